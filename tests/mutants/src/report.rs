//! What a run found, in short: counts by file and by genre, and the mutants that no test noticed.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::mutant::Mutant;
use crate::trial::Verdict;

/// Kept beside this tool, to tell what is known from what is new.
#[derive(Debug, Serialize, Deserialize)]
pub struct Report {
    pub all: Counts,
    pub genres: BTreeMap<String, Counts>,
    pub files: BTreeMap<String, Counts>,
    pub missed: Vec<String>,
    pub unreached: Vec<String>,
    pub open: Vec<String>,
    /// For cargo-mutants itself.
    pub not_built_in: Vec<String>,
}

#[derive(Debug, Default, Clone, Copy, Serialize, Deserialize)]
pub struct Counts {
    caught: usize,
    timeout: usize,
    missed: usize,
    unreached: usize,
    /// Not noticed by quick tests; no others were asked.
    open: usize,
    unviable: usize,
    not_built_in: usize,
    not_tried: usize,
}

impl Counts {
    fn add(&mut self, verdict: Option<Verdict>) {
        *match verdict {
            Some(Verdict::Caught) => &mut self.caught,
            Some(Verdict::Timeout) => &mut self.timeout,
            Some(Verdict::Missed) => &mut self.missed,
            Some(Verdict::Unreached) => &mut self.unreached,
            Some(Verdict::Open) => &mut self.open,
            Some(Verdict::Unviable) => &mut self.unviable,
            Some(Verdict::NotBuiltIn) => &mut self.not_built_in,
            None => &mut self.not_tried,
        } += 1;
    }

    /// Mutants caught and tried, of those that compile and are built in; those that stand open count as not caught.
    fn caught_and_tried(&self) -> (usize, usize) {
        let caught = self.caught + self.timeout;
        (caught, caught + self.missed + self.unreached + self.open)
    }

    pub fn share(&self) -> String {
        let (caught, tried) = self.caught_and_tried();
        let percent = 100.0 * caught as f64 / tried as f64;
        let interval = if self.not_tried == 0 || tried == 0 {
            String::new()
        } else {
            let (least, most) = interval(caught, tried, NINETEEN_OF_TWENTY);
            format!(", {:.1} to {:.1} % of all", 100.0 * least, 100.0 * most)
        };
        format!(
            "caught: {caught} of {tried}, {percent:.1} %{interval}; {} open, {} not tried",
            self.open, self.not_tried
        )
    }
}

impl Report {
    pub fn of(mutants: &[Mutant], verdicts: &[Option<Verdict>]) -> Self {
        let mut report = Self {
            all: Counts::default(),
            genres: BTreeMap::new(),
            files: BTreeMap::new(),
            missed: Vec::new(),
            unreached: Vec::new(),
            open: Vec::new(),
            not_built_in: Vec::new(),
        };
        for (mutant, verdict) in mutants.iter().zip(verdicts) {
            report.all.add(*verdict);
            report.genres.entry(format!("{:?}", mutant.genre)).or_default().add(*verdict);
            report.files.entry(mutant.file.clone()).or_default().add(*verdict);
            match verdict {
                Some(Verdict::Missed) => report.missed.push(mutant.name.clone()),
                Some(Verdict::Unreached) => report.unreached.push(mutant.name.clone()),
                Some(Verdict::Open) => report.open.push(mutant.name.clone()),
                Some(Verdict::NotBuiltIn) => report.not_built_in.push(mutant.name.clone()),
                _ => {}
            }
        }
        report
    }

    /// Those that no test noticed and that another report does not name, wherever in its file it has them.
    pub fn new_beside(&self, known: Option<&Self>) -> Vec<&str> {
        let known: Vec<_> = known.iter().flat_map(|known| known.silent()).map(without_line).collect();
        self.silent().filter(|name| !known.contains(&without_line(name))).collect()
    }

    /// Whether surely fewer are caught than another report says, even if all were that stand open.
    pub fn is_below(&self, known: &Self) -> bool {
        let ((caught, tried), (known_caught, known_tried)) =
            (self.all.caught_and_tried(), known.all.caught_and_tried());
        interval(caught + self.all.open, tried, ALL_BUT_ONE_IN_A_THOUSAND).1 < known_caught as f64 / known_tried as f64
    }

    fn silent(&self) -> impl Iterator<Item = &str> {
        self.missed.iter().chain(&self.unreached).map(String::as_str)
    }
}

/// File and change of a mutant's name, `FILE:LINE:COLUMN: CHANGE`.
fn without_line(name: &str) -> Option<(&str, &str)> {
    Some((name.split(':').next()?, name.split_once(": ")?.1))
}

/// Standard deviations that hold so many samples.
const NINETEEN_OF_TWENTY: f64 = 1.96;
/// Whatever changes is judged by each commit anew: of twenty that are as good as ever one would fail.
const ALL_BUT_ONE_IN_A_THOUSAND: f64 = 3.09;

/// Wilson's interval for the share caught, which a random sample leaves.
fn interval(caught: usize, tried: usize, z: f64) -> (f64, f64) {
    if tried == 0 {
        return (0.0, 1.0);
    }
    let tried = tried as f64;
    let share = caught as f64 / tried;
    let middle = (share + z * z / (2.0 * tried)) / (1.0 + z * z / tried);
    let half = z / (1.0 + z * z / tried) * (share * (1.0 - share) / tried + z * z / (4.0 * tried * tried)).sqrt();
    (middle - half, middle + half)
}
