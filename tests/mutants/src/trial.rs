//! Which tests notice which mutants.

use std::collections::{BTreeMap, HashMap};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use std::{fs, io};

use serde::{Deserialize, Serialize};

use crate::build::{Program, Stage, Tree};
use crate::mutant::Mutant;

/// The signals that end a process which has had its time, of the processor or by the clock.
const TIME_IS_OVER: [i32; 2] = [24, 9];
/// No test takes longer, not even while it is recorded where it comes by.
const MOST_SECONDS: f64 = 300.0;
/// A test that takes this many times as long as without a mutant, and some seconds, never ends.
const PATIENCE: f64 = 5.0;
const LEAST_PATIENCE_S: f64 = 2.0;
/// And one that waits, some more by the clock.
const LEAST_WAIT_S: f64 = 20.0;
/// Runs that take longer than this are asked last, of what the quick ones left open.
const QUICK_S: f64 = 0.8;
/// Properties are asked about the first of their cases before all of them: few notice what these do not.
const FIRST_CASES: &str = "16";
/// A test that takes this much longer with all its cases has more than the first of them.
const LONGER: f64 = 1.3;
/// What the tests of a file have noticed counts as this many mutants of a function.
const FILE_WEIGHT: f64 = 2.0;
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Caught,
    /// The tests never end: that is noticed, too.
    Timeout,
    Missed,
    /// Missed, as no test comes by.
    Unreached,
    /// No test that was asked notices; the others have not been.
    Open,
    Unviable,
    /// For cargo-mutants itself to try.
    NotBuiltIn,
}

impl Verdict {
    /// Whether all tests pass.
    pub fn is_silent(self) -> bool {
        matches!(self, Self::Missed | Self::Unreached)
    }
}

/// A test as it is run.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Run {
    test: String,
    has_all_cases: bool,
    seconds: f64,
}

/// How many mutants a run was tried on, and how many it noticed.
type Record = HashMap<String, (f64, f64)>;

/// The tests of a program, and which of them come by which mutant.
pub struct Tests<'p> {
    program: &'p Program,
    tree: &'p Tree,
    runs: Vec<Run>,
    /// By file and by function.
    records: Mutex<Vec<Record>>,
    reaching: BTreeMap<usize, Vec<usize>>,
}

/// What is kept of the runs of a program's tests: each run with the places that it comes by.
#[derive(Serialize, Deserialize)]
struct Reach {
    of_program: u64,
    runs: Vec<(Run, Vec<usize>)>,
}

impl<'p> Tests<'p> {
    /// Runs each test by itself to see how long it takes and where it comes by. All pass where no mutant is chosen. What a program's tests
    /// reach is kept in a file.
    pub fn learn(program: &'p Program, tree: &'p Tree, kept: &Path, threads: usize) -> io::Result<Self> {
        let hash = crate::hash(&fs::read(&program.tests)?);
        let known = fs::read_to_string(kept).ok().and_then(|text| serde_json::from_str::<Reach>(&text).ok());
        let mut tests = Self { program, tree, runs: Vec::new(), records: Mutex::default(), reaching: BTreeMap::new() };
        let reach = match known.filter(|reach| reach.of_program == hash) {
            Some(reach) => reach,
            None => Reach { of_program: hash, runs: tests.all_runs(kept, threads)? },
        };
        fs::write(kept, serde_json::to_string(&reach)?)?;

        let mut site_of: HashMap<usize, usize> = HashMap::new();
        for (at, site) in program.sites.iter().enumerate() {
            site_of.extend((site.first..site.first + site.mutants.len()).map(|number| (number, at)));
        }
        for (run, numbers) in reach.runs {
            let mut sites: Vec<usize> = numbers.iter().filter_map(|number| site_of.get(number).copied()).collect();
            sites.sort_unstable();
            sites.dedup();
            for &mutant in sites.iter().flat_map(|&site| &program.sites[site].mutants) {
                tests.reaching.entry(mutant).or_default().push(tests.runs.len());
            }
            tests.runs.push(run);
        }
        tests.records = Mutex::new(vec![Record::new(); tests.runs.len()]);
        let seconds: f64 = tests.runs.iter().map(|run| run.seconds).sum();
        eprintln!("{} runs of tests take {seconds:.0} s", tests.runs.len());
        Ok(tests)
    }

    /// Each test with the first of its cases, and with all where it has more.
    fn all_runs(&self, kept: &Path, threads: usize) -> io::Result<Vec<(Run, Vec<usize>)>> {
        let list = Command::new(&self.program.tests).args(["--list", "--format", "terse"]).output()?;
        let list = String::from_utf8_lossy(&list.stdout);
        let names: Vec<&str> = list.lines().filter_map(|line| line.strip_suffix(": test")).collect();
        let runs = Mutex::new(Vec::new());
        let next = AtomicUsize::new(0);
        crate::at_once(threads, || {
            while let Some(name) = names.get(next.fetch_add(1, Relaxed)) {
                let mut all = match self.recorded(name, true, kept) {
                    // By chance, or within these bounds: it is not asked.
                    Err(error) if self.tree.of.waits => {
                        eprintln!("{error}");
                        continue;
                    }
                    run => run?,
                };
                if self.tree.of.waits {
                    locked(&runs).push(all);
                    continue;
                }
                let mut first = self.recorded(name, false, kept)?;
                let longer = all.0.seconds / first.0.seconds;
                let started = Instant::now();
                self.passes(&first.0)?;
                first.0.seconds = started.elapsed().as_secs_f64();
                all.0.seconds = first.0.seconds * longer;
                let mut runs = locked(&runs);
                runs.push(first);
                runs.extend((longer > LONGER).then_some(all));
            }
            Ok(())
        })?;
        let mut runs = runs.into_inner().unwrap_or_else(PoisonError::into_inner);
        runs.sort_by(|(a, _), (b, _)| (&a.test, a.has_all_cases).cmp(&(&b.test, b.has_all_cases)));
        Ok(runs)
    }

    /// A run, the time that it takes with its record, and the places that it comes by.
    fn recorded(&self, test: &str, has_all_cases: bool, kept: &Path) -> io::Result<(Run, Vec<usize>)> {
        let mut run = Run { test: test.to_owned(), has_all_cases, seconds: MOST_SECONDS };
        let record = kept.with_extension(format!("{:x}", crate::hash(test.as_bytes())));
        fs::write(&record, "")?;
        let started = Instant::now();
        let status = self.run(&run, &[("MUTANTS_REACHED", record.to_string_lossy().as_ref())])?;
        run.seconds = started.elapsed().as_secs_f64();
        // A test that counts allocations counts those of the record.
        if !status.success() {
            self.passes(&run)?;
        }
        let reached = fs::read_to_string(&record)?.lines().filter_map(|line| line.parse().ok()).collect();
        fs::remove_file(&record)?;
        Ok((run, reached))
    }

    fn passes(&self, run: &Run) -> io::Result<()> {
        let passes = self.run(run, &[])?.success();
        if passes { Ok(()) } else { Err(io::Error::other(format!("{} fails without a mutant", run.test))) }
    }

    /// The verdict on a mutant that is built in, and the test that brought it: of a stage; only after the last it is missed. Those are asked first that are likeliest to notice for their
    /// time, as far as this function and this file have shown.
    pub fn verdict(&self, number: usize, mutant: &Mutant, stage: Stage) -> io::Result<(Verdict, Option<String>)> {
        let Some(site) = self.program.sites.iter().find(|site| site.mutants.contains(&number)) else {
            return Ok((Verdict::NotBuiltIn, None));
        };
        let chosen = site.first + site.mutants.iter().position(|&other| other == number).unwrap_or_default();
        let Some(reaching) = self.reaching.get(&number) else {
            return Ok((if stage.is_last() { Verdict::Unreached } else { Verdict::Open }, None));
        };
        let function = mutant.function();
        let promise = |record: &Record, run: &Run| {
            let (tried, noticed) = record.get(&mutant.file).copied().unwrap_or_default();
            let of_file = (noticed + 0.5) / (tried + 1.0);
            let (tried, noticed) = record.get(&function).copied().unwrap_or_default();
            (noticed + FILE_WEIGHT * of_file) / (tried + FILE_WEIGHT) / (run.seconds + 0.01)
        };
        let mut order: Vec<(usize, f64)> = {
            let records = locked(&self.records);
            let reaching = reaching.iter().filter(|&&at| stage != Stage::Quick || self.runs[at].seconds <= QUICK_S);
            reaching.map(|&at| (at, promise(&records[at], &self.runs[at]))).collect()
        };
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        for (at, _) in order {
            let run = &self.runs[at];
            let chosen = chosen.to_string();
            let mut status = self.run(run, &[("MUTANT", &chosen)])?;
            if !status.success() && self.tree.of.waits {
                // Not by chance.
                status = self.run(run, &[("MUTANT", &chosen)])?;
            }
            let noticed = if status.success() { 0.0 } else { 1.0 };
            for key in [&mutant.file, &function] {
                let record = &mut locked(&self.records)[at];
                let (all_tried, all_noticed) = record.entry(key.clone()).or_default();
                *all_tried += 1.0;
                *all_noticed += noticed;
            }
            if !status.success() {
                let verdict = if status.signal().is_some_and(|signal| TIME_IS_OVER.contains(&signal)) {
                    Verdict::Timeout
                } else {
                    Verdict::Caught
                };
                return Ok((verdict, Some(run.test.clone())));
            }
        }
        Ok((if stage.is_last() { Verdict::Missed } else { Verdict::Open }, None))
    }

    /// One test in a process of its own, which gets only so much time and memory.
    fn run(&self, run: &Run, environment: &[(&str, &str)]) -> io::Result<ExitStatus> {
        let seconds = (run.seconds * PATIENCE + LEAST_PATIENCE_S).ceil();
        let clock =
            if self.tree.of.waits { format!("timeout -s KILL {} ", seconds + LEAST_WAIT_S) } else { String::new() };
        let limits = format!(
            "ulimit -t {seconds} -v {} -c 0; exec {clock}\"$0\" --exact \"$1\" --test-threads 1",
            self.tree.of.most_memory_kib
        );
        Command::new("bash")
            .args(["-c", &limits])
            .arg(&self.program.tests)
            .arg(&run.test)
            .current_dir(self.tree.copy.join(self.tree.of.directory))
            // The same cases for each mutant, and not made smaller where one fails.
            .envs([("PROPTEST_RNG_SEED", "1"), ("PROPTEST_MAX_SHRINK_ITERS", "0")])
            .envs((!run.has_all_cases).then_some(("PROPTEST_CASES", FIRST_CASES)))
            .envs(environment.iter().copied())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
