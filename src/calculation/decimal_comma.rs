//! CSV for spreadsheets where the decimal sign is a comma: fields stand between semicolons.

use std::io::{self, Write};

/// Takes CSV with a decimal point and commas between fields, and writes it with a decimal comma and semicolons.
pub(crate) struct DecimalComma<W> {
    writer: W,
    /// The field as far as it was written.
    field: Vec<u8>,
    is_quoted: bool,
}

impl<W: Write> DecimalComma<W> {
    pub(crate) const fn new(writer: W) -> Self {
        Self { writer, field: Vec::new(), is_quoted: false }
    }

    fn end_field(&mut self, end: u8, text: &mut Vec<u8>) {
        let field = self.field.as_slice();
        if std::str::from_utf8(field).is_ok_and(|field| field.parse::<f64>().is_ok()) {
            text.extend(field.iter().map(|&byte| if byte == b'.' { b',' } else { byte }));
        } else if field.contains(&b';') && !field.starts_with(b"\"") {
            text.extend([&b"\""[..], field, b"\""].concat());
        } else {
            text.extend(field);
        }
        text.push(end);
        self.field.clear();
    }
}

impl<W: Write> Write for DecimalComma<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut text = Vec::with_capacity(bytes.len());
        for &byte in bytes {
            match byte {
                b',' if !self.is_quoted => self.end_field(b';', &mut text),
                b'\n' if !self.is_quoted => self.end_field(b'\n', &mut text),
                _ => {
                    self.is_quoted ^= byte == b'"';
                    self.field.push(byte);
                }
            }
        }
        self.writer.write_all(&text)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::DecimalComma;

    #[test]
    fn swaps_signs_of_numbers_alone() {
        let csv = "v1.2,\"a,\"\"b.c\",d;e\n-1.5e-7,3,\n0.25,true,\"x;y\"\n";
        let wanted = "v1.2;\"a,\"\"b.c\";\"d;e\"\n-1,5e-7;3;\n0,25;true;\"x;y\"\n";
        for piece in 1..csv.len() {
            let mut text = Vec::new();
            let mut writer = DecimalComma::new(&mut text);
            let written = csv.as_bytes().chunks(piece).try_for_each(|bytes| writer.write_all(bytes));
            assert!(written.is_ok());
            assert_eq!(String::from_utf8_lossy(&text), wanted);
        }
    }
}
