//! Deviations of single items.

use serde_json::{Value, json};

use crate::asking::{LIMITS, Limits, Question, Service};
use crate::designs::{spelled_out, with};

/// Returns case 5.1 with clearances that cover deviations of a few micrometres.
fn cleared() -> Value {
    let model = json!({ "compatibility": "virtual_work", "stiffness": { "law": "palmgren" } });
    let document = with(&spelled_out(), "/model", model);
    let document = with(&document, "/sweep", json!({ "samples": 4, "wind_up": true }));
    let clearance = json!({ "clearance_um": 8.0 });
    with(&document, "/parts", json!({ "wave_generator": clearance, "ring": clearance, "carrier": clearance }))
}

fn with_deviations(deviations: Value) -> Value {
    with(&cleared(), "/deviations", deviations)
}

/// Returns a list of zeros except for one item.
fn one(items: usize, item: usize, value: f64) -> Vec<f64> {
    (0..items).map(|other| if other == item { value } else { 0.0 }).collect()
}

/// Returns deviations of every kind.
fn every_kind() -> Value {
    json!({
        "tooth_radius_um": one(28, 3, 1.0), "slot_angle_arcsec": one(28, 4, 5.0), "slot_wall_um": one(28, 5, 1.0),
        "ring_space_um": one(26, 6, 1.0), "ring_space_angle_arcsec": one(26, 7, 5.0),
        "wave_generator_lobe_um": [0.0, 1.0],
        "wave_generator_runout": { "amount_um": 2.0, "angle_deg": 40.0 },
        "ring_runout": { "amount_um": 1.0, "angle_deg": -30.0 }, "carrier_runout": { "amount_um": 1.0, "angle_deg": 80.0 }
    })
}

/// Returns a document with a measured ring and a cam off its axis.
pub(crate) fn deviating() -> Value {
    with_deviations(json!({ "ring_space_um": one(26, 6, 2.0), "wave_generator_runout": { "amount_um": 2.0 } }))
}

async fn swept(document: &Value) -> Value {
    Service::new().post("/v1/sweep", document).await.found()
}

fn numbers(column: &Value) -> Vec<f64> {
    column.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

#[tokio::test]
async fn deviations_list_all_zones_by_slot() {
    let nominal = swept(&cleared()).await;
    assert!(nominal.get("sweep_period_deg").is_none() && nominal["states"].get("lobe").is_none());
    // Load periods: one for the cam; with it as many as slots or ring spaces, else half (docs/explanation/theory.md section 4.8).
    for (deviations, periods) in [
        (json!({ "wave_generator_runout": { "amount_um": 2.0 } }), 1.0),
        (json!({ "slot_wall_um": one(28, 5, 1.0) }), 14.0),
        (json!({ "ring_space_um": one(26, 5, 1.0) }), 13.0),
        (json!({ "slot_wall_um": one(28, 5, 1.0), "wave_generator_lobe_um": [0.0, 1.0] }), 28.0),
        (every_kind(), 364.0),
    ] {
        let answer = swept(&with_deviations(deviations.clone())).await;
        assert_eq!(answer["period_deg"], nominal["period_deg"]);
        let ratio = answer["sweep_period_deg"].as_f64().unwrap() / answer["period_deg"].as_f64().unwrap();
        assert!((ratio - periods).abs() < 1e-9, "{deviations}: {ratio}");
        let states = &answer["states"];
        let angles = numbers(&states["input_angle_deg"]);
        assert_eq!(angles.last(), answer["sweep_period_deg"].as_f64().as_ref());
        assert_eq!(numbers(&answer["wind_up"]["input_angle_deg"]).len() as f64, 4.0 * periods + 1.0);
        // Each zone has seven teeth.
        assert_eq!(angles.iter().filter(|&&angle| angle == 0.0).count(), 14);
        assert!(numbers(&states["tooth"]).iter().all(|&slot| slot < 28.0));
        let lobes = numbers(&states["lobe"]);
        assert_eq!((lobes.len(), lobes.iter().copied().fold(0.0, f64::max)), (angles.len(), 1.0));
        assert_eq!(states["loaded"].as_array().unwrap().len(), angles.len());
        let unloaded = numbers(&answer["wind_up"]["unloaded_wind_up_deg"]);
        assert!(unloaded.iter().zip(numbers(&answer["wind_up"]["wind_up_deg"])).all(|(&without, with)| without < with));
        let range = |column: &[f64]| {
            column.iter().copied().fold(0.0, f64::max) - column.iter().copied().fold(f64::INFINITY, f64::min)
        };
        let error_deg = answer["wind_up"]["unloaded_transmission_error_peak_to_peak_deg"].as_f64().unwrap();
        assert!((14.0 * error_deg / range(&unloaded) - 1.0).abs() < 1e-12);
        assert!(answer["checks"]["period_closure_residual"].as_f64().unwrap() < 1e-11);
        // Unlike lobes do not balance each other.
        let aside = numbers(&answer["radial_force_n"]["value"]);
        assert!(aside.iter().any(|&force_n| force_n > 0.1), "{deviations}");
    }
}

#[tokio::test]
async fn omits_unloaded_wind_up_without_gaps() {
    let document = with(&spelled_out(), "/sweep", json!({ "wind_up": true }));
    let wind_up = swept(&document).await["wind_up"].clone();
    assert!(wind_up.get("unloaded_wind_up_deg").is_none(), "{wind_up}");
    assert!(wind_up.get("unloaded_transmission_error_peak_to_peak_deg").is_none());
}

#[tokio::test]
async fn geometry_has_ratios_for_each_fixed_member() {
    let members = Service::new().post("/v1/geometry", &spelled_out()).await.found()["members"].clone();
    assert_eq!(
        members,
        json!({
            "ring_fixed": { "ratio": 14.0, "holding_torque_ratio": 13.0 },
            "carrier_fixed": { "ratio": -13.0, "holding_torque_ratio": -14.0 },
            "wave_generator_fixed": { "ratio": 28.0 / 26.0, "holding_torque_ratio": 2.0 / 26.0 }
        })
    );
}

#[tokio::test]
async fn each_deviation_changes_an_answer() {
    // One interval in each of the 364 load periods shows the difference.
    let document = with(&with_deviations(every_kind()), "/sweep/samples", json!(1));
    let found = async |document: &Value| {
        let answer = swept(document).await;
        (numbers(&answer["states"]["force_ring_n"]), numbers(&answer["wind_up"]["wind_up_deg"]))
    };
    let before = found(&document).await;
    let lists = [
        "tooth_radius_um/3",
        "slot_angle_arcsec/4",
        "slot_wall_um/5",
        "ring_space_um/6",
        "ring_space_angle_arcsec/7",
        "wave_generator_lobe_um/1",
    ];
    let runouts = ["wave_generator", "ring", "carrier"];
    let runouts =
        runouts.iter().flat_map(|part| ["amount_um", "angle_deg"].map(|name| format!("{part}_runout/{name}")));
    for field in lists.into_iter().map(str::to_owned).chain(runouts) {
        let field = format!("/deviations/{field}");
        let more = 1.1 * document.pointer(&field).unwrap().as_f64().unwrap();
        assert!(found(&with(&document, &field, json!(more))).await != before, "{field} moves nothing");
    }
}

#[tokio::test]
async fn deviation_of_every_item_equals_modification() {
    let all = |items: usize, value: f64| vec![value; items];
    let pairs = [
        (json!({ "tooth_radius_um": all(28, 2.0) }), json!({ "tooth_radius_um": 2.0 })),
        (json!({ "slot_wall_um": all(28, 2.0) }), json!({ "slot_wall_um": 2.0 })),
        (json!({ "slot_angle_arcsec": all(28, -8.0) }), json!({ "carrier_rotation_arcsec": -8.0 })),
        (json!({ "ring_space_um": all(26, -3.0) }), json!({ "ring_equidistant_um": -3.0 })),
        (json!({ "ring_space_angle_arcsec": all(26, 8.0) }), json!({ "ring_rotation_arcsec": 8.0 })),
        (json!({ "wave_generator_lobe_um": all(2, 3.0) }), json!({ "wave_generator_equidistant_um": 3.0 })),
    ];
    for (deviations, modification) in pairs {
        let found = swept(&with_deviations(deviations.clone())).await;
        let expected = swept(&with(&cleared(), "/modification", modification)).await;
        for contact in ["wave_generator", "ring", "carrier"] {
            for quantity in ["force_n", "stress_mpa"] {
                let peak = |answer: &Value| answer["peaks"][contact][quantity]["value"].as_f64().unwrap();
                assert!((peak(&found) / peak(&expected) - 1.0).abs() < 1e-12, "{deviations}");
            }
        }
    }
}

#[tokio::test]
async fn reports_misfit_list_and_entries_at_their_places() {
    let mut walls = one(27, 3, 2e6);
    walls[5] = -2e6;
    let deviations = json!({
        "slot_wall_um": walls, "ring_space_um": one(28, 0, 1.0), "wave_generator_lobe_um": [1.0],
        "carrier_runout": { "amount_um": -1.0, "angle_deg": 361.0 }
    });
    let document = with(&with_deviations(deviations), "/load", json!({ "input_torque_nm": 0.0 }));
    let problem = Service::new().post("/v1/sweep", &document).await.refused(422, "impossible_design");
    let mut errors: Vec<_> = problem["errors"]
        .as_array()
        .unwrap()
        .iter()
        .map(|error| {
            let number = |name: &str| error[name].as_f64().unwrap();
            (error["pointer"].as_str().unwrap(), error["code"].as_str().unwrap(), number("value"), number("limit"))
        })
        .collect();
    errors.sort_by(|one, other| one.0.cmp(other.0));
    assert_eq!(
        errors,
        [
            ("/deviations/carrier_runout/amount_um", "out_of_range", -1.0, 0.0),
            ("/deviations/carrier_runout/angle_deg", "out_of_range", 361.0, 360.0),
            ("/deviations/ring_space_um", "wrong_length", 28.0, 26.0),
            ("/deviations/slot_wall_um", "wrong_length", 27.0, 28.0),
            ("/deviations/slot_wall_um/3", "out_of_range", 2e6, 1e6),
            ("/deviations/slot_wall_um/5", "out_of_range", -2e6, -1e6),
            ("/deviations/wave_generator_lobe_um", "wrong_length", 1.0, 2.0),
            ("/load/input_torque_nm", "out_of_range", 0.0, 1e-12),
        ]
    );
    // Geometry does not read deviations.
    Service::new().post("/v1/geometry", &document).await.found();
}

#[tokio::test]
async fn reports_first_hundred_of_many_bad_entries() {
    let document = with_deviations(json!({ "wave_generator_lobe_um": vec![2e6; 5000] }));
    for path in ["/v1/sweep", "/v1/accuracy"] {
        let problem = Service::new().post(path, &document).await.refused(422, "impossible_design");
        // All entries are out of range, and the list is too long for two lobes.
        assert_eq!(problem["detail"], "5001 values are impossible. `errors` lists the first 100", "{path}");
        assert_eq!(problem["errors"].as_array().unwrap().len(), 100, "{path}");
    }
}

#[tokio::test]
async fn list_takes_numbers_only() {
    for (wrong, pointer) in [
        (json!({ "slot_wall_um": 1.0 }), "/deviations/slot_wall_um"),
        (json!({ "slot_wall_um": [0.0, "1"] }), "/deviations/slot_wall_um/1"),
        (json!({ "ring_runout": [1.0, 2.0] }), "/deviations/ring_runout"),
    ] {
        let problem = Service::new().post("/v1/sweep", &with_deviations(wrong)).await.refused(422, "invalid_document");
        assert_eq!(problem["errors"][0]["pointer"], pointer);
    }
}

#[tokio::test]
async fn projection_takes_only_zero_deviations() {
    let document = with(&spelled_out(), "/deviations", every_kind());
    let problem = Service::new().post("/v1/sweep", &document).await.refused(422, "impossible_design");
    let errors = problem["errors"].as_array().unwrap();
    assert_eq!(errors.len(), 1, "{problem}");
    assert_eq!((&errors[0]["pointer"], &errors[0]["code"]), (&json!("/deviations"), &json!("conflicting_fields")));
    let nothing = with(&spelled_out(), "/deviations", json!({ "slot_wall_um": one(28, 0, 0.0), "ring_runout": {} }));
    assert_eq!(swept(&nothing).await, swept(&spelled_out()).await);
}

#[tokio::test]
async fn reports_interference_with_slot_lobe_and_input_angle() {
    let full = with_deviations(json!({ "tooth_radius_um": one(28, 11, -20.0) }));
    for sweep in [json!({ "samples": 4 }), json!({ "tolerance": 1e-3 })] {
        let document = with(&full, "/sweep", sweep);
        let problem = Service::new().post("/v1/sweep", &document).await.refused(422, "interference");
        let detail = problem["detail"].as_str().unwrap();
        for word in ["slot 11 on lobe ", "input angle", "deg", "µm", "`deviations`"] {
            assert!(detail.contains(word), "{detail}");
        }
    }
}

#[tokio::test]
async fn deviation_sweep_keeps_limit_on_states() {
    // About 14 teeth at each of 364 times 4 input angles.
    let document = with_deviations(every_kind());
    let service = Service::within(Limits { max_states: 10_000, ..LIMITS });
    let problem = service.post("/v1/sweep", &document).await.refused(422, "too_many_states");
    let error = &problem["errors"][0];
    let states = Service::new().post("/v1/sweep", &document).await.found()["states"]["tooth"].as_array().unwrap().len();
    assert_eq!((&error["pointer"], error["value"].as_f64()), (&json!("/sweep/samples"), Some(states as f64)));
    let document = with(&document, "/sweep", json!({ "tolerance": 1e-3 }));
    let problem = service.post("/v1/sweep", &document).await.refused(422, "too_many_states");
    assert_eq!(problem["errors"][0]["pointer"], "/sweep/tolerance");
}

#[tokio::test]
async fn accuracy_includes_deviations() {
    let document = with_deviations(json!({ "wave_generator_runout": { "amount_um": 2.0 } }));
    let answer = Service::new().post("/v1/accuracy", &document).await.found();
    let ways = answer["ways"].as_array().unwrap();
    let finest = ways.iter().rfind(|way| way["law"] == "palmgren" && way.get("tolerance").is_some()).unwrap();
    assert!(finest["error"].as_f64().unwrap() < 1e-9, "{finest}");
    // At least twelve teeth of both zones at eleven input angles.
    let coarsest = ways.iter().find(|way| way["samples"] == 10).unwrap();
    assert!(coarsest["states"].as_u64().unwrap() >= 11 * 12, "{coarsest}");
    // `projection` does not support deviations.
    let unavailable = answer["unavailable"].as_array().unwrap();
    assert!(unavailable.iter().all(|model| model["compatibility"] == "projection"), "{unavailable:?}");
    assert!(!unavailable.is_empty());
}

#[tokio::test]
async fn only_equal_deviations_share_a_key() {
    let key = async |document: &Value| Service::new().post("/v1/sweep", document).await.etag().to_owned();
    let own = key(&with_deviations(json!({ "wave_generator_lobe_um": [0.0, 1.0] }))).await;
    assert_eq!(own, key(&with_deviations(json!({ "wave_generator_lobe_um": [-0.0, 1], "slot_wall_um": [] }))).await);
    // An entry moved to the next list would leave the same sequence of numbers.
    let lists = [
        json!({ "wave_generator_lobe_um": [1.0, 0.0] }),
        json!({ "wave_generator_runout": { "angle_deg": 1.0 } }),
        json!({ "wave_generator_lobe_um": [0.0, 0.0], "wave_generator_runout": { "amount_um": 1.0 } }),
    ];
    for deviations in lists {
        assert_ne!(own, key(&with_deviations(deviations)).await);
    }
}

#[tokio::test]
async fn deviations_appear_in_csv_text_and_plots() {
    let friction = crate::friction::on(&json!({ "kind": "plain", "coefficient": 0.02 }));
    let document = with(&deviating(), "/friction", friction);
    let service = Service::new();
    let answer = service.post("/v1/sweep", &document).await.found();
    let efficiency = answer["losses"]["efficiency"]["ring_fixed"].as_f64().unwrap();
    let nominal = swept(&with(&document, "/deviations", json!({}))).await;
    let without = nominal["losses"]["efficiency"]["ring_fixed"].as_f64().unwrap();
    assert!((efficiency - without).abs() < 0.02 && efficiency != without, "{efficiency} {without}");
    let as_form = async |form: &str| {
        let question = Question::post("/v1/sweep", document.to_string()).with("accept", form);
        service.ask(&question).await.text().to_owned()
    };
    let csv = as_form("text/csv").await;
    assert!(csv.lines().next().unwrap().contains(",lobe,loaded,"), "{csv}");
    let text = as_form("text/plain").await;
    assert!(text.contains("input angle of the sweep            360.000000 deg"), "{text}");
    let svg = as_form("image/svg+xml").await;
    assert!(svg.contains("<svg") && !svg.contains("NaN"));
    assert!(svg.contains("force, largest of all teeth, N"), "{svg}");
}

/// Counts the points of each plotted curve.
fn points_of_curves(svg: &str) -> Vec<usize> {
    let paths = svg.split("<path d=\"M ").skip(1).filter_map(|path| path.split_once('"'));
    paths.map(|(path, _)| path.split(" L ").count()).collect()
}

/// Curves are cut where teeth enter under load, so many teeth could make a plot of many megabytes.
#[tokio::test]
async fn plot_has_bounded_number_of_pieces() {
    let document = json!({
        "drive": {
            "wave_generator": { "kind": "harmonic", "lobes": 20, "mean_radius_mm": 19_998.0, "amplitude_mm": 0.05 },
            "teeth": { "count": 9999, "radius_mm": 5.9, "width_mm": 15.0 },
            "ring": { "teeth": 9979, "tip_radius_mm": 20_009.751 }
        },
        "load": { "input_torque_nm": 20.0 },
        "model": { "compatibility": "projection", "stiffness": { "law": "linear" } },
        "sweep": { "samples": 4 }
    });
    let question = Question::post("/v1/sweep", document.to_string());
    let service = Service::new();
    let states = service.ask(&question.clone().with("accept", "text/csv")).await.text().lines().count();
    assert!(states > 10_000, "{states}");
    let svg = service.ask(&question.with("accept", "image/svg+xml")).await;
    let points = points_of_curves(svg.text());
    assert!(
        points.len() > 6 * 100 && points.len() <= 6 * 501 && points.iter().sum::<usize>() <= 6 * 4501,
        "{} of {}",
        points.len(),
        points.iter().sum::<usize>()
    );
}

#[tokio::test]
async fn plot_with_deviations_shows_largest_tooth_load() {
    let document = with(&deviating(), "/sweep/samples", json!(5));
    let states = swept(&document).await["states"].clone();
    let mut places = numbers(&states["position_deg"]);
    let stated = places.len();
    places.sort_by(f64::total_cmp);
    places.dedup_by(|one, other| (*one - *other).abs() < 1e-9);
    assert!(places.len() * 10 < stated, "{} places of {stated} states", places.len());
    let question = Question::post("/v1/sweep", document.to_string()).with("accept", "image/svg+xml");
    assert_eq!(points_of_curves(Service::new().ask(&question).await.text()), [places.len(); 6]);
    // In a tolerance sweep teeth have different positions, so the curve divides the pass into intervals.
    let document = with(&with(&document, "/sweep", json!({ "tolerance": 1e-3 })), "/load/input_torque_nm", json!(5.0));
    let question = Question::post("/v1/sweep", document.to_string()).with("accept", "image/svg+xml");
    let curves = points_of_curves(Service::new().ask(&question).await.text());
    assert!(curves.len() == 6 && curves.iter().all(|points| (100..=201).contains(points)), "{curves:?}");
}

#[tokio::test]
async fn plot_curve_of_unlike_zones_ends_at_jumps() {
    // Case 5.2 with an odd number of teeth.
    let unlike = json!({
        "drive": {
            "wave_generator": { "semi_major_mm": 50.7, "semi_minor_mm": 49.3 },
            "teeth": { "count": 81, "installed": 27, "radius_mm": 1.5, "width_mm": 15.0 }, "ring": { "teeth": 79 }
        },
        "load": { "input_torque_nm": 3.0 }
    });
    let found = swept(&unlike).await;
    assert_eq!(found["enters_under_load"], true);
    let question = Question::post("/v1/sweep", unlike.to_string()).with("accept", "image/svg+xml");
    let curves = points_of_curves(Service::new().ask(&question).await.text());
    // Each tooth that enters while another one meshes adds a jump to its curve.
    let jumps = usize::try_from(found["teeth_in_mesh_per_zone"]["min"].as_u64().unwrap()).unwrap();
    assert_eq!(curves.iter().filter(|points| **points > 5).count(), 6 * (jumps + 1), "{curves:?}");
}
