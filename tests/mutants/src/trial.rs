//! Which tests notice which mutants.

use std::collections::{BTreeMap, HashMap};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;
use std::{fs, io};

use serde::{Deserialize, Serialize};

use crate::build::Program;
use crate::mutant::Mutant;

/// The signal that ends a process which has had its time.
const SIGXCPU: i32 = 24;
/// A test that takes this many times as long as without a mutant, and some seconds, never ends.
const PATIENCE: f64 = 5.0;
const LEAST_PATIENCE_S: f64 = 3.0;
/// Tests that take longer than this are asked last, of what the quick ones left open.
const QUICK_S: f64 = 0.5;
/// Some mutants fill a vector for ever.
const MOST_MEMORY_KIB: u64 = 3 << 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Caught,
    /// The tests never end: that is noticed, too.
    Timeout,
    Missed,
    /// Missed, as no test comes by.
    Unreached,
    /// No quick test notices; the others have not been asked.
    Open,
    Unviable,
    /// For cargo-mutants itself to try.
    NotBuiltIn,
}

/// A test, and what it has noticed so far.
pub struct Test {
    name: String,
    seconds: f64,
    /// By file: how many mutants it was tried on, and how many it caught.
    record: HashMap<String, (f64, f64)>,
}

/// The tests of a program, and which of them come by which mutant.
pub struct Tests<'p> {
    program: &'p Program,
    directory: &'p Path,
    tests: Vec<Test>,
    reaching: BTreeMap<usize, Vec<usize>>,
}

/// What is kept of the runs of a program's tests.
#[derive(Serialize, Deserialize)]
struct Reach {
    of_program: u64,
    tests: Vec<(String, f64, Vec<usize>)>,
}

impl<'p> Tests<'p> {
    /// Runs each test by itself to see how long it takes and where it comes by. All pass where no mutant is chosen. What a program's tests
    /// reach is kept in a file.
    pub fn learn(program: &'p Program, directory: &'p Path, kept: &Path) -> io::Result<Self> {
        let hash = crate::hash(&fs::read(&program.tests)?);
        let known = fs::read_to_string(kept).ok().and_then(|text| serde_json::from_str::<Reach>(&text).ok());
        let mut tests = Self { program, directory, tests: Vec::new(), reaching: BTreeMap::new() };
        let reach = match known.filter(|reach| reach.of_program == hash) {
            Some(reach) => reach,
            None => Reach { of_program: hash, tests: tests.runs(&kept.with_extension("record"))? },
        };
        fs::write(kept, serde_json::to_string(&reach)?)?;

        let mut site_of: HashMap<usize, usize> = HashMap::new();
        for (at, site) in program.sites.iter().enumerate() {
            site_of.extend((site.first..site.first + site.mutants.len()).map(|number| (number, at)));
        }
        for (name, seconds, numbers) in reach.tests {
            let mut sites: Vec<usize> = numbers.iter().filter_map(|number| site_of.get(number).copied()).collect();
            sites.sort_unstable();
            sites.dedup();
            for &mutant in sites.iter().flat_map(|&site| &program.sites[site].mutants) {
                tests.reaching.entry(mutant).or_default().push(tests.tests.len());
            }
            tests.tests.push(Test { name, seconds, record: HashMap::new() });
        }
        eprintln!("{} tests take {:.0} s", tests.tests.len(), tests.tests.iter().map(|test| test.seconds).sum::<f64>());
        Ok(tests)
    }

    /// Name, seconds and numbers reached of each test.
    fn runs(&self, record: &Path) -> io::Result<Vec<(String, f64, Vec<usize>)>> {
        let list = Command::new(&self.program.tests).args(["--list", "--format", "terse"]).output()?;
        let list = String::from_utf8_lossy(&list.stdout);
        let mut runs = Vec::new();
        for name in list.lines().filter_map(|line| line.strip_suffix(": test")) {
            let test = Test { name: name.to_owned(), seconds: 300.0, record: HashMap::new() };
            fs::write(record, "")?;
            let started = Instant::now();
            let path = record.to_string_lossy();
            // A test that counts allocations counts those of the record.
            if !self.run(&test, &[("MUTANTS_REACHED", path.as_ref())])?.success() && !self.run(&test, &[])?.success() {
                return Err(io::Error::other(format!("{name} fails without a mutant")));
            }
            let seconds = started.elapsed().as_secs_f64();
            let reached = fs::read_to_string(record)?.lines().filter_map(|line| line.parse().ok()).collect();
            runs.push((test.name, seconds, reached));
        }
        Ok(runs)
    }

    /// The verdict on a mutant that is built in, and the test that brought it: of the quick tests alone, or of the slow ones after these.
    pub fn verdict(&mut self, number: usize, mutant: &Mutant, quick: bool) -> io::Result<(Verdict, Option<String>)> {
        let Some(site) = self.program.sites.iter().find(|site| site.mutants.contains(&number)) else {
            return Ok((Verdict::NotBuiltIn, None));
        };
        let chosen = site.first + site.mutants.iter().position(|&other| other == number).unwrap_or_default();
        let Some(reaching) = self.reaching.get(&number) else { return Ok((Verdict::Unreached, None)) };
        // Those first that are likeliest to notice for their time, as far as this file has shown.
        let promise = |test: &usize| {
            let test = &self.tests[*test];
            let (tried, caught) = test.record.get(&mutant.file).copied().unwrap_or_default();
            (caught + 0.5) / (tried + 1.0) / (test.seconds + 0.01)
        };
        let mut order: Vec<(usize, f64)> = reaching
            .iter()
            .filter(|&&test| (self.tests[test].seconds <= QUICK_S) == quick)
            .map(|test| (*test, promise(test)))
            .collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        for (at, _) in order {
            let status = self.run(&self.tests[at], &[("MUTANT", &chosen.to_string())])?;
            let test = &mut self.tests[at];
            let (tried, caught) = test.record.entry(mutant.file.clone()).or_default();
            *tried += 1.0;
            if !status.success() {
                *caught += 1.0;
                let verdict = if status.signal() == Some(SIGXCPU) { Verdict::Timeout } else { Verdict::Caught };
                return Ok((verdict, Some(test.name.clone())));
            }
        }
        Ok((if quick { Verdict::Open } else { Verdict::Missed }, None))
    }

    /// One test in a process of its own, which gets only so much time and memory.
    fn run(&self, test: &Test, environment: &[(&str, &str)]) -> io::Result<ExitStatus> {
        let seconds = (test.seconds * PATIENCE + LEAST_PATIENCE_S).ceil();
        let limits =
            format!("ulimit -t {seconds} -v {MOST_MEMORY_KIB} -c 0; exec \"$0\" --exact \"$1\" --test-threads 1");
        Command::new("bash")
            .args(["-c", &limits])
            .arg(&self.program.tests)
            .arg(&test.name)
            .current_dir(self.directory)
            // The same cases for each mutant, and not made smaller where one fails.
            .envs([("PROPTEST_RNG_SEED", "1"), ("PROPTEST_MAX_SHRINK_ITERS", "0")])
            .envs(environment.iter().copied())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
    }
}
