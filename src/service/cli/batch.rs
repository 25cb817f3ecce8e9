//! `toothwave batch`: one design document a line, computed on all cores.

use std::fs::File;
use std::io::{self, BufRead, Write as _};
use std::path::Path;

use rayon::prelude::*;
use toothwave_calculation::question::Limits;

use super::Failure;
use super::offline::{log_errors, print, progress_bar};
use crate::http::endpoints::batch::{BatchEnd, BatchQuery, computed_line, json_line};

/// Lines that are computed before the first of them is written. Whole answers are long, so there are few.
const fn lines_at_once(query: BatchQuery, cores: usize) -> usize {
    if query.peaks_only { 256 * cores } else { 2 * cores }
}

pub(super) fn run(file: &Path, query: BatchQuery) -> Result<(), Failure> {
    log_errors();
    query.require_possible()?;
    let open = |error: io::Error| Failure::BadInput(format!("{}: {error}", file.display()));
    let (input, bytes): (Box<dyn BufRead>, u64) = if file.as_os_str() == "-" {
        (Box::new(io::stdin().lock()), 0)
    } else {
        let opened = File::open(file).map_err(open)?;
        let bytes = opened.metadata().map_err(open)?.len();
        (Box::new(io::BufReader::new(opened)), bytes)
    };
    let progress = progress_bar();
    progress.set_length(bytes);
    let mut lines = input.split(b'\n');
    let mut index = 0;
    print(|writer| {
        loop {
            let chunk: Vec<_> =
                lines.by_ref().take(lines_at_once(query, rayon::current_num_threads())).collect::<io::Result<_>>()?;
            if chunk.is_empty() {
                progress.finish_and_clear();
                let end = BatchEnd { asked: index, answered: index, problem: None };
                return writer.write_all(&json_line(&end));
            }
            progress.inc(chunk.iter().map(|line| line.len() as u64 + 1).sum());
            let documents: Vec<_> = chunk.iter().filter(|line| !line.trim_ascii().is_empty()).zip(index..).collect();
            let answers: Vec<_> = documents
                .par_iter()
                .map(|&(document, index)| computed_line(query, index, document, &Limits::OFFLINE))
                .collect();
            index += documents.len() as u64;
            progress.set_message(format!("{index} designs"));
            answers.iter().try_for_each(|answer| writer.write_all(answer))?;
        }
    })
}
