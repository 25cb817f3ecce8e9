//! Tries the mutants that cargo-mutants lists, a batch of them by chance built into one test program.
//!
//!     schemata LIST ROOT COPY TARGET RESULTS [--seconds N] [--draw NAME] [--again] [--known REPORT] [--report REPORT]
//!
//! LIST is what `cargo mutants --list --json` writes of one crate, ROOT the tree, COPY one to change, TARGET where it is compiled, RESULTS a file that keeps what was found: a run
//! that was broken off goes on from there, and mutants of files that have changed are tried anew; with --again also those that no test
//! noticed. N seconds after the first was tried no further mutant is; each name of a draw has an order by chance of its own. It fails where surely fewer are noticed than a known report says.

mod build;
mod mutant;
mod report;
mod schemata;
mod trial;

use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock};
use std::thread;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::build::{Crate, Stage, Tree};
use crate::mutant::Mutant;
use crate::report::Report;
use crate::schemata::Left;
use crate::trial::{Tests, Verdict};

/// So many are compiled together, and asked of all tests before the next: with all of them a function is ten times as long as it was written, and the
/// compiler's time grows faster than that.
const BATCH: usize = 500;

/// Of so few all tests are asked at once.
const FEW: usize = 200;

/// A line of the results.
#[derive(Debug, Serialize, Deserialize)]
struct Outcome {
    mutant: String,
    /// Of the text of its file without its tests: another text may have another mutant of the same name.
    file_hash: u64,
    verdict: Verdict,
    by: Option<String>,
}

fn main() -> io::Result<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [list, root, copy, target, results, options @ ..] = arguments.as_slice() else {
        eprintln!(
            "usage: schemata LIST ROOT COPY TARGET RESULTS [--seconds N] [--draw NAME] [--again] [--known REPORT] [--report REPORT]"
        );
        return Ok(ExitCode::from(2));
    };
    let option = |name: &str| options.iter().skip_while(|option| *option != name).nth(1);
    let seconds: Option<f64> =
        option("--seconds").map(|seconds| seconds.parse().map_err(io::Error::other)).transpose()?;
    let threads = thread::available_parallelism()?.get();
    // What is compiled before does not count.
    let started = OnceLock::<Instant>::new();
    let is_over =
        || seconds.zip(started.get()).is_some_and(|(seconds, started)| started.elapsed().as_secs_f64() > seconds);
    let mutants: Vec<Mutant> = serde_json::from_str(&fs::read_to_string(list)?)?;
    let (root, results) = (PathBuf::from(root), PathBuf::from(results));

    let (mut hashes, mut with_units) = (HashMap::new(), HashSet::new());
    for mutant in &mutants {
        if !hashes.contains_key(&mutant.file) {
            let source = fs::read_to_string(root.join(&mutant.file))?;
            let (code, units) = source.split_once("#[cfg(test)]").unwrap_or((&source, ""));
            hashes.insert(mutant.file.clone(), hash(code.as_bytes()));
            if !units.is_empty() {
                with_units.insert(mutant.file.clone());
            }
        }
    }
    let known = if results.exists() { fs::read_to_string(&results)? } else { String::new() };
    let known = known.lines().filter_map(|line| serde_json::from_str::<Outcome>(line).ok());
    let known: HashMap<_, _> = known.map(|outcome| ((outcome.mutant, outcome.file_hash), outcome.verdict)).collect();
    let mut verdicts: Vec<_> =
        mutants.iter().map(|mutant| known.get(&(mutant.name.clone(), hashes[&mutant.file])).copied()).collect();

    let mut file = File::options().create(true).append(true).open(&results)?;
    let mut keep = |verdicts: &mut [Option<Verdict>], number: usize, verdict: Verdict, by: Option<String>| {
        let mutant = &mutants[number];
        verdicts[number] = Some(verdict);
        let outcome = Outcome { mutant: mutant.name.clone(), file_hash: hashes[&mutant.file], verdict, by };
        file.write_all((serde_json::to_string(&outcome)? + "\n").as_bytes())
    };

    let of = mutants.first().and_then(|mutant| Crate::of(&mutant.file));
    let of = of.ok_or_else(|| io::Error::other(format!("{list} has no mutant of a crate that is known here")))?;
    let tree = Tree { of, root, copy: fs::canonicalize(copy)?, target: fs::canonicalize(target)? };
    let again = options.iter().any(|option| option == "--again");
    let is_open = |verdict: Option<Verdict>| {
        verdict.is_none_or(|verdict| verdict == Verdict::Open || again && verdict.is_silent())
    };
    let mut ask = |verdicts: &mut Vec<Option<Verdict>>, these: &[usize], stage: Stage| {
        if these.is_empty() || is_over() {
            return Ok(());
        }
        let program = tree.build(&mutants, these, stage)?;
        for (&number, left) in &program.left {
            let verdict = match left {
                Left::Unviable => Verdict::Unviable,
                Left::NotBuiltIn => Verdict::NotBuiltIn,
            };
            keep(verdicts, number, verdict, None)?;
        }
        let reached = fs::canonicalize(&results)?.with_extension(format!("{stage:?}"));
        let tests = Tests::learn(&program, &tree, &reached, threads)?;
        let built: Vec<usize> = these.iter().copied().filter(|number| !program.left.contains_key(number)).collect();
        started.get_or_init(Instant::now);
        let (next, found) = (AtomicUsize::new(0), Mutex::new((verdicts, &mut keep)));
        at_once(threads, || {
            while let Some(&number) = built.get(next.fetch_add(1, Relaxed)).filter(|_| !is_over()) {
                let (verdict, by) = tests.verdict(number, &mutants[number], stage)?;
                let (verdicts, keep) = &mut *found.lock().map_err(|_| io::Error::other("a thread panicked"))?;
                keep(verdicts, number, verdict, by)?;
            }
            Ok(())
        })
    };
    // In an order by chance, but the same each time: what is done when the time is over is a fair sample. Once tests were written for what a
    // sample left, only another draw is one of the code as it then is.
    let draw = option("--draw").map_or("", String::as_str);
    let mut order: Vec<usize> = (0..mutants.len()).collect();
    order.sort_by_key(|&number| hash((mutants[number].name.clone() + draw).as_bytes()));
    for batch in order.chunks(BATCH) {
        let those = |which: &dyn Fn(usize) -> bool| -> Vec<usize> {
            batch.iter().copied().filter(|&number| which(number)).collect()
        };
        let fresh = those(&|number| verdicts[number].is_none());
        if fresh.len() > FEW && of.is_optimised {
            ask(&mut verdicts, &fresh, Stage::Quick)?;
        }
        // What only tests beside it may notice.
        let beside = those(&|number| is_open(verdicts[number]) && with_units.contains(&mutants[number].file));
        ask(&mut verdicts, &beside, Stage::Units)?;
        let open = those(&|number| is_open(verdicts[number]));
        ask(&mut verdicts, &open, Stage::All)?;
    }

    let report = Report::of(&mutants, &verdicts);
    println!("{}", report.all.share());
    if let Some(path) = option("--report") {
        fs::write(path, serde_json::to_string_pretty(&report)? + "\n")?;
    }
    let known = option("--known").map(fs::read_to_string).transpose()?;
    let known: Option<Report> = known.map(|text| serde_json::from_str(&text)).transpose()?;
    for name in report.new_beside(known.as_ref()) {
        println!("missed: {name}");
    }
    let is_below = known.is_some_and(|known| report.is_below(&known));
    Ok(if is_below { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// The same work in each of so many threads.
fn at_once(threads: usize, work: impl Fn() -> io::Result<()> + Sync) -> io::Result<()> {
    thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(&work)).collect();
        threads.into_iter().try_for_each(|thread| thread.join().map_err(|_| io::Error::other("a thread panicked"))?)
    })
}

/// The same in each run.
fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}
