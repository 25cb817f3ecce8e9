//! Settings of the service: each a flag and a `TOOTHWAVE_…` variable.

use std::net::{Ipv4Addr, SocketAddr};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use axum::http::Uri;
use clap::Args;
use serde::Serialize;
use toothwave_calculation::question;
use tracing_subscriber::EnvFilter;
use utoipa::ToSchema;

use crate::keys::Keys;
use crate::machine;
use crate::room::SMALL_BYTES;

/// Solves that may be allowed to run or to wait: more than any machine can, fewer than a semaphore can count.
const MOST_SOLVES: i64 = 1_000_000;

/// Of the memory this is nobody's: the process itself, what solves need beside their answers, what the kernel keeps for connections, and what the
/// allocator cannot give back. Of a small memory three quarters at most.
const HELD_BACK_BYTES: u64 = 64 << 20;

/// For each solve at once beyond so many as much more: each keeps up to 4 MiB on its thread that the allocator gives back to nobody else.
const SOLVES_WITHIN: usize = 6;
const KEPT_BY_SOLVE_BYTES: u64 = 4 << 20;

/// Of the memory, for each solve that runs at once, by default.
const MEMORY_PER_SOLVE_BYTES: u64 = 32 << 20;

/// Of the memory, for each connection, by default: an eighth of it is what a connection may hold without taking room.
const MEMORY_PER_CONNECTION_BYTES: u64 = 8 * SMALL_BYTES;

/// By default.
const MOST_CONNECTIONS: usize = 1024;

/// Where the machine does not tell.
const UNKNOWN_MEMORY_BYTES: u64 = 2 << 30;

/// By default, for each solve that runs at once: room for one of a million states that is made, and for another one on its way.
const MOST_UNREAD_BYTES_PER_SOLVE: u64 = 512 << 20;

/// By default.
const MOST_CACHE_BYTES: u64 = 256 << 20;

/// By default.
const MOST_STUDY_BYTES: u64 = 256 << 20;

/// States or points, by default.
const MOST_OF_AN_ANSWER: u64 = 1_000_000;

/// What a state takes while its answer is made: its columns and their text.
const STATE_BYTES: u64 = 320;

/// What a point takes in the longest form, STEP.
const POINT_BYTES: u64 = 800;

/// Bytes of a request's line and headers together, at most.
pub const MAX_HEADER_BYTES: usize = 40_960;

/// The settings of `toothwave serve`.
#[derive(Debug, Clone, Args)]
pub struct Settings {
    /// Address and port to listen on
    #[arg(long, env = "TOOTHWAVE_LISTEN", value_name = "ADDR", default_value_t = SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)))]
    pub listen: SocketAddr,

    /// Largest request body
    #[arg(long, env = "TOOTHWAVE_MAX_BODY_BYTES", value_name = "BYTES", default_value_t = 65_536)]
    pub max_body_bytes: usize,

    /// Most states of a sweep [default: 1000000, or as many as have room in max-unread-bytes]
    #[arg(long, env = "TOOTHWAVE_MAX_STATES", value_name = "N")]
    pub max_states: Option<u64>,

    /// Most points of all profiles of a geometry [default: 1000000, or as many as have room in max-unread-bytes]
    #[arg(long, env = "TOOTHWAVE_MAX_PROFILE_POINTS", value_name = "N")]
    pub max_profile_points: Option<u64>,

    /// Solves that run at once [default: the cores that the process may use, or one for each 32 MiB of the memory]
    #[arg(long, env = "TOOTHWAVE_MAX_CONCURRENT_SOLVES", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SOLVES))]
    pub max_concurrent_solves: Option<u32>,

    /// Solves that may wait for their turn
    #[arg(long, env = "TOOTHWAVE_MAX_QUEUED_SOLVES", value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(..=MOST_SOLVES))]
    pub max_queued_solves: u32,

    /// Batches that may run at once
    #[arg(long, env = "TOOTHWAVE_MAX_CONCURRENT_BATCHES", value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=MOST_SOLVES))]
    pub max_concurrent_batches: u32,

    /// Milliseconds from a request's arrival after which its computation is stopped
    #[arg(long, env = "TOOTHWAVE_DEADLINE_MS", value_name = "MS", default_value_t = 10_000)]
    pub deadline_ms: u64,

    /// Most bytes of answers that the cache keeps [default: 256 MiB, or an eighth of the memory but for 64 MiB and 4 MiB for each concurrent solve beyond six]
    #[arg(long, env = "TOOTHWAVE_CACHE_MAX_BYTES", value_name = "BYTES")]
    pub cache_max_bytes: Option<u64>,

    /// Most bytes of answers that nobody has read yet: being made, in batches, on their way, those up to 256 KiB not counted; and of bodies above 128 KiB that arrive
    /// [default: 512 MiB for each solve that runs at once, or half of the memory but for 64 MiB and 4 MiB for each solve beyond six]
    #[arg(long, env = "TOOTHWAVE_MAX_UNREAD_BYTES", value_name = "BYTES")]
    pub max_unread_bytes: Option<u64>,

    /// Most variants of a study
    #[arg(long, env = "TOOTHWAVE_MAX_STUDY_VARIANTS", value_name = "N", default_value_t = 10_000_000)]
    pub max_study_variants: u64,

    /// Most bytes that a study takes with its result, and without a file all studies together [default: 256 MiB, or a quarter of max-unread-bytes]
    #[arg(long, env = "TOOTHWAVE_MAX_STUDY_BYTES", value_name = "BYTES")]
    pub max_study_bytes: Option<u64>,

    /// Studies that may run at once
    #[arg(long, env = "TOOTHWAVE_MAX_CONCURRENT_STUDIES", value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(..=MOST_SOLVES))]
    pub max_concurrent_studies: u32,

    /// Milliseconds after which a study breaks off
    #[arg(long, env = "TOOTHWAVE_STUDY_DEADLINE_MS", value_name = "MS", default_value_t = 3_600_000)]
    pub study_deadline_ms: u64,

    /// File in which studies are kept, or `off` for none [default: in memory]
    #[arg(long, env = "TOOTHWAVE_STUDIES", value_name = "FILE|off", value_parser = studies)]
    pub studies: Option<StudiesPlace>,

    /// Settings of earlier builds
    #[command(flatten)]
    pub removed: RemovedSettings,

    /// Seconds after which a study that nobody has asked for is forgotten
    #[arg(long, env = "TOOTHWAVE_STUDY_EXPIRY_S", value_name = "S", default_value_t = 2_592_000)]
    pub study_expiry_s: u64,

    /// Connections that may be open at once [default: 1024, or one for each 2 MiB of the memory]
    #[arg(long, env = "TOOTHWAVE_MAX_CONNECTIONS", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SOLVES))]
    pub max_connections: Option<u32>,

    /// Milliseconds in which a request's line and headers have to arrive, and after which a silent connection is closed
    #[arg(long, env = "TOOTHWAVE_HEADER_TIMEOUT_MS", value_name = "MS", default_value_t = 30_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub header_timeout_ms: u64,

    /// File of key hashes (see `toothwave new-key`): with it every path but health and the page wants a bearer token
    #[arg(long, env = "TOOTHWAVE_KEYS_FILE", value_name = "FILE", value_parser = Keys::read)]
    pub keys_file: Option<Keys>,

    /// Origin that browsers may call from, or `*`; may be given several times, in the variable separated by commas
    #[arg(long = "cors-origin", env = "TOOTHWAVE_CORS_ORIGINS", value_name = "ORIGIN", value_delimiter = ',', value_parser = origin)]
    pub cors_origins: Vec<String>,

    /// Milliseconds after a signal to stop in which the service still takes what comes, not ready any more and closing each connection
    /// after its answer, so that whoever spreads requests can turn to others
    #[arg(long, env = "TOOTHWAVE_LAME_DUCK_MS", value_name = "MS", default_value_t = 0)]
    pub lame_duck_ms: u64,

    /// Milliseconds that running requests get to finish after a signal to stop; below the ten seconds that container engines wait
    #[arg(long, env = "TOOTHWAVE_SHUTDOWN_MS", value_name = "MS", default_value_t = 8_000)]
    pub shutdown_ms: u64,

    /// What is logged, as tracing-subscriber's EnvFilter reads it
    #[arg(long, env = "TOOTHWAVE_LOG", value_name = "FILTER", default_value = "info", value_parser = log_filter)]
    pub log: String,
}

/// Where studies are kept, if not in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StudiesPlace {
    /// Nowhere.
    Off,
    /// In this file.
    File(PathBuf),
}

fn studies(text: &str) -> Result<StudiesPlace, String> {
    match text {
        "off" => Ok(StudiesPlace::Off),
        "" | ":memory:" => Err("name a file; without this setting studies are kept in memory".into()),
        address if address.starts_with("postgres:") || address.starts_with("postgresql:") => {
            Err("studies are kept in a file of one service, no longer in PostgreSQL: use `--studies FILE`".into())
        }
        file => Ok(StudiesPlace::File(file.into())),
    }
}

/// Settings that earlier builds had: each ends the start with a sentence that names its replacement.
#[derive(Debug, Clone, Args)]
pub struct RemovedSettings {
    #[arg(long, env = "TOOTHWAVE_REPLICAS", hide = true, value_parser = |_: &str| removed("let one service with `--studies FILE` take all studies, and start the others with `--studies off`"))]
    replicas: Option<()>,
    #[arg(long, env = "TOOTHWAVE_STUDY_PARTS", hide = true, value_parser = |_: &str| removed("read `/v1/studies/{id}/result` as Parquet"))]
    study_parts: Option<()>,
    #[arg(long, env = "TOOTHWAVE_STUDIES_PASSWORD_FILE", hide = true, value_parser = |_: &str| removed("use `--studies FILE`, which needs no password"))]
    studies_password_file: Option<()>,
}

fn removed(replacement: &str) -> Result<(), String> {
    Err(format!("this setting was removed: {replacement}"))
}

fn that_fit(memory_bytes: u64, each_bytes: u64) -> usize {
    usize::try_from(memory_bytes / each_bytes).unwrap_or(usize::MAX).max(1)
}

/// The limits that a client can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct Limits {
    /// Most states of a sweep.
    pub max_states: u64,
    /// Most points of all profiles of a geometry.
    pub max_profile_points: u64,
    /// Largest request body.
    pub max_body_bytes: usize,
    /// Solves that run at once.
    pub max_concurrent_solves: usize,
    /// Solves that may wait for their turn.
    pub max_queued_solves: usize,
    /// Batches that may run at once.
    pub max_concurrent_batches: usize,
    /// Milliseconds from a request's arrival after which its computation is stopped.
    pub deadline_ms: u64,
    /// Most bytes of answers that the cache keeps.
    pub cache_max_bytes: u64,
    /// Most bytes of answers that nobody has read yet: being made, in batches, on their way, those up to 256 KiB not counted; and of bodies above 128 KiB that arrive.
    pub max_unread_bytes: u64,
    /// Most variants of a study.
    pub max_study_variants: u64,
    /// Most bytes that a study takes with its result, and without a file all studies together.
    pub max_study_bytes: u64,
    /// Studies that may run at once.
    pub max_concurrent_studies: usize,
    /// Milliseconds after which a study breaks off.
    pub study_deadline_ms: u64,
    /// Connections that may be open at once.
    pub max_connections: usize,
    /// Bytes of a request's line and headers together.
    pub max_header_bytes: usize,
    /// Milliseconds in which a request's line and headers have to arrive, and after which a silent connection is closed.
    pub header_timeout_ms: u64,
}

impl Limits {
    /// Those that the calculation keeps.
    pub const fn of_calculation(&self) -> question::Limits {
        question::Limits { max_states: self.max_states, max_profile_points: self.max_profile_points }
    }

    /// Those that studies keep.
    pub const fn of_studies(&self) -> toothwave_study::Limits {
        toothwave_study::Limits {
            calculation: self.of_calculation(),
            max_study_variants: self.max_study_variants,
            max_study_bytes: self.max_study_bytes,
        }
    }
}

impl Settings {
    /// The limits among the settings.
    pub fn limits(&self) -> Limits {
        self.limits_of(machine::memory_bytes().unwrap_or(UNKNOWN_MEMORY_BYTES), cores())
    }

    /// Those on a machine with so much memory and so many cores for the process.
    fn limits_of(&self, memory_bytes: u64, cores: usize) -> Limits {
        let solves_that_fit = that_fit(memory_bytes, MEMORY_PER_SOLVE_BYTES);
        let max_concurrent_solves =
            self.max_concurrent_solves.map_or_else(|| cores.min(solves_that_fit), |solves| solves as usize);
        let connections_that_fit = that_fit(memory_bytes, MEMORY_PER_CONNECTION_BYTES).min(MOST_CONNECTIONS);
        let kept_bytes = KEPT_BY_SOLVE_BYTES * max_concurrent_solves.saturating_sub(SOLVES_WITHIN) as u64;
        let shared_bytes = memory_bytes.saturating_sub(HELD_BACK_BYTES + kept_bytes).max(memory_bytes / 4);
        let max_unread_bytes = self
            .max_unread_bytes
            .unwrap_or_else(|| (shared_bytes / 2).min(max_concurrent_solves as u64 * MOST_UNREAD_BYTES_PER_SOLVE));
        let with_room_for = |each_bytes: u64| MOST_OF_AN_ANSWER.min(max_unread_bytes / each_bytes).max(1);
        Limits {
            max_states: self.max_states.unwrap_or_else(|| with_room_for(STATE_BYTES)),
            max_profile_points: self.max_profile_points.unwrap_or_else(|| with_room_for(POINT_BYTES)),
            max_body_bytes: self.max_body_bytes,
            max_concurrent_solves,
            max_queued_solves: self.max_queued_solves as usize,
            max_concurrent_batches: self.max_concurrent_batches as usize,
            deadline_ms: self.deadline_ms,
            cache_max_bytes: self.cache_max_bytes.unwrap_or_else(|| MOST_CACHE_BYTES.min(shared_bytes / 8)),
            max_unread_bytes,
            max_study_variants: self.max_study_variants,
            max_study_bytes: self.max_study_bytes.unwrap_or_else(|| MOST_STUDY_BYTES.min(max_unread_bytes / 4)),
            max_concurrent_studies: self.max_concurrent_studies as usize,
            study_deadline_ms: self.study_deadline_ms,
            max_connections: self.max_connections.map_or(connections_that_fit, |connections| connections as usize),
            max_header_bytes: MAX_HEADER_BYTES,
            header_timeout_ms: self.header_timeout_ms,
        }
    }

    /// The time in which the service still takes what comes, though it is told to stop.
    pub const fn lame_duck(&self) -> Duration {
        Duration::from_millis(self.lame_duck_ms)
    }

    /// The bound on a shutdown.
    pub const fn shutdown(&self) -> Duration {
        Duration::from_millis(self.shutdown_ms)
    }
}

/// Those that the process may use.
fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// An origin as browsers write it in `Origin`, or `*`, which stands for all. Written otherwise it would be none that comes.
fn origin(text: &str) -> Result<String, String> {
    let is_origin = || {
        let uri = text.parse::<Uri>().ok()?;
        let (scheme, host) = (uri.scheme_str()?, uri.host()?);
        let port = uri.port_u16().filter(|port| !matches!((scheme, port), ("http", 80) | ("https", 443)));
        let port = port.map_or_else(String::new, |port| format!(":{port}"));
        let written = format!("{scheme}://{host}{port}").to_ascii_lowercase();
        Some(written == text && !host.contains('*'))
    };
    if text == "*" || is_origin() == Some(true) {
        Ok(text.into())
    } else {
        Err("an origin is written as browsers send it: a scheme, a host in small letters and a port where it is not the scheme's own, and no path; or `*` alone for all".into())
    }
}

fn log_filter(text: &str) -> Result<String, String> {
    EnvFilter::try_new(text).map(|_| text.into()).map_err(|error| format!("no log filter: {error}"))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::{SMALL_BYTES, Settings, origin};

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }

    /// Others started, and allowed nobody.
    #[test]
    fn an_origin_is_written_as_browsers_send_it() {
        for taken in ["*", "https://a.example", "http://localhost:8081", "http://[::1]:8081", "https://a.example:80"] {
            assert_eq!(origin(taken).as_deref(), Ok(taken));
        }
        for refused in [
            "https://*.a.example",
            "https://A.example",
            "https://a.example:443",
            "a.example",
            "null",
            "https://a.example/",
        ] {
            assert!(origin(refused).is_err(), "{refused}");
        }
    }

    /// The process itself takes some 25 MiB, and half as much again goes to what is not counted.
    #[test]
    fn what_may_be_held_by_default_leaves_the_process_its_part_of_the_memory() {
        let Line { settings } = Line::parse_from(["serve"]);
        for memory_mib in [128, 200, 256, 512, 1024, 2048, 65_536] {
            for cores in [1, 2, 16, 128] {
                let memory_bytes = memory_mib << 20;
                let limits = settings.limits_of(memory_bytes, cores);
                let of_connections = limits.max_connections as u64 * SMALL_BYTES;
                let held = limits.max_unread_bytes + limits.cache_max_bytes + of_connections;
                assert!(held + (38 << 20) <= memory_bytes, "{memory_mib} MiB, {cores} cores: {held}");
                assert!(limits.max_study_bytes < limits.max_unread_bytes);
                assert!(limits.max_concurrent_solves as u64 * (32 << 20) <= memory_bytes);
            }
        }
    }

    /// Sixteen threads that had each solved a few ordinary sweeps kept 62 MiB, which was all that nobody else has.
    #[test]
    fn more_solves_at_once_than_a_small_memory_has_by_default_leave_less_to_answers() {
        let of = |words: &[&str]| Line::parse_from(words).settings.limits_of(200 << 20, 16);
        let (few, many) = (of(&["serve"]), of(&["serve", "--max-concurrent-solves", "16"]));
        assert_eq!((few.max_concurrent_solves, few.max_unread_bytes), (6, 68 << 20));
        assert_eq!((many.max_unread_bytes, many.cache_max_bytes), (48 << 20, 12 << 20));
    }

    #[test]
    fn removed_settings_name_their_replacement() {
        for (words, replacement) in [
            (["serve", "--replicas", "2"], "--studies off"),
            (["serve", "--study-parts", "parts"], "/result"),
            (["serve", "--studies-password-file", "password"], "--studies FILE"),
            (["serve", "--studies", "postgres://any@db/studies"], "--studies FILE"),
            (["serve", "--studies", ":memory:"], "name a file"),
        ] {
            let refused = Line::try_parse_from(words).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(refused.contains(replacement), "{refused}");
        }
    }

    #[test]
    fn a_large_memory_is_used_as_far_as_its_cores_need_it() {
        let Line { settings } = Line::parse_from(["serve"]);
        let limits = settings.limits_of(16 << 30, 4);
        assert_eq!(limits.max_unread_bytes, 2 << 30);
        assert_eq!(limits.cache_max_bytes, 256 << 20);
        assert_eq!(limits.max_concurrent_solves, 4);
        assert_eq!(limits.max_connections, 1024);
        assert_eq!(limits.max_states, 1_000_000);
        assert_eq!(settings.limits_of(2 << 30, 4).max_unread_bytes, (2048 - 64) << 19);
    }
}
