//! Baseline (iii): `paper.py`, kept running so that its sweeps take turns with the others'. It takes its time itself: starting Python and
//! reading NumPy in are not counted.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use super::Columns;

/// How the script finds the teeth's contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
    /// As the paper tells it.
    ToothByTooth,
    /// All teeth of an input angle in one array, as NumPy is best used.
    AllAtOnce,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::ToothByTooth => "tooth-by-tooth",
            Self::AllAtOnce => "all-at-once",
        }
    }
}

/// The script at work.
#[derive(Debug)]
pub(crate) struct Paper {
    child: Child,
    questions: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Versions of Python and NumPy.
    pub(crate) versions: String,
}

impl Paper {
    /// Starts it with the `python3` of the path.
    ///
    /// # Errors
    /// Where there is no Python with NumPy.
    pub(crate) fn start() -> Result<Self, Box<dyn Error>> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../benches/baselines/paper.py");
        let mut child = Command::new("python3")
            .arg(script)
            .arg("--serve")
            // One core, as everybody else.
            .envs([("OPENBLAS_NUM_THREADS", "1"), ("MKL_NUM_THREADS", "1"), ("OMP_NUM_THREADS", "1")])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let questions = child.stdin.take().ok_or("no pipe to Python")?;
        let answers = BufReader::new(child.stdout.take().ok_or("no pipe from Python")?);
        let mut paper = Self { child, questions, answers, versions: String::new() };
        let greeting = paper.answer()?;
        let text = |name: &str| greeting[name].as_str().unwrap_or("?").to_owned();
        paper.versions = format!("Python {}, NumPy {}", text("python"), text("numpy"));
        Ok(paper)
    }

    fn answer(&mut self) -> Result<Value, Box<dyn Error>> {
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        Ok(serde_json::from_str(&line)?)
    }

    /// How long `runs` sweeps take together.
    pub(crate) fn time(&mut self, method: Method, intervals: i64, runs: u32) -> Result<Duration, Box<dyn Error>> {
        writeln!(self.questions, "time {} {intervals} {runs}", method.name())?;
        Ok(Duration::from_secs_f64(self.answer()?.as_f64().ok_or("Python answered no time")?))
    }

    /// A sweep's states.
    pub(crate) fn sweep(&mut self, method: Method, intervals: i64) -> Result<Columns, Box<dyn Error>> {
        writeln!(self.questions, "columns {} {intervals}", method.name())?;
        let columns: Vec<Vec<f64>> = serde_json::from_value(self.answer()?)?;
        let [input_angle_deg, tooth, rest @ ..] = columns.as_slice() else { return Err("too few columns".into()) };
        #[expect(clippy::cast_possible_truncation, reason = "small whole numbers")]
        let tooth = tooth.iter().map(|number| *number as i64).collect();
        let mut values = vec![input_angle_deg.clone()];
        values.extend_from_slice(rest);
        Ok(Columns { tooth, values: values.try_into().map_err(|_| "not eleven columns")? })
    }
}

impl Drop for Paper {
    fn drop(&mut self) {
        // Nothing is lost with it, and it may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
