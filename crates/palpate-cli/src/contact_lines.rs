//! Text lines about contacts: their beginnings, changes and ends.

use palpate_estimators::estimator::{Track, TrackedContact};
use palpate_mechanics::units::format_count;

/// Shortest time between two lines about changes of a contact.
const BETWEEN_CHANGES_S: f64 = 1.0;

/// Text lines about the contacts of tracks.
///
/// Each contact has a line at its beginning and end. Between them it has one when its position or
/// force leaves the 95 % interval of the last line, at most once in [`BETWEEN_CHANGES_S`].
#[derive(Default)]
pub struct ContactLines {
    contacts: [Option<Line>; 2],
    begun: u64,
    readings: u64,
}

#[derive(Clone)]
struct Line {
    /// Number of the contact, from 1.
    number: u64,
    begun_s: f64,
    time_s: f64,
    contact: TrackedContact,
}

impl ContactLines {
    pub fn lines(&mut self, track: &Track) -> String {
        self.readings += 1;
        let time_s = track.time_s;
        let mut text = String::new();
        for (slot, last) in self.contacts.iter_mut().enumerate() {
            let words = match (last.as_mut(), track.contacts.get(slot)) {
                (None, None) => continue,
                (Some(line), None) => {
                    let lasted_s = time_s - line.begun_s;
                    let words = format!("contact {} ended after {lasted_s:.2} s", line.number);
                    *last = None;
                    words
                }
                (None, Some(contact)) => {
                    self.begun += 1;
                    let number = self.begun;
                    *last = Some(Line { number, begun_s: time_s, time_s, contact: *contact });
                    format!("contact {number} at {}", describe_contact(contact))
                }
                (Some(line), Some(contact)) => {
                    let is_due = time_s - line.time_s >= BETWEEN_CHANGES_S;
                    if !is_due || !has_changed(&line.contact, contact) {
                        continue;
                    }
                    (line.time_s, line.contact) = (time_s, *contact);
                    format!("contact {} now at {}", line.number, describe_contact(contact))
                }
            };
            text.push_str(&format!("{time_s:.2} s: {words}\n"));
        }
        text
    }

    pub fn summary(&self) -> String {
        let count = |number: u64, noun: &str| {
            format!("{} {noun}{}", format_count(number), if number == 1 { "" } else { "s" })
        };
        format!("{} in {}\n", count(self.begun, "contact"), count(self.readings, "reading"))
    }
}

fn has_changed(before: &TrackedContact, now: &TrackedContact) -> bool {
    let is_outside = |value: f64, (low, high): (f64, f64)| value < low || value > high;
    let has_moved_across =
        before.transverse.zip(now.transverse).is_some_and(|(before, now)| is_outside(now.y_m, before.y_95_m));
    is_outside(now.x_m, before.x_95_m)
        || has_moved_across
        || is_outside(now.force_n, before.force_interval_95_n())
}

/// Formats "33.0 mm (32.7 to 33.4), 2.00 N (1.96 to 2.03)".
fn describe_contact(contact: &TrackedContact) -> String {
    let mm = |(low_m, high_m): (f64, f64)| (low_m * 1e3, high_m * 1e3);
    let x = with_interval(contact.x_m * 1e3, mm(contact.x_95_m), "mm");
    let force = with_interval(contact.force_n, contact.force_interval_95_n(), "N");
    match &contact.transverse {
        None => format!("{x}, {force}"),
        Some(across) => {
            let y = with_interval(across.y_m * 1e3, mm(across.y_95_m), "mm");
            format!("x {x}, y {y}, {force}")
        }
    }
}

/// Formats a value rounded to the first digit of the interval's half width.
fn with_interval(value: f64, (low, high): (f64, f64), unit: &str) -> String {
    let digit = (0.5 * (high - low)).log10().floor();
    let number = |value: f64| format_to_digit(value, digit);
    format!("{} {unit} ({} to {})", number(value), number(low), number(high))
}

const MOST_DECIMALS: f64 = 4.0;
/// Numbers from this on are printed with powers of ten.
const LARGE: f64 = 1e7;

fn format_to_digit(value: f64, digit: f64) -> String {
    if !value.is_finite() || value.abs() >= LARGE {
        return format!("{value:.1e}");
    }
    // An interval without width or with infinite bounds does not determine the number of digits.
    let digit = if digit.is_finite() { digit.max(-MOST_DECIMALS) } else { -MOST_DECIMALS };
    let step = 10.0_f64.powf(digit);
    let rounded = (value / step).round() * step;
    let decimals = (-digit).max(0.0) as usize;
    // Prevents −0.
    format!("{:.decimals$}", rounded + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_estimators::estimator::{Estimate, Status};
    use palpate_mechanics::contact::Position;

    fn track(time_s: f64, contact: Option<(f64, f64)>) -> Track {
        let single = Estimate::of_position(Position::along(0.1), Status::Located);
        let contacts = contact.map(|(x_m, force_n)| TrackedContact {
            x_m,
            speed_m_per_s: 0.0,
            force_n,
            sd: [0.0005, 0.0, 0.1],
            x_95_m: (x_m - 0.001, x_m + 0.001),
            force_95_n: None,
            transverse: None,
        });
        Track { time_s, numbers: [0.0, 1.0, 0.0], contacts: contacts.into_iter().collect(), single }
    }

    #[test]
    fn prints_no_line_while_a_contact_stays() {
        let mut lines = ContactLines::default();
        assert_eq!(lines.lines(&track(0.0, None)), "");
        assert_eq!(
            lines.lines(&track(1.0, Some((0.1, 2.0)))),
            "1.00 s: contact 1 at 100 mm (99 to 101), 2.0 N (1.8 to 2.2)\n"
        );
        for i in 0..500 {
            assert_eq!(lines.lines(&track(1.0 + f64::from(i) * 0.01, Some((0.1005, 2.1)))), "", "{i}");
        }
        assert_eq!(lines.lines(&track(6.0, None)), "6.00 s: contact 1 ended after 5.00 s\n");
        assert_eq!(lines.lines(&track(6.1, None)), "");
        assert_eq!(lines.summary(), "1 contact in 504 readings\n");
    }

    #[test]
    fn prints_a_change_beyond_the_interval_at_most_once_a_second() {
        let mut lines = ContactLines::default();
        let mut printed = Vec::new();
        for i in 0..=1000 {
            let time_s = f64::from(i) * 0.01;
            let text = lines.lines(&track(time_s, Some((0.1 + 0.01 * time_s, 2.0))));
            printed.extend(text.lines().map(str::to_owned).collect::<Vec<_>>());
        }
        assert_eq!(printed.len(), 11, "{printed:?}");
        assert_eq!(printed[1], "1.00 s: contact 1 now at 110 mm (109 to 111), 2.0 N (1.8 to 2.2)");
        let heavier = lines.lines(&track(20.0, Some((0.2, 2.5))));
        assert_eq!(heavier, "20.00 s: contact 1 now at 200 mm (199 to 201), 2.5 N (2.3 to 2.7)\n");
    }

    #[test]
    fn prints_as_many_digits_as_the_interval_supports() {
        for (value, interval, expected) in [
            (33.038, (32.7, 33.376), "33.0 mm (32.7 to 33.4)"),
            (33.038, (-17.0, 83.0), "30 mm (-20 to 80)"),
            (0.0, (-2194.0, 3150.0), "0 mm (-2000 to 3000)"),
            (1.0 / 3.0, (1.0 / 3.0, 1.0 / 3.0), "0.3333 mm (0.3333 to 0.3333)"),
            (2e60, (-3e60, 7e60), "2.0e60 mm (-3.0e60 to 7.0e60)"),
            (5.0, (f64::NEG_INFINITY, f64::INFINITY), "5.0000 mm (-inf to inf)"),
            (-0.01, (-3.0, 3.0), "0 mm (-3 to 3)"),
        ] {
            assert_eq!(with_interval(value, interval, "mm"), expected);
        }
    }
}
