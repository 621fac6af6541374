//! How well the influence functions are known at some places, press by press.

use ndarray::Array2;

use super::forward::Forward;
use palpate_mechanics::contact::Position;

/// Covariances of a whitened reading's function at some places.
#[derive(Clone)]
pub(super) struct Knowledge {
    covariance: Array2<f64>,
}

impl Knowledge {
    /// Before any press.
    pub fn before(forward: &Forward, places: &[Position]) -> Self {
        let covariance = Array2::from_shape_fn((places.len(), places.len()), |(a, b)| {
            forward.covariance(places[a], places[b])
        });
        Self { covariance }
    }

    /// After the mean of presses at a place, whose noise has this `variance` in units of one press's:
    /// C − c·cᵀ/(C_pp + variance), c = C's column of the place.
    pub fn press(&mut self, place: usize, variance: f64) {
        let column = self.covariance.column(place).to_owned();
        let scale = 1.0 / (column[place] + variance);
        for (mut row, c) in self.covariance.outer_iter_mut().zip(&column) {
            row.scaled_add(-scale * c, &column);
        }
    }

    /// The variance that is left at a place.
    pub fn variance(&self, place: usize) -> f64 {
        self.covariance[[place, place]].max(0.0)
    }

    /// The variance that would be left at `place` after presses at another.
    pub fn variance_after(&self, place: usize, pressed: usize, variance: f64) -> f64 {
        let c = self.covariance[[place, pressed]];
        (self.variance(place) - c * c / (self.variance(pressed) + variance)).max(0.0)
    }
}
