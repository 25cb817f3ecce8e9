//! The quantities, in the order of the tables.

use toothwave_solver::Contact;
use toothwave_solver::mesh::Mesh;

use super::variant::most;
use super::{
    Needs, OUTER_DIAMETER_MM, Quantity, Source, TRANSMISSION_RATIO, Takes, backlash, efficiency, flag, geometry,
    loss_ratio, mesh, of_capacity, of_drive, of_losses, of_sweep, pressure_velocity, sweep,
};

/// Paths of the numbers of teeth and lobes.
const COUNTS: [&str; 4] =
    ["/drive/wave_generator/kind", "/drive/wave_generator/lobes", "/drive/teeth/count", "/drive/ring/teeth"];

/// Paths that set the load and its torques.
const TORQUE: [&str; 5] = ["/load", COUNTS[0], COUNTS[1], COUNTS[2], COUNTS[3]];

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
    .depending_on(&["/drive/teeth"])
    .said_by("/drive/teeth/width_mm"),
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
            let steepest = variant.drive.ring_tooth().steepest_engaged()?;
            Ok(variant.drive.flank().at(&steepest).tan_pressure_angle.atan().to_degrees())
        },
    ),
    of_drive(
        "wave_generator_pressure_angle_max_deg",
        "deg",
        "Largest pressure angle of the wave generator at an engaged tooth.",
        geometry("/wave_generator/pressure_angle_max_deg"),
        |variant| Ok(variant.drive.ring_tooth().steepest_engaged()?.tan_pressure_angle.atan().to_degrees()),
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
        |variant| Ok(variant.backlash(|backlash| backlash.mean_arcmin)),
    ),
    backlash(
        "backlash_min_arcmin",
        "Smallest backlash at the output over the input angle. Parts interfere if it is below 0.",
        "/wind_up/backlash/smallest_arcmin",
        |variant| Ok(variant.backlash(|backlash| backlash.smallest_arcmin)),
    ),
    backlash(
        "backlash_max_arcmin",
        "Largest backlash at the output over the input angle.",
        "/wind_up/backlash/largest_arcmin",
        |variant| Ok(variant.backlash(|backlash| backlash.largest_arcmin)),
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
        "Deflection of a carrier finger over the deflection of a tooth at its contacts, for cylinders by `johnson` without a series compliance at the carrier. Above 0.2 there is a finding.",
        Source::Definition("the `share` of the finger with its support among `/series_compliance_estimates` of the sweep"),
        |variant| Ok(variant.loaded(|loaded| loaded.checked.finger_share(&loaded.mean_peaks).unwrap_or(f64::NAN))),
    )
    .not_below_zero()
    .or_absent(),
    of_sweep(
        "finger_stress_mpa",
        "MPa",
        "Largest bending stress at the foot of a carrier finger. Balls have none.",
        sweep("/fingers/stress_mpa"),
        |variant| Ok(variant.fingers(|stress| Some(stress.stress_mpa))),
    )
    .not_below_zero()
    .or_absent(),
    Quantity {
        needs: Needs::CarrierStrength,
        ..of_sweep(
            "finger_safety",
            "",
            "Safety of the carrier fingers against yield and fatigue. Below 1 there is a finding. Balls have none.",
            sweep("/fingers/safety"),
            |variant| Ok(variant.fingers(|stress| stress.safety)),
        )
        .not_below_zero()
        .or_absent()
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
        |variant| Ok(variant.losses(|losses| losses.efficiency.driven)),
    ),
    efficiency(
        "efficiency_ring_fixed_back_driven",
        "Efficiency if the carrier drives the wave generator. At or below 0 the drive is self-locking.",
        sweep("/losses/efficiency/ring_fixed_back_driven"),
        |variant| Ok(variant.losses(|losses| losses.efficiency.back_driven)),
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
