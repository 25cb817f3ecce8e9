//! The quantities of a variant, each with unit, meaning and source.

use serde::Serialize;
use toothwave_calculation::sweep::CheckedSweep;
use toothwave_solver::backlash::Backlash;
use toothwave_solver::fingers::FingerStress;
use toothwave_solver::losses::duty::LossTotals;
use toothwave_solver::losses::period::RadialForces;
use toothwave_solver::mesh::Mesh;
use toothwave_solver::root::NotConverged;
use toothwave_solver::sweep::{ContactPeaks, Peak, SweepPeaks};
use toothwave_solver::{Contact, Drive, PerContact};
use utoipa::ToSchema;

/// Source of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// An answer to the same document has it.
    Answer(AnswerPlace),
    /// Definition of a quantity that is computed from an answer.
    Definition(&'static str),
}

/// Place of a value in an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct AnswerPlace {
    /// Path of the request.
    pub path: &'static str,
    /// JSON pointer into the answer.
    pub pointer: &'static str,
}

/// Fields of the document that a quantity needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Needs {
    /// The drive alone.
    Drive,
    /// A load.
    Load,
    /// A load and `load.allowable_stress_mpa`.
    AllowableStress,
    /// A load and `parts.carrier.strength`.
    CarrierStrength,
    /// A load and `friction`.
    Friction,
    /// A load, `friction` and a speed: `load.input_speed_rpm`, or the speeds of a `load.duty`.
    FrictionAndSpeed,
}

/// Computation that a quantity needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Takes {
    /// Geometry of the drive.
    Drive,
    /// Peaks of a sweep.
    Peaks,
    /// Radial forces on the wave generator, state by state.
    RadialForces,
    /// Losses by friction, state by state.
    Losses,
    /// Backlash at the output.
    Backlash,
}

/// Function that computes a quantity.
type Of = fn(&Variant<'_>) -> Result<f64, NotConverged>;

/// A quantity of a study.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct Quantity {
    /// Name, which ends in the unit.
    pub name: &'static str,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    /// Meaning.
    pub meaning: &'static str,
    /// True if the quantity is a flag: 1 for true, 0 for false.
    pub is_flag: bool,
    /// Fields that the document needs for it.
    pub needs: Needs,
    /// Source.
    pub source: Source,
    /// Paths of a design that it may depend on. Other fields do not change it.
    #[serde(skip)]
    #[schema(ignore)]
    pub(crate) depends_on: &'static [&'static str],
    /// Path of a design that sets it directly, if the field is given.
    #[serde(skip)]
    #[schema(ignore)]
    pub(crate) said_by: Option<&'static str>,
    /// Lower bound for every drive.
    #[serde(skip)]
    #[schema(ignore)]
    pub(crate) least: f64,
    /// Upper bound for every drive.
    #[serde(skip)]
    #[schema(ignore)]
    pub(crate) most: f64,
    #[serde(skip)]
    #[schema(ignore)]
    pub(crate) takes: Takes,
    #[serde(skip)]
    #[schema(ignore)]
    of: Of,
}

impl PartialEq for Quantity {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// Results of a variant, as far as its quantities need them.
#[derive(Debug)]
pub(crate) struct Variant<'a> {
    pub(crate) drive: &'a Drive,
    /// Outer radius of the ring as drawn.
    pub(crate) ring_outer_radius_mm: f64,
    pub(crate) loaded: Option<Loaded<'a>>,
}

/// Results under load.
#[derive(Debug)]
pub(crate) struct Loaded<'a> {
    pub(crate) checked: &'a CheckedSweep,
    pub(crate) peaks: SweepPeaks,
    /// Peaks with the stresses that are means along the teeth.
    pub(crate) mean_peaks: PerContact<ContactPeaks>,
    /// Over all points of a duty; the rest is of its hardest.
    pub(crate) losses: Option<LossTotals>,
    pub(crate) radial_forces: Option<RadialForces>,
    pub(crate) backlash: Option<Backlash>,
}

impl<'a> Loaded<'a> {
    /// Builds the results from the peaks of a sweep, whose stresses are means along the teeth.
    pub(crate) fn new(checked: &'a CheckedSweep, peaks: SweepPeaks, backlash: Option<Backlash>) -> Self {
        let mean_peaks = peaks.contacts;
        Self { checked, peaks: checked.summary_along(peaks), mean_peaks, losses: None, radial_forces: None, backlash }
    }
}

impl Variant<'_> {
    /// Returns a value under load. `Evaluator` has computed it if a quantity needs it.
    fn loaded(&self, of: impl Fn(&Loaded<'_>) -> f64) -> f64 {
        self.loaded.as_ref().map_or(f64::NAN, of)
    }

    fn peaks(&self, contact: Contact, of: impl Fn(&ContactPeaks) -> f64) -> f64 {
        self.loaded(|loaded| of(loaded.peaks.contacts.get(contact)))
    }

    fn greatest(&self, of: impl Fn(&ContactPeaks) -> f64) -> f64 {
        self.loaded(|loaded| loaded.peaks.contacts.iter().map(|(_, peaks)| of(peaks)).fold(f64::NEG_INFINITY, f64::max))
    }

    fn capacity(&self, of: impl Fn(f64, f64) -> f64) -> f64 {
        self.loaded(|loaded| {
            let capacity = loaded.peaks.torque_capacity.as_ref();
            capacity.map_or(f64::NAN, |capacity| of(capacity.input_torque_nm, capacity.output_torque_nm))
        })
    }

    /// Returns a value of the carrier's fingers, 0 if they are not calculated.
    fn fingers(&self, of: impl Fn(&FingerStress) -> Option<f64>) -> f64 {
        self.loaded(|loaded| loaded.checked.finger_stress(&loaded.mean_peaks).as_ref().and_then(&of).unwrap_or(0.0))
    }

    fn losses(&self, of: impl Fn(&LossTotals) -> f64) -> f64 {
        self.loaded(|loaded| loaded.losses.as_ref().map_or(f64::NAN, &of))
    }

    fn backlash(&self, of: impl Fn(&Backlash) -> f64) -> f64 {
        self.loaded(|loaded| loaded.backlash.as_ref().map_or(f64::NAN, &of))
    }

    fn pressure_velocity(&self, contact: Contact) -> f64 {
        let value = |peaks: PerContact<Peak>| peaks.get(contact).value;
        self.losses(|losses| losses.pressure_velocity_mpa_m_per_s.map_or(f64::NAN, value))
    }
}

fn most(column: &[f64]) -> f64 {
    column.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Paths of the numbers of teeth and lobes.
const COUNTS: [&str; 4] =
    ["/drive/wave_generator/kind", "/drive/wave_generator/lobes", "/drive/teeth/count", "/drive/ring/teeth"];

/// Paths that set the load and its torques.
const TORQUE: [&str; 5] = ["/load", COUNTS[0], COUNTS[1], COUNTS[2], COUNTS[3]];

/// All paths except those of drawings.
const MECHANICS: [&str; 9] =
    ["/drive", "/materials", "/load", "/model", "/modification", "/deviations", "/friction", "/parts", "/sweep"];

const fn of_drive(name: &'static str, unit: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity {
        name,
        unit,
        meaning,
        is_flag: false,
        needs: Needs::Drive,
        source,
        depends_on: &["/drive"],
        said_by: None,
        least: f64::NEG_INFINITY,
        most: f64::INFINITY,
        takes: Takes::Drive,
        of,
    }
}

const fn flag(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { is_flag: true, ..of_drive(name, "", meaning, source, of) }
}

const fn of_sweep(name: &'static str, unit: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    let (needs, takes) = (Needs::Load, Takes::Peaks);
    Quantity { needs, depends_on: &MECHANICS, takes, ..of_drive(name, unit, meaning, source, of) }
}

const fn of_capacity(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { needs: Needs::AllowableStress, ..of_sweep(name, "N·m", meaning, source, of) }
}

const fn backlash(name: &'static str, meaning: &'static str, pointer: &'static str, of: Of) -> Quantity {
    of_sweep(name, "arcmin", meaning, sweep(pointer), of).taking(Takes::Backlash)
}

const fn of_losses(name: &'static str, unit: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { needs: Needs::Friction, takes: Takes::Losses, ..of_sweep(name, unit, meaning, source, of) }
}

const fn loss_ratio(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    of_losses(name, "", meaning, source, of).not_below_zero()
}

const fn efficiency(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    Quantity { most: 1.0, ..of_losses(name, "", meaning, source, of) }
}

const fn pressure_velocity(name: &'static str, meaning: &'static str, source: Source, of: Of) -> Quantity {
    of_losses(name, "MPa m/s", meaning, source, of).at_speed().not_below_zero()
}

const fn geometry(pointer: &'static str) -> Source {
    Source::Answer(AnswerPlace { path: "/v1/geometry", pointer })
}

const fn mesh(pointer: &'static str) -> Source {
    Source::Answer(AnswerPlace { path: "/v1/coincidence-degree", pointer })
}

const fn sweep(pointer: &'static str) -> Source {
    Source::Answer(AnswerPlace { path: "/v1/sweep", pointer })
}

/// The two quantities from which a search can derive the free fields.
pub(crate) const TRANSMISSION_RATIO: &str = "transmission_ratio";
pub(crate) const OUTER_DIAMETER_MM: &str = "outer_diameter_mm";

/// All quantities, in the order in which they are listed.
pub static QUANTITIES: [Quantity; 61] = [
    of_drive(
        TRANSMISSION_RATIO,
        "",
        "Input speed over carrier speed, ring fixed. Negative if they turn in opposite directions.",
        geometry("/transmission_ratio"),
        |variant| Ok(variant.drive.transmission_ratio()),
    )
    .depending_on(&COUNTS),
    of_drive(
        "transmission_ratio_carrier_fixed",
        "",
        "Input speed over ring speed, carrier fixed.",
        geometry("/transmission_ratio_carrier_fixed"),
        |variant| Ok(variant.drive.transmission_ratio_carrier_fixed()),
    )
    .depending_on(&COUNTS),
    of_drive(
        OUTER_DIAMETER_MM,
        "mm",
        "Outer diameter of the drive.",
        Source::Definition(
            "twice the ring's outer radius: `parts.ring.outer_radius_mm`, by default 1.2 times the root radius with `parts.ring.clearance_um`, without the ring's `modification`",
        ),
        |variant| Ok(2.0 * variant.ring_outer_radius_mm),
    )
    .not_below_zero()
    .depending_on(&["/drive", "/parts", "/model/clearance"])
    .said_by("/parts/ring/outer_radius_mm"),
    of_drive(
        "ring_root_radius_mm",
        "mm",
        "Radius of the ring in the middle of a tooth space.",
        geometry("/ring/root_radius_mm"),
        |variant| Ok(variant.drive.root_radius_mm()),
    )
    .not_below_zero(),
    of_drive("ring_tip_radius_mm", "mm", "Radius of the ring's tips.", geometry("/ring/tip_radius_mm"), |variant| {
        Ok(variant.drive.tip_radius_mm())
    }).not_below_zero(),
    of_drive(
        "ring_tooth_height_mm",
        "mm",
        "Root radius minus tip radius.",
        geometry("/ring/tooth_height_mm"),
        |variant| Ok(variant.drive.root_radius_mm() - variant.drive.tip_radius_mm()),
    ),
    of_drive(
        "tooth_width_mm",
        "mm",
        "Length of a tooth along the axis.",
        Source::Definition("`drive.teeth.width_mm`; a ball's diameter"),
        |variant| Ok(variant.drive.tooth_width_mm()),
    )
    .not_below_zero()
    .depending_on(&["/drive/teeth"]),
    flag(
        "undercut",
        "True if the envelope of the teeth undercuts the ring's tips.",
        geometry("/undercut/occurs"),
        |variant| Ok(f64::from(u8::from(variant.drive.flank().is_undercut()))),
    ),
    of_drive(
        "coincidence_degree",
        "",
        "Contact ratio over all meshing zones.",
        mesh("/coincidence_degree"),
        |variant| Ok(Mesh::new(variant.drive).coincidence_degree()),
    )
    .not_below_zero(),
    of_drive(
        "teeth_in_mesh_min",
        "",
        "Smallest number of teeth in mesh over all input angles: in one zone if the zones are equal, otherwise in all zones together.",
        mesh("/teeth_in_mesh_per_zone/min"),
        #[expect(clippy::cast_precision_loss, reason = "a count of teeth")]
        |variant| Ok(Mesh::new(variant.drive).teeth_in_mesh().min as f64),
    )
    .not_below_zero(),
    of_drive(
        "engagement_start_deg",
        "deg",
        "Angle from the middle of a lobe at which a tooth begins to touch the ring's flank.",
        mesh("/engagement/start_deg"),
        |variant| Ok(variant.drive.flank_limit().position.from_lobe_deg()),
    ),
    of_drive(
        "period_deg",
        "deg",
        "Input angle after which the load pattern repeats.",
        mesh("/period_deg"),
        |variant| Ok(Mesh::new(variant.drive).period_deg()),
    )
    .not_below_zero(),
    of_drive(
        "ring_pressure_angle_max_deg",
        "deg",
        "Largest pressure angle of the ring on the engaged flank.",
        geometry("/ring/pressure_angle_max_deg"),
        |variant| {
            let steepest = variant.drive.steepest_engaged()?;
            Ok(variant.drive.flank().at(&steepest).tan_pressure_angle.atan().to_degrees())
        },
    ),
    of_drive(
        "wave_generator_pressure_angle_max_deg",
        "deg",
        "Largest pressure angle of the wave generator at an engaged tooth.",
        geometry("/wave_generator/pressure_angle_max_deg"),
        |variant| Ok(variant.drive.steepest_engaged()?.tan_pressure_angle.atan().to_degrees()),
    ),
    of_drive(
        "slot_wall_mm",
        "mm",
        "Smallest wall thickness between two slots. Zero or negative if the slots overlap.",
        geometry("/carrier/slot_wall_mm"),
        |variant| Ok(variant.drive.slot_wall_mm()),
    ),
    of_drive(
        "slot_wall_over_slot_width",
        "",
        "Smallest wall thickness between two slots over the slot width. Below 0.25 a finding warns.",
        Source::Definition("`slot_wall_mm` over the width of a slot without clearance"),
        |variant| Ok(variant.drive.slot_wall_mm() / (2.0 * variant.drive.slot_half_width_mm())),
    ),
    of_drive(
        "carrier_radial_space_mm",
        "mm",
        "Radial space for the carrier between wave generator and ring.",
        geometry("/carrier/radial_space_mm"),
        |variant| Ok(variant.drive.tip_radius_mm() - variant.drive.cam_outer_radius_mm()),
    ),
    of_drive(
        "tooth_center_clearance_inner_mm",
        "mm",
        "Smallest distance of an engaged tooth's centre from the inner limit of the carrier.",
        geometry("/carrier/tooth_center_clearance_inner_mm"),
        |variant| {
            let drive = variant.drive;
            let innermost = drive.flank().locus().at(drive.flank_limit().position)?;
            Ok(innermost.center_radius_mm - drive.cam_outer_radius_mm())
        },
    ),
    of_drive(
        "tooth_center_clearance_outer_mm",
        "mm",
        "Smallest distance of an engaged tooth's centre from the outer limit of the carrier.",
        geometry("/carrier/tooth_center_clearance_outer_mm"),
        |variant| {
            let drive = variant.drive;
            Ok(drive.tip_radius_mm() - (drive.cam_outer_radius_mm() + drive.parameters().tooth_radius_mm))
        },
    ),
    of_drive(
        "tooth_gap_min_mm",
        "mm",
        "Smallest gap between neighbouring teeth on their path.",
        geometry("/teeth/gap_min_mm"),
        |variant| {
            let drive = variant.drive;
            Ok(drive.least_center_distance_mm()? - 2.0 * drive.parameters().tooth_radius_mm)
        },
    ),
    of_sweep("input_torque_nm", "N·m", "Torque at the wave generator.", sweep("/load/input_torque_nm"), |variant| {
        Ok(variant.loaded(|loaded| loaded.checked.load().input_torque_nm(variant.drive)))
    }).depending_on(&TORQUE),
    of_sweep(
        "output_torque_nm",
        "N·m",
        "Torque at the carrier, ring fixed, without losses.",
        sweep("/load/output_torque_nm"),
        |variant| Ok(variant.loaded(|loaded| loaded.checked.load().output_torque_nm(variant.drive))),
    )
    .depending_on(&TORQUE),
    of_sweep(
        "peak_force_wave_generator_n",
        "N",
        "Largest force between tooth and wave generator.",
        sweep("/peaks/wave_generator/force_n/value"),
        |variant| Ok(variant.peaks(Contact::WaveGenerator, |peaks| peaks.force_n.value)),
    )
    .not_below_zero(),
    of_sweep(
        "peak_force_ring_n",
        "N",
        "Largest force between tooth and ring.",
        sweep("/peaks/ring/force_n/value"),
        |variant| Ok(variant.peaks(Contact::Ring, |peaks| peaks.force_n.value)),
    )
    .not_below_zero(),
    of_sweep(
        "peak_force_carrier_n",
        "N",
        "Largest force between tooth and carrier.",
        sweep("/peaks/carrier/force_n/value"),
        |variant| Ok(variant.peaks(Contact::Carrier, |peaks| peaks.force_n.value)),
    )
    .not_below_zero(),
    of_sweep(
        "peak_stress_wave_generator_mpa",
        "MPa",
        "Largest contact stress between tooth and wave generator.",
        sweep("/peaks/wave_generator/stress_mpa/value"),
        |variant| Ok(variant.peaks(Contact::WaveGenerator, |peaks| peaks.stress_mpa.value)),
    )
    .not_below_zero(),
    of_sweep(
        "peak_stress_ring_mpa",
        "MPa",
        "Largest contact stress between tooth and ring.",
        sweep("/peaks/ring/stress_mpa/value"),
        |variant| Ok(variant.peaks(Contact::Ring, |peaks| peaks.stress_mpa.value)),
    )
    .not_below_zero(),
    of_sweep(
        "peak_stress_carrier_mpa",
        "MPa",
        "Largest contact stress between tooth and carrier.",
        sweep("/peaks/carrier/stress_mpa/value"),
        |variant| Ok(variant.peaks(Contact::Carrier, |peaks| peaks.stress_mpa.value)),
    )
    .not_below_zero(),
    of_sweep(
        "peak_stress_mpa",
        "MPa",
        "Largest contact stress.",
        Source::Definition("the largest of the three contacts' peak stresses"),
        |variant| Ok(variant.greatest(|peaks| peaks.stress_mpa.value)),
    )
    .not_below_zero(),
    of_sweep(
        "peak_force_n",
        "N",
        "Largest contact force.",
        Source::Definition("the largest of the three contacts' peak forces"),
        |variant| Ok(variant.greatest(|peaks| peaks.force_n.value)),
    )
    .not_below_zero(),
    of_sweep(
        "half_width_wave_generator_mm",
        "mm",
        "Half the width of the wave generator's contact under its peak stress.",
        sweep("/peaks/wave_generator/half_width_mm"),
        |variant| Ok(variant.peaks(Contact::WaveGenerator, |peaks| peaks.half_width_mm)),
    )
    .not_below_zero(),
    of_sweep(
        "half_width_ring_mm",
        "mm",
        "Half the width of the ring's contact under its peak stress.",
        sweep("/peaks/ring/half_width_mm"),
        |variant| Ok(variant.peaks(Contact::Ring, |peaks| peaks.half_width_mm)),
    )
    .not_below_zero(),
    of_sweep(
        "half_width_carrier_mm",
        "mm",
        "Half the width of the carrier's contact under its peak stress.",
        sweep("/peaks/carrier/half_width_mm"),
        |variant| Ok(variant.peaks(Contact::Carrier, |peaks| peaks.half_width_mm)),
    )
    .not_below_zero(),
    of_sweep(
        "loaded_teeth_min",
        "",
        "Smallest number of loaded teeth over all input angles: in one zone if the zones are equal, otherwise in all zones together.",
        sweep("/loaded_teeth_per_zone/min"),
        #[expect(clippy::cast_precision_loss, reason = "a count of teeth")]
        |variant| Ok(variant.loaded(|loaded| loaded.peaks.loaded_teeth.min as f64)),
    )
    .not_below_zero(),
    of_sweep(
        "wind_up_min_deg",
        "deg",
        "Smallest wind-up of the input under load.",
        Source::Definition("the smallest of `/wind_up/wind_up_deg` of the sweep"),
        |variant| Ok(variant.loaded(|loaded| loaded.peaks.wind_up_deg.least)),
    ),
    of_sweep(
        "wind_up_max_deg",
        "deg",
        "Largest wind-up of the input under load.",
        Source::Definition("the largest of `/wind_up/wind_up_deg` of the sweep"),
        |variant| Ok(variant.loaded(|loaded| loaded.peaks.wind_up_deg.largest)),
    ),
    of_sweep(
        "torsional_stiffness_min_nm_per_rad",
        "N·m/rad",
        "Smallest torsional stiffness at the output over the period.",
        Source::Definition("the smallest of `/wind_up/torsional_stiffness_nm_per_rad` of the sweep"),
        |variant| Ok(variant.loaded(|loaded| loaded.peaks.torsional_stiffness_nm_per_rad.least)),
    ),
    of_sweep(
        "torsional_stiffness_max_nm_per_rad",
        "N·m/rad",
        "Largest torsional stiffness at the output over the period.",
        Source::Definition("the largest of `/wind_up/torsional_stiffness_nm_per_rad` of the sweep"),
        |variant| Ok(variant.loaded(|loaded| loaded.peaks.torsional_stiffness_nm_per_rad.largest)),
    ),
    of_sweep(
        "transmission_error_peak_to_peak_deg",
        "deg",
        "Peak-to-peak range of the wind-up over the period, at the output.",
        sweep("/wind_up/transmission_error_peak_to_peak_deg"),
        |variant| Ok(variant.loaded(|loaded| loaded.peaks.transmission_error_peak_to_peak_deg(variant.drive))),
    ),
    backlash(
        "backlash_mean_arcmin",
        "Mean backlash at the output over the input angle, without load.",
        "/wind_up/backlash/mean_arcmin",
        |variant| Ok(variant.backlash(Backlash::mean_arcmin)),
    ),
    backlash(
        "backlash_min_arcmin",
        "Smallest backlash at the output over the input angle. Parts interfere if it is below 0.",
        "/wind_up/backlash/smallest_arcmin",
        |variant| Ok(variant.backlash(|backlash| backlash.smallest.backlash_arcmin())),
    ),
    backlash(
        "backlash_max_arcmin",
        "Largest backlash at the output over the input angle.",
        "/wind_up/backlash/largest_arcmin",
        |variant| Ok(variant.backlash(|backlash| backlash.largest.backlash_arcmin())),
    ),
    of_sweep(
        "radial_force_max_n",
        "N",
        "Largest radial force of the teeth on the wave generator. 0 if the lobes balance each other.",
        Source::Definition("the largest of `/radial_force_n/value` of the sweep, 0 if it is absent"),
        |variant| Ok(variant.loaded(|loaded| loaded.radial_forces.as_ref().map_or(0.0, |forces| most(&forces.force_n)))),
    )
    .taking(Takes::RadialForces),
    of_sweep(
        "carrier_finger_share",
        "",
        "Deflection of a carrier finger over the deflection of a tooth at its contacts. 0 without an estimate. Above 0.2 there is a finding.",
        Source::Definition("the `share` of the finger with its actual support among `/series_compliance_estimates` of the sweep, 0 if it is absent"),
        |variant| Ok(variant.loaded(|loaded| loaded.checked.finger_share(&loaded.mean_peaks).unwrap_or(0.0))),
    )
    .not_below_zero(),
    of_sweep(
        "finger_stress_mpa",
        "MPa",
        "Largest bending stress at the foot of a carrier finger. 0 without a calculation, as for balls.",
        sweep("/fingers/stress_mpa"),
        |variant| Ok(variant.fingers(|stress| Some(stress.largest_mpa))),
    )
    .not_below_zero(),
    Quantity {
        needs: Needs::CarrierStrength,
        ..of_sweep(
            "finger_safety",
            "",
            "Safety of the carrier fingers against yield and fatigue. Below 1 there is a finding. 0 without a calculation, as for balls.",
            sweep("/fingers/safety"),
            |variant| Ok(variant.fingers(|stress| stress.safety.map(|safety| safety.least()))),
        )
        .not_below_zero()
    },
    of_capacity(
        "torque_capacity_input_nm",
        "Largest torque at the wave generator with which no contact exceeds the allowable stress and no finger its strength.",
        sweep("/torque_capacity/input_torque_nm"),
        |variant| Ok(variant.capacity(|input_nm, _| input_nm)),
    ),
    of_capacity(
        "torque_capacity_output_nm",
        "Largest torque at the carrier with which no contact exceeds the allowable stress and no finger its strength.",
        sweep("/torque_capacity/output_torque_nm"),
        |variant| Ok(variant.capacity(|_, output_nm| output_nm)),
    ),
    loss_ratio(
        "loss_ratio",
        "Mean power loss over the input torque times the speed of the wave generator relative to the carrier.",
        sweep("/losses/loss_ratio"),
        |variant| Ok(variant.losses(|losses| losses.loss_ratio)),
    ),
    loss_ratio(
        "loss_ratio_wave_generator",
        "Part of the loss ratio between teeth and wave generator.",
        sweep("/losses/loss_ratio_by_place/wave_generator"),
        |variant| Ok(variant.losses(|losses| losses.loss_ratio_by_place.wave_generator)),
    ),
    loss_ratio(
        "loss_ratio_ring",
        "Part of the loss ratio between teeth and ring.",
        sweep("/losses/loss_ratio_by_place/ring"),
        |variant| Ok(variant.losses(|losses| losses.loss_ratio_by_place.ring)),
    ),
    loss_ratio(
        "loss_ratio_carrier",
        "Part of the loss ratio between teeth and carrier.",
        sweep("/losses/loss_ratio_by_place/carrier"),
        |variant| Ok(variant.losses(|losses| losses.loss_ratio_by_place.carrier)),
    ),
    loss_ratio(
        "loss_ratio_bearing",
        "Part of the loss ratio in the bearing.",
        sweep("/losses/loss_ratio_by_place/bearing"),
        |variant| Ok(variant.losses(|losses| losses.loss_ratio_by_place.bearing)),
    ),
    efficiency(
        "efficiency_ring_fixed",
        "Efficiency if the wave generator drives the carrier.",
        sweep("/losses/efficiency/ring_fixed"),
        |variant| Ok(variant.losses(|losses| losses.efficiency.ring_fixed)),
    ),
    efficiency(
        "efficiency_ring_fixed_back_driven",
        "Efficiency if the carrier drives the wave generator. At or below 0 the drive is self-locking.",
        sweep("/losses/efficiency/ring_fixed_back_driven"),
        |variant| Ok(variant.losses(|losses| losses.efficiency.ring_fixed_back_driven)),
    ),
    of_losses(
        "efficiency_error",
        "",
        "Largest error of the efficiency that was measured at such losses.",
        sweep("/losses/efficiency_error"),
        |variant| Ok(variant.losses(|losses| losses.efficiency_error)),
    ),
    of_losses(
        "required_input_torque_nm",
        "N·m",
        "Torque that the wave generator needs with losses, ring fixed.",
        sweep("/losses/required_input_torque_nm"),
        |variant| Ok(variant.losses(|losses| losses.required_input_torque_nm)),
    ),
    of_losses("power_loss_w", "W", "Mean power loss, ring fixed.", sweep("/losses/power_loss_w"), |variant| {
        Ok(variant.losses(|losses| losses.power_loss_w.unwrap_or(f64::NAN)))
    }).at_speed(),
    pressure_velocity(
        "pressure_velocity_wave_generator_mpa_m_per_s",
        "Largest product of contact stress and sliding speed at the wave generator.",
        sweep("/losses/pressure_velocity_mpa_m_per_s/wave_generator/value"),
        |variant| Ok(variant.pressure_velocity(Contact::WaveGenerator)),
    ),
    pressure_velocity(
        "pressure_velocity_ring_mpa_m_per_s",
        "Largest product of contact stress and sliding speed at the ring.",
        sweep("/losses/pressure_velocity_mpa_m_per_s/ring/value"),
        |variant| Ok(variant.pressure_velocity(Contact::Ring)),
    ),
    pressure_velocity(
        "pressure_velocity_carrier_mpa_m_per_s",
        "Largest product of contact stress and sliding speed at the carrier.",
        sweep("/losses/pressure_velocity_mpa_m_per_s/carrier/value"),
        |variant| Ok(variant.pressure_velocity(Contact::Carrier)),
    ),
];

impl Quantity {
    const fn not_below_zero(self) -> Self {
        Self { least: 0.0, ..self }
    }

    const fn depending_on(self, depends_on: &'static [&'static str]) -> Self {
        Self { depends_on, ..self }
    }

    const fn said_by(self, place: &'static str) -> Self {
        Self { said_by: Some(place), ..self }
    }

    const fn taking(self, takes: Takes) -> Self {
        Self { takes, ..self }
    }

    const fn at_speed(self) -> Self {
        Self { needs: Needs::FrictionAndSpeed, ..self }
    }

    /// Returns the quantity with this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        QUANTITIES.iter().find(|quantity| quantity.name == name)
    }

    /// Computes the value.
    pub(crate) fn of(&self, variant: &Variant<'_>) -> Result<f64, NotConverged> {
        (self.of)(variant)
    }
}
