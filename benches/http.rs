//! The whole request: `cargo bench --bench http` writes benches/results/speed-http.md.
//!
//! The service runs as the released program on one core; this program asks it from another. Beside it, pinned alike, runs the least that
//! axum can do: a handler that serialises the same answer, and handlers that return the same bytes. With `-- --quick` rounds are short,
//! and the report stays beside the build.

mod harness;

use std::cell::Cell;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::hint::black_box;
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use axum::routing::post;
use axum::{Json, Router};
use clap::Parser;
use harness::{Effort, Spread, machine, three_digits};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use toothwave::http::endpoints::batch::{BatchEndpoint, BatchQuery, computed_line};
use toothwave::ops::config::Settings;
use toothwave_calculation::design::Design;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::SweepAnswer;

type Failure = Box<dyn Error>;

/// Starts this program as the bare handlers.
const BARE_FLAG: &str = "--bare";

/// The request's document: case 5.1 with 50 intervals.
const DESIGN: &str = include_str!("../examples/paper-5.1.json");

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().collect();
    if arguments.iter().any(|argument| argument == BARE_FLAG) {
        return serve_bare();
    }
    let effort = Effort::of(&arguments);
    let cores = Cores::of_this_process()?;
    // Before this thread is pinned, which leaves it one core to count.
    let machine = machine();
    let toothwave = {
        let mut command = Command::new(env!("CARGO_BIN_EXE_toothwave"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--log", "warn"]);
        Server::start(command, &cores)?
    };
    let bare = {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg(BARE_FLAG);
        Server::start(command, &cores)?
    };
    cores.enter(cores.client)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let report = runtime.block_on(measure(effort, &machine, &toothwave, &bare))?;
    println!("{report}");
    let directory = effort.directory();
    fs::create_dir_all(&directory)?;
    let path = directory.join("speed-http.md");
    fs::write(&path, report)?;
    println!("written: {}", path.display());
    Ok(())
}

/// Two cores of those that this process may use; one and the same where there is only one.
#[derive(Debug, Clone, Copy)]
struct Cores {
    server: usize,
    client: usize,
}

impl Cores {
    fn of_this_process() -> Result<Self, Failure> {
        let allowed = sched_getaffinity(None)?;
        let mut allowed = (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core));
        let server = allowed.next().ok_or("no core to run on")?;
        Ok(Self { server, client: allowed.next().unwrap_or(server) })
    }

    /// Pins this thread, and whatever it starts from now on.
    fn enter(&self, core: usize) -> Result<(), Failure> {
        let mut only = CpuSet::new();
        only.set(core);
        Ok(sched_setaffinity(None, &only)?)
    }
}

/// A server in a process of its own.
#[derive(Debug)]
struct Server {
    child: Child,
    address: SocketAddr,
    /// Open as long as the server runs, which may print more.
    _output: BufReader<ChildStdout>,
}

impl Server {
    /// Starts it on the server's core and waits until it says, in the last word of its first line, where it listens.
    fn start(mut command: Command, cores: &Cores) -> Result<Self, Failure> {
        cores.enter(cores.server)?;
        let mut child = command.stdout(Stdio::piped()).spawn()?;
        let mut line = String::new();
        let mut output = BufReader::new(child.stdout.take().ok_or("no pipe")?);
        output.read_line(&mut line)?;
        let word = line.split_whitespace().last().ok_or("the server said nothing")?;
        let address = word.trim_start_matches("http://").parse()?;
        Ok(Self { child, address, _output: output })
    }

    /// Processor time that it has used.
    fn processor_s(&self) -> Result<f64, Failure> {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.child.id()))?;
        // After the name in brackets, which may hold anything, utime and stime are the 12th and 13th; Linux counts 100 a second.
        let fields: Vec<_> = stat.rsplit(") ").next().unwrap_or_default().split(' ').collect();
        let ticks = |index: usize| fields.get(index).and_then(|field| field.parse::<f64>().ok()).ok_or("no such field");
        Ok((ticks(11)? + ticks(12)?) / 100.0)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It keeps nothing that an orderly end would save.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[derive(Debug, Parser)]
struct Defaults {
    #[command(flatten)]
    settings: Settings,
}

/// Documents of a batch.
const BATCH: usize = 50;

/// What a batch is asked for: the peaks of sweeps.
const PEAKS: BatchQuery = BatchQuery { endpoint: BatchEndpoint::Sweep, peaks_only: true };

/// What the bare handlers answer with.
#[derive(Debug)]
struct Bare {
    answer: SweepAnswer,
    bytes: Bytes,
    batch: Bytes,
}

fn serve_bare() -> Result<(), Failure> {
    let limits = limits();
    let answer = Sweep.ask(DESIGN.as_bytes(), &limits, &AtomicBool::new(false))?;
    let bytes = serde_json::to_vec(&answer)?.into();
    let mut batch = Vec::new();
    for index in 0..BATCH as u64 {
        batch.extend(computed_line(PEAKS, index, DESIGN.as_bytes(), &limits));
    }
    let router = Router::new()
        .route("/serialised", post(serialised))
        .route("/bytes", post(bytes_alone))
        .route("/batch", post(batch_alone))
        .with_state(Arc::new(Bare { answer, bytes, batch: batch.into() }));
    // The same kind of runtime as the service's.
    tokio::runtime::Runtime::new()?.block_on(async {
        let listener = TcpListener::bind("127.0.0.1:0").await?;
        println!("{}", listener.local_addr()?);
        Ok(axum::serve(listener, router).await?)
    })
}

/// Both take the request's body in, as whoever answers a POST must.
async fn serialised(State(bare): State<Arc<Bare>>, _: Bytes) -> Response {
    Json(&bare.answer).into_response()
}

async fn bytes_alone(State(bare): State<Arc<Bare>>, _: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], bare.bytes.clone()).into_response()
}

async fn batch_alone(State(bare): State<Arc<Bare>>, _: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/x-ndjson")], bare.batch.clone()).into_response()
}

fn limits() -> Limits {
    Defaults::parse_from(["defaults"]).settings.limits().of_calculation()
}

/// A POST on a kept connection, whose torque may differ from request to request without changing its length.
#[derive(Debug)]
struct Requests {
    head: String,
    before_torque: String,
    after_torque: String,
    /// Documents in the body, each on a line of its own where there are several.
    documents: usize,
    /// The billionths of the torque's next value; none where all requests are one.
    varied: Option<Cell<u64>>,
}

impl Requests {
    fn new(path: &str, varied: bool) -> Result<Self, Failure> {
        Self::of_documents(path, "application/json", 1, varied)
    }

    fn batch(path: &str) -> Result<Self, Failure> {
        Self::of_documents(path, "application/x-ndjson", BATCH, true)
    }

    fn of_documents(path: &str, content_type: &str, documents: usize, varied: bool) -> Result<Self, Failure> {
        let document = serde_json::from_str::<serde_json::Value>(DESIGN)?.to_string();
        let (before, after) = document.split_once("20.0").ok_or("the example has another torque")?;
        let after = if documents > 1 { format!("{after}\n") } else { after.into() };
        let length = documents * (before.len() + "20.0000000000".len() + after.len());
        let head = format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: {content_type}\r\ncontent-length: {length}\r\n\r\n"
        );
        let varied = varied.then(|| Cell::new(1));
        Ok(Self { head, before_torque: before.into(), after_torque: after, documents, varied })
    }

    fn write(&self, request: &mut Vec<u8>) {
        request.clear();
        request.extend_from_slice(self.head.as_bytes());
        for _ in 0..self.documents {
            let number = self.varied.as_ref().map_or(0, |next| next.replace(next.get() + 1));
            request.extend_from_slice(self.before_torque.as_bytes());
            request.extend_from_slice(format!("20.{number:010}").as_bytes());
            request.extend_from_slice(self.after_torque.as_bytes());
        }
    }

    fn length(&self) -> usize {
        let mut request = Vec::new();
        self.write(&mut request);
        request.len() - self.head.len()
    }
}

/// A kept connection and its buffers.
#[derive(Debug)]
struct Connection {
    stream: TcpStream,
    request: Vec<u8>,
    response: Vec<u8>,
}

impl Connection {
    async fn open(address: SocketAddr) -> Result<Self, Failure> {
        let stream = TcpStream::connect(address).await?;
        stream.set_nodelay(true)?;
        Ok(Self { stream, request: Vec::new(), response: Vec::new() })
    }

    /// One request and its whole answer, whose body is returned.
    async fn ask(&mut self, requests: &Requests) -> Result<&[u8], Failure> {
        requests.write(&mut self.request);
        self.stream.write_all(&self.request).await?;
        self.response.clear();
        let mut head = None;
        loop {
            if self.stream.read_buf(&mut self.response).await? == 0 {
                return Err("the server hung up".into());
            }
            if head.is_none() {
                head = head_of_answer(&self.response)?;
            }
            match head {
                Some((start, Some(length))) if self.response.len() >= start + length => {
                    return Ok(&self.response[start..start + length]);
                }
                // In chunks, of which the last is empty.
                Some((start, None)) if self.response.ends_with(b"\r\n0\r\n\r\n") => return Ok(&self.response[start..]),
                _ => self.response.reserve(1 << 17),
            }
        }
    }
}

/// Where the body starts and how long it is, if the head says so, once that is there.
fn head_of_answer(response: &[u8]) -> Result<Option<(usize, Option<usize>)>, Failure> {
    let Some(start) = response.windows(4).position(|bytes| bytes == b"\r\n\r\n") else { return Ok(None) };
    let head = std::str::from_utf8(&response[..start])?;
    if !head.starts_with("HTTP/1.1 200 ") {
        return Err(head.to_owned().into());
    }
    let length = head.lines().find_map(|line| line.strip_prefix("content-length: "));
    Ok(Some((start + 4, length.map(str::parse).transpose()?)))
}

/// Requests a second, how long the server computed for one, and how long the client waited: at the median, and at the 99th of a hundred.
#[derive(Debug, Clone, Copy)]
struct Throughput {
    per_second: f64,
    processor_s: f64,
    median_s: f64,
    slowest_s: f64,
}

/// So many connections, each of which asks again when it has its answer.
async fn closed_loop(
    server: &Server,
    requests: &Requests,
    connections: usize,
    duration: Duration,
) -> Result<Throughput, Failure> {
    let mut opened = Vec::new();
    for _ in 0..connections {
        let mut connection = Connection::open(server.address).await?;
        connection.ask(requests).await?;
        opened.push(connection);
    }
    let processor_before = server.processor_s()?;
    let started = Instant::now();
    let loops = opened.into_iter().map(|mut connection| async move {
        let mut waited_s = Vec::new();
        while started.elapsed() < duration {
            let asked = Instant::now();
            connection.ask(requests).await?;
            waited_s.push(asked.elapsed().as_secs_f64());
        }
        Ok::<_, Failure>(waited_s)
    });
    let mut waited_s = futures_util::future::try_join_all(loops).await?.concat();
    let elapsed = started.elapsed().as_secs_f64();
    waited_s.sort_by(f64::total_cmp);
    let answered = waited_s.len() as f64;
    let processor_s = (server.processor_s()? - processor_before) / answered;
    let (median_s, slowest_s) = (waited_s[waited_s.len() / 2], waited_s[waited_s.len() * 99 / 100]);
    Ok(Throughput { per_second: answered / elapsed, processor_s, median_s, slowest_s })
}

/// What is compared.
struct Comparison<'a> {
    name: &'a str,
    toothwave: Requests,
    bare: Requests,
    goal_percent: u32,
}

async fn measure(effort: Effort, machine: &str, toothwave: &Server, bare: &Server) -> Result<String, Failure> {
    let comparisons = [
        Comparison {
            name: "not in the cache, against an axum handler that serialises the same structure",
            toothwave: Requests::new("/v1/sweep", true)?,
            bare: Requests::new("/serialised", false)?,
            goal_percent: 80,
        },
        Comparison {
            name: "from the cache, against an axum handler that returns the same bytes",
            toothwave: Requests::new("/v1/sweep", false)?,
            bare: Requests::new("/bytes", false)?,
            goal_percent: 90,
        },
    ];
    let body_bytes = {
        let mut connections = (Connection::open(toothwave.address).await?, Connection::open(bare.address).await?);
        let ours = connections.0.ask(&comparisons[1].toothwave).await?;
        if ours != connections.1.ask(&comparisons[1].bare).await? {
            return Err("the bare handler answers with other bytes".into());
        }
        ours.len()
    };
    let mut text = introduction(effort, machine, body_bytes, comparisons[1].toothwave.length());
    let (rounds, duration) = effort.choose((9, Duration::from_secs(1)), (3, Duration::from_millis(200)));
    for Comparison { name, toothwave: ours, bare: theirs, goal_percent } in &comparisons {
        write!(text, "\n## A sweep {name}\n\n")?;
        text += "| connections | toothwave, requests a second | bare axum, requests a second | share of the bare one's | goal | server's processor µs a request: toothwave, bare | share by these |\n";
        text += "|---|---|---|---|---|---|---|\n";
        for connections in [1, 8] {
            let mut measured = Vec::new();
            closed_loop(toothwave, ours, connections, duration / 2).await?;
            closed_loop(bare, theirs, connections, duration / 2).await?;
            for _ in 0..rounds {
                let ours = closed_loop(toothwave, ours, connections, duration).await?;
                measured.push((ours, closed_loop(bare, theirs, connections, duration).await?));
            }
            let ours = Spread::of(measured.iter().map(|(ours, _)| ours.per_second));
            let theirs = Spread::of(measured.iter().map(|(_, theirs)| theirs.per_second));
            let share = Spread::of(measured.iter().map(|(ours, theirs)| 100.0 * ours.per_second / theirs.per_second));
            let by_processor =
                Spread::of(measured.iter().map(|(ours, theirs)| 100.0 * theirs.processor_s / ours.processor_s));
            let processor = |of: fn(&(Throughput, Throughput)) -> f64| {
                three_digits(1e6 * Spread::of(measured.iter().map(of)).median)
            };
            writeln!(
                text,
                "| {connections} | {} | {} | {} % | {goal_percent} % | {}, {} | {} % |",
                ours.show(1.0),
                theirs.show(1.0),
                share.show(1.0),
                processor(|(ours, _)| ours.processor_s),
                processor(|(_, theirs)| theirs.processor_s),
                by_processor.show(1.0),
            )?;
        }
    }
    text += &ladder(effort, toothwave, bare).await?;
    text += &designs(effort, toothwave).await?;
    Ok(text)
}

/// Cached sweeps, sweeps to be solved and batches at more and more connections, each against the bare handler of the same bytes.
async fn ladder(effort: Effort, toothwave: &Server, bare: &Server) -> Result<String, Failure> {
    let mut text = format!(
        "\n## From 1 to 16 connections\n\n\
         Each against the axum handler that returns the same bytes. A batch has {BATCH} documents, each with another torque, and asks for the peaks alone. \
         Waiting times are the client's: at the median, and what 99 of 100 do not exceed.\n\n\
         | | connections | toothwave, requests a second | bare axum, requests a second | share | toothwave, ms: median, 99 % | bare axum, ms: median, 99 % |\n\
         |---|---|---|---|---|---|---|\n"
    );
    let kinds = [
        ("hit", Requests::new("/v1/sweep", false)?, Requests::new("/bytes", false)?),
        ("miss", Requests::new("/v1/sweep", true)?, Requests::new("/bytes", true)?),
        ("batch", Requests::batch("/v1/batch?endpoint=sweep&peaks_only=true")?, Requests::batch("/batch")?),
    ];
    let (rounds, duration) = effort.choose((5, Duration::from_millis(600)), (1, Duration::from_millis(100)));
    for (name, ours, theirs) in &kinds {
        // More batches are refused than 16.
        for connections in [1, 2, 4, 8, 16] {
            let mut measured = Vec::new();
            closed_loop(toothwave, ours, connections, duration / 2).await?;
            for _ in 0..rounds {
                let ours = closed_loop(toothwave, ours, connections, duration).await?;
                measured.push((ours, closed_loop(bare, theirs, connections, duration).await?));
            }
            let median = |of: &dyn Fn(&(Throughput, Throughput)) -> f64| Spread::of(measured.iter().map(of)).median;
            writeln!(
                text,
                "| {name} | {connections} | {} | {} | {} % | {}, {} | {}, {} |",
                three_digits(median(&|(ours, _)| ours.per_second)),
                three_digits(median(&|(_, theirs)| theirs.per_second)),
                three_digits(median(&|(ours, theirs)| 100.0 * ours.per_second / theirs.per_second)),
                three_digits(median(&|(ours, _)| 1e3 * ours.median_s)),
                three_digits(median(&|(ours, _)| 1e3 * ours.slowest_s)),
                three_digits(median(&|(_, theirs)| 1e3 * theirs.median_s)),
                three_digits(median(&|(_, theirs)| 1e3 * theirs.slowest_s)),
            )?;
        }
    }
    Ok(text)
}

/// A step of answering a line.
type Step<'a> = Box<dyn FnMut() + 'a>;

/// How many designs a second a batch of peaks gives, and what each of its steps takes.
async fn designs(effort: Effort, toothwave: &Server) -> Result<String, Failure> {
    let (rounds, duration) = effort.choose((9, Duration::from_secs(1)), (1, Duration::from_millis(100)));
    let requests = Requests::batch("/v1/batch?endpoint=sweep&peaks_only=true")?;
    closed_loop(toothwave, &requests, 2, duration / 2).await?;
    let mut per_second = Vec::new();
    for _ in 0..rounds {
        per_second.push(BATCH as f64 * closed_loop(toothwave, &requests, 2, duration).await?.per_second);
    }

    let (limits, never) = (limits(), AtomicBool::new(false));
    let read = || Design::read(DESIGN.as_bytes());
    let design = read()?;
    let checked = Sweep.check(&design, &limits)?;
    let mut steps: [(&str, Step<'_>); 4] = [
        ("reading the document", Box::new(|| drop(black_box(read())))),
        ("checking it, and the drive's geometry", Box::new(|| drop(black_box(Sweep.check(&design, &limits))))),
        ("the sweep, with peaks, checks and findings", Box::new(|| drop(black_box(Sweep::answer(&checked, &never))))),
        (
            "all of a line, writing its answer included",
            Box::new(|| {
                black_box(computed_line(PEAKS, 0, DESIGN.as_bytes(), &limits));
            }),
        ),
    ];
    let mut text = format!(
        "\n## Designs a second\n\n\
         Batches of {BATCH} documents that ask for the peaks alone, on two connections: {} designs a second on the server's one core, the client on another one. \
         A request has {} bytes; a line of its answer some {}. What a line takes by itself, on one thread of this program:\n\n\
         | step | µs |\n|---|---|\n",
        Spread::of(per_second).show(1.0),
        requests.length(),
        computed_line(PEAKS, 0, DESIGN.as_bytes(), &limits).len(),
    );
    for (name, step) in &mut steps {
        let mut times = Vec::new();
        for _ in 0..effort.choose(200, 5) {
            let started = Instant::now();
            for _ in 0..100 {
                step();
            }
            times.push(started.elapsed().as_secs_f64() / 100.0);
        }
        writeln!(text, "| {name} | {} |", Spread::of(times).show(1e-6))?;
    }
    Ok(text)
}

fn introduction(effort: Effort, machine: &str, body_bytes: usize, request_bytes: usize) -> String {
    let length = effort.choose("one second", "0.2 s");
    format!(
        "# Speed of the whole request\n\n\
         Written by `cargo bench --bench http`; run it again for your machine. The solver alone is measured in [speed-and-accuracy.md](speed-and-accuracy.md).\n\n\
         ## Method\n\n\
         Case 5.1, 50 intervals, as JSON without compression: the answer's body has {body_bytes} bytes, the request {request_bytes}. The service runs as the released program \
         with its defaults but for the log filter `warn` (at `info` it writes a line for each request); a bare axum server runs beside it. Each is pinned to one and the same core \
         and has one worker thread of tokio's usual runtime; the client is pinned to another core. Connections are kept, and each asks again \
         when it has its answer (closed loop). Torques differ by 1e-10 N·m where the cache must not know the answer. Rounds of {length} alternate between the two; a number is the median over the rounds, \
         with the quartiles in brackets, and a share is the median of the rounds' shares.\n\n\
         The servers' processor time, the kernel's share included, says what a request costs where the client is the slower of the two or others use the cores too.\n\n\
         ## Machine\n\n{}.\n",
        machine.replace(" | ", ".\n"),
    )
}
