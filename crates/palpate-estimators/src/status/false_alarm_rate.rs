//! False-alarm rate of contact detection.

use palpate_numerics::OutOfRange;
use serde::{Deserialize, Serialize};

/// Share of untouched readings detected as a contact.
///
/// ```
/// use palpate_estimators::status::FalseAlarmRate;
///
/// assert_eq!(FalseAlarmRate::default(), FalseAlarmRate::new(0.001)?);
/// assert_eq!(FalseAlarmRate::new(0.01)?.to_string(), "1 %");
/// let refused = FalseAlarmRate::new(0.5).unwrap_err().to_string();
/// assert_eq!(refused, "the false-alarm rate is 0.5; it must be at least 0.0001 % and at most 10 %");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct FalseAlarmRate(f64);

impl FalseAlarmRate {
    /// Range of rates; below it the tails of real noise are not normal.
    pub const RANGE: std::ops::RangeInclusive<f64> = 1e-6..=0.1;
    /// Range in words.
    pub const RANGE_IN_WORDS: &'static str = "at least 0.0001 % and at most 10 %";
    /// One in a thousand.
    pub const DEFAULT: Self = Self(1e-3);

    /// Returns a rate.
    ///
    /// # Errors
    /// [`OutOfRange`] outside [`FalseAlarmRate::RANGE`].
    pub fn new(share: f64) -> Result<Self, OutOfRange> {
        let number = [("the false-alarm rate", share)];
        OutOfRange::check(Self::RANGE_IN_WORDS, number, |share| Self::RANGE.contains(&share))?;
        Ok(Self(share))
    }

    /// Share of readings.
    pub const fn share(self) -> f64 {
        self.0
    }
}

impl Default for FalseAlarmRate {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl TryFrom<f64> for FalseAlarmRate {
    type Error = OutOfRange;

    fn try_from(share: f64) -> Result<Self, OutOfRange> {
        Self::new(share)
    }
}

impl From<FalseAlarmRate> for f64 {
    fn from(rate: FalseAlarmRate) -> Self {
        rate.0
    }
}

impl std::fmt::Display for FalseAlarmRate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // A percentage has no more digits than the share: 0.07 is 7 %, not 7.000000000000001 %.
        let percent = (self.0 * 1e14).round() / 1e12;
        write!(f, "{percent} %")
    }
}
