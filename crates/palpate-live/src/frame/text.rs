//! Frames of text: a line a reading.

use super::json;
use super::names::{Filling, Names, Role};
use super::{BadFrame, Frame};

/// Reading of a line of text.
#[derive(Debug)]
pub enum Line {
    /// Blank, or a comment.
    Nothing,
    /// Names of the values of the lines that follow.
    Header,
    /// A frame of values without names, whose first value may have lost its first digits where the start of the line is not there.
    Unnamed(Frame),
    /// A frame that would not be one if the start of its line were not there.
    Whole(Frame),
}

/// Reader of lines of text.
#[derive(Debug)]
pub struct TextReader {
    names: Names,
    /// Roles of values without names: of the channels in their order, until a header or a user names them.
    columns: Vec<Role>,
    /// Names of the last line that had some, with their roles: most lines have the same.
    known: Vec<(Vec<u8>, Role)>,
}

impl TextReader {
    /// A reader of frames of these channels.
    pub fn new(names: Names) -> Self {
        let columns = (0..names.len()).map(Role::Channel).collect();
        Self { names, columns, known: Vec::new() }
    }

    /// Names of channels.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// Roles of values without names.
    pub fn columns(&self) -> &[Role] {
        &self.columns
    }

    /// Sets the roles of values without names.
    pub fn set_columns(&mut self, columns: Vec<Role>) {
        self.columns = columns;
    }

    /// Reads a line without its end.
    pub fn read(&mut self, line: &[u8]) -> Result<Line, BadFrame> {
        let line = line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(line).trim_ascii();
        let Some(first) = line.first() else { return Ok(Line::Nothing) };
        let marks = Marks::found_in(line);
        if marks.has(Marks::CONTROL) || std::str::from_utf8(line).is_err() {
            return Err(BadFrame::Encoding);
        }
        match first {
            b'#' => Ok(Line::Nothing),
            b'{' => self.object(line).map(Line::Whole),
            b'[' => json::array(line, &self.names, &self.columns).map(Line::Whole),
            _ => self.fields(line, marks),
        }
    }

    fn object(&mut self, line: &[u8]) -> Result<Frame, BadFrame> {
        let Self { names, known, .. } = self;
        json::object(line, names, |i, name| role_of(names, known, i, name))
    }

    fn fields(&mut self, line: &[u8], marks: Marks) -> Result<Line, BadFrame> {
        let separator = Separator::found_in(line, marks);
        let fields = Fields { rest: Some(line), separator };
        if marks.has(Marks::NAMED) && fields.clone().next().is_some_and(|field| named(field).is_some()) {
            return self.named(fields, separator).map(Line::Whole);
        }
        let mut frame = Filling::new(&self.names);
        let mut roles = self.columns.iter();
        for field in fields.clone() {
            let Some(value) = number(field, separator) else { return self.header(fields) };
            frame.set(*roles.next().ok_or(BadFrame::Channels)?, value)?;
        }
        if roles.next().is_some() {
            return Err(BadFrame::Channels);
        }
        frame.finish().map(Line::Unnamed)
    }

    fn named(&mut self, fields: Fields, separator: Separator) -> Result<Frame, BadFrame> {
        let mut frame = Filling::new(&self.names);
        for (i, field) in fields.enumerate() {
            let (name, value) = named(field).ok_or(BadFrame::NotANumber)?;
            match role_of(&self.names, &mut self.known, i, name) {
                Role::Ignored => {}
                role => frame.set(role, number(value, separator).ok_or(BadFrame::NotANumber)?)?,
            }
        }
        frame.finish()
    }

    /// Takes a line for names, where it has some number that is none.
    fn header(&mut self, fields: Fields) -> Result<Line, BadFrame> {
        let separator = fields.separator;
        let mut roles = Vec::new();
        for field in fields {
            if number(field, separator).is_some() {
                return Err(BadFrame::NotANumber);
            }
            let name = field.strip_prefix(b"\"").and_then(|field| field.strip_suffix(b"\"")).unwrap_or(field);
            roles.push(std::str::from_utf8(name).map_or(Role::Ignored, |name| self.names.role(name)));
        }
        let channels = roles.iter().filter(|role| matches!(role, Role::Channel(_))).count();
        if channels == 0 {
            return Err(BadFrame::NotANumber);
        }
        if self.names.lacking(&roles).is_some() {
            return Err(BadFrame::MissingChannel);
        }
        if channels > self.names.len() {
            return Err(BadFrame::Channels);
        }
        self.columns = roles;
        Ok(Line::Header)
    }
}

/// Role of the name of the `i`-th value of a line.
fn role_of(names: &Names, known: &mut Vec<(Vec<u8>, Role)>, i: usize, name: &[u8]) -> Role {
    if let Some((last, role)) = known.get(i)
        && last == name
    {
        return *role;
    }
    let role = std::str::from_utf8(name).map_or(Role::Ignored, |name| names.role(name));
    if let Some(place) = known.get_mut(i) {
        place.0.clear();
        place.0.extend_from_slice(name);
        place.1 = role;
    } else if i == known.len() {
        known.push((name.to_vec(), role));
    }
    role
}

/// Name and value of a field, where it has a name.
fn named(field: &[u8]) -> Option<(&[u8], &[u8])> {
    let at = field.iter().position(|byte| matches!(byte, b':' | b'='))?;
    Some((field[..at].trim_ascii_end(), field[at + 1..].trim_ascii_start()))
}

/// Most characters of a number with a decimal comma.
const LONGEST_NUMBER: usize = 64;

/// A number, with a decimal comma too where commas do not separate.
fn number(field: &[u8], separator: Separator) -> Option<f64> {
    let parse = |bytes: &[u8]| std::str::from_utf8(bytes).ok()?.parse().ok();
    let comma = || field.iter().position(|byte| *byte == b',');
    match separator {
        Separator::Comma => parse(field),
        _ => match comma() {
            None => parse(field),
            Some(comma) => {
                let mut copy = [0; LONGEST_NUMBER];
                let copy = copy.get_mut(..field.len())?;
                copy.copy_from_slice(field);
                copy[comma] = b'.';
                parse(copy)
            }
        },
    }
}

/// Kinds of bytes that a line has.
#[derive(Clone, Copy)]
struct Marks(u8);

impl Marks {
    const COMMA: u8 = 1;
    const SEMICOLON: u8 = 1 << 1;
    const TAB: u8 = 1 << 2;
    const BLANK: u8 = 1 << 3;
    const NAMED: u8 = 1 << 4;
    const CONTROL: u8 = 1 << 5;

    /// Kinds by byte.
    const KINDS: [u8; 256] = {
        let mut kinds = [0; 256];
        let mut byte = 0;
        while byte < 256 {
            kinds[byte] = match byte as u8 {
                b',' => Self::COMMA,
                b';' => Self::SEMICOLON,
                b'\t' => Self::TAB,
                b' ' => Self::BLANK,
                b':' | b'=' => Self::NAMED,
                0..=31 | 127 => Self::CONTROL,
                _ => 0,
            };
            byte += 1;
        }
        kinds
    };

    fn found_in(line: &[u8]) -> Self {
        Self(line.iter().fold(0, |marks, byte| marks | Self::KINDS[usize::from(*byte)]))
    }

    fn has(self, mark: u8) -> bool {
        self.0 & mark != 0
    }
}

/// True for bytes that may be lines of text: no control characters but tabs and line ends.
pub fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| matches!(byte, b'\t' | b'\r' | b'\n') || !byte.is_ascii_control())
}

/// Separator of the values of a line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Separator {
    Comma,
    Semicolon,
    Tab,
    Blanks,
}

impl Separator {
    fn found_in(line: &[u8], marks: Marks) -> Self {
        if marks.has(Marks::SEMICOLON) {
            Self::Semicolon
        } else if marks.has(Marks::TAB) {
            Self::Tab
        } else if marks.has(Marks::COMMA) && !(marks.has(Marks::BLANK) && commas_are_decimal(line)) {
            Self::Comma
        } else {
            Self::Blanks
        }
    }
}

/// True where every comma stands between two digits: with blanks in the line, these separate.
fn commas_are_decimal(line: &[u8]) -> bool {
    let digit = |i: usize| line.get(i).is_some_and(u8::is_ascii_digit);
    let decimal = |(i, byte): (usize, &u8)| *byte != b',' || (i > 0 && digit(i - 1) && digit(i + 1));
    line.iter().enumerate().all(decimal)
}

/// Fields of a line; one separator may follow the last.
#[derive(Clone)]
struct Fields<'a> {
    rest: Option<&'a [u8]>,
    separator: Separator,
}

impl<'a> Iterator for Fields<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest.take()?;
        let byte = match self.separator {
            Separator::Comma => b',',
            Separator::Semicolon => b';',
            Separator::Tab => b'\t',
            Separator::Blanks => b' ',
        };
        let Some(end) = rest.iter().position(|is| *is == byte) else { return Some(rest.trim_ascii()) };
        let left = rest[end + 1..].trim_ascii_start();
        // A tab is a blank to `trim_ascii_start`, but the start of an empty field here.
        let left = if self.separator == Separator::Tab { &rest[end + 1..] } else { left };
        self.rest = (!left.is_empty()).then_some(left);
        Some(rest[..end].trim_ascii())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::channels;
    use super::*;

    fn reader() -> TextReader {
        TextReader::new(Names::new(&channels(&["a", "b"])))
    }

    fn reading(line: &str) -> Result<Vec<f64>, BadFrame> {
        match reader().read(line.as_bytes())? {
            Line::Unnamed(frame) | Line::Whole(frame) => Ok(frame.reading),
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn values_are_separated_by_commas_semicolons_tabs_or_blanks() {
        let lines = [
            "1.5,-2",
            "1.5, -2",
            " 1.5 , -2 \r",
            "1.5,-2,",
            "1.5;-2",
            "1,5;-2",
            "1,5;-2,0;",
            "1.5\t-2",
            "1,5\t-2\t",
            "1.5 -2",
            "1,5 -2",
            "1,5   -2,0",
            "\u{FEFF}1.5,-2",
            "+1.5,-2e0",
            "a:1.5,b:-2",
            "b:-2,a:1.5",
            "A:1.5\tB:-2",
            "a=1.5 b=-2",
            "a = 1.5, b = -2",
            "a:1,5;b:-2,0",
            "a:1,5 b:-2",
            "x:text,a:1.5,b:-2",
            "[1.5, -2]",
            r#"{"b": -2, "A": 1.5}"#,
            r#"{"a":1.5,"more":{"a":[7]},"b":-2,"s":"x","z":null}"#,
        ];
        for line in lines {
            assert_eq!(reading(line), Ok(vec![1.5, -2.0]), "{line}");
        }
    }

    #[test]
    fn every_bad_line_has_its_cause() {
        use BadFrame::{Channels, Encoding, Malformed, MissingChannel, NotANumber};
        let lines: [(&[u8], BadFrame); 22] = [
            (b"1", Channels),
            (b"1,2,3", Channels),
            (b"1,,2", NotANumber),
            (b"1,2,,", NotANumber),
            (b"1\t\t2", NotANumber),
            (b"1,x", NotANumber),
            (b"1,nan", NotANumber),
            (b"1,inf", NotANumber),
            (b"1,1e999", NotANumber),
            (b"hello world", NotANumber),
            (b"a,c", MissingChannel),
            (b"a:1", MissingChannel),
            (b"a:1,c:2", MissingChannel),
            (b"a:1,a:2,b:3", Channels),
            (b"a:1,2", NotANumber),
            (b"1,\xFF", Encoding),
            (b"1,\x002", Encoding),
            (b"[1]", Channels),
            (b"[1,null]", NotANumber),
            (b"[1,2", Malformed),
            (br#"{"a":1}"#, MissingChannel),
            (br#"{"a":1,"b":"2"}"#, NotANumber),
        ];
        for (line, cause) in lines {
            let read = reader().read(line);
            assert!(matches!(read, Err(is) if is == cause), "{}: {read:?}", String::from_utf8_lossy(line));
        }
    }

    #[test]
    fn a_header_names_the_values_of_the_lines_that_follow() {
        let mut reader = reader();
        assert!(matches!(reader.read(b"millis;\"B\";temperature;seq;a"), Ok(Line::Header)));
        let Ok(Line::Unnamed(frame)) = reader.read(b"1500;2;99;7;1") else { panic!() };
        assert_eq!(frame.reading, [1.0, 2.0]);
        assert_eq!(frame.device_time, Some(std::time::Duration::from_millis(1500)));
        assert_eq!(frame.sequence, Some(7));
        assert!(matches!(reader.read(b"1,2"), Err(BadFrame::Channels)));
    }

    #[test]
    fn blank_lines_and_comments_are_nothing() {
        for line in ["", "  \r", "# 1,2", "\u{FEFF}"] {
            assert!(matches!(reader().read(line.as_bytes()), Ok(Line::Nothing)), "{line:?}");
        }
    }

    #[test]
    fn times_and_numbers_of_frames_come_in_their_units() {
        let frame = |line: &str| match reader().read(line.as_bytes()) {
            Ok(Line::Whole(frame)) => frame,
            other => panic!("{other:?}"),
        };
        for line in [
            "t:2,a:1,b:2",
            "time:2,a:1,b:2",
            "time_s:2,a:1,b:2",
            "ms:2000,a:1,b:2",
            "Time_ms:2000,a:1,b:2",
            "us:2000000,a:1,b:2",
            "micros:2e6,a:1,b:2",
        ] {
            assert_eq!(frame(line).device_time, Some(std::time::Duration::from_secs(2)), "{line}");
        }
        assert_eq!(frame("n:4294967297,a:1,b:2").sequence, Some(1));
        for line in ["t:-1,a:1,b:2", "t:1e13,a:1,b:2", "n:1.5,a:1,b:2", "n:-1,a:1,b:2", "seq:x,a:1,b:2"] {
            assert!(matches!(reader().read(line.as_bytes()), Err(BadFrame::NotANumber)), "{line}");
        }
    }
}
