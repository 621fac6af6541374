//! Range of contact forces.

use palpate_numerics::OutOfRange;
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

/// Ratio of contact forces to press forces, a policy.
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
