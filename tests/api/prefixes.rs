//! The documentation's page, and addresses behind a proxy that strips a prefix from the path.

use serde_json::{Value, json};

use crate::asking::{LIMITS, Question, Service};
use crate::designs::shortest;
use crate::entry::{KeysFile, new_key};

/// What a client behind the prefix `/tw` makes of a reference in the answer from a path.
fn resolved(path: &str, reference: &str) -> String {
    assert!(!reference.starts_with('/') && !reference.contains(':'), "{reference} is not relative");
    let prefixed = format!("/tw{path}");
    let mut folders: Vec<_> = prefixed.split('/').collect();
    folders.pop();
    for part in reference.split('/') {
        match part {
            "." => {}
            ".." => drop(folders.pop()),
            name => folders.push(name),
        }
    }
    folders.join("/")
}

#[tokio::test]
async fn addresses_keep_the_prefix_of_a_proxy() {
    let service = Service::new();
    assert_eq!(resolved("/docs", service.get("/docs").await.header("location")), "/tw/docs/");
    for (path, document) in [
        ("/openapi.json", service.get("/openapi.json").await.found()),
        ("/openapi-3.0.json", service.get("/openapi-3.0.json").await.found()),
        ("/docs/openapi.json", service.get("/docs/openapi.json").await.found()),
    ] {
        assert_eq!(resolved(path, document["servers"][0]["url"].as_str().unwrap()), "/tw", "{path}");
    }
    let over = json!({ "/load/input_torque_nm": { "min": 1.0, "max": 2.0, "steps": 3 } });
    let study = json!({ "study": "map", "base": shortest(), "over": over });
    let answer = service.ask(&Question::post("/v1/studies", study.to_string())).await;
    let place = format!("/tw/v1/studies/{}", answer.json()["id"].as_str().unwrap());
    assert_eq!((answer.status, resolved("/v1/studies", answer.header("location"))), (202, place));
}

#[tokio::test]
async fn swagger_begins_with_sweep_and_locks_by_keys() {
    let (key, line) = new_key("a team");
    let file = KeysFile::of(&line);
    for (flags, has_keys) in [(&[][..], false), (&["--keys-file", file.path()], true)] {
        let question = Question::of("GET", "/docs/openapi.json").with("authorization", &format!("Bearer {key}"));
        let document = Service::with(LIMITS, flags).ask(&question).await.found();
        assert_eq!(document["tags"][0]["name"], "sweep");
        let operations =
            document["paths"].as_object().unwrap().iter().filter_map(|(path, item)| Some((path, item.get("post")?)));
        let first: Vec<_> = operations.filter(|(_, post): &(_, &Value)| post["tags"] == json!(["sweep"])).collect();
        assert_eq!((first.len(), first[0].0.as_str()), (1, "/v1/sweep"));
        assert_eq!(document.to_string().contains("\"security"), has_keys);
    }
}
