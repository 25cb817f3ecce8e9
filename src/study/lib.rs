//! Studies of many variants of one design: maps, searches, sensitivity and tolerance studies.
//!
//! A study is read from a document and checked as a whole. It consists of chunks; each is a pure function of the study
//! and the chunk's number. Parts can be merged in any order and give the same bits. This crate has no network, no clock
//! and no threads: the caller runs and stores the chunks. The caller may keep parts as
//! files of a folder ([`PartFolder`]).

mod answer;
mod ask;
mod convert;
mod defaults;
mod document;
mod evaluate;
mod front;
mod gathered;
mod identity;
mod limit;
mod map;
pub mod optimise;
mod part_file;
mod part_folder;
mod point;
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
pub use convert::converted;
pub use document::*;
pub use evaluate::{Reason, Stopped};
pub use gathered::Gathered;
pub use limit::Bound;
pub use map::{AxisAnswer, MapAnswer};
pub use part_file::PartError;
pub use part_folder::PartFolder;
pub use quantity::{AnswerPlace, Needs, QUANTITIES, Quantity, Source};
pub use rank::{QuantileAnswer, ShareAnswer};
pub use rows::{ImpossibleAnswer, PossibleAnswer, ReasonAnswer, RowsPart};
pub use search::{FoundAnswer, FreeAnswer, IslandPart, LimitAnswer, RelaxationAnswer, ScanAnswer, SearchAnswer};
pub use sensitivity::{SensitivityAnswer, SensitivityOfQuantity, SensitivityToInput};
pub use study::{Limits, Part, Study, Work};
pub use table::{TableColumn, Values};
pub use tolerance::{
    ContributorAnswer, HistogramAnswer, ToleranceAnswer, ToleranceLimitAnswer, ToleranceQuantityAnswer,
};
