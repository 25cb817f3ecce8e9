//! One period of the input angle: columns of tooth states, peaks, residuals, wind-up, capacity.

use crate::adaptive;
use crate::batch::{self, BatchSweep};
use crate::contact::{Contact, Materials, PerContact, SHEAR_DEPTH, SHEAR_SHARE, half_width_mm};
use crate::drive::Drive;
use crate::load_sharing::{LoadCase, LoadedDrive, ToothState};
use crate::mesh::{Mesh, PlacedTooth, Samples, TeethInMesh};
use crate::root::NotConverged;
use crate::springs::WindUp;
use crate::tooth::Pressure;
use crate::tooth::point::ShearBelow;
use crate::violation::{Parameter, Violation};
use crate::{SolveError, Stop};

/// Where a sweep looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Points {
    /// So many equal intervals of one period, both ends included.
    Samples(Samples),
    /// Wherever it takes to find the true extremes to a tolerance.
    Tolerance(Tolerance),
}

impl Points {
    /// So many equal intervals of one period.
    ///
    /// # Errors
    /// As [`Samples::new`].
    pub fn samples(count: u64) -> Result<Self, Violation> {
        Samples::new(count).map(Self::Samples)
    }

    /// Wherever it takes to find the true extremes to a tolerance, with so many states worked out on the way at most.
    ///
    /// # Errors
    /// As [`Tolerance::new`].
    pub fn tolerance(relative: f64, max_states: u64) -> Result<Self, Violation> {
        Tolerance::new(relative, max_states).map(Self::Tolerance)
    }

    /// The same to the finest tolerance that there is.
    pub const fn finest(max_states: u64) -> Self {
        Self::Tolerance(Tolerance { relative: Parameter::SweepTolerance.range().low, max_states })
    }
}

/// How true the extremes of a sweep are to be.
///
/// The relative tolerance holds for the largest value of every force and stress, for the least and the largest of wind-up and torsional
/// stiffness and for the torque capacity; its root for the places where they stand and for half-widths; of the transmission error the
/// tolerance times the wind-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    relative: f64,
    max_states: u64,
}

impl Tolerance {
    /// Checks the tolerance.
    ///
    /// # Errors
    /// A tolerance out of its range.
    pub fn new(relative: f64, max_states: u64) -> Result<Self, Violation> {
        Parameter::SweepTolerance.check(relative).map_or(Ok(Self { relative, max_states }), Err)
    }

    /// The relative tolerance.
    pub const fn relative(&self) -> f64 {
        self.relative
    }

    /// Most states that may be worked out.
    pub const fn max_states(&self) -> u64 {
        self.max_states
    }
}

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

/// The largest shear stress below a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakShear {
    /// Its value.
    pub stress_mpa: f64,
    /// Its depth.
    pub depth_mm: f64,
}

/// The pressure that has the largest stress of a contact so far.
#[derive(Debug, Clone, Copy)]
struct Hardest {
    stress_mpa: f64,
    force_n: f64,
    pressure: Pressure,
}

/// What limits the torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueCapacity {
    /// The largest torque at the wave generator under which no contact exceeds the allowable stress.
    pub input_torque_nm: f64,
    /// The same at the carrier.
    pub output_torque_nm: f64,
    /// The contact that limits it.
    pub contact: Contact,
    /// The input angle where it does.
    pub input_angle_deg: f64,
}

/// A sweep over one period.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
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

    /// Number of states.
    pub fn len(&self) -> usize {
        self.tooth.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.tooth.is_empty()
    }

    fn peak(&self, column: &[f64], at: usize) -> Peak {
        Peak { value: column[at], input_angle_deg: self.input_angle_deg[at], position_deg: self.position_deg[at] }
    }
}

/// The states where the force and the stress of a contact have their peaks.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PeakAt {
    pub(crate) force: usize,
    pub(crate) stress: usize,
}

/// The first of the largest values of a column.
fn peak_at(column: &[f64]) -> usize {
    column.iter().enumerate().fold(0, |at, (index, &value)| if value > column[at] { index } else { at })
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
        let torque_ratio = drive.teeth_per_wave();
        self.input_angle_deg.extend_from_slice(input_angle_deg);
        self.wind_up_deg.extend(rotation_rad.iter().map(|rotation_rad| rotation_rad.to_degrees()));
        let of_output = |stiffness| 1e-3 * stiffness * torque_ratio * torque_ratio;
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

/// The sweep over one period.
///
/// # Errors
/// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] where no finite forces exist,
/// [`SolveError::TooManyStates`] at a tolerance that takes more of them than allowed,
/// [`SolveError::Inconsistent`] where the answer's own checks say that it is wrong,
/// [`SolveError::Stopped`] when `stop` says so.
pub fn sweep(drive: &Drive, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<Sweep, SolveError> {
    let loaded = LoadedDrive::new(drive, load)?;
    // The capacity is worked out tooth by tooth.
    if let (Points::Samples(samples), None) = (points, load.parameters().allowable_stress_mpa)
        && let Some(batch) = batch::sweep(&loaded, samples, stop)?
    {
        return finished(&loaded, points, batch, None);
    }
    plain(&loaded, load, points, stop)
}

/// The same sweep, state by state: what the fast path is held against, and what is left where it does not reach.
///
/// # Errors
/// As [`sweep`].
pub fn sweep_plain(drive: &Drive, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<Sweep, SolveError> {
    plain(&LoadedDrive::new(drive, load)?, load, points, stop)
}

fn plain(loaded: &LoadedDrive<'_>, load: &LoadCase, points: Points, stop: &impl Stop) -> Result<Sweep, SolveError> {
    let mesh = Mesh::new(loaded.drive());
    let mut columns = Columns::new(loaded, load.parameters().allowable_stress_mpa);
    match points {
        Points::Samples(samples) => {
            columns.reserve(mesh.state_count(samples));
            for sample in 0..=samples.count() {
                if stop.stopped() {
                    return Err(SolveError::Stopped);
                }
                columns.add(mesh.input_angle_deg(sample, samples), mesh.placed_at(sample, samples))?;
            }
        }
        Points::Tolerance(tolerance) => {
            let moments = adaptive::moments(loaded, load, tolerance, stop)?;
            // Each place was counted once; listed it may stand for several teeth, and in every lap.
            let listed =
                moments.iter().map(|moment| moment.places()).sum::<u64>() * mesh.laps() * mesh.listed_at_each_place();
            let limit = tolerance.max_states();
            if listed > limit {
                return Err(SolveError::TooManyStates { limit });
            }
            let lap_deg = mesh.period_deg() / mesh.laps() as f64;
            for lap in 0..mesh.laps() {
                // A lap begins where the one before has ended.
                for moment in &moments[usize::from(lap > 0)..] {
                    if stop.stopped() {
                        return Err(SolveError::Stopped);
                    }
                    columns.add((lap as f64 + moment.fraction) * lap_deg, moment.placed(&mesh, lap))?;
                }
            }
        }
    }
    columns.finish(points, &load.parameters().materials)
}

/// A sweep as it grows by input angles.
struct Columns<'a> {
    loaded: &'a LoadedDrive<'a>,
    allowable_stress_mpa: Option<PerContact<f64>>,
    states: States,
    input_angles: InputAngles,
    torque_capacity: Option<TorqueCapacity>,
    balance: TorqueBalance,
    torque_balance_residual: f64,
    lists_lobes: bool,
    teeth: Vec<ToothState>,
    hardest: PerContact<Option<Hardest>>,
}

impl Hardest {
    /// The peaks of a line with what is another contact's own.
    fn complete(&self, peaks: ContactPeaks, materials: &Materials, contact: Contact) -> ContactPeaks {
        match &self.pressure {
            Pressure::Line { .. } => peaks,
            Pressure::Flat(flat) => ContactPeaks { half_width_mm: 0.5 * flat.length_mm(), shear: None, ..peaks },
            Pressure::Ellipse(ellipse) => {
                let half_width_mm = ellipse.half_width_mm(self.force_n);
                let half_length_mm = ellipse.half_length_mm(self.force_n);
                // Of the two bodies the one where it is larger.
                let shears = [materials.teeth, *materials.partner(contact)].map(|material| {
                    let ShearBelow { share, depth } = ellipse.shear_below(material.poissons_ratio);
                    PeakShear {
                        stress_mpa: share * self.stress_mpa,
                        depth_mm: depth * half_width_mm.min(half_length_mm),
                    }
                });
                let [one, other] = shears;
                let shear = if other.stress_mpa > one.stress_mpa { other } else { one };
                ContactPeaks { half_width_mm, half_length_mm: Some(half_length_mm), shear: Some(shear), ..peaks }
            }
        }
    }
}

impl<'a> Columns<'a> {
    fn new(loaded: &'a LoadedDrive<'a>, allowable_stress_mpa: Option<PerContact<f64>>) -> Self {
        Self {
            loaded,
            allowable_stress_mpa,
            states: States::default(),
            input_angles: InputAngles::default(),
            torque_capacity: None,
            balance: TorqueBalance::new(loaded.drive(), loaded.input_torque_nmm()),
            torque_balance_residual: 0.0,
            lists_lobes: !Mesh::new(loaded.drive()).zones_are_alike(),
            teeth: Vec::new(),
            hardest: PerContact::default(),
        }
    }

    fn reserve(&mut self, states: u64) {
        // A count that memory can hold; the caller has bounded it.
        self.states = States::with_capacity(usize::try_from(states).unwrap_or(usize::MAX));
    }

    /// Appends the states of the teeth in mesh at one input angle.
    fn add(&mut self, input_angle_deg: f64, placed: impl Iterator<Item = PlacedTooth>) -> Result<(), SolveError> {
        self.teeth.clear();
        for PlacedTooth { number, lobe, position, position_deg } in placed {
            self.teeth.push(self.loaded.tooth(position)?);
            self.states.input_angle_deg.push(input_angle_deg);
            self.states.tooth.push(u32::try_from(number).unwrap_or(u32::MAX));
            if self.lists_lobes {
                self.states.lobe.push(lobe);
            }
            self.states.position_deg.push(position_deg);
        }
        let wind_up = self.loaded.wind_up(&self.teeth)?;
        let loaded_teeth = self.share_load(&wind_up)?;
        self.input_angles.push(self.loaded.drive(), input_angle_deg, &wind_up, loaded_teeth);
        if let Some(allowable_stress_mpa) = &self.allowable_stress_mpa {
            let limit = self.loaded.torque_limit(&self.teeth, allowable_stress_mpa)?;
            let input_torque_nm = 1e-3 * limit.input_torque_nmm;
            if self.torque_capacity.is_none_or(|capacity| input_torque_nm < capacity.input_torque_nm) {
                let output_torque_nm = input_torque_nm * self.loaded.drive().teeth_per_wave();
                let contact = limit.contact;
                let capacity = TorqueCapacity { input_torque_nm, output_torque_nm, contact, input_angle_deg };
                self.torque_capacity = Some(capacity);
            }
        }
        Ok(())
    }

    /// Appends geometry, forces and stresses of the teeth, and returns how many carry load.
    fn share_load(&mut self, wind_up: &WindUp) -> Result<usize, NotConverged> {
        let flank = self.loaded.drive().flank();
        let states = &mut self.states;
        let mut loaded_teeth = 0;
        let zones = self.loaded.zones();
        let mut torque_nmm = PerContact::<f64>::default();
        for tooth in &self.teeth {
            let ToothState { center, flank: point, .. } = tooth;
            states.center_radius_mm.push(center.center_radius_mm);
            let cam_angle_rad = flank.locus().contact_angle_from_valley_rad(center);
            states.wave_generator_angle_deg.push(cam_angle_rad.to_degrees());
            states.ring_angle_deg.push(flank.angle_from_tip_rad(center, point).to_degrees());

            let force_n = self.loaded.forces_n(tooth, wind_up)?;
            loaded_teeth += usize::from(force_n.wave_generator > 0.0);
            let stress_mpa = self.loaded.stress_mpa(tooth, &force_n);
            for (contact, &stress_mpa) in stress_mpa.iter() {
                let hardest = self.hardest.get_mut(contact);
                // The first of equal ones, as among the states.
                if hardest.is_none_or(|before| stress_mpa > before.stress_mpa) {
                    let (force_n, pressure) = (*force_n.get(contact), *tooth.pressure.get(contact));
                    *hardest = Some(Hardest { stress_mpa, force_n, pressure });
                }
            }
            states.force_n.push(force_n);
            states.stress_mpa.push(stress_mpa);

            let sin_ring = point.tan_pressure_angle * point.cos_pressure_angle;
            torque_nmm.wave_generator += zones * force_n.wave_generator * center.cam_contact.lever_arm_mm;
            torque_nmm.ring += zones * force_n.ring * sin_ring * center.center_radius_mm;
            torque_nmm.carrier += zones * force_n.carrier * center.center_radius_mm;
        }
        let residual = self.balance.residual(&torque_nmm);
        self.torque_balance_residual = worse(residual, self.torque_balance_residual);
        Ok(loaded_teeth)
    }

    fn finish(self, points: Points, materials: &Materials) -> Result<Sweep, SolveError> {
        let Self { loaded, states, input_angles, torque_capacity, torque_balance_residual, hardest, .. } = self;
        let peaks = PerContact::of(|contact| PeakAt {
            force: peak_at(states.force_n.get(contact)),
            stress: peak_at(states.stress_mpa.get(contact)),
        });
        let columns = BatchSweep { states, input_angles, peaks, torque_balance_residual };
        let mut sweep = finished(loaded, points, columns, torque_capacity)?;
        sweep.peaks = PerContact::of(|contact| match hardest.get(contact) {
            Some(hardest) => hardest.complete(*sweep.peaks.get(contact), materials, contact),
            None => *sweep.peaks.get(contact),
        });
        Ok(sweep)
    }
}

/// A sweep with what follows from its states: peaks and closure, if its checks say nothing against it.
fn finished(
    loaded: &LoadedDrive<'_>,
    points: Points,
    columns: BatchSweep,
    torque_capacity: Option<TorqueCapacity>,
) -> Result<Sweep, SolveError> {
    let BatchSweep { states, input_angles, peaks, torque_balance_residual } = columns;
    let tooth_width_mm = loaded.drive().tooth_width_mm();
    let peaks = PerContact::of(|contact| {
        let (force, at) = (states.force_n.get(contact), peaks.get(contact));
        let stress_mpa = states.peak(states.stress_mpa.get(contact), at.stress);
        let half_width_mm = half_width_mm(force[at.stress], stress_mpa.value, tooth_width_mm);
        ContactPeaks {
            force_n: states.peak(force, at.force),
            stress_mpa,
            half_width_mm,
            half_length_mm: None,
            shear: Some(PeakShear {
                stress_mpa: SHEAR_SHARE * stress_mpa.value,
                depth_mm: SHEAR_DEPTH * half_width_mm,
            }),
        }
    });
    let period_closure_residual = period_closure(loaded, points, &states, &peaks)?;
    for (check, residual) in [("torque balance", torque_balance_residual), ("period closure", period_closure_residual)]
    {
        if residual.is_nan() || residual > MOST_RESIDUAL {
            return Err(SolveError::Inconsistent { check, residual });
        }
    }
    Ok(Sweep { states, input_angles, peaks, torque_capacity, torque_balance_residual, period_closure_residual })
}

/// The largest difference of a load at the last input angle from that angle worked out anew, one state at a time and from positions found
/// another way: by angles where the sweep goes by whole numbers, and the other way about.
fn period_closure(
    loaded: &LoadedDrive<'_>,
    points: Points,
    states: &States,
    peaks: &PerContact<ContactPeaks>,
) -> Result<f64, SolveError> {
    let mesh = Mesh::new(loaded.drive());
    let position = |place| match points {
        Points::Samples(_) => mesh.position_between(place, 1.0),
        Points::Tolerance(_) => mesh.position_after_lap(place),
    };
    let placed: Vec<_> = mesh.placed_between(2..=mesh.whole_spacings() + 1, mesh.laps() - 1, position).collect();
    let teeth = placed.iter().map(|placed| loaded.tooth(placed.position)).collect::<Result<Vec<_>, _>>()?;
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
            let off_force = (states.force_n.get(contact)[state] - force_n).abs() / peaks.force_n.value;
            let off_stress = (states.stress_mpa.get(contact)[state] - stress_mpa).abs() / peaks.stress_mpa.value;
            residual = worse(off_stress, worse(off_force, residual));
        }
    }
    Ok(residual)
}

impl PerContact<Vec<f64>> {
    fn push(&mut self, values: PerContact<f64>) {
        self.wave_generator.push(values.wave_generator);
        self.ring.push(values.ring);
        self.carrier.push(values.carrier);
    }
}
