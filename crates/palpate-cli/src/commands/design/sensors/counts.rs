//! A range of counts on the command line.

use std::ops::RangeInclusive;

/// Numbers of sensors, both ends included.
pub type Counts = RangeInclusive<usize>;

/// More sensors than a curve is drawn for.
const MOST: usize = 200;

/// "2..16" as a range.
pub fn counts(text: &str) -> Result<Counts, String> {
    let form = || format!("`{text}` is no range; write the least and the most, as in 2..16");
    let (from, to) = text.split_once("..").ok_or_else(form)?;
    let number = |text: &str| text.trim_start_matches('=').trim().parse::<usize>().map_err(|_| form());
    let (from, to) = (number(from)?, number(to)?);
    if from < 1 || to > MOST || from > to {
        return Err(format!("`{text}` must go from at least 1 to at most {MOST}, the lesser first"));
    }
    Ok(from..=to)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_and_others_refused() {
        assert_eq!(counts("2..16"), Ok(2..=16));
        assert_eq!(counts("3..=3"), Ok(3..=3));
        for text in ["", "5", "0..4", "5..2", "2..1000", "a..b", "-1..3"] {
            assert!(counts(text).is_err(), "{text}");
        }
    }
}
