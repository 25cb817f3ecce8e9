//! Many variants of one design: maps, searches, sensitivities and tolerances.
//!
//! A study is read from a document, checked as a whole, and consists of chunks. A chunk is a pure function of the study and of its number;
//! what chunks come to is merged in any order to the same bits. Who carries them out, on how many threads, and what is kept where, is the
//! caller's: this crate knows no network, no clock and no threads.

mod answer;
mod ask;
mod document;
mod evaluate;
mod front;
mod identity;
mod limit;
mod map;
pub mod optimise;
mod quantity;
mod random;
mod rank;
mod rows;
mod search;
mod sensitivity;
mod study;
mod table;
mod tolerance;
mod variant;

pub use answer::StudyAnswer;
pub use document::*;
pub use evaluate::{Reason, Stopped};
pub use limit::Bound;
pub use map::{AxisAnswer, MapAnswer};
pub use quantity::{AnswerPlace, Needs, QUANTITIES, Quantity, Source};
pub use rank::{QuantileAnswer, ShareAnswer};
pub use rows::{ImpossibleAnswer, PossibleAnswer, ReasonAnswer, RowsPart};
pub use search::{FoundAnswer, FreeAnswer, IslandPart, LimitAnswer, RelaxationAnswer, ScanAnswer, SearchAnswer};
pub use sensitivity::{SensitivityAnswer, SensitivityOfQuantity, SensitivityToInput};
pub use study::{Gathered, Limits, Part, Study, Work};
pub use tolerance::{
    ContributorAnswer, HistogramAnswer, ToleranceAnswer, ToleranceLimitAnswer, ToleranceQuantityAnswer,
};
