//! The settings of the service: each is a flag and a `TOOTHWAVE_…` variable. All other limits are constants.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use axum::http::Uri;
use clap::Args;
use serde::Serialize;
use toothwave_calculation::question;
use tracing_subscriber::EnvFilter;
use utoipa::ToSchema;

use super::keys::Keys;
use crate::compute::budget::UNKNOWN_SIZE_DIVISOR;
use crate::compute::machine;
use crate::compute::pool::{MAX_RUNNING_BATCHES, MAX_WAITING_REQUESTS};

/// Memory of one computation without its answer, in bytes.
const MEMORY_PER_SOLVE_BYTES: u64 = 128 << 20;

/// Memory that is assumed if the machine does not report it, in bytes.
const UNKNOWN_MEMORY_BYTES: u64 = 2 << 30;

/// Bytes of a state with its text.
const STATE_BYTES: u64 = 350;

/// Most open connections.
pub const MAX_CONNECTIONS: usize = 1024;

/// Largest request head (request line and headers), in bytes.
pub const MAX_HEADER_BYTES: usize = 40_960;

/// Time limit for the request head, and for a client that takes no data.
pub const CLIENT_TIMEOUT_MS: u64 = 30_000;

/// The settings of `toothwave serve`.
#[derive(Debug, Clone, Args)]
pub struct Settings {
    /// Address and port to listen on
    #[arg(long, env = "TOOTHWAVE_LISTEN", value_name = "ADDR", default_value_t = SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)))]
    pub listen: SocketAddr,

    /// Computations that run at once for requests; batches and studies get as many [default: granted cores, at most one
    /// for each 128 MiB of the memory limit]
    #[arg(long, env = "TOOTHWAVE_MAX_CONCURRENT_SOLVES", value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub max_concurrent_solves: Option<u16>,

    /// Time limit of a request from its arrival, and of each line of a batch, in milliseconds
    #[arg(long, env = "TOOTHWAVE_DEADLINE_MS", value_name = "MS", default_value_t = 10_000)]
    pub deadline_ms: u64,

    /// Largest request body in bytes
    #[arg(long, env = "TOOTHWAVE_MAX_BODY_BYTES", value_name = "BYTES", default_value_t = 65_536)]
    pub max_body_bytes: usize,

    /// Most states of a sweep, and most points of a profile [default: 1000000, at most one for each 350 bytes of
    /// max-unread-bytes]
    #[arg(long, env = "TOOTHWAVE_MAX_STATES", value_name = "N")]
    pub max_states: Option<u64>,

    /// Memory for all answers above 256 KiB until clients have read them, in bytes [default: half of the memory limit]
    #[arg(long, env = "TOOTHWAVE_MAX_UNREAD_BYTES", value_name = "BYTES")]
    pub max_unread_bytes: Option<u64>,

    /// Size of the answer cache in bytes [default: one eighth of the memory limit, at most 256 MiB]
    #[arg(long, env = "TOOTHWAVE_CACHE_MAX_BYTES", value_name = "BYTES")]
    pub cache_max_bytes: Option<u64>,

    /// Database file of the studies, or `off` for a service without studies [default: in memory]
    #[arg(long, env = "TOOTHWAVE_STUDIES", value_name = "FILE|off", value_parser = studies)]
    pub studies: Option<StudiesPlace>,

    /// Time in seconds after which a study without requests is removed
    #[arg(long, env = "TOOTHWAVE_STUDY_EXPIRY_S", value_name = "S", default_value_t = 2_592_000)]
    pub study_expiry_s: u64,

    /// File of key hashes (see `toothwave new-key`); with it every path except health and page needs a bearer token
    #[arg(long, env = "TOOTHWAVE_KEYS_FILE", value_name = "FILE", value_parser = Keys::read)]
    pub keys_file: Option<Keys>,

    /// Origin that browsers may call from, or `*`; repeat the flag for more, or separate them by commas in the variable
    #[arg(long = "cors-origin", env = "TOOTHWAVE_CORS_ORIGINS", value_name = "ORIGIN", value_delimiter = ',', value_parser = origin)]
    pub cors_origins: Vec<String>,

    /// Time in milliseconds for which a stopping service still accepts requests, so that a load balancer can switch
    /// over
    #[arg(long, env = "TOOTHWAVE_LAME_DUCK_MS", value_name = "MS", default_value_t = 0)]
    pub lame_duck_ms: u64,

    /// Time in milliseconds for running requests to finish after a stop signal
    #[arg(long, env = "TOOTHWAVE_SHUTDOWN_MS", value_name = "MS", default_value_t = 8_000)]
    pub shutdown_ms: u64,

    /// Log filter, in the syntax of tracing-subscriber's EnvFilter
    #[arg(long, env = "TOOTHWAVE_LOG", value_name = "FILTER", default_value = "info", value_parser = log_filter)]
    pub log: EnvFilter,

    /// Settings of earlier builds
    #[command(flatten)]
    pub removed: RemovedSettings,
}

/// Place where studies are stored, if not in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StudiesPlace {
    /// No studies.
    Off,
    /// A database file.
    File(PathBuf),
}

/// Settings of earlier builds. Each ends the start with a message that names its replacement.
#[derive(Debug, Clone, Args)]
pub struct RemovedSettings {
    #[arg(long, env = "TOOTHWAVE_REPLICAS", hide = true, value_parser = |_: &str| removed("start one service with `--studies FILE` for all studies, and the others with `--studies off`"))]
    replicas: Option<()>,
    #[arg(long, env = "TOOTHWAVE_STUDY_PARTS", hide = true, value_parser = |_: &str| removed("read `/v1/studies/{id}/result` as Parquet"))]
    study_parts: Option<()>,
    #[arg(long, env = "TOOTHWAVE_STUDIES_PASSWORD_FILE", hide = true, value_parser = |_: &str| removed("use `--studies FILE`, which needs no password"))]
    studies_password_file: Option<()>,
}

fn removed(replacement: &str) -> Result<(), String> {
    Err(format!("this setting was removed: {replacement}"))
}

fn studies(text: &str) -> Result<StudiesPlace, String> {
    match text {
        "off" => Ok(StudiesPlace::Off),
        "" | ":memory:" => {
            Err("the file name is missing: name a file, or leave the setting out to keep studies in memory".into())
        }
        address if address.starts_with("postgres:") || address.starts_with("postgresql:") => {
            Err("PostgreSQL is no longer supported: use `--studies FILE`".into())
        }
        file => Ok(StudiesPlace::File(file.into())),
    }
}

/// Limits that clients can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct Limits {
    /// Most states of a sweep.
    pub max_states: u64,
    /// Most points of all profiles of a geometry together.
    pub max_profile_points: u64,
    /// Largest request body in bytes.
    pub max_body_bytes: usize,
    /// Computations that run at once for requests. Batches and studies together get as many.
    pub max_concurrent_solves: usize,
    /// Most requests that wait for a computation.
    pub max_queued_solves: usize,
    /// Most batches that run at once.
    pub max_concurrent_batches: usize,
    /// Time limit of a request from its arrival, and of each line of a batch, in milliseconds.
    pub deadline_ms: u64,
    /// Size of the answer cache in bytes.
    pub cache_max_bytes: u64,
    /// Memory for all answers above 256 KiB until clients have read them, in bytes.
    pub max_unread_bytes: u64,
    /// Most variants of a study.
    pub max_study_variants: u64,
    /// Most bytes of a study with its result, and of all studies together if they are in memory.
    pub max_study_bytes: u64,
    /// Most studies that run at once.
    pub max_concurrent_studies: usize,
    /// Time limit of a study in milliseconds.
    pub study_deadline_ms: u64,
    /// Most open connections.
    pub max_connections: usize,
    /// Largest request line and headers together, in bytes.
    pub max_header_bytes: usize,
    /// Time limit in milliseconds for the request line and headers, and for a silent connection.
    pub header_timeout_ms: u64,
}

impl Limits {
    /// Returns the limits of the calculation.
    pub const fn of_calculation(&self) -> question::Limits {
        let searched_states = self.max_unread_bytes / UNKNOWN_SIZE_DIVISOR / STATE_BYTES;
        question::Limits {
            max_states: self.max_states,
            max_profile_points: self.max_profile_points,
            max_searched_states: if self.max_states < searched_states { self.max_states } else { searched_states },
        }
    }

    /// Returns the limits of studies.
    pub const fn of_studies(&self) -> toothwave_study::Limits {
        let of_calculation = question::Limits { max_searched_states: self.max_states, ..self.of_calculation() };
        toothwave_study::Limits {
            calculation: of_calculation,
            max_study_variants: self.max_study_variants,
            max_study_bytes: self.max_study_bytes,
        }
    }
}

impl Settings {
    /// Returns the limits that follow from the settings and the machine.
    pub fn limits(&self) -> Limits {
        self.limits_on(machine::memory_bytes().unwrap_or(UNKNOWN_MEMORY_BYTES), machine::cores())
    }

    fn limits_on(&self, memory_bytes: u64, cores: usize) -> Limits {
        let solves_that_fit = usize::try_from(memory_bytes / MEMORY_PER_SOLVE_BYTES).unwrap_or(usize::MAX).max(1);
        let max_unread_bytes = self.max_unread_bytes.unwrap_or(memory_bytes / 2);
        let max_states = self.max_states.unwrap_or((max_unread_bytes / STATE_BYTES).clamp(1, 1_000_000));
        Limits {
            max_states,
            max_profile_points: max_states,
            max_body_bytes: self.max_body_bytes,
            max_concurrent_solves: self.max_concurrent_solves.map_or_else(|| cores.min(solves_that_fit), usize::from),
            max_queued_solves: MAX_WAITING_REQUESTS,
            max_concurrent_batches: MAX_RUNNING_BATCHES,
            deadline_ms: self.deadline_ms,
            cache_max_bytes: self.cache_max_bytes.unwrap_or((memory_bytes / 8).min(256 << 20)),
            max_unread_bytes,
            max_study_variants: 10_000_000,
            max_study_bytes: (memory_bytes / 8).min(256 << 20),
            max_concurrent_studies: 4,
            study_deadline_ms: 3_600_000,
            max_connections: MAX_CONNECTIONS,
            max_header_bytes: MAX_HEADER_BYTES,
            header_timeout_ms: CLIENT_TIMEOUT_MS,
        }
    }
}

/// Checks that an origin is `*` or is written as browsers send it. Another spelling would never match.
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
        Err("the origin is not written as browsers send it. Use scheme, host in lower case, and the port if it is not the default, without a path: `https://cad.example` or `http://localhost:8081`. `*` allows all origins".into())
    }
}

fn log_filter(text: &str) -> Result<EnvFilter, String> {
    EnvFilter::try_new(text).map_err(|error| format!("invalid log filter: {error}"))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::{Settings, origin};

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }

    #[test]
    fn accepts_origins_as_browsers_send_them() {
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
    fn defaults_leave_memory_for_the_process() {
        let Line { settings } = Line::parse_from(["serve"]);
        for memory_mib in [1024, 2048, 65_536] {
            for cores in [1, 2, 16, 128] {
                let memory_bytes = memory_mib << 20;
                let limits = settings.limits_on(memory_bytes, cores);
                let held_bytes = limits.max_unread_bytes + limits.cache_max_bytes + limits.max_study_bytes;
                assert!(held_bytes + (128 << 20) <= memory_bytes, "{memory_mib} MiB, {cores} cores: {held_bytes}");
                assert!(limits.max_concurrent_solves as u64 * (128 << 20) <= memory_bytes);
            }
        }
    }
}
