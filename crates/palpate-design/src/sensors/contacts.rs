//! The contacts that a design is for.

use crate::sensors::ContactPrior;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// Contact positions, and how often the surface is touched there.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightedContacts {
    /// Where; on a line from left to right, on a plane row by row from the lower left.
    pub positions: Vec<Position>,
    /// The share of contacts there, as many; their sum is 1.
    pub weights: Vec<f64>,
}

impl WeightedContacts {
    /// The positions of a prior that lie on the surface, with the share of each; those that are never touched are left out.
    pub fn of(prior: &ContactPrior, extent: Extent) -> Self {
        let along = |from_m: f64, to_m: f64| {
            // A rounding error must not cost the last one.
            let steps = ((to_m - from_m) / prior.every_m + 1e-6).floor().max(0.0) as usize;
            (0..=steps).map(move |i| from_m + i as f64 * prior.every_m)
        };
        let across = if extent.is_plane() { along(prior.from.y_m, prior.to.y_m) } else { along(0.0, 0.0) };
        let row = |y_m: f64| along(prior.from.x_m, prior.to.x_m).map(move |x_m| Position { x_m, y_m });
        let length_m = prior.to.x_m - prior.from.x_m;
        let weight = |position: &Position| {
            let stretches = prior.weights.len();
            let at = (position.x_m - prior.from.x_m) / length_m * stretches as f64;
            let stretch = (at.max(0.0) as usize).min(stretches.saturating_sub(1));
            prior.weights.get(stretch).copied().unwrap_or(1.0)
        };
        let touched: Vec<(Position, f64)> = across
            .flat_map(row)
            .map(|position| (position, weight(&position)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect();
        let sum: f64 = touched.iter().map(|(_, weight)| weight).sum();
        let (positions, weights): (Vec<_>, Vec<_>) = touched.into_iter().unzip();
        Self { positions, weights: weights.iter().map(|weight| weight / sum).collect() }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The weighted mean of a figure of each position.
    pub fn mean(&self, figures: impl IntoIterator<Item = f64>) -> f64 {
        self.weights.iter().zip(figures).map(|(weight, figure)| weight * figure).sum()
    }
}
