//! The documented examples, and the paper's cases against separate calculations.

use serde_json::{Value, json};

use crate::asking::{Answer, ENDPOINTS, Question, Service};
use crate::designs::{self, with};

/// The columns of `states` by name, in documented order.
const COLUMNS: [&str; 12] = [
    "input_angle_deg",
    "tooth",
    "position_deg",
    "center_radius_mm",
    "wave_generator_angle_deg",
    "ring_angle_deg",
    "force_wave_generator_n",
    "force_ring_n",
    "force_carrier_n",
    "stress_wave_generator_mpa",
    "stress_ring_mpa",
    "stress_carrier_mpa",
];

/// Asserts that the answer has the documented names, types and values (to 1e-12). A documented `[]` stands for numbers.
fn assert_says(found: &Value, expected: &Value, at: &str) {
    match expected {
        Value::Object(fields) => {
            assert!(found.is_object(), "{at} is {found}");
            for (name, expected) in fields {
                let found = found.get(name).unwrap_or_else(|| panic!("{at} has no `{name}`"));
                assert_says(found, expected, &format!("{at}/{name}"));
            }
        }
        Value::Array(elided) if elided.is_empty() => {
            let column = found.as_array().unwrap_or_else(|| panic!("{at} is {found}"));
            assert!(!column.is_empty() && column.iter().all(Value::is_number), "{at} holds not numbers alone");
        }
        Value::Number(expected) => {
            let (found, expected) =
                (found.as_f64().unwrap_or_else(|| panic!("{at} is {found}")), expected.as_f64().unwrap());
            let error = (found - expected).abs();
            assert!(error <= 1e-12 * expected.abs().max(1.0), "{at} is {found:?}, not {expected:?}");
        }
        _ => assert_eq!(found, expected, "{at}"),
    }
}

async fn answered(path: &str, document: &Value) -> Value {
    Service::new().post(path, document).await.found()
}

/// Returns case 5.1 as documented and as the service's example.
async fn case_5_1() -> [Value; 2] {
    let contract = serde_json::from_str(designs::CONTRACT).unwrap();
    [contract, example("paper-5.1").await]
}

async fn example(name: &str) -> Value {
    Service::new().get(&format!("/v1/examples/{name}")).await.found()
}

fn column<'a>(answer: &'a Value, name: &str) -> Vec<&'a Value> {
    answer["states"][name].as_array().unwrap_or_else(|| panic!("no column `{name}`")).iter().collect()
}

fn numbers(answer: &Value, name: &str) -> Vec<f64> {
    column(answer, name).into_iter().map(|value| value.as_f64().unwrap()).collect()
}

/// Returns the index range of the states at each input angle.
fn by_input_angle(answer: &Value) -> Vec<std::ops::Range<usize>> {
    let angles = numbers(answer, "input_angle_deg");
    let mut groups = Vec::new();
    let mut start = 0;
    for index in 1..=angles.len() {
        if index == angles.len() || angles[index] != angles[start] {
            groups.push(start..index);
            start = index;
        }
    }
    groups
}

fn assert_near(found: &Value, expected: f64, tolerance: f64) {
    let found = found.as_f64().unwrap();
    assert!((found - expected).abs() <= tolerance, "{found:?} is not {expected:?}");
}

#[tokio::test]
async fn case_5_1_geometry_matches_documented_values() {
    let expected = json!({
        "solver_version": "0.2.0",
        "transmission_ratio": 14.0, "transmission_ratio_carrier_fixed": -13.0,
        "period_deg": 13.846153846153847,
        "undercut": { "occurs": false, "critical_tooth_radius_mm": 6.749189868666484 },
        "engagement": { "start_deg": 90.0, "end_deg": 0.0 },
        "ring": { "root_radius_mm": 68.0, "tip_radius_mm": 66.0, "profile": { "x_mm": [], "y_mm": [] } },
        "wave_generator": { "profile": { "x_mm": [], "y_mm": [] } },
        "tooth_center_path": { "x_mm": [], "y_mm": [] }
    });
    for document in case_5_1().await {
        assert_says(&answered("/v1/geometry", &document).await, &expected, "");
    }
}

#[tokio::test]
async fn case_5_1_coincidence_degree_matches_documented_value() {
    let expected = json!({
        "solver_version": "0.2.0",
        "coincidence_degree": 14.0,
        "engagement": { "start_deg": 90.0, "end_deg": 0.0 },
        "teeth_in_mesh_per_zone": { "min": 7, "max": 7 },
        "undercut": { "occurs": false, "critical_tooth_radius_mm": 6.749189868666484 },
        "period_deg": 13.846153846153847
    });
    for document in case_5_1().await {
        let found = answered("/v1/coincidence-degree", &document).await;
        assert_says(&found, &expected, "");
        assert_eq!(found["teeth_in_mesh_per_zone"], json!({ "min": 7, "max": 7 }), "counts are whole numbers");
    }
}

#[tokio::test]
async fn case_5_1_sweep_matches_documented_values() {
    let peak = json!({ "value": [], "input_angle_deg": [], "position_deg": [] });
    let peak_fields: Vec<_> = peak.as_object().unwrap().keys().cloned().collect();
    let expected = json!({
        "solver_version": "0.2.0",
        "coincidence_degree": 14.0, "period_deg": 13.846153846153847,
        "peaks": {
            "wave_generator": {
                "force_n": { "value": 1429.443293502519, "input_angle_deg": 8.307692307692308, "position_deg": 43.71428571428571 },
                "stress_mpa": { "value": 872.6059464961, "input_angle_deg": 8.584615384615384, "position_deg": 43.45714285714286 }
            }
        },
        "states": COLUMNS.iter().map(|&name| (name, json!([]))).collect::<std::collections::BTreeMap<_, _>>()
    });
    for document in case_5_1().await {
        let found = answered("/v1/sweep", &document).await;
        assert_says(&found, &expected, "");
        for contact in ["wave_generator", "ring", "carrier"] {
            for quantity in ["force_n", "stress_mpa"] {
                for field in &peak_fields {
                    assert!(found["peaks"][contact][quantity][field].is_f64(), "{contact}/{quantity}/{field}");
                }
            }
        }
        for check in ["torque_balance_residual", "period_closure_residual"] {
            let residual = found["checks"][check].as_f64().unwrap();
            assert!((0.0..=1e-12).contains(&residual), "{check} is {residual:?}");
        }
    }
}

#[tokio::test]
async fn documented_document_has_no_findings() {
    let document = serde_json::from_str(designs::CONTRACT).unwrap();
    for path in ENDPOINTS {
        assert_eq!(answered(path, &document).await["findings"], json!([]), "{path}");
    }
}

#[tokio::test]
async fn case_5_1_with_stiff_fingers_has_no_findings() {
    let parts = json!({ "carrier": { "fingers": "held_at_both_ends" } });
    let document = with(&designs::shortest(), "/parts", parts);
    for path in ENDPOINTS {
        assert_eq!(answered(path, &document).await["findings"], json!([]), "{path}");
    }
}

/// Asserts the six peaks to three decimals, known from separate calculations.
async fn assert_peaks(compatibility: &str, expected: [f64; 6]) {
    let document = with(&designs::spelled_out(), "/model/compatibility", json!(compatibility));
    let peaks = &answered("/v1/sweep", &document).await["peaks"];
    let contacts = ["wave_generator", "ring", "carrier"];
    let found = ["force_n", "stress_mpa"]
        .iter()
        .flat_map(|quantity| contacts.map(|contact| &peaks[contact][quantity]["value"]));
    for (found, expected) in found.zip(expected) {
        assert_near(found, expected, 5.01e-4);
    }
}

#[tokio::test]
async fn case_5_1_has_known_projection_peaks() {
    assert_peaks("projection", [1429.443, 1549.279, 645.337, 872.606, 980.437, 562.162]).await;
}

#[tokio::test]
async fn case_5_1_has_known_virtual_work_peaks() {
    assert_peaks("virtual_work", [1370.248, 1485.085, 618.576, 854.363, 1014.466, 550.383]).await;
}

#[tokio::test]
async fn case_5_1_has_known_places_of_peaks() {
    for (compatibility, ring_stress_deg, force_deg) in [("projection", 70.2, 43.7), ("virtual_work", 72.8, 43.5)] {
        let document = with(&designs::spelled_out(), "/model/compatibility", json!(compatibility));
        let peaks = &answered("/v1/sweep", &document).await["peaks"];
        // Samples are 12.857°/50 apart.
        assert_near(&peaks["ring"]["stress_mpa"]["position_deg"], ring_stress_deg, 0.26);
        assert_near(&peaks["wave_generator"]["force_n"]["position_deg"], force_deg, 0.26);
    }
}

#[tokio::test]
async fn case_5_2_has_known_undercut() {
    let found = answered("/v1/coincidence-degree", &example("paper-5.2").await).await;
    assert_eq!(found["undercut"]["occurs"], true);
    assert_near(&found["coincidence_degree"], 9.690_577_523_835, 1e-12);
    assert_near(&found["engagement"]["start_deg"], 43.607_598_857_26, 1e-11);
    assert_eq!(found["engagement"]["end_deg"], 0.0);
    assert_eq!(found["teeth_in_mesh_per_zone"], json!({ "min": 4, "max": 5 }));
    assert_near(&found["period_deg"], 360.0 * 2.0 / 78.0, 1e-14);
    let geometry = answered("/v1/geometry", &example("paper-5.2").await).await;
    assert_eq!(
        (&geometry["transmission_ratio"], &geometry["transmission_ratio_carrier_fixed"]),
        (&json!(40.0), &json!(-39.0))
    );
}

#[tokio::test]
async fn bored_case_5_2_matches_the_paper() {
    let document = example("paper-5.2-bored").await;
    assert_eq!(document["drive"]["ring"]["tip_radius_mm"], 52.8227);
    let found = answered("/v1/coincidence-degree", &document).await;
    assert_near(&found["coincidence_degree"], 7.5730, 5e-5);
    assert_near(&found["engagement"]["start_deg"], 34.0787, 5e-5);
    assert_eq!(found["teeth_in_mesh_per_zone"], json!({ "min": 3, "max": 4 }));
    assert_eq!(found["undercut"]["occurs"], true, "before the bore");
    assert_eq!(answered("/v1/geometry", &document).await["ring"]["tip_radius_mm"], 52.8227);
}

#[tokio::test]
async fn critical_radius_is_omitted_without_undercut() {
    let rounder = with(&designs::shortest(), "/drive/wave_generator/semi_minor_mm", json!(57.9));
    for path in ["/v1/geometry", "/v1/coincidence-degree"] {
        assert_eq!(answered(path, &rounder).await["undercut"], json!({ "occurs": false }), "{path}");
    }
}

#[tokio::test]
async fn states_are_equal_columns_in_order() {
    for document in [designs::spelled_out(), designs::undercut(), designs::bored()] {
        let found = answered("/v1/sweep", &document).await;
        let fields = found["states"].as_object().unwrap();
        assert_eq!(fields.len(), COLUMNS.len(), "{:?}", fields.keys());
        let angles = numbers(&found, "input_angle_deg");
        for name in COLUMNS {
            assert_eq!(column(&found, name).len(), angles.len(), "{name}");
        }
        let teeth: Vec<_> = column(&found, "tooth").iter().map(|tooth| tooth.as_u64().unwrap()).collect();
        for i in 1..angles.len() {
            let before = (angles[i - 1], teeth[i - 1]);
            assert!(before < (angles[i], teeth[i]), "{before:?} stands before {:?}", (angles[i], teeth[i]));
        }
    }
}

#[tokio::test]
async fn sweep_has_one_angle_more_than_samples() {
    for samples in [1_u32, 2, 3, 50, 333] {
        let document = with(&designs::undercut(), "/sweep", json!({ "samples": samples }));
        let found = answered("/v1/sweep", &document).await;
        let angles = numbers(&found, "input_angle_deg");
        let firsts: Vec<_> = by_input_angle(&found).iter().map(|group| angles[group.start]).collect();
        assert_eq!(firsts.len(), samples as usize + 1);
        let period_deg = found["period_deg"].as_f64().unwrap();
        assert_eq!((firsts[0], firsts[samples as usize]), (0.0, period_deg));
        for (n, angle) in (0_u32..).zip(&firsts) {
            let expected = period_deg * f64::from(n) / f64::from(samples);
            assert!((angle - expected).abs() <= 1e-14 * period_deg, "{angle:?} is not {expected:?}");
        }
    }
}

#[tokio::test]
async fn states_hold_teeth_between_root_and_flank_end() {
    for document in [designs::spelled_out(), designs::undercut(), designs::bored()] {
        let found = answered("/v1/sweep", &document).await;
        let end_deg = answered("/v1/geometry", &document).await["engagement"]["start_deg"].as_f64().unwrap();
        let installed = document["drive"]["teeth"]["installed"].as_f64().unwrap();
        let (count, ring) = (
            document["drive"]["teeth"]["count"].as_f64().unwrap(),
            document["drive"]["ring"]["teeth"].as_f64().unwrap(),
        );
        let (positions, angles) = (numbers(&found, "position_deg"), numbers(&found, "input_angle_deg"));
        let teeth = numbers(&found, "tooth");
        for group in by_input_angle(&found) {
            let here = &positions[group.clone()];
            assert!(here.iter().all(|&psi| 0.0 < psi && psi <= end_deg), "{here:?}");
            let spacing_deg = 360.0 / installed;
            assert!(here[0] <= spacing_deg * (1.0 + 1e-14), "a tooth is left out at the root: {here:?}");
            assert!(here[here.len() - 1] + spacing_deg > end_deg, "a tooth is left out at the tip: {here:?}");
            for i in group {
                let expected = teeth[i] * spacing_deg - angles[i] * ring / count;
                assert!((positions[i] - expected).abs() <= 1e-12, "{} is not {expected}", positions[i]);
            }
        }
    }
}

#[tokio::test]
async fn tooth_at_tip_meshes_and_at_root_not() {
    let found = answered("/v1/sweep", &designs::spelled_out()).await;
    let positions = numbers(&found, "position_deg");
    for group in by_input_angle(&found) {
        assert_eq!(group.len(), 7, "seven teeth at every input angle");
    }
    let (first, last) = (by_input_angle(&found).remove(0), by_input_angle(&found).pop().unwrap());
    assert_eq!(positions[first.end - 1], 90.0);
    assert_eq!(positions[last.end - 1], 90.0);
    let at_tip = first.end - 1;
    for name in ["force_wave_generator_n", "force_ring_n", "force_carrier_n", "stress_ring_mpa"] {
        assert_eq!(numbers(&found, name)[at_tip], 0.0, "{name}: no lever arm, no load");
    }
    for name in ["wave_generator_angle_deg", "ring_angle_deg"] {
        assert_eq!(numbers(&found, name)[at_tip], 0.0, "{name}: on the minor axis, on the ring's tip");
    }
}

#[tokio::test]
async fn period_ends_as_it_began_with_teeth_renumbered() {
    for document in [designs::spelled_out(), designs::undercut(), designs::bored()] {
        let found = answered("/v1/sweep", &document).await;
        let (first, last) = (by_input_angle(&found).remove(0), by_input_angle(&found).pop().unwrap());
        for name in &COLUMNS[2..] {
            let column = numbers(&found, name);
            let scale = column.iter().copied().fold(0.0, f64::max);
            for (start, end) in column[first.clone()].iter().zip(&column[last.clone()]) {
                assert!((start - end).abs() <= 1e-12 * scale, "{name}: {start:?} became {end:?}");
            }
        }
        let teeth = numbers(&found, "tooth");
        for (start, end) in teeth[first.clone()].iter().zip(&teeth[last.clone()]) {
            assert_eq!(start + 1.0, *end);
        }
    }
}

#[tokio::test]
async fn slots_carry_output_torque_at_every_angle() {
    for (document, input_nm) in [(designs::spelled_out(), 20.0), (designs::undercut(), 3.0), (designs::bored(), 3.0)] {
        for compatibility in ["projection", "virtual_work"] {
            let document = with(&document, "/model", json!({ "compatibility": compatibility }));
            let found = answered("/v1/sweep", &document).await;
            let output_nm = input_nm * document["drive"]["teeth"]["count"].as_f64().unwrap() / 2.0;
            let (forces, radii) = (numbers(&found, "force_carrier_n"), numbers(&found, "center_radius_mm"));
            for group in by_input_angle(&found) {
                let torque_nm: f64 = group.map(|i| 2.0 * forces[i] * 1e-3 * radii[i]).sum();
                assert!((torque_nm / output_nm - 1.0).abs() <= 1e-12, "{torque_nm} is not {output_nm}");
            }
        }
    }
}

#[tokio::test]
async fn torque_at_carrier_equals_torque_at_wave_generator() {
    let document = with(&designs::spelled_out(), "/load", json!({ "output_torque_nm": 280.0 }));
    let (by_output, by_input) =
        (answered("/v1/sweep", &document).await, answered("/v1/sweep", &designs::spelled_out()).await);
    for name in COLUMNS {
        for (found, expected) in numbers(&by_output, name).iter().zip(numbers(&by_input, name)) {
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{name}: {found:?} is not {expected:?}");
        }
    }
}

#[tokio::test]
async fn wave_generator_angle_is_place_of_contact() {
    for document in [designs::spelled_out(), designs::undercut()] {
        let found = answered("/v1/sweep", &document).await;
        let cam = &document["drive"]["wave_generator"];
        let (a, b) = (cam["semi_major_mm"].as_f64().unwrap(), cam["semi_minor_mm"].as_f64().unwrap());
        let r = document["drive"]["teeth"]["radius_mm"].as_f64().unwrap();
        let (angles, positions) = (numbers(&found, "wave_generator_angle_deg"), numbers(&found, "position_deg"));
        for (i, d) in numbers(&found, "center_radius_mm").into_iter().enumerate() {
            let (sin, cos) = positions[i].to_radians().sin_cos();
            // The angle counts from the minor axis. Its point on the ellipse is r from the tooth's centre, the least
            // distance.
            let distance = |angle_deg: f64| {
                let (y, x) = angle_deg.to_radians().sin_cos();
                let radius = a * b / (a * x).hypot(b * y);
                (d * cos - radius * y).hypot(d * sin - radius * x)
            };
            assert!((distance(angles[i]) - r).abs() <= 1e-11, "{} mm at {}°", distance(angles[i]), angles[i]);
            assert!(distance(angles[i] - 0.1) > r && distance(angles[i] + 0.1) > r);
        }
    }
}

#[tokio::test]
async fn peaks_are_column_maxima_with_their_state() {
    for document in [designs::spelled_out(), designs::undercut(), designs::bored()] {
        let found = answered("/v1/sweep", &document).await;
        let (angles, positions) = (numbers(&found, "input_angle_deg"), numbers(&found, "position_deg"));
        for contact in ["wave_generator", "ring", "carrier"] {
            for (quantity, column) in
                [("force_n", format!("force_{contact}_n")), ("stress_mpa", format!("stress_{contact}_mpa"))]
            {
                let peak = &found["peaks"][contact][quantity];
                let column = numbers(&found, &column);
                assert_eq!(peak["value"], column.iter().copied().fold(0.0, f64::max), "{contact} {quantity}");
                let names_a_state = (0..column.len()).any(|i| {
                    peak["value"] == column[i]
                        && peak["input_angle_deg"] == angles[i]
                        && peak["position_deg"] == positions[i]
                });
                assert!(names_a_state, "{peak}");
            }
        }
    }
}

/// Returns the force at the wave generator over the peak, in a tooth's first and last state.
async fn entering_and_leaving(document: &Value) -> (f64, f64) {
    let found = answered("/v1/sweep", document).await;
    let groups = by_input_angle(&found);
    let (forces, teeth) = (numbers(&found, "force_wave_generator_n"), numbers(&found, "tooth"));
    let peak = forces.iter().copied().fold(0.0, f64::max);
    let (mut entering, mut leaving) = (f64::INFINITY, 0.0_f64);
    for pair in groups.windows(2) {
        let (before, after) = (&pair[0], &pair[1]);
        for i in after.clone().filter(|&i| !teeth[before.clone()].contains(&teeth[i])) {
            entering = entering.min(forces[i] / peak);
        }
        for i in before.clone().filter(|&i| !teeth[after.clone()].contains(&teeth[i])) {
            leaving = leaving.max(forces[i] / peak);
        }
    }
    (entering, leaving)
}

#[tokio::test]
async fn case_5_2_load_jumps_only_at_entry() {
    for document in [designs::undercut(), designs::bored()] {
        let document = with(&document, "/sweep", json!({ "samples": 1000 }));
        let (entering, leaving) = entering_and_leaving(&document).await;
        assert!(entering.is_finite() && entering > 0.5, "a tooth enters with {entering} of the peak");
        assert!(leaving < 2e-3, "a tooth leaves with {leaving} of the peak");
    }
}

#[tokio::test]
async fn case_5_2_entering_tooth_unloads_others() {
    let document = with(&designs::undercut(), "/sweep", json!({ "samples": 1000 }));
    let found = answered("/v1/sweep", &document).await;
    let (forces, teeth) = (numbers(&found, "force_wave_generator_n"), numbers(&found, "tooth"));
    let mut drops = 0;
    for pair in by_input_angle(&found).windows(2) {
        let (before, after) = (pair[0].clone(), pair[1].clone());
        if teeth[after.clone()].last() > teeth[before.clone()].last() {
            drops += 1;
            for i in before {
                if let Some(same) = after.clone().find(|&same| teeth[same] == teeth[i]) {
                    assert!(
                        forces[same] < 0.85 * forces[i],
                        "tooth {} from {} to {} N",
                        teeth[i],
                        forces[i],
                        forces[same]
                    );
                }
            }
        }
    }
    assert_eq!(drops, 1, "one tooth enters in a period");
}

#[tokio::test]
async fn case_5_1_load_is_zero_at_ends() {
    let document = with(&designs::spelled_out(), "/sweep", json!({ "samples": 1000 }));
    let (entering, leaving) = entering_and_leaving(&document).await;
    assert!(entering < 2e-3 && leaving < 2e-3, "from {entering} to {leaving} of the peak");
}

#[tokio::test]
async fn csv_has_states_and_names_of_json() {
    for document in [designs::spelled_out(), designs::undercut(), designs::bored()] {
        let service = Service::new();
        let json = service.post("/v1/sweep", &document).await.found();
        let question = Question::post("/v1/sweep", document.to_string()).with("accept", "text/csv");
        let answer: Answer = service.ask(&question).await;
        assert_eq!(answer.status, 200);
        assert!(answer.header("content-type").starts_with("text/csv"), "{}", answer.header("content-type"));
        let mut csv = csv::Reader::from_reader(answer.body.as_slice());
        assert_eq!(csv.headers().unwrap().iter().collect::<Vec<_>>(), COLUMNS);
        let mut rows = 0;
        for (row, record) in csv.records().enumerate() {
            let record = record.unwrap();
            for (cell, name) in record.iter().zip(COLUMNS) {
                assert_eq!(
                    cell.parse::<f64>().unwrap(),
                    json["states"][name][row].as_f64().unwrap(),
                    "{name} of row {row}"
                );
            }
            rows += 1;
        }
        assert_eq!(rows, column(&json, "tooth").len());
    }
}
