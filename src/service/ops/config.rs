//! The settings of the service: each is a flag and a `TOOTHWAVE_…` variable. Everything else is a constant.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use axum::http::Uri;
use clap::Args;
use serde::Serialize;
use toothwave_calculation::question;
use tracing_subscriber::EnvFilter;
use utoipa::ToSchema;

use super::keys::Keys;
use crate::compute::budget::PART_OF_UNKNOWN_SIZE;
use crate::compute::machine;
use crate::compute::pool::{MAX_RUNNING_BATCHES, MAX_WAITING_REQUESTS};

/// Memory that one computation needs beside its answer.
const MEMORY_PER_SOLVE_BYTES: u64 = 128 << 20;

/// Most bytes that the cache takes by default.
const MAX_DEFAULT_CACHE_BYTES: u64 = 256 << 20;

/// Memory of a machine that does not say.
const UNKNOWN_MEMORY_BYTES: u64 = 2 << 30;

/// States, or points, of the largest answer by default.
const MAX_DEFAULT_STATES: u64 = 1_000_000;

/// What a state takes with its text.
const STATE_BYTES: u64 = 350;

/// Variants of the largest study.
const MAX_STUDY_VARIANTS: u64 = 10_000_000;

/// Most bytes that the results of studies take.
const MAX_STUDY_BYTES: u64 = 256 << 20;

/// Studies that may run at once.
const MAX_CONCURRENT_STUDIES: usize = 4;

/// The longest time that a study may run.
const STUDY_DEADLINE_MS: u64 = 3_600_000;

/// Connections that may be open at once.
pub const MAX_CONNECTIONS: usize = 1024;

/// Bytes of the largest head of a request.
pub const MAX_HEADER_BYTES: usize = 40_960;

/// Time in which the head of a request arrives, and in which a client takes what it was sent.
pub const CLIENT_TIMEOUT_MS: u64 = 30_000;

/// The settings of `toothwave serve`.
#[derive(Debug, Clone, Args)]
pub struct Settings {
    /// Address and port to listen on
    #[arg(long, env = "TOOTHWAVE_LISTEN", value_name = "ADDR", default_value_t = SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)))]
    pub listen: SocketAddr,

    /// Computations that run at once for requests, and as many for batches and studies [default: the cores granted, at most one for each 128 MiB of the memory limit]
    #[arg(long, env = "TOOTHWAVE_MAX_CONCURRENT_SOLVES", value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub max_concurrent_solves: Option<u16>,

    /// Milliseconds from the arrival of a request until its computation is stopped
    #[arg(long, env = "TOOTHWAVE_DEADLINE_MS", value_name = "MS", default_value_t = 10_000)]
    pub deadline_ms: u64,

    /// Bytes of the largest request body
    #[arg(long, env = "TOOTHWAVE_MAX_BODY_BYTES", value_name = "BYTES", default_value_t = 65_536)]
    pub max_body_bytes: usize,

    /// States of the largest sweep, and points of the largest profile [default: 1000000, at most one for each 350 bytes of max-unread-bytes]
    #[arg(long, env = "TOOTHWAVE_MAX_STATES", value_name = "N")]
    pub max_states: Option<u64>,

    /// Bytes that all answers above 256 KiB take together until clients have read them [default: half of the memory limit]
    #[arg(long, env = "TOOTHWAVE_MAX_UNREAD_BYTES", value_name = "BYTES")]
    pub max_unread_bytes: Option<u64>,

    /// Bytes of answers that the cache keeps [default: an eighth of the memory limit, at most 256 MiB]
    #[arg(long, env = "TOOTHWAVE_CACHE_MAX_BYTES", value_name = "BYTES")]
    pub cache_max_bytes: Option<u64>,

    /// File in which studies are kept, or `off` for a service without studies [default: in memory]
    #[arg(long, env = "TOOTHWAVE_STUDIES", value_name = "FILE|off", value_parser = studies)]
    pub studies: Option<StudiesPlace>,

    /// Seconds after which a study that nobody asks for is removed
    #[arg(long, env = "TOOTHWAVE_STUDY_EXPIRY_S", value_name = "S", default_value_t = 2_592_000)]
    pub study_expiry_s: u64,

    /// File of key hashes (see `toothwave new-key`): with it every path but health and the page needs a bearer token
    #[arg(long, env = "TOOTHWAVE_KEYS_FILE", value_name = "FILE", value_parser = Keys::read)]
    pub keys_file: Option<Keys>,

    /// Origin that browsers may call from, or `*`; repeat the flag for more, in the variable separate them by commas
    #[arg(long = "cors-origin", env = "TOOTHWAVE_CORS_ORIGINS", value_name = "ORIGIN", value_delimiter = ',', value_parser = origin)]
    pub cors_origins: Vec<String>,

    /// Milliseconds in which a stopping service still accepts requests, so that a load balancer can turn to others
    #[arg(long, env = "TOOTHWAVE_LAME_DUCK_MS", value_name = "MS", default_value_t = 0)]
    pub lame_duck_ms: u64,

    /// Milliseconds that running requests get to finish after a signal to stop
    #[arg(long, env = "TOOTHWAVE_SHUTDOWN_MS", value_name = "MS", default_value_t = 8_000)]
    pub shutdown_ms: u64,

    /// What is logged, as tracing-subscriber's EnvFilter reads it
    #[arg(long, env = "TOOTHWAVE_LOG", value_name = "FILTER", default_value = "info", value_parser = log_filter)]
    pub log: String,

    /// Settings of earlier builds
    #[command(flatten)]
    pub removed: RemovedSettings,
}

/// Where studies are kept, if not in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StudiesPlace {
    /// Nowhere: there are none.
    Off,
    /// In this file.
    File(PathBuf),
}

/// Settings of earlier builds: each ends the start with a sentence that names its replacement.
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
        "" | ":memory:" => Err("name a file; without this setting studies are kept in memory".into()),
        address if address.starts_with("postgres:") || address.starts_with("postgresql:") => {
            Err("PostgreSQL is not supported any more: use `--studies FILE`".into())
        }
        file => Ok(StudiesPlace::File(file.into())),
    }
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
    /// Computations that run at once for requests, and as many for batches and studies.
    pub max_concurrent_solves: usize,
    /// Requests that may wait for a computation.
    pub max_queued_solves: usize,
    /// Batches that may run at once.
    pub max_concurrent_batches: usize,
    /// Milliseconds from the arrival of a request until its computation is stopped.
    pub deadline_ms: u64,
    /// Most bytes of answers that the cache keeps.
    pub cache_max_bytes: u64,
    /// Most bytes that all answers above 256 KiB take together until clients have read them.
    pub max_unread_bytes: u64,
    /// Most variants of a study.
    pub max_study_variants: u64,
    /// Most bytes that the results of studies take.
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
    /// Those of the calculation.
    pub const fn of_calculation(&self) -> question::Limits {
        let searched_states = self.max_unread_bytes / PART_OF_UNKNOWN_SIZE / STATE_BYTES;
        question::Limits {
            max_states: self.max_states,
            max_profile_points: self.max_profile_points,
            max_searched_states: if self.max_states < searched_states { self.max_states } else { searched_states },
        }
    }

    /// Those of studies.
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
    /// The limits that follow from the settings and from this machine.
    pub fn limits(&self) -> Limits {
        self.limits_on(machine::memory_bytes().unwrap_or(UNKNOWN_MEMORY_BYTES), machine::cores())
    }

    fn limits_on(&self, memory_bytes: u64, cores: usize) -> Limits {
        let solves_that_fit = usize::try_from(memory_bytes / MEMORY_PER_SOLVE_BYTES).unwrap_or(usize::MAX).max(1);
        let max_unread_bytes = self.max_unread_bytes.unwrap_or(memory_bytes / 2);
        let max_states =
            self.max_states.unwrap_or_else(|| MAX_DEFAULT_STATES.min(max_unread_bytes / STATE_BYTES).max(1));
        Limits {
            max_states,
            max_profile_points: max_states,
            max_body_bytes: self.max_body_bytes,
            max_concurrent_solves: self.max_concurrent_solves.map_or_else(|| cores.min(solves_that_fit), usize::from),
            max_queued_solves: MAX_WAITING_REQUESTS,
            max_concurrent_batches: MAX_RUNNING_BATCHES,
            deadline_ms: self.deadline_ms,
            cache_max_bytes: self.cache_max_bytes.unwrap_or_else(|| MAX_DEFAULT_CACHE_BYTES.min(memory_bytes / 8)),
            max_unread_bytes,
            max_study_variants: MAX_STUDY_VARIANTS,
            max_study_bytes: MAX_STUDY_BYTES.min(memory_bytes / 8),
            max_concurrent_studies: MAX_CONCURRENT_STUDIES,
            study_deadline_ms: STUDY_DEADLINE_MS,
            max_connections: MAX_CONNECTIONS,
            max_header_bytes: MAX_HEADER_BYTES,
            header_timeout_ms: CLIENT_TIMEOUT_MS,
        }
    }
}

/// An origin as browsers write it in `Origin`, or `*`, which stands for all. One that is written otherwise would never match.
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
        Err("write an origin as browsers send it, such as `https://cad.example` or `http://localhost:8081`: scheme, host in small letters, port unless it is the scheme's own, no path. `*` alone allows all".into())
    }
}

fn log_filter(text: &str) -> Result<String, String> {
    EnvFilter::try_new(text).map(|_| text.into()).map_err(|error| format!("no log filter: {error}"))
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
