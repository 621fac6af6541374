//! Rules that place the training positions.

mod grid;
mod training;

pub use grid::{EveryError, all_over, every};
pub use grid::{cells, chebyshev, inner_grid, squarest, warped_cells};
pub use training::Training;

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// Where a surface is pressed to calibrate it.
#[derive(Clone, Debug, PartialEq)]
pub enum Arrangement {
    /// Equally spaced: a_i = (i + ½)·l/n for i = 0…n−1 (sets 1 to 3 of the founding paper's Table 1).
    Even,
    /// Equally spaced over a portion of the length, its ends included: a_i = s + i·(e − s)/(n − 1) for i = 0…n−1; a single one lies
    /// in the middle.
    EvenOver {
        /// Start s and end e of the portion as shares of the length; 0 ≤ start < end ≤ 1.
        portion: (f64, f64),
    },
    /// Fewer positions in the middle portion and more towards the edges (the founding paper's Table 3).
    ///
    /// The `middle` ones are equally spaced over the portion, its ends included. The other n − `middle` split evenly over
    /// both edges, at pitch d/(k + 1) from the support, where d is the edge's length and k = (n − `middle`)/2.
    EdgeDense {
        /// How many lie in the middle portion; at least 2.
        middle: usize,
        /// Start and end of the middle portion as shares of the length; 0 < start < end < 1.
        portion: (f64, f64),
    },
    /// At Chebyshev's nodes, dense towards both ends: a_i = l·(1 − cos(π·(i + ½)/n))/2 for i = 0…n−1.
    Chebyshev,
    /// In the middles of equal cells of a plane: x_i = (i + ½)·length/columns and y_j = (j + ½)·width/rows.
    Grid {
        /// Positions along the length.
        columns: usize,
        /// Positions across the width.
        rows: usize,
    },
    /// These positions.
    Explicit(Vec<Position>),
}

/// Why an arrangement cannot be laid out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArrangementError {
    /// There are no positions.
    #[error("0 training positions; at least 1 is needed")]
    NoPositions,
    /// The middle portion holds fewer than its two ends.
    #[error("{middle} training positions in the middle portion; at least 2 are needed, its ends")]
    MiddleTooSmall {
        /// How many were to lie in the middle portion.
        middle: usize,
    },
    /// There are fewer positions than the middle portion alone wants.
    #[error(
        "{count} training positions, but {middle} of them in the middle portion; at least {middle} are needed"
    )]
    FewerThanMiddle {
        /// How many positions there are.
        count: usize,
        /// How many were to lie in the middle portion.
        middle: usize,
    },
    /// What the middle portion leaves is odd.
    #[error(
        "{count} training positions with {middle} in the middle portion leave {} for two edges; the rest must be even",
        count.saturating_sub(*middle)
    )]
    UnevenEdges {
        /// How many positions there are.
        count: usize,
        /// How many lie in the middle portion.
        middle: usize,
    },
    /// The middle portion is empty or reaches a support.
    #[error("the middle portion goes from {start} to {end} of the length; 0 < start < end < 1 must hold")]
    Portion {
        /// Its start, as a share of the length.
        start: f64,
        /// Its end, as a share of the length.
        end: f64,
    },
    /// The portion of even positions is empty or reaches beyond the surface.
    #[error("the portion goes from {start} to {end} of the length; 0 ≤ start < end ≤ 1 must hold")]
    EvenPortion {
        /// Its start, as a share of the length.
        start: f64,
        /// Its end, as a share of the length.
        end: f64,
    },
    /// The explicit positions are not as many as was said.
    #[error("{listed} training positions are listed, but their count is given as {count}")]
    CountDiffers {
        /// How many positions are listed.
        listed: usize,
        /// How many there were to be.
        count: usize,
    },
    /// A position does not lie on the surface.
    #[error(
        "training position {number} is at {}, off the surface; it must be within {}",
        extent.place_in_words(*position),
        extent.bounds_in_words()
    )]
    OffSurface {
        /// Which position, from 1.
        number: usize,
        /// Where it is.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// A rule along a line, on a surface that has a width as well.
    #[error(
        "{count} training positions on a line do not say where they are on a plane; a plane needs a grid"
    )]
    LineOnPlane {
        /// How many positions there are.
        count: usize,
    },
    /// A grid, on a surface without a width.
    #[error("a grid of {columns} × {rows} training positions needs a plane; this surface is a line")]
    GridOnLine {
        /// Positions along the length.
        columns: usize,
        /// Positions across the width.
        rows: usize,
    },
}

impl Arrangement {
    /// The middle portion that the founding paper uses: 100 to 300 mm of 400 mm.
    pub const PAPER_PORTION: (f64, f64) = (0.25, 0.75);

    /// Lays `count` positions out: on a line from left to right, on a plane row by row; explicit positions come in the
    /// order in which they were listed.
    ///
    /// # Errors
    /// [`ArrangementError`], with the value and the bound, where the rule cannot place that many positions.
    pub fn positions(&self, count: usize, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
        if count == 0 {
            return Err(ArrangementError::NoPositions);
        }
        match self {
            Self::Even | Self::EvenOver { .. } | Self::EdgeDense { .. } | Self::Chebyshev
                if extent.is_plane() =>
            {
                Err(ArrangementError::LineOnPlane { count })
            }
            Self::Even => Ok(cells(extent, count, 1)),
            Self::Chebyshev => Ok(warped_cells(extent, count, 1, chebyshev)),
            Self::EvenOver { portion } => even_over(count, *portion, extent.length_m),
            Self::EdgeDense { middle, portion } => edge_dense(count, *middle, *portion, extent.length_m),
            Self::Grid { columns, rows } => grid(count, *columns, *rows, extent),
            Self::Explicit(positions) => explicit(positions, count, extent),
        }
    }
}

fn at(x_m: f64) -> Position {
    Position::along(x_m)
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
    Ok((0..count).map(|i| at((start + share(i) * (end - start)) * length_m)).collect())
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
    let left = (1..=edge).map(|i| at(i as f64 * left_pitch_m));
    let centre = (0..middle).map(|i| at(start * length_m + i as f64 * middle_pitch_m));
    let right = (1..=edge).rev().map(|i| at(length_m - i as f64 * right_pitch_m));
    Ok(left.chain(centre).chain(right).collect())
}

fn grid(
    count: usize,
    columns: usize,
    rows: usize,
    extent: Extent,
) -> Result<Vec<Position>, ArrangementError> {
    if !extent.is_plane() {
        return Err(ArrangementError::GridOnLine { columns, rows });
    }
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
    match positions.iter().position(|position| !extent.contains(*position)) {
        Some(i) => Err(ArrangementError::OffSurface { number: i + 1, position: positions[i], extent }),
        None => Ok(positions.to_vec()),
    }
}

#[cfg(test)]
mod tests;
