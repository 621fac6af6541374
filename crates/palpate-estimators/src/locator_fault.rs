//! Faults of a locator's numbers, as a file may have them.

use std::borrow::Borrow;

/// A locator with inconsistent numbers.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LocatorFault {
    /// A list has the wrong length.
    #[error("the locator has {found} {what}; it must have {needed}")]
    Count {
        /// Name of the list's elements.
        what: &'static str,
        /// Length that the rest of the locator requires.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// A number that is infinite, not a number, or beyond its bound.
    #[error("the locator's {what} number {number} is {value:?}; it must be {bound}")]
    BadNumber {
        /// Name of the list's elements.
        what: &'static str,
        /// Which one, from 1.
        number: usize,
        /// The number.
        value: f64,
        /// Bound of the number, in words.
        bound: &'static str,
    },
    /// A divisor that is hardly more than 0.
    #[error(
        "the locator's {what} number {number} is {value:?}; it must be at least {:e}",
        LocatorFault::LEAST
    )]
    TooSmall {
        /// Name of the list's elements.
        what: &'static str,
        /// Which one, from 1.
        number: usize,
        /// The number.
        value: f64,
    },
}

impl LocatorFault {
    /// Least size of a number that must not be 0: its inverse and the square of that are numbers.
    pub const LEAST: f64 = 1e-60;

    /// The number that is at fault, or the count that was found.
    pub fn value(&self) -> f64 {
        match self {
            Self::Count { found, .. } => *found as f64,
            Self::BadNumber { value, .. } | Self::TooSmall { value, .. } => *value,
        }
    }

    /// Checks the length of a list.
    ///
    /// # Errors
    /// [`LocatorFault::Count`] when `found` is not `needed`.
    pub fn check_count(what: &'static str, needed: usize, found: usize) -> Result<(), Self> {
        if needed == found { Ok(()) } else { Err(Self::Count { what, needed, found }) }
    }

    /// Checks the numbers of a list.
    ///
    /// # Errors
    /// [`LocatorFault::BadNumber`] for the first number that is not finite or not `good`, and [`LocatorFault::TooSmall`] for a number
    /// hardly more than 0 where 0 is not good.
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
