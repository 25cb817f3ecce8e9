//! Each endpoint requires, reads and caches by only the fields that it needs.

use serde_json::{Value, json};

use crate::asking::Service;
use crate::designs::{spelled_out, with, without};

async fn etag(path: &str, document: &Value) -> String {
    let answer = Service::new().post(path, document).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.etag().to_owned()
}

/// Returns impossible values for parts of a document that an endpoint does not read.
fn impossible(part: &str) -> Value {
    match part {
        "materials" => json!({ "ring": { "youngs_modulus_gpa": -210.0, "poissons_ratio": 7.0 } }),
        "load" => json!({ "input_torque_nm": -1.0, "output_torque_nm": 0.0 }),
        "model" => json!({ "compatibility": "virtual_work", "stiffness": crate::designs::fixed(0.0, -1.0, 1e99) }),
        "sweep" => json!({ "samples": -50 }),
        "profile" => json!({ "chord_tolerance_mm": -1.0, "extent": "full" }),
        _ => unreachable!("{part}"),
    }
}

const READS: [(&str, &[&str], &[&str]); 3] = [
    ("/v1/geometry", &["profile"], &["materials", "load", "model", "sweep"]),
    ("/v1/coincidence-degree", &[], &["materials", "load", "model", "sweep", "profile"]),
    ("/v1/sweep", &["materials", "load", "model", "sweep"], &["profile"]),
];

#[tokio::test]
async fn unread_fields_change_neither_answer_nor_tag() {
    for (path, _, unread) in READS {
        let service = Service::new();
        let first = service.post(path, &spelled_out()).await;
        assert_eq!(first.status, 200);
        for part in unread {
            let pointer = format!("/{part}");
            for document in [without(&spelled_out(), &pointer), with(&spelled_out(), &pointer, impossible(part))] {
                let answer = service.post(path, &document).await;
                assert_eq!(answer.status, 200, "{path} reads {part}: {}", answer.text());
                assert_eq!(answer.etag(), first.etag(), "{path} caches by {part}");
                assert!(answer.is_hit() && answer.body == first.body);
            }
        }
    }
}

#[tokio::test]
async fn fields_that_endpoint_reads_must_be_possible() {
    for (path, read, _) in READS {
        for part in read {
            let document = with(&spelled_out(), &format!("/{part}"), impossible(part));
            assert_eq!(Service::new().post(path, &document).await.status, 422, "{path} does not read {part}");
        }
    }
}

#[tokio::test]
async fn geometry_and_coincidence_degree_need_only_drive() {
    let document = json!({ "drive": spelled_out()["drive"] });
    for path in ["/v1/geometry", "/v1/coincidence-degree"] {
        assert_eq!(etag(path, &document).await, etag(path, &spelled_out()).await);
    }
    let (at, code, _) = Service::new().post("/v1/sweep", &document).await.faulty_field();
    assert_eq!((at.as_str(), code.as_str()), ("/load", "missing_field"));
}

#[tokio::test]
async fn rejects_unknown_field_in_unread_object() {
    let document = with(&spelled_out(), "/load/torque", json!(20.0));
    let (at, ..) = Service::new().post("/v1/geometry", &document).await.faulty_field();
    assert_eq!(at, "/load/torque");
}

#[tokio::test]
async fn geometry_depends_on_its_profile() {
    let first = etag("/v1/geometry", &spelled_out()).await;
    for (pointer, value) in [("/profile/chord_tolerance_mm", json!(0.002)), ("/profile/extent", json!("full"))] {
        assert_ne!(etag("/v1/geometry", &with(&spelled_out(), pointer, value)).await, first, "{pointer}");
    }
}

#[tokio::test]
async fn sweep_depends_on_all_but_profile() {
    let first = etag("/v1/sweep", &spelled_out()).await;
    let mut seen = vec![first.clone()];
    for (pointer, value) in [
        ("/drive/wave_generator/semi_major_mm", json!(58.1)),
        ("/drive/wave_generator/semi_minor_mm", json!(56.1)),
        ("/drive/teeth/installed", json!(14)),
        ("/drive/teeth/radius_mm", json!(5.1)),
        ("/drive/teeth/width_mm", json!(15.1)),
        ("/drive/ring/teeth", json!(30)),
        ("/drive/ring/tip_radius_mm", json!(66.1)),
        ("/materials/wave_generator/youngs_modulus_gpa", json!(211.0)),
        ("/materials/wave_generator/poissons_ratio", json!(0.31)),
        ("/materials/teeth/youngs_modulus_gpa", json!(211.0)),
        ("/materials/teeth/poissons_ratio", json!(0.31)),
        ("/materials/ring/youngs_modulus_gpa", json!(211.0)),
        ("/materials/ring/poissons_ratio", json!(0.31)),
        ("/materials/carrier/youngs_modulus_gpa", json!(211.0)),
        ("/materials/carrier/poissons_ratio", json!(0.31)),
        ("/load/input_torque_nm", json!(20.000_000_000_000_004)),
        ("/model/compatibility", json!("virtual_work")),
        ("/model/stiffness", crate::designs::fixed(1e6, 1e6, 1e6)),
        ("/model/stiffness", crate::designs::fixed(1e6, 1e6, 2e6)),
        ("/model/stiffness", crate::designs::fixed(1e6, 2e6, 1e6)),
        ("/model/stiffness", crate::designs::fixed(2e6, 1e6, 1e6)),
        ("/sweep/samples", json!(51)),
    ] {
        let etag = etag("/v1/sweep", &with(&spelled_out(), pointer, value)).await;
        assert!(!seen.contains(&etag), "{pointer} changes nothing");
        seen.push(etag);
    }
    let by_output = with(&spelled_out(), "/load", json!({ "output_torque_nm": 20.0 }));
    assert!(!seen.contains(&etag("/v1/sweep", &by_output).await), "a torque at the carrier is another");
}

#[tokio::test]
async fn endpoints_have_separate_cache_entries() {
    let service = Service::new();
    let mut tags = Vec::new();
    for (path, ..) in READS {
        let answer = service.post(path, &spelled_out()).await;
        assert!(answer.is_miss(), "{path}");
        tags.push(answer.etag().to_owned());
    }
    tags.sort_unstable();
    tags.dedup();
    assert_eq!(tags.len(), 3);
}

/// Parts of `/v1/design` with the endpoints that answer each part alone.
const PARTS: [(&str, &str); 3] =
    [("geometry", "/v1/geometry"), ("coincidence_degree", "/v1/coincidence-degree"), ("sweep", "/v1/sweep")];

#[tokio::test]
async fn design_answer_joins_bytes_of_its_parts() {
    let service = Service::new();
    for document in [spelled_out(), service.get("/v1/examples/paper-5.2").await.json()] {
        let whole = service.post("/v1/design", &document).await;
        let mut expected = String::from("{");
        for (name, path) in PARTS {
            expected += &format!("\"{name}\":{},", service.post(path, &document).await.text());
        }
        assert_eq!(whole.text(), expected + "\"problems\":{}}");
        assert!(service.post("/v1/design", &document).await.is_hit());
    }
}

#[tokio::test]
async fn failed_part_of_design_has_its_problem() {
    let service = Service::new();
    let unloaded = without(&spelled_out(), "/load");
    let touching = with(&spelled_out(), "/drive/teeth/radius_mm", json!(8.0));
    let coarse = with(&spelled_out(), "/profile/chord_tolerance_mm", json!(-1.0));
    for (document, missing) in [(unloaded, 1), (touching, 3), (coarse, 1)] {
        let whole = service.post("/v1/design", &document).await;
        assert_eq!(whole.status, 200, "{}", whole.text());
        let whole = whole.json();
        for (name, path) in PARTS {
            let alone = service.post(path, &document).await;
            let (there, absent) =
                if alone.status == 200 { (&whole, &whole["problems"]) } else { (&whole["problems"], &whole) };
            assert_eq!(there[name], alone.json(), "{name}");
            assert!(absent.get(name).is_none(), "{name}");
        }
        assert_eq!(whole["problems"].as_object().unwrap().len(), missing);
    }
}

#[tokio::test]
async fn design_key_depends_on_all_parts() {
    let first = etag("/v1/design", &spelled_out()).await;
    for (pointer, value) in [
        ("/profile/chord_tolerance_mm", json!(0.002)),
        ("/drive/teeth/radius_mm", json!(5.1)),
        ("/load/input_torque_nm", json!(21.0)),
        ("/sweep/samples", json!(51)),
    ] {
        assert_ne!(etag("/v1/design", &with(&spelled_out(), pointer, value)).await, first, "{pointer}");
    }
    let drawn = with(&spelled_out(), "/assembly", json!({ "input_angle_deg": 5.0 }));
    assert_eq!(etag("/v1/design", &drawn).await, first, "drawings alone read the input angle");
}

#[tokio::test]
async fn malformed_document_fails_whole_design() {
    let document = with(&spelled_out(), "/load/torque", json!(20.0));
    let (at, ..) = Service::new().post("/v1/design", &document).await.faulty_field();
    assert_eq!(at, "/load/torque");
}

#[tokio::test]
async fn sweep_states_both_torques_and_entry_under_load() {
    let service = Service::new();
    for (example, enters_under_load) in [("paper-5.1", false), ("paper-5.2", true), ("paper-5.2-bored", true)] {
        let design = service.get(&format!("/v1/examples/{example}")).await.json();
        let ratio = service.post("/v1/geometry", &design).await.json()["transmission_ratio"].as_f64().unwrap();
        let sweep = service.post("/v1/sweep", &design).await.json();
        let input_nm = design["load"]["input_torque_nm"].as_f64().unwrap();
        assert_eq!(sweep["load"], json!({ "input_torque_nm": input_nm, "output_torque_nm": input_nm * ratio }));
        assert_eq!(sweep["enters_under_load"], enters_under_load, "{example}");
        // The same load may be given at the other shaft.
        let turned = with(&design, "/load", json!({ "output_torque_nm": input_nm * ratio }));
        assert_eq!(service.post("/v1/sweep", &turned).await.json()["load"], sweep["load"]);
    }
}

#[tokio::test]
async fn geometry_states_holding_wall_and_slot_wall() {
    let service = Service::new();
    let design = spelled_out();
    let carrier = |answer: &Value| answer["carrier"].clone();
    let forward = carrier(&service.post("/v1/geometry", &design).await.json());
    let against = with(&design, "/drive/ring/teeth", json!(30));
    let backward = carrier(&service.post("/v1/geometry", &without(&against, "/drive/ring/tip_radius_mm")).await.json());
    assert_eq!((&forward["loaded_wall"], &backward["loaded_wall"]), (&json!("leading"), &json!("trailing")));
    assert_eq!(forward["finger"]["corners"]["x_mm"].as_array().unwrap().len(), 4);
    // Slots that run into each other leave a pointed finger, and wider slots none.
    let of_radius = |radius_mm: f64| {
        with(&without(&design, "/drive/ring/tip_radius_mm"), "/drive/teeth/radius_mm", json!(radius_mm))
    };
    let pointed = service.post("/v1/geometry", &of_radius(6.6)).await.json();
    assert_eq!(pointed["carrier"]["finger"]["corners"]["x_mm"].as_array().unwrap().len(), 3, "{}", pointed["carrier"]);
}
