//! Example design documents.

use serde_json::{Value, json};

use crate::asking::{ENDPOINTS, Service};

async fn names(service: &Service) -> Vec<String> {
    let found = service.get("/v1/examples").await.found();
    let examples = found["examples"].as_array().unwrap();
    examples.iter().map(|example| example["name"].as_str().unwrap().to_owned()).collect()
}

#[tokio::test]
async fn every_material_has_source_and_fits_a_document() {
    let service = Service::new();
    let found = service.get("/v1/materials").await.found();
    let materials = found["materials"].as_array().unwrap();
    assert!(materials.len() >= 4);
    for material in materials {
        assert!(material["elasticity_source"].as_str().unwrap().len() > 20);
        // A stress always has its source.
        assert_eq!(material.get("allowable_stress_mpa").is_some(), material.get("allowable_stress_source").is_some());
        let elastic = json!({
            "youngs_modulus_gpa": material["youngs_modulus_gpa"], "poissons_ratio": material["poissons_ratio"]
        });
        let document = crate::designs::with(&crate::designs::spelled_out(), "/materials/ring", elastic);
        service.post("/v1/sweep", &document).await.found();
    }
}

#[tokio::test]
async fn examples_include_the_papers_cases() {
    let names = names(&Service::new()).await;
    for name in ["paper-5.1", "paper-5.2", "paper-5.2-bored"] {
        assert!(names.contains(&name.to_owned()), "{names:?}");
    }
}

#[tokio::test]
async fn each_listed_example_exists() {
    let service = Service::new();
    let found = service.get("/v1/examples").await.found();
    for example in found["examples"].as_array().unwrap() {
        assert!(example["title"].as_str().is_some_and(|title| !title.is_empty()), "{example}");
        service.get(example["href"].as_str().unwrap()).await.found();
        assert_eq!(example["href"], format!("/v1/examples/{}", example["name"].as_str().unwrap()));
    }
}

#[tokio::test]
async fn every_endpoint_answers_its_examples() {
    let service = Service::new();
    for name in names(&service).await {
        let example = service.get(&format!("/v1/examples/{name}")).await;
        let document: Value = example.found();
        for path in ENDPOINTS {
            let answer = service.post_text(path, example.body.clone()).await;
            if path == "/v1/sweep" && document.get("load").is_none() {
                assert_eq!(answer.status, 422, "{name} has no load");
            } else {
                answer.found();
            }
        }
    }
}

#[tokio::test]
async fn served_example_equals_its_file() {
    let service = Service::new();
    for name in names(&service).await {
        let file = format!("{}/../../examples/{name}.json", env!("CARGO_MANIFEST_DIR"));
        assert_eq!(service.get(&format!("/v1/examples/{name}")).await.text(), std::fs::read_to_string(file).unwrap());
    }
}

#[tokio::test]
async fn every_kind_has_an_example_without_warning() {
    let service = Service::new();
    let (mut kinds, mut shapes) = (Vec::new(), Vec::new());
    for name in names(&service).await {
        let document = service.get(&format!("/v1/examples/{name}")).await.found();
        let word = |pointer: &str, by_default: &str| {
            document.pointer(pointer).and_then(Value::as_str).unwrap_or(by_default).to_owned()
        };
        kinds.push(word("/drive/wave_generator/kind", "ellipse"));
        shapes.push(word("/drive/teeth/shape", "cylinder"));
        if !name.starts_with("paper") {
            let found = service.post("/v1/sweep", &document).await.found();
            let findings = found["findings"].as_array().unwrap();
            assert!(findings.iter().all(|finding| finding["severity"] != "warning"), "{name}: {findings:?}");
        }
    }
    for (words, found) in [
        (vec!["ellipse", "eccentric", "harmonic", "harmonic_path"], kinds),
        (vec!["cylinder", "ball", "flat_sided"], shapes),
    ] {
        for word in words {
            assert!(found.contains(&word.to_owned()), "no example of {word}");
        }
    }
}

#[tokio::test]
async fn unknown_example_lists_known_ones() {
    let service = Service::new();
    let problem = service.get("/v1/examples/paper-5.3").await.refused(404, "not_found");
    for name in names(&service).await {
        assert!(problem["detail"].as_str().unwrap().contains(&name), "{problem}");
    }
}
