//! The endpoints: one file each, with its handler and what the API document says of it. What they share, the walk of a request from
//! document to bytes, stands here.

use std::cell::Cell;
use std::io::{self, Write};
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::Request;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::{Bytes, BytesMut};
use flate2::Compression;
use flate2::write::GzEncoder;
use futures_util::StreamExt as _;
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::{Format, Forms};
use toothwave_calculation::key::Key;
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::question::{Question, Stop, with_room};
use utoipa::IntoResponses;

use crate::app::App;
use crate::cache::{Cache, Provenance, Served, Spelling, Stored, etag, in_own_pages};
use crate::compute::Thread;
use crate::memory::Memory;
use crate::negotiation::{self, Representation};
use crate::problem::{Problem, ProblemCode};
use crate::query::require_no_query;
use crate::room::{NoRoom, Reserved, Room, SMALL_BYTES, Sent};

pub mod accuracy;
pub mod batch;
pub mod coincidence_degree;
pub mod design;
pub mod drawings;
pub mod geometry;
pub mod page;
pub mod side;
pub mod studies;
pub mod sweep;

/// The statuses that every solving endpoint can answer with beside 200 and 304.
#[derive(IntoResponses)]
pub enum Problems {
    /// The body is no JSON.
    #[response(status = 400, content_type = "application/problem+json")]
    Malformed(#[to_schema] Problem),
    /// No representation that the client accepts.
    #[response(status = 406, content_type = "application/problem+json")]
    NotAcceptable(#[to_schema] Problem),
    /// The body did not arrive in time.
    #[response(status = 408, content_type = "application/problem+json")]
    RequestTimeout(#[to_schema] Problem),
    /// The body exceeds `max_body_bytes`.
    #[response(status = 413, content_type = "application/problem+json")]
    BodyTooLarge(#[to_schema] Problem),
    /// The body is not sent as plain JSON.
    #[response(status = 415, content_type = "application/problem+json")]
    UnsupportedMediaType(#[to_schema] Problem),
    /// JSON that is no design document, or describes no possible drive, load or request.
    #[response(status = 422, content_type = "application/problem+json")]
    Unprocessable(#[to_schema] Problem),
    /// A fault of the service itself.
    #[response(status = 500, content_type = "application/problem+json")]
    Internal(#[to_schema] Problem),
    /// The service is full, or the deadline stopped the computation; `Retry-After` says when to try again.
    #[response(status = 503, content_type = "application/problem+json", headers(("Retry-After" = u32, description = "Seconds")))]
    Unavailable(#[to_schema] Problem),
}

/// The walk of a request: document → key → cache → checked parameters → answer → bytes.
pub async fn respond<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Response {
    match walk(question, app, request).await {
        Ok(response) => response,
        Err(problem) => problem.into_response(),
    }
}

async fn walk<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Result<Response, Problem> {
    let Asked { headers, body, representation, deadline } = Asked::read::<Q>(&app, request).await?;
    let spelling = Spelling::new(question.name(), representation, &body);
    let known = app.cache.key(spelling).and_then(|key| app.cache.get(key).map(|stored| (key, stored)));
    let (key, stored, served) = match known {
        Some((key, stored)) => {
            drop(body);
            log_design(key);
            (key, stored, Served::Hit)
        }
        None => {
            let keyed = move |design: &Design| {
                let key = question.key(design, &representation);
                (question, key)
            };
            let (design, (question, key)) = read_design(&app, deadline, body, keyed).await?;
            log_design(key);
            let (stored, served) = match app.cache.get(key) {
                // What is kept was checked when it was solved.
                Some(stored) => (stored, Served::Hit),
                None => {
                    let checked = Arc::new(question.check(&design, &app.limits.of_calculation())?);
                    let solving = Arc::clone(&app);
                    let thread = match representation {
                        Representation::JSON if Q::is_short(&checked) => Thread::Executor,
                        _ => Thread::Blocking,
                    };
                    let solve = async move {
                        let run = |reserved| {
                            let (checked, room, cache) =
                                (Arc::clone(&checked), solving.room.clone(), solving.cache.clone());
                            let job = move |stop: &AtomicBool| {
                                try_to_solve::<Q>(&checked, representation, &room, reserved, Some(&cache), stop)
                            };
                            solving.pool.run_while_wanted(thread, job)
                        };
                        in_room(&solving, deadline, run).await
                    };
                    let solved = app.cache.solve_once(key, tokio::time::sleep_until(deadline), solve).await?;
                    solved.ok_or_else(|| app.pool.deadline_exceeded())?
                }
            };
            app.cache.remember(spelling, key);
            (key, stored, served)
        }
    };
    let etag = etag(key);
    let provenance = Provenance { served, solve: stored.solve };
    if negotiation::is_not_modified(&headers, &etag) {
        return Ok(caching(StatusCode::NOT_MODIFIED.into_response(), provenance, &etag));
    }
    Ok(caching(with_body(&app, deadline, stored, representation).await?, provenance, &etag))
}

/// The design's hash, for the request's log line.
fn log_design(key: Key) {
    tracing::Span::current().record("design", tracing::field::display(key));
}

/// A request as far as all endpoints read it alike.
struct Asked {
    headers: HeaderMap,
    body: Read,
    representation: Representation,
    deadline: tokio::time::Instant,
}

impl Asked {
    async fn read<Q: Question>(app: &App, request: Request) -> Result<Self, Problem> {
        let deadline = app.pool.deadline();
        let (Parts { headers, uri, .. }, body) = request.into_parts();
        require_no_query(&uri)?;
        negotiation::require_json(&headers)?;
        let representation = Representation::negotiate(&headers, Q::Answer::FORMS.iter().map(|(format, _)| *format))?;
        let body = read_body(app, &headers, body, deadline).await?;
        Ok(Self { headers, body, representation, deadline })
    }
}

/// The same walk for an answer that is measured there and then: never cached.
async fn respond_afresh<Q: Question>(question: Q, app: Arc<App>, request: Request) -> Response {
    let walk = async {
        let Asked { body, representation, deadline, .. } = Asked::read::<Q>(&app, request).await?;
        let (design, ()) = read_design(&app, deadline, body, |_| ()).await?;
        let checked = Arc::new(question.check(&design, &app.limits.of_calculation())?);
        let run = |reserved| {
            let (checked, room) = (Arc::clone(&checked), app.room.clone());
            let job = move |stop: &AtomicBool| try_to_solve::<Q>(&checked, representation, &room, reserved, None, stop);
            app.pool.run(deadline, Thread::Blocking, job)
        };
        with_body(&app, deadline, in_room(&app, deadline, run).await?, representation).await
    };
    let mut response = walk.await.unwrap_or_else(IntoResponse::into_response);
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

/// Documents that take longer than some tenths of a millisecond to be read: two hundred clients with 60 KB of deviations, at 3 ms each, had health wait for up to 3 s.
const LONG_TEXT_BYTES: u64 = 1 << 13;

/// A body that was read, with the room that it takes.
struct Read {
    bytes: Bytes,
    room: Reserved,
}

/// Of the tree that a design is read into, which takes up to so many times its length; of what is short nothing is counted.
const fn tree_bytes(document: &[u8]) -> u64 {
    /// Measured with lists of numbers, texts and objects, each as short as can be.
    const TIMES: u64 = 64;
    if 2 * document.len() as u64 > SMALL_BYTES { TIMES * document.len() as u64 } else { 0 }
}

impl Deref for Read {
    type Target = Bytes;

    fn deref(&self) -> &Bytes {
        &self.bytes
    }
}

/// The design of a body, and what is told of it. One that is long is read on a thread apart: it would keep the executor from all others.
async fn read_design<T: Send + 'static>(
    app: &App,
    deadline: tokio::time::Instant,
    mut body: Read,
    tell: impl FnOnce(&Design) -> T + Send + 'static,
) -> Result<(Design, T), Problem> {
    let (text_bytes, tree_bytes) = (body.len() as u64, tree_bytes(&body));
    body.room.hold_at_least(tree_bytes)?;
    let read = move || {
        let design = Design::read(&body)?;
        // The answer may want all the room.
        drop(body);
        let told = tell(&design);
        Ok((design, told))
    };
    if text_bytes < LONG_TEXT_BYTES { read() } else { app.pool.run_aside(deadline, text_bytes, read).await }
}

async fn read_body(
    app: &App,
    headers: &HeaderMap,
    body: Body,
    deadline: tokio::time::Instant,
) -> Result<Read, Problem> {
    let limit = app.limits.max_body_bytes;
    let too_large = |length: &str| {
        let detail = format!("the body has {length}more than the {limit} bytes of `max_body_bytes`");
        Problem::new(ProblemCode::BodyTooLarge, detail)
    };
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if let Some(length) = announced.filter(|&length| length > limit as u64) {
        return Err(too_large(&format!("{length} bytes, ")));
    }
    let mut pieces = body.into_data_stream();
    // One piece of its own, and those that arrive are let go: they may be of a byte each, and hold the whole buffer that they were read into.
    let (mut whole, mut room) = (BytesMut::new(), app.room.nothing());
    let reading = async {
        while let Some(piece) = pieces.next().await {
            let piece = piece.map_err(|error| broken_body(&error))?;
            if piece.len() > limit - whole.len() {
                return Err(too_large(""));
            }
            // It grows by doubling.
            room.hold_at_least(2 * (whole.len() + piece.len()) as u64)?;
            whole.extend_from_slice(&piece);
        }
        Ok(())
    };
    let in_time = async {
        tokio::time::timeout_at(deadline, reading).await.unwrap_or_else(|_| {
            let detail = format!("the body did not arrive within {} ms", app.limits.deadline_ms);
            Err(Problem::new(ProblemCode::RequestTimeout, detail))
        })
    };
    app.pool.until_closed(in_time).await?;
    Ok(Read { bytes: whole.freeze(), room })
}

/// The problem of a body that does not end as it should.
fn broken_body(error: &axum::Error) -> Problem {
    Problem::new(ProblemCode::BrokenBody, format!("the body cannot be read to its end: {error}"))
}

/// What an answer takes before it is made.
struct Expected {
    columns_bytes: u64,
    text_bytes: u64,
    /// While it is computed.
    working_bytes: u64,
}

impl Expected {
    fn of<Q: Question>(checked: &Q::Checked, Representation { format, gzip }: Representation) -> Self {
        let columns_bytes = Q::columns_bytes(checked);
        // A number has 8 bytes, and its text 20 about.
        let text_bytes = match is_long(format) {
            true if gzip => columns_bytes,
            true => columns_bytes * 5 / 2,
            false => 0,
        };
        Self { columns_bytes, text_bytes, working_bytes: Q::working_bytes(checked) }
    }

    const fn bytes(&self) -> u64 {
        self.columns_bytes + self.text_bytes + self.working_bytes
    }
}

/// What comes of a solve that wants room.
enum Tried {
    Solved(Stored),
    /// There is not so much in this moment, or others wait for less.
    WantsRoom(u64),
}

/// What comes of a solve in the room that there is when it begins, or in some that it waits for: no permit is held meanwhile.
async fn in_room<F: Future<Output = Result<Tried, Problem>>>(
    app: &App,
    deadline: tokio::time::Instant,
    run: impl Fn(Option<Reserved>) -> F,
) -> Result<Stored, Problem> {
    let mut reserved = None;
    loop {
        match run(reserved.take()).await? {
            Tried::Solved(stored) => return Ok(stored),
            Tried::WantsRoom(bytes) => {
                let waited = async { Ok(app.room.reserve_in_time(deadline, bytes).await?) };
                reserved = Some(app.pool.until_closed(waited).await?);
            }
        }
    }
}

/// Solves in room that was waited for, or that there is.
fn try_to_solve<Q: Question>(
    checked: &Q::Checked,
    representation: Representation,
    room: &Room,
    reserved: Option<Reserved>,
    cache: Option<&Cache>,
    stop: &AtomicBool,
) -> Result<Tried, Problem> {
    let expected = Expected::of::<Q>(checked, representation);
    let bytes = expected.bytes();
    match reserved.map_or_else(|| room.reserve_now(bytes), |reserved| Ok(Some(reserved)))? {
        Some(reserved) => solve::<Q>(checked, representation, &expected, reserved, cache, stop).map(Tried::Solved),
        None => Ok(Tried::WantsRoom(bytes)),
    }
}

/// Solves and writes the final bytes.
fn solve<Q: Question>(
    checked: &Q::Checked,
    representation: Representation,
    expected: &Expected,
    reserved: Reserved,
    cache: Option<&Cache>,
    stop: &AtomicBool,
) -> Result<Stored, Problem> {
    #[cfg(feature = "fault-injection")]
    fail::fail_point!("solve");
    let started = Instant::now();
    let (answer, mut reserved) = answered::<Q>(checked, reserved, stop)?;
    let Expected { columns_bytes, text_bytes, .. } = *expected;
    reserved.hold_at_most((columns_bytes + text_bytes).max(answer.held_bytes(representation.format)));
    written(answer, representation, reserved, columns_bytes, started.elapsed(), cache, stop)
}

/// An answer, in room for it and beside it for its text, which grows with it.
fn answered<Q: Question>(
    checked: &Q::Checked,
    mut reserved: Reserved,
    stop: &AtomicBool,
) -> Result<(Q::Answer, Reserved), Problem> {
    let taking = Taking::new(stop, &reserved);
    let take = |input_angles| reserved.hold_at_least(Q::searched_bytes(checked, input_angles));
    let answer = with_room(&taking, take, |stop| Q::answer(checked, stop))?;
    if taking.is_scarce.get() { Err(NoRoom::Scarce.into()) } else { Ok((answer?, reserved)) }
}

/// What stops a solve and the writing of its answer: nobody waits for them any more, or they take room where memory has become scarce.
struct Taking<'a> {
    stop: &'a AtomicBool,
    memory: Option<Memory>,
    is_scarce: Cell<bool>,
}

impl<'a> Taking<'a> {
    fn new(stop: &'a AtomicBool, reserved: &Reserved) -> Self {
        Self { stop, memory: reserved.memory().cloned(), is_scarce: Cell::new(false) }
    }
}

impl Stop for Taking<'_> {
    fn stopped(&self) -> bool {
        if self.memory.as_ref().is_some_and(Memory::is_scarce) {
            self.is_scarce.set(true);
        }
        self.is_scarce.get() || self.stop.stopped()
    }
}

/// Whether a form is long where the columns are.
const fn is_long(format: Format) -> bool {
    matches!(format, Format::Json | Format::Csv | Format::Arrow | Format::Parquet)
}

/// Writes an answer, which took so long and whose columns take so many bytes, into its final bytes, which the cache may keep.
fn written<A: Forms>(
    answer: A,
    Representation { format, gzip }: Representation,
    reserved: Reserved,
    columns_bytes: u64,
    solve: Duration,
    cache: Option<&Cache>,
    stop: &AtomicBool,
) -> Result<Stored, Problem> {
    let is_long = is_long(format);
    let expected_bytes = if gzip || !is_long { 0 } else { answer.expected_bytes() };
    let held_bytes = columns_bytes.max(answer.held_bytes(format));
    let buffer = Growing::new(reserved, held_bytes, expected_bytes)?;
    let taking = Taking::new(stop, &buffer.reserved);
    let written = if gzip {
        // Before the encoder: of what compresses well little comes out of it for long.
        let mut writer = Stoppable::new(GzEncoder::new(buffer, Compression::fast()), &taking);
        answer.write(format, &mut writer).and_then(|()| writer.inner.finish())
    } else {
        let mut writer = Stoppable::new(buffer, &taking);
        answer.write(format, &mut writer).map(|()| writer.inner)
    };
    drop(answer);
    match written {
        Ok(buffer) => {
            let server_timing = format!("solve;dur={:.3}", 1e3 * solve.as_secs_f64());
            let server_timing = HeaderValue::try_from(server_timing).map_err(|error| Problem::internal(&error))?;
            let (body, reserved) = buffer.into_body(cache);
            let sent = Sent::default();
            let held = Some(reserved.send(body.clone(), &sent));
            Ok(Stored { body, sent, held, solve, server_timing })
        }
        Err(error) => Err(write_problem(error, &taking)),
    }
}

/// Why an answer could not be written into memory.
fn write_problem(error: io::Error, taking: &Taking<'_>) -> Problem {
    if taking.is_scarce.get() {
        return NoRoom::Scarce.into();
    }
    if taking.stopped() {
        return NoAnswer::stopped().into();
    }
    error.downcast::<NoRoom>().map_or_else(|error| Problem::internal(&error), Into::into)
}

/// How much of a large answer is written between two looks at the stop signal.
const LOOK_EVERY_BYTES: usize = 1 << 16;

/// A writer that fails once the stop signal is set, so that writing a large answer stops too.
struct Stoppable<'a, W> {
    inner: W,
    until_look: usize,
    stop: &'a dyn Stop,
}

impl<'a, W> Stoppable<'a, W> {
    fn new(inner: W, stop: &'a dyn Stop) -> Self {
        Self { inner, until_look: LOOK_EVERY_BYTES, stop }
    }

    fn look(&mut self) -> io::Result<()> {
        self.until_look = LOOK_EVERY_BYTES;
        if self.stop.stopped() { Err(io::Error::other("stopped")) } else { Ok(()) }
    }
}

impl<W: Write> Write for Stoppable<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes).map(|()| bytes.len())
    }

    // Numbers come one by one: this is called for each.
    #[inline]
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self.until_look.checked_sub(bytes.len()) {
            Some(rest) => self.until_look = rest,
            None => self.look()?,
        }
        self.inner.write_all(bytes)
    }

    // Of what comes to few bytes whoever writes it knows when to look.
    fn flush(&mut self) -> io::Result<()> {
        self.look()?;
        self.inner.flush()
    }
}

/// A buffer that takes room before it takes memory.
struct Growing {
    bytes: Vec<u8>,
    reserved: Reserved,
    /// What the answer takes beside its bytes.
    held_bytes: u64,
}

impl Growing {
    fn new(mut reserved: Reserved, held_bytes: u64, expected_bytes: usize) -> Result<Self, NoRoom> {
        reserved.hold_at_least(held_bytes + expected_bytes as u64)?;
        Ok(Self { bytes: Vec::with_capacity(expected_bytes), reserved, held_bytes })
    }

    #[cold]
    fn grow(&mut self, bytes: usize) -> io::Result<()> {
        let before = self.bytes.capacity();
        let capacity = (2 * before).max(self.bytes.len() + bytes);
        // While the bytes are copied they are there twice.
        self.reserved.hold_at_least(self.held_bytes + (before + capacity) as u64).map_err(io::Error::other)?;
        self.bytes.reserve_exact(capacity - self.bytes.len());
        self.reserved.hold_at_most(self.held_bytes + capacity as u64);
        Ok(())
    }

    /// Its bytes, and the room that they take.
    fn into_body(self, cache: Option<&Cache>) -> (Bytes, Reserved) {
        let Self { bytes, mut reserved, .. } = self;
        let copied = cache.filter(|cache| cache.wants_copy(&bytes)).and_then(|_| {
            // What was written is gone by now. While the bytes are copied they are there twice.
            reserved.hold_at_least((bytes.capacity() + bytes.len()) as u64).ok()?;
            in_own_pages(&bytes)
        });
        (copied.unwrap_or_else(|| bytes.into_boxed_slice().into()), reserved)
    }
}

impl Write for Growing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes).map(|()| bytes.len())
    }

    #[inline]
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        if bytes.len() > self.bytes.capacity() - self.bytes.len() {
            self.grow(bytes.len())?;
        }
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// How long a solve took.
pub const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
/// Where an answer came from (RFC 9211).
pub const CACHE_STATUS: HeaderName = HeaderName::from_static("cache-status");

async fn with_body(
    app: &App,
    deadline: tokio::time::Instant,
    stored: Stored,
    representation: Representation,
) -> Result<Response, Problem> {
    let taken = async { Ok(app.room.take(deadline, stored.body, &stored.sent).await?) };
    let body = app.pool.until_closed(taken).await?;
    let mut response = (StatusCode::OK, body).into_response();
    let headers = response.headers_mut();
    // Those here and those of the layers around.
    headers.reserve(12);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(negotiation::content_type(representation.format)));
    if representation.gzip {
        headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    headers.insert(SERVER_TIMING, stored.server_timing);
    Ok(response)
}

/// The headers about caching that 200 and 304 share.
fn caching(mut response: Response, provenance: Provenance, etag: &str) -> Response {
    response.extensions_mut().insert(provenance);
    let headers = response.headers_mut();
    if let Ok(etag) = HeaderValue::from_str(etag) {
        headers.insert(header::ETAG, etag);
    }
    headers.insert(header::VARY, HeaderValue::from_static("accept, accept-encoding"));
    headers.insert(CACHE_STATUS, HeaderValue::from_static(provenance.served.cache_status()));
    response
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::sync::atomic::AtomicBool;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use toothwave_calculation::accuracy::Accuracy;
    use toothwave_calculation::design::Design;
    use toothwave_calculation::drawing::Drawing;
    use toothwave_calculation::drawing::answer::DrawnPart;
    use toothwave_calculation::forms::Format;
    use toothwave_calculation::geometry::Geometry;
    use toothwave_calculation::question::{Limits, Question};
    use toothwave_calculation::sweep::Sweep;

    use super::{Expected, Growing, LOOK_EVERY_BYTES, SMALL_BYTES, Stoppable};
    use crate::cache::{Cache, Stored};
    use crate::negotiation::Representation;
    use crate::problem::{Problem, ProblemCode};
    use crate::room::Room;

    /// In the room that there is, and no other.
    fn solve<Q: Question>(
        checked: &Q::Checked,
        representation: Representation,
        room: &Room,
        cache: Option<&Cache>,
        stop: &AtomicBool,
    ) -> Result<Stored, Problem> {
        let expected = Expected::of::<Q>(checked, representation);
        let reserved = room.reserve(expected.bytes())?;
        super::solve::<Q>(checked, representation, &expected, reserved, cache, stop)
    }

    /// The bytes of an answer, where so much room is left.
    fn solved<Q: Question>(question: &Q, format: Format, left_bytes: u64) -> Result<u64, ProblemCode> {
        let document = include_str!("../../../examples/paper-5.1.json")
            .replace("\"chord_tolerance_mm\": 0.001", "\"chord_tolerance_mm\": 1e-6")
            .replace("\"samples\": 50", "\"tolerance\": 1e-9");
        let limits = Limits { max_states: 1_000_000, max_profile_points: 1_000_000 };
        let design = Design::read(document.as_bytes()).expect("a design");
        let checked = question.check(&design, &limits).expect("a possible one");
        let room = Room::new(1 << 30);
        let _others = room.reserve((1 << 30) - left_bytes).expect("room");
        let stored = solve::<Q>(&checked, Representation { format, gzip: false }, &room, None, &AtomicBool::new(false));
        stored.map(|stored| stored.body.len() as u64).map_err(|problem| problem.code)
    }

    #[test]
    fn an_answer_wants_room_for_itself_beside_its_text_where_the_question_did_not_tell_how_long_it_gets() {
        let drawing = Drawing(DrawnPart::Assembly);
        for (name, solved) in [
            ("geometry", &(|left_bytes| solved(&Geometry, Format::Json, left_bytes)) as &dyn Fn(u64) -> _),
            ("drawing", &|left_bytes| solved(&drawing, Format::Json, left_bytes)),
            ("sweep to a tolerance", &|left_bytes| solved(&Sweep, Format::Json, left_bytes)),
        ] {
            let text_bytes = solved(1 << 30).unwrap_or_else(|code| panic!("{name}: {code:?}"));
            assert_eq!(solved(text_bytes + text_bytes / 10), Err(ProblemCode::TooManyUnreadBytes), "{name}");
        }
    }

    /// Whoever is told to stop at once does not come to solving.
    #[test]
    fn what_is_computed_without_a_number_of_states_takes_its_room_before() {
        let document = r#"{ "drive": { "wave_generator": { "semi_major_mm": 1600, "semi_minor_mm": 1599 },
            "teeth": { "count": 800, "radius_mm": 4, "width_mm": 15 }, "ring": { "teeth": 798 } },
            "load": { "input_torque_nm": 20 }, "sweep": { "tolerance": 1e-6 } }"#;
        let design = Design::read(document.as_bytes()).expect("a design");
        let limits = Limits { max_states: 1_000_000, max_profile_points: 1_000_000 };
        let room = Room::new(1 << 20);
        let _others = room.reserve(1 << 19).expect("room");
        let code = |solved: Result<_, Problem>| solved.map(|_: Stored| ()).map_err(|problem| problem.code);
        let json = Representation::JSON;
        let sweep = Sweep.check(&design, &limits).expect("a possible one");
        let accuracy = Accuracy.check(&design, &limits).expect("a possible one");
        let stop = AtomicBool::new(true);
        assert_eq!(code(solve::<Sweep>(&sweep, json, &room, None, &stop)), Err(ProblemCode::TooManyUnreadBytes));
        assert_eq!(code(solve::<Accuracy>(&accuracy, json, &room, None, &stop)), Err(ProblemCode::TooManyUnreadBytes));
    }

    /// Whatever was counted. One that takes hundreds of milliseconds, so that it is given up on its way, and one that takes no room.
    #[test]
    fn where_memory_becomes_scarce_what_takes_room_is_given_up_and_nothing_else() {
        let document = include_str!("../../../examples/paper-5.1.json");
        let design = Design::read(document.as_bytes()).expect("a design");
        let limits = Limits { max_states: 1_000_000, max_profile_points: 1_000_000 };
        let (json, stop) = (Representation::JSON, AtomicBool::new(false));
        let room = Room::new(1 << 30);
        let accuracy = Accuracy.check(&design, &limits).expect("a possible one");
        let given_up = std::thread::scope(|scope| {
            let solving = scope.spawn(|| solve::<Accuracy>(&accuracy, json, &room, None, &stop));
            while room.taken_bytes() == 0 && !solving.is_finished() {
                std::thread::yield_now();
            }
            room.memory().set_scarce(true);
            solving.join().expect("no panic")
        });
        assert_eq!(given_up.err().map(|problem| problem.code), Some(ProblemCode::TooManyUnreadBytes));
        assert_eq!(room.taken_bytes(), 0);
        assert!(room.reserve(SMALL_BYTES + 1).is_err());
        let sweep = Sweep.check(&design, &limits).expect("a possible one");
        assert!(solve::<Sweep>(&sweep, json, &room, None, &stop).is_ok());
        room.memory().set_scarce(false);
        assert!(room.reserve(SMALL_BYTES + 1).is_ok());
    }

    /// Those of the allocator begin behind a head.
    #[test]
    fn an_answer_that_may_be_kept_is_written_into_pages_of_its_own() {
        let design = Design::read(include_bytes!("../../../examples/paper-5.1.json")).expect("a design");
        let limits = Limits { max_states: 1_000_000, max_profile_points: 1_000_000 };
        let sweep = Sweep.check(&design, &limits).expect("a possible one");
        let begins_a_page = |cache: Option<&Cache>| {
            let room = Room::new(1 << 30);
            let stored = solve::<Sweep>(&sweep, Representation::JSON, &room, cache, &AtomicBool::new(false));
            stored.expect("an answer").body.as_ptr().addr().is_multiple_of(4096)
        };
        assert!(begins_a_page(Some(&Cache::new(1 << 20))));
        assert!(!begins_a_page(Some(&Cache::new(0))) && !begins_a_page(None));
    }

    /// It has two texts for each pole of its curves, at the bottom and at the top, to know them again.
    #[test]
    fn a_drawing_as_step_wants_room_for_the_records_that_are_remembered() {
        let drawing = Drawing(DrawnPart::Assembly);
        let text_bytes = solved(&drawing, Format::Step, 1 << 30).expect("room");
        assert_eq!(solved(&drawing, Format::Step, text_bytes), Err(ProblemCode::TooManyUnreadBytes));
    }

    #[test]
    fn while_a_text_grows_it_wants_room_for_both_copies() {
        let room = Room::new(1 << 30);
        let mut growing = Growing::new(room.reserve(0).expect("room"), 0, 1 << 20).expect("room");
        growing.write_all(&vec![0; 1 << 20]).expect("room");
        let others = room.reserve((1 << 30) - (3 << 20) + 1).expect("room");
        assert!(growing.write_all(&[0]).is_err());
        drop(others);
        growing.write_all(&[0]).expect("room");
        assert_eq!(room.taken_bytes(), 2 << 20);
    }

    /// Of a megabyte of zeros a kilobyte comes out of the encoder.
    #[test]
    fn what_compresses_well_is_stopped_as_soon_as_anything_else() {
        let stop = AtomicBool::new(true);
        let mut writer = Stoppable::new(GzEncoder::new(Vec::new(), Compression::fast()), &stop);
        let written = (0..LOOK_EVERY_BYTES).take_while(|_| writer.write_all(&[0; 1024]).is_ok()).count();
        assert!(written * 1024 <= LOOK_EVERY_BYTES, "{written} KiB");
    }
}
