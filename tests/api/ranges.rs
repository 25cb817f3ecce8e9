//! The documented ranges. Both ends are accepted, and values just beyond are refused.

use std::collections::HashMap;

use serde_json::{Value, json};
use toothwave_calculation::field::ranges;
use toothwave_solver::violation::Range;

use crate::asking::{LIMITS, Limits, Service};
use crate::designs::{eccentric, every_number, fixed, spelled_out, with};

/// A field with its range, the endpoint that reads it, and a document that holds it.
struct Field {
    pointer: String,
    path: &'static str,
    document: Value,
    low: f64,
    high: f64,
    is_whole: bool,
}

fn fields() -> Vec<Field> {
    let ranges: HashMap<_, _> = ranges().collect();
    let field = |pointer: &str| {
        let first = |name| if str::parse::<u32>(name).is_ok() { "0" } else { name };
        let Range { low, high, .. } = ranges[&pointer.split('/').map(first).collect::<Vec<_>>().join("/")];
        let pointer = pointer.into();
        Field { pointer, path: "/v1/sweep", document: every_number(), low, high, is_whole: false }
    };
    let count = |pointer: &str| Field { is_whole: true, ..field(pointer) };
    let mut fields: Vec<_> = [
        "/drive/wave_generator/semi_major_mm",
        "/drive/wave_generator/semi_minor_mm",
        "/drive/teeth/radius_mm",
        "/drive/teeth/width_mm",
        "/drive/ring/tip_radius_mm",
    ]
    .map(field)
    .into();
    fields.push(Field { path: "/v1/geometry", ..field("/profile/chord_tolerance_mm") });
    let made = crate::drawings::made(r#"{ "wave_generator": {}, "teeth": {}, "ring": {}, "carrier": {} }"#);
    let part = |pointer: &str| Field { path: "/v1/drawings/assembly", document: made.clone(), ..field(pointer) };
    fields.push(part("/assembly/input_angle_deg"));
    fields.extend(
        ["ring/outer_radius_mm", "carrier/inner_radius_mm", "carrier/outer_radius_mm", "wave_generator/bore_radius_mm"]
            .map(|field| part(&format!("/parts/{field}"))),
    );
    fields.extend(
        ["wave_generator", "teeth", "ring", "carrier"].map(|name| part(&format!("/parts/{name}/clearance_um"))),
    );
    fields.extend(["/drive/teeth/count", "/drive/teeth/installed", "/drive/ring/teeth"].map(count));
    fields.push(count("/sweep/samples"));
    fields.push(field("/load/input_torque_nm"));
    let by_output = with(&every_number(), "/load", json!({ "output_torque_nm": 280.0 }));
    fields.push(Field { document: by_output, ..field("/load/output_torque_nm") });
    let bearing = json!({
        "kind": "race", "coefficient": 0.05, "bearing_coefficient": 0.002, "bearing_radius_mm": 52.0
    });
    let rubbing = with(&every_number(), "/friction", crate::friction::on(&bearing));
    let rubbing = with(&rubbing, "/load/input_speed_rpm", json!(1500.0));
    let of_friction = |pointer: &str| Field { document: rubbing.clone(), ..field(pointer) };
    fields.push(of_friction("/load/input_speed_rpm"));
    for pointer in
        ["wave_generator/coefficient", "wave_generator/bearing_coefficient", "ring/coefficient", "carrier/coefficient"]
    {
        fields.push(of_friction(&format!("/friction/{pointer}")));
    }
    fields.push(of_friction("/friction/wave_generator/bearing_radius_mm"));
    let worn = with(&rubbing, "/friction/wear_rate_mm3_per_nm", json!({}));
    for contact in ["wave_generator", "ring", "carrier"] {
        let pointer = format!("/friction/wear_rate_mm3_per_nm/{contact}");
        fields.push(Field { document: worn.clone(), ..field(&pointer) });
    }
    let wave_generator = json!({
        "kind": "race", "coefficient": 0.05, "bearing_coefficient": 0.002, "bearing_radius_mm": 25.0,
        "bearing_element": "roller"
    });
    let rated = with(&eccentric(), "/friction", crate::friction::on(&wave_generator));
    let rated = with(&rated, "/load/input_speed_rpm", json!(1500.0));
    let pointer = "/friction/wave_generator/bearing_load_rating_n";
    fields.push(Field { document: rated, ..field(pointer) });
    let own = json!({ "wave_generator": 900.0, "ring": 1000.0, "carrier": 500.0 });
    let limited = with(&every_number(), "/load/allowable_stress_mpa", own);
    for contact in ["wave_generator", "ring", "carrier"] {
        let pointer = format!("/load/allowable_stress_mpa/{contact}");
        fields.push(Field { document: limited.clone(), ..field(&pointer) });
    }
    for part in ["wave_generator", "teeth", "ring", "carrier"] {
        fields.push(field(&format!("/materials/{part}/youngs_modulus_gpa")));
    }
    let modified = with(
        &with(&spelled_out(), "/model", json!({ "compatibility": "virtual_work" })),
        "/modification",
        json!({
            "ring_tip_relief": { "amount_um": 1.0, "start_deg": 60.0, "power": 2.0 }
        }),
    );
    let modification = |name: &str| Field { document: modified.clone(), ..field(&format!("/modification/{name}")) };
    for name in ["ring_equidistant", "ring_path_shift", "ring_profile_shift", "wave_generator_equidistant", "slot_wall"]
    {
        fields.push(modification(&format!("{name}_um")));
    }
    fields.push(modification("tooth_radius_um"));
    fields.push(modification("ring_rotation_arcsec"));
    fields.push(modification("carrier_rotation_arcsec"));
    fields.push(modification("ring_tip_relief/amount_um"));
    fields.push(modification("ring_tip_relief/power"));
    // Testing each entry would need another document each.
    let items = |count: usize| vec![0.0; count];
    let deviating = with(
        &with(&spelled_out(), "/model", json!({ "compatibility": "virtual_work" })),
        "/deviations",
        json!({
            "tooth_radius_um": items(28), "slot_angle_arcsec": items(28), "slot_wall_um": items(28),
            "ring_space_um": items(26), "ring_space_angle_arcsec": items(26), "wave_generator_lobe_um": items(2),
            "wave_generator_runout": {}, "ring_runout": {}, "carrier_runout": {}
        }),
    );
    let deviation = |name: &str| Field { document: deviating.clone(), ..field(&format!("/deviations/{name}")) };
    for name in ["tooth_radius_um/27", "slot_wall_um/0", "ring_space_um/25", "wave_generator_lobe_um/1"] {
        fields.push(deviation(name));
    }
    fields.push(deviation("slot_angle_arcsec/3"));
    fields.push(deviation("ring_space_angle_arcsec/7"));
    for contact in ["wave_generator", "ring", "carrier"] {
        fields.push(deviation(&format!("{contact}_runout/amount_um")));
        fields.push(deviation(&format!("{contact}_runout/angle_deg")));
    }
    for contact in ["wave_generator", "ring", "carrier"] {
        fields.push(field(&format!("/model/stiffness/{contact}_n_per_mm")));
    }
    fields
}

#[test]
fn typical_fields_have_known_bounds() {
    let found: HashMap<_, _> = ranges().map(|(pointer, Range { low, high, .. })| (pointer, [low, high])).collect();
    for (pointer, bounds) in [
        ("/drive/teeth/radius_mm", [1e-6, 1e6]),
        ("/drive/teeth/count", [2.0, 1e4]),
        ("/sweep/samples", [1.0, 1e7]),
        ("/load/input_torque_nm", [1e-12, 1e15]),
        ("/load/input_speed_rpm", [1e-6, 1e6]),
        ("/load/allowable_stress_mpa/ring", [1e-3, 1e6]),
        ("/friction/ring/coefficient", [0.0, 1.0]),
        ("/materials/teeth/youngs_modulus_gpa", [1e-3, 1e5]),
        ("/model/stiffness/ring_n_per_mm", [1e-3, 1e15]),
        ("/parts/ring/clearance_um", [0.0, 1e6]),
        ("/modification/slot_wall_um", [-1e6, 1e6]),
        ("/modification/ring_tip_relief/power", [0.1, 100.0]),
        ("/deviations/slot_angle_arcsec/0", [-1e5, 1e5]),
        ("/assembly/input_angle_deg", [-1e7, 1e7]),
    ] {
        assert_eq!(found[pointer], bounds, "{pointer}");
    }
}

/// Returns the exceeded limit if the service reports one at this field.
async fn limit_exceeded(field: &Field, value: f64) -> Option<f64> {
    // With a small limit, a sweep of many samples is refused quickly and only for that.
    let service = Service::within(Limits { max_states: 1_000, ..LIMITS });
    let document = with(&field.document, &field.pointer, json!(value));
    let answer = service.post(field.path, &document).await;
    if answer.status == 200 {
        assert!(!answer.text().contains("null"), "{}", answer.text());
        return None;
    }
    let problem = answer.problem();
    assert_eq!(answer.status, 422, "{problem}");
    let errors = problem.get("errors").and_then(Value::as_array).cloned().unwrap_or_default();
    let error =
        errors.iter().find(|error| error["pointer"] == field.pointer.as_str() && error["code"] == "out_of_range")?;
    assert_eq!(error["value"].as_f64(), Some(value), "{error}");
    Some(error["limit"].as_f64().unwrap())
}

#[tokio::test]
async fn both_ends_of_every_range_are_accepted() {
    for field in fields() {
        for value in [field.low, field.high] {
            assert_eq!(limit_exceeded(&field, value).await, None, "{} = {value:?}", field.pointer);
        }
    }
}

#[tokio::test]
async fn value_beyond_range_is_refused_with_limit() {
    for field in fields() {
        let beyond = if field.is_whole {
            [field.low - 1.0, field.high + 1.0]
        } else {
            [field.low.next_down(), field.high.next_up()]
        };
        for (value, limit) in beyond.into_iter().zip([field.low, field.high]) {
            assert_eq!(limit_exceeded(&field, value).await, Some(limit), "{} = {value:?}", field.pointer);
        }
        let below = if field.is_whole { [0.0, -28.0] } else { [0.0, -58.0] };
        for value in below.into_iter().filter(|&value| value < field.low) {
            assert_eq!(limit_exceeded(&field, value).await, Some(field.low), "{} = {value:?}", field.pointer);
        }
    }
}

#[tokio::test]
async fn poissons_ratio_lies_strictly_between_its_limits() {
    for part in ["wave_generator", "teeth", "ring", "carrier"] {
        let field = Field {
            pointer: format!("/materials/{part}/poissons_ratio"),
            path: "/v1/sweep",
            document: spelled_out(),
            low: -1.0,
            high: 0.5,
            is_whole: false,
        };
        for inside in [field.low.next_up(), -0.5, 0.0, field.high.next_down()] {
            assert_eq!(limit_exceeded(&field, inside).await, None, "{inside:?}");
        }
        for (beyond, limit) in [(field.low, field.low), (field.high, field.high), (-2.0, field.low), (0.6, field.high)]
        {
            assert_eq!(limit_exceeded(&field, beyond).await, Some(limit), "{beyond:?}");
        }
    }
}

#[tokio::test]
async fn every_number_has_a_range() {
    let known: Vec<_> = fields().into_iter().map(|field| field.pointer).collect();
    for pointer in crate::designs::pointers(&every_number(), Value::is_number) {
        assert!(known.contains(&pointer) || pointer.ends_with("/poissons_ratio"), "{pointer}");
    }
}

/// Returns a drive scaled in proportion.
fn scaled(scale: f64) -> Value {
    json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 58.0 * scale, "semi_minor_mm": 56.0 * scale },
            "teeth": { "count": 28, "radius_mm": 5.0 * scale, "width_mm": 15.0 * scale },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20.0 },
        "model": crate::designs::of_the_paper(),
        "profile": { "chord_tolerance_mm": (1e-3 * scale).max(1e-6) }
    })
}

#[tokio::test]
async fn smallest_and_largest_drive_are_answered() {
    let service = Service::new();
    for scale in [1e-6 / 5.0, 1e-3, 1.0, 1e3, 1e6 / 58.0] {
        for path in crate::asking::ENDPOINTS {
            let found = service.post(path, &scaled(scale)).await.found();
            let is_crushed = scale < 1e-2 && path == "/v1/sweep";
            let codes: Vec<_> = found["findings"].as_array().unwrap().iter().map(|one| &one["code"]).collect();
            // Under 20 N·m a drive of a hundredth of the size is overloaded: all stresses, and finally the wind-up,
            // exceed their limits.
            let stresses = codes.iter().filter(|&&code| code == "stress_above_fatigue_limit").count();
            assert_eq!(stresses, usize::from(is_crushed) * 3, "{scale}: {codes:?}");
            assert!(
                codes.len() == stresses || is_crushed && codes.contains(&&json!("wind_up_beyond_model")),
                "{scale}: {codes:?}"
            );
        }
        let found = service.post("/v1/sweep", &scaled(scale)).await.found();
        // Forces scale as torque over length, stresses as the root of torque over volume.
        let force_n = found["peaks"]["wave_generator"]["force_n"]["value"].as_f64().unwrap() * scale;
        assert!((force_n / 1_429.443_293_502_519 - 1.0).abs() < 1e-9, "{force_n}");
        let stress_mpa = found["peaks"]["wave_generator"]["stress_mpa"]["value"].as_f64().unwrap() * scale.powf(1.5);
        assert!((stress_mpa / 872.605_946_496_1 - 1.0).abs() < 1e-9, "{stress_mpa}");
    }
}

#[tokio::test]
async fn extreme_values_give_finite_numbers() {
    let service = Service::new();
    let soft = json!({ "youngs_modulus_gpa": 1e-3, "poissons_ratio": (-1.0_f64).next_up() });
    let hard = json!({ "youngs_modulus_gpa": 1e5, "poissons_ratio": 0.5_f64.next_down() });
    for torque in [1e-12, 1e15] {
        for materials in [&soft, &hard] {
            for stiffness in [1e-3, 1e15] {
                for law in [json!({ "law": "linear" }), fixed(stiffness, stiffness, stiffness)] {
                    let document = with(&spelled_out(), "/load", json!({ "input_torque_nm": torque }));
                    let parts =
                        ["wave_generator", "teeth", "ring", "carrier"].map(|part| (part.to_owned(), materials.clone()));
                    let document = with(&document, "/materials", parts.into_iter().collect());
                    let document = with(&document, "/model/stiffness", law);
                    let answer = service.post("/v1/sweep", &document).await;
                    answer.found();
                    assert!(!answer.text().contains("null"));
                }
            }
        }
    }
}
