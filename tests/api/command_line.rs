//! The command line gives the service's answers without the service.

use std::io::Write as _;
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};

use crate::asking::{Question, Service};
use crate::designs::{shortest, spelled_out, undercut, with, without};
use crate::serving::Process;

/// Commands with the paths that give the same answers.
const COMMANDS: [(&str, &str); 3] =
    [("geometry", "/v1/geometry"), ("coincidence-degree", "/v1/coincidence-degree"), ("sweep", "/v1/sweep")];

fn run(arguments: &[&str], input: &[u8]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_toothwave"));
    let command = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // A process may close its input without reading it.
    let _ = child.stdin.take().unwrap().write_all(input);
    child.wait_with_output().unwrap()
}

fn stdout(output: &Output) -> &str {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::str::from_utf8(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

fn example(name: &str) -> String {
    format!("{}/../../examples/{name}.json", env!("CARGO_MANIFEST_DIR"))
}

#[tokio::test]
async fn json_equals_body_of_service() {
    for name in ["paper-5.1", "paper-5.2", "paper-5.2-bored", "ring-with-more-teeth", "balls", "flat-sided"] {
        for (command, path) in COMMANDS {
            let served = Service::new().post_text(path, std::fs::read(example(name)).unwrap()).await;
            let output = run(&[command, &example(name), "--format", "json"], b"");
            assert!(stdout(&output).strip_suffix('\n') == Some(served.text()), "{command} {name}");
        }
    }
}

#[tokio::test]
async fn study_equals_that_of_service() {
    let over = json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 9.0, "steps": 7 } });
    let study = json!({ "study": "map", "base": shortest(), "over": over, "quantities": ["undercut"] }).to_string();
    let service = Service::new();
    let question = Question::post("/v1/studies", study.clone()).with("prefer", "wait=600");
    let found = service.ask(&question).await.found();
    let served = service.get(found["result_href"].as_str().unwrap()).await;
    let output = run(&["study", "-"], study.as_bytes());
    assert!(stdout(&output).strip_suffix('\n') == Some(served.text()), "{}", stdout(&output));
    let refused = run(&["study", "-"], br#"{ "study": "map", "base": {}, "over": {} }"#);
    assert_eq!((refused.status.code(), stderr(&refused).contains("/over")), (Some(2), true));
}

/// A folder of this process, removed in the end.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        // It may not have been made.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn jobs_of_an_array_give_the_whole_answer() {
    let folder = Folder(std::env::temp_dir().join(format!("toothwave-array-{}", std::process::id())));
    let path = folder.0.to_str().unwrap();
    let over = json!({ "/drive/teeth/radius_mm": { "min": 3.0, "max": 9.0, "steps": 7 } });
    let study = json!({ "study": "map", "base": shortest(), "over": over, "quantities": ["undercut"] }).to_string();
    let ask = |arguments: &[&str]| run(&[&["study", "-"], arguments].concat(), study.as_bytes());
    assert_eq!(
        stderr(&ask(&["--part", "1/2", "--into", path])),
        "part 1/2: computed 3 chunks, found 0; the study has 7\n"
    );
    let incomplete = ask(&["--merge", path]);
    assert_eq!(incomplete.status.code(), Some(1));
    assert!(stderr(&incomplete).contains("4 of 7 chunks are missing (0, 2, 4, 6)"), "{}", stderr(&incomplete));
    assert!(String::from_utf8_lossy(&incomplete.stdout).contains(r#""is_complete":false"#));
    assert!(ask(&["--part", "0/2", "--into", path]).status.success());
    assert!(stderr(&ask(&["--part", "1/1", "--into", path])).contains("computed 0 chunks, found 7"));
    assert_eq!(stdout(&ask(&["--merge", path])), stdout(&ask(&[])));
    assert_eq!(stdout(&ask(&["--merge", path, "--rows"])), stdout(&ask(&["--format", "csv"])));
    let other = study.replace("9.0", "8.0");
    let refused = run(&["study", "-", "--merge", path], other.as_bytes());
    assert_eq!((refused.status.code(), stderr(&refused).contains("another study")), (Some(2), true));
    for wrong in [&["--part", "3/2", "--into", path][..], &["--part", "1/2"], &["--rows", "--format", "json"]] {
        assert_eq!(ask(wrong).status.code(), Some(2), "{wrong:?}");
    }
}

#[tokio::test]
async fn sweep_csv_equals_body_of_service() {
    let question = Question::post("/v1/sweep", std::fs::read(example("paper-5.2")).unwrap()).with("accept", "text/csv");
    let served = Service::new().ask(&question).await;
    let output = run(&["sweep", "--format", "csv", &example("paper-5.2")], b"");
    assert!(stdout(&output) == served.text());
}

#[tokio::test]
async fn geometry_csv_holds_points_of_json() {
    let found = Service::new().post_text("/v1/geometry", std::fs::read(example("paper-5.2")).unwrap()).await.found();
    let output = run(&["geometry", "--format", "csv", &example("paper-5.2")], b"");
    let mut csv = csv::Reader::from_reader(stdout(&output).as_bytes());
    assert_eq!(csv.headers().unwrap(), vec!["profile", "x_mm", "y_mm"]);
    let mut rows = csv.records().map(|row| row.unwrap());
    let profiles = [
        ("ring", &found["ring"]["profile"]),
        ("wave_generator", &found["wave_generator"]["profile"]),
        ("tooth_center_path", &found["tooth_center_path"]),
    ];
    for (name, profile) in profiles {
        for (x, y) in profile["x_mm"].as_array().unwrap().iter().zip(profile["y_mm"].as_array().unwrap()) {
            let row = rows.next().unwrap();
            let point = (row[1].parse::<f64>().ok(), row[2].parse::<f64>().ok());
            assert_eq!((&row[0], point), (name, (x.as_f64(), y.as_f64())));
        }
    }
    assert!(rows.next().is_none());
}

#[test]
fn coincidence_degree_csv_is_one_line() {
    let output = run(&["coincidence-degree", "--format", "csv", &example("paper-5.1")], b"");
    let mut csv = csv::Reader::from_reader(stdout(&output).as_bytes());
    let names: Vec<_> = csv.headers().unwrap().iter().map(str::to_owned).collect();
    let rows: Vec<_> = csv.records().map(|row| row.unwrap()).collect();
    assert_eq!(rows.len(), 1);
    let value = |name: &str| rows[0][names.iter().position(|known| known == name).unwrap()].parse::<f64>().unwrap();
    assert_eq!((value("coincidence_degree"), value("teeth_in_mesh_per_zone_min")), (14.0, 7.0));
}

#[test]
fn prints_table_of_main_numbers_by_default() {
    for (command, numbers) in [
        ("geometry", &["14", "-13", "66.000000", "6.749190"][..]),
        ("coincidence-degree", &["14.000000000000", "7 to 7", "13.846154"]),
        ("sweep", &["1429.443", "1549.279", "645.337", "872.606", "980.437", "562.162", "357"]),
    ] {
        let by_default = run(&[command, &example("paper-5.1")], b"");
        let table = run(&[command, "--format", "table", &example("paper-5.1")], b"");
        assert_eq!(stdout(&by_default), stdout(&table));
        for number in numbers {
            assert!(stdout(&table).contains(number), "no {number} in\n{}", stdout(&table));
        }
    }
}

#[test]
fn table_lists_findings() {
    let output = run(&["coincidence-degree", &example("paper-5.2")], b"");
    assert!(stdout(&output).contains("cut away the tips of the ring's teeth"), "{}", stdout(&output));
}

#[test]
fn dash_reads_standard_input() {
    for (command, _) in COMMANDS {
        let from_file = run(&[command, &example("paper-5.2"), "--format", "json"], b"");
        let from_input = run(&[command, "-", "--format", "json"], &std::fs::read(example("paper-5.2")).unwrap());
        assert!(stdout(&from_file) == stdout(&from_input), "{command}");
    }
}

/// Returns documents that get no answer, of each kind.
fn bad_documents() -> Vec<String> {
    vec![
        String::new(),
        "{".into(),
        "[]".into(),
        "{}".into(),
        with(&shortest(), "/drive/teeth/colour", json!("red")).to_string(),
        with(&shortest(), "/drive/teeth/count", json!("28")).to_string(),
        without(&shortest(), "/load").to_string(),
        with(&shortest(), "/drive/ring/teeth", json!(27)).to_string(),
        with(&shortest(), "/drive/teeth/installed", json!(4)).to_string(),
        with(&with(&shortest(), "/drive/teeth/installed", json!(9)), "/drive/ring/teeth", json!(27)).to_string(),
    ]
}

#[tokio::test]
async fn bad_input_exits_2_with_details_of_service() {
    for document in bad_documents() {
        let problem = Service::new().post_text("/v1/sweep", document.clone()).await.problem();
        for format in ["json", "csv", "table"] {
            let output = run(&["sweep", "-", "--format", format], document.as_bytes());
            assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{document}");
            let errors: Vec<_> = problem["errors"].as_array().into_iter().flatten().collect();
            // If there are several errors, the service's detail is only their number.
            let detail = problem[if errors.len() > 1 { "title" } else { "detail" }].as_str().unwrap();
            assert!(stderr(&output).contains(detail), "{problem} is not\n{}", stderr(&output));
            assert!(!stderr(&output).contains("`errors`"), "{}", stderr(&output));
            for error in errors {
                for member in ["pointer", "detail"] {
                    let text = error[member].as_str().unwrap();
                    assert!(stderr(&output).contains(text), "{text} is not in\n{}", stderr(&output));
                }
            }
        }
    }
}

#[test]
fn unreadable_file_exits_2_with_its_name() {
    for file in ["/nowhere/at/all.json", env!("CARGO_MANIFEST_DIR")] {
        let output = run(&["sweep", file], b"");
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
        assert!(stderr(&output).contains(file), "{}", stderr(&output));
    }
}

#[test]
fn misspelled_command_exits_2() {
    for arguments in [
        &["swep"][..],
        &["sweep"],
        &["sweep", "-", "--format", "xml"],
        &["sweep", "-", "--colour"],
        &["--listen", "nowhere"],
    ] {
        assert_eq!(run(arguments, b"").status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn removed_commands_name_their_replacement() {
    for arguments in [
        &["worker", "--studies", "postgres://any@db/studies"][..],
        &["migrate", "--studies", "postgres://any@db/studies"],
        &["worker"],
        &["--studies", "postgres://any@db/studies"],
        &["--replicas", "2"],
    ] {
        let output = run(arguments, b"");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains("--studies "), "{}", stderr(&output));
    }
}

#[test]
fn only_the_documents_limits_apply() {
    let many = with(&undercut(), "/sweep", json!({ "samples": 250_000 })).to_string();
    let output = run(&["sweep", "-", "--format", "table"], many.as_bytes());
    assert!(stdout(&output).contains("coincidence degree"));
    let too_many = with(&undercut(), "/sweep", json!({ "samples": 10_000_001 })).to_string();
    assert_eq!(run(&["sweep", "-"], too_many.as_bytes()).status.code(), Some(2));
}

#[test]
fn rejects_too_much_without_naming_a_setting() {
    let states = with(&undercut(), "/sweep", json!({ "samples": 10_000_000 }));
    let points = json!({ "chord_tolerance_mm": 1e-6, "extent": "full" });
    let points =
        [("/drive/wave_generator", json!({ "semi_major_mm": 5.8e5, "semi_minor_mm": 5.6e5 })), ("/profile", points)]
            .into_iter()
            .fold(with(&shortest(), "/drive/teeth/radius_mm", json!(5e4)), |document, (pointer, value)| {
                with(&document, pointer, value)
            });
    for (command, document) in [("sweep", states), ("geometry", points)] {
        let output = run(&[command, "-"], document.to_string().as_bytes());
        assert_eq!(output.status.code(), Some(2));
        let text = stderr(&output);
        assert!(text.contains("20000000") && text.contains("the command line") && !text.contains("max_"), "{text}");
    }
}

#[test]
fn openapi_prints_the_committed_document() {
    assert_eq!(stdout(&run(&["openapi"], b"")), crate::openapi::COMMITTED);
}

#[test]
fn version_is_the_solvers() {
    assert_eq!(stdout(&run(&["--version"], b"")).trim(), format!("toothwave {}", toothwave_solver::VERSION));
    let output = run(&["coincidence-degree", "-", "--format", "json"], spelled_out().to_string().as_bytes());
    let answer: Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(answer["solver_version"], toothwave_solver::VERSION);
}

#[test]
fn health_succeeds_for_running_service() {
    let process = Process::started(&["serve"]);
    let output = run(&["health", "--address", &process.address.to_string()], b"");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    // A wildcard address is asked on this host, and the environment variable sets the address too.
    let everywhere = format!("0.0.0.0:{}", process.address.port());
    let mut command = Command::new(env!("CARGO_BIN_EXE_toothwave"));
    assert!(command.arg("health").env("TOOTHWAVE_LISTEN", everywhere).status().unwrap().success());
}

#[test]
fn health_fails_without_toothwave_service() {
    let closed = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let output = run(&["health", "--address", &closed.to_string()], b"");
    assert!(!output.status.success());
    assert!(!stderr(&output).is_empty());
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = other.local_addr().unwrap().to_string();
    let answering = std::thread::spawn(move || {
        let (mut stream, _) = other.accept().unwrap();
        // The client may close before it has read everything.
        let _ = stream.write_all(b"HTTP/1.1 503 Service Unavailable\r\n\r\n");
    });
    assert!(!run(&["health", "--address", &address], b"").status.success());
    answering.join().unwrap();
}

/// Text of a foreign document must not control the reader's terminal.
#[test]
fn escapes_control_characters_for_terminal() {
    let document = r#"{ "drive": { "\u001b[2J\u009b31m\u0007good\n": 1 } }"#;
    let output = run(&["sweep", "-"], document.as_bytes());
    assert!(!output.status.success());
    let said = stderr(&output);
    assert!(said.trim_end().chars().all(|character| !character.is_control() || character == '\n'), "{said:?}");
    assert!(said.contains(r"\u{1b}[2J\u{9b}31m\u{7}good"), "{said:?}");
}

#[tokio::test]
async fn csv_has_a_decimal_comma_on_request() {
    for (command, path) in COMMANDS {
        let document = std::fs::read(example("paper-5.2")).unwrap();
        let ask = async |query: &str| {
            let question = Question::post(&format!("{path}{query}"), document.clone()).with("accept", "text/csv");
            Service::new().ask(&question).await
        };
        let (point, comma) = (ask("?decimal=point").await, ask("?decimal=comma").await);
        assert_eq!(point.text(), ask("").await.text());
        // No field holds a comma, a semicolon, or a point but in its number.
        assert_eq!(comma.text(), point.text().replace(',', ";").replace('.', ","), "{path}");
        assert_eq!(comma.header("content-type"), point.header("content-type"));
        let arguments = [command, "--format", "csv-comma", &example("paper-5.2")];
        assert_eq!(stdout(&run(&arguments, b"")), comma.text());
        for query in ["?decimal=dot", "?decimal", "?comma=true"] {
            ask(query).await.refused(400, "invalid_query");
        }
    }
}

#[test]
fn draw_writes_meshes_for_printing() {
    let stl = run(&["draw", "tooth", &example("paper-5.1"), "--format", "stl", "--printing"], b"").stdout;
    let x_mm = stl[84..].chunks_exact(50).map(|record| f32::from_le_bytes(record[12..16].try_into().unwrap()));
    assert!((x_mm.fold(0.0, f32::max) - 4.95).abs() < 1e-6);
    let archive = run(&["draw", "assembly", &example("paper-5.1"), "--format", "3mf"], b"").stdout;
    assert!(archive.starts_with(b"PK"));
}

#[tokio::test]
async fn a_document_in_utf_16_is_named() {
    let text = std::fs::read_to_string(example("paper-5.1")).unwrap();
    let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    for document in [[b"\xFF\xFE", &little[..]].concat(), [b"\xFE\xFF", &big[..]].concat(), little, big] {
        let problem = Service::new().post_text("/v1/sweep", document.clone()).await.refused(400, "malformed_json");
        assert!(problem["detail"].as_str().unwrap().contains("the document is UTF-16; save it as UTF-8"), "{problem}");
        assert!(stderr(&run(&["sweep", "-"], &document)).contains("UTF-16"));
    }
}
