//! The API document: it is committed, consistent, and describes the service.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use serde_json::{Value, json};
use toothwave_solver::Parameter;

use crate::asking::{Answer, ENDPOINTS, LIMITS, Limits, Question, Service};
use crate::codes::{field_codes, finding_codes, problem_codes, words};
use crate::designs::{self, bored, eccentric, every_number, fixed, shortest, spelled_out, undercut, with, without};

/// The committed document.
pub(crate) const COMMITTED: &str = include_str!("../../openapi/openapi.json");

pub(crate) fn document() -> &'static Value {
    static DOCUMENT: LazyLock<Value> =
        LazyLock::new(|| serde_json::from_str(&toothwave::http::router::openapi_json()).unwrap());
    &DOCUMENT
}

/// Returns the path's template in the document.
fn described(path: &str) -> &str {
    if path.starts_with("/v1/drawings/") { "/v1/drawings/{part}" } else { path }
}

#[test]
fn committed_document_matches_code() {
    assert!(
        COMMITTED == toothwave::http::router::openapi_json(),
        "openapi/openapi.json is not what the code describes; write it anew with `cargo run -p toothwave -- openapi > openapi/openapi.json` and look at the difference"
    );
}

#[test]
fn every_reference_resolves() {
    let document = document();
    let mut references = 0;
    let mut pending = vec![document];
    while let Some(value) = pending.pop() {
        match value {
            Value::Object(fields) => {
                if let Some(reference) = fields.get("$ref").and_then(Value::as_str) {
                    let pointer = reference.strip_prefix('#').unwrap_or_else(|| panic!("{reference} leads outside"));
                    assert!(document.pointer(pointer).is_some(), "{reference} leads nowhere");
                    references += 1;
                }
                pending.extend(fields.values());
            }
            Value::Array(items) => pending.extend(items),
            _ => {}
        }
    }
    assert!(references > 20, "{references} references");
}

/// Returns every object of a document.
fn objects(document: &Value) -> Vec<&serde_json::Map<String, Value>> {
    let (mut found, mut pending) = (Vec::new(), vec![document]);
    while let Some(value) = pending.pop() {
        match value {
            Value::Object(fields) => {
                found.push(fields);
                pending.extend(fields.values());
            }
            Value::Array(items) => pending.extend(items),
            _ => {}
        }
    }
    found
}

#[test]
fn every_refusal_refers_to_one_problem() {
    let problems: Vec<_> =
        objects(document()).into_iter().filter_map(|object| object.get("application/problem+json")).collect();
    assert!(problems.len() > 50, "{}", problems.len());
    for problem in problems {
        assert_eq!(*problem, json!({ "schema": { "$ref": "#/components/schemas/Problem" } }));
    }
}

#[test]
fn server_url_is_relative() {
    assert_eq!(document()["servers"][0]["url"], ".");
}

#[test]
fn every_variant_has_name_and_discriminator_word() {
    let schemas = document()["components"]["schemas"].as_object().unwrap();
    for name in ["Stiffness", "WaveGeneratorFriction", "EdgeAnswer", "OutlineAnswer", "Study", "StudyAnswer"] {
        let (schema, mapping) = (&schemas[name], schemas[name]["discriminator"]["mapping"].as_object().unwrap());
        let tag = schema["discriminator"]["propertyName"].as_str().unwrap();
        assert_eq!(schema["oneOf"].as_array().unwrap().len(), mapping.len(), "{name}");
        for (word, reference) in mapping {
            assert!(schema["oneOf"].as_array().unwrap().contains(&json!({ "$ref": reference })), "{name} {word}");
            let variant = &schemas[reference.as_str().unwrap().rsplit('/').next().unwrap()];
            assert_eq!(variant["properties"][tag]["enum"], json!([word]));
        }
    }
}

/// Generators read no discriminator that a variant may lack: of these choices each variant names its word, and one by default.
#[test]
fn a_word_that_may_be_left_out_is_no_discriminator() {
    let schemas = &document()["components"]["schemas"];
    for (name, tag, by_default) in [("WaveGenerator", "kind", "ellipse"), ("Teeth", "shape", "cylinder")] {
        assert!(schemas[name].get("discriminator").is_none(), "{name}");
        let mut words = BTreeSet::new();
        for variant in schemas[name]["oneOf"].as_array().unwrap() {
            let variant = document().pointer(&variant["$ref"].as_str().unwrap()[1..]).unwrap();
            let [word] = variant["properties"][tag]["enum"].as_array().unwrap().as_slice() else { panic!("{name}") };
            let is_default = word == by_default;
            assert_eq!(variant["properties"][tag]["default"] == *word, is_default, "{word}");
            assert_eq!(variant["required"].as_array().unwrap().contains(&json!(tag)), !is_default, "{word}");
            assert!(words.insert(word.as_str().unwrap()), "{word} twice");
        }
        assert!(words.contains(by_default));
    }
}

#[test]
fn no_default_is_null_where_null_is_refused() {
    for object in objects(document()) {
        let admits =
            |kind: &Value| kind == "null" || kind.as_array().is_some_and(|kinds| kinds.contains(&json!("null")));
        assert!(object.get("default") != Some(&Value::Null) || object.get("type").is_some_and(admits), "{object:?}");
    }
}

#[test]
fn default_words_are_never_beside_references() {
    assert_eq!(document()["components"]["schemas"]["ExtentDocument"]["default"], "tooth");
    for object in objects(document()) {
        assert!(!(object.contains_key("$ref") && object.get("default").is_some_and(Value::is_string)), "{object:?}");
    }
}

#[test]
fn no_text_contains_comment_markers() {
    // A generator for C++ puts `k = E*/2` into a comment and so ends it.
    for object in objects(document()) {
        for text in object.values().filter_map(Value::as_str) {
            assert!(!text.contains("*/") && !text.contains("/*"), "{text}");
        }
    }
}

#[test]
fn version_3_0_has_no_3_1_keywords() {
    let document: Value = serde_json::from_str(&toothwave::http::router::openapi_3_0_json()).unwrap();
    assert_eq!(document["openapi"], "3.0.3");
    assert_eq!(document["info"]["license"].get("identifier"), None);
    for object in objects(&document) {
        assert!(!object.get("type").is_some_and(Value::is_array), "{object:?}");
        assert!(!object.get("exclusiveMinimum").is_some_and(Value::is_number), "{object:?}");
        assert!(!object.get("exclusiveMaximum").is_some_and(Value::is_number), "{object:?}");
        for word in ["const", "examples", "prefixItems", "propertyNames", "patternProperties"] {
            // An object under this word is a field's schema.
            assert!(object.get(word).is_none_or(Value::is_object), "{word} in {object:?}");
        }
        if let Some(reference) = object.get("$ref").and_then(Value::as_str) {
            assert_eq!(object.len(), 1, "{object:?}");
            assert!(document.pointer(reference.strip_prefix('#').unwrap()).is_some(), "{reference}");
        }
    }
    let sweep = &document["paths"]["/v1/sweep"]["post"];
    let answer = &sweep["responses"]["200"]["content"];
    assert_eq!(*answer, json!({ "application/json": { "schema": { "$ref": "#/components/schemas/SweepAnswer" } } }));
    assert!(document["paths"].get("/v1/batch").is_none(), "its lines are no JSON document");
}

#[tokio::test]
async fn version_3_0_is_served() {
    let answer = Service::new().ask(&Question::of("GET", "/openapi-3.0.json")).await;
    assert_eq!((answer.status, answer.text()), (200, &*toothwave::http::router::openapi_3_0_json()));
}

#[test]
fn every_schema_is_used() {
    let text = document().to_string();
    for name in document()["components"]["schemas"].as_object().unwrap().keys() {
        assert!(text.contains(&format!("#/components/schemas/{name}\"")), "nothing refers to {name}");
    }
}

#[test]
fn every_path_and_status_is_described() {
    let solving = ["200", "304", "400", "406", "408", "413", "415", "422", "500", "503"];
    let mut expected: Vec<(&str, &str, &[&str])> =
        ENDPOINTS.iter().map(|&path| (described(path), "post", &solving[..])).collect();
    expected.extend([
        ("/v1/design", "post", &solving[..]),
        ("/v1/batch", "post", &["200", "400", "415", "503"]),
        // Each answer is measured anew, so 304 does not exist.
        ("/v1/accuracy", "post", &["200", "400", "406", "408", "413", "415", "422", "500", "503"]),
        ("/v1/studies", "post", &["200", "202", "400", "406", "408", "413", "415", "422", "500", "501", "503"]),
        ("/v1/studies/{id}", "get", &["200", "404", "501"]),
        ("/v1/studies/{id}", "delete", &["204", "404", "501", "503"]),
        ("/v1/studies/{id}/result", "get", &["200", "404", "406", "500", "501", "503"]),
        ("/v1/studies/{id}/events", "get", &["200", "404", "501"]),
        ("/v1/quantities", "get", &["200"]),
        ("/v1/limits", "get", &["200"]),
        ("/v1/examples", "get", &["200"]),
        ("/v1/materials", "get", &["200"]),
        ("/v1/examples/{name}", "get", &["200", "404"]),
        ("/health/live", "get", &["200"]),
        ("/health/ready", "get", &["200", "503"]),
        ("/metrics", "get", &["200"]),
    ]);
    let document = document();
    let paths = document["paths"].as_object().unwrap();
    let operations = paths.values().map(|operations| operations.as_object().unwrap().len()).sum::<usize>();
    assert_eq!(operations, expected.len(), "{:?}", paths.keys());
    for (path, method, statuses) in expected {
        let operations = paths[path].as_object().unwrap();
        let responses = operations[method]["responses"].as_object().unwrap();
        for status in statuses {
            assert!(responses.contains_key(*status), "{path} can answer {status}");
        }
        assert!(responses.contains_key("503"), "{path} stands behind the bound on connections");
        let wants_key = !path.starts_with("/health/");
        assert_eq!(responses.contains_key("401"), wants_key, "{path}");
        let security = &operations[method]["security"];
        assert_eq!(*security, if wants_key { json!([{}, {"key": []}]) } else { Value::Null }, "{path}");
        assert!(operations[method]["summary"].is_string() && operations[method]["operationId"].is_string(), "{path}");
    }
}

#[test]
fn problems_are_problem_json_with_retry_after() {
    let document = document();
    for path in ENDPOINTS {
        let responses = document["paths"][described(path)]["post"]["responses"].as_object().unwrap();
        for (status, response) in responses.iter().filter(|(status, _)| status.as_str() >= "400") {
            let types: Vec<_> = response["content"].as_object().unwrap().keys().collect();
            assert_eq!(types, ["application/problem+json"], "{path} {status}");
        }
        assert!(responses["503"]["headers"]["Retry-After"].is_object(), "{path}");
        let found: BTreeSet<_> = responses["200"]["content"].as_object().unwrap().keys().map(String::as_str).collect();
        let expected = match path {
            "/v1/sweep" => {
                &["application/json", "application/vnd.apache.arrow.stream", "image/svg+xml", "text/csv", "text/plain"]
                    [..]
            }
            "/v1/drawings/assembly" => {
                &["application/json", "image/svg+xml", "image/vnd.dxf", "model/3mf", "model/step", "model/stl"]
            }
            _ => &["application/json", "text/csv", "text/plain"],
        };
        assert_eq!(found, expected.iter().copied().collect(), "{path}");
    }
}

/// Returns the schemas of a schema's fields by name. Follows references and alternatives.
fn fields_of<'a>(document: &'a Value, schema: &'a Value) -> Vec<(&'a str, &'a Value)> {
    let mut fields = Vec::new();
    if let Some(reference) = schema["$ref"].as_str() {
        fields.extend(fields_of(document, document.pointer(&reference[1..]).unwrap()));
    }
    for alternatives in ["oneOf", "anyOf", "allOf"] {
        for alternative in schema[alternatives].as_array().into_iter().flatten() {
            fields.extend(fields_of(document, alternative));
        }
    }
    // The first entry represents a list.
    fields.extend(schema.get("items").map(|schema| ("0", schema)));
    fields.extend(schema["properties"].as_object().into_iter().flatten().map(|(name, schema)| (name.as_str(), schema)));
    fields
}

/// Returns the alternatives of a schema. Follows references.
fn alternatives<'a>(document: &'a Value, schema: &'a Value) -> Vec<&'a Value> {
    let schema = schema["$ref"].as_str().map_or(schema, |reference| document.pointer(&reference[1..]).unwrap());
    schema["oneOf"].as_array().into_iter().flatten().collect()
}

/// Returns the schemas of all fields below a schema, by pointer.
fn below<'a>(document: &'a Value, schema: &'a Value, pointer: &str) -> Vec<(String, &'a Value)> {
    let mut all = Vec::new();
    for (name, schema) in fields_of(document, schema) {
        let pointer = format!("{pointer}/{name}");
        all.extend(below(document, schema, &pointer));
        // A list is followed at its first item, and a number or object at both alternatives.
        if let Some(items) = schema.get("items") {
            all.extend(below(document, items, &format!("{pointer}/0")));
        }
        let numbers = alternatives(document, schema).into_iter().filter(|alternative| is_numeric(alternative));
        all.extend(numbers.map(|number| (pointer.clone(), number)));
        all.push((pointer, schema));
    }
    all
}

fn is_numeric(schema: &Value) -> bool {
    let names_number = |kind: &Value| kind == "number" || kind == "integer";
    names_number(&schema["type"]) || schema["type"].as_array().is_some_and(|kinds| kinds.iter().any(names_number))
}

#[test]
fn every_number_has_the_checked_range() {
    let document = document();
    let all = below(document, &document["components"]["schemas"]["Design"], "");
    let is_of_number = |of: &Parameter| of.range().low.is_finite() && *of != Parameter::DutyPoints;
    let parameters: Vec<_> = Parameter::all().into_iter().filter(is_of_number).collect();
    for parameter in &parameters {
        let pointer = parameter.to_string();
        let bounds = ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"];
        let bounds_of = |schema: &Value| bounds.map(|bound| schema[bound].as_f64());
        let range = parameter.range();
        let (low, high) = (Some(range.low), Some(range.high));
        let expected = if range.closed { [low, high, None, None] } else { [None, None, low, high] };
        // Kinds of wave generator have different ranges at the same place.
        let at_place = |at: &Parameter| at.to_string() == pointer;
        let kinds = parameters.iter().filter(|other| at_place(other)).count();
        let mut schemas: Vec<_> = all.iter().filter(|(at, schema)| *at == pointer && is_numeric(schema)).collect();
        schemas.dedup_by_key(|(_, schema)| bounds_of(schema));
        assert_eq!(schemas.len(), kinds, "{pointer}: {schemas:?}");
        assert!(schemas.iter().any(|(_, schema)| bounds_of(schema) == expected), "{pointer}: {schemas:?}");
    }
    let known: BTreeSet<_> = parameters.into_iter().map(|parameter| parameter.to_string()).collect();
    let numbers: BTreeSet<_> = all.iter().filter(|(_, schema)| is_numeric(schema)).map(|(at, _)| at.clone()).collect();
    assert_eq!(numbers, known, "numbers of the schema and parameters with a range");
}

#[test]
fn every_schema_default_is_the_applied_one() {
    let document = document();
    let all = below(document, &document["components"]["schemas"]["Design"], "");
    let mut defaults = 0;
    for (pointer, schema) in &all {
        let expected = spelled_out();
        let of_words = || document.pointer(schema.get("$ref")?.as_str()?.strip_prefix('#')?)?.get("default");
        let default = schema.get("default").or_else(of_words);
        if let (Some(default), Some(expected)) = (default, expected.pointer(pointer)) {
            let same = default.as_f64().is_some() && default.as_f64() == expected.as_f64()
                || !default.is_number() && equal(default, expected);
            assert!(same, "{pointer}: {default} is not {expected}");
            defaults += 1;
        }
    }
    assert!(defaults >= 8, "{defaults} defaults");
}

/// True if both are equal as JSON, with 210 equal to 210.0.
fn equal(one: &Value, other: &Value) -> bool {
    match (one, other) {
        (Value::Number(one), Value::Number(other)) => one.as_f64() == other.as_f64(),
        (Value::Object(one), Value::Object(other)) => {
            one.len() == other.len()
                && one.iter().all(|(name, value)| other.get(name).is_some_and(|other| equal(value, other)))
        }
        _ => one == other,
    }
}

#[test]
fn document_contains_every_code() {
    let document = document();
    for (schema, words) in [
        ("ProblemCode", words(&problem_codes())),
        ("FieldCode", words(&field_codes())),
        ("FindingCode", words(&finding_codes())),
    ] {
        let schema = &document["components"]["schemas"][schema];
        let mut found: Vec<_> = schema["enum"].as_array().unwrap().iter().map(|word| word.as_str().unwrap()).collect();
        found.sort_unstable();
        assert_eq!(found, words);
    }
}

fn documentation(name: &str) -> String {
    let path = format!("{}/../../docs/reference/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn docs_findings_explains_every_finding() {
    let text = documentation("findings.md");
    for word in words(&finding_codes()) {
        assert!(text.contains(&format!("`{word}`")), "docs/reference/findings.md does not name `{word}`");
    }
}

#[test]
fn docs_problems_explains_every_code() {
    let text = documentation("problems.md");
    for word in words(&problem_codes()).into_iter().chain(words(&field_codes())) {
        assert!(text.contains(&format!("`{word}`")), "docs/reference/problems.md does not name `{word}`");
    }
}

/// Compiles a schema of the document with all its references.
fn validator(schema: &Value) -> jsonschema::Validator {
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "allOf": [schema],
        "components": document()["components"]
    });
    jsonschema::validator_for(&schema).unwrap()
}

fn assert_valid(schema: &Value, instance: &Value, what: &str) {
    let errors: Vec<_> =
        validator(schema).iter_errors(instance).map(|error| format!("{}: {error}", error.instance_path())).collect();
    assert!(errors.is_empty(), "{what}: {errors:#?}");
}

/// Asserts that the document describes this answer for the path.
fn assert_described(method: &str, path: &str, answer: &Answer) {
    let document = document();
    let what = format!("{method} {path}: {}", answer.status);
    let response = &document["paths"][described(path)][method]["responses"][answer.status.to_string()];
    assert!(response.is_object(), "{what} is not described");
    if answer.status == 304 {
        assert!(response.get("content").is_none(), "{what}");
        return;
    }
    let content_type = answer.header("content-type").split(';').next().unwrap();
    let schema = &response["content"][content_type]["schema"];
    assert!(schema.is_object(), "{what}: {content_type} is not described");
    let instance = if content_type.ends_with("json") { answer.json() } else { Value::from(answer.text()) };
    assert_valid(schema, &instance, &what);
    assert_all_described(document, schema, &instance, &what);
}

/// Asserts that the schema has every field of the instance. Schemas of answers allow more, so that answers can grow.
fn assert_all_described(document: &Value, schema: &Value, instance: &Value, what: &str) {
    if let Some(items) = schema.get("items").or_else(|| {
        let reference = schema["$ref"].as_str()?;
        document.pointer(&reference[1..])?.get("items")
    }) {
        // All items are alike, so a few suffice.
        for item in instance.as_array().into_iter().flatten().take(3) {
            assert_all_described(document, items, item, what);
        }
    }
    let fields = fields_of(document, schema);
    if !fields.is_empty() {
        for (name, value) in instance.as_object().into_iter().flatten() {
            let field = fields.iter().find(|(known, _)| known == name);
            let (_, schema) = field.unwrap_or_else(|| panic!("{what}: `{name}` is not described"));
            assert_all_described(document, schema, value, &format!("{what}/{name}"));
        }
    }
}

#[tokio::test]
async fn every_success_matches_its_schema() {
    let service = Service::new();
    let bore_without_effect = serde_json::from_str(designs::CONTRACT).unwrap();
    let overloaded = with(&spelled_out(), "/load/input_torque_nm", json!(2000.0));
    let never_undercut = with(&shortest(), "/drive/wave_generator/semi_minor_mm", json!(57.9));
    for document in [
        spelled_out(),
        shortest(),
        undercut(),
        bored(),
        every_number(),
        bore_without_effect,
        overloaded,
        never_undercut,
    ] {
        for path in ENDPOINTS {
            let answer = service.post(path, &document).await;
            assert_eq!(answer.status, 200, "{}", answer.text());
            assert_described("post", path, &answer);
        }
    }
    let csv = Question::post("/v1/sweep", shortest().to_string()).with("accept", "text/csv");
    assert_described("post", "/v1/sweep", &service.ask(&csv).await);
    for path in
        ["/v1/limits", "/v1/quantities", "/v1/examples", "/v1/materials", "/health/live", "/health/ready", "/metrics"]
    {
        assert_described("get", path, &service.get(path).await);
    }
    for name in ["paper-5.1", "paper-5.2", "paper-5.2-bored", "ring-with-more-teeth", "balls", "harmonic-path"] {
        assert_described("get", "/v1/examples/{name}", &service.get(&format!("/v1/examples/{name}")).await);
    }
}

#[tokio::test]
async fn every_304_matches_its_description() {
    let service = Service::new();
    for path in ENDPOINTS {
        let question = Question::post(path, shortest().to_string());
        let first = service.ask(&question).await;
        let answer = service.ask(&question.with("if-none-match", first.etag())).await;
        assert_eq!(answer.status, 304);
        assert_described("post", path, &answer);
    }
}

#[tokio::test]
async fn every_problem_matches_its_schema() {
    let limits = Limits { max_states: 300, ..LIMITS };
    let service = Service::within(limits);
    let mut statuses = BTreeSet::new();
    for path in ENDPOINTS {
        let invalid = without(&spelled_out(), "/drive/teeth/count");
        let impossible =
            with(&with(&spelled_out(), "/drive/teeth/radius_mm", json!(0.0)), "/drive/teeth/installed", json!(9));
        let questions = [
            Question::post(path, "{"),
            Question::post(path, spelled_out().to_string()).with("accept", "image/png"),
            Question::post(path, " ".repeat(LIMITS.max_body_bytes + 1)),
            Question::of("POST", path),
            Question::post(path, invalid.to_string()),
            Question::post(path, impossible.to_string()),
        ];
        for question in questions {
            let answer = service.ask(&question).await;
            assert_described("post", path, &answer);
            statuses.insert(answer.status);
        }
    }
    assert_eq!(statuses, [400, 406, 413, 415, 422].into());
    assert_described("get", "/v1/examples/{name}", &service.get("/v1/examples/nothing").await);
    let geometry = service.post("/v1/geometry", &spelled_out()).await;
    geometry.refused(422, "too_many_points");
    assert_described("post", "/v1/geometry", &geometry);
    let unloaded = with(&spelled_out(), "/drive/teeth/installed", json!(4));
    let sweep = service.post("/v1/sweep", &unloaded).await;
    sweep.refused(422, "no_tooth_in_mesh");
    assert_described("post", "/v1/sweep", &sweep);
}

fn design_schema() -> Value {
    json!({ "$ref": "#/components/schemas/Design" })
}

#[tokio::test]
async fn schema_accepts_what_the_service_accepts() {
    let service = Service::new();
    let documents = [
        spelled_out(),
        shortest(),
        undercut(),
        bored(),
        every_number(),
        serde_json::from_str(designs::CONTRACT).unwrap(),
        with(&shortest(), "/load", json!({ "output_torque_nm": 280 })),
        with(&shortest(), "/drive/teeth/count", json!(28.0)),
        with(&shortest(), "/materials", json!({})),
        with(&shortest(), "/materials", json!({ "ring": {} })),
        with(&shortest(), "/model", json!({})),
        with(&shortest(), "/sweep", json!({})),
        with(&shortest(), "/profile", json!({})),
    ];
    for document in documents {
        service.post("/v1/sweep", &document).await.found();
        assert_valid(&design_schema(), &document, &document.to_string());
    }
}

/// Returns one document for each kind, shape and law. Defaults appear with and without their word.
fn kinds() -> Vec<Value> {
    let wave_generators = [
        json!({ "kind": "ellipse", "semi_major_mm": 49.0, "semi_minor_mm": 47.0 }),
        json!({ "kind": "harmonic", "lobes": 2, "mean_radius_mm": 48.0, "amplitude_mm": 1.0 }),
        json!({ "kind": "harmonic_path", "lobes": 2, "mean_path_radius_mm": 51.0, "amplitude_mm": 1.0 }),
    ];
    let teeth = [
        json!({ "shape": "cylinder", "count": 28, "radius_mm": 3.0, "width_mm": 15.0 }),
        json!({ "shape": "flat_sided", "count": 28, "radius_mm": 3.0, "width_mm": 15.0, "flat_length_mm": 3.0 }),
    ];
    let laws = [json!({ "law": "linear" }), json!({ "law": "palmgren" }), fixed(4e5, 5e5, 3e5)];
    let mut kinds = vec![eccentric()];
    kinds.extend(wave_generators.map(|other| with(&shortest(), "/drive/wave_generator", other)));
    kinds.extend(teeth.map(|other| with(&shortest(), "/drive/teeth", other)));
    kinds.extend(laws.map(|other| with(&shortest(), "/model", json!({ "stiffness": other }))));
    let balls = json!({ "shape": "ball", "count": 28, "radius_mm": 3.0, "groove_radius_mm": { "ring": 3.2 } });
    let virtual_work = |other: Value| json!({ "compatibility": "virtual_work", "stiffness": other });
    kinds.push(with(&with(&shortest(), "/drive/teeth", balls), "/model", virtual_work(json!({ "law": "hertz" }))));
    let johnson = json!({ "law": "johnson", "depth_mm": { "ring": 4.0 } });
    let model = with(&virtual_work(johnson), "/series_compliance_mm_per_n", json!({ "carrier": 1e-6 }));
    kinds.push(with(&shortest(), "/model", model));
    let bearing = json!({ "coefficient": 0.05, "bearing_coefficient": 0.002, "bearing_radius_mm": 52.0 });
    for (kind, wave_generator) in
        [("plain", json!({ "coefficient": 0.03 })), ("race", bearing.clone()), ("rolling", bearing)]
    {
        let wave_generator = with(&wave_generator, "/kind", json!(kind));
        let document = with(&shortest(), "/friction", crate::friction::on(&wave_generator));
        kinds.push(with(&document, "/load/input_speed_rpm", json!(1500.0)));
        kinds.push(with(&eccentric(), "/friction", document["friction"].clone()));
    }
    let relief = json!({ "amount_um": 4.0, "start_deg": 60.0, "power": 2.0 });
    let modification = json!({ "ring_equidistant_um": 4.0, "tooth_radius_um": 0.5, "ring_tip_relief": relief });
    let modified = with(&shortest(), "/model", json!({ "compatibility": "virtual_work" }));
    kinds.push(with(&modified, "/modification", modification));
    kinds.push(crate::deviations::deviating());
    kinds
}

#[tokio::test]
async fn every_kind_is_answered_as_described() {
    let service = Service::new();
    for document in kinds() {
        assert_valid(&design_schema(), &document, &document.to_string());
        for path in ENDPOINTS {
            let answer = service.post(path, &document).await;
            assert_eq!(answer.status, 200, "{path}: {document}: {}", answer.text());
            assert_described("post", path, &answer);
        }
    }
}

/// Generated clients tell kinds apart by this word.
#[test]
fn every_discriminator_maps_to_schemas_requiring_its_word() {
    let document = document();
    let mut unions = 0;
    for (name, schema) in document["components"]["schemas"].as_object().unwrap() {
        let Some(discriminator) = schema.get("discriminator") else { continue };
        let tag = discriminator["propertyName"].as_str().unwrap();
        let alternatives: Vec<_> = schema["oneOf"].as_array().unwrap().iter().map(|one| &one["$ref"]).collect();
        for (word, reference) in discriminator["mapping"].as_object().unwrap() {
            assert!(alternatives.contains(&reference), "{name}: {reference}");
            let kind = document.pointer(&reference.as_str().unwrap()[1..]).unwrap();
            assert_eq!(kind["properties"][tag]["enum"], json!([word]), "{name}");
            assert!(kind["required"].as_array().unwrap().contains(&json!(tag)), "{name}");
        }
        unions += 1;
    }
    assert_eq!(unions, 6);
}

#[tokio::test]
async fn schema_refuses_invalid_form_and_range() {
    let service = Service::new();
    let schema = validator(&design_schema());
    let mut refused = vec![json!(null), json!([]), json!({}), json!("drive")];
    for document in [spelled_out(), every_number()] {
        for pointer in designs::pointers(&document, |_| true) {
            refused.extend([json!([1]), json!(true), json!("text")].map(|other| with(&document, &pointer, other)));
        }
        for pointer in designs::pointers(&document, Value::is_object) {
            refused.push(with(&document, &format!("{pointer}/colour"), json!(1)));
        }
        for pointer in ["/drive/teeth/count", "/drive/teeth/installed", "/drive/ring/teeth", "/sweep/samples"] {
            refused.push(with(&document, pointer, json!(28.5)));
        }
    }
    for document in refused {
        // No endpoint reads all values, so those that read this one must refuse it.
        let statuses =
            [service.post("/v1/sweep", &document).await.status, service.post("/v1/geometry", &document).await.status];
        assert!(statuses.contains(&422), "{document}");
        assert!(!schema.is_valid(&document), "the schema takes {document}");
    }
}

#[test]
fn example_in_the_document_is_a_design() {
    let document = document();
    let example = &document["components"]["schemas"]["Design"]["example"];
    assert!(example.is_object());
    assert_valid(&design_schema(), example, "the example");
}
