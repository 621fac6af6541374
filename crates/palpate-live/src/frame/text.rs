use super::json;
use super::names::{Filling, Names, Role};
use super::printed::{self, Item};
use super::{BadFrame, Frame};
use palpate_mechanics::units::Unit;

#[derive(Debug)]
pub enum Line {
    /// Blank, or a comment.
    Nothing,
    /// Names of the following values.
    Header,
    /// Values without names; the first may be cut.
    Unnamed(Frame),
    /// A frame that is certainly complete.
    Whole(Frame),
}

#[derive(Debug)]
pub struct TextReader {
    names: Names,
    columns: Vec<Role>,
    /// Names of the last line, which most lines repeat.
    known: Vec<(Vec<u8>, Role)>,
    units: Vec<Option<String>>,
    /// First label; lines with another one contain other values.
    label: Option<String>,
    /// Incomplete reading with one line per channel.
    partial: Option<Vec<Option<f64>>>,
}

impl TextReader {
    pub fn new(names: Names) -> Self {
        let columns = (0..names.len()).map(Role::Channel).collect();
        let units = vec![None; names.len()];
        Self { names, columns, known: Vec::new(), units, label: None, partial: None }
    }

    pub fn names(&self) -> &Names {
        &self.names
    }

    pub fn columns(&self) -> &[Role] {
        &self.columns
    }

    pub fn set_columns(&mut self, columns: Vec<Role>) {
        self.columns = columns;
    }

    /// Discards an incomplete reading.
    pub fn open(&mut self) {
        self.partial = None;
    }

    /// Reads a line without its end.
    pub fn read(&mut self, line: &[u8]) -> Result<Line, BadFrame> {
        self.read_form(line).or_else(|cause| self.read_printed(line, cause))
    }

    fn read_form(&mut self, line: &[u8]) -> Result<Line, BadFrame> {
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

    /// Reads a line by the rules of [`printed`]; `cause` is the error of other forms.
    #[cold]
    fn read_printed(&mut self, line: &[u8], cause: BadFrame) -> Result<Line, BadFrame> {
        let line = printed::without_colours(line);
        let Ok(line) = std::str::from_utf8(&line) else { return Err(cause) };
        if line.bytes().any(|byte| byte.is_ascii_control() && byte != b'\t') {
            return Err(cause);
        }
        let line = line.trim_start_matches('\u{FEFF}').trim();
        let joined = printed::with_joined_time(line);
        if let Some(Ok(read)) = joined.map(|line| self.read_form(line.as_bytes())) {
            return Ok(read);
        }
        let mut message = line;
        while let Some(inner) = printed::message(message) {
            message = inner;
            if let Ok(read) = self.read_form(message.as_bytes()) {
                return Ok(read);
            }
        }
        // The typographic minus sign is not a hyphen.
        let message = message.replace('\u{2212}', "-");
        let marks = Marks::found_in(message.as_bytes());
        let decimal_comma = Separator::found_in(message.as_bytes(), marks) != Separator::Comma;
        let is_name = |name: &str| self.names.role(name) != Role::Ignored;
        let items = printed::items(&message, decimal_comma, is_name);
        let read = items.map_or(Err(cause), |items| self.read_items(&items, cause));
        let read = read.map_err(|other| if other == BadFrame::OtherUnit { other } else { cause });
        match line.strip_prefix('>') {
            Some(line) if read.is_err() => self.add_to_partial(line, cause),
            _ => read,
        }
    }

    /// All items have names, or none, or one label.
    fn read_items(&mut self, items: &[Item], cause: BadFrame) -> Result<Line, BadFrame> {
        let is_named = items.iter().all(|item| !item.name.is_empty());
        let label = items[0].name;
        let is_labelled = items[1..].iter().all(|item| item.name.is_empty())
            && items.len() == self.columns.len()
            && (label.is_empty() || is_general_label(label))
            && self.label.as_ref().is_none_or(|first| first == label)
            && self.names.role(label) == Role::Ignored;
        let roles: Vec<Role> = if is_labelled {
            self.columns.clone()
        } else if is_named {
            items.iter().map(|item| self.names.role(item.name)).collect()
        } else {
            return Err(cause);
        };
        // Adjacent values with and without a unit may be one value with a decimal comma.
        let units = items.iter().filter(|item| !item.unit.is_empty()).count();
        if is_labelled && units != 0 && units != items.len() {
            return Err(cause);
        }
        let mut frame = Filling::new(&self.names);
        let mut values = Vec::with_capacity(items.len());
        for (item, role) in items.iter().zip(&roles) {
            if *role != Role::Ignored {
                values.push((*role, item));
            }
        }
        for (role, item) in &values {
            let value = printed::value(item.value).ok_or(BadFrame::NotANumber)?;
            let factor =
                if item.unit.is_empty() { 1.0 } else { factor(&self.names, &self.units, *role, item.unit)? };
            frame.set(*role, value * factor)?;
        }
        let frame = frame.finish()?;
        if is_labelled && self.label.is_none() {
            self.label = Some(label.to_owned());
        }
        for (role, item) in values {
            if let Role::Channel(i) = role
                && !item.unit.is_empty()
            {
                self.units[i].get_or_insert_with(|| item.unit.to_owned());
            }
        }
        Ok(if is_named || !label.is_empty() { Line::Whole(frame) } else { Line::Unnamed(frame) })
    }

    /// Adds a line of Teleplot, `name:value` or `name:time:value` with optional `§unit` and `|flags`.
    fn add_to_partial(&mut self, line: &str, cause: BadFrame) -> Result<Line, BadFrame> {
        let line = line.split(['§', '|']).next().unwrap_or_default();
        let last = line.rsplit(';').next().unwrap_or_default();
        let (Some((name, _)), Some((_, value))) = (line.split_once(':'), last.rsplit_once(':')) else {
            return Err(cause);
        };
        let Role::Channel(channel) = self.names.role(name.trim()) else { return Ok(Line::Nothing) };
        let value: f64 = value.trim().parse().map_err(|_| BadFrame::NotANumber)?;
        let mut torn = None;
        if channel == 0 {
            torn = self.partial.replace(vec![None; self.names.len()]);
        }
        // The reading has no start.
        let Some(partial) = &mut self.partial else { return Ok(Line::Nothing) };
        partial[channel] = Some(value);
        if partial.iter().any(Option::is_none) {
            return if torn.is_some() { Err(BadFrame::MissingChannel) } else { Ok(Line::Nothing) };
        }
        let mut frame = Filling::new(&self.names);
        for (channel, value) in self.partial.take().into_iter().flatten().enumerate() {
            frame.set(Role::Channel(channel), value.unwrap_or(f64::NAN))?;
        }
        frame.finish().map(Line::Whole)
    }

    fn object(&mut self, line: &[u8]) -> Result<Frame, BadFrame> {
        let Self { names, known, .. } = self;
        json::object(line, names, |i, name| role_of(names, known, i, name))
    }

    fn fields(&mut self, line: &[u8], marks: Marks) -> Result<Line, BadFrame> {
        let separator = Separator::found_in(line, marks);
        let fields = Fields { rest: Some(line), separator };
        if marks.has(Marks::NAMED) && fields.clone().next().is_some_and(begins_with_name) {
            return self.named(fields, separator).map(Line::Whole);
        }
        let mut frame = Filling::new(&self.names);
        let mut roles = self.columns.iter();
        for field in fields.clone() {
            let Some(value) = number(field, separator) else {
                match roles.next() {
                    Some(Role::Time(_)) if frame.set_time_text(field) => continue,
                    _ => return self.header(fields),
                }
            };
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
                role => match number(value, separator) {
                    Some(value) => frame.set(role, value)?,
                    None if matches!(role, Role::Time(_)) && frame.set_time_text(value) => {}
                    None => return Err(BadFrame::NotANumber),
                },
            }
        }
        frame.finish()
    }

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

/// Label such as `Reading` or `HX711 reading`.
fn is_general_label(label: &str) -> bool {
    const LABELS: [&str; 13] = [
        "adc",
        "channel",
        "channels",
        "data",
        "measurement",
        "output",
        "raw",
        "reading",
        "readings",
        "sample",
        "sensor",
        "value",
        "values",
    ];
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || " _-".contains(letter);
    let word = label.rsplit([' ', '_', '-']).next().unwrap_or_default();
    label.chars().all(is_part) && LABELS.iter().any(|known| known.eq_ignore_ascii_case(word))
}

fn factor(names: &Names, units: &[Option<String>], role: Role, unit: &str) -> Result<f64, BadFrame> {
    match role {
        Role::Channel(i) if names.channel(i).unit == Unit::NONE => match &units[i] {
            Some(first) if first != unit => Err(BadFrame::OtherUnit),
            _ => Ok(1.0),
        },
        Role::Channel(i) => {
            let wanted = names.channel(i).unit;
            let given = Unit::from_symbol(unit).filter(|given| given.dimension() == wanted.dimension());
            given.map(|given| given.factor() / wanted.factor()).ok_or(BadFrame::OtherUnit)
        }
        Role::Time(unit_s) => {
            let given_s = match unit {
                "s" | "sec" => 1.0,
                "ms" => 1e-3,
                "us" | "µs" | "μs" => 1e-6,
                _ => return Err(BadFrame::OtherUnit),
            };
            Ok(given_s / unit_s)
        }
        Role::Sequence | Role::Ignored => Ok(1.0),
    }
}

fn begins_with_name(field: &[u8]) -> bool {
    let is_time = || std::str::from_utf8(field).is_ok_and(printed::is_time);
    named(field).is_some() && !(field[0].is_ascii_digit() && is_time())
}

fn named(field: &[u8]) -> Option<(&[u8], &[u8])> {
    let at = field.iter().position(|byte| matches!(byte, b':' | b'='))?;
    Some((field[..at].trim_ascii_end(), field[at + 1..].trim_ascii_start()))
}

const LONGEST_NUMBER: usize = 64;

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

#[derive(Clone, Copy)]
struct Marks(u8);

impl Marks {
    const COMMA: u8 = 1;
    const SEMICOLON: u8 = 1 << 1;
    const TAB: u8 = 1 << 2;
    const BLANK: u8 = 1 << 3;
    const NAMED: u8 = 1 << 4;
    const CONTROL: u8 = 1 << 5;

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

pub fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| matches!(byte, b'\t' | b'\r' | b'\n' | 0x1B) || !byte.is_ascii_control())
}

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

/// Commas between digits; blanks are then the separators.
fn commas_are_decimal(line: &[u8]) -> bool {
    let digit = |i: usize| line.get(i).is_some_and(u8::is_ascii_digit);
    let decimal = |(i, byte): (usize, &u8)| *byte != b',' || (i > 0 && digit(i - 1) && digit(i + 1));
    line.iter().enumerate().all(decimal)
}

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
        // For `trim_ascii_start` a tab is a blank; here it begins an empty field.
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
            r#"{"a":"1.5","b":" -2 "}"#,
            r#"{"time":"2026-03-02T10:11:12","a":1.5,"b":-2}"#,
            "a: 1.5 b: -2",
            "a: 1.5\tb: -2\t",
            "a: 1.5 mV, b: -2 mV",
            "a 1.5 b -2",
            "1.5 mV, -2 mV",
            "1.5mV;-2mV",
            "1,5 mV; -2,0 mV",
            "a=1.5 | b=-2 |",
            "1.5 | -2",
            "Reading: 1.5, -2",
            "Reading: 1.5 mV, -2 mV",
            "10:11:12.345 -> 1.5,-2",
            "10:11:12 -> a: 1.5 b: -2",
            "[INFO] 1.5,-2",
            "I (1234) main: a: 1.5, b: -2",
            "\u{1B}[0;32mI (1234) main: 1.5,-2\u{1B}[0m",
            r#"[INFO] {"a":1.5,"b":-2}"#,
            "(1.5, -2)",
            "[1.5 -2]",
            "1.5 \u{2212}2",
        ];
        for line in lines {
            assert_eq!(reading(line), Ok(vec![1.5, -2.0]), "{line}");
        }
    }

    #[test]
    fn every_bad_line_has_its_cause() {
        use BadFrame::{Channels, Encoding, Malformed, MissingChannel, NotANumber};
        let lines: [(&[u8], BadFrame); 31] = [
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
            (br#"{"a":1,"b":"x"}"#, NotANumber),
            (b"1 nan", NotANumber),
            (b"1.5 mV, ovf", NotANumber),
            (b"[ERROR] 1,2", Malformed),
            (b"Offsets: 1, 2", NotANumber),
            (b"HX711 v1.2, 80 Hz", NotANumber),
            (b"1,2 mV", NotANumber),
            (b"0xFFFFFE,1", NotANumber),
            (b"one reading: 1 | average: 2", NotANumber),
            (b"2026-03-02,5", NotANumber),
        ];
        for (line, cause) in lines {
            let read = reader().read(line);
            assert!(matches!(read, Err(is) if is == cause), "{}: {read:?}", String::from_utf8_lossy(line));
        }
    }

    fn one_channel() -> TextReader {
        TextReader::new(Names::new(&channels(&["a"])))
    }

    #[test]
    fn single_values_have_units_and_labels() {
        for line in ["446.45 mV", "Reading: 446.45", "HX711 reading: 446.45 mV", "a:446.45", "[12] 446.45"] {
            let read = one_channel().read(line.as_bytes());
            assert!(
                matches!(&read, Ok(Line::Whole(frame) | Line::Unnamed(frame)) if frame.reading == [446.45]),
                "{line}: {read:?}"
            );
        }
        for line in ["Temperature: 21.5", "b: 1", "two 2", "446,45 mV and more"] {
            assert!(one_channel().read(line.as_bytes()).is_err(), "{line}");
        }
    }

    #[test]
    fn another_unit_or_label_than_before_is_refused() {
        let mut reader = one_channel();
        assert!(reader.read(b"446.45 mV").is_ok());
        assert!(matches!(reader.read(b"1.02 V"), Err(BadFrame::OtherUnit)));
        assert!(reader.read(b"447.00 mV").is_ok());
        let mut reader = one_channel();
        assert!(reader.read(b"Raw: 8412").is_ok());
        assert!(reader.read(b"Value: 3.5").is_err());
    }

    #[test]
    fn units_are_those_of_the_channel() {
        let mut channels = channels(&["a"]);
        channels[0].unit = Unit::from_symbol("um").unwrap();
        let mut reader = TextReader::new(Names::new(&channels));
        for (line, value_m) in [("5", 5e-6), ("5 um", 5e-6), ("a: 0.005 mm", 5e-6)] {
            let Ok(Line::Unnamed(frame) | Line::Whole(frame)) = reader.read(line.as_bytes()) else {
                panic!("{line}")
            };
            assert!((frame.reading[0] / value_m - 1.0).abs() < 1e-12, "{line}: {:?}", frame.reading);
        }
        assert!(matches!(reader.read(b"5 N"), Err(BadFrame::OtherUnit)));
    }

    #[test]
    fn lines_of_teleplot_make_a_reading_from_the_first_channel_on() {
        let mut reader = reader();
        let mut read = |line: &str| match reader.read(line.as_bytes()) {
            Ok(Line::Whole(frame)) => Ok(Some(frame.reading)),
            Ok(Line::Nothing) => Ok(None),
            Ok(other) => panic!("{line}: {other:?}"),
            Err(cause) => Err(cause),
        };
        // The end of a reading without a start.
        assert_eq!(read(">b:9"), Ok(None));
        assert_eq!(read(">a:1.5"), Ok(None));
        assert_eq!(read(">temperature:21"), Ok(None));
        assert_eq!(read(">b:-2"), Ok(Some(vec![1.5, -2.0])));
        assert_eq!(read(">a:1627551892437:2§mV|g"), Ok(None));
        assert_eq!(read(">b:1627551892437:1;1627551892438:3"), Ok(Some(vec![2.0, 3.0])));
        assert_eq!(read(">a:1"), Ok(None));
        assert_eq!(read(">a:2"), Err(BadFrame::MissingChannel));
        assert_eq!(read(">b:2"), Ok(Some(vec![2.0, 2.0])));
        assert_eq!(read(">a:1,b:2"), Ok(Some(vec![1.0, 2.0])));
    }

    #[test]
    fn dates_with_a_fraction_of_a_second_are_times() {
        let line = br#"{"time":"1970-01-01T00:00:02.500Z","a":1,"b":2}"#;
        let Ok(Line::Whole(frame)) = reader().read(line) else { panic!() };
        assert_eq!(frame.device_time, Some(std::time::Duration::from_millis(2500)));
        let mut reader = reader();
        assert!(matches!(reader.read(b"time,a,b"), Ok(Line::Header)));
        let Ok(Line::Unnamed(frame)) = reader.read(b"1970-01-01 00:00:02.500,1,2") else { panic!() };
        assert_eq!(frame.device_time, Some(std::time::Duration::from_millis(2500)));
        let Ok(Line::Unnamed(frame)) = reader.read(b"1970-01-01 00:00:02,1,2") else { panic!() };
        assert_eq!((frame.device_time, frame.reading), (None, vec![1.0, 2.0]));
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
    fn blank_lines_and_comments_are_ignored() {
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
