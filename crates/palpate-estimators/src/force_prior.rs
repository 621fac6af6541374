//! Prior of the unknown force of a contact: one for the estimators, the tracker and the status of readings.
//!
//! A [`ForceRange`] (W₁, W₂) is a log-normal distribution, ln W ~ N(μ, s²) with the quantiles W₁ at 0.5 % and W₂ at 99.5 %, cut off at W₂. Over
//! several decades it is nearly flat in ln W: a place where the surface is stiff, and a greater force has to explain the reading, is as probable as
//! any other. A prior flat in W would prefer the stiff places beside supports, in proportion to the force that they need.
//!
//! Locators of files without a range have a normal prior, that of the presses.

mod cut_normal;
mod log_normal;

pub(crate) use cut_normal::NormalPrior;
pub(crate) use log_normal::LogNormalPrior;

use palpate_numerics::{OutOfRange, normal_interval_95};
use serde::{Deserialize, Serialize};

/// Range of the forces of contacts, in newtons: 1 in 200 is less than its lower end, and none is greater than its upper end.
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

/// Where readings are proportional to the force, contacts may be so many times lighter or harder than the presses of the calibration: a decade.
pub(crate) const DECADE: f64 = 10.0;

/// Ratio of the greatest to the least force of presses below which they count as presses of one force. A policy: over a smaller ratio, a
/// saturation of some percent and a varying hand are indistinguishable.
pub(crate) const ONE_WEIGHT: f64 = 1.5;

impl ForceRange {
    /// From a least to a greatest force, in newtons.
    ///
    /// # Errors
    /// [`OutOfRange`] for an end that is not greater than 0 and finite, and an upper end that is not greater than the lower one.
    pub fn new(least_n: f64, greatest_n: f64) -> Result<Self, OutOfRange> {
        const UPPER: &str = "the upper end of the force range in newtons";
        let ends = [("the lower end of the force range in newtons", least_n), (UPPER, greatest_n)];
        OutOfRange::check_positive(ends)?;
        OutOfRange::check("greater than the lower end", [(UPPER, greatest_n)], |upper| upper > least_n)?;
        Ok(Self { least_n, greatest_n })
    }

    /// From a decade below to a decade above the mean force of presses, in newtons, extended to include all presses; `None` without a press.
    ///
    /// Readings that are proportional to the force have the same directions at any force, so extrapolation is safe there. Another function
    /// of the force is calibrated over the presses alone, and contacts are expected to be about as hard as these.
    pub fn of_presses(forces_n: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut sum_n, mut count, mut least_n, mut greatest_n) = (0.0, 0.0, f64::INFINITY, 0.0f64);
        for force_n in forces_n {
            (sum_n, count) = (sum_n + force_n, count + 1.0);
            (least_n, greatest_n) = (least_n.min(force_n), greatest_n.max(force_n));
        }
        let mean_n: f64 = sum_n / count;
        Self::new(least_n.min(mean_n / DECADE), greatest_n.max(mean_n * DECADE)).ok()
    }

    /// Lower and upper end, in newtons.
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

/// Prior of an unknown force, or of another quantity in newtons that is a power of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ForcePrior {
    Normal(NormalPrior),
    LogNormal(LogNormalPrior),
}

/// Likelihood exp(−½·M(W)) of a force W at a place, with the squared residual M(W) = M(0) − 2·b·W + a·W², in variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceLikelihood {
    pub b: f64,
    pub a: f64,
    /// A force, and M there.
    pub at_n: f64,
    pub misfit: f64,
}

/// Posterior of a force at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceIntegral {
    /// −2·ln of the greatest value of prior times likelihood, and of the width about it, up to a constant of the prior. Their sum is −2·ln of the
    /// integral; infinite where the integral is not a number.
    pub peak_cost: f64,
    pub width_cost: f64,
    pub mean_n: f64,
    pub variance_n2: f64,
}

/// Expansion of −2·ln of a prior's density about a force, up to a constant, as least squares of one residual r.
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
    /// The least force that matters, and the greatest that is possible, in newtons.
    pub fn ends_n(&self) -> (f64, f64) {
        match self {
            Self::Normal(prior) => (0.0, prior.greatest_n),
            Self::LogNormal(prior) => prior.ends_n(),
        }
    }

    /// Expansion about a force; that of a log-normal prior is the expansion of the density of ln W.
    pub fn terms(&self, force_n: f64) -> PriorTerms {
        match self {
            Self::Normal(prior) => prior.terms(force_n),
            Self::LogNormal(prior) => prior.terms(force_n),
        }
    }

    /// Point estimate of the force by the [likelihood](ForceLikelihood) of these b and a.
    pub fn estimate_n(&self, b: f64, a: f64) -> f64 {
        match self {
            Self::Normal(prior) => prior.estimate_n(b, a),
            Self::LogNormal(prior) => prior.estimate_n(b, a),
        }
    }

    /// The integral of prior and likelihood, with mean and variance of the force.
    pub fn integrate(&self, likelihood: ForceLikelihood) -> ForceIntegral {
        match self {
            Self::Normal(prior) => prior.integrate(likelihood),
            Self::LogNormal(prior) => prior.integrate(likelihood),
        }
    }
}

/// The 95 % interval of a force by a normal distribution, in newtons. Contacts press: the interval of a force that presses ends at 0.
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
