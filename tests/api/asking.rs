//! Clients of the service. Each test has its own process and uses real connections.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderMap, HeaderName, HeaderValue};
use serde_json::{Value, json};

use crate::designs::{shortest, with};
use crate::serving::Process;

/// Every path that a design document can be sent to.
pub(crate) const ENDPOINTS: [&str; 4] =
    ["/v1/geometry", "/v1/coincidence-degree", "/v1/sweep", "/v1/drawings/assembly"];

/// Service settings of a test.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) max_states: u64,
    pub(crate) max_body_bytes: usize,
    pub(crate) max_concurrent_solves: u16,
    pub(crate) deadline_ms: u64,
    pub(crate) cache_max_bytes: u64,
    pub(crate) max_unread_bytes: u64,
}

/// Generous limits. No test comes near the deadline.
pub(crate) const LIMITS: Limits = Limits {
    max_states: 1_000_000,
    max_body_bytes: 65_536,
    max_concurrent_solves: 2,
    deadline_ms: 600_000,
    cache_max_bytes: 268_435_456,
    max_unread_bytes: 1 << 30,
};

impl Limits {
    fn arguments(&self) -> Vec<String> {
        let Self { max_states, max_body_bytes, max_concurrent_solves, deadline_ms, cache_max_bytes, max_unread_bytes } =
            self;
        let flags = [
            format!("--max-states={max_states}"),
            format!("--max-body-bytes={max_body_bytes}"),
            format!("--max-concurrent-solves={max_concurrent_solves}"),
            format!("--deadline-ms={deadline_ms}"),
            format!("--cache-max-bytes={cache_max_bytes}"),
            format!("--max-unread-bytes={max_unread_bytes}"),
        ];
        flags.into()
    }
}

/// A request.
#[derive(Debug, Clone)]
pub(crate) struct Question {
    method: &'static str,
    path: String,
    headers: Vec<(String, String)>,
    body: Vec<u8>,
}

impl Question {
    pub(crate) fn of(method: &'static str, path: &str) -> Self {
        Self { method, path: path.into(), headers: Vec::new(), body: Vec::new() }
    }

    /// Makes a POST request with these bytes as JSON.
    pub(crate) fn post(path: &str, body: impl Into<Vec<u8>>) -> Self {
        Self::post_as("application/json", path, body)
    }

    /// Makes a POST request with these bytes and this content type.
    pub(crate) fn post_as(content_type: &str, path: &str, body: impl Into<Vec<u8>>) -> Self {
        let question = Self { body: body.into(), ..Self::of("POST", path) };
        question.with("content-type", content_type)
    }

    pub(crate) fn with(mut self, name: &str, value: &str) -> Self {
        self.headers.push((name.into(), value.into()));
        self
    }

    pub(crate) fn wire(&self) -> Vec<u8> {
        let mut head = format!("{} {} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n", self.method, self.path);
        for (name, value) in &self.headers {
            head += &format!("{name}: {value}\r\n");
        }
        head += &format!("content-length: {}\r\n\r\n", self.body.len());
        [head.as_bytes(), &self.body].concat()
    }
}

/// A response.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn text(&self) -> &str {
        std::str::from_utf8(&self.body).unwrap()
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {:?}", self.text()))
    }

    /// Returns the header's value, or an empty string.
    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |value| value.to_str().unwrap())
    }

    pub(crate) fn etag(&self) -> &str {
        let etag = self.header("etag");
        assert!(etag.starts_with('"') && etag.ends_with('"') && etag.len() > 2, "{etag} is no strong entity tag");
        etag
    }

    pub(crate) fn is_hit(&self) -> bool {
        cache_status(self.header("cache-status")).contains(&"hit")
    }

    pub(crate) fn is_collapsed(&self) -> bool {
        cache_status(self.header("cache-status")).contains(&"collapsed")
    }

    /// True if the answer was solved for this very request.
    pub(crate) fn is_miss(&self) -> bool {
        cache_status(self.header("cache-status")).contains(&"fwd=miss") && !self.is_collapsed()
    }

    /// Returns the body of a success in JSON.
    pub(crate) fn found(&self) -> Value {
        assert_eq!(self.status, 200, "{}", self.text());
        assert_eq!(self.header("content-type"), "application/json");
        self.json()
    }

    /// Returns the body of a problem after full checks.
    pub(crate) fn problem(&self) -> Value {
        assert_eq!(self.header("content-type"), "application/problem+json", "{}: {}", self.status, self.text());
        let problem = self.json();
        assert_eq!(problem["status"], self.status, "{problem}");
        for member in ["type", "title", "detail", "code"] {
            assert!(problem[member].as_str().is_some_and(|text| !text.is_empty()), "`{member}` of {problem}");
        }
        if let Some(errors) = problem.get("errors") {
            let errors = errors.as_array().expect("`errors` is an array");
            assert!(!errors.is_empty(), "{problem}");
            for error in errors {
                assert!(error["pointer"].is_string(), "{error}");
                for member in ["code", "detail"] {
                    assert!(error[member].as_str().is_some_and(|text| !text.is_empty()), "`{member}` of {error}");
                }
                for member in ["value", "limit"] {
                    assert!(error.get(member).is_none_or(Value::is_number), "`{member}` of {error}");
                }
            }
        }
        problem
    }

    /// Returns the body of a problem with this status and code.
    pub(crate) fn refused(&self, status: u16, code: &str) -> Value {
        let problem = self.problem();
        assert_eq!((self.status, problem["code"].as_str()), (status, Some(code)), "{problem}");
        problem
    }

    /// Returns pointer, code and detail of the only field at fault.
    pub(crate) fn faulty_field(&self) -> (String, String, String) {
        let problem = self.refused(422, "invalid_document");
        let [error] = problem["errors"].as_array().unwrap().as_slice() else { panic!("not one fault: {problem}") };
        let text = |member: &str| error[member].as_str().unwrap().to_owned();
        (text("pointer"), text("code"), text("detail"))
    }
}

fn cache_status(header: &str) -> Vec<&str> {
    let parameters: Vec<_> = header.split(';').map(str::trim).skip(1).collect();
    assert!(!parameters.is_empty(), "`{header}` says nothing of the cache");
    parameters
}

/// A running service that ends with the test.
#[derive(Debug, Clone)]
pub(crate) struct Service(Arc<Process>);

impl Service {
    pub(crate) fn new() -> Self {
        Self::within(LIMITS)
    }

    pub(crate) fn within(limits: Limits) -> Self {
        Self::with(limits, &[])
    }

    pub(crate) fn for_origins(origins: &[&str]) -> Self {
        let flags: Vec<_> = origins.iter().flat_map(|origin| ["--cors-origin", origin]).collect();
        Self::with(LIMITS, &flags)
    }

    /// Starts a service within these limits, with further arguments.
    pub(crate) fn with(limits: Limits, arguments: &[&str]) -> Self {
        let limits = limits.arguments();
        let limits = limits.iter().map(String::as_str);
        let all: Vec<_> = ["serve"].into_iter().chain(limits).chain(arguments.iter().copied()).collect();
        Self(Arc::new(Process::started(&all)))
    }

    pub(crate) fn process(&self) -> &Process {
        &self.0
    }

    /// Returns the process after the last use of the service.
    pub(crate) fn into_process(self) -> Process {
        Arc::try_unwrap(self.0).unwrap()
    }

    pub(crate) fn address(&self) -> SocketAddr {
        self.0.address
    }

    pub(crate) async fn ask(&self, question: &Question) -> Answer {
        let (address, question) = (self.address(), question.clone());
        tokio::task::spawn_blocking(move || ask_at(address, &question)).await.unwrap()
    }

    /// Posts a design document.
    pub(crate) async fn post(&self, path: &str, document: &Value) -> Answer {
        self.ask(&Question::post(path, document.to_string())).await
    }

    /// Posts a text as a design document.
    pub(crate) async fn post_text(&self, path: &str, text: impl Into<Vec<u8>>) -> Answer {
        self.ask(&Question::post(path, text)).await
    }

    pub(crate) async fn get(&self, path: &str) -> Answer {
        self.ask(&Question::of("GET", path)).await
    }

    /// Returns the value of a metric series.
    pub(crate) fn metric(&self, series: &str) -> f64 {
        let metrics = ask_at(self.address(), &Question::of("GET", "/metrics"));
        let line = metrics.text().lines().find(|line| line.starts_with(&format!("{series} ")));
        let line = line.unwrap_or_else(|| panic!("no {series} in {}", metrics.text()));
        line.rsplit_once(' ').unwrap().1.parse().unwrap()
    }

    /// Reads a metric series until it has this value. Fails after too many tries.
    pub(crate) fn until(&self, series: &str, value: f64) {
        assert!((0..100_000).any(|_| self.metric(series) == value), "{series} never is {value}");
    }

    /// Sends a request without waiting for its answer.
    pub(crate) fn send(&self, question: &Question) -> TcpStream {
        let mut stream = TcpStream::connect(self.address()).unwrap();
        stream.write_all(&question.wire()).unwrap();
        stream
    }

    /// Occupies permits with computations that run until their clients leave.
    pub(crate) fn occupied_by(&self, computations: u16) -> Vec<TcpStream> {
        let before = self.metric("toothwave_solves_running");
        let streams = (0..computations).map(|number| self.send(&endless(number))).collect();
        self.until("toothwave_solves_running", before + f64::from(computations));
        streams
    }
}

/// Limits under which [`endless`] computes for minutes.
pub(crate) const ENDLESS: Limits = Limits { max_states: 100_000_000, max_unread_bytes: 1 << 40, ..LIMITS };

/// Returns a request for a sweep that runs for minutes. Each number gives another sweep.
pub(crate) fn endless(number: u16) -> Question {
    let document = with(&shortest(), "/sweep", json!({ "samples": 10_000_000 - u64::from(number) }));
    Question::post("/v1/sweep", document.to_string())
}

/// Asks the listener at `address` and blocks this thread for the answer.
pub(crate) fn ask_at(address: SocketAddr, question: &Question) -> Answer {
    // Longer than any answer takes, so that a hanging service fails the test.
    const PATIENCE: Duration = Duration::from_secs(300);
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(&question.wire()).unwrap();
    answer_on(stream)
}

/// Reads the answer from a connection until it is closed.
pub(crate) fn answer_on(mut stream: TcpStream) -> Answer {
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let end = bytes.windows(4).position(|window| window == b"\r\n\r\n").expect("the head of an answer");
    let head = std::str::from_utf8(&bytes[..end]).unwrap();
    let mut lines = head.split("\r\n");
    let status = lines.next().and_then(|line| line.split(' ').nth(1)).unwrap().parse().unwrap();
    let headers: HeaderMap = lines
        .map(|line| {
            let (name, value) = line.split_once(':').unwrap();
            (name.parse::<HeaderName>().unwrap(), value.trim().parse::<HeaderValue>().unwrap())
        })
        .collect();
    let body = bytes[end + 4..].to_vec();
    let body = if headers.get("transfer-encoding").is_some() { unchunked(&body) } else { body };
    let announced = headers.get("content-length").map(|length| length.to_str().unwrap().parse::<usize>().unwrap());
    // A response to HEAD states a length but has no body.
    assert!(body.is_empty() || announced.is_none_or(|length| length == body.len()), "the whole body has arrived");
    Answer { status, headers, body }
}

/// Decodes a chunked body (RFC 9112, section 7.1).
fn unchunked(mut chunks: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    loop {
        let end = chunks.windows(2).position(|window| window == b"\r\n").expect("the length of a chunk");
        let length = usize::from_str_radix(std::str::from_utf8(&chunks[..end]).unwrap(), 16).unwrap();
        if length == 0 {
            return body;
        }
        body.extend_from_slice(&chunks[end + 2..end + 2 + length]);
        chunks = &chunks[end + 4 + length..];
    }
}
