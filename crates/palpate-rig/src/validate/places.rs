//! Positions and grids, of sensors and of training presses alike.

use toml::Spanned;

use crate::error::{RigError, RigProblem};
use crate::value::{RawPosition, RawQuantity, count, quantity};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Dimension;

/// A position that stands at `key`, or in its list: one length on a line, a pair on a plane.
pub(super) fn place(
    key: &'static str,
    raw: &Spanned<RawPosition>,
    extent: Extent,
) -> Result<Position, RigError> {
    let plane = extent.is_plane();
    let refuse = |found| Err(RigProblem::Coordinates { key, found, plane }.at(raw.span()));
    let length = |raw: &Spanned<RawQuantity>| quantity(key, raw, Dimension::Length);
    match (raw.get_ref(), plane) {
        (RawPosition::Along(x), false) => length(&Spanned::new(raw.span(), x.clone())).map(Position::along),
        (RawPosition::Along(_), true) => refuse("a single length"),
        (RawPosition::List(_), false) => refuse("a list"),
        (RawPosition::List(list), true) => match list.as_slice() {
            [x, y] => Ok(Position { x_m: length(x)?, y_m: length(y)? }),
            [] | [_] => refuse("a list of fewer than two lengths"),
            _ => refuse("a list of more than two lengths"),
        },
    }
}

/// The same, refused beside the surface.
pub(super) fn on_surface(
    key: &'static str,
    raw: &Spanned<RawPosition>,
    extent: Extent,
) -> Result<Position, RigError> {
    let position = place(key, raw, extent)?;
    if extent.contains(position) {
        Ok(position)
    } else {
        Err(RigProblem::PlaceOffSurface { key, position, extent }.at(raw.span()))
    }
}

/// Whether a stretch or rectangle goes from left to right, and upward on a plane.
pub(super) fn in_order(from: Position, to: Position, extent: Extent) -> Result<(), RigProblem> {
    if from.x_m < to.x_m && (!extent.is_plane() || from.y_m < to.y_m) {
        Ok(())
    } else {
        Err(RigProblem::EndsBeforeItBegins { from, to, extent })
    }
}

/// Columns and rows as `grid` lists them, at most `most` places in all, which `bound` says in words.
pub(super) fn grid_sides(
    raw: &Spanned<Vec<Spanned<i64>>>,
    extent: Extent,
    most: usize,
    bound: &'static str,
) -> Result<[usize; 2], RigError> {
    if !extent.is_plane() {
        let with = "a surface that is a line; say `count`";
        return Err(RigProblem::UnusedKey { key: "grid", with }.at(raw.span()));
    }
    let refuse = |value, bound| Err(RigProblem::OutOfRange { key: "grid", value, bound }.at(raw.span()));
    let [columns, rows] = raw.get_ref().as_slice() else {
        let value = format!("a list of {}", raw.get_ref().len());
        return refuse(value, "a list of 2, columns along the length and rows across the width");
    };
    let (columns, rows) = (count("grid", columns, 1..=most, bound)?, count("grid", rows, 1..=most, bound)?);
    if columns.saturating_mul(rows) > most {
        return refuse(format!("{columns} × {rows}"), bound);
    }
    Ok([columns, rows])
}
