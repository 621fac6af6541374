//! Truncated normal prior of a force.

use super::{ForceIntegral, ForceLikelihood, PriorTerms};
use palpate_numerics::normal_between;

/// Normal distribution, truncated at 0 and a maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NormalPrior {
    pub mean_n: f64,
    pub precision: f64,
    pub greatest_n: f64,
}

#[derive(Clone, Copy)]
pub(super) struct CutNormal {
    pub mean_n: f64,
    pub precision: f64,
    pub greatest_n: f64,
}

impl NormalPrior {
    pub fn terms(self, force_n: f64) -> PriorTerms {
        let off_n = force_n - self.mean_n;
        PriorTerms {
            cost: off_n * off_n * self.precision,
            slope: off_n * self.precision,
            precision: self.precision,
        }
    }

    pub fn estimate_n(self, b: f64, a: f64) -> f64 {
        let CutNormal { mean_n, precision, greatest_n } = self.posterior(b, a);
        if precision > 0.0 { mean_n.clamp(0.0, greatest_n) } else { 0.0 }
    }

    pub fn integrate(self, ForceLikelihood { b, a, at_n, misfit }: ForceLikelihood) -> ForceIntegral {
        let posterior = self.posterior(b, a);
        let with_prior = misfit + (at_n - self.mean_n).powi(2) * self.precision;
        posterior.integrate(with_prior - (at_n - posterior.mean_n).powi(2) * posterior.precision)
    }

    fn posterior(self, b: f64, a: f64) -> CutNormal {
        let precision = a + self.precision;
        let mean_n = (b + self.mean_n * self.precision) / precision;
        CutNormal { mean_n, precision, greatest_n: self.greatest_n }
    }
}

impl CutNormal {
    /// From −2·ln of the density at the mean.
    pub fn integrate(self, peak_cost: f64) -> ForceIntegral {
        let Self { mean_n, precision, greatest_n } = self;
        if precision.is_nan() || precision <= 0.0 {
            let mean_n = if mean_n > 0.0 { mean_n.min(greatest_n) } else { 0.0 };
            return ForceIntegral { peak_cost: f64::INFINITY, width_cost: 0.0, mean_n, variance_n2: 0.0 };
        }
        let sd_n = precision.sqrt().recip();
        let part = normal_between((0.0 - mean_n) / sd_n, (greatest_n - mean_n) / sd_n);
        ForceIntegral {
            peak_cost,
            width_cost: -2.0 * (part.ln_share + sd_n.ln()),
            mean_n: (mean_n + sd_n * part.mean).clamp(0.0, greatest_n),
            variance_n2: part.variance * sd_n * sd_n,
        }
    }
}
