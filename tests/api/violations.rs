//! Reasons for impossible drives, loads and requests, over HTTP.

use serde_json::{Value, json};

use crate::asking::{ENDPOINTS, LIMITS, Limits, Service};
use crate::codes::{codes_of, field_codes, words};
use crate::designs::{eccentric, every_number, fixed, spelled_out, undercut, with, with_twice, without};

async fn errors_at(path: &str, document: &Value) -> Vec<Value> {
    errors_of(&Service::new(), path, document).await
}

async fn errors_of(service: &Service, path: &str, document: &Value) -> Vec<Value> {
    let problem = service.post(path, document).await.refused(422, "impossible_design");
    problem["errors"].as_array().unwrap().clone()
}

/// Asserts that every endpoint refuses a change of case 5.1 at one value.
async fn assert_impossible(changes: &[(&str, Value)], code: &str, pointer: &str, value: f64, limit: f64) {
    let document =
        changes.iter().fold(spelled_out(), |document, (pointer, value)| with(&document, pointer, value.clone()));
    for path in ENDPOINTS {
        let errors = errors_at(path, &document).await;
        let [error] = errors.as_slice() else { panic!("{errors:?}") };
        assert_eq!((&error["code"], &error["pointer"]), (&json!(code), &json!(pointer)));
        for (name, expected) in [("value", value), ("limit", limit)] {
            let found = error[name].as_f64().unwrap();
            assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{name} of {error} is not {expected}");
        }
    }
}

const SEMI_MAJOR: &str = "/drive/wave_generator/semi_major_mm";
const SEMI_MINOR: &str = "/drive/wave_generator/semi_minor_mm";
const COUNT: &str = "/drive/teeth/count";
const INSTALLED: &str = "/drive/teeth/installed";
const RADIUS: &str = "/drive/teeth/radius_mm";
const WIDTH: &str = "/drive/teeth/width_mm";
const RING_TEETH: &str = "/drive/ring/teeth";
const TIP_RADIUS: &str = "/drive/ring/tip_radius_mm";

#[tokio::test]
async fn zero_length_is_out_of_range() {
    assert_impossible(&[(WIDTH, json!(0))], "out_of_range", WIDTH, 0.0, 1e-6).await;
    assert_impossible(&[(RADIUS, json!(-5.0))], "out_of_range", RADIUS, -5.0, 1e-6).await;
    assert_impossible(&[(TIP_RADIUS, json!(2e6))], "out_of_range", TIP_RADIUS, 2e6, 1e6).await;
}

#[tokio::test]
async fn cam_must_be_elongated() {
    assert_impossible(&[(SEMI_MINOR, json!(58.0))], "cam_not_elongated", SEMI_MAJOR, 58.0, 58.0).await;
    assert_impossible(&[(SEMI_MINOR, json!(58.5))], "cam_not_elongated", SEMI_MAJOR, 58.0, 58.5).await;
}

#[tokio::test]
async fn ring_and_carrier_must_differ_by_two_teeth() {
    for (teeth, nearest) in [(28, 26), (27, 26), (25, 26), (29, 30), (31, 30), (100, 30), (2, 26)] {
        let expected = (f64::from(teeth), f64::from(nearest));
        assert_impossible(&[(RING_TEETH, json!(teeth))], "tooth_difference", RING_TEETH, expected.0, expected.1).await;
    }
}

#[tokio::test]
async fn proposed_ring_teeth_are_within_range() {
    for (count, ring, nearest) in [(2, 2, 4.0), (10_000, 10_000, 9_998.0)] {
        let changes = [(COUNT, json!(count)), (INSTALLED, json!(2)), (RING_TEETH, json!(ring)), (RADIUS, json!(4.9))];
        let value = f64::from(ring);
        assert_impossible(&changes, "tooth_difference", RING_TEETH, value, nearest).await;
    }
}

#[tokio::test]
async fn teeth_may_be_odd_and_zones_unlike() {
    let odd = with(&with(&spelled_out(), COUNT, json!(27)), RING_TEETH, json!(25));
    for document in
        [without(&odd, INSTALLED), with(&odd, INSTALLED, json!(27)), with(&spelled_out(), INSTALLED, json!(7))]
    {
        for path in ENDPOINTS {
            Service::new().post(path, &document).await.found();
        }
    }
}

#[tokio::test]
async fn eccentric_circle_must_contain_axis() {
    for (radius, eccentricity) in [(1.2, 1.2), (1.0, 1.2)] {
        let document = with(&eccentric(), "/drive/wave_generator/radius_mm", json!(radius));
        for path in ENDPOINTS {
            let errors = errors_at(path, &document).await;
            let error = errors.iter().find(|error| error["code"] == "cam_too_small").unwrap();
            assert_eq!(error["pointer"], "/drive/wave_generator/radius_mm");
            assert_eq!((error["value"].as_f64(), error["limit"].as_f64()), (Some(radius), Some(eccentricity)));
        }
    }
}

#[tokio::test]
async fn flat_must_be_shorter_than_tooth_thickness() {
    let flats =
        json!({ "shape": "flat_sided", "count": 28, "radius_mm": 5.0, "width_mm": 15.0, "flat_length_mm": 10.0 });
    assert_impossible(&[("/drive/teeth", flats)], "flat_too_long", "/drive/teeth/flat_length_mm", 10.0, 10.0).await;
}

#[tokio::test]
async fn groove_must_be_wider_than_ball() {
    let balls =
        json!({ "shape": "ball", "count": 28, "radius_mm": 5.0, "groove_radius_mm": { "carrier": 5.0, "ring": 5.2 } });
    let document = with(&with(&spelled_out(), "/drive/teeth", balls), "/model", json!({}));
    let errors = errors_at("/v1/geometry", &document).await;
    let [error] = errors.as_slice() else { panic!("{errors:?}") };
    assert_eq!(
        (&error["code"], &error["pointer"]),
        (&json!("groove_too_tight"), &json!("/drive/teeth/groove_radius_mm/carrier"))
    );
}

#[tokio::test]
async fn reports_no_fault_at_omitted_field() {
    for (count, ring) in [(20_000, 19_998), (1, 3), (-4, -2)] {
        let document = with(&with(&spelled_out(), COUNT, json!(count)), RING_TEETH, json!(ring));
        for path in ENDPOINTS {
            let errors = errors_at(path, &without(&document, INSTALLED)).await;
            assert!(errors.iter().any(|error| error["pointer"] == COUNT), "{errors:?}");
            assert!(!errors.iter().any(|error| error["pointer"] == INSTALLED), "{errors:?}");
        }
    }
}

#[tokio::test]
async fn installed_teeth_must_divide_theoretical_ones() {
    for (installed, nearest) in [(8, 7.0), (9, 7.0), (10, 7.0), (56, 28.0)] {
        let value = f64::from(installed);
        let changes = [(INSTALLED, json!(installed)), (RADIUS, json!(3.0))];
        assert_impossible(&changes, "installed_no_divisor", INSTALLED, value, nearest).await;
    }
    let errors = errors_at("/v1/sweep", &with(&spelled_out(), INSTALLED, json!(8))).await;
    assert!(errors[0]["detail"].as_str().unwrap().ends_with("choose 7 or 14"), "{errors:?}");
}

#[tokio::test]
async fn neighbouring_teeth_must_not_touch() {
    // The cam is next to round: teeth touch where (56 mm + r) sin(π/28) = r.
    let sin = (std::f64::consts::PI / 28.0).sin();
    let largest = 56.0 * sin / (1.0 - sin);
    let document = with(&with(&spelled_out(), RADIUS, json!(7.2)), SEMI_MAJOR, json!(56.000_001));
    let errors = errors_at("/v1/coincidence-degree", &document).await;
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert_eq!((&errors[0]["code"], &errors[0]["pointer"]), (&json!("teeth_touch"), &json!(RADIUS)));
    assert_eq!(errors[0]["value"], 7.2);
    assert!((errors[0]["limit"].as_f64().unwrap() - largest).abs() < 1e-6, "{errors:?}");
    let thinner = with(&document, RADIUS, json!(errors[0]["limit"].as_f64().unwrap() * (1.0 - 1e-12)));
    assert_eq!(Service::new().post("/v1/coincidence-degree", &thinner).await.status, 200);
}

#[tokio::test]
async fn carrier_needs_an_annulus() {
    // The tips stand at b + 2r = 57.8 mm, inside the cam's 58.
    assert_impossible(&[(RADIUS, json!(0.9))], "no_carrier_annulus", SEMI_MAJOR, 58.0, 57.8).await;
    assert_impossible(&[(RADIUS, json!(1.0))], "no_carrier_annulus", SEMI_MAJOR, 58.0, 58.0).await;
}

#[tokio::test]
async fn bore_may_make_room_for_carrier() {
    let document = with(&with(&spelled_out(), RADIUS, json!(0.9)), TIP_RADIUS, json!(58.5));
    assert_eq!(Service::new().post("/v1/geometry", &document).await.status, 200);
}

#[tokio::test]
async fn bore_must_leave_a_flank() {
    assert_impossible(&[(TIP_RADIUS, json!(68.0))], "bore_leaves_no_flank", TIP_RADIUS, 68.0, 68.0).await;
    assert_impossible(&[(TIP_RADIUS, json!(70.0))], "bore_leaves_no_flank", TIP_RADIUS, 70.0, 68.0).await;
}

#[tokio::test]
async fn reports_every_impossible_value_with_value_and_limit() {
    let mut document = every_number();
    let mut expected = Vec::new();
    for (pointer, value, limit) in [
        (SEMI_MAJOR, 2e6, 1e6),
        (SEMI_MINOR, 0.0, 1e-6),
        (COUNT, 10_001.0, 1e4),
        (INSTALLED, 0.0, 2.0),
        (RADIUS, 1e-7, 1e-6),
        (WIDTH, -15.0, 1e-6),
        (RING_TEETH, 1.0, 2.0),
        (TIP_RADIUS, 3e6, 1e6),
        ("/materials/wave_generator/youngs_modulus_gpa", 1e6, 1e5),
        ("/materials/wave_generator/poissons_ratio", 0.5, 0.5),
        ("/materials/teeth/youngs_modulus_gpa", 0.0, 1e-3),
        ("/materials/teeth/poissons_ratio", -1.0, -1.0),
        ("/materials/ring/youngs_modulus_gpa", -210.0, 1e-3),
        ("/materials/ring/poissons_ratio", 30.0, 0.5),
        ("/materials/carrier/youngs_modulus_gpa", 210e9, 1e5),
        ("/materials/carrier/poissons_ratio", -7.0, -1.0),
        ("/load/input_torque_nm", 0.0, 1e-12),
        ("/model/stiffness/wave_generator_n_per_mm", 0.0, 1e-3),
        ("/model/stiffness/ring_n_per_mm", 1e16, 1e15),
        ("/model/stiffness/carrier_n_per_mm", -1.0, 1e-3),
        ("/sweep/samples", 0.0, 1.0),
    ] {
        document = with(&document, pointer, json!(value));
        expected.push((pointer.to_owned(), "out_of_range".to_owned(), value, limit));
    }
    let mut found: Vec<_> = errors_at("/v1/sweep", &document)
        .await
        .iter()
        .map(|error| {
            let text = |member: &str| error[member].as_str().unwrap().to_owned();
            (text("pointer"), text("code"), error["value"].as_f64().unwrap(), error["limit"].as_f64().unwrap())
        })
        .collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    expected.sort_by(|a, b| a.0.cmp(&b.0));
    assert_eq!(found, expected);
}

#[tokio::test]
async fn reports_contradictions_beside_values_out_of_range() {
    let document = [
        (SEMI_MINOR, json!(58.0)),
        (INSTALLED, json!(9)),
        (RING_TEETH, json!(27)),
        (TIP_RADIUS, json!(68.0)),
        (WIDTH, json!(0.0)),
        ("/materials/ring/poissons_ratio", json!(0.7)),
        ("/load/input_torque_nm", json!(-20.0)),
        ("/sweep/samples", json!(0)),
    ]
    .into_iter()
    .fold(spelled_out(), |document, (pointer, value)| with(&document, pointer, value));
    let errors = errors_at("/v1/sweep", &document).await;
    let expected =
        ["bore_leaves_no_flank", "cam_not_elongated", "installed_no_divisor", "out_of_range", "tooth_difference"];
    assert_eq!(codes_of(&errors), expected);
    assert_eq!(errors.len(), 8, "{errors:?}");
}

/// A fault of case 5.1, with the changes that cause it, its report, and the fields on which it depends.
struct SingleFault {
    changes: &'static [(&'static str, f64)],
    code: &'static str,
    pointer: &'static str,
    needs: &'static [&'static str],
}

const fn single(
    changes: &'static [(&'static str, f64)],
    code: &'static str,
    pointer: &'static str,
    needs: &'static [&'static str],
) -> SingleFault {
    SingleFault { changes, code, pointer, needs }
}

impl SingleFault {
    fn reads(&self, field: &str) -> bool {
        self.needs.contains(&field) || self.changes.iter().any(|(changed, _)| *changed == field)
    }

    fn is_disjoint_from(&self, other: &Self) -> bool {
        !self.changes.iter().any(|(field, _)| other.reads(field)) && !self.needs.iter().any(|field| other.reads(field))
    }

    fn is_among(&self, errors: &[Value]) -> bool {
        errors.iter().any(|error| error["code"] == self.code && error["pointer"] == self.pointer)
    }
}

const GAP_AT_CARRIER: &str = CARRIER_CLEARANCE;
const RING_OUTER: &str = "/parts/ring/outer_radius_mm";
const RING_CLEARANCE: &str = "/parts/ring/clearance_um";
const CARRIER_INNER: &str = "/parts/carrier/inner_radius_mm";
const CARRIER_OUTER: &str = "/parts/carrier/outer_radius_mm";
const CARRIER_CLEARANCE: &str = "/parts/carrier/clearance_um";
const BORE: &str = "/parts/wave_generator/bore_radius_mm";
const CAM_CLEARANCE: &str = "/parts/wave_generator/clearance_um";
const TEETH_CLEARANCE: &str = "/parts/teeth/clearance_um";

/// All faults of a drive, each with the fewest fields on which it depends.
const FAULTS_OF_DRIVE: [SingleFault; 14] = [
    single(&[(SEMI_MAJOR, 2e6)], "out_of_range", SEMI_MAJOR, &[]),
    single(&[(SEMI_MINOR, -1.0)], "out_of_range", SEMI_MINOR, &[]),
    single(&[(COUNT, 20_000.0)], "out_of_range", COUNT, &[]),
    single(&[(INSTALLED, 0.0)], "out_of_range", INSTALLED, &[]),
    single(&[(RADIUS, 0.0)], "out_of_range", RADIUS, &[]),
    single(&[(WIDTH, 0.0)], "out_of_range", WIDTH, &[]),
    single(&[(RING_TEETH, 1.0)], "out_of_range", RING_TEETH, &[]),
    single(&[(TIP_RADIUS, -1.0)], "out_of_range", TIP_RADIUS, &[]),
    single(&[(SEMI_MINOR, 58.0)], "cam_not_elongated", SEMI_MAJOR, &[SEMI_MAJOR]),
    single(&[(RING_TEETH, 32.0)], "tooth_difference", RING_TEETH, &[COUNT]),
    single(&[(INSTALLED, 10.0)], "installed_no_divisor", INSTALLED, &[COUNT]),
    single(&[(TIP_RADIUS, 200.0)], "bore_leaves_no_flank", TIP_RADIUS, &[SEMI_MAJOR, RADIUS]),
    single(&[(RADIUS, 9.0)], "teeth_touch", RADIUS, &[SEMI_MAJOR, SEMI_MINOR, INSTALLED]),
    single(&[(RADIUS, 0.5)], "no_carrier_annulus", SEMI_MAJOR, &[SEMI_MAJOR, SEMI_MINOR, RING_TEETH, TIP_RADIUS]),
];

const FAULTS_OF_SWEEP: [SingleFault; 10] = [
    single(
        &[(RING_TEETH, 30.0), (GAP_AT_CARRIER, 10.0)],
        "clearance_not_monotone",
        GAP_AT_CARRIER,
        &[SEMI_MAJOR, SEMI_MINOR, RADIUS, COUNT, TIP_RADIUS],
    ),
    single(&[("/load/input_torque_nm", 0.0)], "out_of_range", "/load/input_torque_nm", &[]),
    single(&[("/load/allowable_stress_mpa", 0.0)], "out_of_range", "/load/allowable_stress_mpa", &[]),
    single(&[("/materials/ring/poissons_ratio", 3.0)], "out_of_range", "/materials/ring/poissons_ratio", &[]),
    single(&[("/materials/teeth/youngs_modulus_gpa", 0.0)], "out_of_range", "/materials/teeth/youngs_modulus_gpa", &[]),
    single(&[("/model/clearance/ring_um", -1.0)], "out_of_range", "/model/clearance/ring_um", &[]),
    single(&[("/model/clearance/wave_generator_um", 2e6)], "out_of_range", "/model/clearance/wave_generator_um", &[]),
    single(&[(GAP_AT_CARRIER, -1.0)], "out_of_range", GAP_AT_CARRIER, &[]),
    single(&[("/model/stiffness/ring_n_per_mm", 0.0)], "out_of_range", "/model/stiffness/ring_n_per_mm", &[]),
    single(&[("/sweep/samples", 0.0)], "out_of_range", "/sweep/samples", &[]),
];

const FAULTS_OF_DRAWING: [SingleFault; 18] = [
    single(&[(RING_OUTER, 68.0)], "ring_without_rim", RING_OUTER, &[SEMI_MAJOR, RADIUS, RING_CLEARANCE]),
    single(&[(CARRIER_INNER, 58.0)], "carrier_meets_cam", CARRIER_INNER, &[SEMI_MAJOR]),
    single(
        &[(CARRIER_OUTER, 67.0)],
        "carrier_meets_ring",
        CARRIER_OUTER,
        &[SEMI_MAJOR, SEMI_MINOR, RADIUS, RING_TEETH, TIP_RADIUS],
    ),
    single(&[(CARRIER_INNER, 64.0), (CARRIER_OUTER, 63.0)], "carrier_without_wall", CARRIER_OUTER, &[]),
    single(
        &[(CARRIER_INNER, 66.0)],
        "carrier_without_wall",
        CARRIER_OUTER,
        &[SEMI_MAJOR, SEMI_MINOR, RADIUS, RING_TEETH, TIP_RADIUS, CARRIER_OUTER],
    ),
    single(
        &[(CARRIER_CLEARANCE, 2400.0), (CARRIER_OUTER, 65.0)],
        "slots_take_carrier",
        CARRIER_OUTER,
        &[RADIUS, INSTALLED],
    ),
    single(&[(BORE, 56.0)], "bore_takes_cam", BORE, &[SEMI_MINOR, CAM_CLEARANCE]),
    single(&[(CAM_CLEARANCE, 54_069.0)], "clearance_takes_cam", CAM_CLEARANCE, &[SEMI_MAJOR, SEMI_MINOR]),
    single(&[(TEETH_CLEARANCE, 5000.0)], "clearance_takes_tooth", TEETH_CLEARANCE, &[RADIUS]),
    single(&[(RING_OUTER, 0.0)], "out_of_range", RING_OUTER, &[]),
    single(&[(RING_CLEARANCE, -1.0)], "out_of_range", RING_CLEARANCE, &[]),
    single(&[(CARRIER_INNER, 0.0)], "out_of_range", CARRIER_INNER, &[]),
    single(&[(CARRIER_OUTER, 2e6)], "out_of_range", CARRIER_OUTER, &[]),
    single(&[(CARRIER_CLEARANCE, -1.0)], "out_of_range", CARRIER_CLEARANCE, &[]),
    single(&[(BORE, 0.0)], "out_of_range", BORE, &[]),
    single(&[(TEETH_CLEARANCE, -1.0)], "out_of_range", TEETH_CLEARANCE, &[]),
    single(&[("/assembly/input_angle_deg", 1e8)], "out_of_range", "/assembly/input_angle_deg", &[]),
    single(&[("/profile/chord_tolerance_mm", 0.0)], "out_of_range", "/profile/chord_tolerance_mm", &[]),
];

#[tokio::test]
async fn no_fault_hides_fault_of_other_fields() {
    let service = Service::new();
    let base = with(&spelled_out(), "/model/stiffness", fixed(4e5, 5e5, 3e5));
    let empty_parts = json!({ "ring": {}, "carrier": {}, "teeth": {}, "wave_generator": {} });
    let base = [("/model/clearance", json!({})), ("/parts", empty_parts), ("/assembly", json!({}))]
        .into_iter()
        .fold(base, |document, (pointer, value)| with(&document, pointer, value));
    let changed = |document: &Value, fault: &SingleFault| {
        fault.changes.iter().fold(document.clone(), |document, (pointer, value)| with(&document, pointer, json!(value)))
    };
    for (path, faults) in [
        ("/v1/sweep", FAULTS_OF_DRIVE.iter().chain(&FAULTS_OF_SWEEP).collect::<Vec<_>>()),
        ("/v1/drawings/assembly", FAULTS_OF_DRIVE.iter().chain(&FAULTS_OF_DRAWING).collect()),
    ] {
        service.post(path, &base).await.found();
        let mut pairs = 0;
        for (index, one) in faults.iter().enumerate() {
            let alone = errors_of(&service, path, &changed(&base, one)).await;
            assert!(one.is_among(&alone), "no {} at {} in {alone:?}", one.code, one.pointer);
            for other in faults[..index].iter().filter(|other| other.is_disjoint_from(one)) {
                let errors = errors_of(&service, path, &changed(&changed(&base, one), other)).await;
                for fault in [one, other] {
                    let beside = if std::ptr::eq(fault, one) { other } else { one };
                    assert!(
                        fault.is_among(&errors),
                        "{} at {} hides {} at {}: {errors:?}",
                        beside.code,
                        beside.pointer,
                        fault.code,
                        fault.pointer
                    );
                }
                pairs += 1;
            }
        }
        assert!(pairs > 200, "{pairs}");
    }
}

#[tokio::test]
async fn reports_geometry_faults_beside_values_out_of_range() {
    // Thick teeth on a small cam touch; a deep ellipse leaves no annulus.
    let document = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 20.0, "semi_minor_mm": 10.0 },
            "teeth": { "count": 28, "radius_mm": 4.0, "width_mm": 0.0 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 0.0 },
        "sweep": { "samples": 0 },
        "profile": { "chord_tolerance_mm": 0.0 }
    });
    let errors = errors_at("/v1/sweep", &document).await;
    assert!(codes_of(&errors).contains(&"teeth_touch".to_owned()), "{errors:?}");
    assert_eq!(errors.iter().filter(|error| error["code"] == "out_of_range").count(), 3, "{errors:?}");
    let errors = errors_at("/v1/geometry", &document).await;
    assert_eq!(errors.iter().filter(|error| error["code"] == "out_of_range").count(), 2, "{errors:?}");
}

#[tokio::test]
async fn reports_touching_teeth_and_missing_annulus_together() {
    let document = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 2.0 },
            "teeth": { "count": 6, "radius_mm": 4.0, "width_mm": 15.0 },
            "ring": { "teeth": 4 }
        }
    });
    assert_eq!(codes_of(&errors_at("/v1/geometry", &document).await), ["no_carrier_annulus", "teeth_touch"]);
}

#[tokio::test]
async fn detail_names_one_field_or_counts_several() {
    let one = with(&spelled_out(), RADIUS, json!(0.0));
    let problem = Service::new().post("/v1/sweep", &one).await.refused(422, "impossible_design");
    assert!(problem["detail"].as_str().unwrap().contains(RADIUS), "{problem}");
    let two = with(&one, WIDTH, json!(0.0));
    let problem = Service::new().post("/v1/sweep", &two).await.refused(422, "impossible_design");
    assert!(problem["detail"].as_str().unwrap().contains('2'), "{problem}");
}

#[tokio::test]
async fn sweep_needs_lever_arm_at_every_angle() {
    let service = Service::new();
    // ψ_e = 90° and exactly one spacing of four teeth: at j = 0 the only tooth stands on the minor axis.
    let four = with(&spelled_out(), INSTALLED, json!(4));
    // ψ_e = 34.08° and a spacing of 36°.
    let ten = with(&crate::designs::bored(), INSTALLED, json!(10));
    let two = with(&spelled_out(), INSTALLED, json!(2));
    for document in [four, ten, two] {
        let problem = service.post("/v1/sweep", &document).await.refused(422, "no_tooth_in_mesh");
        assert!(problem["detail"].as_str().unwrap().contains("deg"), "{problem}");
        for path in ["/v1/geometry", "/v1/coincidence-degree"] {
            service.post(path, &document).await.found();
        }
    }
    // ψ_e = 43.6° and a spacing of 36°; ψ_e = 90° and one of 60°.
    let enough = with(&undercut(), INSTALLED, json!(10));
    let six = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "count": 30, "installed": 6, "radius_mm": 5.0, "width_mm": 15.0 },
            "ring": { "teeth": 28 }
        },
        "load": { "input_torque_nm": 20.0 }
    });
    for document in [enough, six] {
        service.post("/v1/sweep", &document).await.found();
    }
}

/// Returns a drive with more ring teeth and soft slots: projecting their approach gives a negative compliance.
fn soft_slots(compatibility: &str, carrier_n_per_mm: f64) -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 40.6, "semi_minor_mm": 39.4 },
            "teeth": { "count": 30, "radius_mm": 3.0, "width_mm": 12.0 },
            "ring": { "teeth": 32 }
        },
        "load": { "input_torque_nm": 6.0 },
        "model": { "compatibility": compatibility, "stiffness": fixed(1e9, 1e9, carrier_n_per_mm) }
    })
}

#[tokio::test]
async fn tooth_without_compliance_is_refused_under_projection_only() {
    let service = Service::new();
    let problem =
        service.post("/v1/sweep", &soft_slots("projection", 1e3)).await.refused(422, "compliance_not_positive");
    assert!(problem["detail"].as_str().unwrap().contains("virtual_work"), "{problem}");
    service.post("/v1/sweep", &soft_slots("virtual_work", 1e3)).await.found();
    service.post("/v1/sweep", &soft_slots("projection", 1e9)).await.found();
}

#[tokio::test]
async fn carrier_may_have_more_teeth_or_fewer() {
    for (ring, ratio, other) in [(26, 14.0, -13.0), (30, -14.0, 15.0)] {
        let document = with(&spelled_out(), RING_TEETH, json!(ring));
        let found = Service::new().post("/v1/geometry", &document).await.found();
        assert_eq!(
            (&found["transmission_ratio"], &found["transmission_ratio_carrier_fixed"]),
            (&json!(ratio), &json!(other))
        );
    }
}

#[tokio::test]
async fn sweep_over_max_states_is_refused() {
    // 7 teeth at each of 51 input angles.
    let service = Service::within(Limits { max_states: 357, ..LIMITS });
    service.post("/v1/sweep", &spelled_out()).await.found();
    let service = Service::within(Limits { max_states: 356, ..LIMITS });
    let problem = service.post("/v1/sweep", &spelled_out()).await.refused(422, "too_many_states");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("357") && detail.contains("356") && detail.contains("`max_states`"), "{detail}");
    let error = &problem["errors"][0];
    assert_eq!((&error["pointer"], &error["code"]), (&json!("/sweep/samples"), &json!("too_many_states")));
    assert_eq!((error["value"].as_f64(), error["limit"].as_f64()), (Some(357.0), Some(356.0)));
}

#[tokio::test]
async fn counted_states_equal_swept_states() {
    for document in [undercut(), crate::designs::bored()] {
        for samples in [1, 2, 7, 50, 51] {
            let document = with(&document, "/sweep", json!({ "samples": samples }));
            let found = Service::new().post("/v1/sweep", &document).await.found();
            let states = found["states"]["tooth"].as_array().unwrap().len() as u64;
            Service::within(Limits { max_states: states, ..LIMITS }).post("/v1/sweep", &document).await.found();
            let service = Service::within(Limits { max_states: states - 1, ..LIMITS });
            let problem = service.post("/v1/sweep", &document).await.refused(422, "too_many_states");
            assert_eq!(problem["errors"][0]["value"].as_f64(), Some(states as f64));
        }
    }
}

#[tokio::test]
async fn profiles_over_max_profile_points_are_refused() {
    for extent in ["tooth", "full"] {
        let document = with(&spelled_out(), "/profile/extent", json!(extent));
        let found = Service::new().post("/v1/geometry", &document).await.found();
        let length = |profile: &Value| profile["x_mm"].as_array().unwrap().len() as u64;
        let points = length(&found["ring"]["profile"])
            + length(&found["wave_generator"]["profile"])
            + length(&found["tooth_center_path"]);
        Service::within(Limits { max_states: points, ..LIMITS }).post("/v1/geometry", &document).await.found();
        let service = Service::within(Limits { max_states: points - 1, ..LIMITS });
        let problem = service.post("/v1/geometry", &document).await.refused(422, "too_many_points");
        let error = &problem["errors"][0];
        assert_eq!(
            (&error["pointer"], &error["code"]),
            (&json!("/profile/chord_tolerance_mm"), &json!("too_many_points"))
        );
        assert_eq!(
            (error["value"].as_f64(), error["limit"].as_f64()),
            (Some(points as f64), Some((points - 1) as f64))
        );
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.ends_with("Use a larger chord tolerance"), "{detail}");
        assert!(detail.contains(&points.to_string()) && detail.contains(&(points - 1).to_string()), "{detail}");
    }
}

#[tokio::test]
async fn limit_refusal_names_limit_as_published() {
    let service = Service::within(Limits { max_states: 1, max_body_bytes: 2_000, ..LIMITS });
    let limits = service.get("/v1/limits").await.found();
    let long = format!("{}{}", spelled_out(), " ".repeat(2_000));
    for (path, body, limit) in [
        ("/v1/sweep", spelled_out().to_string(), "max_states"),
        ("/v1/geometry", spelled_out().to_string(), "max_profile_points"),
        ("/v1/sweep", long, "max_body_bytes"),
    ] {
        let problem = service.post_text(path, body).await.problem();
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains(&format!("`{limit}`")) && detail.contains(&limits[limit].to_string()), "{detail}");
    }
}

#[tokio::test]
async fn every_field_fault_occurs_over_http() {
    let document = spelled_out();
    let huge = with(&document, RADIUS, json!("HERE")).to_string().replace("\"HERE\"", "1e999");
    let texts = [
        with(&document, "/colour", json!(1)).to_string(),
        without(&document, COUNT).to_string(),
        with_twice(&document, COUNT),
        with(&document, COUNT, json!("28")).to_string(),
        with(&document, "/profile/extent", json!("half")).to_string(),
        huge,
        with(&document, "/load/output_torque_nm", json!(280.0)).to_string(),
        with(&document, RADIUS, json!(0.0)).to_string(),
        with(&document, SEMI_MINOR, json!(58.0)).to_string(),
        with(&document, RING_TEETH, json!(27)).to_string(),
        with(&eccentric(), "/drive/wave_generator/radius_mm", json!(1.2)).to_string(),
        with(
            &document,
            "/drive/teeth",
            json!({ "shape": "flat_sided", "count": 28, "radius_mm": 5.0, "width_mm": 15.0, "flat_length_mm": 12.0 }),
        )
        .to_string(),
        with(
            &document,
            "/drive/teeth",
            json!({ "shape": "ball", "count": 28, "radius_mm": 5.0, "groove_radius_mm": { "ring": 4.9 } }),
        )
        .to_string(),
        with(&document, INSTALLED, json!(8)).to_string(),
        with(&document, "/deviations", json!({ "slot_wall_um": [1.0] })).to_string(),
        with(&document, RADIUS, json!(7.2)).to_string(),
        with(&document, RADIUS, json!(0.9)).to_string(),
        with(&document, TIP_RADIUS, json!(68.0)).to_string(),
    ];
    let gap =
        [(RING_TEETH, json!(30)), (RADIUS, json!(4.0)), ("/parts", json!({ "carrier": { "clearance_um": 5.0 } }))]
            .into_iter()
            .fold(document.clone(), |document, (pointer, value)| with(&document, pointer, value));
    let service = Service::within(Limits { max_states: 1, ..LIMITS });
    let mut errors = Vec::new();
    for text in texts.into_iter().chain([gap.to_string(), document.to_string()]) {
        for path in ["/v1/sweep", "/v1/geometry"] {
            let answer = service.post_text(path, text.clone()).await;
            assert_eq!(answer.status, 422, "{}", answer.text());
            errors.extend(answer.problem()["errors"].as_array().unwrap().clone());
        }
    }
    for (parts, ..) in crate::drawings::MISFITS {
        errors.extend(errors_at("/v1/drawings/assembly", &crate::drawings::made(parts)).await);
    }
    let modified = with(&document, "/modification", json!({ "slot_wall_um": -6000.0 }));
    errors.extend(errors_at("/v1/drawings/assembly", &modified).await);
    let mut codes = words(&field_codes());
    // Faults of studies are covered by the tests of studies.
    codes.retain(|code| !["too_many_variants", "unaffected"].contains(&code.as_str()));
    assert_eq!(codes_of(&errors), codes);
}
