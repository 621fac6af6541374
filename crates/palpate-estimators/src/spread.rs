//! Test for a distributed contact: a second contact close by, or a patch, instead of a single point.
//!
//! Two contacts at a − h and a + h, or a patch that presses with variance h² about a, read W·(f(a) + ½·h²·f″(a) + …): f influence, W total
//! force. A point contact explains the part of the change along f″ that lies along f and f′, by a greater force and a displacement. The
//! remainder has a direction u of unit length, over the noise. With the residual e of the best point contact, z = e·u is a standard normal
//! variable for a point contact, and greater where h² > 0. This is the score of h² at 0 (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948), the
//! most powerful test of a small h. χ² tests all directions, and so has less power along each. On a plane h² is a matrix of three numbers,
//! f″ are three derivatives, and Σz² along three directions is χ² of three degrees of freedom.
//!
//! A residual is at right angles to f and f′ for any u. So differences in place of derivatives, or a u of a place near by, do not increase
//! the error rate of z. They reduce its power a little.

use crate::status::SPREAD_RATE;
use palpate_numerics::small::dot;
use palpate_numerics::{chi_squared_critical_value, push_rest};
use std::sync::OnceLock;

/// Contact about which readings are expanded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct About {
    /// Position along and across, and force or another unknown of the reading.
    pub at: [f64; 3],
    /// Ends of each unknown; both ends are equal for a known quantity.
    pub ends: [(f64, f64); 3],
}

/// Share of a side over which second differences are taken on either side: short against the way over which influences bend, and long against
/// the distance between the nodes of a table.
const REACH: f64 = 1.0 / 32.0;
/// Share of the reach over which first differences are taken.
const STEP: f64 = 1e-3;
/// Least share of a direction that must lie across the others; a direction with less is omitted.
const LEAST_LEFT: f64 = 1e-3;

/// Directions of unit length along which a distributed contact changes a reading, and a point contact does not.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SpreadDirections {
    units: Vec<Vec<f64>>,
    is_line: bool,
}

impl SpreadDirections {
    /// The directions about a contact; `reads` gives the reading of a contact, channel by channel, over the noise about this one.
    pub fn about(About { at, ends }: About, mut reads: impl FnMut([f64; 3]) -> Vec<f64>) -> Self {
        let side = |k: usize| ends[k].1 - ends[k].0;
        let is_free = |k: usize| side(k) > 0.0;
        let is_line = !is_free(1);
        // Where differences to both sides stay within the ends.
        let within = |reach: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|k| at[k].max(ends[k].0 + reach[k]).min(ends[k].1 - reach[k]))
        };
        let reach = [REACH * side(0), REACH * side(1), 0.0];
        let mut basis: Vec<Vec<f64>> = Vec::new();
        for k in (0..3).filter(|k| is_free(*k)) {
            let mut step = [0.0; 3];
            step[k] = STEP * if k < 2 { reach[k] } else { at[k].abs().max(STEP * side(k).min(1.0)) };
            let from = within(step);
            let moved = |way: f64| std::array::from_fn(|i| from[i] + way * step[i]);
            let tangent = combined(&[(1.0, reads(moved(1.0))), (-1.0, reads(moved(-1.0)))]);
            push_rest(&mut basis, tangent, f64::EPSILON.sqrt());
        }
        let tangents = basis.len();
        let from = within(reach);
        let mut moved = |x: f64, y: f64| reads([from[0] + x * reach[0], from[1] + y * reach[1], at[2]]);
        let here = moved(0.0, 0.0);
        for (x, y) in [(1.0, 0.0), (0.0, 1.0)].into_iter().take(if is_line { 1 } else { 2 }) {
            let second = combined(&[(-2.0, here.clone()), (1.0, moved(x, y)), (1.0, moved(-x, -y))]);
            push_rest(&mut basis, second, LEAST_LEFT);
        }
        if !is_line {
            let corners = [(1.0, 1.0, 1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0), (1.0, -1.0, -1.0)];
            let mixed = combined(&corners.map(|(sign, x, y)| (sign, moved(x, y))));
            push_rest(&mut basis, mixed, LEAST_LEFT);
        }
        Self { units: basis.split_off(tangents), is_line }
    }

    /// The squared component of a residual along the directions. On a line, a distributed contact has only one sign; the score is 0 for the other.
    pub fn score(&self, residual: &[f64]) -> f64 {
        let along = |unit: &Vec<f64>| dot(unit, residual);
        match self.units.as_slice() {
            [unit] if self.is_line => along(unit).max(0.0).powi(2),
            units => units.iter().map(|unit| along(unit).powi(2)).sum(),
        }
    }

    /// The direction on a line; `None` where there is none.
    pub fn on_line(self) -> Option<Vec<f64>> {
        self.units.into_iter().next().filter(|_| self.is_line)
    }
}

/// Score of a reading about the contact that explains it best; `reads` as for [`SpreadDirections::about`], and the reading over the same noise.
pub(crate) fn spread_score(
    about: About,
    reading: impl IntoIterator<Item = f64>,
    mut reads: impl FnMut([f64; 3]) -> Vec<f64>,
) -> f64 {
    let residual: Vec<f64> = reading.into_iter().zip(reads(about.at)).map(|(d, f)| d - f).collect();
    SpreadDirections::about(about, reads).score(&residual)
}

/// The score that a point contact exceeds at [`SPREAD_RATE`], on a surface of so many dimensions.
pub(crate) fn spread_bound(dimensions: usize) -> f64 {
    static KNOWN: [OnceLock<f64>; 2] = [const { OnceLock::new() }; 2];
    if dimensions == 1 {
        // One-sided test.
        return *KNOWN[0].get_or_init(|| chi_squared_critical_value(2.0 * SPREAD_RATE, 1));
    }
    *KNOWN[1].get_or_init(|| chi_squared_critical_value(SPREAD_RATE, 3))
}

fn combined(parts: &[(f64, Vec<f64>)]) -> Vec<f64> {
    let channels = parts.first().map_or(0, |(_, part)| part.len());
    (0..channels).map(|c| parts.iter().map(|(factor, part)| factor * part[c]).sum()).collect()
}

#[cfg(test)]
mod tests;
