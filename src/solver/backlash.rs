//! Output backlash: unloaded rotation of the carrier between opposite flanks, with wave generator and ring held
//! (docs/explanation/theory.md section 4.11).

use crate::cam::ToothCenter;
use crate::contact::PerContact;
use crate::drive::Drive;
use crate::gaps::{Deviations, Gaps, Modification, Runout};
use crate::load_sharing::LoadCase;
use crate::mesh::{Mesh, Neighbours, Place};
use crate::ring::FlankPoint;
use crate::root::NotConverged;
use crate::{SolveError, Stop};

mod first;
mod pair;

use first::FirstTeeth;
use pair::Pair;

/// Fraction of a lap left out at both ends of a piece. A tooth on a lobe or in a valley there has no lever arm, so
/// limits are used.
const MARGIN: f64 = 1e-9;

/// Number of intervals in a piece. It is even because each cell has two.
const INTERVALS: usize = 32;

/// Backlash at the output: rotation of the carrier from one flank to the other, with wave generator and ring held and
/// without load. It follows from the gaps alone, because the parts are rigid here.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), schema(as = BacklashAnswer))]
#[non_exhaustive]
pub struct Backlash {
    /// Mean over the input angle, in arcmin.
    pub mean_arcmin: f64,
    /// Smallest value over the input angle, in arcmin. Parts interfere if it is below zero.
    pub smallest_arcmin: f64,
    /// Input angle of the smallest value.
    #[cfg_attr(feature = "document", serde(skip))]
    pub smallest_at_deg: f64,
    /// Largest value over the input angle, in arcmin.
    pub largest_arcmin: f64,
    /// Input angle of the largest value.
    #[cfg_attr(feature = "document", serde(skip))]
    pub largest_at_deg: f64,
    /// Contribution of the gaps of each contact to the mean, in arcmin. The sum is the mean.
    pub contribution_arcmin: PerContact<f64>,
}

fn arcmin(rad: f64) -> f64 {
    60.0 * rad.to_degrees()
}

/// Returns the backlash of a drive with these deviations and the gaps of this load case. The torque has no effect.
///
/// ```
/// use toothwave_solver::{
///     Deviations, Drive, DriveParameters, LoadCase, LoadParameters, Never, PerContact, backlash,
/// };
///
/// let drive = Drive::new(&DriveParameters::default()).unwrap();
/// let load = LoadCase::new(&LoadParameters {
///     clearance_um: PerContact { wave_generator: 10.0, ring: 10.0, carrier: 10.0 },
///     ..LoadParameters::default()
/// })
/// .unwrap();
/// let backlash = backlash::of(&drive, &load, &Deviations::default(), &Never).unwrap();
/// assert!((backlash.mean_arcmin - 6.266).abs() < 5e-4);
/// ```
///
/// # Errors
/// [`SolveError::NoToothInMesh`] if no flank is touched at some input angle, [`SolveError::Interference`] if a tooth
/// cannot pass a lobe or a valley, [`SolveError::Impossible`] for deviations or a modification that the drive cannot
/// have.
pub fn of(drive: &Drive, load: &LoadCase, deviations: &Deviations, stop: &dyn Stop) -> Result<Backlash, SolveError> {
    let mirrored = mirrored(deviations);
    let flanks = Flanks::new(drive, load, deviations, &mirrored)?;
    let pieces = flanks.pieces()?;
    let mut found = Found::new();
    for lap in 0..flanks.laps {
        if stop.stopped() {
            return Err(SolveError::Stopped);
        }
        flanks.look(lap, &pieces, &mut found)?;
    }
    let laps = flanks.laps as f64;
    let contribution_rad = PerContact::of(|contact| *found.integral_rad.get(contact) / laps);
    let at = |(laps_passed, backlash_rad): (f64, f64)| (laps_passed * flanks.lap_deg(), arcmin(backlash_rad));
    let (smallest_at_deg, smallest_arcmin) = at(found.smallest);
    let (largest_at_deg, largest_arcmin) = at(found.largest);
    Ok(Backlash {
        mean_arcmin: arcmin(sum(&contribution_rad)),
        smallest_arcmin,
        smallest_at_deg,
        largest_arcmin,
        largest_at_deg,
        contribution_arcmin: PerContact::of(|contact| arcmin(*contribution_rad.get(contact))),
    })
}

/// Returns the backlash at an input angle, see [`of`].
///
/// # Errors
/// The errors of [`of`], except interference.
pub fn arcmin_at(
    drive: &Drive,
    load: &LoadCase,
    deviations: &Deviations,
    input_angle_deg: f64,
) -> Result<f64, SolveError> {
    let mirrored = mirrored(deviations);
    let flanks = Flanks::new(drive, load, deviations, &mirrored)?;
    let laps_passed = (input_angle_deg / flanks.lap_deg()).rem_euclid(flanks.laps as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, far below 2^53")]
    let lap = (laps_passed as u64).min(flanks.laps - 1);
    let fraction = (laps_passed - lap as f64).clamp(MARGIN, 1.0 - MARGIN);
    let first_rad = |side: Side| {
        let fraction = side.fraction(fraction);
        let teeth = flanks.teeth(side.lap(lap, flanks.laps), flanks.places(fraction));
        teeth.iter().try_fold(f64::INFINITY, |first_rad, tooth| {
            let lever = flanks.lever(tooth.spacings, fraction)?;
            Ok::<_, SolveError>(first_rad.min(sum(&flanks.closing_rad(side, tooth, &lever))))
        })
    };
    Ok(arcmin(first_rad(Side::Front)? + first_rad(Side::Behind)?))
}

fn sum(of_contacts: &PerContact<f64>) -> f64 {
    of_contacts.iter().map(|(_, value)| value).sum()
}

/// Returns the deviations of the mirrored drive. Its front flanks are the flanks of this drive behind the lobes.
fn mirrored(deviations: &Deviations) -> Deviations {
    let list = |list: &[f64], sign: f64| {
        let turned = list.iter().take(1).chain(list.iter().skip(1).rev());
        turned.map(|value| sign * value).collect::<Vec<_>>()
    };
    let runout = |runout: &Runout| Runout { angle_deg: -runout.angle_deg, ..*runout };
    Deviations {
        tooth_radius_um: list(&deviations.tooth_radius_um, 1.0),
        slot_angle_arcsec: list(&deviations.slot_angle_arcsec, -1.0),
        slot_wall_um: list(&deviations.slot_wall_um, 1.0),
        ring_space_um: list(&deviations.ring_space_um, 1.0),
        ring_space_angle_arcsec: list(&deviations.ring_space_angle_arcsec, -1.0),
        wave_generator_lobe_um: list(&deviations.wave_generator_lobe_um, 1.0),
        wave_generator_runout: runout(&deviations.wave_generator_runout),
        ring_runout: runout(&deviations.ring_runout),
        carrier_runout: runout(&deviations.carrier_runout),
    }
}

/// Side of the lobes on which the flanks are.
#[derive(Debug, Clone, Copy)]
enum Side {
    /// Flanks that carry if the load holds the wave generator back.
    Front,
    /// Opposite flanks: the front flanks of the mirrored drive at the full repeat minus the input angle.
    Behind,
}

impl Side {
    fn fraction(self, fraction: f64) -> f64 {
        match self {
            Self::Front => fraction,
            Self::Behind => 1.0 - fraction,
        }
    }

    const fn lap(self, lap: u64, laps: u64) -> u64 {
        match self {
            Self::Front => lap,
            Self::Behind => laps - 1 - lap,
        }
    }

    /// Returns the index on this side of an item in a row of `count`.
    const fn index(self, index: usize, count: usize) -> usize {
        match self {
            Self::Front => index,
            Self::Behind => count - 1 - index,
        }
    }
}

/// One tooth on one side during a lap.
#[derive(Debug, Clone, Copy)]
struct Tooth {
    /// Distance from its lobe at the start of the lap, in tooth spacings.
    spacings: u64,
    place: Place,
}

/// Conversion of a tooth's gaps to carrier rotation, and the tooth's position.
#[derive(Debug, Clone, Copy)]
struct Lever {
    center: ToothCenter,
    flank: FlankPoint,
    /// Rotation of the carrier per millimetre of gap.
    rad_per_mm: PerContact<f64>,
}

/// Part of every lap in which no tooth enters or leaves the mesh.
struct Piece {
    nodes: Vec<f64>,
    /// Levers at each node, by spacings from 1 on.
    levers: Vec<Vec<Lever>>,
}

/// Results of the laps evaluated so far.
struct Found {
    integral_rad: PerContact<f64>,
    /// Laps passed, and the backlash at that point.
    smallest: (f64, f64),
    largest: (f64, f64),
}

impl Found {
    fn new() -> Self {
        Self { integral_rad: PerContact::default(), smallest: (0.0, f64::INFINITY), largest: (0.0, f64::NEG_INFINITY) }
    }

    fn see(&mut self, laps_passed: f64, backlash_rad: f64) {
        if backlash_rad < self.smallest.1 {
            self.smallest = (laps_passed, backlash_rad);
        }
        if backlash_rad > self.largest.1 {
            self.largest = (laps_passed, backlash_rad);
        }
    }
}

/// The flanks of a drive on both sides of its lobes.
struct Flanks<'a> {
    drive: &'a Drive,
    mesh: Mesh,
    laps: u64,
    front: Gaps<'a>,
    /// Gaps of the mirrored drive.
    behind: Gaps<'a>,
}

impl<'a> Flanks<'a> {
    fn new(
        drive: &'a Drive,
        load: &LoadCase,
        deviations: &'a Deviations,
        mirrored: &'a Deviations,
    ) -> Result<Self, SolveError> {
        let p = load.parameters();
        let mut violations = p.deviation_violations(drive.parameters(), deviations);
        violations.extend(p.modification.violation_in(drive));
        if !violations.is_empty() {
            return Err(SolveError::Impossible(violations));
        }
        let mesh = deviations.mesh(drive);
        if !mesh.always_carries() {
            return Err(SolveError::NoToothInMesh {
                engagement_start_deg: drive.flank_limit().position.from_lobe_deg(),
                spacing_deg: mesh.spacing_deg(),
            });
        }
        let of_mirrored =
            Modification { carrier_rotation_arcsec: -p.modification.carrier_rotation_arcsec, ..p.modification };
        Ok(Self {
            drive,
            mesh,
            // If all items are alike, so are all laps.
            laps: if mesh.tells_items_apart() { mesh.laps() } else { 1 },
            front: Gaps::new(drive, &p.clearance_um, p.modification, Some(deviations)),
            behind: Gaps::new(drive, &p.clearance_um, of_mirrored, Some(mirrored)),
        })
    }

    fn lap_deg(&self) -> f64 {
        self.mesh.sweep_period_deg() / self.mesh.laps() as f64
    }

    /// Returns the number of spacings from the lobe within which teeth touch the flank.
    fn places(&self, fraction: f64) -> u64 {
        self.mesh.whole_spacings() + u64::from(fraction > self.mesh.entry_fraction())
    }

    /// Returns the teeth of one side in one of its laps, up to `places` spacings from their lobes.
    fn teeth(&self, lap: u64, places: u64) -> Vec<Tooth> {
        if !self.mesh.tells_items_apart() {
            return (1..=places).map(|spacings| Tooth { spacings, place: Place::default() }).collect();
        }
        let mut runs = Vec::new();
        self.mesh.list(places, lap, &mut runs);
        let apart = self.mesh.laps_of_load_period();
        let of_run = |run: &Neighbours| {
            let (first_place, places) = (run.first_place, self.mesh.places_of(run));
            (0..run.count).zip(places).map(move |(tooth, place)| Tooth { spacings: first_place + apart * tooth, place })
        };
        runs.iter().flat_map(of_run).collect()
    }

    fn lever(&self, spacings: u64, fraction: f64) -> Result<Lever, NotConverged> {
        let flank_curve = self.drive.flank();
        let center = flank_curve.locus().at(self.mesh.position_between(spacings, fraction))?;
        let flank = flank_curve.at(&center);
        let (d_mm, k, ratio) = (center.center_radius_mm, flank_curve.teeth_per_wave(), self.drive.teeth_per_wave());
        let ring_arm_mm = d_mm * flank.tan_pressure_angle * flank.cos_pressure_angle;
        let rad_per_mm = PerContact {
            wave_generator: 1.0 / (center.lever_arm_mm * ratio),
            ring: k / (ring_arm_mm * ratio),
            carrier: 1.0 / d_mm,
        };
        Ok(Lever { center, flank, rad_per_mm })
    }

    const fn gaps(&self, side: Side) -> &Gaps<'a> {
        match side {
            Side::Front => &self.front,
            Side::Behind => &self.behind,
        }
    }

    /// Returns the carrier rotation that closes the gaps of a tooth, per contact.
    fn closing_rad(&self, side: Side, tooth: &Tooth, lever: &Lever) -> PerContact<f64> {
        let gap_mm = self.gaps(side).at(&tooth.place, &lever.center, &lever.flank);
        PerContact::of(|contact| gap_mm.get(contact) * lever.rad_per_mm.get(contact))
    }

    /// Returns the pieces of a lap. Those of the mirrored lap are the same in reverse order.
    fn pieces(&self) -> Result<Vec<Piece>, NotConverged> {
        let relief = self.front.modification.ring_tip_relief;
        let relieved = relief.map(|relief| self.mesh.fraction_at_deg(relief.start_deg));
        let cuts = [Some(self.mesh.entry_fraction()), relieved].into_iter().flatten();
        let mut ends: Vec<_> = cuts.flat_map(|cut| [cut, 1.0 - cut]).chain([0.0, 1.0]).collect();
        ends.sort_by(f64::total_cmp);
        let pieces = ends.windows(2).map(|ends| (ends[0] + MARGIN, ends[1] - MARGIN));
        pieces.filter(|(start, end)| end - start > 2.0 * MARGIN).map(|(start, end)| self.piece(start, end)).collect()
    }

    fn piece(&self, start: f64, end: f64) -> Result<Piece, NotConverged> {
        let places = self.places(start.midpoint(end));
        let share = |node: usize| node as f64 / INTERVALS as f64;
        let nodes: Vec<_> = (0..=INTERVALS).map(|node| start * (1.0 - share(node)) + end * share(node)).collect();
        let levers_at = |&fraction: &f64| (1..=places).map(|spacings| self.lever(spacings, fraction)).collect();
        let levers = nodes.iter().map(levers_at).collect::<Result<Vec<Vec<_>>, NotConverged>>()?;
        Ok(Piece { nodes, levers })
    }

    /// Adds the results of a lap to `found`.
    fn look(&self, lap: u64, pieces: &[Piece], found: &mut Found) -> Result<(), SolveError> {
        for (index, Piece { nodes, .. }) in pieces.iter().enumerate() {
            let on = |side: Side| FirstTeeth::new(self, side, lap, nodes, &pieces[side.index(index, pieces.len())]);
            let (front, behind) = (on(Side::Front), on(Side::Behind));
            front.check_lobe_and_valley(lap)?;
            for cell in (0..INTERVALS).step_by(2) {
                let those_behind = behind.stretches(cell)?;
                for ahead in front.stretches(cell)? {
                    for other in &those_behind {
                        let (start, end) = (ahead.start.max(other.start), ahead.end.min(other.end));
                        if start < end {
                            let teeth = [ahead.tooth, other.tooth];
                            Pair { front: &front, behind: &behind, teeth, lap }.integrate(start, end, found)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }
}
