//! Numbers of a design, checked against their bounds.

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// A number that is not in its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{what} is {value}; it must be {bound}")]
pub struct OutOfRange {
    /// Which number.
    pub what: &'static str,
    /// Its value.
    pub value: f64,
    /// Its bound.
    pub bound: &'static str,
}

impl OutOfRange {
    /// Checks that numbers, each with its name, are finite and greater than 0.
    pub(crate) fn check_positive<const N: usize>(numbers: [(&'static str, f64); N]) -> Result<(), Self> {
        Self::check("greater than 0", numbers, |value| value.is_finite() && value > 0.0)
    }

    /// Checks that numbers, each with its name, are `good`, as `bound` says.
    pub(crate) fn check(
        bound: &'static str,
        numbers: impl IntoIterator<Item = (&'static str, f64)>,
        good: impl Fn(f64) -> bool,
    ) -> Result<(), Self> {
        match numbers.into_iter().find(|(_, value)| !good(*value)) {
            Some((what, value)) => Err(Self { what, value, bound }),
            None => Ok(()),
        }
    }

    /// Checks that a number of things is no more than fit into memory.
    pub(crate) fn check_count(what: &'static str, count: f64) -> Result<(), Self> {
        Self::check("at most 1,000,000", [(what, count)], |count| count <= 1e6)
    }

    /// Checks that positions lie on a surface.
    pub(crate) fn check_positions(
        what: &'static str,
        positions: impl IntoIterator<Item = Position>,
        extent: Extent,
    ) -> Result<(), Self> {
        let outside = positions.into_iter().find(|position| !extent.contains(*position));
        let beyond = |at: Position| {
            let along = extent.contains(Position { y_m: 0.0, ..at });
            Self { what, value: if along { at.y_m } else { at.x_m }, bound: "on the surface" }
        };
        outside.map_or(Ok(()), |at| Err(beyond(at)))
    }
}
