//! Placement error of manual presses, stored in a comment.

use palpate_mechanics::units::{Dimension, Quantity};

const PART: &str = "; placement ";

/// Appends the placement standard deviation in each direction, in metres.
pub fn comment_with_placement(comment: &str, placement_sd_m: Option<f64>) -> String {
    match placement_sd_m {
        // Round to picometres.
        Some(sd_m) => format!("{comment}{PART}{} mm", (sd_m * 1e12).round() / 1e9),
        None => comment.to_owned(),
    }
}

pub(super) fn placement_of(content: &[u8]) -> Option<f64> {
    let line = content.split(|byte| *byte == b'\n').next()?;
    let (_, text) = std::str::from_utf8(line).ok()?.strip_prefix('#')?.rsplit_once(PART)?;
    let sd_m = Quantity::parse_as(text.trim_end(), Dimension::Length).ok()?;
    (sd_m.is_finite() && sd_m > 0.0).then_some(sd_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placement_survives_the_file() {
        for sd_m in [2e-3, 0.35e-3, 1.5, 7e-6] {
            let comment = comment_with_placement("palpate 0.1.0, pressed for rig.toml", Some(sd_m));
            let read = placement_of(format!("# {comment}\r\nposition_mm,a\n").as_bytes()).unwrap();
            assert!((read / sd_m - 1.0).abs() < 1e-9, "{comment}: {read}");
        }
        let without = comment_with_placement("palpate 0.1.0, pressed for rig.toml", None);
        assert_eq!(placement_of(format!("# {without}\n").as_bytes()), None);
    }

    #[test]
    fn lines_without_a_length_say_no_placement() {
        for line in [
            "palpate 0.1; placement 2 mm",
            "# palpate 0.1, placement 2 mm",
            "# palpate 0.1; placement 2",
            "# palpate 0.1; placement -2 mm",
            "\u{fe}",
            "",
        ] {
            assert_eq!(placement_of(line.as_bytes()), None, "{line}");
        }
    }
}
