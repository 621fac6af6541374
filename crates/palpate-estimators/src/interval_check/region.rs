//! 95 % regions and true values.

use super::{HeldOutEstimate, UNBOUNDED};
use crate::estimate_record::ContactRecord;
use palpate_core::{ContactEstimate, Uncertainty};
use palpate_mechanics::surface::Extent;
use palpate_numerics::small::Ldl;
use palpate_numerics::{ELLIPSE_95, NORMAL_95};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Region {
    Interval(Interval),
    Ellipse {
        /// C, as xx, xy and yy.
        covariance: [f64; 3],
        /// e − t.
        error: [f64; 2],
        intervals: [Interval; 2],
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interval {
    low: f64,
    high: f64,
    estimate: f64,
    truth: f64,
}

impl Region {
    pub fn of_position(held_out: &HeldOutEstimate, extent: Extent) -> Option<Self> {
        let ContactEstimate { position, uncertainty, .. } = held_out.estimate.contact;
        let Uncertainty { covariance: [xx, xy, _, yy, ..], x_95_m, y_95_m, .. } = uncertainty?;
        let truth = held_out.truth;
        let along = Interval::new(x_95_m, position.x_m, truth.x_m);
        Some(match extent {
            Extent::Line { .. } => Self::Interval(along),
            Extent::Plane { .. } => Self::Ellipse {
                covariance: [xx, xy, yy],
                error: [position.x_m - truth.x_m, position.y_m - truth.y_m],
                intervals: [along, Interval::new(y_95_m, position.y_m, truth.y_m)],
            },
        })
    }

    pub fn of_force(held_out: &HeldOutEstimate, extent: Extent) -> Option<Self> {
        let contact = &held_out.estimate.contact;
        let interval_n = ContactRecord::new(contact, extent).force_interval_95_n()?;
        Some(Self::Interval(Interval::new(interval_n.into(), contact.force_n?, held_out.force_n?)))
    }

    pub fn dimensions(&self) -> f64 {
        match self {
            Self::Interval(_) => 1.0,
            Self::Ellipse { .. } => 2.0,
        }
    }

    /// Over the root of the dimensions.
    pub fn error(&self) -> f64 {
        match self {
            Self::Interval(interval) => interval.error().abs(),
            Self::Ellipse { error: [x, y], .. } => x.hypot(*y) / self.dimensions().sqrt(),
        }
    }

    /// Least factor to contain the truth, at most [`UNBOUNDED`].
    pub fn ratio(&self, added_sd: f64) -> f64 {
        match self {
            Self::Interval(interval) => interval.ratio(added_sd),
            Self::Ellipse { error, intervals, .. } => {
                let of_ellipse =
                    self.factors(added_sd).map(|factors| (factors.quadratic(*error) / ELLIPSE_95).sqrt());
                // An ellipse without an area does not bound the errors across it; its intervals do.
                let of_intervals = || intervals[0].ratio(added_sd).max(intervals[1].ratio(added_sd));
                of_ellipse.filter(|ratio| ratio.is_finite()).unwrap_or_else(of_intervals).min(UNBOUNDED)
            }
        }
    }

    /// Log standard deviation, or log product.
    pub fn log_size(&self, added_sd: f64) -> f64 {
        match self {
            Self::Interval(interval) => 0.5 * interval.variance(added_sd).ln(),
            Self::Ellipse { .. } => {
                self.factors(added_sd).map_or(f64::NEG_INFINITY, |factors| 0.5 * factors.log_determinant())
            }
        }
    }

    pub fn square(&self, added_sd: f64) -> f64 {
        match self {
            Self::Interval(interval) => interval.error().powi(2) / interval.variance(added_sd),
            Self::Ellipse { error, .. } => {
                self.factors(added_sd).map_or(f64::INFINITY, |factors| factors.quadratic(*error))
            }
        }
    }

    fn factors(&self, added_sd: f64) -> Option<Ldl<2>> {
        let Self::Ellipse { covariance: [xx, xy, yy], .. } = self else { return None };
        let added = added_sd * added_sd;
        Ldl::new(&[[xx + added, *xy], [*xy, yy + added]])
    }
}

impl Interval {
    fn new((low, high): (f64, f64), estimate: f64, truth: f64) -> Self {
        Self { low, high, estimate, truth }
    }

    fn error(&self) -> f64 {
        self.estimate - self.truth
    }

    fn half_width(&self) -> f64 {
        0.5 * (self.high - self.low).max(0.0)
    }

    fn variance(&self, added_sd: f64) -> f64 {
        (self.half_width() / NORMAL_95).powi(2) + added_sd * added_sd
    }

    /// Beyond the interval, the distance from the nearer end counts in half-widths, as a side may have length
    /// 0.
    fn ratio(&self, added_sd: f64) -> f64 {
        let half = self.half_width().hypot(NORMAL_95 * added_sd);
        let more = half - self.half_width();
        let (low, high) = (self.low - more, self.high + more);
        let beyond = (low - self.truth).max(self.truth - high);
        let toward = if self.error() <= 0.0 { high - self.estimate } else { self.estimate - low };
        let ratio = if beyond > 0.0 {
            1.0 + beyond / half
        } else if toward > 0.0 {
            (self.error().abs() / toward).min(1.0)
        } else {
            0.0
        };
        ratio.min(UNBOUNDED)
    }
}

#[cfg(test)]
mod tests {
    use super::super::widening::Widening;
    use super::*;

    #[test]
    fn an_interval_contains_the_truth_once_widened_by_its_ratio() {
        for ((low, high), estimate, truth) in [
            ((0.4, 0.6), 0.5, 0.8),
            // Intervals that end at their estimate, or do not contain it.
            ((0.4, 0.5), 0.5, 0.52),
            ((0.4, 0.5), 0.7, 0.9),
            ((0.4, 0.5), 0.45, 0.1),
        ] {
            for added_sd in [0.0, 0.005] {
                let ratio = Interval::new((low, high), estimate, truth).ratio(added_sd);
                assert!(ratio > 1.0 && ratio < 20.0, "{ratio}");
                let contains = |factor: f64| {
                    let (low, high) = Widening { added_sd, factor }.interval((low, high), 1.0);
                    (low..=high).contains(&truth)
                };
                assert!(contains(1.001 * ratio) && !contains(0.999 * ratio), "{ratio}");
            }
        }
        let ratio = |interval, estimate, truth| Interval::new(interval, estimate, truth).ratio(0.0);
        assert!((ratio((0.4, 0.6), 0.5, 0.55) - 0.5).abs() < 1e-12);
        assert_eq!((ratio((0.4, 0.4), 0.4, 0.5), ratio((0.4, 0.4), 0.4, 0.4)), (UNBOUNDED, 0.0));
    }

    #[test]
    fn an_ellipse_without_an_area_is_judged_by_its_intervals() {
        let interval = Interval::new((0.498, 0.502), 0.5, 0.501);
        let region =
            Region::Ellipse { covariance: [1e-6, 0.0, 0.0], error: [-1e-3; 2], intervals: [interval; 2] };
        assert!((region.ratio(0.0) - 0.5).abs() < 1e-9);
        assert!(region.ratio(2e-3) < 0.5 && region.log_size(2e-3).is_finite());
    }
}
