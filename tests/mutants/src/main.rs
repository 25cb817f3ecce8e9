//! Tries the mutants that cargo-mutants lists, all built into one test program.
//!
//!     schemata LIST ROOT COPY RESULTS [--seconds N] [--again] [--known REPORT] [--report REPORT]
//!
//! LIST is what `cargo mutants --list --json` writes, ROOT the tree, COPY one to change, RESULTS a file that keeps what was found: a run
//! that was broken off goes on from there, and mutants of files that have changed are tried anew; with --again also those that no test
//! noticed. After N seconds no further mutant is tried. It fails where no test notices a mutant that a known report of all does not name.

mod build;
mod mutant;
mod report;
mod schemata;
mod trial;

use std::collections::{BTreeSet, HashMap};
use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::build::Tree;
use crate::mutant::Mutant;
use crate::report::Report;
use crate::schemata::Left;
use crate::trial::{Tests, Verdict};

/// A line of the results.
#[derive(Debug, Serialize, Deserialize)]
struct Outcome {
    mutant: String,
    /// Of the text of its file: another text may have another mutant of the same name.
    file_hash: u64,
    verdict: Verdict,
    by: Option<String>,
}

fn main() -> io::Result<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [list, root, copy, results, options @ ..] = arguments.as_slice() else {
        eprintln!("usage: schemata LIST ROOT COPY RESULTS [--seconds N] [--again] [--known REPORT] [--report REPORT]");
        return Ok(ExitCode::from(2));
    };
    let option = |name: &str| options.iter().skip_while(|option| *option != name).nth(1);
    let seconds: Option<f64> =
        option("--seconds").map(|seconds| seconds.parse().map_err(io::Error::other)).transpose()?;
    let started = Instant::now();
    let is_over = || seconds.is_some_and(|seconds| started.elapsed().as_secs_f64() > seconds);
    let mutants: Vec<Mutant> = serde_json::from_str(&fs::read_to_string(list)?)?;
    let (root, results) = (PathBuf::from(root), PathBuf::from(results));

    let mut hashes = HashMap::new();
    for mutant in &mutants {
        if !hashes.contains_key(&mutant.file) {
            hashes.insert(mutant.file.clone(), hash(&fs::read(root.join(&mutant.file))?));
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

    let tree = Tree { root, copy: fs::canonicalize(copy)? };
    let directory = tree.copy.join("src/solver");
    let again = options.iter().any(|option| option == "--again");
    let is_open = |verdict: Option<Verdict>| {
        verdict.is_none_or(|verdict| match verdict {
            Verdict::Open => true,
            Verdict::Missed | Verdict::Unreached => again,
            _ => false,
        })
    };
    let parts: BTreeSet<&str> = mutants.iter().map(part).collect();
    for part in parts {
        let (mut order, elsewhere): (Vec<usize>, Vec<usize>) =
            (0..mutants.len()).partition(|&number| self::part(&mutants[number]) == part);
        if is_over() || !order.iter().any(|&number| is_open(verdicts[number])) {
            continue;
        }
        let left = verdicts.iter().enumerate().filter_map(|(number, verdict)| match verdict {
            Some(Verdict::Unviable) => Some((number, Left::Unviable)),
            Some(Verdict::NotBuiltIn) => Some((number, Left::NotBuiltIn)),
            _ => None,
        });
        let program = tree.build(&mutants, left.collect(), &elsewhere.into_iter().collect())?;
        for (&number, left) in &program.left {
            if verdicts[number].is_none() {
                keep(
                    &mut verdicts,
                    number,
                    if *left == Left::Unviable { Verdict::Unviable } else { Verdict::NotBuiltIn },
                    None,
                )?;
            }
        }
        let reached = fs::canonicalize(&results)?.with_extension(format!("{:x}.reached", hash(part.as_bytes())));
        let mut tests = Tests::learn(&program, &directory, &reached)?;
        // In an order by chance, but the same each time: what is done when the time is over is a fair sample.
        order.retain(|&number| is_open(verdicts[number]));
        order.sort_by_key(|&number| hash(mutants[number].name.as_bytes()));
        for quick in [true, false] {
            let now = |verdict| if quick { verdict != Some(Verdict::Open) } else { verdict == Some(Verdict::Open) };
            for &number in order.iter().filter(|&&number| now(verdicts[number])).collect::<Vec<_>>() {
                if is_over() {
                    break;
                }
                let (verdict, by) = tests.verdict(number, &mutants[number], quick)?;
                keep(&mut verdicts, number, verdict, by)?;
            }
        }
    }

    let report = Report::of(&mutants, &verdicts);
    println!("{}", report.all.share());
    if let Some(path) = option("--report") {
        fs::write(path, serde_json::to_string_pretty(&report)? + "\n")?;
    }
    let known = option("--known").map(fs::read_to_string).transpose()?;
    let known: Option<Report> = known.map(|text| serde_json::from_str(&text)).transpose()?;
    let new = report.new_beside(known.as_ref());
    for name in &new {
        println!("missed: {name}");
    }
    let is_news = known.as_ref().is_none_or(Report::is_whole);
    Ok(if new.is_empty() || !is_news { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// What is compiled together. The files of the fast path become one function: the compiler's time grows faster than this does.
fn part(mutant: &Mutant) -> &str {
    if mutant.file.starts_with("src/solver/sweep/fast") { &mutant.file } else { "" }
}

/// The same in each run.
fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}
