//! Design documents: defaults, spelling and structural faults.

use serde_json::{Value, json};

use crate::asking::{Answer, ENDPOINTS, Service};
use crate::designs::{
    self, defaults_spelled_out, every_number, fixed, in_reverse, of_the_paper, pointers, shortest, spelled_out, with,
    with_twice, without,
};

/// Asserts that the text is the same question as the document, whose answer is cached.
async fn assert_same(service: &Service, path: &str, document: &Answer, text: &str) {
    let answer = service.post_text(path, text).await;
    assert_eq!(answer.status, 200, "{path}: {text}: {}", answer.text());
    assert_eq!(answer.etag(), document.etag(), "{path}: {text}");
    assert!(answer.body == document.body, "{path}: another body for {text}");
    assert!(answer.is_hit(), "{path}: solved anew for {text}");
}

/// Asserts that all spellings mean one design.
async fn assert_all_same(document: &Value, spellings: impl IntoIterator<Item = String>) {
    let spellings: Vec<_> = spellings.into_iter().collect();
    for path in ENDPOINTS {
        let service = Service::new();
        let first = service.post(path, document).await;
        assert_eq!(first.status, 200, "{}", first.text());
        assert!(first.is_miss());
        for text in &spellings {
            assert_same(&service, path, &first, text).await;
        }
    }
}

/// Lists each optional field with a value other than its default.
fn defaults() -> Vec<(&'static str, Value)> {
    vec![
        ("/drive/teeth/installed", json!(14)),
        ("/drive/ring/tip_radius_mm", json!(67.0)),
        ("/materials", json!({ "teeth": { "poissons_ratio": 0.25 } })),
        ("/materials/wave_generator", json!({ "youngs_modulus_gpa": 70.0 })),
        ("/materials/wave_generator/youngs_modulus_gpa", json!(70.0)),
        ("/materials/wave_generator/poissons_ratio", json!(0.25)),
        ("/materials/teeth", json!({ "youngs_modulus_gpa": 70.0 })),
        ("/materials/teeth/youngs_modulus_gpa", json!(70.0)),
        ("/materials/teeth/poissons_ratio", json!(0.25)),
        ("/materials/ring", json!({ "youngs_modulus_gpa": 70.0 })),
        ("/materials/ring/youngs_modulus_gpa", json!(70.0)),
        ("/materials/ring/poissons_ratio", json!(0.25)),
        ("/materials/carrier", json!({ "youngs_modulus_gpa": 70.0 })),
        ("/materials/carrier/youngs_modulus_gpa", json!(70.0)),
        ("/materials/carrier/poissons_ratio", json!(0.25)),
        ("/model", json!({ "compatibility": "projection" })),
        ("/model/compatibility", json!("projection")),
        ("/model/stiffness", fixed(4e5, 5e5, 3e5)),
        ("/sweep", json!({ "samples": 51 })),
        ("/sweep/samples", json!(51)),
        ("/profile", json!({ "extent": "full" })),
        ("/profile/chord_tolerance_mm", json!(0.002)),
        ("/profile/extent", json!("full")),
    ]
}

#[tokio::test]
async fn each_omitted_field_means_its_default() {
    let document = defaults_spelled_out();
    // No name stands for an omitted law: the drive decides.
    let fields = defaults().into_iter().map(|(pointer, _)| pointer).filter(|&pointer| pointer != "/model/stiffness");
    let shortened = fields.map(|pointer| without(&document, pointer).to_string());
    assert_all_same(&document, shortened).await;
}

#[tokio::test]
async fn minimal_document_means_all_defaults() {
    let empty =
        ["/materials", "/model", "/sweep", "/profile"].map(|pointer| with(&shortest(), pointer, json!({})).to_string());
    let nulled = with(&shortest(), "/drive/ring/tip_radius_mm", Value::Null).to_string();
    assert_all_same(&defaults_spelled_out(), [shortest().to_string(), nulled].into_iter().chain(empty)).await;
}

#[tokio::test]
async fn omitted_stiffness_under_projection_means_linear() {
    let named = with(&shortest(), "/model", of_the_paper());
    let left_out = with(&shortest(), "/model", json!({ "compatibility": "projection" }));
    assert_all_same(&named, [left_out.to_string()]).await;
}

#[tokio::test]
async fn balls_default_to_virtual_work_and_hertz() {
    let balls = with(&shortest(), "/drive/teeth", json!({ "shape": "ball", "count": 28, "radius_mm": 5.0 }));
    let named = with(&balls, "/model", json!({ "compatibility": "virtual_work", "stiffness": { "law": "hertz" } }));
    assert_all_same(&named, [balls.to_string()]).await;
}

#[tokio::test]
async fn projection_rejects_johnson_hertz_and_series_compliance() {
    let model = |more: Value| {
        let mut model = json!({ "compatibility": "projection" });
        model.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        with(&shortest(), "/model", model)
    };
    let balls = with(&model(json!({})), "/drive/teeth", json!({ "shape": "ball", "count": 28, "radius_mm": 5.0 }));
    for (document, pointer) in [
        (model(json!({ "stiffness": { "law": "johnson" } })), "/model/stiffness/law"),
        (balls, "/model/stiffness/law"),
        (model(json!({ "series_compliance_mm_per_n": { "ring": 1e-6 } })), "/model/series_compliance_mm_per_n/ring"),
    ] {
        for path in ["/v1/sweep", "/v1/accuracy"] {
            let problem = Service::new().post(path, &document).await.refused(422, "impossible_design");
            assert_eq!(problem["errors"][0]["pointer"], pointer, "{problem}");
        }
    }
    for law in [json!({ "law": "linear" }), json!({ "law": "palmgren" }), fixed(4e5, 5e5, 3e5)] {
        Service::new().post("/v1/sweep", &model(json!({ "stiffness": law }))).await.found();
    }
}

#[tokio::test]
async fn each_non_default_value_changes_some_key() {
    let document = defaults_spelled_out();
    for (pointer, other) in defaults() {
        let service = Service::new();
        let mut changed = 0;
        for path in ENDPOINTS {
            let by_default = service.post(path, &document).await;
            let otherwise = service.post(path, &with(&document, pointer, other.clone())).await;
            changed += usize::from(otherwise.etag() != by_default.etag());
        }
        assert!(changed > 0, "{pointer} = {other} changes nothing");
    }
}

#[tokio::test]
async fn field_order_and_white_space_are_irrelevant() {
    let document = every_number();
    let pretty = serde_json::to_string_pretty(&document).unwrap();
    let reversed = in_reverse(&document);
    assert_ne!(document.to_string(), reversed);
    assert_all_same(&document, [reversed, pretty, format!("\r\n\t {document} \n")]).await;
}

#[tokio::test]
async fn equal_numbers_may_be_spelled_differently() {
    let text = spelled_out().to_string();
    let replaced = |from: &str, to: &str| {
        assert!(text.contains(from), "{from} is not in {text}");
        text.replace(from, to)
    };
    assert_all_same(
        &spelled_out(),
        [
            replaced("\"count\":28", "\"count\":28.0"),
            replaced("\"count\":28", "\"count\":2.8e1"),
            replaced("\"count\":28", "\"count\":2.8E+01"),
            replaced("\"count\":28", "\"count\":280e-1"),
            replaced("\"installed\":28", "\"installed\":28.000"),
            replaced("\"installed\":28", "\"installed\":2.8e1"),
            replaced("\"teeth\":26", "\"teeth\":26.0"),
            replaced("\"teeth\":26", "\"teeth\":0.26e2"),
            replaced("\"samples\":50", "\"samples\":50.0"),
            replaced("\"samples\":50", "\"samples\":5e1"),
            replaced(":58.0", ":58"),
            replaced(":58.0", ":5.8e1"),
            replaced(":58.0", ":58.000000000000000000000000000000000000000000000"),
            replaced(":20.0", ":2E1"),
            replaced(":210.0", ":210"),
            replaced(":0.001", ":1e-3"),
            replaced(":0.001", ":0.1e-2"),
            replaced(":0.3", ":3e-1"),
        ],
    )
    .await;
}

#[tokio::test]
async fn names_may_be_escaped() {
    let text = spelled_out().to_string();
    assert_all_same(
        &spelled_out(),
        [
            text.replace("\"drive\"", "\"\\u0064rive\""),
            text.replace("\"tooth\"", "\"t\\u006f\\u006Fth\""),
            text.replace("\"law\"", "\"la\\u0077\""),
        ],
    )
    .await;
}

#[tokio::test]
async fn minus_zero_is_zero() {
    for part in ["wave_generator", "teeth", "ring", "carrier"] {
        let pointer = format!("/materials/{part}/poissons_ratio");
        let document = with(&spelled_out(), &pointer, json!(0.0));
        let text = |zero: &str| {
            let text = with(&spelled_out(), &pointer, json!(0.125)).to_string().replace("0.125", zero);
            assert!(text.contains(&format!(":{zero}")), "{text}");
            text
        };
        assert_all_same(&document, ["0", "-0", "-0.0", "-0e5", "0.0e-7", "-1e-400"].map(text)).await;
    }
}

#[tokio::test]
async fn rejects_unknown_field_at_every_level() {
    let service = Service::new();
    for document in [spelled_out(), every_number()] {
        for object in pointers(&document, Value::is_object) {
            let pointer = format!("{object}/colour");
            for value in [json!("red"), json!(null), json!({}), json!(7.0)] {
                for path in ENDPOINTS {
                    let (at, code, detail) =
                        service.post(path, &with(&document, &pointer, value.clone())).await.faulty_field();
                    assert_eq!((at.as_str(), code.as_str()), (pointer.as_str(), "unknown_field"));
                    assert!(detail.contains("`colour`"), "{detail}");
                }
            }
        }
    }
}

#[tokio::test]
async fn pointer_is_escaped_as_json_pointer() {
    let document = with(&shortest(), "/drive/ring", json!({ "teeth": 26, "a/b~c": 1 }));
    let (at, code, detail) = Service::new().post("/v1/sweep", &document).await.faulty_field();
    assert_eq!((at.as_str(), code.as_str()), ("/drive/ring/a~1b~0c", "unknown_field"));
    assert!(detail.contains("a/b~c"), "{detail}");
}

/// A name may be as long as a document, and a problem repeats it.
#[tokio::test]
async fn long_field_name_is_reported_by_its_beginning() {
    let name = "~".repeat(60_000);
    let map =
        json!({ "study": "map", "base": shortest(), "over": { format!("/drive/{name}"): { "min": 1, "max": 2 } } });
    let documents = [
        ("/v1/sweep", json!({ "drive": { &*name: 1 } })),
        ("/v1/sweep", with(&shortest(), "/model", json!({ "compatibility": &name }))),
        ("/v1/studies", map),
    ];
    let service = Service::new();
    for (path, document) in documents {
        let answer = service.post(path, &document).await;
        let (_, _, detail) = answer.faulty_field();
        assert!(detail.contains("~~~") && detail.ends_with('…'), "{path}: {detail}");
        assert!(answer.body.len() < 6000, "{path}: {} bytes", answer.body.len());
    }
}

#[tokio::test]
async fn typo_never_means_a_default() {
    let service = Service::new();
    for (right, wrong) in [
        ("/drive/teeth/installed", "/drive/teeth/Installed"),
        ("/drive/ring/tip_radius_mm", "/drive/ring/tip_radius"),
        ("/materials/carrier", "/materials/carier"),
        ("/materials/ring/poissons_ratio", "/materials/ring/poisson_ratio"),
        ("/model/compatibility", "/model/compatability"),
        ("/sweep/samples", "/sweep/sample"),
        ("/profile/chord_tolerance_mm", "/profile/chord_tolerance"),
    ] {
        let document = with(&without(&spelled_out(), right), wrong, spelled_out().pointer(right).unwrap().clone());
        for path in ENDPOINTS {
            let (at, code, _) = service.post(path, &document).await.faulty_field();
            assert_eq!((at.as_str(), code.as_str()), (wrong, "unknown_field"));
        }
    }
}

#[tokio::test]
async fn linear_law_takes_no_fixed_stiffness() {
    let law = json!({ "law": "linear", "ring_n_per_mm": 5e5 });
    let document = with(&spelled_out(), "/model/stiffness", law);
    let (at, code, _) = Service::new().post("/v1/sweep", &document).await.faulty_field();
    assert_eq!((at.as_str(), code.as_str()), ("/model/stiffness/ring_n_per_mm", "unknown_field"));
}

#[tokio::test]
async fn a_stiffness_names_its_law() {
    for stiffness in [json!({}), json!({ "ring_n_per_mm": 5e5 })] {
        let document = with(&spelled_out(), "/model/stiffness", stiffness);
        let (at, code, _) = Service::new().post("/v1/sweep", &document).await.faulty_field();
        assert_eq!((at.as_str(), code.as_str()), ("/model/stiffness/law", "missing_field"));
    }
}

#[tokio::test]
async fn rejects_array_in_place_of_object() {
    let service = Service::new();
    for document in [spelled_out(), every_number()] {
        for pointer in pointers(&document, Value::is_object) {
            // The values of the object's fields in order. A lenient reader would accept them.
            let fields = document.pointer(&pointer).unwrap().as_object().unwrap();
            for array in [json!([]), fields.values().cloned().collect::<Value>()] {
                for path in ENDPOINTS {
                    let (at, code, detail) =
                        service.post(path, &with(&document, &pointer, array.clone())).await.faulty_field();
                    assert_eq!((at.as_str(), code.as_str()), (pointer.as_str(), "wrong_type"), "{detail}");
                }
            }
        }
    }
}

#[tokio::test]
async fn rejects_null_except_for_tip_radius() {
    let service = Service::new();
    let null_may_stand_here = |pointer: &str| pointer == "/drive/ring/tip_radius_mm";
    for document in [spelled_out(), every_number()] {
        for pointer in pointers(&document, |_| true) {
            let document = with(&document, &pointer, Value::Null);
            for path in ENDPOINTS {
                let answer = service.post(path, &document).await;
                if null_may_stand_here(&pointer) {
                    assert_eq!(answer.status, 200, "{}", answer.text());
                } else {
                    let (at, code, detail) = answer.faulty_field();
                    assert_eq!((at.as_str(), code.as_str()), (pointer.as_str(), "wrong_type"), "{detail}");
                }
            }
        }
    }
}

#[tokio::test]
async fn rejects_null_output_torque() {
    let document = with(&spelled_out(), "/load/output_torque_nm", Value::Null);
    let (at, code, _) = Service::new().post("/v1/sweep", &document).await.faulty_field();
    assert_eq!((at.as_str(), code.as_str()), ("/load/output_torque_nm", "wrong_type"));
}

#[tokio::test]
async fn names_missing_required_field() {
    let service = Service::new();
    for pointer in [
        "/drive",
        "/drive/wave_generator",
        "/drive/wave_generator/semi_major_mm",
        "/drive/wave_generator/semi_minor_mm",
        "/drive/teeth",
        "/drive/teeth/count",
        "/drive/teeth/radius_mm",
        "/drive/teeth/width_mm",
        "/drive/ring",
        "/drive/ring/teeth",
        "/model/stiffness/wave_generator_n_per_mm",
        "/model/stiffness/ring_n_per_mm",
        "/model/stiffness/carrier_n_per_mm",
    ] {
        for path in ENDPOINTS {
            let (at, code, detail) = service.post(path, &without(&every_number(), pointer)).await.faulty_field();
            assert_eq!((at.as_str(), code.as_str()), (pointer, "missing_field"));
            assert!(detail.contains(pointer.rsplit('/').next().unwrap()), "{detail}");
        }
    }
}

#[tokio::test]
async fn sweep_needs_exactly_one_torque() {
    let service = Service::new();
    for (load, expected) in [
        (None, "missing_field"),
        (Some(json!({})), "missing_field"),
        (Some(json!({ "input_torque_nm": 20.0, "output_torque_nm": 280.0 })), "conflicting_fields"),
    ] {
        let document = match load {
            None => without(&spelled_out(), "/load"),
            Some(load) => with(&spelled_out(), "/load", load),
        };
        let (at, code, detail) = service.post("/v1/sweep", &document).await.faulty_field();
        assert_eq!((at.as_str(), code.as_str()), ("/load", expected));
        assert!(detail.contains("`input_torque_nm`") && detail.contains("`output_torque_nm`"), "{detail}");
    }
}

#[tokio::test]
async fn reports_first_structural_fault_of_document() {
    let both_torques = with(&spelled_out(), "/load", json!({ "input_torque_nm": 20.0, "output_torque_nm": 280.0 }));
    let document = with(&both_torques, "/sweep", json!({ "samples": 50, "tolerance": 1e-6 }));
    let (at, _, _) = Service::new().post("/v1/sweep", &document).await.faulty_field();
    assert_eq!(at, "/load");
}

#[tokio::test]
async fn rejects_duplicate_field_at_every_level() {
    let service = Service::new();
    for document in [spelled_out(), every_number()] {
        for pointer in pointers(&document, |_| true).into_iter().filter(|pointer| !pointer.is_empty()) {
            for path in ENDPOINTS {
                let (at, code, _) = service.post_text(path, with_twice(&document, &pointer)).await.faulty_field();
                assert_eq!((at, code.as_str()), (pointer.clone(), "duplicate_field"));
            }
        }
    }
}

#[tokio::test]
async fn rejects_wrong_type_with_its_place() {
    let service = Service::new();
    let document = every_number();
    let others = [json!("58.0"), json!(true), json!({}), json!([58.0])];
    for pointer in pointers(&document, Value::is_number) {
        for other in &others {
            let (at, code, detail) =
                service.post("/v1/sweep", &with(&document, &pointer, other.clone())).await.faulty_field();
            assert_eq!((at.as_str(), code.as_str()), (pointer.as_str(), "wrong_type"), "{detail}");
        }
    }
    for pointer in pointers(&document, Value::is_string) {
        for other in [json!(1), json!(true), json!({ "projection": null }), json!(["tooth"])] {
            let (at, code, detail) = service.post("/v1/sweep", &with(&document, &pointer, other)).await.faulty_field();
            assert_eq!((at.as_str(), code.as_str()), (pointer.as_str(), "wrong_type"), "{detail}");
        }
    }
    for pointer in pointers(&document, Value::is_object) {
        for other in [json!(1), json!("text"), json!(false)] {
            let (at, code, detail) = service.post("/v1/sweep", &with(&document, &pointer, other)).await.faulty_field();
            assert_eq!((at.as_str(), code.as_str()), (pointer.as_str(), "wrong_type"), "{detail}");
        }
    }
}

#[tokio::test]
async fn rejects_unknown_choice_and_lists_known_ones() {
    for (pointer, choices) in [
        ("/model/compatibility", &["projection", "virtual_work"][..]),
        ("/model/stiffness/law", &["linear", "fixed"]),
        ("/profile/extent", &["tooth", "full"]),
    ] {
        for word in ["", "Projection", "LINEAR", "tooth ", "hertzian"] {
            let document = with(&spelled_out(), pointer, json!(word));
            let (at, code, detail) = Service::new().post("/v1/sweep", &document).await.faulty_field();
            assert_eq!((at.as_str(), code.as_str()), (pointer, "unknown_choice"));
            for choice in choices {
                assert!(detail.contains(choice), "{detail}");
            }
        }
    }
}

const COUNTS: [&str; 4] = ["/drive/teeth/count", "/drive/teeth/installed", "/drive/ring/teeth", "/sweep/samples"];

#[tokio::test]
async fn rejects_fractional_count() {
    for pointer in COUNTS {
        for value in [28.5, 0.1, -0.5, 28.000_000_000_000_004, 1e-300] {
            let document = with(&spelled_out(), pointer, json!(value));
            let (at, code, _) = Service::new().post("/v1/sweep", &document).await.faulty_field();
            assert_eq!((at.as_str(), code.as_str()), (pointer, "wrong_type"), "{value}");
        }
    }
}

#[tokio::test]
async fn huge_count_is_out_of_range() {
    for (pointer, limit) in COUNTS.into_iter().zip([1e4, 1e4, 1e4, 1e7]) {
        for value in [1e8, 9_007_199_254_740_993.0, 1e17, 1e300] {
            let document = with(&spelled_out(), pointer, json!(value));
            let problem = Service::new().post("/v1/sweep", &document).await.refused(422, "impossible_design");
            let error = problem["errors"].as_array().unwrap().iter().find(|error| error["pointer"] == pointer).unwrap();
            assert_eq!(
                (&error["code"], &error["value"], &error["limit"]),
                (&json!("out_of_range"), &json!(value), &json!(limit))
            );
        }
    }
}

#[tokio::test]
async fn number_beyond_double_is_json_but_no_value() {
    let service = Service::new();
    let document = every_number();
    let many_digits = "9".repeat(400);
    for pointer in pointers(&document, Value::is_number) {
        for number in ["1e999", "-1e999", "1E+0400", many_digits.as_str()] {
            let text = with(&document, &pointer, json!("HERE")).to_string().replace("\"HERE\"", number);
            for path in ENDPOINTS {
                let (at, code, _) = service.post_text(path, text.clone()).await.faulty_field();
                assert_eq!((at, code.as_str()), (pointer.clone(), "number_too_large"), "{number}");
            }
        }
    }
}

#[tokio::test]
async fn json_without_object_is_no_design_document() {
    for text in ["null", "true", "28", "-1.5e3", "\"drive\"", "[]", "[{}]", " [ ] "] {
        let (at, code, _) = Service::new().post_text("/v1/sweep", text).await.faulty_field();
        assert_eq!((at.as_str(), code.as_str()), ("", "wrong_type"), "{text}");
    }
}

#[tokio::test]
async fn rejects_body_that_is_no_json() {
    let service = Service::new();
    let whole = spelled_out().to_string();
    let commented = format!("// a drive\n{whole}");
    let mut texts: Vec<Vec<u8>> = [
        "",
        " ",
        "\n\n",
        "{",
        "}",
        "{]",
        "drive",
        "{'drive': {}}",
        "{\"drive\": {},}",
        "{\"drive\": NaN}",
        "{\"drive\": Infinity}",
        "{\"drive\": +1}",
        "{\"drive\": 01}",
        "{\"drive\": .5}",
        "{\"drive\": 5.}",
        "{\"drive\": 0x1c}",
        "{\"drive\": tru}",
        "{\"drive\" {}}",
        "{drive: {}}",
        "{\"drive\": \"\n\"}",
        "{\"drive\": \"\\x\"}",
        "nullnull",
        commented.as_str(),
    ]
    .iter()
    .map(|text| text.as_bytes().to_vec())
    .collect();
    for cut in [1, whole.len() / 2, whole.len() - 1] {
        texts.push(whole.as_bytes()[..cut].to_vec());
    }
    for garbage in ["x", "{}", ",", "]", "}", "\0", " 1", "\u{feff}"] {
        texts.push(format!("{whole}{garbage}").into_bytes());
    }
    for text in texts {
        for path in ENDPOINTS {
            let problem = service.post_text(path, text.clone()).await.refused(400, "malformed_json");
            assert!(problem.get("errors").is_none(), "{problem}");
        }
    }
}

#[tokio::test]
async fn ignores_byte_order_mark() {
    let (service, document) = (Service::new(), spelled_out().to_string());
    let plain = service.post_text("/v1/sweep", document.clone()).await;
    let marked = service.post_text("/v1/sweep", format!("\u{feff}{document}")).await;
    assert!(marked.status == 200 && marked.text() == plain.text());
    for nothing in ["\u{feff}", "\u{feff}\u{feff}{}"] {
        service.post_text("/v1/sweep", nothing).await.refused(400, "malformed_json");
    }
}

#[tokio::test]
async fn rejects_text_that_is_not_utf_8() {
    let whole = spelled_out().to_string();
    let (head, tail) = whole.split_at(whole.find("28").unwrap());
    for bytes in [&b"\xff"[..], b"\xc3\x28", b"\xed\xa0\x80", b"\xf8\x88\x80\x80\x80"] {
        let texts = [
            bytes.to_vec(),
            [head.as_bytes(), bytes, tail.as_bytes()].concat(),
            [&b"{\"dri"[..], bytes, b"ve\": {}}"].concat(),
            [&b"{\"drive\": \""[..], bytes, b"\"}"].concat(),
        ];
        for text in texts {
            Service::new().post_text("/v1/sweep", text).await.refused(400, "malformed_json");
        }
    }
}

#[tokio::test]
async fn syntax_error_outranks_earlier_faults() {
    let service = Service::new();
    // Each text has a structural fault before its syntax error.
    for text in [
        "{\"colour\": 1, ",
        "{\"drive\": 1e999, ",
        "{\"drive\": [1e999",
        "[{\"drive\": 1e999}, nothing]",
        "1e999 1e999",
    ] {
        service.post_text("/v1/sweep", text).await.refused(400, "malformed_json");
    }
}

#[tokio::test]
async fn rejects_json_nested_too_deep() {
    let service = Service::new();
    for depth in [100, 127, 128, 200, 5_000] {
        for (open, close) in [("[", "]"), ("{\"drive\":", "}")] {
            let text = format!("{}0{}", open.repeat(depth), close.repeat(depth));
            for path in ENDPOINTS {
                service.post_text(path, text.clone()).await.refused(422, "invalid_document");
            }
        }
    }
}

#[tokio::test]
async fn names_one_of_several_structural_faults() {
    let document = with(&without(&spelled_out(), "/drive/teeth/count"), "/colour", json!(1));
    let (at, ..) = Service::new().post("/v1/sweep", &document).await.faulty_field();
    assert!(["/drive/teeth/count", "/colour"].contains(&at.as_str()), "{at}");
}

#[tokio::test]
async fn every_endpoint_answers_the_documented_document() {
    for path in ENDPOINTS {
        assert_eq!(Service::new().post_text(path, designs::CONTRACT).await.status, 200, "{path}");
    }
}
