//! Work on one chunk of a study.

use std::sync::Arc;

use toothwave_solver::Stop;

use super::{Kind, Part, Study};
use crate::evaluate::Stopped;
use crate::rows::RowsWork;
use crate::search::Island;

/// A chunk that is being computed, one variant a step. It can be paused between two steps.
#[derive(Debug)]
pub struct Work {
    study: Arc<Study>,
    state: State,
}

#[derive(Debug)]
enum State {
    Rows(RowsWork),
    Island(Box<Island>),
}

impl Work {
    /// Starts a chunk of a study.
    pub fn new(study: &Arc<Study>, chunk: u64) -> Self {
        let state = match &study.kind {
            Kind::Search(search) => State::Island(Box::new(Island::new(search, study.template.clone(), chunk))),
            Kind::Map(_) | Kind::Sensitivity(_) | Kind::Tolerance(_) => {
                let quantities = study.evaluator.quantities.len();
                State::Rows(RowsWork::new(study.template.clone(), quantities, study.span_of(chunk)))
            }
        };
        Self { study: Arc::clone(study), state }
    }

    /// Computes one variant. Returns true if it was the last one. If `stop` is set, it fails and the chunk stays the
    /// same.
    pub fn step(&mut self, stop: &dyn Stop) -> Result<bool, Stopped> {
        let Self { study, state } = self;
        let evaluator = &study.evaluator;
        match (&study.kind, state) {
            (Kind::Map(map), State::Rows(rows)) => rows.step(map, evaluator, stop),
            (Kind::Sensitivity(sensitivity), State::Rows(rows)) => rows.step(sensitivity, evaluator, stop),
            (Kind::Tolerance(tolerance), State::Rows(rows)) => rows.step(tolerance, evaluator, stop),
            (Kind::Search(search), State::Island(island)) => island.step(search, evaluator, stop),
            // `new` never makes this combination.
            (Kind::Search(_), State::Rows(_)) | (_, State::Island(_)) => Ok(true),
        }
    }

    /// Returns the result of a finished chunk.
    pub fn finish(self) -> Part {
        match self.state {
            State::Rows(rows) => Part::Rows(rows.finish()),
            State::Island(island) => Part::Island(island.finish()),
        }
    }

    /// Computes the whole chunk.
    pub fn run(mut self, stop: &dyn Stop) -> Result<Part, Stopped> {
        while !self.step(stop)? {}
        Ok(self.finish())
    }
}
