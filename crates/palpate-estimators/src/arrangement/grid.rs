//! Grids that cover a surface: where sensors stand, where to press, where to judge.

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// Positions on a line at which an estimator is judged: 1/400 of the length apart, for the paper's beam every millimetre.
const ALONG_A_LINE: usize = 399;
/// Positions on a plane at which an estimator is judged, about; more of them along its longer side.
const ON_A_PLANE: f64 = 400.0;
/// A spacing that makes no positions, or too many.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a spacing of {every_m} m makes {count} positions; there must be at least 1 and at most {}",
    Self::MOST
)]
pub struct EveryError {
    /// The spacing, in metres.
    pub every_m: f64,
    /// How many positions it makes.
    pub count: f64,
}

impl EveryError {
    /// The most positions that a spacing may make.
    pub const MOST: f64 = 1e6;
}

/// Where an estimator is judged, all over a surface: on a line 399 positions, 1/400 of the length apart; on a plane about
/// 400, in the middles of equal cells that are as square as they can be, so that a share of them is a share of the area.
pub fn all_over(extent: Extent) -> Vec<Position> {
    let Some(width_m) = extent.width_m else { return inner_grid(extent, ALONG_A_LINE, 1) };
    let side = |ratio: f64| (ON_A_PLANE * ratio).sqrt().round().clamp(2.0, 0.5 * ON_A_PLANE) as usize;
    cells(extent, side(extent.length_m / width_m), side(width_m / extent.length_m))
}

/// Positions `every_m` (metres) apart, the first of them `every_m` from the edge, and none on an edge; on a plane row by
/// row.
///
/// # Errors
/// [`EveryError`] where those are none or more than 1,000,000.
pub fn every(extent: Extent, every_m: f64) -> Result<Vec<Position>, EveryError> {
    let inside = |size_m: f64| (size_m / every_m - 1e-6).floor().max(0.0);
    let (columns, rows) = (inside(extent.length_m), extent.width_m.map_or(1.0, inside));
    let count = columns * rows;
    if !(1.0..=EveryError::MOST).contains(&count) {
        return Err(EveryError { every_m, count });
    }
    let at = |i: usize| (i + 1) as f64 * every_m;
    Ok(rows_of(extent, columns as usize, rows as usize, at, at))
}

/// The middles of equal cells: x_i = (i + ½)·length/columns, and y_j = (j + ½)·width/rows on a plane.
pub fn cells(extent: Extent, columns: usize, rows: usize) -> Vec<Position> {
    let middle = |i: usize, size_m: f64, count: usize| (i as f64 + 0.5) * size_m / count as f64;
    let (length_m, width_m) = (extent.length_m, extent.width_m.unwrap_or(0.0));
    rows_of(extent, columns, rows, |i| middle(i, length_m, columns), |j| middle(j, width_m, rows))
}

/// The same middles with every coordinate, as a share u of its side, moved to `warp`(u): x_i = length·warp((i + ½)/columns).
pub fn warped_cells(extent: Extent, columns: usize, rows: usize, warp: impl Fn(f64) -> f64) -> Vec<Position> {
    let middle = |i: usize, size_m: f64, count: usize| size_m * warp((i as f64 + 0.5) / count as f64);
    let (length_m, width_m) = (extent.length_m, extent.width_m.unwrap_or(0.0));
    rows_of(extent, columns, rows, |i| middle(i, length_m, columns), |j| middle(j, width_m, rows))
}

/// (1 − cos πu)/2, which takes even shares to Chebyshev's: dense towards both ends.
pub fn chebyshev(share: f64) -> f64 {
    0.5 * (1.0 - (std::f64::consts::PI * share).cos())
}

/// The grid of `count` positions whose cells are the closest to squares: columns and rows.
pub fn squarest(extent: Extent, count: usize) -> (usize, usize) {
    let Some(width_m) = extent.width_m else { return (count, 1) };
    let elongation = |columns: usize| {
        let (columns, rows) = (columns as f64, (count / columns) as f64);
        ((extent.length_m / columns) / (width_m / rows)).ln().abs()
    };
    let columns = (1..=count)
        .filter(|columns| count.is_multiple_of(*columns))
        .min_by(|a, b| elongation(*a).total_cmp(&elongation(*b)))
        .unwrap_or(count);
    (columns, count / columns)
}

/// The inner crossings of a grid: x_i = i·length/(columns + 1) from i = 1, and y_j = j·width/(rows + 1) on a plane.
pub fn inner_grid(extent: Extent, columns: usize, rows: usize) -> Vec<Position> {
    let crossing = |i: usize, size_m: f64, count: usize| (i + 1) as f64 / (count + 1) as f64 * size_m;
    let (length_m, width_m) = (extent.length_m, extent.width_m.unwrap_or(0.0));
    rows_of(extent, columns, rows, |i| crossing(i, length_m, columns), |j| crossing(j, width_m, rows))
}

/// Rows of positions, one above the other; a line has one row, at 0.
fn rows_of(
    extent: Extent,
    columns: usize,
    rows: usize,
    x_m: impl Fn(usize) -> f64,
    y_m: impl Fn(usize) -> f64,
) -> Vec<Position> {
    let rows = if extent.is_plane() { rows } else { 1 };
    let mut positions = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        let y_m = if extent.is_plane() { y_m(row) } else { 0.0 };
        positions.extend((0..columns).map(|column| Position { x_m: x_m(column), y_m }));
    }
    positions
}
