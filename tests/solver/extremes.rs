//! True extremes, wind-up and torque capacity against the 60-digit calculation of `tests/reference/reference.py`.

use toothwave_solver::contact::{SHEAR_DEPTH, SHEAR_SHARE};
use toothwave_solver::sweep::{LimitedBy, Points};
use toothwave_solver::{Contact, PerContact};

use crate::reference::{Case, Worst, number};

const CONTACTS: [(Contact, &str); 3] =
    [(Contact::WaveGenerator, "wave_generator"), (Contact::Ring, "ring"), (Contact::Carrier, "carrier")];

pub(crate) fn cases(group: &str) -> Vec<Case> {
    let all = Case::of(include_str!("../reference/extremes.json"));
    all.into_iter().filter(|case| case.0["group"] == group).collect()
}

#[test]
fn tolerance_sweep_finds_true_extremes() {
    let mut worst = Worst::default();
    for case in cases("extremes") {
        let (name, sweep) = (case.name(), case.sweep().unwrap());
        let Points::Tolerance(tolerance) = case.points() else { panic!("{name}") };
        let tolerance = tolerance.relative();
        let (expected, condition) = (&case.0["expected"], &case.0["condition"]);
        for (contact, word) in CONTACTS {
            let peaks = PerContact::get(&sweep.peaks, contact);
            for (kind, found) in [("force_n", peaks.force_n.value), ("stress_mpa", peaks.stress_mpa.value)] {
                let value = number(&expected["peaks"][word][kind]["value"]).unwrap();
                let rounding = condition["peaks"][word][kind]["value"].as_f64().unwrap_or(0.0);
                worst.see(kind, &name, (found - value).abs(), tolerance * value + rounding);
            }
        }
        let stiffness = number(&expected["torsional_stiffness_nm_per_rad_at_0"]).unwrap();
        let rounding = condition["torsional_stiffness_nm_per_rad_at_0"].as_f64().unwrap_or(0.0);
        let found = sweep.input_angles.torsional_stiffness_nm_per_rad[0];
        worst.see("torsional stiffness", &name, (found - stiffness).abs(), 1e-13 * stiffness + rounding);
        let loaded = expected["loaded_teeth_at_0"].as_u64().unwrap();
        assert_eq!(u64::from(sweep.input_angles.loaded_teeth[0]), loaded, "{name}");
    }
    worst.assert_all_within();
}

#[test]
fn peak_contact_has_hertz_width_and_shear() {
    let mut worst = Worst::default();
    for case in cases("extremes") {
        let (name, sweep) = (case.name(), case.sweep().unwrap());
        for (contact, word) in CONTACTS {
            let (found, expected) = (sweep.peaks.get(contact), &case.0["expected"]["peaks"][word]);
            let shear = SHEAR_SHARE * found.stress_mpa.value;
            let depth = SHEAR_DEPTH * found.half_width_mm;
            for (kind, found) in
                [("half_width_mm", found.half_width_mm), ("shear_stress_mpa", shear), ("shear_depth_mm", depth)]
            {
                let value = number(&expected[kind]).unwrap();
                // The width follows the peak's position to first order. The position's error is the root of the
                // tolerance.
                worst.see(kind, &name, (found - value).abs(), 1e-4 * value);
            }
        }
    }
    worst.assert_all_within();
}

#[test]
fn allowable_stress_is_reached_at_torque_capacity() {
    let mut worst = Worst::default();
    for case in cases("torque-capacity") {
        let (name, expected) = (case.name(), &case.0["expected"]["torque_capacity"]);
        let capacity = case.sweep().unwrap().torque_capacity.unwrap();
        let condition = &case.0["condition"]["torque_capacity"];
        for (kind, found) in
            [("input_torque_nm", capacity.input_torque_nm), ("output_torque_nm", capacity.output_torque_nm)]
        {
            let value = number(&expected[kind]).unwrap();
            let allowed = 1e-13 * value + condition[kind].as_f64().unwrap_or(0.0);
            worst.see(kind, &name, (found - value).abs(), allowed);
        }
        let (_, limited_by) =
            CONTACTS.iter().find(|(contact, _)| LimitedBy::from(*contact) == capacity.limited_by).unwrap();
        assert_eq!(Some(*limited_by), expected["limited_by"].as_str(), "{name}");
    }
    worst.assert_all_within();
}
