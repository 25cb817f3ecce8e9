//! Bearer keys. The service stores only their hashes.
//!
//! Each line of a keys file has the BLAKE3 hash of a key in hexadecimal, then a name. Empty lines and lines with `#`
//! are skipped. `toothwave new-key` makes long random keys, so a fast hash is safe.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use parking_lot::RwLock;

use crate::http::problem::{Problem, ProblemCode};

/// Random bytes of a new key.
const KEY_BYTES: usize = 32;

/// The accepted keys. Clones share them.
#[derive(Debug, Clone)]
pub struct Keys {
    path: PathBuf,
    known: Arc<RwLock<Vec<Known>>>,
}

/// A line of the keys file.
#[derive(Debug, Clone)]
struct Known {
    hash: blake3::Hash,
    name: String,
}

impl Keys {
    /// Reads a keys file.
    pub fn read(path: &str) -> Result<Self, String> {
        Ok(Self { path: path.into(), known: Arc::new(RwLock::new(known_in(path.as_ref())?)) })
    }

    /// Reloads the keys file. If it is invalid, the keys stay the same, and the log has the reason.
    pub fn reload(&self) {
        match known_in(&self.path) {
            Ok(known) => {
                tracing::info!(keys = known.len(), "reloaded the keys file");
                *self.known.write() = known;
            }
            Err(error) => {
                tracing::error!(path = %self.path.display(), error, "cannot reload the keys file: the keys stay the same")
            }
        }
    }

    /// Returns the name of a known key. Compares all hashes, each in constant time.
    fn name_of(&self, key: &str) -> Option<String> {
        let hash = blake3::hash(key.as_bytes());
        let known = self.known.read();
        let found = known.iter().fold(None, |found, known| if known.hash == hash { Some(known) } else { found });
        found.map(|known| known.name.clone())
    }
}

fn known_in(file: &Path) -> Result<Vec<Known>, String> {
    let text = fs::read_to_string(file).map_err(|error| error.to_string())?;
    let mut keys = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let (hash, name) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let hash = blake3::Hash::from_hex(hash)
            .map_err(|_| format!("line {number} does not begin with a hash of 64 hexadecimal digits. Make a line by `toothwave new-key NAME`"))?;
        keys.push(Known { hash, name: name.trim().into() });
    }
    if keys.is_empty() {
        Err("the keys file has no key. Make one by `toothwave new-key NAME`".into())
    } else {
        Ok(keys)
    }
}

/// Makes a new key, and its line for a keys file.
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

/// True if a path needs a key. Health probes have no key, and the page must ask for one.
fn needs_key(path: &str) -> bool {
    !(matches!(path, "/health/live" | "/health/ready" | "/") || path.starts_with("/page/"))
}

/// The middleware that requires a key on every path except health and page.
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
        None => "the request has no key. Send the header `Authorization: Bearer KEY`",
    };
    let mut response = Problem::new(ProblemCode::Unauthorized, detail).into_response();
    response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    response
}
