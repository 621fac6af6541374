//! Checks of bounds.

/// Error of a number out of range.
///
/// ```
/// use palpate_numerics::OutOfRange;
///
/// let refused = OutOfRange::check_positive([("the length", 0.4), ("the width", -0.04)]).unwrap_err();
/// assert_eq!(refused.to_string(), "the width is -0.04; it must be greater than 0 and finite");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{quantity} is {value}; it must be {bound}")]
pub struct OutOfRange {
    /// Name of the number.
    pub quantity: &'static str,
    /// Value.
    pub value: f64,
    /// Bound.
    pub bound: &'static str,
}

impl OutOfRange {
    /// Checks for positive, finite numbers.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check_positive(numbers: impl IntoIterator<Item = (&'static str, f64)>) -> Result<(), Self> {
        Self::check("greater than 0 and finite", numbers, |value| value > 0.0 && value.is_finite())
    }

    /// Checks for non-negative, finite numbers.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check_not_negative(numbers: impl IntoIterator<Item = (&'static str, f64)>) -> Result<(), Self> {
        Self::check("at least 0 and finite", numbers, |value| value >= 0.0 && value.is_finite())
    }

    /// Checks for `good` numbers; `bound` describes them.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check(
        bound: &'static str,
        numbers: impl IntoIterator<Item = (&'static str, f64)>,
        good: impl Fn(f64) -> bool,
    ) -> Result<(), Self> {
        let wrong = numbers.into_iter().find(|(_, value)| !good(*value));
        wrong.map_or(Ok(()), |(what, value)| Err(Self { quantity: what, value, bound }))
    }
}
