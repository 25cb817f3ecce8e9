//! Who may come in: bearer keys, of which the service knows only hashes.
//!
//! A keys file has a line a key: the BLAKE3 hash of the key in hexadecimal, then a name for people. Lines that begin with `#` and
//! empty ones are passed over. Keys are random and long (`toothwave new-key`), so that a fast hash cannot be searched.

use std::fmt::Write as _;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::problem::{Problem, ProblemCode};

/// Random bytes of a new key.
const KEY_BYTES: usize = 32;

/// The hashes of the keys that open the service.
#[derive(Debug, Clone)]
pub struct Keys(Arc<[blake3::Hash]>);

impl Keys {
    /// Reads a keys file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(path: &str) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
        Self::parse(&text)
    }

    /// Reads the text of a keys file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut keys = Vec::new();
        for (number, line) in (1..).zip(text.lines()) {
            let Some(hash) = line.split_whitespace().next().filter(|word| !word.starts_with('#')) else { continue };
            let hash = blake3::Hash::from_hex(hash)
                .map_err(|_| format!("line {number} does not begin with a hash of 64 hexadecimal digits"))?;
            keys.push(hash);
        }
        if keys.is_empty() {
            Err("there is no key in it, so that nobody could come in".into())
        } else {
            Ok(Self(keys.into()))
        }
    }

    /// Whether a key is one of them. Every hash is compared, each in constant time.
    fn open_to(&self, key: &str) -> bool {
        let hash = blake3::hash(key.as_bytes());
        self.0.iter().fold(false, |found, known| found | (*known == hash))
    }
}

/// A new key, and its line of a keys file.
///
/// # Errors
/// Where the system has no random bytes.
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

/// Whether a path wants a key: health is asked by who has none, and the page, which holds nothing secret, has to be there to ask for
/// one.
fn wants_key(path: &str) -> bool {
    !(matches!(path, "/health/live" | "/health/ready" | "/") || path.starts_with("/page/"))
}

/// The middleware: every path but health and the page wants a key.
pub async fn require(State(keys): State<Keys>, request: Request, next: Next) -> Response {
    if !wants_key(request.uri().path()) {
        return next.run(request).await;
    }
    let given = request.headers().get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
    let key = given.and_then(|value| {
        let (scheme, key) = value.split_once(' ')?;
        scheme.eq_ignore_ascii_case("bearer").then(|| key.trim())
    });
    if key.is_some_and(|key| keys.open_to(key)) {
        return next.run(request).await;
    }
    let detail = match key {
        Some(_) => "this key opens nothing here",
        None => "send a key as `Authorization: Bearer …`",
    };
    let mut response = Problem::new(ProblemCode::Unauthorized, detail).into_response();
    response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    response
}
