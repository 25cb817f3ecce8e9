//! Normal form of the deviations.

use toothwave_solver::{Deviations, DriveParameters};

/// Clears each list that has a zero for every item, which is equivalent.
pub(super) fn leave_out_zeros(deviations: &mut Deviations, drive: &DriveParameters) {
    for (list, items) in [
        (&mut deviations.tooth_radius_um, drive.installed),
        (&mut deviations.slot_angle_arcsec, drive.installed),
        (&mut deviations.slot_wall_um, drive.installed),
        (&mut deviations.ring_space_um, drive.ring_teeth),
        (&mut deviations.ring_space_angle_arcsec, drive.ring_teeth),
        (&mut deviations.wave_generator_lobe_um, drive.wave_generator.lobes()),
    ] {
        if usize::try_from(items) == Ok(list.len()) && list.iter().all(|&value| value == 0.0) {
            list.clear();
        }
    }
}
