//! Widening of intervals.

use palpate_core::{ContactEstimate, Estimate, Mode, Uncertainty};
use palpate_mechanics::surface::Extent;
use palpate_numerics::NORMAL_95;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Widening {
    pub added_sd: f64,
    pub factor: f64,
}

impl Widening {
    pub const NONE: Self = Self { added_sd: 0.0, factor: 1.0 };

    /// Lengthens both sides, within 0 and `size` where the original is.
    pub fn interval(self, (low, high): (f64, f64), size: f64) -> (f64, f64) {
        let half = 0.5 * (high - low).max(0.0);
        let more = self.factor * half.hypot(NORMAL_95 * self.added_sd) - half;
        ((low - more).max(low.min(0.0)), (high + more).min(high.max(size)))
    }

    fn variance(self, variance: f64) -> f64 {
        self.factor * self.factor * (variance + self.added_sd * self.added_sd)
    }

    pub fn added_variance(self, variance: f64) -> f64 {
        self.variance(variance) - variance
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EstimateWidening {
    pub position: Widening,
    pub force: Widening,
}

impl EstimateWidening {
    /// Intervals within the surface, and positive forces, stay so.
    pub fn widened(&self, estimate: Estimate, extent: Extent) -> Estimate {
        if [self.position, self.force] == [Widening::NONE; 2] {
            return estimate;
        }
        let mut wider = Estimate { contact: self.contact(estimate.contact, extent), ..estimate };
        wider.modes.clear();
        for mode in estimate.modes.as_slice() {
            wider.modes.push(Mode { contact: self.contact(mode.contact, extent), ..*mode });
        }
        wider.further.clear();
        for contact in estimate.further.as_slice() {
            wider.further.push(self.contact(*contact, extent));
        }
        wider
    }

    fn contact(&self, contact: ContactEstimate, extent: Extent) -> ContactEstimate {
        let Some(uncertainty) = contact.uncertainty else { return contact };
        let Self { position, force } = *self;
        let [xx, xy, xf, yy, yf, ff] = uncertainty.covariance;
        let (p, f) = (position.factor, force.factor);
        // A line has no error across it.
        let yy = if extent.width_m().is_some() { position.variance(yy) } else { p * p * yy };
        // A known force has no error.
        let ff = if ff > 0.0 { force.variance(ff) } else { ff };
        let uncertainty = Uncertainty {
            covariance: [position.variance(xx), p * p * xy, p * f * xf, yy, p * f * yf, ff],
            x_95_m: position.interval(uncertainty.x_95_m, extent.length_m()),
            y_95_m: extent
                .width_m()
                .map_or(uncertainty.y_95_m, |width_m| position.interval(uncertainty.y_95_m, width_m)),
            force_95_n: uncertainty.force_95_n.map(|force_95_n| force.interval(force_95_n, f64::INFINITY)),
        };
        ContactEstimate { uncertainty: Some(uncertainty), ..contact }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interval_check::UNBOUNDED;

    fn by_factor(factor: f64) -> Widening {
        Widening { added_sd: 0.0, factor }
    }

    #[test]
    fn intervals_end_where_the_surface_does() {
        assert_eq!(by_factor(2.0).interval((0.0, 0.3), 1.0), (0.0, 0.3 + 0.15));
        assert_eq!(by_factor(4.0).interval((0.6, 0.95), 1.0).1, 1.0);
        // An interval beyond an end is not shortened.
        assert_eq!(by_factor(2.0).interval((-0.2, 0.2), 1.0), (-0.2, 0.4));
        assert_eq!(by_factor(UNBOUNDED).interval((0.3, 0.3), 1.0), (0.3, 0.3));
    }

    #[test]
    fn an_added_standard_deviation_lengthens_narrow_intervals_most() {
        let widening = Widening { added_sd: 0.01, factor: 1.5 };
        let (low, high) = widening.interval((0.5, 0.5), 1.0);
        assert!((0.5 * (high - low) - 1.5 * NORMAL_95 * 0.01).abs() < 1e-12);
        let (low, high) = widening.interval((0.2, 0.8), 1.0);
        assert!((0.5 * (high - low) - 0.45).abs() < 1e-3);
    }
}
