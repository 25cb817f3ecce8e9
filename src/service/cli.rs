//! The command line: the service, the same answers without it, and what containers need.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufRead, Read, Write};
use std::iter;
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use parking_lot::Mutex;
use rayon::prelude::*;
use rustix::process::Signal;
use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{SignalKind, signal};
use toothwave_calculation::accuracy::Accuracy;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::convert::converted;
use toothwave_calculation::drawing::Drawing;
use toothwave_calculation::drawing::answer::DrawnPart;
use toothwave_calculation::forms::{Format, Forms};
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::question::{Limits, Question};
use toothwave_calculation::sweep::Sweep;
use toothwave_store::{Address, SCHEMA_VERSION, Store};
use toothwave_study::{Gathered, Study, StudyAnswer, Work};
use tracing_subscriber::EnvFilter;

use crate::api::batch::{BatchEnd, BatchEndpoint, BatchQuery, answer_line};
use crate::config::{Settings, StoreSettings, WorkerSettings};
use crate::problem::Problem;
use crate::room::Room;
use crate::{keys, log, memory, observe, router, serve};

/// Bad input, as most tools have it.
const EXIT_BAD_INPUT: u8 = 2;

/// Forces and contact stresses of discrete-tooth harmonic drives.
#[derive(Debug, Parser)]
#[command(name = "toothwave", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve over HTTP; what happens without a command too
    Serve(Box<Settings>),
    /// Profiles of the mating parts
    Geometry(Offline),
    /// How many teeth share the load
    CoincidenceDegree(Offline),
    /// Forces and contact stresses over one period
    Sweep(Offline),
    /// Each way of computing a design, with its error and its time
    Accuracy(Offline),
    /// A part, or all of them, as DXF, STEP or SVG
    Draw {
        /// Which part
        #[arg(value_parser = one_of(&PARTS))]
        part: DrawnPart,
        /// A design document, or `-` for standard input
        file: PathBuf,
        /// Form of the answer
        #[arg(long, value_parser = one_of(&FORMATS), default_value = "dxf")]
        format: Format,
    },
    /// Many designs, one a line, on all cores; answers come as NDJSON in their order
    Batch {
        /// Design documents, one a line, or `-` for standard input
        file: PathBuf,
        /// What each is asked
        #[arg(long, value_enum, default_value_t = BatchEndpoint::Sweep)]
        endpoint: BatchEndpoint,
        /// Of sweeps, the peaks without the states
        #[arg(long)]
        peaks_only: bool,
    },
    /// Many variants of one design, on all cores: a map, a search, a sensitivity or a tolerance study
    Study {
        /// A study document, or `-` for standard input
        file: PathBuf,
        /// Form of the answer
        #[arg(long, value_parser = one_of(&FORMATS), default_value = "json")]
        format: Format,
    },
    /// Print a document without its deprecated fields
    Convert {
        /// A design document or a study document, or `-` for standard input
        file: PathBuf,
    },
    /// Compute chunks of the studies that a PostgreSQL database holds, until told to stop
    Worker(WorkerSettings),
    /// Bring the database of studies to the schema of this build
    Migrate(StoreSettings),
    /// Ask a running service whether it is well; exit status 0 if so
    Health {
        /// Where it listens
        #[arg(long, env = "TOOTHWAVE_LISTEN", value_name = "ADDR", default_value = "127.0.0.1:8080")]
        address: SocketAddr,
    },
    /// Print the API document
    Openapi,
    /// Make a key: prints it once, with the line that the keys file holds of it
    NewKey {
        /// Whose it is
        name: String,
    },
}

#[derive(Debug, Args)]
struct Offline {
    /// A design document, or `-` for standard input
    file: PathBuf,
    /// Form of the answer, if it has this one; `table` means `text`
    #[arg(long, value_parser = one_of(&FORMATS), default_value = "text")]
    format: Format,
}

/// A choice on the command line: its word, another word for it, and what it means.
struct Choice<T> {
    value: T,
    word: &'static str,
    alias: Option<&'static str>,
    help: &'static str,
}

const fn choice<T>(value: T, word: &'static str, help: &'static str) -> Choice<T> {
    Choice { value, word, alias: None, help }
}

const FORMATS: [Choice<Format>; 8] = [
    choice(Format::Json, "json", "As programs read it"),
    choice(Format::Csv, "csv", "Columns"),
    choice(Format::Arrow, "arrow", "Columns as an Apache Arrow stream"),
    choice(Format::Parquet, "parquet", "Columns as an Apache Parquet file"),
    Choice { value: Format::Text, word: "text", alias: Some("table"), help: "For a terminal" },
    choice(Format::Svg, "svg", "A picture"),
    choice(Format::Dxf, "dxf", "Outlines for CAD and workshops"),
    choice(Format::Step, "step", "Solids for CAD"),
];

const PARTS: [Choice<DrawnPart>; 5] = [
    choice(DrawnPart::Ring, "ring", "The ring, x along the middle of a tooth space"),
    choice(DrawnPart::WaveGenerator, "wave-generator", "The wave generator, x along its major axis"),
    choice(DrawnPart::Carrier, "carrier", "The carrier, x along a slot"),
    choice(DrawnPart::Tooth, "tooth", "A tooth"),
    choice(DrawnPart::Assembly, "assembly", "All parts in the ring's frame, at the document's input angle"),
];

/// Reads one of these words.
fn one_of<T: Copy + Send + Sync + 'static>(choices: &'static [Choice<T>]) -> impl TypedValueParser<Value = T> {
    let values = choices.iter().map(|choice| PossibleValue::new(choice.word).aliases(choice.alias).help(choice.help));
    PossibleValuesParser::new(values).try_map(|word| {
        let chosen = choices.iter().find(|choice| choice.word == word || choice.alias == Some(&*word));
        chosen.map(|choice| choice.value).ok_or("none of the choices")
    })
}

/// Runs the command that the process was started with.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse_from(arguments()) {
        Ok(cli) => cli,
        Err(error) => return refuse(error),
    };
    let result = match cli.command {
        Command::Serve(settings) => run_service(&settings),
        Command::Geometry(offline) => answer(Geometry, &offline.file, offline.format),
        Command::CoincidenceDegree(offline) => answer(CoincidenceDegree, &offline.file, offline.format),
        Command::Sweep(offline) => answer(Sweep, &offline.file, offline.format),
        Command::Accuracy(offline) => answer(Accuracy, &offline.file, offline.format),
        Command::Draw { part, file, format } => answer(Drawing(part), &file, format),
        Command::Batch { file, endpoint, peaks_only } => batch(&file, BatchQuery { endpoint, peaks_only }),
        Command::Study { file, format } => study(&file, format),
        Command::Convert { file } => convert(&file),
        Command::Worker(settings) => run_worker(&settings),
        Command::Migrate(settings) => migrate(&settings),
        Command::Health { address } => health(address),
        Command::NewKey { name } => new_key(&name),
        Command::Openapi => print(|writer| writer.write_all(router::openapi_json().as_bytes())),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::BadInput(text)) => complain(&text, ExitCode::from(EXIT_BAD_INPUT)),
        Err(Failure::Io(error)) => complain(&error, ExitCode::FAILURE),
    }
}

/// Says what went wrong, where anybody listens: standard error may be full or closed, or a pipe that nobody reads, which whoever ends waits for no longer than a
/// moment.
fn complain(what: &dyn std::fmt::Display, status: ExitCode) -> ExitCode {
    let text = printable(&what.to_string());
    within_patience(move || {
        let _ = writeln!(io::stderr(), "toothwave: {text}");
    });
    status
}

fn within_patience(say: impl FnOnce() + Send + 'static) {
    const PATIENCE: Duration = Duration::from_millis(300);
    let (said, done) = std::sync::mpsc::sync_channel(1);
    let saying = move || {
        say();
        let _ = said.send(());
    };
    if std::thread::Builder::new().spawn(saying).is_ok() {
        let _ = done.recv_timeout(PATIENCE);
    }
}

/// A text without what a terminal obeys: it may name fields of a document that somebody else wrote.
fn printable(text: &str) -> String {
    let mut printable = String::with_capacity(text.len());
    for character in text.chars() {
        if character.is_control() && character != '\n' {
            printable.extend(character.escape_default());
        } else {
            printable.push(character);
        }
    }
    printable
}

/// Says what is wrong with the command line. It names the first fault alone; of the settings in the environment, by which containers are
/// configured, every one is named.
fn refuse(error: clap::Error) -> ExitCode {
    let status = ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(EXIT_BAD_INPUT));
    if !error.use_stderr() {
        // Help, which whoever asked for it reads.
        let _ = error.print();
        return status;
    }
    within_patience(move || {
        let _ = error.print();
        let settings = Settings::augment_args(clap::Command::new("toothwave").no_binary_name(true));
        for setting in settings.get_arguments().filter(|setting| setting.get_env().is_some()) {
            let alone = clap::Command::new("toothwave").no_binary_name(true).arg(setting.clone());
            if let Err(other) = alone.try_get_matches_from([""; 0])
                && other.to_string() != error.to_string()
            {
                let _ = other.print();
            }
        }
    });
    status
}

#[derive(Debug)]
enum Failure {
    /// The document is at fault.
    BadInput(String),
    /// The surroundings are.
    Io(io::Error),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<Problem> for Failure {
    fn from(problem: Problem) -> Self {
        observe::note_problem(&problem);
        // A service's limits can be set, those of the command line are its own.
        let limits = ["`max_states`", "`max_profile_points`", "`max_study_variants`", "`max_study_bytes`"];
        let text = limits.iter().fold(problem.to_string(), |text, limit| text.replace(limit, "the command line"));
        match problem.cause {
            Some(_) => Self::Io(io::Error::other(text)),
            None => Self::BadInput(text),
        }
    }
}

/// The arguments of this process, with the command that may be left out. The settings are read for that command alone, so that a fault in
/// them is none of, say, `health`.
fn arguments() -> Vec<OsString> {
    let mut arguments: Vec<_> = std::env::args_os().collect();
    let names_command = arguments.get(1).is_some_and(|first| {
        let first = first.to_string_lossy();
        !first.starts_with('-') || ["-h", "--help", "-V", "--version"].contains(&&*first)
    });
    if !names_command {
        arguments.insert(arguments.len().min(1), "serve".into());
    }
    arguments
}

/// Threads on which a database's name is looked up. Where nobody answers each takes its time, whoever gave it up.
const LOOK_UPS: usize = 4;

/// An executor, whose other threads nothing is solved on. Where the system refuses one of its own it would wait for the others for ever, but that such a panic ends the
/// process.
fn runtime() -> io::Result<Runtime> {
    let runtime = with_threads(Builder::new_multi_thread().enable_all(), LOOK_UPS)?;
    runtime.block_on(async {
        // Who is once waited for ends the process no more: a file that is as large as it may be, a log for instance, is an error like others, and
        // keys may be told to be read again before anybody does so.
        for number in [Signal::XFSZ, Signal::HUP] {
            let _ = signal(SignalKind::from_raw(number.as_raw()))?;
        }
        Ok::<_, io::Error>(())
    })?;
    log::end_of_start();
    Ok(runtime)
}

/// Threads that so many solves run on, and the single one that runs beside long slices: with many more than there are permits each solve would wake another,
/// whose memory is cold.
fn threads_of_solves(max_concurrent_solves: usize) -> io::Result<Runtime> {
    with_threads(&mut Builder::new_current_thread(), max_concurrent_solves + 1)
}

/// With so many threads for what waits or computes. They stay, and one is there from the start: where the system refuses one and there is no other, tokio panics.
fn with_threads(builder: &mut Builder, most: usize) -> io::Result<Runtime> {
    const FOR_EVER: Duration = Duration::from_secs(u32::MAX as u64);
    let runtime = builder.max_blocking_threads(most).thread_keep_alive(FOR_EVER).build()?;
    runtime.block_on(runtime.spawn_blocking(|| ())).map_err(io::Error::other)?;
    Ok(runtime)
}

/// A solve beyond its bound must not hold up the exit, nor a name that nobody answers for.
fn end(runtime: Runtime, solves: Runtime) {
    runtime.shutdown_background();
    solves.shutdown_background();
}

fn run_service(settings: &Settings) -> Result<(), Failure> {
    let address = settings.store.address().map_err(Failure::BadInput)?;
    let parts = settings.parts.of_service(address.as_ref()).map_err(Failure::BadInput)?;
    let filter = EnvFilter::try_new(&settings.log).map_err(|error| Failure::BadInput(error.to_string()))?;
    memory::keep_pages_small();
    log::start(filter)?;
    let (solves, runtime) = (threads_of_solves(settings.limits().max_concurrent_solves)?, runtime()?);
    let result = runtime.block_on(serve::serve(settings, address.as_ref(), parts, solves.handle()));
    end(runtime, solves);
    log::flush();
    Ok(result?)
}

/// The database that the settings name: a file would be one process's alone.
fn shared_database(settings: &StoreSettings) -> Result<Address, Failure> {
    match settings.address().map_err(Failure::BadInput)? {
        Some(address) if address.is_shared() => Ok(address),
        Some(file) => Err(Failure::BadInput(format!(
            "{file}: a file serves one process, the service, which computes its studies itself; workers share `postgres://…`"
        ))),
        None => Err(Failure::BadInput("`--studies postgres://…` names the database that holds the studies".into())),
    }
}

fn run_worker(settings: &WorkerSettings) -> Result<(), Failure> {
    let address = shared_database(&settings.store)?;
    let parts = settings.parts.parts().map_err(Failure::BadInput)?;
    let filter = EnvFilter::try_new(&settings.log).map_err(|error| Failure::BadInput(error.to_string()))?;
    memory::keep_pages_small();
    log::start(filter)?;
    let (solves, runtime) = (threads_of_solves(settings.limits().max_concurrent_solves)?, runtime()?);
    let result = runtime.block_on(serve::serve_chunks(settings, &address, parts, solves.handle()));
    end(runtime, solves);
    log::flush();
    Ok(result?)
}

fn migrate(settings: &StoreSettings) -> Result<(), Failure> {
    let address = shared_database(settings)?;
    let runtime = Builder::new_current_thread().enable_all().build()?;
    let before = runtime.block_on(async { Store::open(&address).await?.migrate().await }).map_err(io::Error::other)?;
    print(|writer| writeln!(writer, "{address}: schema {before} before, {SCHEMA_VERSION} now"))
}

/// Without a server only memory limits what is computed: some two gigabytes of it.
const OFFLINE: Limits = Limits { max_states: 20_000_000, max_profile_points: 20_000_000 };

fn answer<Q: Question>(question: Q, file: &Path, format: Format) -> Result<(), Failure> {
    // What fails inside says why in the log.
    tracing_subscriber::fmt().with_max_level(tracing::Level::ERROR).with_writer(io::stderr).init();
    require_form::<Q::Answer>(format)?;
    let text = read(file)?;
    print_answer(&question.ask(&text, &OFFLINE, &AtomicBool::new(false)).map_err(Problem::from)?, format)
}

fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    let mut text = Vec::new();
    if file.as_os_str() == "-" {
        io::stdin().read_to_end(&mut text)?;
    } else {
        File::open(file)
            .and_then(|mut file| file.read_to_end(&mut text))
            .map_err(|error| Failure::BadInput(format!("{}: {error}", file.display())))?;
    }
    Ok(text)
}

fn convert(file: &Path) -> Result<(), Failure> {
    let document = converted(&read(file)?).map_err(Problem::from)?;
    print(|writer| writeln!(writer, "{document}"))
}

fn print_answer(answer: &impl Forms, format: Format) -> Result<(), Failure> {
    print(|writer| {
        answer.write(format, writer)?;
        // The other formats end their last line themselves.
        if format == Format::Json { writeln!(writer) } else { Ok(()) }
    })
}

/// Without a server only memory limits what is computed.
const OFFLINE_STUDY: toothwave_study::Limits =
    toothwave_study::Limits { calculation: OFFLINE, max_study_variants: 1_000_000_000, max_study_bytes: 8 << 30 };

fn study(file: &Path, format: Format) -> Result<(), Failure> {
    tracing_subscriber::fmt().with_max_level(tracing::Level::ERROR).with_writer(io::stderr).init();
    require_form::<StudyAnswer>(format)?;
    let study = Arc::new(Study::read(&read(file)?, &OFFLINE_STUDY).map_err(Problem::from)?);
    let progress = progress_bar();
    progress.set_length(study.variants());
    let gathered = Mutex::new(Gathered::new(&study));
    (0..study.chunks()).into_par_iter().for_each(|chunk| {
        // Nobody stops it but by ending the process.
        let Ok(part) = Work::new(&study, chunk).run(&AtomicBool::new(false)) else { return };
        let mut gathered = gathered.lock();
        gathered.add(chunk, part);
        progress.set_position(gathered.variants());
    });
    progress.finish_and_clear();
    print_answer(&gathered.into_inner().answer(), format)
}

/// Drawn on standard error, and only where that is a terminal.
fn progress_bar() -> ProgressBar {
    ProgressBar::new(0).with_style(
        ProgressStyle::with_template("{bar:40} {percent}% {msg}, {elapsed} gone, {eta} to go")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    )
}

/// Lines that are answered side by side before the first of them is written: of whole answers few, because they are long.
const fn lines_at_once(query: BatchQuery, cores: usize) -> usize {
    if query.peaks_only { 256 * cores } else { 2 * cores }
}

fn batch(file: &Path, query: BatchQuery) -> Result<(), Failure> {
    tracing_subscriber::fmt().with_max_level(tracing::Level::ERROR).with_writer(io::stderr).init();
    query.require_possible()?;
    let open = |error: io::Error| Failure::BadInput(format!("{}: {error}", file.display()));
    let (input, bytes): (Box<dyn BufRead>, Option<u64>) = if file.as_os_str() == "-" {
        (Box::new(io::stdin().lock()), None)
    } else {
        let opened = File::open(file).map_err(open)?;
        let bytes = opened.metadata().map_err(open)?.len();
        (Box::new(io::BufReader::new(opened)), Some(bytes))
    };
    let progress = progress_bar();
    progress.set_length(bytes.unwrap_or(0));
    let mut lines = input.split(b'\n');
    let mut index = 0;
    let room = Room::new(u64::MAX);
    print(|writer| {
        loop {
            let chunk: Vec<_> =
                lines.by_ref().take(lines_at_once(query, rayon::current_num_threads())).collect::<io::Result<_>>()?;
            if chunk.is_empty() {
                progress.finish_and_clear();
                let end = BatchEnd { asked: index, answered: index, problem: None };
                return writer.write_all(&end.line());
            }
            progress.inc(chunk.iter().map(|line| line.len() as u64 + 1).sum());
            let documents: Vec<_> = chunk.iter().filter(|line| !line.trim_ascii().is_empty()).zip(index..).collect();
            let answers: Vec<_> = documents
                .par_iter()
                .map(|&(document, index)| {
                    let answer = answer_line(query, index, document, &OFFLINE, &room, &AtomicBool::new(false));
                    answer.note_told();
                    answer.text
                })
                .collect();
            index += documents.len() as u64;
            progress.set_message(format!("{index} designs"));
            answers.iter().try_for_each(|answer| writer.write_all(answer))?;
        }
    })
}

fn require_form<A: Forms>(format: Format) -> Result<(), Failure> {
    let known: Vec<_> = iter::once(Format::Json).chain(A::FORMS.iter().map(|(format, _)| *format)).collect();
    if known.contains(&format) {
        return Ok(());
    }
    let name = |format: &Format| FORMATS.iter().find(|choice| choice.value == *format).map_or("", |choice| choice.word);
    let names: Vec<_> = known.iter().map(name).collect();
    Err(Failure::BadInput(format!("this answer has no form `{}`; choose one of {}", name(&format), names.join(", "))))
}

/// Writes to standard output; a reader that has seen enough is no failure.
fn print(write: impl FnOnce(&mut io::BufWriter<io::StdoutLock<'static>>) -> io::Result<()>) -> Result<(), Failure> {
    let mut writer = io::BufWriter::new(io::stdout().lock());
    match write(&mut writer).and_then(|()| writer.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

fn new_key(name: &str) -> Result<(), Failure> {
    if name.contains(char::is_control) {
        return Err(Failure::BadInput("a key's name is one line of text".into()));
    }
    let (key, line) = keys::new_key(name).map_err(io::Error::other)?;
    print(|writer| writeln!(writer, "key, for its holder:        {key}\nline, for the keys file:    {line}"))
}

fn health(mut address: SocketAddr) -> Result<(), Failure> {
    const PATIENCE: Duration = Duration::from_secs(2);
    if address.ip().is_unspecified() {
        // What listens everywhere also answers here.
        address.set_ip(if address.is_ipv4() { [127, 0, 0, 1].into() } else { std::net::Ipv6Addr::LOCALHOST.into() });
    }
    let connected = TcpStream::connect_timeout(&address, PATIENCE);
    let mut stream = connected.map_err(|error| io::Error::new(error.kind(), format!("{address}: {error}")))?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    write!(stream, "GET /health/live HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n")?;
    let mut head = [0; 12];
    stream.read_exact(&mut head)?;
    if head == *b"HTTP/1.1 200" { Ok(()) } else { Err(io::Error::other("the service is not well").into()) }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use clap::Parser as _;

    use super::{Cli, Command, LOOK_UPS, end, runtime, threads_of_solves};
    use crate::compute::{Lane, Pool, Thread};
    use crate::problem::Problem;

    /// One study of variants of some seconds each had ordinary sweeps refused at their deadline: each had a permit, and no thread; and so had a database whose name nobody
    /// looked up.
    #[test]
    fn a_single_solve_has_a_thread_beside_slices_that_hold_all_permits_and_look_ups_that_do_not_end() {
        let cli = Cli::parse_from(["toothwave", "serve", "--max-concurrent-solves", "2"]);
        let Command::Serve(settings) = cli.command else { panic!("a service") };
        let limits = settings.limits();
        let runtime = runtime().expect("a runtime");
        let solves = threads_of_solves(limits.max_concurrent_solves).expect("threads");
        let answer = runtime.block_on(async {
            let pool = Pool::new(limits).on(solves.handle());
            let look_ups = (0..2 * LOOK_UPS).map(|_| {
                let (release, released) = mpsc::channel::<()>();
                tokio::task::spawn_blocking(move || released.recv());
                release
            });
            let _unanswered: Vec<_> = look_ups.collect();
            let (senders, slices): (Vec<_>, Vec<_>) = (0..2)
                .map(|_| {
                    let (release, released) = mpsc::channel::<()>();
                    let (pool, mut lane) = (pool.clone(), Lane::default());
                    let slice =
                        async move { pool.run_variants(&mut lane, 0, move |_, _| Ok(released.recv().is_err())).await };
                    (release, tokio::spawn(slice))
                })
                .unzip();
            while pool.running() < 2 {
                tokio::task::yield_now().await;
            }
            let answer = pool.run(pool.deadline(), Thread::Blocking, |_| Ok(7)).await;
            drop(senders);
            for slice in slices {
                slice.await.map_err(|error| Problem::internal(&error))??;
            }
            answer
        });
        end(runtime, solves);
        assert!(answer.is_ok_and(|answer| answer == 7));
    }
}
