//! Prior of the unknown force of a contact.
//!
//! A [`ForceRange`] (W₁, W₂) is log-normal, ln W ~ N(μ, s²), with quantiles W₁ at 0.5 % and W₂ at 99.5 %,
//! truncated at W₂. A prior flat in W would prefer stiff positions beside supports. Locator files without a
//! range have a normal prior.

mod cut_normal;
mod log_normal;

pub(crate) use cut_normal::NormalPrior;
pub(crate) use log_normal::LogNormalPrior;

use palpate_numerics::{OutOfRange, normal_interval_95};
use serde::{Deserialize, Serialize};

/// Range of contact forces in newtons, from the 0.5 % quantile to the maximum.
///
/// ```
/// use palpate_estimators::force_prior::ForceRange;
///
/// let range = ForceRange::new(0.5, 10.0)?;
/// assert_eq!(range.ends_n(), (0.5, 10.0));
/// let refused = ForceRange::new(10.0, 0.5).unwrap_err().to_string();
/// assert_eq!(refused, "the upper end of the force range in newtons is 0.5; it must be greater than the lower end");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "(f64, f64)", into = "(f64, f64)")]
pub struct ForceRange {
    least_n: f64,
    greatest_n: f64,
}

/// Ratio of contact forces to press forces.
pub(crate) const DECADE: f64 = 10.0;

/// Ratio of press forces up to which they count as one, a policy: saturation resembles a varying hand.
pub(crate) const ONE_WEIGHT: f64 = 1.5;

impl ForceRange {
    /// Returns a range in newtons.
    ///
    /// # Errors
    /// [`OutOfRange`] unless 0 < least < greatest, both finite.
    pub fn new(least_n: f64, greatest_n: f64) -> Result<Self, OutOfRange> {
        const UPPER: &str = "the upper end of the force range in newtons";
        let ends = [("the lower end of the force range in newtons", least_n), (UPPER, greatest_n)];
        OutOfRange::check_positive(ends)?;
        OutOfRange::check("greater than the lower end", [(UPPER, greatest_n)], |upper| upper > least_n)?;
        Ok(Self { least_n, greatest_n })
    }

    /// Returns a decade below to a decade above the mean press force, extended to all presses.
    ///
    /// For readings in proportion to the force, which keep their direction; others are calibrated over the
    /// presses alone.
    pub fn of_presses(forces_n: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut sum_n, mut count, mut least_n, mut greatest_n) = (0.0, 0.0, f64::INFINITY, 0.0f64);
        for force_n in forces_n {
            (sum_n, count) = (sum_n + force_n, count + 1.0);
            (least_n, greatest_n) = (least_n.min(force_n), greatest_n.max(force_n));
        }
        let mean_n: f64 = sum_n / count;
        Self::new(least_n.min(mean_n / DECADE), greatest_n.max(mean_n * DECADE)).ok()
    }

    /// Ends.
    pub fn ends_n(self) -> (f64, f64) {
        (self.least_n, self.greatest_n)
    }
}

impl TryFrom<(f64, f64)> for ForceRange {
    type Error = OutOfRange;

    fn try_from((least_n, greatest_n): (f64, f64)) -> Result<Self, OutOfRange> {
        Self::new(least_n, greatest_n)
    }
}

impl From<ForceRange> for (f64, f64) {
    fn from(range: ForceRange) -> Self {
        range.ends_n()
    }
}

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
        Self::LogNormal(LogNormalPrior::new(range.least_n, range.greatest_n))
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
