//! Bounds of `no_contact` that noise exceeds exactly at the false-alarm rate.

use super::FalseAlarmRate;
use super::simpson::simpson;
use palpate_numerics::{bisect, chi_squared_critical_value, chi_squared_survival, normal_cdf};
use std::f64::consts::TAU;

/// Directions f/|f| of contacts: curve length ℓ on a line; half the boundary length ℓ and area A on a plane.
///
/// Noise exceeds u along one with probability Φ(−u) + e^(−u²/2)·(ℓ/2π + A·u/(2π)^(3/2)) (S. O. Rice 1944;
/// Adler and Taylor, *Random Fields and Geometry*, 2007, chapter 14).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Directions {
    pub length: f64,
    pub area: f64,
}

impl Directions {
    fn exceeded(self, u: f64) -> f64 {
        normal_cdf(-u) + (-0.5 * u * u).exp() * (self.length / TAU + self.area * u / TAU.powf(1.5))
    }

    /// Terms of [`Directions::exceeded`] as integrals, with χ² of the remaining channels.
    fn exceeded_within(self, u: f64, square: f64, channels: usize) -> f64 {
        const STEPS: usize = 64;
        let most = square.sqrt();
        if u >= most {
            return 0.0;
        }
        let below = |value: f64, freedom: usize| 1.0 - chi_squared_survival(value.max(0.0), freedom);
        let density = |z: f64| {
            let (bell, rest) = ((-0.5 * z * z).exp(), square - z * z);
            let along = below(rest, channels.saturating_sub(1)) / TAU.sqrt();
            let across = self.area * (z * z - 1.0) * below(rest, channels.saturating_sub(3)) / TAU.powf(1.5);
            bell * (along + across)
        };
        let integral = simpson((u, most), STEPS, density);
        integral + self.length / TAU * (-0.5 * u * u).exp() * below(square - u * u, channels)
    }
}

/// Bounds on |d|² and its reduction, exceeded equally often, and one of them at the false-alarm rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoiseBounds {
    pub square: f64,
    pub taken: f64,
}

impl NoiseBounds {
    pub fn new(channels: usize, directions: Directions, rate: FalseAlarmRate) -> Self {
        let of_tail = |tail: f64| {
            let u = bisect((0.0, 20.0), 50, |u| directions.exceeded(u) > tail);
            (u, chi_squared_critical_value(tail, channels.max(1)))
        };
        let is_rarer = |tail: f64| {
            let (u, square) = of_tail(tail);
            tail + directions.exceeded_within(u, square, channels) < rate.share()
        };
        let (u, square) = of_tail(bisect((0.5 * rate.share(), rate.share()), 20, is_rarer));
        Self { square, taken: u * u }
    }
}
