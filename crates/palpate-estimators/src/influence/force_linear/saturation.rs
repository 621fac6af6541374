//! Saturation of readings at large forces.
//!
//! A deviation x proportional to the force is read as y = x/(1 + s/(1 − s)·|x|/X), the hyperbolic law of a
//! Langmuir isotherm and of resistive foams. All channels share s, the relative shortfall of the largest
//! deviation X. With Y = (1 − s)·X the inverse is x = y/(1 − s·|y|/Y), with a tangent beyond Y.

use serde::{Deserialize, Serialize};

/// Saturation of the channels in use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Saturation {
    /// s, from 0 to below 1.
    pub share: f64,
    /// Y of each channel.
    pub ranges: Vec<f64>,
}

impl Saturation {
    /// x of a deviation y.
    pub fn linearized(&self, channel: usize, deviation: f64) -> f64 {
        let range = self.ranges[channel];
        let within = deviation.abs().min(range);
        let linear = within / (1.0 - self.share * within / range);
        deviation.signum() * (linear + (deviation.abs() - within) * self.slope(channel, within))
    }

    /// dx/dy.
    pub fn slope(&self, channel: usize, deviation: f64) -> f64 {
        let range = self.ranges[channel];
        (1.0 - self.share * deviation.abs().min(range) / range).powi(-2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SATURATION: Saturation = Saturation { share: 0.2, ranges: Vec::new() };

    fn saturation() -> Saturation {
        Saturation { ranges: vec![4.0], ..SATURATION }
    }

    #[test]
    fn linearizes_the_hyperbolic_law() {
        let largest = 4.0 / 0.8;
        for x in [-5.0, -1.0, 0.0, 0.3, 2.5, 5.0] {
            let y = x / (1.0 + 0.25 * f64::abs(x) / largest);
            assert!((saturation().linearized(0, y) - x).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn slope_is_the_derivative_within_the_range_and_beyond() {
        for y in [-6.0, -4.5, -3.0, 0.5, 3.9, 4.1, 9.0] {
            let at = |y: f64| saturation().linearized(0, y);
            let difference = (at(y + 1e-5) - at(y - 1e-5)) / 2e-5;
            assert!((difference - saturation().slope(0, y)).abs() < 1e-8, "{y}");
        }
    }
}
