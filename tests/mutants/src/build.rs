//! The tree with all its mutants, and those of them that compile.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{fs, io};

use serde_json::Value;

use crate::mutant::Mutant;
use crate::schemata::{self, Built, Left};

/// Errors are mended in rounds, as the compiler finds those of one kind only after those of another.
const MOST_ROUNDS: usize = 40;

/// Functions ten times as long as they were written: what the optimiser does to them beyond this takes it a quarter of an hour.
const PROFILE: [&str; 3] = [
    "profile.dev.debug=false",
    "profile.dev.package.toothwave-solver.codegen-units=1",
    "profile.dev.package.toothwave-solver.opt-level=1",
];

/// What is compiled, and where.
pub struct Tree {
    /// Where the sources come from.
    pub root: PathBuf,
    /// A copy of it, whose sources get the mutants.
    pub copy: PathBuf,
}

/// The tests of the tree with the mutants that compile.
pub struct Program {
    pub tests: PathBuf,
    pub sites: Vec<Built>,
    pub left: HashMap<usize, Left>,
}

impl Tree {
    /// Leaves mutants out until the rest compiles; those of `elsewhere` are built at another time.
    pub fn build(
        &self,
        mutants: &[Mutant],
        mut left: HashMap<usize, Left>,
        elsewhere: &HashSet<usize>,
    ) -> io::Result<Program> {
        let library = "src/solver/lib.rs";
        // All sources, as those without mutants are compiled too.
        let sources = self.sources()?;
        let mut of_file: BTreeMap<&str, Vec<(usize, &Mutant)>> =
            sources.iter().map(|file| (file.as_str(), Vec::new())).collect();
        for (number, mutant) in mutants.iter().enumerate() {
            of_file.entry(&mutant.file).or_default().push((number, mutant));
        }
        let mut constants = HashSet::new();
        for round in 1..=MOST_ROUNDS {
            let without = left.keys().chain(elsewhere).copied().collect();
            let mut files = HashMap::new();
            let mut first = 0;
            for (&file, mutants) in &of_file {
                let source = fs::read_to_string(self.root.join(file))?;
                let schemata =
                    schemata::of_file(&source, mutants, &without, &constants, first).map_err(io::Error::other)?;
                first += mutants.len();
                left.extend(schemata.left.iter().copied());
                let chosen = if file == library { include_str!("chosen.rs") } else { "" };
                write_if_changed(&self.copy.join(file), &(schemata.text.clone() + chosen))?;
                files.insert(file, schemata);
            }
            let errors = self.cargo("check", &[])?.0;
            if errors.is_empty() {
                let sites = files.into_values().flat_map(|file| file.sites).collect();
                let tests =
                    self.cargo("test", &["--no-run"])?.1.ok_or_else(|| io::Error::other("the tests do not compile"))?;
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
            eprintln!(
                "round {round}: {} errors; {} mutants do not compile, {} cannot be built in",
                errors.len(),
                lines.len(),
                sites.len()
            );
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

    /// The solver's files, from the root.
    fn sources(&self) -> io::Result<Vec<String>> {
        let mut directories = vec!["src/solver".to_owned()];
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
    fn cargo(&self, command: &str, options: &[&str]) -> io::Result<(Vec<Value>, Option<PathBuf>)> {
        let output = Command::new("cargo")
            .args([command, "--package", "toothwave-solver", "--test", "solver", "--message-format", "json"])
            .args(PROFILE.iter().flat_map(|setting| ["--config", setting]))
            .args(options)
            .current_dir(&self.copy)
            .env("RUSTFLAGS", "--cap-lints warn")
            .env("CARGO_TARGET_DIR", self.copy.with_extension("target"))
            .stderr(Stdio::inherit())
            .output()?;
        let messages =
            output.stdout.split(|&byte| byte == b'\n').filter_map(|line| serde_json::from_slice::<Value>(line).ok());
        let (mut errors, mut program) = (Vec::new(), None);
        for mut message in messages {
            if message["message"]["level"] == "error"
                && message["message"]["spans"].as_array().is_some_and(|spans| !spans.is_empty())
            {
                errors.push(message["message"].take());
            } else if message["target"]["name"] == "solver" {
                program = message["executable"].as_str().map(PathBuf::from).or(program);
            }
        }
        if errors.is_empty() && !output.status.success() {
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
    let path = error["message"].as_str()?.split('`').nth(1)?;
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
