//! The whole request: `cargo bench --bench http` writes docs/speed-http.md.
//!
//! The service runs as the released program on one core; this program asks it from another. Beside it, pinned alike, runs the least that
//! axum can do: a handler that serialises the same answer, and one that returns the same bytes. With `-- --quick` rounds are short,
//! and the report stays beside the build.

mod harness;

use std::cell::Cell;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
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
use toothwave::api::Endpoint;
use toothwave::api::sweep::{Sweep, SweepAnswer};
use toothwave::config::Settings;
use toothwave::design::Design;

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

/// What the bare handlers answer with.
#[derive(Debug)]
struct Bare {
    answer: SweepAnswer,
    bytes: Bytes,
}

fn serve_bare() -> Result<(), Failure> {
    let limits = Defaults::parse_from(["defaults"]).settings.limits();
    let design = toothwave::json::read::<Design>(DESIGN.as_bytes()).map_err(|error| format!("{error:?}"))?.normalised();
    let question = Sweep.question(&design, &limits).map_err(|problem| problem.to_string())?;
    let answer = Sweep::answer(&question, &AtomicBool::new(false)).map_err(|problem| problem.to_string())?;
    let bytes = serde_json::to_vec(&answer)?.into();
    let router = Router::new()
        .route("/serialised", post(serialised))
        .route("/bytes", post(bytes_alone))
        .with_state(Arc::new(Bare { answer, bytes }));
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

/// A POST on a kept connection, whose torque may differ from request to request without changing its length.
#[derive(Debug)]
struct Requests {
    before_torque: String,
    after_torque: String,
    /// The billionths of the torque's next value; none where all requests are one.
    varied: Option<Cell<u64>>,
}

impl Requests {
    fn new(path: &str, varied: bool) -> Result<Self, Failure> {
        let document = serde_json::from_str::<serde_json::Value>(DESIGN)?.to_string();
        let (before, after) = document.split_once("20.0").ok_or("the example has another torque")?;
        let length = before.len() + "20.0000000000".len() + after.len();
        let head = format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n\r\n"
        );
        Ok(Self { before_torque: head + before, after_torque: after.into(), varied: varied.then(|| Cell::new(1)) })
    }

    fn write(&self, request: &mut Vec<u8>) {
        let number = self.varied.as_ref().map_or(0, |next| next.replace(next.get() + 1));
        request.clear();
        request.extend_from_slice(self.before_torque.as_bytes());
        request.extend_from_slice(format!("20.{number:010}").as_bytes());
        request.extend_from_slice(self.after_torque.as_bytes());
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
        let mut end = None;
        loop {
            if self.stream.read_buf(&mut self.response).await? == 0 {
                return Err("the server hung up".into());
            }
            if end.is_none() {
                end = end_of_answer(&self.response)?;
            }
            if let Some((start, end)) = end
                && self.response.len() >= end
            {
                return Ok(&self.response[start..end]);
            }
            self.response.reserve(1 << 17);
        }
    }
}

/// Where the body starts and ends, once the head is there.
fn end_of_answer(response: &[u8]) -> Result<Option<(usize, usize)>, Failure> {
    let Some(start) = response.windows(4).position(|bytes| bytes == b"\r\n\r\n") else { return Ok(None) };
    let head = std::str::from_utf8(&response[..start])?;
    if !head.starts_with("HTTP/1.1 200 ") {
        return Err(head.to_owned().into());
    }
    let length = head.lines().find_map(|line| line.strip_prefix("content-length: ")).ok_or("no content-length")?;
    Ok(Some((start + 4, start + 4 + length.parse::<usize>()?)))
}

/// Requests a second, and how long the server computed for one.
#[derive(Debug, Clone, Copy)]
struct Throughput {
    per_second: f64,
    processor_s: f64,
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
        let mut answered = 0_u32;
        while started.elapsed() < duration {
            connection.ask(requests).await?;
            answered += 1;
        }
        Ok::<_, Failure>(answered)
    });
    let answered = futures_util::future::try_join_all(loops).await?;
    let elapsed = started.elapsed().as_secs_f64();
    let answered = f64::from(answered.into_iter().sum::<u32>());
    let processor_s = (server.processor_s()? - processor_before) / answered;
    Ok(Throughput { per_second: answered / elapsed, processor_s })
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
    let mut text = introduction(effort, machine, body_bytes, comparisons[1].toothwave.before_torque.len());
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
    Ok(text)
}

fn introduction(effort: Effort, machine: &str, body_bytes: usize, request_bytes: usize) -> String {
    let length = effort.choose("one second", "0.2 s");
    format!(
        "# Speed of the whole request\n\n\
         Written by `cargo bench --bench http`; run it again for your machine. The solver alone is measured in [speed-and-accuracy.md](speed-and-accuracy.md).\n\n\
         ## Method\n\n\
         Case 5.1, 50 intervals, as JSON without compression: the answer's body has {body_bytes} bytes, the request about {request_bytes}. The service runs as the released program \
         with its defaults but for the log filter `warn` (at `info` it writes a line for each request); a bare axum server runs beside it. Each is pinned to one and the same core \
         and has one worker thread of tokio's usual runtime; the client is pinned to another core. Connections are kept, and each asks again \
         when it has its answer (closed loop). Torques differ by 1e-10 N·m where the cache must not know the answer. Rounds of {length} alternate between the two; a number is the median over the rounds, \
         with the quartiles in brackets, and a share is the median of the rounds' shares.\n\n\
         The servers' processor time, the kernel's share included, says what a request costs where the client is the slower of the two or others use the cores too.\n\n\
         ## Machine\n\n{}.\n",
        machine.replace(" | ", ".\n"),
    )
}
