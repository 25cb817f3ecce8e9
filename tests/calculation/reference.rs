//! Documents of every kind against `tests/reference/family.py`, an independent calculation to 25 digits.
//! The worst error is 4.6e-15 of a column's peak.

use std::collections::BTreeMap;

use serde_json::Value;
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_solver::Never;

/// Allowed error over the column's largest compared value. The reference has exactly the documents' numbers.
const TOLERANCE: f64 = 1e-12;

const CONTACTS: [&str; 3] = ["wave_generator", "ring", "carrier"];

fn cases() -> Vec<Value> {
    let file: Value = serde_json::from_str(include_str!("../reference/family.json")).unwrap();
    let mut cases = file["cases"].as_array().unwrap().clone();
    // The reference has no refinements.
    cases.iter_mut().for_each(|case| case["document"]["model"]["refinements"] = "none".into());
    cases
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| value.as_str().unwrap().parse().unwrap())
}

fn column<'a>(table: &'a Value, name: &str) -> &'a Vec<Value> {
    table[name].as_array().unwrap_or_else(|| panic!("no column {name}"))
}

fn asked(question: &impl Question, document: &Value) -> Value {
    let limits = Limits::new(1_000_000, 1_000_000);
    let answer = question.ask(document.to_string().as_bytes(), &limits, &Never).expect("an answer");
    serde_json::to_value(&answer).unwrap()
}

#[test]
fn every_kind_matches_the_reference() {
    let mut worst = BTreeMap::new();
    let mut compared = 0;
    for case in cases() {
        let name = case["name"].as_str().unwrap();
        let answer = asked(&Sweep, &case["document"]);
        let (states, wind_up) = (&answer["states"], &answer["wind_up"]);
        let samples = case["document"]["sweep"]["samples"].as_f64().unwrap();
        let period_deg = number(&answer["period_deg"]);
        let lobes = states.get("lobe").and_then(Value::as_array);
        assert_eq!(lobes.is_none(), case["alike"].as_bool().unwrap(), "{name}");
        // Error and largest value of each column.
        let mut columns: BTreeMap<String, (f64, f64)> = BTreeMap::new();
        let mut compare = |name: &str, found: f64, expected: f64| {
            compared += 1;
            let (off, most) = columns.entry(name.to_owned()).or_default();
            *off = off.max((found - expected).abs());
            *most = most.max(expected.abs());
        };
        for expected in case["states"].as_array().unwrap() {
            let input_deg = period_deg * expected["interval"].as_f64().unwrap() / samples;
            let at = |table: &Value| -> Vec<usize> {
                let angles = column(table, "input_angle_deg").iter().map(number).enumerate();
                angles.filter(|(_, angle)| (angle - input_deg).abs() < 1e-6 * period_deg).map(|(row, _)| row).collect()
            };
            let rows = at(states);
            let teeth = expected["teeth"].as_array().unwrap();
            for tooth in teeth {
                let position_deg = number(&tooth["position_deg"]);
                let row = rows.iter().copied().find(|&row| {
                    (number(&column(states, "position_deg")[row]) - position_deg).abs() < 1e-9
                        && lobes.is_none_or(|lobes| lobes[row] == tooth["lobe"])
                });
                let row = row.unwrap_or_else(|| panic!("{name}: no tooth at {position_deg}"));
                if lobes.is_some() {
                    assert_eq!(column(states, "tooth")[row], tooth["slot"], "{name} at {position_deg}");
                }
                for (index, contact) in CONTACTS.iter().enumerate() {
                    for (column_name, key) in
                        [(format!("force_{contact}_n"), "force_n"), (format!("stress_{contact}_mpa"), "stress_mpa")]
                    {
                        compare(&column_name, number(&column(states, &column_name)[row]), number(&tooth[key][index]));
                    }
                }
            }
            // Additional states are unloaded teeth at a regular tip.
            for &row in &rows {
                let position_deg = number(&column(states, "position_deg")[row]);
                let is_known = teeth.iter().any(|tooth| (number(&tooth["position_deg"]) - position_deg).abs() < 1e-9);
                assert!(is_known || number(&column(states, "force_ring_n")[row]) == 0.0, "{name} at {position_deg}");
            }
            let [row] = at(wind_up)[..] else { panic!("{name}: {input_deg}") };
            compare("wind_up_deg", number(&column(wind_up, "wind_up_deg")[row]), number(&expected["wind_up_deg"]));
            if let Some(unloaded) = wind_up["unloaded_wind_up_deg"].as_array() {
                let expected = number(&expected["unloaded_wind_up_deg"]);
                compare("unloaded_wind_up_deg", number(&unloaded[row]), expected);
            } else {
                assert!(number(&expected["unloaded_wind_up_deg"]) == 0.0, "{name}");
            }
        }
        for (column, (off, most)) in columns {
            let share = if most > 0.0 { off / most } else { off };
            assert!(share <= TOLERANCE, "{name}, {column}: off by {share:.1e} of its peak");
            let so_far = worst.entry(column).or_insert((0.0, String::new()));
            if share > so_far.0 {
                *so_far = (share, name.to_owned());
            }
        }
    }
    assert!(compared > 1900, "{compared}");
    println!("{compared} numbers; worst of each column, of its peak:");
    for (column, (share, name)) in worst {
        println!("  {column:28} {share:.1e}  {name}");
    }
}

#[test]
fn speeds_are_those_of_rolling_contacts() {
    for case in cases() {
        let answer = asked(&Geometry, &case["document"]);
        for (fixed, expected) in case["members"].as_object().unwrap() {
            let ratio = number(&expected[2]) / number(&expected[3]);
            let member = &answer["members"][format!("{fixed}_fixed")];
            let found = number(&member["ratio"]);
            assert!((found / ratio - 1.0).abs() < 1e-15, "{}, {fixed} fixed: {found} is not {ratio}", case["name"]);
            // Power is conserved and the three torques balance.
            let held = number(&member["holding_torque_ratio"]);
            assert!((held - (ratio - 1.0)).abs() < 1e-14 * ratio.abs(), "{}, {fixed} fixed: {held}", case["name"]);
        }
    }
}
