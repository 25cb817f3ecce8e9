//! All calls by the client that progenitor makes of ./openapi-3.0.json: sweep URL

use futures_util::TryStreamExt;
use serde_json::json;

progenitor::generate_api!(spec = "openapi-3.0.json");

fn design(radius_mm: f64) -> types::Design {
    let design = json!({
        "drive": {
            "wave_generator": { "kind": "ellipse", "semi_major_mm": 58.0, "semi_minor_mm": 56.0 },
            "teeth": { "shape": "cylinder", "count": 28, "radius_mm": radius_mm, "width_mm": 15.0 },
            "ring": { "teeth": 26 }
        },
        "load": { "input_torque_nm": 20.0 },
        "model": { "compatibility": "projection", "stiffness": { "law": "linear" } }
    });
    serde_json::from_value(design).expect("a design")
}

#[tokio::main(flavor = "current_thread")]
async fn main() {
    let url = std::env::args().nth(1).expect("a URL");
    let client = Client::new(&url);
    for example in &client.examples().await.expect("examples").examples {
        let design = client.example(&example.name).await.expect("an example");
        client.geometry(None, None, &design).await.expect("a geometry");
        client.coincidence_degree(None, None, &design).await.expect("a contact ratio");
        assert!(client.design(None, &design).await.expect("answers").sweep.is_some(), "{}", example.name);
        let drawing = client.drawing(types::DrawnPart::Assembly, None, None, &design).await.expect("a drawing");
        assert!(!drawing.bodies.is_empty(), "{}", example.name);
    }
    let answer = client.sweep(None, None, &design(5.0)).await.expect("an answer");
    println!("{}", answer.peaks.wave_generator.force_n.value);
    assert!(!client.accuracy(None, &design(5.0)).await.expect("ways").ways.is_empty());

    let refused = client.sweep(None, None, &design(-1.0)).await;
    let Err(Error::ErrorResponse(response)) = refused else { panic!("an answer for a radius below zero") };
    // Of media types this generator knows application/json alone, and leaves a problem as the bytes that it is.
    let bytes: Vec<_> = response.into_inner().into_inner().try_collect().await.expect("a whole body");
    let problem: types::Problem = serde_json::from_slice(&bytes.concat()).expect("a problem");
    assert_eq!(problem.errors[0].pointer, "/drive/teeth/radius_mm");

    assert!(!client.quantities().await.expect("quantities").quantities.is_empty());
    let over = json!({ "/load/input_torque_nm": { "min": 1.0, "max": 2.0, "steps": 3 } });
    let study = json!({ "study": "map", "base": design(5.0), "over": over });
    let study = serde_json::from_value(study).expect("a study");
    let found = client.begin(Some("wait=9"), &study).await.expect("a study");
    assert!(found.result.is_some(), "no result");
    client.cancel(&found.id).await.expect("it is forgotten");
}
