//! `toothwave study`: many variants of one design, computed on all cores.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use parking_lot::Mutex;
use rayon::prelude::*;
use toothwave_calculation::forms::Format;
use toothwave_study::{Gathered, Study, StudyAnswer, Work};

use super::Failure;
use super::offline::{OFFLINE, log_errors, print_answer, progress_bar, read, require_form};
use crate::http::problem::Problem;

/// Limits without a server: 8 GiB of results.
const OFFLINE_STUDY: toothwave_study::Limits =
    toothwave_study::Limits { calculation: OFFLINE, max_study_variants: 1_000_000_000, max_study_bytes: 8 << 30 };

pub(super) fn run(file: &Path, format: Format) -> Result<(), Failure> {
    log_errors();
    require_form::<StudyAnswer>(format)?;
    let study = Arc::new(Study::read(&read(file)?, &OFFLINE_STUDY).map_err(Problem::from)?);
    let progress = progress_bar();
    progress.set_length(study.variants());
    let gathered = Mutex::new(Gathered::new(&study));
    (0..study.chunks()).into_par_iter().for_each(|chunk| {
        // The stop flag is never set, so every chunk has a part.
        let Ok(part) = Work::new(&study, chunk).run(&AtomicBool::new(false)) else { return };
        let mut gathered = gathered.lock();
        gathered.add(chunk, part);
        progress.set_position(gathered.variants());
    });
    progress.finish_and_clear();
    print_answer(&gathered.into_inner().answer(), format)
}
