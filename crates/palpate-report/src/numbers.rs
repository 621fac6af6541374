use palpate_estimators::evaluation::{Portion, Quantiles};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Dimension, Quantity, format_count};

pub(crate) const NOTHING: &str = "–";

/// Three significant digits: "63.5", "−0.044", "1,250"; "–" for a value that is not finite.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        return NOTHING.to_owned();
    }
    let text = if size >= 99.95 {
        format_count(size.round() as u64)
    } else if size >= 9.995 {
        format!("{size:.1}")
    } else if size >= 0.0995 || size == 0.0 {
        format!("{size:.2}")
    } else if size >= 1e-5 {
        let decimals = (1.0 - size.log10().floor()) as usize;
        format!("{size:.decimals$}")
    } else {
        format!("{size:.1e}")
    };
    signed(value, text)
}

fn signed(value: f64, size: String) -> String {
    if value < 0.0 { format!("−{size}") } else { size }
}

/// "−1.3784"
pub(crate) fn decimals(value: f64, count: usize) -> String {
    signed(value, format!("{:.count$}", value.abs()))
}

/// "5 µm" for "5 um" in files.
pub(crate) fn quantity(value: f64, dimension: Dimension) -> String {
    let text = Quantity { value, dimension }.to_string();
    match text.split_once(" u") {
        Some((number, "e")) => format!("{number} µε"),
        Some((number, unit)) => format!("{number} µ{unit}"),
        None => text,
    }
}

/// "26,850"
pub(crate) fn whole(value: f64) -> String {
    if !value.is_finite() {
        return NOTHING.to_owned();
    }
    let rounded = value.round();
    signed(rounded, format_count(rounded.abs() as u64))
}

/// "3.6", "26,850"
pub(crate) fn as_written(value: f64) -> String {
    if value.abs() >= 1e3 { whole(value) } else { format!("{value}") }
}

/// At most two decimals: "33.33", "20".
pub(crate) fn mm(length_m: f64) -> String {
    let text = format!("{:.2}", length_m * 1e3);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// "50", or "50, 20" on a plane.
pub(crate) fn place(position: Position, extent: Extent) -> String {
    extent.coordinates_m(position).map(mm).collect::<Vec<_>>().join(", ")
}

/// "20–380 mm"
pub(crate) fn stretch(portion: Portion) -> String {
    format!("{}–{} mm", mm(portion.from_m), mm(portion.to_m))
}

/// As in a rig file: "3", "200", "0.25".
pub(crate) fn rig_number(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Median with 5th and 95th percentile: "2.38 (2.26–2.73)"; the median alone if all three read
/// alike.
pub(crate) fn quantile_range(spread: Quantiles, shown: fn(f64) -> String) -> String {
    let [median, low, high] = [spread.median, spread.p05, spread.p95].map(shown);
    if low == median && high == median { median } else { format!("{median} ({low}–{high})") }
}

/// "1 seed", "1,200 networks"
pub(crate) fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{} {}", whole(count as f64), if count == 1 { one } else { many })
}

/// "C1, C2 and C5"
pub(crate) fn listed<T: AsRef<str>>(items: &[T]) -> String {
    match items {
        [] => String::new(),
        [only] => only.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_about_three_digits() {
        let shown =
            [26_850.4, 100.0, 63.46, 2.4649, 0.5712, 0.0, 0.04449, 1.2e-7, -0.213, f64::NAN].map(number);
        assert_eq!(shown, ["26,850", "100", "63.5", "2.46", "0.57", "0.00", "0.044", "1.2e-7", "−0.21", "–"]);
        assert_eq!([-1.378_42, 0.5].map(|value| decimals(value, 4)), ["−1.3784", "0.5000"]);
    }

    #[test]
    fn thousands_are_set_apart() {
        let shown = [0.0, 999.0, 1000.0, -1_234_567.0, f64::INFINITY].map(whole);
        assert_eq!(shown, ["0", "999", "1,000", "−1,234,567", "–"]);
        assert_eq!([26_850.0, 3.6].map(as_written), ["26,850", "3.6"]);
    }

    #[test]
    fn micro_sign_is_one_letter() {
        let shown = [quantity(5e-6, Dimension::Length), quantity(1e-6, Dimension::Strain)];
        assert_eq!(shown, ["5 µm", "1 µε"]);
        assert_eq!(quantity(5e-3, Dimension::Force), "5 mN");
    }

    #[test]
    fn a_spread_of_one_value_is_that_value() {
        assert_eq!(quantile_range(Quantiles { median: 2.0, p05: 2.0, p95: 2.0 }, number), "2.00");
        assert_eq!(
            quantile_range(Quantiles { median: 2.0, p05: 1.0, p95: 30.0 }, number),
            "2.00 (1.00–30.0)"
        );
    }

    #[test]
    fn lists_and_counts_read_as_sentences_do() {
        assert_eq!(listed::<&str>(&[]), "");
        assert_eq!(listed(&["C1", "C2", "C5"]), "C1, C2 and C5");
        assert_eq!(counted(1, "seed", "seeds"), "1 seed");
        assert_eq!(counted(1200, "seed", "seeds"), "1,200 seeds");
    }
}
