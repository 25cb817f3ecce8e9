//! Drawings over HTTP: outlines that close, areas in closed form, and the same geometry in every format.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::asking::{Question, Service};
use crate::designs::{bored, eccentric, shortest, undercut, with};

pub(crate) const PARTS: [&str; 4] = ["ring", "wave-generator", "carrier", "tooth"];

/// Returns case 5.1 with a `parts` group.
pub(crate) fn made(parts: &str) -> Value {
    let document = with(&shortest(), "/parts", serde_json::from_str(parts).unwrap());
    with(&document, "/assembly", json!({}))
}

/// Parts of case 5.1 that cannot be made, with code, field, value and limit.
pub(crate) const MISFITS: [(&str, &str, &str, f64, f64); 8] = [
    (r#"{ "ring": { "outer_radius_mm": 68 } }"#, "ring_without_rim", "/parts/ring/outer_radius_mm", 68.0, 68.000_068),
    (r#"{ "carrier": { "inner_radius_mm": 58 } }"#, "carrier_meets_cam", "/parts/carrier/inner_radius_mm", 58.0, 58.0),
    (r#"{ "carrier": { "outer_radius_mm": 66 } }"#, "carrier_meets_ring", "/parts/carrier/outer_radius_mm", 66.0, 66.0),
    (
        r#"{ "carrier": { "inner_radius_mm": 65.5 } }"#,
        "carrier_without_wall",
        "/parts/carrier/outer_radius_mm",
        65.2,
        65.5,
    ),
    (
        // 7.4 mm over sin(pi/28).
        r#"{ "carrier": { "clearance_um": 2400 } }"#,
        "slots_take_carrier",
        "/parts/carrier/outer_radius_mm",
        65.2,
        66.092_391_6,
    ),
    (
        r#"{ "wave_generator": { "bore_radius_mm": 55.5, "clearance_um": 500 } }"#,
        "bore_takes_cam",
        "/parts/wave_generator/bore_radius_mm",
        55.5,
        55.499_944_5,
    ),
    (
        // 56 mm times 56/58, in µm.
        r#"{ "wave_generator": { "clearance_um": 54069 } }"#,
        "clearance_takes_cam",
        "/parts/wave_generator/clearance_um",
        54_069.0,
        54_068.965_5,
    ),
    (r#"{ "teeth": { "clearance_um": 5000 } }"#, "clearance_takes_tooth", "/parts/teeth/clearance_um", 5000.0, 5000.0),
];

pub(crate) async fn drawn(part: &str, document: &Value) -> Value {
    Service::new().post(&format!("/v1/drawings/{part}"), document).await.found()
}

async fn written(part: &str, document: &Value, accept: &str) -> String {
    let question = Question::post(&format!("/v1/drawings/{part}"), document.to_string()).with("accept", accept);
    let answer = Service::new().ask(&question).await;
    assert_eq!((answer.status, answer.header("content-type")), (200, accept), "{}", answer.text());
    answer.text().to_owned()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Returns the area of an outline: the shoelace formula for its chords, plus the segments of its arcs.
fn area_mm2(outline: &Value) -> f64 {
    if let Some(radius_mm) = outline["radius_mm"].as_f64() {
        return PI * radius_mm * radius_mm;
    }
    let of_edge = |edge: &Value| {
        let (x, y) = (numbers(&edge["x_mm"]), numbers(&edge["y_mm"]));
        if edge["kind"] == "arc" {
            let (radius_mm, sweep_rad) =
                (edge["radius_mm"].as_f64().unwrap(), edge["sweep_deg"].as_f64().unwrap().to_radians());
            let center = numbers(&edge["center_mm"]);
            // The sector, and the triangle of its centre, its ends and the origin.
            let moved = center[0] * (y[2] - y[0]) - center[1] * (x[2] - x[0]);
            return 0.5 * (radius_mm * radius_mm * sweep_rad + moved);
        }
        (1..x.len()).map(|i| 0.5 * (x[i - 1] * y[i] - x[i] * y[i - 1])).sum()
    };
    outline["edges"].as_array().unwrap().iter().map(of_edge).sum()
}

/// Returns the area of all prisms in a drawing of one part.
pub(crate) async fn part_area_mm2(part: &str, document: &Value) -> f64 {
    let drawing = drawn(part, document).await;
    let [body] = drawing["bodies"].as_array().unwrap().as_slice() else { panic!("{drawing}") };
    let holes: f64 = body["holes"].as_array().unwrap().iter().map(area_mm2).sum();
    body["placements"].as_array().unwrap().len() as f64 * (area_mm2(&body["outer"]) - holes)
}

#[tokio::test]
async fn rejects_unmakeable_part_with_value_and_limit() {
    for (parts, code, pointer, value, limit) in MISFITS {
        let problem =
            Service::new().post("/v1/drawings/assembly", &made(parts)).await.refused(422, "impossible_design");
        let [error] = problem["errors"].as_array().unwrap().as_slice() else { panic!("{problem}") };
        assert_eq!((&error["code"], &error["pointer"]), (&json!(code), &json!(pointer)));
        for (name, expected) in [("value", value), ("limit", limit)] {
            let found = error[name].as_f64().unwrap();
            assert!((found - expected).abs() <= 1e-8 * expected, "{name} of {error}");
        }
    }
}

#[tokio::test]
async fn rejects_wall_too_thin_for_cad() {
    for (group, field, none_mm, code) in [
        ("wave_generator", "bore_radius_mm", 56.0 - 1e-7, "bore_takes_cam"),
        ("ring", "outer_radius_mm", 68.0 + 1e-7, "ring_without_rim"),
    ] {
        let of = |radius_mm: f64| with(&shortest(), "/parts", json!({ group: { field: radius_mm } }));
        let problem =
            Service::new().post("/v1/drawings/assembly", &of(none_mm)).await.refused(422, "impossible_design");
        assert_eq!(problem["errors"][0]["code"], code);
        let limit_mm = problem["errors"][0]["limit"].as_f64().unwrap();
        drawn("assembly", &of(limit_mm + 1e-9 * (limit_mm - none_mm).signum())).await;
    }
}

#[tokio::test]
async fn step_extrudes_named_and_coloured_parts() {
    let hash = drawn("assembly", &undercut()).await["design_hash"].as_str().unwrap()[..8].to_owned();
    let text = written("assembly", &undercut(), "model/step").await;
    let count = |what: &str| text.matches(what).count();
    for name in ["ring", "carrier_finger", "tooth", "wave_generator", "assembly"] {
        assert_eq!(count(&format!("=PRODUCT('{name} {hash}'")), 1, "{name}");
    }
    assert_eq!((count("=PRODUCT("), count("=MANIFOLD_SOLID_BREP("), count("=STYLED_ITEM(")), (5, 4, 4));
    assert_eq!(count("=NEXT_ASSEMBLY_USAGE_OCCURRENCE("), 2 + 2 * 40);
    // The cam's quarters and the ring's flanks, each a few polynomials.
    let extruded = count("=SURFACE_OF_LINEAR_EXTRUSION(");
    assert!((2 * 4 + 2 * 78..=3 * (4 + 2 * 78)).contains(&extruded), "{extruded}");
    assert_eq!((count("=B_SPLINE_CURVE_WITH_KNOTS("), count("=B_SPLINE_SURFACE_WITH_KNOTS(")), (2 * extruded, 0));
    assert_eq!(written("tooth", &undercut(), "model/step").await.matches("NEXT_ASSEMBLY_USAGE_OCCURRENCE").count(), 0);
}

/// Polynomials follow their own error limit, so a solid has few faces even with a fine chord tolerance.
#[tokio::test]
async fn step_at_ten_nanometres_is_small() {
    let [of_10_nm, of_1_nm] = [1e-3, 1e-4].map(async |tolerance_mm| {
        let profile = json!({ "chord_tolerance_mm": tolerance_mm });
        written("ring", &with(&shortest(), "/profile", profile), "model/step").await
    });
    let (of_10_nm, of_1_nm) = (of_10_nm.await, of_1_nm.await);
    let polynomials = |text: &str| text.matches("=B_SPLINE_CURVE_WITH_KNOTS(").count();
    // Each edge appears twice, at the bottom and at the top.
    assert_eq!(polynomials(&of_10_nm), 2 * 5 * 26);
    assert!(of_10_nm.len() < 240_000, "{} bytes", of_10_nm.len());
    assert!(polynomials(&of_1_nm) < 2 * 8 * 26, "{}", polynomials(&of_1_nm));
}

/// OpenCascade's quadrature with nine points integrates these exactly, but no piecewise polynomial.
#[tokio::test]
async fn step_faces_are_polynomials_up_to_degree_eight() {
    let text = written("assembly", &undercut(), "model/step").await;
    for line in text.lines().filter(|line| line.contains("B_SPLINE_CURVE_WITH_KNOTS")) {
        let degree: usize = line.split("('',").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
        assert!((3..=8).contains(&degree), "{line}");
        let ends = format!("({0},{0}),(0.,1.),.UNSPECIFIED.);", degree + 1);
        assert!(line.ends_with(&ends), "{line}");
    }
}

#[tokio::test]
async fn excessive_modification_names_number_and_limit() {
    let refused = async |modification: Value| {
        let document = with(&shortest(), "/modification", modification);
        let problem = Service::new().post("/v1/drawings/assembly", &document).await.refused(422, "impossible_design");
        let [error] = problem["errors"].as_array().unwrap().as_slice() else { panic!("{problem}") };
        assert_eq!(error["code"], "modification_leaves_nothing");
        (error["pointer"].as_str().unwrap().to_owned(), error["value"].as_f64().unwrap(), error["limit"].as_f64())
    };
    let slot = refused(json!({ "slot_wall_um": -6000.0 })).await;
    assert_eq!(slot, ("/modification/slot_wall_um".to_owned(), -6000.0, Some(-5000.0)));
    let ring = refused(json!({ "ring_rotation_arcsec": 30_000.0 })).await;
    assert_eq!(ring, ("/modification/ring_rotation_arcsec".to_owned(), 30_000.0, None));
}

/// A drawing's entity tag follows from what it shows, so a modification gives another tag.
#[tokio::test]
async fn modification_changes_drawing_of_each_part_involved() {
    for (part, modification) in [
        ("ring", json!({ "ring_tip_relief": { "amount_um": 5.0, "start_deg": 60.0, "power": 2.0 } })),
        ("ring", json!({ "ring_path_shift_um": -2.0 })),
        ("wave-generator", json!({ "wave_generator_equidistant_um": 3.0 })),
        ("carrier", json!({ "slot_wall_um": 2.0 })),
        ("tooth", json!({ "tooth_radius_um": 1.0 })),
        ("assembly", json!({ "carrier_rotation_arcsec": 9.0 })),
    ] {
        let modified = with(&shortest(), "/modification", modification);
        let (plain, modified) = (drawn(part, &shortest()).await, drawn(part, &modified).await);
        assert_ne!(plain["bodies"], modified["bodies"], "{part}");
        assert_ne!(plain["design_hash"], modified["design_hash"], "{part}");
    }
}

#[tokio::test]
async fn turned_carrier_leads_its_teeth() {
    let turned = with(&shortest(), "/modification", json!({ "carrier_rotation_arcsec": 36.0 }));
    let angle = async |document: &Value| {
        let drawing = drawn("assembly", document).await;
        let carrier = drawing["bodies"].as_array().unwrap().iter().find(|body| body["part"] == "carrier").unwrap();
        carrier["placements"][3]["rotation_deg"].as_f64().unwrap()
    };
    assert!((angle(&turned).await - angle(&shortest()).await - 0.01).abs() < 1e-12);
}

#[tokio::test]
async fn balls_are_spheres_and_other_parts_prisms() {
    let document: Value = serde_json::from_str(include_str!("../../examples/balls.json")).unwrap();
    let drawing = drawn("assembly", &document).await;
    for body in drawing["bodies"].as_array().unwrap() {
        assert_eq!(body["solid"], if body["part"] == "teeth" { "ball" } else { "prism" });
    }
    let ball = written("tooth", &document, "model/step").await;
    let count = |what: &str| ball.matches(what).count();
    assert_eq!((count("=SPHERICAL_SURFACE("), count("=ADVANCED_FACE("), count("=CYLINDRICAL_SURFACE(")), (1, 2, 0));
}

#[tokio::test]
async fn eccentric_is_arcs_and_cylinders() {
    let document =
        with(&eccentric(), "/parts", json!({ "wave_generator": { "bore_radius_mm": 10.0, "clearance_um": 50.0 } }));
    let drawing = drawn("wave-generator", &document).await;
    let edges = drawing["bodies"][0]["outer"]["edges"].as_array().unwrap();
    assert_eq!(edges.len(), 2);
    for edge in edges {
        let found = (&edge["kind"], &edge["center_mm"], &edge["radius_mm"], &edge["sweep_deg"]);
        assert_eq!(found, (&json!("arc"), &json!([1.2, 0.0]), &json!(30.75), &json!(180.0)));
    }
    assert_area(part_area_mm2("wave-generator", &document).await, PI * (30.75 * 30.75 - 100.0), "eccentric");
    let step = written("wave-generator", &document, "model/step").await;
    let count = |what: &str| step.matches(what).count();
    // Two halves each of the eccentric and of its bore; below and above each has a circle.
    assert_eq!(
        (count("=CYLINDRICAL_SURFACE("), count("=CIRCLE("), count("B_SPLINE"), count("EXTRUSION")),
        (4, 8, 0, 0)
    );
    assert!(step.contains("CARTESIAN_POINT('',(1.2,0.,0.))"));
    let svg = written("wave-generator", &document, "image/svg+xml").await;
    assert_eq!((svg.matches("A30.75 30.75").count(), svg.matches('L').count()), (2, 0));
}

#[tokio::test]
async fn draws_part_though_another_is_impossible() {
    let document = made(r#"{ "ring": { "outer_radius_mm": 10 } }"#);
    drawn("carrier", &document).await;
    Service::new().post("/v1/drawings/ring", &document).await.refused(422, "impossible_design");
}

#[tokio::test]
async fn reports_impossible_drive_and_parts_together() {
    let document = with(&made(r#"{ "teeth": { "clearance_um": -1 } }"#), "/drive/teeth/radius_mm", json!(0));
    let problem = Service::new().post("/v1/drawings/tooth", &document).await.refused(422, "impossible_design");
    assert_eq!(problem["errors"].as_array().unwrap().len(), 2, "{problem}");
}

#[tokio::test]
async fn unknown_part_is_not_found() {
    let problem = Service::new().post("/v1/drawings/gearbox", &shortest()).await.refused(404, "not_found");
    let detail = problem["detail"].as_str().unwrap();
    assert!(PARTS.iter().chain(&["assembly"]).all(|part| detail.contains(part)), "{detail}");
}

#[tokio::test]
async fn each_edge_starts_where_previous_ends() {
    for document in [shortest(), undercut(), bored()] {
        for part in PARTS {
            for body in drawn(part, &document).await["bodies"].as_array().unwrap() {
                for outline in body["holes"].as_array().unwrap().iter().chain([&body["outer"]]) {
                    let Some(edges) = outline["edges"].as_array() else { continue };
                    let ends = |edge: &Value| {
                        let (x, y) = (numbers(&edge["x_mm"]), numbers(&edge["y_mm"]));
                        ([x[0], y[0]], [x[x.len() - 1], y[y.len() - 1]])
                    };
                    let ends: Vec<_> = edges.iter().map(ends).collect();
                    for (index, (start, _)) in ends.iter().enumerate() {
                        assert_eq!(*start, ends[(index + ends.len() - 1) % ends.len()].1, "{part} {index}");
                    }
                }
            }
        }
    }
}

/// Sets a chord tolerance far below the one of compared areas.
pub(crate) fn finely(document: &Value) -> Value {
    with(document, "/profile", json!({ "chord_tolerance_mm": 1e-6 }))
}

fn assert_area(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 1e-6, "{what}: {found} is not {expected}");
}

#[tokio::test]
async fn cam_tooth_and_carrier_have_closed_form_areas() {
    let document = finely(&made(
        r#"{ "wave_generator": { "bore_radius_mm": 20 }, "carrier": { "inner_radius_mm": 59, "outer_radius_mm": 65 } }"#,
    ));
    assert_area(part_area_mm2("wave-generator", &document).await, PI * (58.0 * 56.0 - 400.0), "cam");
    assert_area(part_area_mm2("tooth", &document).await, PI * 25.0, "tooth");
    // A slot's area between the radii: the strip of half-width w, its ends bounded by the circles.
    let strip = |radius: f64, w: f64| w * (radius * radius - w * w).sqrt() + radius * radius * (w / radius).asin();
    let carrier = |w: f64| PI * (65.0 * 65.0 - 59.0 * 59.0) - 28.0 * (strip(65.0, w) - strip(59.0, w));
    assert_area(part_area_mm2("carrier", &document).await, carrier(5.0), "carrier");
    let wider = with(&document, "/parts/carrier/clearance_um", json!(30.0));
    assert_area(part_area_mm2("carrier", &wider).await, carrier(5.03), "carrier with clearance");
    let thinner = with(&document, "/parts/teeth", json!({ "clearance_um": 10.0 }));
    assert_area(part_area_mm2("tooth", &thinner).await, PI * 4.99 * 4.99, "tooth with clearance");
}

/// Steiner: an offset by c changes the area of a closed curve of length L by L c + π c² outward, L c - π c² inward.
#[tokio::test]
async fn clearance_changes_area_by_length_times_clearance() {
    let clearance_mm = 0.1;
    for (part, group, outline, outward) in
        [("ring", "ring", "/bodies/0/holes/0", 1.0), ("wave-generator", "wave_generator", "/bodies/0/outer", -1.0)]
    {
        let curve = async |clearance_um: f64| {
            let parts = json!({ group: { "clearance_um": clearance_um } });
            let drawing = drawn(part, &finely(&with(&shortest(), "/parts", parts))).await;
            let outline = drawing.pointer(outline).unwrap().clone();
            let chords = polygon(&outline, &json!({ "rotation_deg": 0.0 }));
            let length_mm: f64 =
                chords.iter().zip(chords.iter().cycle().skip(1)).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
            (area_mm2(&outline), length_mm)
        };
        let ((without, length_mm), (with, _)) = (curve(0.0).await, curve(1e3 * clearance_mm).await);
        let expected = outward * length_mm * clearance_mm + PI * clearance_mm * clearance_mm;
        assert!(((with - without) / expected - 1.0).abs() < 1e-5, "{part}: {} is not {expected}", with - without);
    }
}

#[tokio::test]
async fn bored_ring_has_lands_and_undercut_has_points() {
    let edges = |drawing: Value| drawing["bodies"][0]["holes"][0]["edges"].as_array().unwrap().clone();
    let kinds = |edges: &[Value], kind: &str| edges.iter().filter(|edge| edge["kind"] == kind).count();
    let bored = edges(drawn("ring", &bored()).await);
    assert_eq!((kinds(&bored, "curve"), kinds(&bored, "arc")), (78, 78));
    assert!(bored.iter().all(|edge| edge["kind"] != "arc" || edge["radius_mm"] == 52.8227));
    let pointed = edges(drawn("ring", &undercut()).await);
    assert_eq!((kinds(&pointed, "curve"), kinds(&pointed, "arc")), (78, 0));
    // At a point the direction turns by twice the angle between flank and symmetry line; no spike reaches beyond.
    let turn_deg = pointed[1]["start_tangent_deg"].as_f64().unwrap() - pointed[0]["end_tangent_deg"].as_f64().unwrap();
    assert!(turn_deg.abs() > 10.0 && turn_deg.abs() < 170.0, "{turn_deg}");
    let geometry = Service::new().post("/v1/geometry", &undercut()).await.found();
    let tip_radius_mm = geometry["ring"]["tip_radius_mm"].as_f64().unwrap();
    for edge in &pointed {
        let (x, y) = (numbers(&edge["x_mm"]), numbers(&edge["y_mm"]));
        assert!(x.iter().zip(&y).all(|(x, y)| x.hypot(*y) > tip_radius_mm - 1e-12));
    }
}

#[tokio::test]
async fn every_format_names_its_content() {
    for part in PARTS.iter().chain(&["assembly"]) {
        let drawing = drawn(part, &bored()).await;
        let hash = drawing["design_hash"].as_str().unwrap();
        for accept in ["image/svg+xml", "image/vnd.dxf", "model/step"] {
            let text = written(part, &bored(), accept).await;
            assert!(text.contains(&format!(
                "toothwave {}, {part}, design {hash}",
                drawing["solver_version"].as_str().unwrap()
            )));
            assert!(!text.contains("NaN") && !text.contains("inf"), "{part}");
        }
    }
    let at = |deg: f64| with(&bored(), "/assembly", json!({ "input_angle_deg": deg }));
    assert_eq!(
        drawn("assembly", &at(0.0)).await["design_hash"],
        drawn("assembly", &at(30.0)).await["design_hash"],
        "the design is the same at every angle"
    );
}

#[tokio::test]
async fn dxf_has_millimetres_layers_and_closed_polylines() {
    let text = written("assembly", &undercut(), "image/vnd.dxf").await;
    let pairs: Vec<_> = text
        .split("\r\n")
        .collect::<Vec<_>>()
        .chunks_exact(2)
        .map(|pair| (pair[0].trim(), pair[1]))
        .collect::<Vec<_>>();
    let follows =
        |first: (&str, &str), then: (&str, &str)| pairs.windows(2).any(|two| two[0] == first && two[1] == then);
    assert!(follows(("9", "$INSUNITS"), ("70", "4")) && follows(("9", "$ACADVER"), ("1", "AC1015")));
    for layer in ["RING", "CARRIER", "TEETH", "WAVE_GENERATOR"] {
        assert!(pairs.contains(&("8", layer)) && pairs.contains(&("2", layer)), "{layer}");
    }
    let polylines = pairs.iter().filter(|pair| **pair == ("0", "LWPOLYLINE")).count();
    let closed = pairs.windows(2).filter(|two| two[0].0 == "90" && two[1] == ("70", "1")).count();
    // Ring and cam, and a finger between any two of the forty slots.
    assert_eq!((polylines, closed), (42, 42));
    assert_eq!(pairs.iter().filter(|pair| **pair == ("0", "CIRCLE")).count(), 41);
}

#[tokio::test]
async fn parts_change_estimates_but_no_load() {
    let service = Service::new();
    let document = made(r#"{ "ring": { "outer_radius_mm": 1 } }"#);
    for path in ["/v1/geometry", "/v1/coincidence-degree"] {
        service.post(path, &shortest()).await.found();
        assert!(service.post(path, &document).await.is_hit(), "{path}");
    }
    let [usual, made] = [service.post("/v1/sweep", &shortest()).await, service.post("/v1/sweep", &document).await]
        .map(|answer| answer.found());
    for name in ["states", "peaks"] {
        assert_eq!(usual[name], made[name], "{name}");
    }
    let has_rim = |answer: &Value| {
        let estimates = answer["series_compliance_estimates"].as_array().unwrap();
        estimates.iter().any(|estimate| estimate["backing"] == "housed_rim")
    };
    assert!(has_rim(&usual) && !has_rim(&made), "a rim of 1 mm cannot be made");
}

#[tokio::test]
async fn drawing_of_one_part_needs_no_angle() {
    let service = Service::new();
    service.post("/v1/drawings/ring", &shortest()).await.found();
    let turned = with(&shortest(), "/assembly", json!({ "input_angle_deg": 12.5 }));
    assert!(service.post("/v1/drawings/ring", &turned).await.is_hit());
    service.post("/v1/drawings/assembly", &shortest()).await.found();
    assert!(service.post("/v1/drawings/assembly", &turned).await.is_miss());
}

/// The distance of a tooth's centre from the outline of cam and ring is its radius, within the chord tolerance.
#[tokio::test]
async fn engaged_teeth_touch_cam_and_ring() {
    for (design, start_deg) in [(shortest(), 90.0), (undercut(), 43.607_598_857_26), (bored(), 34.0787)] {
        let radius_mm = design["drive"]["teeth"]["radius_mm"].as_f64().unwrap();
        for angle_deg in [0.0, 7.0, 100.0, -33.0, 359.0, 1e5 + 0.25] {
            let document = with(&design, "/assembly", json!({ "input_angle_deg": angle_deg }));
            let drawing = drawn("assembly", &document).await;
            let bodies = drawing["bodies"].as_array().unwrap();
            let body = |part: &str| bodies.iter().find(|body| body["part"] == part).unwrap();
            let cam = polygon(&body("wave_generator")["outer"], &body("wave_generator")["placements"][0]);
            let ring = polygon(&body("ring")["holes"][0], &body("ring")["placements"][0]);
            let mut engaged = 0;
            for tooth in body("teeth")["placements"].as_array().unwrap() {
                let center = [tooth["x_mm"].as_f64().unwrap(), tooth["y_mm"].as_f64().unwrap()];
                let to_cam = distance(&cam, center) - radius_mm;
                let to_ring = distance(&ring, center) - radius_mm;
                assert!(to_cam.abs() < 2e-3, "{angle_deg}: {to_cam}");
                assert!(to_ring > -2e-3, "{angle_deg}: {to_ring}");
                let position_deg = (center[1].atan2(center[0]).to_degrees() - angle_deg).rem_euclid(180.0);
                if position_deg > 0.01 && position_deg < start_deg - 0.01 {
                    engaged += 1;
                    assert!(to_ring < 2e-3, "{angle_deg} {position_deg}: {to_ring}");
                }
            }
            assert!(engaged >= 6, "{engaged}");
        }
    }
}

/// Returns the chords of a placed outline, with each arc (a land here) as three points.
fn polygon(outline: &Value, placement: &Value) -> Vec<[f64; 2]> {
    let (sin, cos) = placement["rotation_deg"].as_f64().unwrap().to_radians().sin_cos();
    let edges = outline["edges"].as_array().unwrap();
    let points = edges.iter().flat_map(|edge| numbers(&edge["x_mm"]).into_iter().zip(numbers(&edge["y_mm"])));
    points.map(|(x, y)| [x * cos - y * sin, x * sin + y * cos]).collect()
}

/// Returns the least distance of a point from a closed polygon.
fn distance(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let of_chord = |(from, to): (&[f64; 2], &[f64; 2])| {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length2 = dx * dx + dy * dy;
        let along = if length2 == 0.0 { 0.0 } else { ((x - from[0]) * dx + (y - from[1]) * dy) / length2 };
        let along = along.clamp(0.0, 1.0);
        (x - from[0] - along * dx).hypot(y - from[1] - along * dy)
    };
    polygon.iter().zip(polygon.iter().cycle().skip(1)).map(of_chord).fold(f64::INFINITY, f64::min)
}
