//! Contacts for which a design is made.

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::OutOfRange;

/// Default number of contacts: along a line, along a plane's longer side.
const ALONG_A_LINE: f64 = 400.0;
const ALONG_A_PLANE: f64 = 30.0;

/// Prior of contact positions: a regular grid, both ends included.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPrior {
    /// The left end, or lower left corner.
    pub from: Position,
    /// The right end, or upper right corner.
    pub to: Position,
    /// Grid spacing, m; greater than 0.
    pub every_m: f64,
    /// Relative frequencies in equal sections of the length, left to right; empty if uniform.
    pub weights: Vec<f64>,
}

impl ContactPrior {
    /// Creates contacts on the whole surface without its edge.
    pub fn over_surface(extent: Extent) -> Self {
        let every_m = spacing(extent, ALONG_A_LINE, ALONG_A_PLANE);
        let last = |size_m: f64| (size_m - every_m).max(0.5 * size_m);
        let first = |size_m: f64| every_m.min(0.5 * size_m);
        Self {
            from: Position { x_m: first(extent.length_m()), y_m: extent.width_m().map_or(0.0, first) },
            to: Position { x_m: last(extent.length_m()), y_m: extent.width_m().map_or(0.0, last) },
            every_m,
            weights: Vec::new(),
        }
    }

    /// Creates uniform contacts on a line; all arguments in metres.
    pub fn along(from_m: f64, to_m: f64, every_m: f64) -> Self {
        let (from, to) = (Position::along(from_m), Position::along(to_m));
        Self { from, to, every_m, weights: Vec::new() }
    }
}

pub(crate) fn check_count(what: &'static str, count: f64) -> Result<(), OutOfRange> {
    OutOfRange::check("at most 1,000,000", [(what, count)], |count| count <= 1e6)
}

pub(crate) fn check_positions(
    what: &'static str,
    positions: impl IntoIterator<Item = Position>,
    extent: Extent,
) -> Result<(), OutOfRange> {
    let outside = positions.into_iter().find(|position| !extent.contains(*position));
    let beyond = |at: Position| {
        let along = extent.contains(Position { y_m: 0.0, ..at });
        OutOfRange { quantity: what, value: if along { at.y_m } else { at.x_m }, bound: "on the surface" }
    };
    outside.map_or(Ok(()), |at| Err(beyond(at)))
}

pub(crate) fn spacing(extent: Extent, along_a_line: f64, along_a_plane: f64) -> f64 {
    match extent.width_m() {
        None => extent.length_m() / along_a_line,
        Some(width_m) => extent.length_m().max(width_m) / along_a_plane,
    }
}

/// Contact positions and their relative frequencies.
///
/// ```
/// use palpate_design::{ContactPrior, WeightedContacts};
/// use palpate_mechanics::surface::Extent;
///
/// // Every 100 mm from 0 to 400 mm, three times as often in the right half.
/// let prior = ContactPrior { weights: vec![1.0, 3.0], ..ContactPrior::along(0.0, 0.4, 0.1) };
/// let contacts = WeightedContacts::from_prior(&prior, Extent::line(0.4)?)?;
/// assert_eq!(contacts.len(), 5);
/// assert!((contacts.weights[4] - 3.0 / 11.0).abs() < 1e-15);
/// # Ok::<(), palpate_numerics::OutOfRange>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct WeightedContacts {
    /// Positions, left to right; on a plane row by row from the lower left.
    pub positions: Vec<Position>,
    /// Shares with the sum 1.
    pub weights: Vec<f64>,
}

impl WeightedContacts {
    /// Lists the positions with a share above 0.
    ///
    /// # Errors
    /// [`OutOfRange`] for a prior off the surface or without contacts.
    pub fn from_prior(prior: &ContactPrior, extent: Extent) -> Result<Self, OutOfRange> {
        let ContactPrior { from, to, every_m, weights } = prior;
        OutOfRange::check_positive([("the distance of contacts in m", *every_m)])?;
        check_positions("an end of the contacts, in m,", [*from, *to], extent)?;
        let sizes =
            [to.x_m - from.x_m, to.y_m - from.y_m].map(|size_m| ("the range of contacts in m", size_m));
        OutOfRange::check("at least 0", sizes, |value| value >= 0.0)?;
        let count: f64 = sizes.iter().map(|(_, size_m)| size_m / every_m + 1.0).product();
        check_count("the number of contacts", count)?;
        let shares = weights.iter().map(|weight| ("a weight of contacts", *weight));
        OutOfRange::check("at least 0", shares, |value| value.is_finite() && value >= 0.0)?;
        let along = |from_m: f64, to_m: f64| {
            // A rounding error must not drop the last position.
            let steps = ((to_m - from_m) / *every_m + 1e-6).floor() as usize;
            (0..=steps).map(move |i| from_m + i as f64 * *every_m)
        };
        let weight = |position: &Position| {
            let at = (position.x_m - from.x_m) / (to.x_m - from.x_m) * weights.len() as f64;
            let stretch = (at.max(0.0) as usize).min(weights.len().saturating_sub(1));
            weights.get(stretch).copied().unwrap_or(1.0)
        };
        let touched: Vec<(Position, f64)> = along(from.y_m, to.y_m)
            .flat_map(|y_m| along(from.x_m, to.x_m).map(move |x_m| Position { x_m, y_m }))
            .map(|position| (position, weight(&position)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect();
        let sum: f64 = touched.iter().map(|(_, weight)| weight).sum();
        OutOfRange::check_positive([("the sum of the weights of contacts", sum)])?;
        let (positions, weights): (Vec<_>, Vec<_>) = touched.into_iter().unzip();
        Ok(Self { positions, weights: weights.iter().map(|weight| weight / sum).collect() })
    }

    /// Returns an even sample with normalized weights.
    #[must_use]
    pub(crate) fn sample(&self, most: usize) -> Self {
        let step = self.len().div_ceil(most);
        let share: f64 = self.weights.iter().step_by(step).sum();
        Self {
            positions: self.positions.iter().copied().step_by(step).collect(),
            weights: self.weights.iter().step_by(step).map(|weight| weight / share).collect(),
        }
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns true for zero contacts.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Returns the weighted mean of one value per position.
    pub fn mean(&self, figures: impl IntoIterator<Item = f64>) -> f64 {
        self.weights.iter().zip(figures).map(|(weight, figure)| weight * figure).sum()
    }
}
