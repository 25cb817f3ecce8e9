//! Friction losses: slip, power, efficiency (docs/explanation/theory.md section 10). The modules below contain wear,
//! bearing load and life, and duty.
//!
//! Friction is of first order in its coefficients: the normal forces are those without friction. The loss is their
//! friction power at the kinematic slip. The difference to an exact equilibrium was measured, see
//! [`Friction::first_order_error`].
//!
//! All quantities are per radian of the wave generator *relative to the carrier*, whichever member is fixed. The fixed
//! member enters in [`Mechanism::loss_share`] and [`Mechanism::turning_rad_per_s`].

pub mod bearing;
pub mod duty;
mod friction;
pub mod period;
pub mod wear;

use std::f64::consts::PI;

use crate::cam::ToothCenter;
use crate::contact::{Contact, PerContact};
use crate::drive::{Drive, ToothShape};
use crate::mesh::Mesh;
use crate::ring::FlankPoint;

pub use friction::{
    FirstOrderError, Friction, FrictionParameters, MEASURED_TO, MEASURED_TO_ALONG_CAM, RaceBearing,
    WaveGeneratorFriction,
};

/// A drive and the mesh that lists its teeth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanism {
    /// The drive.
    pub drive: Drive,
    /// The mesh. If items deviate it lists all teeth, and no two lobes carry the same load.
    pub mesh: Mesh,
    /// True if a tooth can spin about its own axis. A flat-sided tooth cannot.
    pub tooth_spins: bool,
}

/// Tooth in mesh and its loads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadedTooth {
    /// Index of the lobe, counted from 0 in the direction of ψ.
    pub lobe: u32,
    /// Centre of the tooth and its contact with the cam.
    pub center: ToothCenter,
    /// Contact with the ring.
    pub flank: FlankPoint,
    /// True if that contact is the corner of the ring's tip, which the tooth touches before it reaches the flank.
    pub is_at_corner: bool,
    /// `F_H`, `F_K`, `F_S` without friction.
    pub force_n: PerContact<f64>,
}

/// Slip of a tooth on the parts that it touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToothSlip {
    /// `v_c`: slip of the tooth's surface against the part's, along the counter-clockwise tangent; exactly 0 where it rolls.
    pub slip_mm_per_rad: PerContact<f64>,
    /// The rolling contact. None if the tooth cannot spin or carries no load.
    pub rolls: Option<Contact>,
}

/// Friction at one input angle.
#[derive(Debug, Clone, PartialEq)]
pub struct Turning {
    /// Slip of each tooth.
    pub teeth: Vec<ToothSlip>,
    /// `v_R`: speed of the race along the cam relative to the cam's rotation; 0 without a race. Divided by `R_race` it
    /// is the bearing's speed divided by that of the wave generator relative to the carrier. It is near 1, since the
    /// race is nearly at rest relative to the carrier.
    pub race_mm_per_rad: f64,
    /// Power lost at each contact, summed over all teeth of all zones.
    pub work_nmm_per_rad: PerContact<f64>,
    /// `D |v_R|`: power lost in the bearing.
    pub bearing_work_nmm_per_rad: f64,
}

/// The fixed member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fixed {
    /// The wave generator drives the carrier.
    Ring,
    /// The wave generator drives the ring.
    Carrier,
    /// The ring drives the carrier.
    WaveGenerator,
}

/// Output power divided by input power with one member fixed, for a given torque at the driven end. In an answer the
/// ring is fixed, and the fields are named after it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "document",
    derive(serde::Serialize, utoipa::ToSchema),
    schema(description = "Efficiencies with the ring fixed, the torque at the driven end given.")
)]
pub struct Efficiencies<T> {
    /// In the direction that the variant of [`Fixed`] describes.
    #[cfg_attr(feature = "document", serde(rename = "ring_fixed"))]
    pub driven: T,
    /// If the drive is back-driven. At or below 0 it is self-locking. A negative value is the extra power required from
    /// the other end, relative to the load's power.
    #[cfg_attr(feature = "document", serde(rename = "ring_fixed_back_driven"))]
    pub back_driven: T,
}

impl Mechanism {
    /// Returns the mechanism of a drive whose items are all alike.
    pub fn of(drive: &Drive) -> Self {
        let tooth_spins = !matches!(drive.parameters().tooth, ToothShape::FlatSided { .. });
        Self { drive: *drive, mesh: Mesh::new(drive), tooth_spins }
    }

    /// Returns `R_race`: speed of a race along the cam over its turning.
    pub fn race_radius_mm(&self) -> f64 {
        let p = self.drive.parameters();
        p.wave_generator.race_radius_mm(p.tooth_radius_mm)
    }

    /// Returns `g = gcd(U, Z'_G)`, the number of lobes that carry the same load; 1 if items deviate.
    fn lobes_loaded_alike(&self) -> u64 {
        if self.mesh.tells_items_apart() { 1 } else { self.mesh.lobes_loaded_alike() }
    }

    /// Returns `Z_G`, `Z_K` and `U`.
    fn counts(&self) -> [f64; 3] {
        let p = self.drive.parameters();
        [p.teeth as f64, p.ring_teeth as f64, f64::from(self.drive.lobes())]
    }

    /// Returns the speed ratio of driving to driven member, both relative to the fixed one: `s Z_G/U`, `-s Z_K/U`,
    /// `Z_G/Z_K`. Without losses it is also the ratio of output to input torque.
    pub fn speed_ratio(&self, fixed: Fixed) -> f64 {
        let [teeth, ring_teeth, _] = self.counts();
        match fixed {
            Fixed::Ring => self.drive.transmission_ratio(),
            Fixed::Carrier => self.drive.transmission_ratio_carrier_fixed(),
            Fixed::WaveGenerator => teeth / ring_teeth,
        }
    }

    /// Returns the torque on the fixed member divided by the input torque, positive in its direction: output minus
    /// input.
    pub fn holding_torque_ratio(&self, fixed: Fixed) -> f64 {
        // Whole numbers of teeth avoid cancellation.
        let ([teeth, ring_teeth, lobes], s) = (self.counts(), self.drive.sense());
        match fixed {
            Fixed::Ring => s * (ring_teeth / lobes),
            Fixed::Carrier => -s * (teeth / lobes),
            Fixed::WaveGenerator => s * (lobes / ring_teeth),
        }
    }

    /// Returns the loss divided by the power at the driven end, `ℓ`, from the loss ratio ν: `ν Z_K/Z_G`, `ν`, `ν
    /// U/Z_G`.
    pub fn loss_share(&self, fixed: Fixed, loss_ratio: f64) -> f64 {
        let [teeth, ring_teeth, lobes] = self.counts();
        let turns = match fixed {
            Fixed::Ring => ring_teeth,
            Fixed::Carrier => teeth,
            Fixed::WaveGenerator => lobes,
        };
        loss_ratio * (turns / teeth)
    }

    /// Returns the efficiencies `1/(1 + ℓ)` and `1 - ℓ` at a loss ratio ν. Over a period, use the mean ν.
    pub fn efficiency(&self, fixed: Fixed, loss_ratio: f64) -> Efficiencies<f64> {
        let loss_share = self.loss_share(fixed, loss_ratio);
        Efficiencies { driven: 1.0 / (1.0 + loss_share), back_driven: 1.0 - loss_share }
    }

    /// Returns `|ω_HS|`, the speed of the wave generator relative to the carrier with the ring fixed: `|ω_H| Z_K/Z_G`.
    pub fn turning_rad_per_s(&self, input_speed_rpm: f64) -> f64 {
        let [teeth, ring_teeth, _] = self.counts();
        input_speed_rpm * (2.0 * PI / 60.0) * (ring_teeth / teeth)
    }

    /// Returns the slips of a tooth that does not spin: `a_H = d/cos γ - r`, `a_K = s(d/cos β + r)/k`, at a corner `s(d
    /// tan γ sin β + (d cos β + ℓ)/k)`, and `a_S = -s d tan β/k`.
    fn slip_without_spin_mm_per_rad(&self, tooth: &LoadedTooth) -> PerContact<f64> {
        let drive = &self.drive;
        let (k, s, r) = (drive.flank().teeth_per_wave(), drive.sense(), drive.parameters().tooth_radius_mm);
        let (d, t) = (tooth.center.center_radius_mm, tooth.center.tan_pressure_angle);
        let FlankPoint { distance_mm, tan_pressure_angle, cos_pressure_angle: cos, .. } = tooth.flank;
        let on_ring = if tooth.is_at_corner {
            d * t * tan_pressure_angle * cos + (d * cos + distance_mm) / k
        } else {
            (d * secant(k * t) + r) / k
        };
        PerContact {
            wave_generator: d * secant(t) - r,
            ring: s * on_ring,
            // tan β = k tan γ
            carrier: -s * d * t,
        }
    }

    /// Returns the friction at these teeth: all teeth in mesh, of one zone if zones are alike. At least one carries
    /// load, away from both ends of its mesh.
    pub fn turning(&self, friction: &Friction, teeth: &[LoadedTooth]) -> Turning {
        let slips: Vec<_> = teeth.iter().map(|tooth| self.slip_without_spin_mm_per_rad(tooth)).collect();
        let race_mm_per_rad = self.race_mm_per_rad(friction, teeth, &slips);
        let zones = self.mesh.zones_in_torque();
        let (mut work, mut load_n) = (PerContact::default(), 0.0);
        let mut slipping = Vec::with_capacity(teeth.len());
        for (tooth, slip) in teeth.iter().zip(&slips) {
            let on_race = PerContact { wave_generator: slip.wave_generator - race_mm_per_rad, ..*slip };
            let limit_n = friction.limit_n(&tooth.force_n);
            let slip = self.least_slip(&on_race, &limit_n);
            let taken = |contact| zones * limit_n.get(contact) * slip.slip_mm_per_rad.get(contact).abs();
            work = PerContact::of(|contact| work.get(contact) + taken(contact));
            load_n += zones * tooth.force_n.wave_generator;
            slipping.push(slip);
        }
        Turning {
            teeth: slipping,
            race_mm_per_rad,
            work_nmm_per_rad: work,
            bearing_work_nmm_per_rad: friction
                .bearing()
                .map_or(0.0, |bearing| bearing.drag_n(load_n, self.race_radius_mm()) * race_mm_per_rad.abs()),
        }
    }

    /// Returns the spin at which a tooth loses least; its moments balance there. `-rω` is the median of the slips,
    /// weighted by `μ_c F_c`. The contact of the median therefore rolls.
    fn least_slip(&self, slip: &PerContact<f64>, limit_n: &PerContact<f64>) -> ToothSlip {
        let rolls = if self.tooth_spins {
            let weighted = |of| Weighted { place: *slip.get(of), weight: *limit_n.get(of), of };
            let mut places = Contact::all().map(weighted);
            weighted_median(&mut places).map(|median| median.of)
        } else {
            None
        };
        let spin_mm_per_rad = rolls.map_or(0.0, |contact| *slip.get(contact));
        ToothSlip { slip_mm_per_rad: PerContact::of(|contact| slip.get(contact) - spin_mm_per_rad), rolls }
    }

    /// Returns `v_R`, the race speed that minimizes the loss `Σ min_ω Σ μ_c F_c |v_c| + D |v_R|`. Each tooth's part is
    /// convex and piecewise linear. Its slope changes where its contact with the race would roll together with another
    /// contact, at `a_H - a_K` and `a_H - a_S`. The minimum is therefore at a weighted median of these points and of 0.
    fn race_mm_per_rad(&self, friction: &Friction, teeth: &[LoadedTooth], slips: &[PerContact<f64>]) -> f64 {
        let bearing = match friction.0.wave_generator {
            WaveGeneratorFriction::Plain { .. } => return 0.0,
            WaveGeneratorFriction::Rolling { .. } => return self.race_radius_mm(),
            WaveGeneratorFriction::Race { bearing, .. } => bearing,
        };
        let load_n: f64 = teeth.iter().map(|tooth| tooth.force_n.wave_generator).sum();
        let drag = Weighted { place: 0.0, weight: bearing.drag_n(load_n, self.race_radius_mm()), of: () };
        let of_teeth = teeth.iter().zip(slips).flat_map(|(tooth, slip)| {
            let limit_n = friction.limit_n(&tooth.force_n);
            let with = |other: f64, weight: f64| Weighted { place: slip.wave_generator - other, weight, of: () };
            if !self.tooth_spins {
                return [with(0.0, limit_n.wave_generator), with(0.0, 0.0)];
            }
            // Where race and ring roll together, the slope of the least loss of the other two contacts changes by 2 μ_K
            // F_K, likewise at the slot. The race's slope is at most μ_H F_H in either direction.
            let most = limit_n.wave_generator.min(limit_n.ring + limit_n.carrier);
            let between = (limit_n.ring - limit_n.carrier).clamp(-most, most);
            [with(slip.ring, 0.5 * (most + between)), with(slip.carrier, 0.5 * (most - between))]
        });
        let mut places: Vec<_> = of_teeth.chain(std::iter::once(drag)).collect();
        weighted_median(&mut places).map_or(0.0, |median| median.place)
    }
}

/// Returns the mean over a period by the trapezoidal rule, from input angles in any unit with their values. The angles may
/// be unequally spaced; a jump has two points.
pub fn mean_over_period(column: &[(f64, f64)]) -> f64 {
    let (mut area, mut length) = (0.0, 0.0);
    for pair in column.windows(2) {
        let [(from, value), (to, next)] = [pair[0], pair[1]];
        area += 0.5 * (to - from) * (value + next);
        length += to - from;
    }
    area / length
}

/// Returns `1/cos` of the angle with this tangent.
fn secant(tan: f64) -> f64 {
    (1.0 + tan * tan).sqrt()
}

/// Point with a weight.
#[derive(Debug, Clone, Copy)]
struct Weighted<T> {
    place: f64,
    weight: f64,
    of: T,
}

/// Returns the weighted median, which minimizes `Σ weight |x - place|`. It is the lowest if there are several, and none
/// if all weights are zero.
fn weighted_median<T>(places: &mut [Weighted<T>]) -> Option<&Weighted<T>> {
    places.sort_unstable_by(|one, other| one.place.total_cmp(&other.place));
    let half = 0.5 * places.iter().map(|place| place.weight).sum::<f64>();
    let mut below = 0.0;
    places.iter().find(|place| {
        below += place.weight;
        place.weight > 0.0 && below >= half
    })
}
