//! What the benchmarks share: where they write, on what machine they run, how they sum up what they measured.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

/// How a benchmark was called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effort {
    /// The report: written to benches/results/.
    Full,
    /// Everything once and small, in less than a minute: shows that the benchmark works, and writes beside the build.
    Quick,
}

impl Effort {
    /// From the command line. `cargo bench` adds `--bench`; without it somebody runs all targets as tests, and must not wait.
    pub(crate) fn of(arguments: &[String]) -> Self {
        let given = |flag: &str| arguments.iter().any(|argument| argument == flag);
        if given("--bench") && !given("--quick") { Self::Full } else { Self::Quick }
    }

    /// The first of the two when it counts.
    pub(crate) fn choose<T>(self, full: T, quick: T) -> T {
        match self {
            Self::Full => full,
            Self::Quick => quick,
        }
    }

    /// Where documents go.
    pub(crate) fn directory(self) -> PathBuf {
        match self {
            Self::Full => PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../benches/results")),
            Self::Quick => PathBuf::from(env!("CARGO_TARGET_TMPDIR")),
        }
    }
}

/// Median and quartiles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    pub(crate) lower: f64,
    pub(crate) median: f64,
    pub(crate) upper: f64,
}

impl Spread {
    /// Of at least one value.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let place = share * (values.len() - 1) as f64;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
            let below = place.floor() as usize;
            let above = (below + 1).min(values.len() - 1);
            values[below] + (place - below as f64) * (values[above] - values[below])
        };
        Self { lower: quantile(0.25), median: quantile(0.5), upper: quantile(0.75) }
    }

    /// `median (lower to upper)` in a unit, with three digits that mean something.
    pub(crate) fn show(&self, unit: f64) -> String {
        let digits = |value: f64| three_digits(value / unit);
        format!("{} ({} to {})", digits(self.median), digits(self.lower), digits(self.upper))
    }
}

/// A number with three significant digits, as plain decimals.
pub(crate) fn three_digits(value: f64) -> String {
    let decimals = match value.abs() {
        0.0..1.0 => 3,
        1.0..10.0 => 2,
        10.0..100.0 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

/// The machine, as far as times depend on it.
pub(crate) fn machine() -> String {
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
    let field = |text: &str, name: &str, separator: char| {
        let line = text.lines().find_map(|line| {
            let (key, value) = line.split_once(separator)?;
            (key.trim() == name).then(|| value.trim().trim_matches('"').to_owned())
        });
        line.unwrap_or_else(|| "unknown".into())
    };
    let cpu = read("/proc/cpuinfo");
    let flags = field(&cpu, "flags", ':');
    let vectors = ["avx512f", "avx2", "sse2", "asimd"];
    let vectors: Vec<_> = vectors.into_iter().filter(|name| flags.split(' ').any(|flag| flag == *name)).collect();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let rustc = Command::new("rustc").arg("--version").output().ok();
    let rustc =
        rustc.map_or_else(|| "unknown".into(), |output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    format!(
        "{}, family {} model {}, {cores} cores for this process, {} | {}, Linux {} | {rustc}, release profile, no target-cpu",
        field(&cpu, "model name", ':'),
        field(&cpu, "cpu family", ':'),
        field(&cpu, "model", ':'),
        if vectors.is_empty() { "vector sets unknown".into() } else { vectors.join(", ") },
        field(&read("/etc/os-release"), "PRETTY_NAME", '='),
        read("/proc/sys/kernel/osrelease").trim(),
    )
}
