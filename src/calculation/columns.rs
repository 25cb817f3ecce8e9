//! JSON as serde_json writes it, sooner: most of an answer is columns of numbers, and writing them takes longer than solving.
//!
//! A processor that copies a text right after it was made waits for it. So numbers in a row are kept back until there are a
//! few, then all made into text, then all copied; and of equal ones that follow each other, such as an input angle for all its
//! teeth, the text is made once.

use std::array;
use std::io::{self, Write};

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::Formatter;

/// Writes an object or an array as [`serde_json::to_writer`] does. Arrays hold either floats or none.
pub fn write(value: &impl Serialize, writer: &mut impl Write) -> io::Result<()> {
    let columns = Columns { kept: [0.0; KEPT], count: 0 };
    Ok(value.serialize(&mut Serializer::with_formatter(writer, columns))?)
}

/// Numbers that are kept back at most: enough to hide the wait, few enough for the nearest cache.
const KEPT: usize = 8;

/// Bytes of a double's text: `-2.2250738585072014e-308`.
const LONGEST: usize = 24;

struct Columns {
    /// The last numbers, not written yet; the first `count` of them count.
    kept: [f64; KEPT],
    count: usize,
}

impl Columns {
    fn write_kept(&mut self, writer: &mut (impl Write + ?Sized)) -> io::Result<()> {
        let kept = &self.kept[..self.count];
        self.count = 0;
        let mut buffers: [_; KEPT] = array::from_fn(|_| zmij::Buffer::new());
        let mut texts = [""; KEPT];
        let mut before: Option<(f64, &str)> = None;
        for ((&value, buffer), text) in kept.iter().zip(&mut buffers).zip(&mut texts) {
            *text = match before {
                Some((same, text)) if same.to_bits() == value.to_bits() => text,
                _ => buffer.format_finite(value),
            };
            before = Some((value, text));
        }
        let mut row = [0; KEPT * (LONGEST + 1)];
        let mut end = 0;
        for text in &texts[..kept.len()] {
            row[end..end + text.len()].copy_from_slice(text.as_bytes());
            end += text.len();
            row[end] = b',';
            end += 1;
        }
        writer.write_all(&row[..end.saturating_sub(1)])
    }
}

/// Kept numbers are written before whatever can follow the last number of a row, and the commas between them with them.
impl Formatter for Columns {
    fn write_f64<W: ?Sized + Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        self.kept[self.count] = value;
        self.count += 1;
        if self.count == KEPT { self.write_kept(writer) } else { Ok(()) }
    }

    /// For a float that is no number.
    fn write_null<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        if self.count > 0 {
            self.write_kept(writer)?;
            writer.write_all(b",")?;
        }
        writer.write_all(b"null")
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        if first || self.count > 0 { Ok(()) } else { writer.write_all(b",") }
    }

    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.write_kept(writer)?;
        writer.write_all(b"]")
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        self.write_kept(writer)?;
        if first { Ok(()) } else { writer.write_all(b",") }
    }

    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.write_kept(writer)?;
        writer.write_all(b"}")
    }
}
