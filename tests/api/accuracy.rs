//! Errors and solve times of each way to calculate, against 40 digits.

use serde_json::{Value, json};

use crate::asking::Service;
use crate::designs::{spelled_out, with};

const CONTACTS: [&str; 3] = ["wave_generator", "ring", "carrier"];

/// Reads reference cases with true extremes: the paper's, a bored one and a hard one.
fn cases() -> Vec<Value> {
    let file: Value = serde_json::from_str(include_str!("../reference/extremes.json")).unwrap();
    let cases = file["cases"].as_array().unwrap().iter().filter(|case| {
        let name = case["name"].as_str().unwrap();
        case["group"] == "extremes"
            && ["5.1 ", "5.2 ", "1e-6 above undercut"].iter().any(|start| name.starts_with(start))
            && !name.contains("palmgren")
            && !name.contains("um")
    });
    // The reference has no refinements.
    cases.map(|case| with(case, "/document/model/refinements", json!("none"))).collect()
}

fn ways(answer: &Value) -> &Vec<Value> {
    answer["ways"].as_array().unwrap()
}

/// Returns the largest relative error of the peaks of a sweep against 40 digits.
fn true_error(sweep: &Value, case: &Value) -> f64 {
    let mut worst = 0.0_f64;
    for contact in CONTACTS {
        for kind in ["force_n", "stress_mpa"] {
            let found = sweep["peaks"][contact][kind]["value"].as_f64().unwrap();
            let value: f64 = case["expected"]["peaks"][contact][kind]["value"].as_str().unwrap().parse().unwrap();
            worst = worst.max((found - value).abs() / value);
        }
    }
    worst
}

#[tokio::test]
async fn reported_errors_match_40_digit_reference() {
    let cases = cases();
    assert!(cases.len() >= 6, "{}", cases.len());
    for case in &cases {
        let service = Service::new();
        let answer = service.post("/v1/accuracy", &case["document"]).await.found();
        let compatibility = &case["document"]["model"]["compatibility"];
        let law = &case["document"]["model"]["stiffness"]["law"];
        let own = ways(&answer).iter().filter(|way| way["compatibility"] == *compatibility && way["law"] == *law);
        let mut seen = 0;
        for way in own {
            let points = match way.get("samples") {
                Some(samples) => json!({ "samples": samples }),
                None => json!({ "tolerance": way["tolerance"] }),
            };
            let sweep = service.post("/v1/sweep", &with(&case["document"], "/sweep", points)).await.found();
            let (told, known) = (way["error"].as_f64().unwrap(), true_error(&sweep, case));
            // The hardest case has a condition of 1e-9.
            assert!((told - known).abs() <= 1e-6 * known + 2e-9, "{}: {told:e}, not {known:e}: {way}", case["name"]);
            assert_eq!(way["states"], sweep["states"]["tooth"].as_array().unwrap().len());
            seen += 1;
        }
        assert_eq!(seen, 14);
    }
}

#[tokio::test]
async fn cheapest_way_is_fastest_within_requested_error() {
    for requested in [1e-2, 1e-4, 1e-8] {
        let document = with(&spelled_out(), "/accuracy", json!({ "requested_error": requested }));
        let answer = Service::new().post("/v1/accuracy", &document).await.found();
        let cheapest = &answer["cheapest"];
        assert!(cheapest["error"].as_f64().unwrap() <= requested);
        assert_eq!((&cheapest["compatibility"], &cheapest["law"]), (&json!("projection"), &json!("linear")));
        for way in ways(&answer) {
            let is_own = way["compatibility"] == "projection" && way["law"] == "linear";
            if is_own && way["error"].as_f64().unwrap() <= requested {
                assert!(way["solve_us"].as_f64().unwrap() >= cheapest["solve_us"].as_f64().unwrap());
            }
        }
    }
}

#[tokio::test]
async fn reports_difference_of_every_model_to_own() {
    let document = with(&spelled_out(), "/parts", json!({ "carrier": { "fingers": "held_at_both_ends" } }));
    let answer = Service::new().post("/v1/accuracy", &document).await.found();
    let models: std::collections::BTreeSet<_> = ways(&answer)
        .iter()
        .map(|way| (way["compatibility"].as_str().unwrap(), way["law"].as_str().unwrap()))
        .collect();
    let all = ["projection", "virtual_work"].into_iter().flat_map(|form| [(form, "linear"), (form, "palmgren")]);
    assert_eq!(models, all.chain([("virtual_work", "johnson")]).collect());
    for way in ways(&answer) {
        let is_own = way["compatibility"] == "projection" && way["law"] == "linear";
        let difference = way["model_difference"].as_f64().unwrap();
        // In hundredths of the force: johnson 1, palmgren by virtual work 1, linear 3, the projections 11 and 8.
        let expected = match (way["compatibility"].as_str().unwrap(), way["law"].as_str().unwrap()) {
            ("virtual_work", "linear") => 0.03,
            ("virtual_work", _) => 0.01,
            (_, "palmgren") => 0.11,
            _ => 0.08,
        };
        assert_eq!(way["expected_model_error"], json!(expected), "{way}");
        let is_finer = way["error"].as_f64().unwrap() < 0.1 * expected;
        assert_eq!(way["is_finer_than_model"], json!(is_finer), "{way}");
        assert!(if is_own { difference == 0.0 } else { difference > 1e-3 && difference < 0.1 }, "{way}");
    }
    assert_eq!(answer["unavailable"], json!([]));
}

/// Teeth of case 5.2 enter under load, which the finite elements do not cover.
#[tokio::test]
async fn omits_model_error_beyond_calculated_drives() {
    let service = Service::new();
    let case_5_2: Value = serde_json::from_str(include_str!("../../examples/paper-5.2.json")).unwrap();
    let entering = with(&case_5_2, "/model", json!({}));
    // A smaller width makes its fingers stiff enough.
    let at_both_ends = json!({ "carrier": { "fingers": "held_at_both_ends" } });
    let narrow = with(&with(&case_5_2, "/drive/teeth/width_mm", json!(5.0)), "/load/input_torque_nm", json!(1.0));
    let narrow = with(&narrow, "/parts", at_both_ends.clone());
    let pressed = with(&narrow, "/model", json!({ "corner_contact": true }));
    // Fingers held at one end reduce case 5.1's largest force by 13 %.
    let case_5_1 = with(&with(&spelled_out(), "/model", json!({})), "/parts", at_both_ends);
    let slender = with(&case_5_1, "/parts", json!({ "carrier": { "fingers": "held_at_one_end" } }));
    for (document, expected) in [(entering, None), (pressed, Some(0.04)), (case_5_1, Some(0.01)), (slender, None)] {
        let answer = service.post("/v1/accuracy", &document).await.found();
        let own = ways(&answer).iter().find(|way| way["law"] == "johnson").unwrap().clone();
        assert_eq!(own.get("expected_model_error").and_then(Value::as_f64), expected, "{own}");
        assert!(expected.is_some() || own["is_finer_than_model"] == false);
    }
}

#[tokio::test]
async fn names_model_without_answer_and_its_reason() {
    let document = [
        ("/drive/ring/teeth", json!(30)),
        ("/drive/teeth/radius_mm", json!(4.0)),
        ("/model", json!({ "compatibility": "virtual_work", "stiffness": { "law": "linear" } })),
        ("/parts", json!({ "carrier": { "clearance_um": 5.0 } })),
    ]
    .into_iter()
    .fold(spelled_out(), |document, (pointer, value)| with(&document, pointer, value));
    let answer = Service::new().post("/v1/accuracy", &document).await.found();
    let unavailable = answer["unavailable"].as_array().unwrap();
    assert_eq!(unavailable.len(), 2, "{unavailable:?}");
    assert!(unavailable.iter().all(|model| model["compatibility"] == "projection"));
    assert!(ways(&answer).iter().all(|way| way["compatibility"] == "virtual_work"));
}

#[tokio::test]
async fn accuracy_answers_are_never_cached() {
    let service = Service::new();
    for _ in 0..2 {
        let answer = service.post("/v1/accuracy", &spelled_out()).await;
        assert_eq!(answer.status, 200);
        assert_eq!(answer.header("cache-control"), "no-store");
        assert!(!answer.headers.contains_key("etag") && !answer.headers.contains_key("cache-status"));
    }
}
