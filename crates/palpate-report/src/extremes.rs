//! The least and the greatest of what a figure shows.

use super::{Axis, Series, SeriesKind};

/// Positive values whose greatest is this many times the least are drawn on a logarithmic axis.
const LOGARITHMIC_FROM: f64 = 10.0;

/// The least and the greatest of some values; zeros where none of them is a number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Extremes {
    pub least: f64,
    pub greatest: f64,
}

impl Extremes {
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let wider = |extremes: Option<Self>, value: f64| {
            let Self { least, greatest } = extremes.unwrap_or(Self { least: value, greatest: value });
            Some(Self { least: least.min(value), greatest: greatest.max(value) })
        };
        finite.fold(None, wider).unwrap_or_default()
    }

    /// Of the heights of all lines.
    pub fn of_lines(series: &[Series]) -> Self {
        Self::of(series.iter().flat_map(|series| match &series.kind {
            SeriesKind::Line { points, .. } => points.iter().map(|point| point.1).collect(),
            _ => Vec::new(),
        }))
    }

    /// Whether only a logarithmic axis shows both ends.
    pub fn are_far_apart(self) -> bool {
        self.least > 0.0 && self.greatest >= LOGARITHMIC_FROM * self.least
    }

    /// An axis that shows both ends: logarithmic where they are far apart.
    pub fn axis(self, label: &str) -> Axis {
        if self.are_far_apart() { Axis::log10(label) } else { Axis::linear(label) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_does_not_count() {
        let extremes = Extremes::of([3.0, f64::NAN, 0.3, f64::INFINITY]);
        assert_eq!(extremes, Extremes { least: 0.3, greatest: 3.0 });
        assert!(extremes.are_far_apart());
        assert!(!Extremes::of([0.0, 3.0]).are_far_apart());
        assert_eq!(Extremes::of([f64::NAN]), Extremes::default());
    }
}
