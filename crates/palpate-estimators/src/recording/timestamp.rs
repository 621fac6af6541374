//! Row times: numbers, or timestamps relative to the first row.

use super::csv_error::CsvProblem;

/// Time converter of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Clock {
    start: Option<Start>,
}

/// The first row determines the notation.
#[derive(Clone, Copy, Debug)]
enum Start {
    Number,
    Timestamp {
        first: Timestamp,
        /// Previous row.
        previous: Timestamp,
    },
}

const DAY_NS: i64 = 86_400_000_000_000;

impl Clock {
    /// Time in seconds, for timestamps since the first row; an error for another notation or midnight.
    pub fn read(
        &mut self,
        text: &str,
        number: impl FnOnce() -> Result<f64, CsvProblem>,
    ) -> Result<f64, CsvProblem> {
        // A text with a colon is not a number.
        if !text.contains(':') {
            let value = number().map_err(|problem| match problem {
                CsvProblem::NotANumber { text } => CsvProblem::NotATime { text },
                other => other,
            })?;
            return match self.start {
                Some(Start::Timestamp { .. }) => Err(CsvProblem::OtherTime { text: text.to_owned() }),
                _ => {
                    self.start = Some(Start::Number);
                    Ok(value)
                }
            };
        }
        let now = Timestamp::parse(text)?.ok_or_else(|| CsvProblem::NotATime { text: text.to_owned() })?;
        let (first, previous) = match self.start {
            None => (now, now),
            Some(Start::Timestamp { first, previous }) if first.kind == now.kind => (first, previous),
            Some(_) => return Err(CsvProblem::OtherTime { text: text.to_owned() }),
        };
        if now.kind == Kind::TimeOfDay && now.ns - previous.ns < -DAY_NS / 2 {
            return Err(CsvProblem::Midnight { text: text.to_owned() });
        }
        self.start = Some(Start::Timestamp { first, previous: now });
        Ok(now.seconds_since(first))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Timestamp {
    kind: Kind,
    /// Days since 1 March of year 0.
    day: i64,
    /// Nanoseconds since midnight UTC.
    ns: i64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    TimeOfDay,
    Local,
    Utc,
}

impl Timestamp {
    /// `14:03:25,120`, `2026-04-03T14:03:25.12+02:00`, `2026-04-03 14:03` or `03.04.2026 14:03:25,120`; an
    /// error for ambiguous slashes.
    fn parse(text: &str) -> Result<Option<Self>, CsvProblem> {
        let (date, time) = match text.find(['T', ' ', ',']).filter(|at| !text[..*at].contains(':')) {
            Some(at) => (&text[..at], text[at + 1..].trim_start()),
            None => ("", text),
        };
        let slashes = date.split('/').filter(|part| digits(part, 1..=4).is_some()).count();
        if slashes == 3 && digits(date.split('/').next().unwrap_or_default(), 4..=4).is_none() {
            return Err(CsvProblem::SlashedDate { text: text.to_owned() });
        }
        Ok(Self::from_date_and_time(date, time))
    }

    fn from_date_and_time(date: &str, time: &str) -> Option<Self> {
        let (time, offset_ns) = match time.find(['Z', '+', '-']) {
            Some(at) => (&time[..at], Some(offset_ns(&time[at..])?)),
            None => (time, None),
        };
        let kind = match (date, offset_ns) {
            ("", None) => Kind::TimeOfDay,
            ("", Some(_)) => return None,
            (_, None) => Kind::Local,
            (_, Some(_)) => Kind::Utc,
        };
        let day = if date.is_empty() { 0 } else { day(date)? };
        Some(Self { kind, day, ns: time_ns(time.trim_end())? - offset_ns.unwrap_or(0) })
    }

    fn seconds_since(self, first: Self) -> f64 {
        let ns = i128::from(self.day - first.day) * i128::from(DAY_NS) + i128::from(self.ns - first.ns);
        // A single division rounds once, so that 0.1 s becomes exactly the number 0.1.
        ns as f64 / 1e9
    }
}

fn digits(text: &str, count: std::ops::RangeInclusive<usize>) -> Option<i64> {
    let all = count.contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    if all { text.parse().ok() } else { None }
}

/// `2026-04-03`, `2026/04/03` or `03.04.2026`, Gregorian.
fn day(date: &str) -> Option<i64> {
    let parts: Vec<&str> = date.split(['-', '.', '/']).collect();
    let separators: Vec<u8> = date.bytes().filter(|byte| b"-./".contains(byte)).collect();
    let (year, month, day) = match (parts.as_slice(), separators.as_slice()) {
        ([year, month, day], [b'-', b'-'] | [b'/', b'/']) => (year, month, day),
        ([day, month, year], [b'.', b'.']) => (year, month, day),
        _ => return None,
    };
    let (year, month, day) = (digits(year, 4..=4)?, digits(month, 1..=2)?, digits(day, 1..=2)?);
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let last = match month {
        2 if leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => return None,
    };
    if !(1..=last).contains(&day) {
        return None;
    }
    // Years begin in March: the leap day is then their last day, and month lengths repeat every five months:
    // 31 30 31 30 31.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let before_year = 365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some(before_year + (153 * month + 2) / 5 + day - 1)
}

/// `14:03`, `14:03:25` or `14:03:25,120`.
fn time_ns(time: &str) -> Option<i64> {
    let (whole, fraction) = match time.find(['.', ',']) {
        Some(at) => (&time[..at], Some(&time[at + 1..])),
        None => (time, None),
    };
    let mut parts = whole.split(':');
    let (hour, minute) = (digits(parts.next()?, 1..=2)?, digits(parts.next()?, 2..=2)?);
    let second = parts.next();
    // A fraction of a minute is not a usual notation. Second 60 is a leap second.
    let second = match second {
        Some(second) => digits(second, 2..=2)?,
        None if fraction.is_none() => 0,
        None => return None,
    };
    if parts.next().is_some() || hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    let fraction_ns = match fraction {
        None => 0,
        Some(fraction) if digits(fraction, 1..=18).is_some() => {
            let nine: String = fraction.chars().chain(std::iter::repeat('0')).take(9).collect();
            digits(&nine, 9..=9)?
        }
        Some(_) => return None,
    };
    Some(((hour * 60 + minute) * 60 + second) * 1_000_000_000 + fraction_ns)
}

/// `Z`, `+02:00`, `+0200` or `-05`; positive ahead of UTC.
fn offset_ns(offset: &str) -> Option<i64> {
    if offset == "Z" {
        return Some(0);
    }
    let (sign, rest) = match offset.as_bytes().first()? {
        b'+' => (1, &offset[1..]),
        b'-' => (-1, &offset[1..]),
        _ => return None,
    };
    let (hours, minutes) = match rest.split_once(':') {
        Some(parts) => parts,
        None => rest.split_at_checked(2)?,
    };
    let minutes = if minutes.is_empty() { 0 } else { digits(minutes, 2..=2)? };
    Some(sign * (digits(hours, 2..=2)? * 60 + minutes) * 60_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::dialect::Dialect;
    use palpate_mechanics::units::Unit;
    use proptest::prelude::*;

    fn times(texts: &[&str]) -> Vec<Result<f64, String>> {
        let (mut clock, mut dialect) = (Clock::default(), Dialect::default());
        let mut read = |text: &&str| clock.read(text, || dialect.number(text, Unit::NONE));
        texts.iter().map(|text| read(text).map_err(|error| error.to_string())).collect()
    }

    fn good(texts: &[&str]) -> Vec<f64> {
        times(texts).into_iter().map(Result::unwrap).collect()
    }

    #[test]
    fn timestamps_count_from_the_first() {
        assert_eq!(
            good(&["03.04.2026 14:03:25,120", "03.04.2026 14:03:25,220", "3.4.2026 14:04"]),
            [0.0, 0.1, 34.88]
        );
        assert_eq!(
            good(&["2026-02-28T23:59:59.5Z", "2026-03-01T01:00:00+01:00", "2026-02-28 18:59:00-0500"]),
            [0.0, 0.5, -59.5]
        );
        assert_eq!(good(&["2024-02-28 00:00", "2024-03-01 00:00", "2100/03/01 00:00"])[1], 2.0 * 86_400.0);
        assert_eq!(good(&["9:00:00", "09:00:01.000000001999"]), [0.0, 1.000_000_001]);
        assert_eq!(good(&["5", "3.25"]), [5.0, 3.25]);
    }

    #[test]
    fn days_follow_one_another() {
        let mut before = day("1999-12-31").unwrap();
        for year in 2000..2105 {
            for month in 1..=12 {
                for number in 1..=31 {
                    let Some(day) = day(&format!("{year}-{month:02}-{number:02}")) else { continue };
                    assert_eq!(day, before + 1, "{year}-{month}-{number}");
                    before = day;
                }
            }
        }
        // 105 years with 26 leap days: 2000 has one, 2100 has none.
        assert_eq!(before, day("1999-12-31").unwrap() + 105 * 365 + 26);
    }

    #[test]
    fn invalid_times_are_refused() {
        let refused = |texts: &[&str]| times(texts).pop().unwrap().unwrap_err();
        let messages = [
            refused(&["now"]),
            refused(&["2026-02-29 10:00"]),
            refused(&["2026-02-28 10:61"]),
            refused(&["04/03/2026 10:00"]),
            refused(&["5", "10:00:00"]),
            refused(&["10:00:00", "5"]),
            refused(&["10:00:00", "2026-02-28 10:00:00"]),
            refused(&["2026-02-28 10:00:00Z", "2026-02-28 10:00:00"]),
            refused(&["23:59:59", "00:00:01"]),
            refused(&["inf"]),
            refused(&[""]),
        ];
        insta::assert_snapshot!(messages.join("\n"));
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "[0-9T:.,/Z +µ-]{0,30}") {
            let _ = times(&[&text, &text]);
        }
    }
}
