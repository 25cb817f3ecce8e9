//! Answers one document without a server.

use std::fs;
use std::io::{self, Read as _, Write};
use std::iter;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use indicatif::{ProgressBar, ProgressStyle};
use toothwave_calculation::drawing::DrawnPart;
use toothwave_calculation::forms::{Format, Forms};
use toothwave_calculation::question::{Limits, Question};

use super::Failure;
use crate::http::problem::Problem;

/// A value of a command-line option: its word, an alias, and its help text.
pub(super) struct Choice<T> {
    value: T,
    word: &'static str,
    alias: Option<&'static str>,
    help: &'static str,
}

const fn choice<T>(value: T, word: &'static str, help: &'static str) -> Choice<T> {
    Choice { value, word, alias: None, help }
}

pub(super) const FORMATS: [Choice<Format>; 11] = [
    choice(Format::Json, "json", "For programs"),
    choice(Format::Csv, "csv", "Columns as comma-separated values"),
    choice(Format::CsvComma, "csv-comma", "Columns with a decimal comma, semicolons between them"),
    choice(Format::Arrow, "arrow", "Columns as an Apache Arrow stream"),
    choice(Format::Parquet, "parquet", "Columns as an Apache Parquet file"),
    Choice { value: Format::Text, word: "text", alias: Some("table"), help: "Summary for a terminal" },
    choice(Format::Svg, "svg", "Image"),
    choice(Format::Dxf, "dxf", "Outlines for CAD and manufacturing"),
    choice(Format::Step, "step", "Solids for CAD"),
    choice(Format::ThreeMf, "3mf", "Meshes for printers"),
    choice(Format::Stl, "stl", "One mesh for printers that read no 3MF"),
];

pub(super) const PARTS: [Choice<DrawnPart>; 5] = [
    choice(DrawnPart::Ring, "ring", "The ring; x runs through the middle of a tooth space"),
    choice(DrawnPart::WaveGenerator, "wave-generator", "The wave generator; x is its major axis"),
    choice(DrawnPart::Carrier, "carrier", "The carrier; x runs along a slot"),
    choice(DrawnPart::Tooth, "tooth", "One tooth"),
    choice(DrawnPart::Assembly, "assembly", "All parts at the document's input angle, in the ring's frame"),
];

/// Returns a parser that accepts the words of these choices.
pub(super) fn one_of<T: Copy + Send + Sync + 'static>(
    choices: &'static [Choice<T>],
) -> impl TypedValueParser<Value = T> {
    let values = choices.iter().map(|choice| PossibleValue::new(choice.word).aliases(choice.alias).help(choice.help));
    PossibleValuesParser::new(values).try_map(|word| {
        let chosen = choices.iter().find(|choice| choice.word == word || choice.alias == Some(&*word));
        chosen.map(|choice| choice.value).ok_or("none of the choices")
    })
}

/// Answers one document.
pub(super) fn answer<Q: Question>(question: Q, file: &Path, format: Format) -> Result<(), Failure> {
    log_errors();
    require_form::<Q::Answer>(format)?;
    let text = read(file)?;
    print_answer(&question.ask(&text, &Limits::OFFLINE, &AtomicBool::new(false)).map_err(Problem::from)?, format)
}

/// Logs the causes of internal errors to standard error.
pub(super) fn log_errors() {
    tracing_subscriber::fmt().with_max_level(tracing::Level::ERROR).with_writer(io::stderr).init();
}

/// Reads a file, or standard input for `-`.
pub(super) fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    if file.as_os_str() != "-" {
        return fs::read(file).map_err(|error| Failure::BadInput(format!("{}: {error}", file.display())));
    }
    let mut text = Vec::new();
    io::stdin().read_to_end(&mut text)?;
    Ok(text)
}

/// Checks that the answer type has this format.
pub(super) fn require_form<A: Forms>(format: Format) -> Result<(), Failure> {
    let known: Vec<_> = iter::once(Format::Json).chain(A::FORMS.iter().map(|(format, _)| *format)).collect();
    if known.contains(&format.offered()) {
        return Ok(());
    }
    let name = |format: &Format| FORMATS.iter().find(|choice| choice.value == *format).map_or("", |choice| choice.word);
    let names: Vec<_> = known.iter().map(name).collect();
    Err(Failure::BadInput(format!("this answer has no format `{}`. Use one of: {}", name(&format), names.join(", "))))
}

pub(super) fn print_answer(answer: &impl Forms, format: Format) -> Result<(), Failure> {
    print(|writer| {
        answer.write(format, writer)?;
        // The other formats end with a line break.
        if format == Format::Json { writeln!(writer) } else { Ok(()) }
    })
}

/// Writes to standard output. A closed pipe is not an error.
pub(super) fn print(
    write: impl FnOnce(&mut io::BufWriter<io::StdoutLock<'static>>) -> io::Result<()>,
) -> Result<(), Failure> {
    let mut writer = io::BufWriter::new(io::stdout().lock());
    match write(&mut writer).and_then(|()| writer.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Returns a progress bar. It is visible only if standard error is a terminal.
pub(super) fn progress_bar() -> ProgressBar {
    ProgressBar::new(0).with_style(
        ProgressStyle::with_template("{bar:40} {percent}% {msg}, {elapsed} elapsed, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    )
}
