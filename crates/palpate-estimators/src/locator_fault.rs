//! Faults of numbers in locator files.

use std::borrow::Borrow;

/// Inconsistent numbers of a locator.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LocatorFault {
    /// List of the wrong length.
    #[error("the locator has {found} {what}; it must have {needed}")]
    Count {
        /// Name of the elements.
        what: &'static str,
        /// Required length.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// Number out of range.
    #[error("the locator's {what} number {number} is {value:?}; it must be {bound}")]
    BadNumber {
        /// Name of the elements.
        what: &'static str,
        /// Index from 1.
        number: usize,
        /// Value.
        value: f64,
        /// Bound in words.
        bound: &'static str,
    },
    /// Divisor close to 0.
    #[error(
        "the locator's {what} number {number} is {value:?}; it must be at least {:e}",
        LocatorFault::LEAST
    )]
    TooSmall {
        /// Name of the elements.
        what: &'static str,
        /// Index from 1.
        number: usize,
        /// Value.
        value: f64,
    },
}

impl LocatorFault {
    /// Least divisor, with a finite squared inverse.
    pub const LEAST: f64 = 1e-60;

    /// Faulty number, or the count.
    pub fn value(&self) -> f64 {
        match self {
            Self::Count { found, .. } => *found as f64,
            Self::BadNumber { value, .. } | Self::TooSmall { value, .. } => *value,
        }
    }

    /// Checks the length of a list.
    ///
    /// # Errors
    /// [`LocatorFault::Count`].
    pub fn check_count(what: &'static str, needed: usize, found: usize) -> Result<(), Self> {
        if needed == found { Ok(()) } else { Err(Self::Count { what, needed, found }) }
    }

    /// Checks the numbers of a list.
    ///
    /// # Errors
    /// [`LocatorFault::BadNumber`] unless finite and `good`; [`LocatorFault::TooSmall`] near a forbidden 0.
    pub fn check_numbers(
        what: &'static str,
        numbers: impl IntoIterator<Item = impl Borrow<f64>>,
        good: impl Fn(f64) -> bool,
        bound: &'static str,
    ) -> Result<(), Self> {
        let least = if good(0.0) { 0.0 } else { Self::LEAST };
        for (i, value) in numbers.into_iter().enumerate() {
            let (number, value) = (i + 1, *value.borrow());
            if !(value.is_finite() && good(value)) {
                return Err(Self::BadNumber { what, number, value, bound });
            }
            if value.abs() < least {
                return Err(Self::TooSmall { what, number, value });
            }
        }
        Ok(())
    }
}
