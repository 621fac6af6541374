//! One line of CSV, cut into fields without losing where each of them stands.

use std::borrow::Cow;
use std::ops::Range;

/// One field: its value, and the bytes of the line it came from.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field<'a> {
    /// The value, without the spaces and quotes around it.
    pub value: Cow<'a, str>,
    /// Where it stands in the line, spaces around it left out.
    pub span: Range<usize>,
}

/// A quote that the line does not close.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OpenQuote {
    /// From the quote to the end of the line.
    pub span: Range<usize>,
}

/// Cuts `line` at its commas, except within double quotes; a doubled quote within quotes is a quote (RFC 4180, but
/// a field ends with its line, so that every row has one line number).
pub(super) fn split(line: &str) -> Result<Vec<Field<'_>>, OpenQuote> {
    let bytes = line.as_bytes();
    let mut fields = Vec::new();
    let mut start = 0;
    loop {
        let opening = start + bytes[start..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
        let end = if bytes.get(opening) == Some(&b'"') {
            let closing = closing_quote(bytes, opening).ok_or(OpenQuote { span: opening..bytes.len() })?;
            comma(bytes, closing)
        } else {
            comma(bytes, opening)
        };
        fields.push(field(line, start..end));
        if end == bytes.len() {
            return Ok(fields);
        }
        start = end + 1;
    }
}

fn comma(bytes: &[u8], from: usize) -> usize {
    from + bytes[from..].iter().take_while(|b| **b != b',').count()
}

/// The first byte after the quoted text that begins at `opening`.
fn closing_quote(bytes: &[u8], opening: usize) -> Option<usize> {
    let mut at = opening + 1;
    loop {
        at += bytes.get(at..)?.iter().position(|b| *b == b'"')?;
        if bytes.get(at + 1) != Some(&b'"') {
            return Some(at + 1);
        }
        at += 2;
    }
}

fn field(line: &str, range: Range<usize>) -> Field<'_> {
    let text = &line[range.clone()];
    let trimmed = text.trim();
    let start = range.start + (text.len() - text.trim_start().len());
    let quoted = trimmed.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    let value = match quoted {
        Some(inside) if inside.contains("\"\"") => Cow::Owned(inside.replace("\"\"", "\"")),
        Some(inside) => Cow::Borrowed(inside),
        None => Cow::Borrowed(trimmed),
    };
    Field { value: trim(value), span: start..start + trimmed.len() }
}

fn trim(value: Cow<'_, str>) -> Cow<'_, str> {
    match value {
        Cow::Borrowed(text) => Cow::Borrowed(text.trim()),
        Cow::Owned(text) => Cow::Owned(text.trim().to_owned()),
    }
}
