//! The tree with all its mutants, and those of them that compile.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{fs, io};

use serde_json::Value;

use crate::mutant::Mutant;
use crate::schemata::{self, Built, Left};

/// Errors are mended in rounds, as the compiler finds those of one kind only after those of another.
const MOST_ROUNDS: usize = 40;

/// What is wrong in a mutant is no error to the compiler.
const ALLOWED: &str = "#![allow(arithmetic_overflow, overflowing_literals, unconditional_panic)] ";

/// What is compiled, and where.
pub struct Tree {
    pub of: &'static Crate,
    /// Where the sources come from.
    pub root: PathBuf,
    /// A copy of it, whose sources get the mutants.
    pub copy: PathBuf,
    /// Where libraries are compiled.
    pub target: PathBuf,
}

/// A crate whose mutants are tried, with its tests.
#[derive(Debug)]
pub struct Crate {
    package: &'static str,
    /// Where it stands, from the root.
    pub directory: &'static str,
    /// How its tests that stand apart are compiled: of the workspace where that can be, as libraries have other features for a crate alone,
    /// and would be compiled anew.
    apart: &'static [&'static str],
    /// How those beside the code are: not of the workspace where all crates would be compiled anew for them.
    units: &'static [&'static str],
    /// Whether it is optimised even where the rest is not. With a whole batch functions are some times as long as they were written, and
    /// the optimiser would take longer than it saves.
    pub is_optimised: bool,
    /// Whether tests wait for others: such a one fails by chance now and then, and may wait for what never comes. They have no properties,
    /// of which some cases might be asked first.
    pub waits: bool,
    /// What a test may take: some mutants fill a vector for ever. Of what the service asks for much is never used.
    pub most_memory_kib: u64,
}

const CRATES: [Crate; 2] = [
    Crate {
        package: "toothwave-solver",
        directory: "src/solver",
        apart: &["--workspace", "--test", "solver"],
        units: &["--package", "toothwave-solver", "--lib"],
        is_optimised: true,
        waits: false,
        most_memory_kib: 3 << 20,
    },
    Crate {
        package: "toothwave",
        directory: "src/service",
        apart: &["--workspace", "--test", "api"],
        units: &["--workspace", "--lib"],
        is_optimised: false,
        waits: true,
        most_memory_kib: 32 << 20,
    },
];

impl Crate {
    /// The one that a file belongs to.
    pub fn of(file: &str) -> Option<&'static Self> {
        CRATES.iter().find(|of| Path::new(file).starts_with(of.directory))
    }

    fn targets(&self, stage: Stage) -> &[&str] {
        if stage == Stage::Units { self.units } else { self.apart }
    }

    /// All else is compiled as ever, so that it need not be compiled anew.
    fn settings(&self, stage: Stage) -> impl Iterator<Item = String> {
        let level = (self.is_optimised && stage != Stage::All).then_some("opt-level=1");
        let settings = ["debug=false", "codegen-units=16"].into_iter().chain(level);
        settings.map(|setting| format!("--config=profile.dev.package.{}.{setting}", self.package))
    }
}

/// Which tests are asked, and of how many mutants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The quick ones of those that stand apart, of a whole batch.
    Quick,
    /// All of these, of what the quick ones left open.
    All,
    /// Those beside what they are about.
    Units,
}

impl Stage {
    /// Whether what no test has noticed after it is missed.
    pub fn is_last(self) -> bool {
        self == Self::All
    }
}

/// The tests of the tree with the mutants that compile.
pub struct Program {
    pub tests: PathBuf,
    pub sites: Vec<Built>,
    pub left: HashMap<usize, Left>,
}

impl Tree {
    /// Builds those of a batch, and leaves mutants out until the rest compiles.
    pub fn build(&self, mutants: &[Mutant], batch: &[usize], stage: Stage) -> io::Result<Program> {
        let library = format!("{}/lib.rs", self.of.directory);
        // All sources, as those without mutants are compiled too.
        let sources = self.sources()?;
        let mut of_file: BTreeMap<&str, Vec<(usize, &Mutant)>> =
            sources.iter().map(|file| (file.as_str(), Vec::new())).collect();
        for &number in batch {
            let mutant = &mutants[number];
            of_file.entry(&mutant.file).or_default().push((number, mutant));
        }
        let mut left = HashMap::new();
        let mut constants = HashSet::new();
        for round in 1..=MOST_ROUNDS {
            let without = left.keys().copied().collect();
            let mut files = HashMap::new();
            let mut first = 0;
            for (&file, mutants) in &of_file {
                let source = fs::read_to_string(self.root.join(file))?;
                let schemata =
                    schemata::of_file(&source, mutants, &without, &constants, first).map_err(io::Error::other)?;
                first += mutants.len();
                left.extend(schemata.left.iter().copied());
                // On the first line, so that lines stay as they are counted.
                let (allowed, chosen) = if file == library { (ALLOWED, include_str!("chosen.rs")) } else { ("", "") };
                write_if_changed(&self.copy.join(file), &(allowed.to_owned() + &schemata.text + chosen))?;
                files.insert(file, schemata);
            }
            let (errors, tests) = self.compile(stage)?;
            if errors.is_empty() {
                let sites = files.into_values().flat_map(|file| file.sites).collect();
                let tests = tests.ok_or_else(|| io::Error::other("the tests do not compile"))?;
                return Ok(Program { tests, sites, left });
            }
            let (mut lines, mut sites, mut names) = (BTreeSet::new(), BTreeSet::new(), 0);
            for error in &errors {
                if let Some(name) = wanted_constant(error)
                    && constants.insert(name)
                {
                    names += 1;
                    continue;
                }
                let places = places(error);
                let mutant = places.iter().find_map(|(file, line)| files.get(file.as_str())?.mutant_of_line.get(line));
                let site = || {
                    places.iter().find_map(|(file, line)| {
                        files
                            .get(file.as_str())?
                            .sites
                            .iter()
                            .filter(|site| site.lines.contains(line))
                            .min_by_key(|site| site.lines.len())
                    })
                };
                if let Some(&mutant) = mutant {
                    lines.insert(mutant);
                } else if let Some(site) = site() {
                    sites.extend(&site.mutants);
                } else if names == 0 {
                    eprintln!("{}", error["rendered"].as_str().unwrap_or_default());
                }
            }
            eprintln!("round {round}: {} mutants do not compile, {} cannot be built in", lines.len(), sites.len());
            if lines.is_empty() && sites.is_empty() && names == 0 {
                return Err(io::Error::other("errors that come from no mutant"));
            }
            // What stands beside an error may be its cause: it gets another round.
            if lines.is_empty() {
                left.extend(sites.into_iter().map(|mutant| (mutant, Left::NotBuiltIn)));
            }
            left.extend(lines.into_iter().map(|mutant| (mutant, Left::Unviable)));
        }
        Err(io::Error::other("the mutants still do not compile"))
    }

    /// The crate's files, from the root.
    fn sources(&self) -> io::Result<Vec<String>> {
        let mut directories = vec![self.of.directory.to_owned()];
        let mut sources = Vec::new();
        while let Some(directory) = directories.pop() {
            fs::create_dir_all(self.copy.join(&directory))?;
            for entry in fs::read_dir(self.root.join(&directory))? {
                let entry = entry?;
                let path = format!("{directory}/{}", entry.file_name().to_string_lossy());
                if entry.file_type()?.is_dir() {
                    directories.push(path);
                } else if path.ends_with(".rs") {
                    sources.push(path);
                }
            }
        }
        Ok(sources)
    }

    /// The errors, and the test program where one was made.
    fn compile(&self, stage: Stage) -> io::Result<(Vec<Value>, Option<PathBuf>)> {
        let output = Command::new("cargo")
            .args(["test", "--no-run", "--locked", "--message-format", "json"])
            .args(self.of.targets(stage))
            .args(self.of.settings(stage))
            .current_dir(&self.copy)
            .env("CARGO_TARGET_DIR", &self.target)
            .output()?;
        let messages =
            output.stdout.split(|&byte| byte == b'\n').filter_map(|line| serde_json::from_slice::<Value>(line).ok());
        let (mut errors, mut program) = (Vec::new(), None);
        for mut message in messages {
            if message["message"]["level"] == "error"
                && message["message"]["spans"].as_array().is_some_and(|spans| !spans.is_empty())
            {
                errors.push(message["message"].take());
            } else if message["profile"]["test"] == true
                && message["manifest_path"]
                    .as_str()
                    .is_some_and(|path| Path::new(path).starts_with(self.copy.join(self.of.directory)))
            {
                program = message["executable"].as_str().map(PathBuf::from).or(program);
            }
        }
        // That mutants do not compile is expected: what cargo says of it would only look like a failure.
        if errors.is_empty() && !output.status.success() {
            eprint!("{}", String::from_utf8_lossy(&output.stderr));
            return Err(io::Error::other("cargo fails without an error in the sources"));
        }
        Ok((errors, program))
    }
}

/// A function that is called where only constants may stand.
fn wanted_constant(error: &Value) -> Option<String> {
    if error["code"]["code"] != "E0015" {
        return None;
    }
    // Without the types that it is called for.
    let path = error["message"].as_str()?.split('`').nth(1)?.split("::<").next()?;
    Some(path.rsplit("::").next()?.to_owned())
}

/// Files and lines that an error names, those first that it is about.
fn places(error: &Value) -> Vec<(String, usize)> {
    let mut places = Vec::new();
    let spans = error["spans"].as_array().into_iter().flatten();
    let (primary, others): (Vec<_>, Vec<_>) = spans.partition(|span| span["is_primary"] == true);
    for mut span in primary.into_iter().chain(others) {
        // Out of macros to where they are called.
        while span.is_object() {
            let line = span["line_start"].as_u64().and_then(|line| usize::try_from(line).ok());
            places.extend(span["file_name"].as_str().map(str::to_owned).zip(line));
            span = &span["expansion"]["span"];
        }
    }
    places
}

/// So that cargo sees only what has.
fn write_if_changed(path: &Path, text: &str) -> io::Result<()> {
    if fs::read_to_string(path).is_ok_and(|old| old == text) { Ok(()) } else { fs::write(path, text) }
}
