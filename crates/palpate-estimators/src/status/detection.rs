//! Probability of detecting a contact.

use super::simpson::simpson;
use palpate_numerics::{bisect, chi_squared_survival};
use std::f64::consts::TAU;

/// Detection bounds for channels of unit noise.
///
/// Symbols: d whitened reading, n channels, k unknowns, s signal-to-noise ratio, B bound on |d|², C bound on
/// its reduction.
///
/// Nearby contacts span k dimensions, so the best one reduces |d|² = u + w by u = (s + z)² + v, with
/// independent z normal, v χ² of k − 1 and w χ² of n − k degrees of freedom. To first order a contact is
/// missed for u ≤ C and u + w ≤ B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Detection {
    /// n.
    pub channels: usize,
    /// k.
    pub unknowns: usize,
    /// B.
    pub square: f64,
    /// C.
    pub taken: f64,
}

impl Detection {
    pub fn probability(&self, signal: f64) -> f64 {
        const STEPS: usize = 80;
        const FAR: f64 = 7.0;
        let Self { channels, unknowns, square, taken } = *self;
        let tangents = unknowns.min(channels).saturating_sub(1);
        let rest = channels.saturating_sub(unknowns);
        let below = |value: f64| if value < 0.0 { 0.0 } else { 1.0 - chi_squared_survival(value, rest) };
        let normal = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
        // Probability of a miss for a component x = s + z along the contact, integrated over the length y of
        // the component along the tangents.
        let missed = |x: f64| {
            let room = (taken - x * x).max(0.0);
            match tangents {
                0 => below(square - x * x),
                _ => {
                    let density = |y: f64| {
                        let power = if tangents == 1 { 2.0 } else { y * TAU.sqrt() };
                        power * normal(y) * below(square - x * x - y * y)
                    };
                    simpson((0.0, room.sqrt().min(FAR)), STEPS, density)
                }
            }
        };
        let (from, to) = ((-taken.sqrt()).max(signal - FAR), taken.sqrt().min(signal + FAR));
        if from >= to {
            return 1.0;
        }
        1.0 - simpson((from, to), STEPS, |x| normal(x - signal) * missed(x))
    }

    pub fn signal(&self, probability: f64) -> f64 {
        let most = self.taken.sqrt() + self.square.sqrt() + 10.0;
        bisect((0.0, most), 40, |signal| self.probability(signal) < probability)
    }
}
