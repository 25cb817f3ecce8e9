//! The mutants that cargo-mutants lists.

use serde::Deserialize;

/// One change of one place.
#[derive(Debug, Clone, Deserialize)]
pub struct Mutant {
    /// Place and change, in words: no two have the same.
    pub name: String,
    pub file: String,
    pub span: Span,
    pub replacement: String,
    pub genre: Genre,
}

impl Mutant {
    /// File and function, as its name has them: `FILE:LINE:COLUMN: replace FUNCTION -> …` or `… in FUNCTION`.
    pub fn function(&self) -> String {
        let change = self.name.split_once(": ").map_or("", |(_, change)| change);
        let function = match change.rsplit_once(" in ") {
            Some((_, function)) => function,
            None => change.trim_start_matches("replace ").split(" -> ").next().unwrap_or_default(),
        };
        format!("{} {function}", self.file)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
pub enum Genre {
    FnValue,
    BinaryOperator,
    UnaryOperator,
    MatchArm,
    MatchArmGuard,
    StructField,
}

#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Span {
    pub start: Place,
    pub end: Place,
}

/// Line and column, both from 1, the column in characters.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Place {
    pub line: usize,
    pub column: usize,
}

/// The bytes at which the lines of a text start, to turn places into offsets.
pub struct Lines<'t> {
    text: &'t str,
    starts: Vec<usize>,
}

impl<'t> Lines<'t> {
    pub fn of(text: &'t str) -> Self {
        let starts = [0].into_iter().chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { text, starts }
    }

    /// The offset of a place whose column counts from 0.
    pub fn offset(&self, line: usize, column: usize) -> usize {
        let start = self.starts[line - 1];
        let rest = &self.text[start..];
        start + rest.char_indices().nth(column).map_or(rest.len(), |(at, _)| at)
    }

    pub fn range(&self, span: Span) -> std::ops::Range<usize> {
        self.offset(span.start.line, span.start.column - 1)..self.offset(span.end.line, span.end.column - 1)
    }
}
