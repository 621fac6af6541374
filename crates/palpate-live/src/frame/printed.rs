//! Lines printed for people: items `[name :] value [unit]` after log prefixes. Other text is ambiguous, and
//! rejected.

use std::borrow::Cow;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item<'a> {
    /// May contain blanks.
    pub name: &'a str,
    pub value: &'a str,
    pub unit: &'a str,
}

/// Removes terminal escape sequences (`ESC [ … letter`).
pub fn without_colours(line: &[u8]) -> Cow<'_, [u8]> {
    const ESCAPE: u8 = 0x1B;
    if !line.contains(&ESCAPE) {
        return Cow::Borrowed(line);
    }
    let mut plain = Vec::with_capacity(line.len());
    let mut rest = line;
    while let Some(at) = rest.windows(2).position(|pair| pair == [ESCAPE, b'[']) {
        plain.extend_from_slice(&rest[..at]);
        let end = rest[at + 2..].iter().position(|byte| (0x40..0x7F).contains(byte));
        rest = end.map_or(&[][..], |end| &rest[at + 2 + end + 1..]);
    }
    plain.extend_from_slice(rest);
    Cow::Owned(plain)
}

/// Removes the first log prefix, or brackets around the line.
///
/// Prefixes: time (`10:11:12.345 -> `), groups (`[INFO]`), ESP-IDF (`I (1234) tag: `), level (`INFO: `),
/// function (`loop(): `), `>`. Warnings and errors are not readings.
pub fn message(line: &str) -> Option<&str> {
    strip_time(line)
        .or_else(|| strip_group(line))
        .or_else(|| strip_esp_idf(line))
        .or_else(|| strip_level(line))
        .or_else(|| strip_function(line))
        .or_else(|| line.strip_prefix('>'))
        .or_else(|| strip_brackets(line))
        .map(str::trim)
        .filter(|message| !message.is_empty())
}

/// Joins date and time of day with a `T`.
pub fn with_joined_time(line: &str) -> Option<String> {
    let is_apart = time_length(line)? > 10 && line.as_bytes()[10] == b' ';
    is_apart.then(|| format!("{}T{}", &line[..10], &line[11..]))
}

const LEVELS: [&str; 6] = ["trace", "debug", "verbose", "info", "notice", "log"];

fn is_level(word: &str) -> bool {
    LEVELS.iter().any(|level| level.eq_ignore_ascii_case(word))
}

fn is_alarm(text: &str) -> bool {
    let words = text.split(|letter: char| !letter.is_ascii_alphabetic());
    let alarms = ["e", "w", "f", "warn", "warning", "err", "error", "fatal", "critical", "panic"];
    words.into_iter().any(|word| alarms.iter().any(|alarm| alarm.eq_ignore_ascii_case(word)))
}

fn strip_time(line: &str) -> Option<&str> {
    let length = time_length(line)?;
    let rest = line[length..].trim_start();
    let rest = rest.strip_prefix("->").unwrap_or(rest);
    Some(rest.strip_prefix([',', ';', '|', ':']).unwrap_or(rest))
}

fn time_length(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    // `d` stands for a digit.
    let matches = |at: usize, pattern: &str| {
        let is = |(byte, kind): (&u8, u8)| if kind == b'd' { byte.is_ascii_digit() } else { *byte == kind };
        bytes.get(at..at + pattern.len()).is_some_and(|part| part.iter().zip(pattern.bytes()).all(is))
    };
    let digits = |at: usize| bytes[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut at = if matches(0, "dddd-dd-dd") || matches(0, "dddd/dd/dd") { 10 } else { 0 };
    let time_at = at + usize::from(at > 0 && matches!(bytes.get(at), Some(b'T' | b' ')));
    if matches(time_at, "dd:dd:dd") {
        at = time_at + 8;
        if matches!(bytes.get(at), Some(b'.' | b',')) && digits(at + 1) > 0 {
            at += 1 + digits(at + 1);
        }
        for zone in ["Z", "+dd:dd", "-dd:dd", "+dddd", "-dddd"] {
            if matches(at, zone) {
                at += zone.len();
                break;
            }
        }
    }
    let ends = bytes.get(at).is_none_or(|byte| !byte.is_ascii_alphanumeric() && *byte != b'.');
    (at > 0 && ends).then_some(at)
}

fn strip_group(line: &str) -> Option<&str> {
    let (group, rest) = line.strip_prefix('[')?.split_once(']')?;
    // Brackets around the whole line are not a prefix but enclose a list of values.
    (!rest.trim().is_empty() && !is_alarm(group)).then_some(rest.strip_prefix(':').unwrap_or(rest))
}

fn strip_esp_idf(line: &str) -> Option<&str> {
    let rest = line.strip_prefix(['I', 'D', 'V'])?.strip_prefix(" (")?;
    let (clock, rest) = rest.split_once(") ")?;
    let is_clock = clock.bytes().all(|byte| byte.is_ascii_digit() || b":. ".contains(&byte));
    let (_, message) = rest.split_once(": ")?;
    is_clock.then_some(message)
}

fn strip_level(line: &str) -> Option<&str> {
    let end = line.find(|letter: char| !letter.is_ascii_alphabetic())?;
    let (word, rest) = line.split_at(end);
    is_level(word).then(|| rest.trim_start().strip_prefix(':').unwrap_or(rest))
}

fn strip_function(line: &str) -> Option<&str> {
    let (name, rest) = line.split_once("()")?;
    let is_name = |letter: char| letter.is_ascii_alphanumeric() || "_:".contains(letter);
    name.chars().all(is_name).then(|| rest.strip_prefix(':'))?
}

fn strip_brackets(line: &str) -> Option<&str> {
    ["[]", "()", "<>", "{}"].iter().find_map(|pair| {
        let inner = line.strip_prefix(&pair[..1])?.strip_suffix(&pair[1..])?;
        (!inner.contains(['[', '(', '<', '{'])).then_some(inner)
    })
}

const NO_NUMBERS: [&str; 16] = [
    "nan", "inf", "infinity", "ovf", "ovl", "ovr", "over", "overflow", "overload", "err", "error", "fault",
    "null", "none", "na", "ol",
];

/// Symbol such as `mV`, `°C`, `%`, `m/s2`.
fn is_unit(word: &str) -> bool {
    let is_sign = |letter: char| letter.is_alphabetic() || "%°²³".contains(letter);
    let is_part = |letter: char| is_sign(letter) || letter.is_ascii_digit() || "/^*·".contains(letter);
    word.chars().next().is_some_and(is_sign)
        && word.chars().count() <= 8
        && word.chars().all(is_part)
        && !NO_NUMBERS.iter().any(|known| known.eq_ignore_ascii_case(word))
}

const SEPARATORS: [char; 4] = [',', ';', '|', '\t'];

pub fn items<'a>(
    line: &'a str,
    decimal_comma: bool,
    is_name: impl Fn(&str) -> bool,
) -> Option<Vec<Item<'a>>> {
    let mut items: Vec<Item> = Vec::new();
    let mut rest = line;
    while let Some((start, end)) = next_number(rest, decimal_comma, items.is_empty()) {
        let (unit, name) = unit_and_name(&rest[..start], items.is_empty(), &is_name)?;
        if let Some(last) = items.last_mut() {
            last.unit = unit;
        }
        items.push(Item { name, value: &rest[start..end], unit: "" });
        rest = &rest[end..];
    }
    // One separator may follow the last value.
    let end = rest.trim_end();
    let unit = end.strip_suffix(SEPARATORS).unwrap_or(end).trim();
    if has_empty_field(rest) || !(unit.is_empty() || is_unit(unit)) {
        return None;
    }
    items.last_mut()?.unit = unit;
    Some(items)
}

fn unit_and_name<'a>(
    between: &'a str,
    is_first: bool,
    is_name: &impl Fn(&str) -> bool,
) -> Option<(&'a str, &'a str)> {
    if has_empty_field(between) {
        return None;
    }
    let text = between.trim();
    let named = text.strip_suffix([':', '=']).map(str::trim_end);
    let text = named.unwrap_or(text);
    if is_first {
        let is_plain = text.is_empty() || named.is_some() || is_name(text);
        return (is_plain && !text.contains(SEPARATORS)).then_some(("", text));
    }
    let (unit, name) = match text.split_once(SEPARATORS) {
        Some((unit, name)) => (unit.trim(), name.trim()),
        None if is_name(text) => ("", text),
        None => match text.split_once(char::is_whitespace) {
            Some((unit, name)) if is_unit(unit) => (unit, name.trim()),
            None if named.is_none() => (text, ""),
            _ => ("", text),
        },
    };
    let name_is_plain = name.is_empty() || named.is_some() || is_name(name);
    // A name must not include a value that is not a number, as in `1,x,S2:2`.
    let name_is_one = !name.contains(SEPARATORS);
    ((unit.is_empty() || is_unit(unit)) && name_is_plain && name_is_one).then_some((unit, name))
}

fn has_empty_field(text: &str) -> bool {
    let mut last = None;
    text.chars().filter(|letter| *letter != ' ').any(|letter| {
        let is_second = SEPARATORS.contains(&letter) && last == Some(letter);
        last = Some(letter);
        is_second
    })
}

/// Range of the next number outside words and names; the first needs `is_line`.
fn next_number(text: &str, decimal_comma: bool, is_line: bool) -> Option<(usize, usize)> {
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        let before = at.checked_sub(1).map(|before| bytes[before]);
        let begins = before.map_or(is_line, |byte| byte.is_ascii_whitespace() || b",;|:=".contains(&byte));
        if begins && let Some(length) = number_length(&bytes[at..], decimal_comma) {
            let after = text[at + length..].trim_start();
            if !after.starts_with([':', '=']) {
                return Some((at, at + length));
            }
            at += length;
        } else {
            at += 1;
        }
    }
    None
}

fn number_length(bytes: &[u8], decimal_comma: bool) -> Option<usize> {
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let count = |from: usize, is: fn(&u8) -> bool| {
        bytes.get(from..).map_or(0, |rest| rest.iter().take_while(|byte| is(byte)).count())
    };
    if matches!(bytes.get(sign..sign + 2), Some(b"0x" | b"0X")) {
        let digits = count(sign + 2, u8::is_ascii_hexdigit);
        return (digits > 0).then_some(sign + 2 + digits);
    }
    let whole = count(sign, u8::is_ascii_digit);
    let mut end = sign + whole;
    let is_point = matches!(bytes.get(end), Some(b'.')) || (decimal_comma && bytes.get(end) == Some(&b','));
    let fraction = if is_point { count(end + 1, u8::is_ascii_digit) } else { 0 };
    if is_point && (fraction > 0 || bytes[end] == b'.') {
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let digits = count(end + 1 + sign, u8::is_ascii_digit);
        if digits > 0 {
            end += 1 + sign + digits;
        }
    }
    Some(end)
}

/// Parses a number; `None` for a hexadecimal one of 4, 6 or 8 digits that may be negative.
pub fn value(text: &str) -> Option<f64> {
    let (sign, digits) = text.strip_prefix('-').map_or((1.0, text), |digits| (-1.0, digits));
    let hexadecimal = digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X"));
    let Some(digits) = hexadecimal else { return text.replace(',', ".").parse().ok() };
    let value = u64::from_str_radix(digits, 16).ok()?;
    let is_ambiguous = matches!(digits.len(), 4 | 6 | 8) && value >> (4 * digits.len() - 1) == 1;
    (!is_ambiguous && value < 1 << 53).then_some(sign * value as f64)
}

pub fn is_time(text: &str) -> bool {
    let text = text.trim();
    time_length(text) == Some(text.len())
}

/// Seconds of the day, or since 1970 with a date, without the zone. `None` without milliseconds: such a clock
/// does not resolve readings.
pub fn time_s(text: &str) -> Option<f64> {
    let text = text.trim();
    if !is_time(text) {
        return None;
    }
    let number = |part: &str| part.parse::<i64>().ok();
    let (date, time) = match text.split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time),
        None => (None, text),
    };
    let time = time.trim_end_matches('Z');
    let end = time.find(['+', '-']).unwrap_or(time.len());
    let (clock, fraction) = time[..end].split_once(['.', ','])?;
    if fraction.len() < 3 {
        return None;
    }
    let [hours, minutes, seconds] = clock.splitn(3, ':').map(number).collect::<Option<Vec<_>>>()?[..] else {
        return None;
    };
    let days = match date {
        None => 0,
        Some(date) => {
            let parts: Vec<i64> = date.split(['-', '/']).map(number).collect::<Option<_>>()?;
            let [year, month, day] = parts[..] else { return None };
            days_since_1970(year, month, day)
        }
    };
    let whole = (days * 86_400 + hours * 3600 + minutes * 60 + seconds) as f64;
    Some(whole + format!("0.{fraction}").parse::<f64>().ok()?)
}

/// Civil date in years that begin in March.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year / 4 - year / 100 + year / 400;
    365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all_stripped(line: &str) -> &str {
        message(line).map_or(line, all_stripped)
    }

    #[test]
    fn prefixes_of_logs_are_stripped() {
        for line in [
            "10:11:12 -> 1,2",
            "10:11:12.345 -> 1,2",
            "2026-03-02T10:11:12Z 1,2",
            "2026-03-02 10:11:12,345 INFO 1,2",
            "2026-03-02T10:11:12.5+01:00,1,2",
            "[INFO] 1,2",
            "[12.345] 1,2",
            "[  123][I][main.cpp:12] loop(): 1,2",
            "I (1234) main: 1,2",
            "I (10:11:12.345) main: 1,2",
            "INFO: 1,2",
            "> 1,2",
            "(1,2)",
            "[INFO] <1,2>",
        ] {
            assert_eq!(all_stripped(line), "1,2", "{line}");
        }
        for line in ["[ERROR] 1,2", "E (1234) main: 1,2", "ERROR: 1,2", "10:11,2", "12 34"] {
            assert_eq!(all_stripped(line), line);
        }
        assert_eq!(all_stripped("[1][W][x.cpp] 1,2"), "[W][x.cpp] 1,2");
    }

    #[test]
    fn colours_are_stripped() {
        assert_eq!(&*without_colours(b"\x1B[0;32mI (12) a: 1,2\x1B[0m"), b"I (12) a: 1,2");
        assert_eq!(&*without_colours(b"1\x1B[31"), b"1");
    }

    fn parts(line: &str) -> Option<Vec<(&str, &str, &str)>> {
        let items = items(line, false, |name| name == "S1" || name == "S2")?;
        Some(items.iter().map(|item| (item.name, item.value, item.unit)).collect())
    }

    #[test]
    fn items_have_names_and_units() {
        let lines = [
            ("g1: 10491 g2: -5", vec![("g1", "10491", ""), ("g2", "-5", "")]),
            ("446.45 mV", vec![("", "446.45", "mV")]),
            ("446.45mV, 3e2 mV;", vec![("", "446.45", "mV"), ("", "3e2", "mV")]),
            ("S1 153 S2 220", vec![("S1", "153", ""), ("S2", "220", "")]),
            ("S1: 153 mV S2: 220 mV", vec![("S1", "153", "mV"), ("S2", "220", "mV")]),
            ("Reading: 153, 220", vec![("Reading", "153", ""), ("", "220", "")]),
            ("S1=1 | S2=2 |", vec![("S1", "1", ""), ("S2", "2", "")]),
            ("Sensor 1: 153, Sensor 2: 5 °C", vec![("Sensor 1", "153", ""), ("Sensor 2", "5", "°C")]),
            ("0x1F 0x20", vec![("", "0x1F", ""), ("", "0x20", "")]),
        ];
        for (line, expected) in lines {
            assert_eq!(parts(line), Some(expected), "{line}");
        }
        for line in
            ["1,,2", "hello 5 world is 6", "1 nan", "x", "1 2 3-4", "153 220 and more of it", "ovf, 2", "a b"]
        {
            assert_eq!(parts(line), None, "{line}");
        }
    }

    #[test]
    fn hexadecimal_numbers_that_may_be_negative_are_none() {
        assert_eq!(value("0x1F"), Some(31.0));
        assert_eq!(value("-0x1F"), Some(-31.0));
        assert_eq!(value("0x7FFFFF"), Some(8_388_607.0));
        assert_eq!(value("0xFFFFFE"), None);
        assert_eq!(value("0x8000"), None);
        assert_eq!(value("1,5"), Some(1.5));
    }

    #[test]
    fn times_with_a_fraction_are_seconds() {
        assert_eq!(time_s("1970-01-01T00:00:01.250Z"), Some(1.25));
        assert_eq!(time_s("2000-03-01 00:00:00.000"), Some(951_868_800.0));
        assert_eq!(time_s("10:11:12.500"), Some(36_672.5));
        for text in
            ["2026-03-02T10:11:12", "10:11:12", "12.500", "x", "2026-03-02T10:11:12.500x", "2026-03-02", ""]
        {
            assert_eq!(time_s(text), None, "{text}");
        }
    }
}
