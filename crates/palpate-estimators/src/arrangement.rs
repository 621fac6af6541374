//! Rules that place the training positions.

use palpate_mechanics::contact::{OffSurface, Position};
use palpate_mechanics::surface::Extent;

/// Rule that places the training positions.
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
        /// Number of positions in the middle portion; at least 2.
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

/// An arrangement that cannot be laid out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArrangementError {
    /// There are no positions.
    #[error("0 training positions; at least 1 is needed")]
    NoPositions,
    /// The middle portion holds fewer than its two ends.
    #[error("{middle} training positions in the middle portion; at least 2 are needed, its ends")]
    MiddleTooSmall {
        /// Number of positions in the middle portion.
        middle: usize,
    },
    /// There are fewer positions than the middle portion alone wants.
    #[error(
        "{count} training positions, but {middle} of them in the middle portion; at least {middle} are needed"
    )]
    FewerThanMiddle {
        /// Number of positions.
        count: usize,
        /// Number of positions in the middle portion.
        middle: usize,
    },
    /// An odd number of positions for the two edges.
    #[error(
        "{count} training positions with {middle} in the middle portion leave {} for two edges; the rest must be even",
        count.saturating_sub(*middle)
    )]
    UnevenEdges {
        /// Number of positions.
        count: usize,
        /// Number of positions in the middle portion.
        middle: usize,
    },
    /// The middle portion is empty or reaches a support.
    #[error(
        "the middle portion goes from {start} to {end} of the length; it must satisfy 0 < start < end < 1"
    )]
    Portion {
        /// Start, as a share of the length.
        start: f64,
        /// End, as a share of the length.
        end: f64,
    },
    /// The portion of even positions is empty or reaches beyond the surface.
    #[error("the portion goes from {start} to {end} of the length; it must satisfy 0 ≤ start < end ≤ 1")]
    EvenPortion {
        /// Start, as a share of the length.
        start: f64,
        /// End, as a share of the length.
        end: f64,
    },
    /// The explicit positions are not as many as was said.
    #[error("{listed} training positions are listed, but their count is given as {count}")]
    CountDiffers {
        /// Number of positions in the list.
        listed: usize,
        /// Number of positions asked for.
        count: usize,
    },
    /// A position does not lie on the surface.
    #[error(transparent)]
    OffSurface(#[from] OffSurface),
    /// A rule along a line, on a surface that has a width as well.
    #[error(
        "{count} training positions along a line do not define positions on a plane; a plane needs a grid"
    )]
    LineOnPlane {
        /// Number of positions.
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
    /// [`ArrangementError`], with the value and the bound, where the rule cannot place that many positions.
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

/// Training positions: the rule that places them, and how each is pressed.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// The rule that places them.
    pub arrangement: Arrangement,
    /// Number of positions; at least 1.
    pub count: usize,
    /// Presses at each position; at least 1.
    pub repeats: usize,
    /// The force of these presses in newtons, where it is not the contact's.
    pub force_n: Option<f64>,
    /// Standard deviation in each direction of the pressed place about the asked one, in metres, where it is known.
    pub placement_sd_m: Option<f64>,
}

impl Training {
    /// `count` positions by a rule, each pressed once with the contact's force.
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

    /// `count` equally spaced positions along the length.
    pub const fn even(count: usize) -> Self {
        Self::new(Arrangement::Even, count)
    }

    /// The middles of columns × rows equal cells of a plane.
    pub const fn grid(columns: usize, rows: usize) -> Self {
        Self::new(Arrangement::Grid { columns, rows }, columns * rows)
    }

    /// The same, each position pressed `repeats` times; at least 1.
    #[must_use]
    pub fn repeated(self, repeats: usize) -> Self {
        Self { repeats: repeats.max(1), ..self }
    }

    /// The same, pressed with this force in newtons, whatever the force of contacts in use.
    #[must_use]
    pub fn with_force(self, force_n: f64) -> Self {
        Self { force_n: Some(force_n), ..self }
    }

    /// The same, pressed by a person who misses the asked place by this standard deviation in each direction, in metres.
    #[must_use]
    pub fn with_placement(self, sd_m: f64) -> Self {
        Self { placement_sd_m: Some(sd_m), ..self }
    }

    /// The positions on a surface of this `extent`, each once.
    ///
    /// # Errors
    /// [`ArrangementError`] when the rule cannot place so many.
    pub fn positions(&self, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
        self.arrangement.positions(self.count, extent)
    }
}

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
    /// Number of positions that it makes.
    pub count: f64,
}

impl EveryError {
    /// The most positions that a spacing may make.
    pub const MOST: f64 = 1e6;
}

/// Positions at which an estimator is judged, all over a surface: on a line 399, 1/400 of the length apart; on a plane about
/// 400, in the middles of equal cells that are as square as they can be, so that a share of them is a share of the area.
pub fn all_over(extent: Extent) -> Vec<Position> {
    let Some(width_m) = extent.width_m() else { return inner_grid(extent, ALONG_A_LINE, 1) };
    let side = |ratio: f64| (ON_A_PLANE * ratio).sqrt().round().clamp(2.0, 0.5 * ON_A_PLANE) as usize;
    cells(extent, side(extent.length_m() / width_m), side(width_m / extent.length_m()))
}

/// Positions `every_m` (metres) apart, the first of them `every_m` from the edge, and none on an edge; on a plane row by
/// row.
///
/// # Errors
/// [`EveryError`] where those are none or more than 1,000,000.
pub fn every(extent: Extent, every_m: f64) -> Result<Vec<Position>, EveryError> {
    let inside = |size_m: f64| (size_m / every_m - 1e-6).floor().max(0.0);
    let (columns, rows) = (inside(extent.length_m()), extent.width_m().map_or(1.0, inside));
    let count = columns * rows;
    if !(1.0..=EveryError::MOST).contains(&count) {
        return Err(EveryError { every_m, count });
    }
    Ok(rows_of(extent, columns as usize, rows as usize, |i, _, _| (i + 1) as f64 * every_m))
}

/// The middles of equal cells: x_i = (i + ½)·length/columns, and y_j = (j + ½)·width/rows on a plane.
pub fn cells(extent: Extent, columns: usize, rows: usize) -> Vec<Position> {
    rows_of(extent, columns, rows, |i, count, size_m| (i as f64 + 0.5) * size_m / count as f64)
}

/// The same middles with every coordinate, as a share u of its side, moved to `warp`(u): x_i = length·warp((i + ½)/columns).
pub fn warped_cells(extent: Extent, columns: usize, rows: usize, warp: impl Fn(f64) -> f64) -> Vec<Position> {
    rows_of(extent, columns, rows, |i, count, size_m| size_m * warp((i as f64 + 0.5) / count as f64))
}

/// (1 − cos πu)/2, which takes even shares to Chebyshev's: dense towards both ends.
pub fn chebyshev(share: f64) -> f64 {
    0.5 * (1.0 - (std::f64::consts::PI * share).cos())
}

/// The grid of `count` positions whose cells are the closest to squares: columns and rows.
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

/// The inner crossings of a grid: x_i = i·length/(columns + 1) from i = 1, and y_j = j·width/(rows + 1) on a plane.
pub fn inner_grid(extent: Extent, columns: usize, rows: usize) -> Vec<Position> {
    rows_of(extent, columns, rows, |i, count, size_m| (i + 1) as f64 / (count + 1) as f64 * size_m)
}

/// Rows of positions, one above the other, each coordinate by its number, how many there are, and the size of its side; a line has
/// one row, at 0.
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
