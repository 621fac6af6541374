//! Published figures of the paper, each from one training run.

use serde::Serialize;

use crate::{ArmResults, StudyResults};
use palpate_estimators::evaluation::Quantiles;

/// Criterion of agreement with a published figure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AgreementCriterion {
    /// Largest difference, in the figure's unit.
    Within(f64),
    /// Largest ratio of the larger to the smaller.
    Factor(f64),
    /// The published figure is an upper bound.
    Below,
}

impl AgreementCriterion {
    fn accepts(self, published: f64, median: f64) -> bool {
        match self {
            Self::Within(difference) => (published - median).abs() <= difference,
            Self::Factor(factor) => median <= published * factor && published <= median * factor,
            Self::Below => median < published,
        }
    }

    /// Describes the criterion; `published` as printed: "±0.6 points".
    pub fn in_words(self, published: &str) -> String {
        match self {
            Self::Within(difference) => format!("±{difference} points"),
            Self::Factor(factor) => format!("a factor of {factor}"),
            Self::Below => format!("below {published}"),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Figure {
    Epochs,
    Error,
    /// Average error within a portion (index).
    PortionError(usize),
    /// Largest error within a portion (index).
    PortionMaxError(usize),
    EffectiveLength,
}

impl Figure {
    fn quantiles(self, arm: &ArmResults) -> Option<Quantiles> {
        Some(match self {
            Self::Epochs => arm.epochs?,
            Self::Error => arm.error_percent,
            Self::PortionError(index) => arm.portions.get(index)?.error_percent,
            Self::PortionMaxError(index) => arm.portions.get(index)?.max_error_percent,
            Self::EffectiveLength => arm.effective_length_percent,
        })
    }

    const fn name(self) -> (&'static str, &'static str) {
        match self {
            Self::Epochs => ("epochs", "iterations"),
            Self::Error => ("error_percent", "average error, 1–399 mm, %"),
            Self::PortionError(0) => ("error_percent_20_380", "average error, 20–380 mm, %"),
            Self::PortionError(_) => ("error_percent_60_300", "average error, 60–300 mm, %"),
            Self::PortionMaxError(_) => ("max_error_percent_60_300", "largest error, 60–300 mm, %"),
            Self::EffectiveLength => ("effective_length_percent", "effective length, %"),
        }
    }

    /// Errors within 0.6 points (0.25 below 1 %), effective lengths within 6 points, iterations within a
    /// factor of 3.
    fn criterion(self, published: f64) -> AgreementCriterion {
        match self {
            Self::Epochs => AgreementCriterion::Factor(3.0),
            Self::PortionMaxError(_) => AgreementCriterion::Below,
            Self::EffectiveLength => AgreementCriterion::Within(6.0),
            Self::Error | Self::PortionError(_) if published < 1.0 => AgreementCriterion::Within(0.25),
            Self::Error | Self::PortionError(_) => AgreementCriterion::Within(0.6),
        }
    }
}

/// Figures of sections 3.1 to 3.3 by arm.
const PUBLISHED: [(&str, Figure, f64); 16] = [
    ("position-10", Figure::Epochs, 26_850.0),
    ("position-10", Figure::Error, 3.6),
    ("position-10", Figure::PortionError(0), 1.4),
    ("position-10", Figure::PortionError(1), 0.2),
    ("position-10", Figure::PortionMaxError(1), 0.5),
    ("position-30", Figure::Error, 1.6),
    ("normalized-10", Figure::Error, 2.46),
    ("normalized-30", Figure::Error, 0.57),
    ("middle4-10", Figure::Error, 2.18),
    ("middle4-30", Figure::Error, 0.44),
    ("normalized-10", Figure::EffectiveLength, 63.5),
    ("normalized-30", Figure::EffectiveLength, 87.5),
    ("middle6-10", Figure::EffectiveLength, 70.3),
    ("middle6-30", Figure::EffectiveLength, 94.5),
    ("middle4-10", Figure::EffectiveLength, 78.0),
    ("middle4-30", Figure::EffectiveLength, 94.8),
];

/// Published figure beside that of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PublishedFigure {
    /// Arm and figure: "position-10.error_percent".
    pub id: String,
    /// Arm.
    pub arm: &'static str,
    /// Figure in words, with its unit.
    #[serde(rename = "what")]
    pub label: &'static str,
    /// Published value.
    pub published: f64,
    /// Quantiles over the seeds.
    #[serde(flatten)]
    #[serde(rename = "found")]
    pub result: Quantiles,
    /// Criterion of agreement.
    #[serde(rename = "yardstick")]
    pub criterion: AgreementCriterion,
    /// True if the median agrees.
    pub agrees: bool,
    /// True within the 5th to 95th percentile; for a bound, above the 5th.
    pub within_seeds: bool,
}

/// Numbers of figures that agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Agreement {
    /// Agreement with the medians.
    pub agreeing: usize,
    /// Agreement with the 5–95 % range of the seeds.
    pub within_seeds: usize,
    /// Number of all figures.
    pub compared: usize,
}

impl Agreement {
    /// Counts the figures that agree.
    pub fn new(figures: &[PublishedFigure]) -> Self {
        let count =
            |holds: fn(&PublishedFigure) -> bool| figures.iter().filter(|figure| holds(figure)).count();
        Self {
            agreeing: count(|figure| figure.agrees),
            within_seeds: count(|figure| figure.within_seeds),
            compared: figures.len(),
        }
    }
}

/// Compares all published figures among the results.
pub fn published_figures(results: &StudyResults) -> Vec<PublishedFigure> {
    let beside = |&(arm, figure, published): &(&'static str, Figure, f64)| {
        let found = figure.quantiles(results.arm(arm)?)?;
        let (key, what) = figure.name();
        let yardstick = figure.criterion(published);
        let agrees = yardstick.accepts(published, found.median);
        let within_seeds =
            found.p05 <= published && (yardstick == AgreementCriterion::Below || published <= found.p95);
        let id = format!("{arm}.{key}");
        Some(PublishedFigure {
            id,
            arm,
            label: what,
            published,
            result: found,
            criterion: yardstick,
            agrees,
            within_seeds,
        })
    };
    PUBLISHED.iter().filter_map(beside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn yardsticks_measure_both_ways() {
        assert!(AgreementCriterion::Within(0.6).accepts(3.6, 3.01));
        assert!(!AgreementCriterion::Within(0.6).accepts(3.6, 4.21));
        assert!(AgreementCriterion::Factor(3.0).accepts(26_850.0, 9_000.0));
        assert!(!AgreementCriterion::Factor(3.0).accepts(26_850.0, 8_900.0));
        assert!(!AgreementCriterion::Factor(3.0).accepts(26_850.0, 81_000.0));
        assert!(!AgreementCriterion::Below.accepts(0.5, 0.5));
    }
}
