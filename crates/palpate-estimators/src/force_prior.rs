//! Prior of the unknown force of a contact.
//!
//! A [`ForceRange`] (W₁, W₂) is log-normal, ln W ~ N(μ, s²), with quantiles W₁ at 0.5 % and W₂ at 99.5 %,
//! truncated at W₂. A prior flat in W would prefer stiff positions beside supports. Locator files without a
//! range have a normal prior.

mod belief;
mod cut_normal;
mod log_normal;
mod range;

pub use belief::ForceBelief;
pub(crate) use cut_normal::NormalPrior;
pub(crate) use log_normal::LogNormalPrior;
pub use range::ForceRange;
pub(crate) use range::{DECADE, ONE_WEIGHT};

use palpate_numerics::normal_interval_95;

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ForcePrior {
    Normal(NormalPrior),
    LogNormal(LogNormalPrior),
}

/// Likelihood exp(−½·M(W)), M(W) = M(0) − 2·b·W + a·W² in variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceLikelihood {
    pub b: f64,
    pub a: f64,
    pub at_n: f64,
    pub misfit: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceIntegral {
    /// −2·ln of the maximum and of the width of prior times likelihood, up to a constant; infinite for an
    /// invalid integral.
    pub peak_cost: f64,
    pub width_cost: f64,
    pub mean_n: f64,
    pub variance_n2: f64,
}

/// −2·ln prior as the square of a residual r, up to a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PriorTerms {
    /// r².
    pub cost: f64,
    /// r·r′, per newton.
    pub slope: f64,
    /// r′², per square newton.
    pub precision: f64,
}

impl From<ForceRange> for ForcePrior {
    fn from(range: ForceRange) -> Self {
        let (least_n, greatest_n) = range.ends_n();
        Self::LogNormal(LogNormalPrior::new(least_n, greatest_n))
    }
}

impl ForcePrior {
    pub fn ends_n(&self) -> (f64, f64) {
        match self {
            Self::Normal(prior) => (0.0, prior.greatest_n),
            Self::LogNormal(prior) => prior.ends_n(),
        }
    }

    /// For a log-normal prior, of the density of ln W.
    pub fn terms(&self, force_n: f64) -> PriorTerms {
        match self {
            Self::Normal(prior) => prior.terms(force_n),
            Self::LogNormal(prior) => prior.terms(force_n),
        }
    }

    pub fn estimate_n(&self, b: f64, a: f64) -> f64 {
        match self {
            Self::Normal(prior) => prior.estimate_n(b, a),
            Self::LogNormal(prior) => prior.estimate_n(b, a),
        }
    }

    pub fn integrate(&self, likelihood: ForceLikelihood) -> ForceIntegral {
        match self {
            Self::Normal(prior) => prior.integrate(likelihood),
            Self::LogNormal(prior) => prior.integrate(likelihood),
        }
    }
}

/// Returns the 95 % interval of a normal force; at least 0 for a positive force.
///
/// ```
/// use palpate_estimators::force_prior::force_interval_95_n;
///
/// assert_eq!(force_interval_95_n(1.0, 5.0).0, 0.0);
/// assert!(force_interval_95_n(-1.0, 0.1).1 < 0.0); // where the rig counts pulls as negative forces
/// ```
pub fn force_interval_95_n(force_n: f64, sd_n: f64) -> (f64, f64) {
    let (low_n, high_n) = normal_interval_95(force_n, sd_n);
    if force_n >= 0.0 { (low_n.max(0.0), high_n) } else { (low_n, high_n) }
}

#[cfg(test)]
mod tests;
