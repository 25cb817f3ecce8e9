//! One period of the input angle: columns of tooth states, peaks, residuals.

use crate::contact::{Contact, PerContact};
use crate::drive::{Drive, WAVES};
use crate::load_sharing::{LoadCase, LoadedDrive, ToothState};
use crate::mesh::Mesh;
use crate::{SolveError, Stop};

/// The states of a sweep, by input angle and then tooth number: columns of equal length, one entry a state.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct States {
    /// Input angle j.
    pub input_angle_deg: Vec<f64>,
    /// Tooth number, 0 being the tooth on the major axis at j = 0.
    pub tooth: Vec<u32>,
    /// Position ψ, from the major axis.
    pub position_deg: Vec<f64>,
    /// Distance `d` of the tooth's centre from the axis.
    pub center_radius_mm: Vec<f64>,
    /// φ_H: contact point on the cam, from the minor axis.
    pub wave_generator_angle_deg: Vec<f64>,
    /// φ_K: contact point on the ring, from the ring's tooth tip.
    pub ring_angle_deg: Vec<f64>,
    /// `F_H`, `F_K`, `F_S`.
    pub force_n: PerContact<Vec<f64>>,
    /// Hertz stresses `σ_H`, `σ_K`, `σ_S`.
    pub stress_mpa: PerContact<Vec<f64>>,
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
}

/// A sweep over one period.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The states.
    pub states: States,
    /// Peaks over the states.
    pub peaks: PerContact<ContactPeaks>,
    /// Largest relative deviation of the input, ring and carrier torques from `M0`, `M0 Z_K/U`, `M0 Z_G/U`.
    pub torque_balance_residual: f64,
    /// Largest difference of a force or stress between the last input angle and the first, teeth renumbered, over
    /// the column's peak.
    pub period_closure_residual: f64,
}

impl States {
    fn with_capacity(count: usize) -> Self {
        let column = || Vec::with_capacity(count);
        Self {
            input_angle_deg: column(),
            tooth: Vec::with_capacity(count),
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

    fn peak(&self, column: &[f64]) -> Peak {
        let mut at = 0;
        for (index, value) in column.iter().enumerate() {
            if *value > column[at] {
                at = index;
            }
        }
        Peak { value: column[at], input_angle_deg: self.input_angle_deg[at], position_deg: self.position_deg[at] }
    }
}

/// The sweep over one period in `samples` equal intervals, both ends included; `samples` is at least 1.
///
/// # Errors
/// [`SolveError::NoToothInMesh`] and [`SolveError::ComplianceNotPositive`] where no finite forces exist,
/// [`SolveError::Stopped`] when `stop` says so.
pub fn sweep(drive: &Drive, load: &LoadCase, samples: u64, stop: &impl Stop) -> Result<Sweep, SolveError> {
    let loaded = LoadedDrive::new(drive, load)?;
    let mesh = Mesh::new(drive);
    // A count that memory can hold; the caller has bounded it.
    let count = usize::try_from(mesh.state_count(samples)).unwrap_or(usize::MAX);
    let mut states = States::with_capacity(count);
    let mut torque_balance_residual = 0.0_f64;
    let mut teeth: Vec<ToothState> = Vec::new();
    for sample in 0..=samples {
        if stop.stopped() {
            return Err(SolveError::Stopped);
        }
        teeth.clear();
        let numbers = mesh.teeth_at(sample, samples);
        let input_angle_deg = mesh.input_angle_deg(sample, samples);
        for number in numbers {
            let tooth = loaded.tooth(mesh.position(number, sample, samples))?;
            states.input_angle_deg.push(input_angle_deg);
            states.tooth.push(u32::try_from(number).unwrap_or(u32::MAX));
            states.position_deg.push(mesh.position_deg(number, sample, samples));
            teeth.push(tooth);
        }
        torque_balance_residual = torque_balance_residual.max(share_load(&loaded, &teeth, &mut states));
    }
    let peaks = PerContact::of(|contact| ContactPeaks {
        force_n: states.peak(states.force_n.get(contact)),
        stress_mpa: states.peak(states.stress_mpa.get(contact)),
    });
    let period_closure_residual = period_closure(&states, &peaks, &mesh, samples);
    Ok(Sweep { states, peaks, torque_balance_residual, period_closure_residual })
}

/// Appends geometry, forces and stresses of the teeth at one input angle, and returns the largest relative
/// deviation of the torques that these forces make from those they must balance.
fn share_load(loaded: &LoadedDrive<'_>, teeth: &[ToothState], states: &mut States) -> f64 {
    let drive = loaded.drive();
    let flank = drive.flank();
    let wind_up_rad = loaded.wind_up_rad(teeth);
    let mut torque_nmm = PerContact::<f64>::default();
    for tooth in teeth {
        let ToothState { center, flank: point, .. } = tooth;
        states.center_radius_mm.push(center.center_radius_mm);
        let cam_angle_rad = flank.locus().cam().contact_angle_from_minor_rad(&center.cam_contact);
        states.wave_generator_angle_deg.push(cam_angle_rad.to_degrees());
        states.ring_angle_deg.push(flank.angle_from_tip_rad(center, point).to_degrees());

        let force_n = tooth.forces_n(wind_up_rad);
        let stress_mpa = PerContact::of(|contact| {
            let curvature_per_mm = *tooth.curvature_per_mm.get(contact);
            loaded.hertz().get(contact).stress_mpa(*force_n.get(contact), curvature_per_mm)
        });
        states.force_n.push(force_n);
        states.stress_mpa.push(stress_mpa);

        let sin_ring = point.tan_pressure_angle * point.cos_pressure_angle;
        torque_nmm.wave_generator += WAVES * force_n.wave_generator * center.cam_contact.lever_arm_mm;
        torque_nmm.ring += WAVES * force_n.ring * sin_ring * center.center_radius_mm;
        torque_nmm.carrier += WAVES * force_n.carrier * center.center_radius_mm;
    }
    let input_nmm = loaded.input_torque_nmm();
    let balanced = PerContact {
        wave_generator: torque_nmm.wave_generator / input_nmm,
        ring: torque_nmm.ring / (input_nmm * flank.teeth_per_wave()),
        carrier: torque_nmm.carrier / (input_nmm * drive.teeth_per_wave()),
    };
    balanced.iter().map(|(_, ratio)| (ratio - 1.0).abs()).fold(0.0, f64::max)
}

fn period_closure(states: &States, peaks: &PerContact<ContactPeaks>, mesh: &Mesh, samples: u64) -> f64 {
    let last = states.len() - mesh.teeth_at(samples, samples).count();
    let residual = |column: &[f64], peak: f64| {
        let (first, last) = (column.iter(), column[last..].iter());
        last.zip(first).map(|(end, start)| (end - start).abs() / peak).fold(0.0, f64::max)
    };
    [Contact::WaveGenerator, Contact::Ring, Contact::Carrier]
        .into_iter()
        .map(|contact| {
            let ContactPeaks { force_n, stress_mpa } = peaks.get(contact);
            let force = residual(states.force_n.get(contact), force_n.value);
            force.max(residual(states.stress_mpa.get(contact), stress_mpa.value))
        })
        .fold(0.0, f64::max)
}

impl PerContact<Vec<f64>> {
    fn push(&mut self, values: PerContact<f64>) {
        self.wave_generator.push(values.wave_generator);
        self.ring.push(values.ring);
        self.carrier.push(values.carrier);
    }
}
