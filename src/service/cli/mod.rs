//! The command line: the service, the same answers without a server, and helpers for containers.

mod batch;
mod offline;
mod study;

use std::ffi::OsString;
use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use tokio::runtime::Builder;
use toothwave_calculation::accuracy::Accuracy;
use toothwave_calculation::coincidence_degree::CoincidenceDegree;
use toothwave_calculation::drawing::preset::Preset;
use toothwave_calculation::drawing::{Drawing, DrawnPart};
use toothwave_calculation::forms::Format;
use toothwave_calculation::geometry::Geometry;
use toothwave_calculation::sweep::Sweep;
use toothwave_study::converted;

use crate::http::endpoints::batch::{BatchEndpoint, BatchQuery};
use crate::http::observe::note_problem;
use crate::http::problem::Problem;
use crate::http::{router, server};
use crate::ops::config::Settings;
use crate::ops::{keys, log};
use crate::unix::outlive_file_size_limit;
use offline::{FORMATS, PARTS, answer, one_of, print, read};

/// Exit status for bad input: 2, as in most tools.
const EXIT_BAD_INPUT: u8 = 2;

/// Forces and contact stresses of discrete-tooth harmonic drives.
#[derive(Debug, Parser)]
#[command(name = "toothwave", version, after_help = "Example: toothwave sweep design.json")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve over HTTP; the default without a command
    #[command(after_help = "Example: toothwave serve --listen 127.0.0.1:8080 --studies studies.db")]
    Serve(Box<Settings>),
    /// Compute the profiles of the mating parts
    #[command(after_help = "Example: toothwave geometry design.json")]
    Geometry(Offline),
    /// Compute the contact ratio (coincidence degree): how many teeth share the load
    #[command(after_help = "Example: toothwave coincidence-degree design.json")]
    CoincidenceDegree(Offline),
    /// Compute forces and contact stresses over one period
    #[command(after_help = "Example: toothwave sweep design.json --format csv > states.csv")]
    Sweep(Offline),
    /// Measure the error and the time of each computation method for a design
    #[command(after_help = "Example: toothwave accuracy design.json")]
    Accuracy(Offline),
    /// Write one part, or the assembly, as DXF, STEP, SVG, 3MF or STL
    #[command(after_help = "Example: toothwave draw ring design.json --format dxf > ring.dxf")]
    Draw {
        /// The part
        #[arg(value_parser = one_of(&PARTS))]
        part: DrawnPart,
        /// A design document, or `-` for standard input
        file: PathBuf,
        /// Format of the drawing
        #[arg(long, value_parser = one_of(&FORMATS), default_value = "dxf")]
        format: Format,
        /// Set each `parts.*.clearance_um` to 50, so that each contact has a gap of 0.1 mm
        #[arg(long)]
        printing: bool,
    },
    /// Compute many designs, one a line, on all cores; write the answers as NDJSON in the same order
    #[command(after_help = "Example: toothwave batch designs.ndjson --peaks-only > answers.ndjson")]
    Batch {
        /// File with one design document a line, or `-` for standard input
        file: PathBuf,
        /// Calculation for every document
        #[arg(long, value_enum, default_value_t = BatchEndpoint::Sweep)]
        endpoint: BatchEndpoint,
        /// For sweeps: write the peaks, without the states
        #[arg(long)]
        peaks_only: bool,
    },
    /// Compute many variants of one design on all cores: map, search, sensitivity or tolerance study
    #[command(after_help = "Example: toothwave study study.json --format csv > result.csv")]
    Study(study::StudyCommand),
    /// Print a document without its deprecated fields
    #[command(after_help = "Example: toothwave convert old.json > new.json")]
    Convert {
        /// A design document or a study document, or `-` for standard input
        file: PathBuf,
    },
    /// Commands of earlier builds
    #[command(hide = true, aliases = ["migrate"])]
    Worker {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        _any: Vec<OsString>,
    },
    /// Check that a running service answers; exit status 0 if it does
    #[command(after_help = "Example: toothwave health --address 127.0.0.1:8080")]
    Health {
        /// Address and port of the service
        #[arg(long, env = "TOOTHWAVE_LISTEN", value_name = "ADDR", default_value = "127.0.0.1:8080")]
        address: SocketAddr,
    },
    /// Print the API document
    #[command(after_help = "Example: toothwave openapi > openapi.json")]
    Openapi,
    /// Make a key: print it once, with its line for the keys file
    #[command(after_help = "Example: toothwave new-key 'drawing office'")]
    NewKey {
        /// Name of the key's owner
        name: String,
    },
}

#[derive(Debug, Args)]
struct Offline {
    /// A design document, or `-` for standard input
    file: PathBuf,
    /// Format of the answer; `table` is the same as `text`
    #[arg(long, value_parser = one_of(&FORMATS), default_value = "text")]
    format: Format,
}

/// Reason for the failure of a command.
#[derive(Debug)]
enum Failure {
    /// The document or a setting is wrong.
    BadInput(String),
    /// A file, a socket or a thread failed.
    Io(io::Error),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<Problem> for Failure {
    fn from(problem: Problem) -> Self {
        note_problem(&problem);
        // The command line has fixed limits and no settings of these names.
        let limits = ["`max_states`", "`max_profile_points`", "`max_study_variants`", "`max_study_bytes`"];
        let text = limits.iter().fold(problem.to_string(), |text, limit| text.replace(limit, "the command line"));
        match problem.cause {
            Some(_) => Self::Io(io::Error::other(text)),
            None => Self::BadInput(text),
        }
    }
}

/// Runs the command in the arguments of this process.
pub fn run() -> ExitCode {
    let cli = Cli::parse_from(arguments());
    let result = match cli.command {
        Command::Serve(settings) => run_service(&settings),
        Command::Geometry(offline) => answer(Geometry, &offline.file, offline.format),
        Command::CoincidenceDegree(offline) => answer(CoincidenceDegree, &offline.file, offline.format),
        Command::Sweep(offline) => answer(Sweep, &offline.file, offline.format),
        Command::Accuracy(offline) => answer(Accuracy, &offline.file, offline.format),
        Command::Draw { part, file, format, printing } => {
            let preset = if printing { Preset::Printing } else { Preset::Document };
            answer(Drawing { part, preset }, &file, format)
        }
        Command::Batch { file, endpoint, peaks_only } => batch::run(&file, BatchQuery { endpoint, peaks_only }),
        Command::Study(command) => study::run(&command),
        Command::Convert { file } => convert(&file),
        Command::Worker { .. } => Err(Failure::BadInput(
            "the commands `worker` and `migrate` were removed: `toothwave --studies FILE` computes its studies itself"
                .into(),
        )),
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

fn complain(what: &dyn std::fmt::Display, status: ExitCode) -> ExitCode {
    // Standard error may be closed.
    let _ = writeln!(io::stderr(), "toothwave: {}", printable(&what.to_string()));
    status
}

/// Escapes control characters for a terminal. The text may quote a document from someone else.
fn printable(text: &str) -> String {
    let escaped = |character: char| match character {
        '\n' => character.to_string(),
        _ if character.is_control() => character.escape_default().to_string(),
        _ => character.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// Returns the arguments of this process, with the command `serve` if there is no command. Only `serve` reads the
/// settings, so a wrong environment variable does not stop other commands.
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

fn run_service(settings: &Settings) -> Result<(), Failure> {
    let _written_at_end = log::start(settings.log.clone());
    // With transparent huge pages, clearing 2 MiB for each answer of 80 KB takes a sixth of its time.
    #[cfg(target_os = "linux")]
    let _ = rustix::thread::disable_transparent_huge_pages(true);
    let runtime = Builder::new_multi_thread().enable_all().build()?;
    let result = runtime.block_on(async {
        outlive_file_size_limit()?;
        server::serve(settings).await
    });
    // A computation after its time limit must not delay the exit.
    runtime.shutdown_background();
    Ok(result?)
}

fn convert(file: &Path) -> Result<(), Failure> {
    let document = converted(&read(file)?).map_err(Problem::from)?;
    print(|writer| writeln!(writer, "{document}"))
}

fn new_key(name: &str) -> Result<(), Failure> {
    if name.contains(char::is_control) {
        return Err(Failure::BadInput("the name contains a control character. Use one line of text".into()));
    }
    let (key, line) = keys::new_key(name).map_err(io::Error::other)?;
    print(|writer| writeln!(writer, "key, for its holder:        {key}\nline, for the keys file:    {line}"))
}

fn health(mut address: SocketAddr) -> Result<(), Failure> {
    const TIMEOUT: Duration = Duration::from_secs(2);
    if address.ip().is_unspecified() {
        // A service on all addresses also listens on the loopback address.
        address.set_ip(if address.is_ipv4() { [127, 0, 0, 1].into() } else { std::net::Ipv6Addr::LOCALHOST.into() });
    }
    let connected = TcpStream::connect_timeout(&address, TIMEOUT);
    let mut stream = connected.map_err(|error| io::Error::new(error.kind(), format!("{address}: {error}")))?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    stream.set_write_timeout(Some(TIMEOUT))?;
    write!(stream, "GET /health/live HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n")?;
    let mut head = [0; 12];
    stream.read_exact(&mut head)?;
    if head == *b"HTTP/1.1 200" {
        Ok(())
    } else {
        Err(io::Error::other("the service is not healthy. Read its log").into())
    }
}
