//! What a sweep returns: columns of states and input angles, peaks, capacity, and the checks that it has to pass.

use crate::SolveError;
use crate::contact::{Contact, Materials, PerContact, SHEAR_DEPTH, SHEAR_SHARE, half_width_mm};
use crate::drive::Drive;
use crate::load_sharing::LoadedDrive;
use crate::mesh::{Mesh, TeethInMesh};
use crate::root::NotConverged;
use crate::springs::WindUp;
use crate::sweep::points::Points;
use crate::tooth::point::ShearBelow;
use crate::tooth::{Pressure, StressExponents};

/// Forces that miss a torque by more than this share of it, or a period that fails to close by more than this share of a peak, are wrong: some
/// ten thousand times what rounding does to the worst design that is known.
const MOST_RESIDUAL: f64 = 1e-9;

/// The torques that must come out: `M0` at the wave generator, `M0 Z_K/U` at the ring, `M0 Z_G/U` at the carrier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueBalance {
    per_nmm: PerContact<f64>,
}

impl TorqueBalance {
    /// Of a drive under an input torque.
    pub fn new(drive: &Drive, input_torque_nmm: f64) -> Self {
        let per_nmm = PerContact {
            wave_generator: 1.0 / input_torque_nmm,
            ring: 1.0 / (input_torque_nmm * drive.flank().teeth_per_wave()),
            carrier: 1.0 / (input_torque_nmm * drive.teeth_per_wave()),
        };
        Self { per_nmm }
    }

    /// The largest relative deviation of the torques that did come out; not a number where one of them is none.
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

/// The larger of a residual and those before; what is not a number is the worst of all.
#[inline(always)]
pub(crate) fn worse(residual: f64, before: f64) -> f64 {
    if residual.is_nan() || residual > before { residual } else { before }
}

/// The states of a sweep, by input angle and then tooth number: columns of equal length, one entry a state. Where the zones are alike the
/// teeth of one stand for all, elsewhere the teeth of all zones are listed ([`Mesh`]).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct States {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// Tooth number, 0 being the tooth in the middle of a lobe at j = 0.
    pub tooth: Vec<u32>,
    /// The lobe that the tooth is on; empty where the zones are alike.
    pub lobe: Vec<u32>,
    /// Position ψ, from the middle of the lobe.
    pub position_deg: Vec<f64>,
    /// Distance `d` of the tooth's centre from the axis.
    pub center_radius_mm: Vec<f64>,
    /// φ_H: contact point on the cam, from the valley.
    pub wave_generator_angle_deg: Vec<f64>,
    /// φ_K: contact point on the ring, from the ring's tooth tip.
    pub ring_angle_deg: Vec<f64>,
    /// `F_H`, `F_K`, `F_S`.
    pub force_n: PerContact<Vec<f64>>,
    /// Hertz stresses `σ_H`, `σ_K`, `σ_S`.
    pub stress_mpa: PerContact<Vec<f64>>,
}

/// What holds for all teeth at an input angle: columns of equal length, one entry an input angle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InputAngles {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// `Δφ`: how far the wave generator turns under the load, clearances included.
    pub wind_up_deg: Vec<f64>,
    /// `(Z_G/U)² dM0/dΔφ`: output torque over output rotation, input held, at the load.
    pub torsional_stiffness_nm_per_rad: Vec<f64>,
    /// Of the teeth that are listed, those that carry load.
    pub loaded_teeth: Vec<u32>,
}

/// The largest value of a column, and the state where it stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// The value, in the column's unit.
    pub value: f64,
    /// Input angle of the state.
    pub input_angle_deg: f64,
    /// Position of the tooth.
    pub position_deg: f64,
}

/// Peaks of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPeaks {
    /// Of the force, in N.
    pub force_n: Peak,
    /// Of the stress, in MPa.
    pub stress_mpa: Peak,
    /// Half the width of the contact, in the plane of motion, where the stress has its peak.
    pub half_width_mm: f64,
    /// Half its length along the axis there, of an ellipse.
    pub half_length_mm: Option<f64>,
    /// The largest shear stress below the surface there, and how deep it stands; none under a flat, whose edges are not modelled.
    pub shear: Option<PeakShear>,
}

impl ContactPeaks {
    /// Of a line contact, which bears `force_n` where its stress has its peak.
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
    /// Those of a line with what is the own of a contact of this pressure, which bears `force_n` where its stress has its peak.
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
                // Of the two bodies the one where it is larger.
                let [tooth, partner] = [&materials.teeth, materials.partner(contact)].map(|body| body.poissons_ratio);
                let (of_tooth, are_alike) = (shear(tooth), partner.to_bits() == tooth.to_bits());
                let of_partner = if are_alike { of_tooth } else { shear(partner) };
                let shear = if of_partner.stress_mpa > of_tooth.stress_mpa { of_partner } else { of_tooth };
                Self { half_width_mm, half_length_mm: Some(half_length_mm), shear: Some(shear), ..self }
            }
        }
    }
}

/// The largest shear stress below a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakShear {
    /// Its value.
    pub stress_mpa: f64,
    /// Its depth.
    pub depth_mm: f64,
}

/// What limits the torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueCapacity {
    /// The largest torque at the wave generator under which no contact exceeds the allowable stress.
    pub input_torque_nm: f64,
    /// The same at the carrier.
    pub output_torque_nm: f64,
    /// The contact that limits it; the nearest to its allowable stress where none reaches it.
    pub contact: Contact,
    /// Whether none does before the wave generator turns past its teeth.
    pub turns_past_teeth: bool,
    /// The input angle where it does.
    pub input_angle_deg: f64,
}

impl TorqueCapacity {
    /// Where all loads are in proportion: of line contacts `M0 min (σ_a/σ)²`.
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
        Self { input_torque_nm, output_torque_nm, contact, turns_past_teeth: false, input_angle_deg }
    }
}

/// A sweep over one period; where items deviate, over as many as it takes until they meet again as they did.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The mesh that it went through.
    pub mesh: Mesh,
    /// The states.
    pub states: States,
    /// What holds at each input angle.
    pub input_angles: InputAngles,
    /// Peaks over the states.
    pub peaks: PerContact<ContactPeaks>,
    /// The torque capacity, given an allowable stress.
    pub torque_capacity: Option<TorqueCapacity>,
    /// Largest relative deviation of the input, ring and carrier torques from `M0`, `M0 Z_K/U`, `M0 Z_G/U`.
    pub torque_balance_residual: f64,
    /// Largest difference of a force or stress at the last input angle from that angle worked out anew, over the column's peak.
    pub period_closure_residual: f64,
}

/// What a sweep comes to, its states left out: what searches ask of millions of drives.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPeaks {
    /// Peaks over the states.
    pub contacts: PerContact<ContactPeaks>,
    /// Of `Δφ` over the input angles.
    pub wind_up_deg: Extremes,
    /// Of the stiffness at the output over the input angles.
    pub torsional_stiffness_nm_per_rad: Extremes,
    /// Of the teeth that are listed, those that carry load.
    pub loaded_teeth: TeethInMesh,
    /// The torque capacity, given an allowable stress.
    pub torque_capacity: Option<TorqueCapacity>,
    /// Largest relative deviation of the input, ring and carrier torques from `M0`, `M0 Z_K/U`, `M0 Z_G/U`.
    pub torque_balance_residual: f64,
}

/// The least and the largest of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// The least.
    pub least: f64,
    /// The largest.
    pub largest: f64,
}

impl Extremes {
    /// Of no value yet.
    pub(crate) const NONE: Self = Self { least: f64::INFINITY, largest: f64::NEG_INFINITY };

    /// Those of a column.
    pub fn of(column: &[f64]) -> Self {
        column.iter().fold(Self::NONE, |seen, &value| seen.with(value))
    }

    #[inline(always)]
    pub(crate) fn with(self, value: f64) -> Self {
        Self { least: self.least.min(value), largest: self.largest.max(value) }
    }
}

/// What all teeth together come to at the input angles so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AngleExtremes {
    wind_up_deg: Extremes,
    torsional_stiffness_nm_per_rad: Extremes,
    loaded_teeth: Option<TeethInMesh>,
}

impl AngleExtremes {
    pub(crate) const NONE: Self =
        Self { wind_up_deg: Extremes::NONE, torsional_stiffness_nm_per_rad: Extremes::NONE, loaded_teeth: None };

    /// One further.
    #[inline(always)]
    pub(crate) fn see(&mut self, wind_up_deg: f64, torsional_stiffness_nm_per_rad: f64, loaded_teeth: u64) {
        self.wind_up_deg = self.wind_up_deg.with(wind_up_deg);
        self.torsional_stiffness_nm_per_rad = self.torsional_stiffness_nm_per_rad.with(torsional_stiffness_nm_per_rad);
        let TeethInMesh { min, max } =
            self.loaded_teeth.unwrap_or(TeethInMesh { min: loaded_teeth, max: loaded_teeth });
        self.loaded_teeth = Some(TeethInMesh { min: min.min(loaded_teeth), max: max.max(loaded_teeth) });
    }

    /// With what each contact comes to.
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
    /// How far the carrier lags and leads over the period under the load: the range of the wind-up at the output.
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
    /// How far the carrier lags and leads over the period under the load: the range of the wind-up at the output.
    pub fn transmission_error_peak_to_peak_deg(&self, drive: &Drive) -> f64 {
        let wind_up_deg = self.input_angles.wind_up_deg.iter().copied();
        let most = wind_up_deg.clone().fold(f64::NEG_INFINITY, f64::max);
        (most - wind_up_deg.fold(f64::INFINITY, f64::min)) / drive.teeth_per_wave()
    }

    /// Least and most teeth of a zone that carry load: of those in mesh, those whose gaps are closed.
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

    /// With the teeth of all zones, to be filled in.
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

    /// Number of states.
    pub fn len(&self) -> usize {
        self.tooth.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.tooth.is_empty()
    }

    pub(crate) fn peak(&self, column: &[f64], at: usize) -> Peak {
        Peak { value: column[at], input_angle_deg: self.input_angle_deg[at], position_deg: self.position_deg[at] }
    }
}

/// The states where the force and the stress of a contact have their peaks.
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

    /// To be filled in.
    pub(crate) fn of_zeros(count: usize) -> Self {
        let column = || vec![0.0; count];
        Self {
            input_angle_deg: column(),
            wind_up_deg: column(),
            torsional_stiffness_nm_per_rad: column(),
            loaded_teeth: vec![0; count],
        }
    }

    /// The stiffness at the output of `dM0/dΔφ`.
    #[inline(always)]
    pub(crate) fn of_output(drive: &Drive, stiffness_nmm_per_rad: f64) -> f64 {
        let torque_ratio = drive.teeth_per_wave();
        1e-3 * stiffness_nmm_per_rad * torque_ratio * torque_ratio
    }

    /// Appends an input angle; the stiffness `dM0/dΔφ` becomes that of the output.
    pub(crate) fn push(&mut self, drive: &Drive, input_angle_deg: f64, wind_up: &WindUp, loaded_teeth: usize) {
        let stiffness = std::iter::once(wind_up.stiffness_nmm_per_rad);
        self.extend(drive, &[input_angle_deg], &[wind_up.rotation_rad()], stiffness, std::iter::once(loaded_teeth));
    }

    /// Appends some input angles at once.
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

    /// Appends the first input angle again, a period on.
    pub(crate) fn repeat_first(&mut self, input_angle_deg: f64) {
        self.input_angle_deg.push(input_angle_deg);
        self.wind_up_deg.push(self.wind_up_deg[0]);
        self.torsional_stiffness_nm_per_rad.push(self.torsional_stiffness_nm_per_rad[0]);
        self.loaded_teeth.push(self.loaded_teeth[0]);
    }
}
/// What the plain path and the fast one both make of a sweep.
pub(crate) struct Columns {
    pub(crate) states: States,
    pub(crate) input_angles: InputAngles,
    pub(crate) peaks: PerContact<PeakAt>,
    pub(crate) torque_balance_residual: f64,
}

/// A sweep with what follows from its states: peaks and closure, if its checks say nothing against it.
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
        // That the items have met again as they did shows in what all teeth together make.
        let wind_up_deg = &input_angles.wind_up_deg;
        let ends_deg = [wind_up_deg.first(), wind_up_deg.last()].map(|end| end.copied().unwrap_or(f64::NAN));
        let [first_deg, last_deg] = ends_deg;
        period_closure_residual = worse((last_deg - first_deg).abs() / last_deg, period_closure_residual);
    }
    check("torque balance", torque_balance_residual)?;
    // Light loads across wide gaps, or at corners, keep fewer digits: the answer says how few.
    if let Err(inconsistent) = check("period closure", period_closure_residual) {
        let of_rounding = ROUNDINGS * f64::EPSILON * input_angles.amplification(loaded)?;
        if period_closure_residual.is_nan() || period_closure_residual > of_rounding {
            return Err(inconsistent);
        }
    }
    let mesh = *loaded.mesh();
    Ok(Sweep { mesh, states, input_angles, peaks, torque_capacity, torque_balance_residual, period_closure_residual })
}

/// How many roundings of closing angles part two ways to the same loads.
const ROUNDINGS: f64 = 32.0;

impl InputAngles {
    /// How much a relative error of a closing angle becomes in what is turned beyond it, at most: `Δφ K/M0`, one or so without gaps. What a tooth keeps
    /// from a corner is a difference of two distances, and has their rounding.
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

/// That a residual is one of rounding.
pub(crate) fn check(check: &'static str, residual: f64) -> Result<(), SolveError> {
    if residual.is_nan() || residual > MOST_RESIDUAL {
        return Err(SolveError::Inconsistent { check, residual });
    }
    Ok(())
}

/// The largest difference of a load at the last input angle from that angle worked out anew, one state at a time and from positions found
/// another way: by angles where the sweep goes by whole numbers, and the other way about.
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
            // Where corners alone press the teeth there is no stress at the ring.
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
