//! Ways to ask the service: its router alone, or over a real connection.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::mpsc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Request};
use axum::response::Response;
use serde_json::Value;
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio::task::JoinHandle;
use toothwave::app::App;
use toothwave::compute::{Pool, Thread};
use toothwave::config::Limits;
use toothwave::keys::Keys;
use toothwave::router::{Entry, router};
use toothwave::studies::Keeping;
use tower::ServiceExt as _;

/// Every path that a design document can be sent to.
pub(crate) const ENDPOINTS: [&str; 4] =
    ["/v1/geometry", "/v1/coincidence-degree", "/v1/sweep", "/v1/drawings/assembly"];

/// Limits that no test meets by accident; above all no test races the deadline.
pub(crate) const LIMITS: Limits = Limits {
    max_states: 1_000_000,
    max_profile_points: 1_000_000,
    max_body_bytes: 65_536,
    max_concurrent_solves: 2,
    max_queued_solves: 32,
    deadline_ms: 600_000,
    cache_max_bytes: 268_435_456,
    max_unread_bytes: 268_435_456,
    max_connections: 64,
    max_header_bytes: 16_384,
    max_concurrent_batches: 4,
    max_study_variants: 1_000_000,
    max_study_bytes: 67_108_864,
    max_concurrent_studies: 4,
    study_deadline_ms: 600_000,
    header_timeout_ms: 600_000,
};

/// What is asked.
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

    /// A POST of these bytes as JSON.
    pub(crate) fn post(path: &str, body: impl Into<Vec<u8>>) -> Self {
        Self::post_as("application/json", path, body)
    }

    /// A POST of these bytes as whatever they are.
    pub(crate) fn post_as(content_type: &str, path: &str, body: impl Into<Vec<u8>>) -> Self {
        let question = Self { body: body.into(), ..Self::of("POST", path) };
        question.with("content-type", content_type)
    }

    pub(crate) fn with(mut self, name: &str, value: &str) -> Self {
        self.headers.push((name.into(), value.into()));
        self
    }

    pub(crate) fn request(&self) -> Request<Body> {
        let mut request = Request::builder().method(self.method).uri(&self.path);
        for (name, value) in &self.headers {
            request = request.header(name, value);
        }
        request.body(Body::from(self.body.clone())).unwrap()
    }

    fn wire(&self) -> Vec<u8> {
        let mut head = format!("{} {} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n", self.method, self.path);
        for (name, value) in &self.headers {
            head += &format!("{name}: {value}\r\n");
        }
        head += &format!("content-length: {}\r\n\r\n", self.body.len());
        [head.as_bytes(), &self.body].concat()
    }
}

/// What is answered.
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

    /// The header's value, empty where there is none.
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

    /// Whether this very request was solved for.
    pub(crate) fn is_miss(&self) -> bool {
        cache_status(self.header("cache-status")).contains(&"fwd=miss") && !self.is_collapsed()
    }

    /// The body of a success in JSON.
    pub(crate) fn found(&self) -> Value {
        assert_eq!(self.status, 200, "{}", self.text());
        assert_eq!(self.header("content-type"), "application/json");
        self.json()
    }

    /// The body of a problem, which is one in every respect.
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

    /// The body of a problem of this kind.
    pub(crate) fn refused(&self, status: u16, code: &str) -> Value {
        let problem = self.problem();
        assert_eq!((self.status, problem["code"].as_str()), (status, Some(code)), "{problem}");
        problem
    }

    /// The one field at fault in a document that is no design document.
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

/// The service without a connection before it.
#[derive(Debug, Clone)]
pub(crate) struct Service {
    pub(crate) app: Arc<App>,
    router: Router,
}

impl Service {
    pub(crate) fn new() -> Self {
        Self::within(LIMITS)
    }

    pub(crate) fn within(limits: Limits) -> Self {
        Self::within_for_origins(limits, &[])
    }

    pub(crate) fn for_origins(origins: &[&str]) -> Self {
        Self::within_for_origins(LIMITS, origins)
    }

    pub(crate) fn within_for_origins(limits: Limits, origins: &[&str]) -> Self {
        let app = App::new(limits);
        let origins: Vec<_> = origins.iter().map(|&origin| origin.into()).collect();
        let entry = Entry { cors_origins: origins, ..Entry::default() };
        Self { router: router(Arc::clone(&app), &entry), app }
    }

    /// With its studies kept somewhere.
    pub(crate) fn keeping(limits: Limits, keeping: Keeping) -> Self {
        let app = App::keeping(Pool::new(limits), limits, keeping);
        Self { router: router(Arc::clone(&app), &Entry::default()), app }
    }

    /// Behind a keys file of this text.
    pub(crate) fn behind(keys: &str) -> Self {
        let app = App::new(LIMITS);
        let entry = Entry { keys: Some(Keys::parse(keys).unwrap()), ..Entry::default() };
        Self { router: router(Arc::clone(&app), &entry), app }
    }

    pub(crate) async fn ask(&self, question: &Question) -> Answer {
        self.send(question.request()).await
    }

    /// The answer with its body still to come.
    pub(crate) async fn response(&self, request: Request<Body>) -> Response {
        self.router.clone().oneshot(request).await.unwrap()
    }

    pub(crate) async fn send(&self, request: Request<Body>) -> Answer {
        let response = self.response(request).await;
        let (parts, body) = response.into_parts();
        let body = axum::body::to_bytes(body, usize::MAX).await.unwrap().to_vec();
        Answer { status: parts.status.as_u16(), headers: parts.headers, body }
    }

    /// Sends a design document.
    pub(crate) async fn post(&self, path: &str, document: &Value) -> Answer {
        self.ask(&Question::post(path, document.to_string())).await
    }

    /// Sends a text as if it were a design document.
    pub(crate) async fn post_text(&self, path: &str, text: impl Into<Vec<u8>>) -> Answer {
        self.ask(&Question::post(path, text)).await
    }

    pub(crate) async fn get(&self, path: &str) -> Answer {
        self.ask(&Question::of("GET", path)).await
    }
}

/// The service behind a real socket, on threads of its own.
#[derive(Debug)]
pub(crate) struct Listening {
    pub(crate) app: Arc<App>,
    pub(crate) address: SocketAddr,
    runtime: Option<Runtime>,
}

impl Listening {
    pub(crate) fn within(limits: Limits) -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(4).enable_all().build().unwrap();
        let app = App::new(limits);
        let router = router(Arc::clone(&app), &Entry::default());
        let listener = runtime.block_on(TcpListener::bind(("127.0.0.1", 0))).unwrap();
        let address = listener.local_addr().unwrap();
        runtime.spawn(async move { axum::serve(listener, router).await });
        Self { app, address, runtime: Some(runtime) }
    }

    /// Runs what has to run where the service does.
    pub(crate) fn run<T>(&self, future: impl Future<Output = T>) -> T {
        self.runtime.as_ref().unwrap().block_on(future)
    }
}

impl Drop for Listening {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

/// Asks whatever listens at `address`; this thread waits for the answer.
pub(crate) fn ask_at(address: SocketAddr, question: &Question) -> Answer {
    // Far beyond any answer: so that a service that hangs fails the test instead of hanging it too.
    const PATIENCE: Duration = Duration::from_secs(300);
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(&question.wire()).unwrap();
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
    let announced = headers.get("content-length").map(|length| length.to_str().unwrap().parse::<usize>().unwrap());
    assert_eq!(announced.unwrap_or(body.len()), body.len(), "the whole body has arrived");
    Answer { status, headers, body }
}

/// Lets other tasks and threads go on until something is true of them; fails when that takes forever.
pub(crate) async fn until(what: &str, is_true: impl Fn() -> bool) {
    for _ in 0..20_000_000 {
        if is_true() {
            return;
        }
        tokio::task::yield_now().await;
        std::thread::yield_now();
    }
    panic!("it never came true that {what}");
}

/// A solve that occupies a pool until it is told to end, or dropped.
#[derive(Debug)]
pub(crate) struct Occupied {
    release: mpsc::Sender<()>,
    solve: JoinHandle<Result<(), toothwave::problem::Problem>>,
}

impl Occupied {
    pub(crate) async fn by_one(pool: &Pool) -> Self {
        let (release, released) = mpsc::channel();
        let before = pool.running();
        let own = pool.clone();
        let solve = tokio::spawn(async move {
            own.run(own.deadline(), Thread::Blocking, move |_| {
                // Dropped or told so: both mean that it is over.
                let _ = released.recv();
                Ok(())
            })
            .await
        });
        until("the pool is occupied", || pool.running() == before + 1).await;
        Self { release, solve }
    }

    pub(crate) async fn end(self) {
        self.release.send(()).unwrap();
        self.solve.await.unwrap().unwrap();
    }
}
