//! Command `toothwave study`: computes a study on all cores of this machine, or as jobs of a cluster.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use parking_lot::Mutex;
use rayon::prelude::*;
use toothwave_calculation::forms::Format;
use toothwave_study::{Gathered, Limits, Part, PartFolder, Study, StudyAnswer, Work};

use super::Failure;
use super::offline::{FORMATS, log_errors, one_of, print, print_answer, progress_bar, read, require_form};
use crate::http::problem::Problem;

/// Arguments of the command.
#[derive(Debug, Args)]
pub(super) struct StudyCommand {
    /// A study document, or `-` for standard input
    file: PathBuf,
    /// Format of the result, `json` by default; with `--rows` `csv` (default) or `parquet`
    #[arg(long, value_parser = one_of(&FORMATS))]
    format: Option<Format>,
    /// Compute one of PARTS parts into `--into FOLDER`, for instance 17/200: one job of an array
    #[arg(long, value_name = "N/PARTS", requires = "into", value_parser = PartOf::parse)]
    part: Option<PartOf>,
    /// Folder for the files of a part; chunks that have a file are not computed again
    #[arg(long, value_name = "FOLDER", requires = "part")]
    into: Option<PathBuf>,
    /// Print the result from the parts in this folder
    #[arg(long, value_name = "FOLDER", conflicts_with = "part")]
    merge: Option<PathBuf>,
    /// Print one row for each variant instead of the result
    #[arg(long, conflicts_with = "part")]
    rows: bool,
}

/// Part number of an array job, counted from 0 or from 1: number `parts` is the same part as number 0.
#[derive(Debug, Clone, Copy)]
struct PartOf {
    number: u64,
    parts: u64,
}

impl PartOf {
    fn parse(text: &str) -> Result<Self, &'static str> {
        let numbers = text.split_once('/').map(|(number, parts)| (number.parse(), parts.parse()));
        match numbers {
            Some((Ok(number), Ok(parts))) if parts > 0 && number <= parts => Ok(Self { number, parts }),
            _ => Err("expected N/PARTS, for instance 17/200: the part's number, from 0 or 1, and the number of parts"),
        }
    }

    /// Returns the chunks of this part, `parts` apart, because neighbouring chunks often take equally long.
    fn chunks(self, study: &Study) -> Vec<u64> {
        (0..study.chunks()).filter(|chunk| chunk % self.parts == self.number % self.parts).collect()
    }
}

pub(super) fn run(command: &StudyCommand) -> Result<(), Failure> {
    log_errors();
    let format = command.format.unwrap_or(if command.rows { Format::Csv } else { Format::Json });
    if command.rows && !matches!(format, Format::Csv | Format::Parquet) {
        return Err(Failure::BadInput("rows have no such format. Use `--format csv` or `--format parquet`".into()));
    }
    require_form::<StudyAnswer>(format)?;
    let study = Arc::new(Study::read(&read(&command.file)?, &Limits::OFFLINE).map_err(Problem::from)?);
    if command.rows && !study.has_rows() {
        return Err(Failure::BadInput("a search has no rows. Leave out `--rows`: the result lists the designs".into()));
    }
    if let (Some(part), Some(folder)) = (command.part, &command.into) {
        return compute_part(&study, part, folder);
    }
    let gathered = match &command.merge {
        Some(folder) => merged(&study, folder)?,
        None => computed(&study)?,
    };
    if command.rows {
        print(|writer| gathered.write_rows(format, writer))?;
    } else {
        print_answer(&gathered.answer(), format)?;
    }
    require_complete(&study, &gathered)
}

fn computed(study: &Arc<Study>) -> Result<Gathered, Failure> {
    let gathered = Mutex::new(Gathered::new(study));
    compute(study, (0..study.chunks()).collect(), |chunk, part| {
        gathered.lock().add(chunk, part);
        Ok(())
    })?;
    Ok(gathered.into_inner())
}

/// Computes chunks on all cores and passes each part to `take`.
fn compute(
    study: &Arc<Study>,
    chunks: Vec<u64>,
    take: impl Fn(u64, Part) -> Result<(), Failure> + Sync,
) -> Result<(), Failure> {
    let progress = progress_bar();
    progress.set_length(chunks.len() as u64);
    let result = chunks.into_par_iter().try_for_each(|chunk| {
        // The stop flag is never set, so every chunk has a part.
        let Ok(part) = Work::new(study, chunk).run(&AtomicBool::new(false)) else { return Ok(()) };
        take(chunk, part)?;
        progress.inc(1);
        Ok(())
    });
    progress.finish_and_clear();
    result
}

/// Computes the chunks of a part that have no file yet, and checks the files of the others.
fn compute_part(study: &Arc<Study>, part: PartOf, folder: &Path) -> Result<(), Failure> {
    let folder = PartFolder::create(folder)?;
    let done = folder.chunks()?;
    let (there, missing): (Vec<_>, Vec<_>) = part.chunks(study).into_iter().partition(|chunk| done.contains(chunk));
    there.iter().try_for_each(|&chunk| read_part(study, &folder, chunk).map(drop))?;
    let computed = missing.len();
    compute(study, missing, |chunk, part| Ok(folder.write(chunk, &study.part_bytes(chunk, &part)?)?))?;
    let PartOf { number, parts } = part;
    let (there, all) = (there.len(), study.chunks());
    // Standard error may be closed.
    let _ =
        writeln!(io::stderr(), "part {number}/{parts}: computed {computed} chunks, found {there}; the study has {all}");
    Ok(())
}

fn merged(study: &Arc<Study>, folder: &Path) -> Result<Gathered, Failure> {
    let folder = PartFolder::open(folder)?;
    let mut gathered = Gathered::new(study);
    for chunk in folder.chunks()? {
        gathered.add(chunk, read_part(study, &folder, chunk)?);
    }
    Ok(gathered)
}

fn read_part(study: &Study, folder: &PartFolder, chunk: u64) -> Result<Part, Failure> {
    let refused = |error| Failure::BadInput(format!("{}: {error}", folder.file(chunk).display()));
    study.read_part(chunk, folder.read(chunk)?).map_err(refused)
}

/// Returns an error if the printed result is incomplete.
fn require_complete(study: &Study, gathered: &Gathered) -> Result<(), Failure> {
    const MOST_NAMED: usize = 10;
    let missing: Vec<_> = gathered.missing().collect();
    if missing.is_empty() {
        return Ok(());
    }
    let named: Vec<_> = missing.iter().take(MOST_NAMED).map(u64::to_string).collect();
    let more = if missing.len() > MOST_NAMED { ", …" } else { "" };
    let (count, all, named) = (missing.len(), study.chunks(), named.join(", "));
    let text = format!(
        "the result is incomplete: {count} of {all} chunks are missing ({named}{more}). Run the failed parts again"
    );
    Err(io::Error::other(text).into())
}
