//! Drift of the offsets during a recording.

use palpate_numerics::regression::Kernel;
use serde::{Deserialize, Serialize};

/// Time of the last row, which located readings follow.
pub(super) const END: f64 = 1.0;
pub(super) const START: f64 = 0.0;

/// Course of the drift: a Gaussian process of time, from 0 at the first row to 1 at the last, with a total
/// change of variance 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DriftCourse {
    /// A random walk.
    #[default]
    Walk,
    /// Proportional to time.
    Linear,
    /// Smooth: squared-exponential correlation over half the recording.
    Smooth,
}

impl DriftCourse {
    pub(super) const ALL: [Self; 3] = [Self::Walk, Self::Linear, Self::Smooth];

    /// Covariance of the drift from `a` and `b` to the last row.
    pub(super) fn covariance(self, a: f64, b: f64) -> f64 {
        const LENGTH: f64 = 0.5;
        let correlation = |way: f64| Kernel::SquaredExponential.correlation((way / LENGTH) * (way / LENGTH));
        match self {
            Self::Walk => 1.0 - a.max(b),
            Self::Linear => (1.0 - a) * (1.0 - b),
            Self::Smooth => {
                let change = 1.0 + correlation(a - b) - correlation(1.0 - a) - correlation(1.0 - b);
                0.5 * change / (1.0 - correlation(1.0))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_course_moves_by_one_from_end_to_end() {
        for course in DriftCourse::ALL {
            assert!((course.covariance(0.0, 0.0) - 1.0).abs() < 1e-12, "{course:?}");
            assert_eq!([0.0, 0.5, 1.0].map(|a| course.covariance(a, 1.0).abs()), [0.0; 3], "{course:?}");
        }
    }
}
