//! Who may come in: bearer keys, of which the service knows only hashes.
//!
//! A keys file has a line a key: the BLAKE3 hash of the key in hexadecimal, then a name for people. Lines that begin with `#` and
//! empty ones are passed over. Keys are random and long (`toothwave new-key`), so that a fast hash cannot be searched.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Read as _;
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use parking_lot::RwLock;
use rustix::fs::OFlags;
use tokio::sync::Semaphore;

use crate::problem::{Problem, ProblemCode};

/// Of a keys file, which may turn out to be something that never ends: tens of thousands of keys.
const MOST_BYTES: u64 = 4 << 20;

/// Readings of the file at once: each has a thread.
const MOST_READINGS: usize = 4;

/// Random bytes of a new key.
const KEY_BYTES: usize = 32;

/// The keys that open the service, as long as their file is not read anew.
#[derive(Debug, Clone)]
pub struct Keys {
    path: Arc<str>,
    last: Arc<RwLock<Reading>>,
    /// One for each reading that has not come to its end.
    readings: Arc<Semaphore>,
}

/// What a reading of the file found.
#[derive(Debug)]
struct Reading {
    number: u64,
    known: Vec<Known>,
}

/// A line of the file.
#[derive(Debug, Clone)]
struct Known {
    hash: blake3::Hash,
    name: String,
}

impl Keys {
    /// Reads a keys file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(path: &str) -> Result<Self, String> {
        Ok(Self::of(path, known_in(path)?))
    }

    fn of(path: &str, known: Vec<Known>) -> Self {
        let last = Arc::new(RwLock::new(Reading { number: 0, known }));
        Self { path: path.into(), last, readings: Arc::new(Semaphore::new(MOST_READINGS)) }
    }

    /// Begins to read the file again, for the `number`th time, on a thread of its own: it may stand on a device that is away. A reading that does not come to
    /// its end holds up no later one, but for the last of several.
    pub fn reload(&self, number: u64) {
        let Ok(place) = Arc::clone(&self.readings).try_acquire_owned() else {
            tracing::error!(
                readings = MOST_READINGS,
                "the keys stay as they were: earlier readings have not come to their end"
            );
            return;
        };
        let keys = self.clone();
        let reading = move || {
            let _held = place;
            keys.read_again(number);
        };
        tracing::info!(path = %self.path, "reading the keys file again");
        if let Err(error) = std::thread::Builder::new().name("keys".into()).spawn(reading) {
            tracing::error!(%error, "the keys stay as they were");
        }
    }

    /// A file that is wrong leaves the keys as they were, and the log says so.
    fn read_again(&self, number: u64) {
        match known_in(&self.path) {
            Ok(known) => {
                let mut last = self.last.write();
                // One that was begun later may have come to its end earlier.
                if number > last.number {
                    tracing::info!(keys = known.len(), "the keys file was read again");
                    *last = Reading { number, known };
                }
            }
            Err(error) => tracing::error!(path = %self.path, error, "the keys stay as they were"),
        }
        self.warn_of_readers();
    }

    /// Whoever reads the file learns the names, and which hash to look for.
    pub fn warn_of_readers(&self) {
        let mode = std::fs::metadata(&*self.path).map_or(0, |file| file.permissions().mode());
        if mode & 0o004 != 0 {
            tracing::warn!(path = %self.path, mode = format!("{:o}", mode & 0o777), "anyone on this machine may read the keys file");
        }
    }

    /// Reads the text of a keys file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        Ok(Self::of("", parse(text)?))
    }

    /// The name of a key that is one of them. Every hash is compared, each in constant time.
    fn name_of(&self, key: &str) -> Option<String> {
        let hash = blake3::hash(key.as_bytes());
        let last = self.last.read();
        let found = last.known.iter().fold(None, |found, known| if known.hash == hash { Some(known) } else { found });
        found.map(|known| known.name.clone())
    }
}

fn known_in(path: &str) -> Result<Vec<Known>, String> {
    let mut text = String::new();
    // Else to open a pipe would wait for who writes to it.
    let file = File::options().read(true).custom_flags(OFlags::NONBLOCK.bits().cast_signed()).open(path);
    let file = file.map_err(|error| error.to_string())?;
    if !file.metadata().map_err(|error| error.to_string())?.is_file() {
        return Err("a keys file is a regular file, so that it can be read again".into());
    }
    file.take(MOST_BYTES + 1).read_to_string(&mut text).map_err(|error| error.to_string())?;
    if text.len() as u64 > MOST_BYTES {
        return Err(format!("a keys file has at most {MOST_BYTES} bytes"));
    }
    parse(&text)
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
    if keys.is_empty() { Err("there is no key in it, so that nobody could come in".into()) } else { Ok(keys) }
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
    if let Some(name) = key.and_then(|key| keys.name_of(key)) {
        tracing::Span::current().record("key", name);
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
