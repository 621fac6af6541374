//! Numbers of a design, checked against their bounds.

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::OutOfRange;

/// Checks that a number of things is no more than fit into memory.
pub(crate) fn check_count(what: &'static str, count: f64) -> Result<(), OutOfRange> {
    OutOfRange::check("at most 1,000,000", [(what, count)], |count| count <= 1e6)
}

/// Checks that positions lie on a surface.
pub(crate) fn check_positions(
    what: &'static str,
    positions: impl IntoIterator<Item = Position>,
    extent: Extent,
) -> Result<(), OutOfRange> {
    let outside = positions.into_iter().find(|position| !extent.contains(*position));
    let beyond = |at: Position| {
        let along = extent.contains(Position { y_m: 0.0, ..at });
        OutOfRange { what, value: if along { at.y_m } else { at.x_m }, bound: "on the surface" }
    };
    outside.map_or(Ok(()), |at| Err(beyond(at)))
}
