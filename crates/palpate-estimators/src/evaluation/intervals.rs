//! Coverage and score of the 95 % intervals of a position.

use palpate_core::ContactEstimate;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;

/// Coordinates of a position within their 95 % intervals ([`Uncertainty::x_95_m`], and on planes
/// [`Uncertainty::y_95_m`]).
///
/// Each interval has its own coverage of 95 %: both of a plane contain a position in 90 % of the cases where
/// their errors are independent.
///
/// [`Uncertainty::x_95_m`]: palpate_core::Uncertainty::x_95_m
/// [`Uncertainty::y_95_m`]: palpate_core::Uncertainty::y_95_m
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoveredCoordinates {
    /// True for x in its interval.
    pub x: bool,
    /// True for y in its interval; `None` on a line.
    pub y: Option<bool>,
}

impl CoveredCoordinates {
    pub(crate) fn new(contact: &ContactEstimate, truth: Position, extent: Extent) -> Option<Self> {
        let uncertainty = contact.uncertainty?;
        let contains = |(low, high): (f64, f64), at: f64| (low..=high).contains(&at);
        Some(Self {
            x: contains(uncertainty.x_95_m, truth.x_m),
            y: extent.width_m().map(|_| contains(uncertainty.y_95_m, truth.y_m)),
        })
    }

    /// x, and on planes y.
    pub fn coordinates(self) -> impl Iterator<Item = bool> {
        [Some(self.x), self.y].into_iter().flatten()
    }

    /// True for all coordinates.
    pub fn all(self) -> bool {
        self.coordinates().all(|is_covered| is_covered)
    }

    /// Share of the coordinates: 0 or 1 on lines; 0, ½ or 1 on planes.
    pub fn share(self) -> f64 {
        mean(self.coordinates().map(f64::from))
    }
}

pub(super) fn interval_score_m(contact: &ContactEstimate, truth: Position, extent: Extent) -> Option<f64> {
    let uncertainty = contact.uncertainty?;
    let x = score_of_interval(uncertainty.x_95_m, truth.x_m);
    Some(match extent {
        Extent::Line { .. } => x,
        Extent::Plane { .. } => 0.5 * (x + score_of_interval(uncertainty.y_95_m, truth.y_m)),
    })
}

/// u − l + 2/α·(l − x)⁺ + 2/α·(x − u)⁺ for α = 0.05.
pub(super) fn score_of_interval((low, high): (f64, f64), truth: f64) -> f64 {
    const ALPHA: f64 = 0.05;
    high - low + 2.0 / ALPHA * ((low - truth).max(0.0) + (truth - high).max(0.0))
}
