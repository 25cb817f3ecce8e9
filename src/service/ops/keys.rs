//! Bearer keys, of which the service knows only hashes.
//!
//! A keys file has one line for each key: the BLAKE3 hash of the key in hexadecimal, then a name. Lines that begin with `#` and empty
//! ones are skipped. Keys are random and long (`toothwave new-key`), so that a fast hash cannot be searched.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use parking_lot::RwLock;

use crate::http::problem::{Problem, ProblemCode};

/// Random bytes of a new key.
const KEY_BYTES: usize = 32;

/// The keys that open the service; clones share them.
#[derive(Debug, Clone)]
pub struct Keys {
    path: PathBuf,
    known: Arc<RwLock<Vec<Known>>>,
}

/// A line of the file.
#[derive(Debug, Clone)]
struct Known {
    hash: blake3::Hash,
    name: String,
}

impl Keys {
    /// Reads a keys file.
    pub fn read(path: &str) -> Result<Self, String> {
        let text = fs::read_to_string(path).map_err(|error| error.to_string())?;
        Ok(Self { path: path.into(), known: Arc::new(RwLock::new(parse(&text)?)) })
    }

    /// Reads the file again. If it is wrong, the keys stay as they were, and the log says so.
    pub fn reload(&self) {
        let read = fs::read_to_string(&self.path).map_err(|error| error.to_string()).and_then(|text| parse(&text));
        match read {
            Ok(known) => {
                tracing::info!(keys = known.len(), "read the keys file again");
                *self.known.write() = known;
            }
            Err(error) => tracing::error!(path = %self.path.display(), error, "the keys stay as they were"),
        }
    }

    /// The name of a key that is one of them. Every hash is compared, each in constant time.
    fn name_of(&self, key: &str) -> Option<String> {
        let hash = blake3::hash(key.as_bytes());
        let known = self.known.read();
        let found = known.iter().fold(None, |found, known| if known.hash == hash { Some(known) } else { found });
        found.map(|known| known.name.clone())
    }
}

fn parse(text: &str) -> Result<Vec<Known>, String> {
    let mut keys = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let (hash, name) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let hash = blake3::Hash::from_hex(hash)
            .map_err(|_| format!("line {number} does not begin with a hash of 64 hexadecimal digits"))?;
        keys.push(Known { hash, name: name.trim().into() });
    }
    if keys.is_empty() { Err("the file has no key. Add one by `toothwave new-key NAME`".into()) } else { Ok(keys) }
}

/// A new key, and its line of a keys file.
pub fn new_key(name: &str) -> Result<(String, String), getrandom::Error> {
    let mut bytes = [0; KEY_BYTES];
    getrandom::fill(&mut bytes)?;
    let key = bytes.iter().fold(String::from("tw_"), |mut key, byte| {
        // Writing to a string does not fail.
        let _ = write!(key, "{byte:02x}");
        key
    });
    let line = format!("{} {name}", blake3::hash(key.as_bytes()).to_hex());
    Ok((key, line))
}

/// Whether a path needs a key. Health probes have none, and the page, which holds nothing secret, has to ask for one.
fn needs_key(path: &str) -> bool {
    !(matches!(path, "/health/live" | "/health/ready" | "/") || path.starts_with("/page/"))
}

/// The middleware: every path but health and the page needs a key.
pub async fn require(State(keys): State<Keys>, request: Request, next: Next) -> Response {
    if !needs_key(request.uri().path()) {
        return next.run(request).await;
    }
    let given = request.headers().get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
    let key = given.and_then(|value| {
        let (scheme, key) = value.split_once(' ')?;
        scheme.eq_ignore_ascii_case("bearer").then(|| key.trim())
    });
    if let Some(name) = key.and_then(|key| keys.name_of(key)) {
        tracing::Span::current().record("key", name);
        return next.run(request).await;
    }
    let detail = match key {
        Some(_) => "the key is unknown. Ask the operator for one",
        None => "the request has no key. Send one as `Authorization: Bearer KEY`",
    };
    let mut response = Problem::new(ProblemCode::Unauthorized, detail).into_response();
    response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    response
}
