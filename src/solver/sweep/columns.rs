//! Result of a sweep: columns of states and input angles, peaks, capacity, and the checks that it has to pass.

use crate::SolveError;
use crate::contact::{Contact, Materials, PerContact, SHEAR_DEPTH, SHEAR_SHARE, half_width_mm};
use crate::drive::Drive;
use crate::load_sharing::LoadedDrive;
use crate::mesh::{Mesh, TeethInMesh};
use crate::root::NotConverged;
use crate::springs::WindUp;
use crate::sweep::limited_by::LimitedBy;
use crate::sweep::points::Points;
use crate::tooth::point::ShearBelow;
use crate::tooth::{Pressure, StressExponents};

/// Largest allowed residual of torque balance (share of the torque) and of period closure (share of a peak). It is
/// about ten thousand times the rounding error of the worst known design.
const MOST_RESIDUAL: f64 = 1e-9;

/// Expected torques: `M0` at the wave generator, `M0 Z_K/U` at the ring, `M0 Z_G/U` at the carrier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueBalance {
    per_nmm: PerContact<f64>,
}

impl TorqueBalance {
    /// Returns the torques of a drive under an input torque.
    pub fn new(drive: &Drive, input_torque_nmm: f64) -> Self {
        let per_nmm = PerContact {
            wave_generator: 1.0 / input_torque_nmm,
            ring: 1.0 / (input_torque_nmm * drive.flank().teeth_per_wave()),
            carrier: 1.0 / (input_torque_nmm * drive.teeth_per_wave()),
        };
        Self { per_nmm }
    }

    /// Returns the largest relative deviation of computed torques; NaN if one of them is NaN.
    #[inline(always)]
    pub fn residual(&self, torque_nmm: &PerContact<f64>) -> f64 {
        let off_cam = (torque_nmm.wave_generator * self.per_nmm.wave_generator - 1.0).abs();
        let off_ring = (torque_nmm.ring * self.per_nmm.ring - 1.0).abs();
        let off_carrier = (torque_nmm.carrier * self.per_nmm.carrier - 1.0).abs();
        let most = if off_ring > off_carrier { off_ring } else { off_carrier };
        let most = if off_cam > most { off_cam } else { most };
        let all = off_cam + off_ring + off_carrier;
        if all.is_nan() { all } else { most }
    }
}

/// Returns the larger of a residual and the earlier ones. NaN counts as the largest.
#[inline(always)]
pub(crate) fn worse(residual: f64, before: f64) -> f64 {
    if residual.is_nan() || residual > before { residual } else { before }
}

/// States of a sweep, by input angle and then tooth number: columns of equal length with one entry for each state. If
/// the zones are alike, the teeth of one zone represent all. Otherwise the teeth of all zones are listed ([`Mesh`]).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct States {
    /// Input angle j, in deg.
    pub input_angle_deg: Vec<f64>,
    /// Tooth number. Tooth 0 is in the middle of a lobe at j = 0.
    pub tooth: Vec<u32>,
    /// Lobe of the tooth; empty if the zones are alike.
    pub lobe: Vec<u32>,
    /// Position ψ from the middle of the lobe, in deg.
    pub position_deg: Vec<f64>,
    /// Distance `d` of the tooth's centre from the axis, in mm.
    pub center_radius_mm: Vec<f64>,
    /// φ_H: angle of the contact point on the cam from the valley, in deg.
    pub wave_generator_angle_deg: Vec<f64>,
    /// φ_K: angle of the contact point on the ring from the tip of the ring's tooth, in deg.
    pub ring_angle_deg: Vec<f64>,
    /// Contact forces `F_H`, `F_K`, `F_S`, in N.
    pub force_n: PerContact<Vec<f64>>,
    /// Hertz stresses `σ_H`, `σ_K`, `σ_S`, in MPa.
    pub stress_mpa: PerContact<Vec<f64>>,
}

/// Quantities of all teeth together at an input angle: columns of equal length with one entry for each input angle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InputAngles {
    /// Input angle j, in deg.
    pub input_angle_deg: Vec<f64>,
    /// Wind-up `Δφ`: rotation of the wave generator under the load, clearances included, in deg.
    pub wind_up_deg: Vec<f64>,
    /// Torsional stiffness `(Z_G/U)² dM0/dΔφ`: output torque over output rotation, input held, at the load.
    pub torsional_stiffness_nm_per_rad: Vec<f64>,
    /// Number of listed teeth that carry load.
    pub loaded_teeth: Vec<u32>,
}

/// Largest value of a column, and the state in which it occurs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct Peak {
    /// The value, in the unit of the field that holds the peak.
    pub value: f64,
    /// Input angle of the state.
    pub input_angle_deg: f64,
    /// Position of the tooth, from the middle of its lobe.
    pub position_deg: f64,
}

/// Peaks of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPeaks {
    /// Peak of the force, in N.
    pub force_n: Peak,
    /// Peak of the stress, in MPa.
    pub stress_mpa: Peak,
    /// Half the width of the contact in the plane of motion at the stress peak, in mm.
    pub half_width_mm: f64,
    /// Half the length of a contact ellipse along the axis at the stress peak, in mm.
    pub half_length_mm: Option<f64>,
    /// Largest shear stress below the surface at the stress peak, and its depth. None for a flat, whose edges are not
    /// modelled.
    pub shear: Option<PeakShear>,
}

impl ContactPeaks {
    /// Returns the peaks of a line contact with force `force_n` at its stress peak.
    pub(crate) fn of_line(force_peak_n: Peak, stress_peak_mpa: Peak, force_n: f64, tooth_width_mm: f64) -> Self {
        let half_width_mm = half_width_mm(force_n, stress_peak_mpa.value, tooth_width_mm);
        Self {
            force_n: force_peak_n,
            stress_mpa: stress_peak_mpa,
            half_width_mm,
            half_length_mm: None,
            shear: Some(PeakShear {
                stress_mpa: SHEAR_SHARE * stress_peak_mpa.value,
                depth_mm: SHEAR_DEPTH * half_width_mm,
            }),
        }
    }
}

impl ContactPeaks {
    /// Returns these peaks with the data of a contact of this pressure model and force `force_n` at its stress peak.
    pub(crate) fn of_pressure(
        self,
        pressure: &Pressure,
        force_n: f64,
        materials: &Materials,
        contact: Contact,
    ) -> Self {
        match pressure {
            Pressure::Line { .. } | Pressure::Corner(_) => self,
            Pressure::Flat(flat) => Self { half_width_mm: 0.5 * flat.length_mm(), shear: None, ..self },
            Pressure::Ellipse(ellipse) => {
                let half_width_mm = ellipse.half_width_mm(force_n);
                let half_length_mm = ellipse.half_length_mm(force_n);
                let shear = |poissons_ratio: f64| {
                    let ShearBelow { share, depth } = ellipse.shear_below(poissons_ratio);
                    PeakShear {
                        stress_mpa: share * self.stress_mpa.value,
                        depth_mm: depth * half_width_mm.min(half_length_mm),
                    }
                };
                // The larger of the values in the two bodies.
                let [tooth, partner] = [&materials.teeth, materials.partner(contact)].map(|body| body.poissons_ratio);
                let (of_tooth, are_alike) = (shear(tooth), partner.to_bits() == tooth.to_bits());
                let of_partner = if are_alike { of_tooth } else { shear(partner) };
                let shear = if of_partner.stress_mpa > of_tooth.stress_mpa { of_partner } else { of_tooth };
                Self { half_width_mm, half_length_mm: Some(half_length_mm), shear: Some(shear), ..self }
            }
        }
    }
}

/// Largest shear stress below the surface of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakShear {
    /// Shear stress, in MPa.
    pub stress_mpa: f64,
    /// Depth below the surface, in mm.
    pub depth_mm: f64,
}

/// Torque capacity and the contact that limits it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema))]
pub struct TorqueCapacity {
    /// Largest torque at the wave generator under which no contact exceeds its allowable stress and no finger of the
    /// carrier its strength, in N·m.
    pub input_torque_nm: f64,
    /// The corresponding torque at the carrier, in N·m.
    pub output_torque_nm: f64,
    /// What limits it; where `turns_past_teeth`, the contact that is nearest to its allowable stress.
    pub limited_by: LimitedBy,
    /// True if no contact reaches its allowable stress under any torque that the teeth carry. Beyond this torque the wave
    /// generator would turn past its teeth.
    /// Left out where it does not.
    #[cfg_attr(feature = "document", serde(skip_serializing_if = "std::ops::Not::not"))]
    pub turns_past_teeth: bool,
    /// The input angle where it is so.
    pub input_angle_deg: f64,
}

impl TorqueCapacity {
    /// Returns the capacity if all loads are proportional: for line contacts `M0 min (σ_a/σ)²`.
    pub(crate) fn in_proportion(
        drive: &Drive,
        input_torque_nm: f64,
        allowable_mpa: &PerContact<f64>,
        peaks: &PerContact<ContactPeaks>,
        stress_exponents: StressExponents,
    ) -> Self {
        let share_of = |contact| {
            stress_exponents.raised_at(contact, allowable_mpa.get(contact) / peaks.get(contact).stress_mpa.value)
        };
        let (contact, share) = [Contact::Ring, Contact::Carrier]
            .map(|contact| (contact, share_of(contact)))
            .into_iter()
            .fold((Contact::WaveGenerator, share_of(Contact::WaveGenerator)), |least, other| {
                if other.1 < least.1 { other } else { least }
            });
        let peak = peaks.get(contact).stress_mpa;
        let input_torque_nm = input_torque_nm * share;
        let output_torque_nm = input_torque_nm * drive.teeth_per_wave();
        let input_angle_deg = peak.input_angle_deg;
        Self { input_torque_nm, output_torque_nm, limited_by: contact.into(), turns_past_teeth: false, input_angle_deg }
    }
}

/// A sweep over one period. If items deviate, it covers the load periods after which all items are back in their
/// positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Mesh of the sweep.
    pub mesh: Mesh,
    /// States of the teeth.
    pub states: States,
    /// Quantities at each input angle.
    pub input_angles: InputAngles,
    /// Peaks over the states.
    pub peaks: PerContact<ContactPeaks>,
    /// The torque capacity, given an allowable stress.
    pub torque_capacity: Option<TorqueCapacity>,
    /// Largest relative deviation of the input, ring and carrier torques from `M0`, `M0 Z_K/U`, `M0 Z_G/U`.
    pub torque_balance_residual: f64,
    /// Largest difference of a force or stress at the last input angle from its independent recalculation, over the
    /// peak.
    pub period_closure_residual: f64,
}

/// Summary of a sweep without its states, for searches over millions of drives.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPeaks {
    /// Peaks over the states.
    pub contacts: PerContact<ContactPeaks>,
    /// Range of the wind-up `Δφ` over the input angles, in deg.
    pub wind_up_deg: Extremes,
    /// Range of the output torsional stiffness over the input angles.
    pub torsional_stiffness_nm_per_rad: Extremes,
    /// Number of listed teeth that carry load.
    pub loaded_teeth: TeethInMesh,
    /// The torque capacity, given an allowable stress.
    pub torque_capacity: Option<TorqueCapacity>,
    /// Largest relative deviation of the input, ring and carrier torques from `M0`, `M0 Z_K/U`, `M0 Z_G/U`.
    pub torque_balance_residual: f64,
}

/// Least and largest value of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub largest: f64,
}

impl Extremes {
    /// Extremes of no values.
    pub(crate) const NONE: Self = Self { least: f64::INFINITY, largest: f64::NEG_INFINITY };

    /// Returns the extremes of a column.
    pub fn of(column: &[f64]) -> Self {
        column.iter().fold(Self::NONE, |seen, &value| seen.with(value))
    }

    #[inline(always)]
    pub(crate) fn with(self, value: f64) -> Self {
        Self { least: self.least.min(value), largest: self.largest.max(value) }
    }
}

/// Running extremes over the input angles so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AngleExtremes {
    wind_up_deg: Extremes,
    torsional_stiffness_nm_per_rad: Extremes,
    loaded_teeth: Option<TeethInMesh>,
}

impl AngleExtremes {
    pub(crate) const NONE: Self =
        Self { wind_up_deg: Extremes::NONE, torsional_stiffness_nm_per_rad: Extremes::NONE, loaded_teeth: None };

    /// Adds an input angle.
    #[inline(always)]
    pub(crate) fn see(&mut self, wind_up_deg: f64, torsional_stiffness_nm_per_rad: f64, loaded_teeth: u64) {
        self.wind_up_deg = self.wind_up_deg.with(wind_up_deg);
        self.torsional_stiffness_nm_per_rad = self.torsional_stiffness_nm_per_rad.with(torsional_stiffness_nm_per_rad);
        let TeethInMesh { min, max } =
            self.loaded_teeth.unwrap_or(TeethInMesh { min: loaded_teeth, max: loaded_teeth });
        self.loaded_teeth = Some(TeethInMesh { min: min.min(loaded_teeth), max: max.max(loaded_teeth) });
    }

    /// Returns the summary, given the peaks of each contact.
    pub(crate) fn peaks(
        self,
        contacts: PerContact<ContactPeaks>,
        torque_capacity: Option<TorqueCapacity>,
        torque_balance_residual: f64,
    ) -> SweepPeaks {
        SweepPeaks {
            contacts,
            wind_up_deg: self.wind_up_deg,
            torsional_stiffness_nm_per_rad: self.torsional_stiffness_nm_per_rad,
            loaded_teeth: self.loaded_teeth.unwrap_or(TeethInMesh { min: 0, max: 0 }),
            torque_capacity,
            torque_balance_residual,
        }
    }
}

impl SweepPeaks {
    /// Returns the transmission error under load, peak to peak: the range of the wind-up, referred to the output.
    pub fn transmission_error_peak_to_peak_deg(&self, drive: &Drive) -> f64 {
        (self.wind_up_deg.largest - self.wind_up_deg.least) / drive.teeth_per_wave()
    }
}

impl From<&Sweep> for SweepPeaks {
    fn from(sweep: &Sweep) -> Self {
        Self {
            contacts: sweep.peaks,
            wind_up_deg: Extremes::of(&sweep.input_angles.wind_up_deg),
            torsional_stiffness_nm_per_rad: Extremes::of(&sweep.input_angles.torsional_stiffness_nm_per_rad),
            loaded_teeth: sweep.loaded_teeth(),
            torque_capacity: sweep.torque_capacity,
            torque_balance_residual: sweep.torque_balance_residual,
        }
    }
}

impl Sweep {
    /// Returns the transmission error under load, peak to peak: the range of the wind-up, referred to the output.
    pub fn transmission_error_peak_to_peak_deg(&self, drive: &Drive) -> f64 {
        let wind_up_deg = self.input_angles.wind_up_deg.iter().copied();
        let most = wind_up_deg.clone().fold(f64::NEG_INFINITY, f64::max);
        (most - wind_up_deg.fold(f64::INFINITY, f64::min)) / drive.teeth_per_wave()
    }

    /// Returns the least and the largest number of teeth in a zone that are in mesh with their gaps closed.
    pub fn loaded_teeth(&self) -> TeethInMesh {
        let teeth = self.input_angles.loaded_teeth.iter().map(|&teeth| u64::from(teeth));
        TeethInMesh { min: teeth.clone().min().unwrap_or(0), max: teeth.max().unwrap_or(0) }
    }
}

impl States {
    pub(crate) fn with_capacity(count: usize) -> Self {
        let column = || Vec::with_capacity(count);
        Self {
            input_angle_deg: column(),
            tooth: Vec::with_capacity(count),
            lobe: Vec::new(),
            position_deg: column(),
            center_radius_mm: column(),
            wave_generator_angle_deg: column(),
            ring_angle_deg: column(),
            force_n: PerContact::of(|_| column()),
            stress_mpa: PerContact::of(|_| column()),
        }
    }

    /// Returns columns of zeros with the teeth of all zones, to be filled in.
    pub(crate) fn of_zeros(count: usize) -> Self {
        let column = || vec![0.0; count];
        Self {
            input_angle_deg: column(),
            tooth: vec![0; count],
            lobe: vec![0; count],
            position_deg: column(),
            center_radius_mm: column(),
            wave_generator_angle_deg: column(),
            ring_angle_deg: column(),
            force_n: PerContact::of(|_| column()),
            stress_mpa: PerContact::of(|_| column()),
        }
    }

    /// Returns the number of states.
    pub fn len(&self) -> usize {
        self.tooth.len()
    }

    /// Returns true if there is no state.
    pub fn is_empty(&self) -> bool {
        self.tooth.is_empty()
    }

    pub(crate) fn peak(&self, column: &[f64], at: usize) -> Peak {
        Peak { value: column[at], input_angle_deg: self.input_angle_deg[at], position_deg: self.position_deg[at] }
    }
}

/// Indices of the states with the peaks of a contact's force and stress.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PeakAt {
    pub(crate) force: usize,
    pub(crate) stress: usize,
}

impl InputAngles {
    pub(crate) fn with_capacity(count: usize) -> Self {
        let column = || Vec::with_capacity(count);
        Self {
            input_angle_deg: column(),
            wind_up_deg: column(),
            torsional_stiffness_nm_per_rad: column(),
            loaded_teeth: Vec::with_capacity(count),
        }
    }

    /// Returns columns of zeros, to be filled in.
    pub(crate) fn of_zeros(count: usize) -> Self {
        let column = || vec![0.0; count];
        Self {
            input_angle_deg: column(),
            wind_up_deg: column(),
            torsional_stiffness_nm_per_rad: column(),
            loaded_teeth: vec![0; count],
        }
    }

    /// Returns the torsional stiffness at the output for `dM0/dΔφ`.
    #[inline(always)]
    pub(crate) fn of_output(drive: &Drive, stiffness_nmm_per_rad: f64) -> f64 {
        let torque_ratio = drive.teeth_per_wave();
        1e-3 * stiffness_nmm_per_rad * torque_ratio * torque_ratio
    }

    /// Appends an input angle. The stiffness `dM0/dΔφ` is converted to that at the output.
    pub(crate) fn push(&mut self, drive: &Drive, input_angle_deg: f64, wind_up: &WindUp, loaded_teeth: usize) {
        let stiffness = std::iter::once(wind_up.stiffness_nmm_per_rad);
        self.extend(drive, &[input_angle_deg], &[wind_up.rotation_rad()], stiffness, std::iter::once(loaded_teeth));
    }

    /// Appends several input angles.
    #[inline(always)]
    pub(crate) fn extend(
        &mut self,
        drive: &Drive,
        input_angle_deg: &[f64],
        rotation_rad: &[f64],
        stiffness_nmm_per_rad: impl Iterator<Item = f64>,
        loaded_teeth: impl Iterator<Item = usize>,
    ) {
        self.input_angle_deg.extend_from_slice(input_angle_deg);
        self.wind_up_deg.extend(rotation_rad.iter().map(|rotation_rad| rotation_rad.to_degrees()));
        let of_output = |stiffness| Self::of_output(drive, stiffness);
        self.torsional_stiffness_nm_per_rad.extend(stiffness_nmm_per_rad.map(of_output));
        self.loaded_teeth.extend(loaded_teeth.map(|teeth| u32::try_from(teeth).unwrap_or(u32::MAX)));
    }

    /// Appends the first input angle again, one period later.
    pub(crate) fn repeat_first(&mut self, input_angle_deg: f64) {
        self.input_angle_deg.push(input_angle_deg);
        self.wind_up_deg.push(self.wind_up_deg[0]);
        self.torsional_stiffness_nm_per_rad.push(self.torsional_stiffness_nm_per_rad[0]);
        self.loaded_teeth.push(self.loaded_teeth[0]);
    }
}
/// Result of both the plain and the fast path.
pub(crate) struct Columns {
    pub(crate) states: States,
    pub(crate) input_angles: InputAngles,
    pub(crate) peaks: PerContact<PeakAt>,
    pub(crate) torque_balance_residual: f64,
}

/// Returns a sweep with its peaks and closure, or an error if a check fails.
pub(crate) fn finished(
    loaded: &LoadedDrive<'_>,
    points: Points,
    columns: Columns,
    torque_capacity: Option<TorqueCapacity>,
) -> Result<Sweep, SolveError> {
    let Columns { states, input_angles, peaks, torque_balance_residual } = columns;
    let tooth_width_mm = loaded.drive().tooth_width_mm();
    let peaks = PerContact::of(|contact| {
        let (force, at) = (states.force_n.get(contact), peaks.get(contact));
        let stress_mpa = states.peak(states.stress_mpa.get(contact), at.stress);
        ContactPeaks::of_line(states.peak(force, at.force), stress_mpa, force[at.stress], tooth_width_mm)
    });
    let mut period_closure_residual = period_closure(loaded, points, &states, &peaks)?;
    if loaded.mesh().tells_items_apart() {
        // The wind-up shows whether all items are back in their positions.
        let wind_up_deg = &input_angles.wind_up_deg;
        let ends_deg = [wind_up_deg.first(), wind_up_deg.last()].map(|end| end.copied().unwrap_or(f64::NAN));
        let [first_deg, last_deg] = ends_deg;
        period_closure_residual = worse((last_deg - first_deg).abs() / last_deg, period_closure_residual);
    }
    check("torque balance", torque_balance_residual)?;
    // Light loads across wide gaps, or at corners, keep fewer digits. The residual in the answer shows how many.
    if let Err(inconsistent) = check("period closure", period_closure_residual) {
        let of_rounding = ROUNDINGS * f64::EPSILON * input_angles.amplification(loaded)?;
        if period_closure_residual.is_nan() || period_closure_residual > of_rounding {
            return Err(inconsistent);
        }
    }
    let mesh = *loaded.mesh();
    Ok(Sweep { mesh, states, input_angles, peaks, torque_capacity, torque_balance_residual, period_closure_residual })
}

/// Number of rounding errors of closing angles by which two paths to the same loads may differ.
const ROUNDINGS: f64 = 32.0;

impl InputAngles {
    /// Returns the largest amplification of a relative error of a closing angle in the rotation beyond it: `Δφ K/M0`,
    /// about 1 without gaps. The gap of a tooth at a corner is a difference of two distances and has their rounding
    /// error.
    fn amplification(&self, loaded: &LoadedDrive<'_>) -> Result<f64, NotConverged> {
        let ratio = loaded.drive().teeth_per_wave();
        let per_torque = 1e3 / (loaded.input_torque_nmm() * ratio * ratio);
        let to_corner_rad = loaded.distance_at_corner_rad()?;
        let angles = self.wind_up_deg.iter().zip(&self.torsional_stiffness_nm_per_rad);
        let beyond = |(wind_up_deg, stiffness): (&f64, &f64)| {
            wind_up_deg.to_radians().max(to_corner_rad) * stiffness * per_torque
        };
        Ok(angles.map(beyond).fold(1.0, f64::max))
    }
}

/// Checks that a residual is only rounding.
pub(crate) fn check(check: &'static str, residual: f64) -> Result<(), SolveError> {
    if residual.is_nan() || residual > MOST_RESIDUAL {
        return Err(SolveError::Inconsistent { check, residual });
    }
    Ok(())
}

/// Returns the largest difference of a load at the last input angle from its recalculation. The recalculation is state
/// by state and finds positions by the other method: by angles if the sweep uses whole numbers, and vice versa.
fn period_closure(
    loaded: &LoadedDrive<'_>,
    points: Points,
    states: &States,
    peaks: &PerContact<ContactPeaks>,
) -> Result<f64, SolveError> {
    let mesh = *loaded.mesh();
    let position = |place| match points {
        Points::Samples(_) => mesh.position_between(place, 1.0),
        Points::Tolerance(_) => mesh.position_after_lap(place),
    };
    let placed: Vec<_> = mesh.placed_between(2..=mesh.whole_spacings() + 1, mesh.laps() - 1, position).collect();
    let teeth = placed.iter().map(|placed| loaded.tooth_at(&placed.place, placed.position));
    let teeth = teeth.collect::<Result<Vec<_>, _>>()?;
    let wind_up = loaded.wind_up(&teeth)?;
    let last_angle_deg = states.input_angle_deg.last();
    let first = states.len().checked_sub(teeth.len());
    let Some(first) = first.filter(|&first| states.input_angle_deg.get(first) == last_angle_deg) else {
        return Ok(f64::INFINITY);
    };
    let mut residual = 0.0;
    for ((state, placed), tooth) in (first..).zip(&placed).zip(&teeth) {
        if u64::from(states.tooth[state]) != placed.number {
            return Ok(f64::INFINITY);
        }
        let loads = loaded.loads(tooth, &wind_up)?;
        for ((contact, peaks), (force_n, stress_mpa)) in peaks.iter().zip(loads[..3].iter().zip(&loads[3..])) {
            // If only corners press the teeth, there is no stress at the ring.
            let off = |found: f64, anew: f64, peak: f64| {
                let off = (found - anew).abs();
                if off > 0.0 { off / peak } else { off }
            };
            let off_force = off(states.force_n.get(contact)[state], *force_n, peaks.force_n.value);
            let off_stress = off(states.stress_mpa.get(contact)[state], *stress_mpa, peaks.stress_mpa.value);
            residual = worse(off_stress, worse(off_force, residual));
        }
    }
    Ok(residual)
}
