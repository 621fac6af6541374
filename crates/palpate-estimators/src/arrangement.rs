//! Rules that place training positions.

use palpate_mechanics::contact::{OffSurface, Position};
use palpate_mechanics::surface::Extent;

/// Rule that places training positions.
#[derive(Clone, Debug, PartialEq)]
pub enum Arrangement {
    /// a_i = (i + ½)·l/n for i = 0…n−1 (sets 1 to 3 of the founding paper's Table 1).
    Even,
    /// a_i = s + i·(e − s)/(n − 1) for i = 0…n−1; one position lies in the middle.
    EvenOver {
        /// Start s and end e, 0 ≤ start < end ≤ 1.
        portion: (f64, f64),
    },
    /// Denser towards the edges (the founding paper's Table 3).
    ///
    /// `middle` positions are equally spaced over the portion with its ends. Each edge of length d has k = (n
    /// − `middle`)/2 positions, at pitch d/(k + 1) from the support.
    EdgeDense {
        /// Positions in the middle portion; at least 2.
        middle: usize,
        /// Start and end, 0 < start < end < 1.
        portion: (f64, f64),
    },
    /// Chebyshev nodes: a_i = l·(1 − cos(π·(i + ½)/n))/2 for i = 0…n−1.
    Chebyshev,
    /// Cell centres: x_i = (i + ½)·length/columns, y_j = (j + ½)·width/rows.
    Grid {
        /// Positions along the length.
        columns: usize,
        /// Positions across the width.
        rows: usize,
    },
    /// Listed positions.
    Explicit(Vec<Position>),
}

/// Invalid arrangement.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArrangementError {
    /// No positions.
    #[error("0 training positions; at least 1 is needed")]
    NoPositions,
    /// Fewer than 2 positions in the middle portion.
    #[error("{middle} training positions in the middle portion; at least 2 are needed, its ends")]
    MiddleTooSmall {
        /// Positions in the middle portion.
        middle: usize,
    },
    /// Fewer positions than the middle portion needs.
    #[error(
        "{count} training positions, but {middle} of them in the middle portion; at least {middle} are needed"
    )]
    FewerThanMiddle {
        /// Number of positions.
        count: usize,
        /// Positions in the middle portion.
        middle: usize,
    },
    /// Odd number of positions for the two edges.
    #[error(
        "{count} training positions with {middle} in the middle portion leave {} for two edges; the rest must be even",
        count.saturating_sub(*middle)
    )]
    UnevenEdges {
        /// Number of positions.
        count: usize,
        /// Positions in the middle portion.
        middle: usize,
    },
    /// Middle portion that is empty or reaches a support.
    #[error(
        "the middle portion goes from {start} to {end} of the length; it must satisfy 0 < start < end < 1"
    )]
    Portion {
        /// Start.
        start: f64,
        /// End.
        end: f64,
    },
    /// Invalid portion.
    #[error("the portion goes from {start} to {end} of the length; it must satisfy 0 ≤ start < end ≤ 1")]
    EvenPortion {
        /// Start.
        start: f64,
        /// End.
        end: f64,
    },
    /// Wrong number of listed positions.
    #[error("{listed} training positions are listed, but their count is given as {count}")]
    CountDiffers {
        /// Listed positions.
        listed: usize,
        /// Given count.
        count: usize,
    },
    /// Position off the surface.
    #[error(transparent)]
    OffSurface(#[from] OffSurface),
    /// Rule along a line on a plane.
    #[error(
        "{count} training positions along a line do not define positions on a plane; a plane needs a grid"
    )]
    LineOnPlane {
        /// Number of positions.
        count: usize,
    },
    /// Grid on a line.
    #[error("a grid of {columns} × {rows} training positions needs a plane; this surface is a line")]
    GridOnLine {
        /// Positions along the length.
        columns: usize,
        /// Positions across the width.
        rows: usize,
    },
}

impl Arrangement {
    /// Middle portion of the founding paper: 100 to 300 of 400 mm.
    pub const PAPER_PORTION: (f64, f64) = (0.25, 0.75);

    /// Returns `count` positions: from left to right, on a plane row by row, listed ones in their order.
    ///
    /// ```
    /// use palpate_estimators::arrangement::Arrangement;
    /// use palpate_mechanics::surface::Extent;
    /// use palpate_mechanics::units::mm;
    ///
    /// let dense = Arrangement::EdgeDense { middle: 4, portion: Arrangement::PAPER_PORTION };
    /// let positions = dense.positions(10, Extent::line(mm(400.0))?)?;
    /// assert!((positions[0].x_m - mm(25.0)).abs() < 1e-12 && (positions[3].x_m - mm(100.0)).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ArrangementError`] where the rule cannot place them.
    pub fn positions(&self, count: usize, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
        if count == 0 {
            return Err(ArrangementError::NoPositions);
        }
        match (self, extent) {
            (Self::Explicit(positions), _) => explicit(positions, count, extent),
            (&Self::Grid { columns, rows }, Extent::Plane { .. }) => grid(count, columns, rows, extent),
            (&Self::Grid { columns, rows }, Extent::Line { .. }) => {
                Err(ArrangementError::GridOnLine { columns, rows })
            }
            (_, Extent::Plane { .. }) => Err(ArrangementError::LineOnPlane { count }),
            (Self::Even, _) => Ok(cells(extent, count, 1)),
            (Self::Chebyshev, _) => Ok(warped_cells(extent, count, 1, chebyshev)),
            (Self::EvenOver { portion }, Extent::Line { .. }) => {
                even_over(count, *portion, extent.length_m())
            }
            (Self::EdgeDense { middle, portion }, Extent::Line { .. }) => {
                edge_dense(count, *middle, *portion, extent.length_m())
            }
        }
    }
}

fn even_over(
    count: usize,
    (start, end): (f64, f64),
    length_m: f64,
) -> Result<Vec<Position>, ArrangementError> {
    if !(0.0 <= start && start < end && end <= 1.0) {
        return Err(ArrangementError::EvenPortion { start, end });
    }
    let share = |i: usize| if count == 1 { 0.5 } else { i as f64 / (count - 1) as f64 };
    Ok((0..count).map(|i| Position::along((start + share(i) * (end - start)) * length_m)).collect())
}

fn edge_dense(
    count: usize,
    middle: usize,
    (start, end): (f64, f64),
    length_m: f64,
) -> Result<Vec<Position>, ArrangementError> {
    if middle < 2 {
        return Err(ArrangementError::MiddleTooSmall { middle });
    }
    if !(0.0 < start && start < end && end < 1.0) {
        return Err(ArrangementError::Portion { start, end });
    }
    if count < middle {
        return Err(ArrangementError::FewerThanMiddle { count, middle });
    }
    if !(count - middle).is_multiple_of(2) {
        return Err(ArrangementError::UnevenEdges { count, middle });
    }
    let edge = (count - middle) / 2;
    let left_pitch_m = start * length_m / (edge + 1) as f64;
    let right_pitch_m = (1.0 - end) * length_m / (edge + 1) as f64;
    let middle_pitch_m = (end - start) * length_m / (middle - 1) as f64;
    let left = (1..=edge).map(|i| Position::along(i as f64 * left_pitch_m));
    let centre = (0..middle).map(|i| Position::along(start * length_m + i as f64 * middle_pitch_m));
    let right = (1..=edge).rev().map(|i| Position::along(length_m - i as f64 * right_pitch_m));
    Ok(left.chain(centre).chain(right).collect())
}

fn grid(
    count: usize,
    columns: usize,
    rows: usize,
    extent: Extent,
) -> Result<Vec<Position>, ArrangementError> {
    let listed = columns.saturating_mul(rows);
    if listed != count {
        return Err(ArrangementError::CountDiffers { listed, count });
    }
    Ok(cells(extent, columns, rows))
}

fn explicit(positions: &[Position], count: usize, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
    if positions.len() != count {
        return Err(ArrangementError::CountDiffers { listed: positions.len(), count });
    }
    OffSurface::check("training position", positions, extent)?;
    Ok(positions.to_vec())
}

/// Training positions and the presses at them.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// Rule of the positions.
    pub arrangement: Arrangement,
    /// Number of positions; at least 1.
    pub count: usize,
    /// Presses at each position; at least 1.
    pub repeats: usize,
    /// Force of the presses; `None` for the contact's force.
    pub force_n: Option<f64>,
    /// Standard deviation of the pressed position in each direction.
    pub placement_sd_m: Option<f64>,
}

impl Training {
    /// Returns `count` positions with one press each.
    ///
    /// ```
    /// use palpate_estimators::arrangement::{Arrangement, Training};
    /// use palpate_mechanics::units::newtons;
    ///
    /// let training = Training::new(Arrangement::Even, 10).repeated(5).with_force(newtons(3.0));
    /// ```
    pub const fn new(arrangement: Arrangement, count: usize) -> Self {
        Self { arrangement, count, repeats: 1, force_n: None, placement_sd_m: None }
    }

    /// Returns `count` equally spaced positions along the length.
    pub const fn even(count: usize) -> Self {
        Self::new(Arrangement::Even, count)
    }

    /// Returns the centres of columns × rows cells of a plane.
    pub const fn grid(columns: usize, rows: usize) -> Self {
        Self::new(Arrangement::Grid { columns, rows }, columns * rows)
    }

    /// Sets the presses at each position; at least 1.
    #[must_use]
    pub fn repeated(self, repeats: usize) -> Self {
        Self { repeats: repeats.max(1), ..self }
    }

    /// Sets the force of the presses in newtons.
    #[must_use]
    pub fn with_force(self, force_n: f64) -> Self {
        Self { force_n: Some(force_n), ..self }
    }

    /// Sets the standard deviation of the pressed position in each direction.
    #[must_use]
    pub fn with_placement(self, sd_m: f64) -> Self {
        Self { placement_sd_m: Some(sd_m), ..self }
    }

    /// Returns each position once.
    ///
    /// # Errors
    /// [`ArrangementError`] where the rule cannot place them.
    pub fn positions(&self, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
        self.arrangement.positions(self.count, extent)
    }
}

const ALONG_A_LINE: usize = 399;
const ON_A_PLANE: f64 = 400.0;

/// Spacing that gives no positions or too many.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a spacing of {every_m} m makes {count} positions; there must be at least 1 and at most {}",
    Self::MOST
)]
pub struct EveryError {
    /// Spacing.
    pub every_m: f64,
    /// Number of positions.
    pub count: f64,
}

impl EveryError {
    /// Upper limit of the number of positions.
    pub const MOST: f64 = 1e6;
}

/// Returns 399 positions 1/400 of the length apart, or about 400 centres of nearly square equal cells.
pub fn all_over(extent: Extent) -> Vec<Position> {
    let Some(width_m) = extent.width_m() else { return inner_grid(extent, ALONG_A_LINE, 1) };
    let side = |ratio: f64| (ON_A_PLANE * ratio).sqrt().round().clamp(2.0, 0.5 * ON_A_PLANE) as usize;
    cells(extent, side(extent.length_m() / width_m), side(width_m / extent.length_m()))
}

/// Returns inner positions at multiples of `every_m`, on a plane row by row.
///
/// # Errors
/// [`EveryError`] for no positions, or more than 1,000,000.
pub fn every(extent: Extent, every_m: f64) -> Result<Vec<Position>, EveryError> {
    let inside = |size_m: f64| (size_m / every_m - 1e-6).floor().max(0.0);
    let (columns, rows) = (inside(extent.length_m()), extent.width_m().map_or(1.0, inside));
    let count = columns * rows;
    if !(1.0..=EveryError::MOST).contains(&count) {
        return Err(EveryError { every_m, count });
    }
    Ok(rows_of(extent, columns as usize, rows as usize, |i, _, _| (i + 1) as f64 * every_m))
}

/// Returns cell centres x_i = (i + ½)·length/columns, y_j = (j + ½)·width/rows.
pub fn cells(extent: Extent, columns: usize, rows: usize) -> Vec<Position> {
    rows_of(extent, columns, rows, |i, count, size_m| (i as f64 + 0.5) * size_m / count as f64)
}

/// Returns warped cell centres x_i = length·warp((i + ½)/columns), y_j alike.
pub fn warped_cells(extent: Extent, columns: usize, rows: usize, warp: impl Fn(f64) -> f64) -> Vec<Position> {
    rows_of(extent, columns, rows, |i, count, size_m| size_m * warp((i as f64 + 0.5) / count as f64))
}

/// Returns (1 − cos πu)/2, from equal shares to Chebyshev nodes.
pub fn chebyshev(share: f64) -> f64 {
    0.5 * (1.0 - (std::f64::consts::PI * share).cos())
}

/// Returns columns and rows of `count` nearly square cells.
pub fn squarest(extent: Extent, count: usize) -> (usize, usize) {
    let Some(width_m) = extent.width_m() else { return (count, 1) };
    let elongation = |columns: usize| {
        let (columns, rows) = (columns as f64, (count / columns) as f64);
        ((extent.length_m() / columns) / (width_m / rows)).ln().abs()
    };
    let columns = (1..=count)
        .filter(|columns| count.is_multiple_of(*columns))
        .min_by(|a, b| elongation(*a).total_cmp(&elongation(*b)))
        .unwrap_or(count);
    (columns, count / columns)
}

/// Returns inner grid nodes x_i = i·length/(columns + 1), y_j = j·width/(rows + 1).
pub fn inner_grid(extent: Extent, columns: usize, rows: usize) -> Vec<Position> {
    rows_of(extent, columns, rows, |i, count, size_m| (i + 1) as f64 / (count + 1) as f64 * size_m)
}

fn rows_of(
    extent: Extent,
    columns: usize,
    rows: usize,
    place: impl Fn(usize, usize, f64) -> f64,
) -> Vec<Position> {
    let x_m = |i: usize| place(i, columns, extent.length_m());
    let row = |y_m: f64| (0..columns).map(move |i| Position { x_m: x_m(i), y_m });
    match extent.width_m() {
        None => row(0.0).collect(),
        Some(width_m) => (0..rows).flat_map(|j| row(place(j, rows, width_m))).collect(),
    }
}

#[cfg(test)]
mod tests;
