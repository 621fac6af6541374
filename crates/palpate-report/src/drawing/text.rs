//! Size of a text, estimated without a font.
//!
//! The widths follow the wider common sans-serif fonts (DejaVu Sans, Verdana), so a layout is also
//! valid for the narrower ones (Arial, Noto Sans).

/// Upper estimate in pixels.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    text.chars().map(em).sum::<f64>() * size
}

/// Advance in units of the font size.
fn em(character: char) -> f64 {
    match character {
        'i' | 'j' | 'l' | '\'' | '.' | ',' | ':' | ';' | '|' | ' ' => 0.34,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '!' | '/' | '-' => 0.42,
        'm' | 'w' | 'M' | 'W' | '%' | '@' | '…' => 1.0,
        '+' | '<' | '>' | '=' | '−' | '×' | '±' | '≤' | '≥' | '&' | '~' | '#' => 0.84,
        'A'..='Z' => 0.76,
        '\u{2e80}'.. => 1.05,
        '\u{0250}'.. => 0.8,
        _ => 0.64,
    }
}

pub(crate) fn fit(text: &str, size: f64, room: f64) -> String {
    if width(text, size) <= room {
        return text.to_owned();
    }
    let mut left = room - width("…", size);
    let kept: String = text
        .chars()
        .take_while(|&character| {
            left -= em(character) * size;
            left >= 0.0
        })
        .collect();
    format!("{}…", kept.trim_end())
}

/// Breaks `text` at spaces into at most `lines` lines of `room` pixels, with an ellipsis.
pub(crate) fn wrap(text: &str, size: f64, room: f64, lines: usize) -> Vec<String> {
    let mut wrapped: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let at_last = wrapped.len() == lines;
        match wrapped.last_mut() {
            Some(line) if at_last || width(line, size) + width(" ", size) + width(word, size) <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => wrapped.push(word.to_owned()),
        }
    }
    wrapped.iter().map(|line| fit(line, size, room)).collect()
}

/// Rows of texts that do not touch each other.
#[derive(Default)]
pub(crate) struct Rows(Vec<Vec<(f64, f64)>>);

impl Rows {
    pub fn first_free(&self, left: f64, right: f64) -> usize {
        let free = |row: &Vec<(f64, f64)>| row.iter().all(|&(start, end)| right <= start || end <= left);
        self.0.iter().position(free).unwrap_or(self.0.len())
    }

    /// Occupies the first free row between `left` and `right`, and returns it.
    pub fn place(&mut self, left: f64, right: f64) -> usize {
        let row = self.first_free(left, right);
        if row == self.0.len() {
            self.0.push(Vec::new());
        }
        self.0[row].push((left, right));
        row
    }

    pub fn count(&self) -> usize {
        self.0.len()
    }
}
