//! Score test for a distributed contact: two contacts or a patch.
//!
//! Contacts at a ± h, or a patch of variance h², read W·(f(a) + ½·h²·f″(a) + …). Let u be the unit direction
//! of f″ across f and f′, over the noise, and e the residual of the best point contact. Then z = e·u is
//! standard normal, and greater for h² > 0: the score of h² at 0 (C. R. Rao, Proc. Camb. Phil. Soc. 44,
//! 1948), the most powerful test of a small h. On a plane Σz² of three derivatives is χ².
//!
//! Differences in place of derivatives keep the error rate, as residuals are orthogonal to f and f′.

use crate::status::{CriticalValues, SPREAD_RATE};
use palpate_numerics::push_rest;
use palpate_numerics::small::dot;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoundedContact {
    /// Position along and across, and force.
    pub at: [f64; 3],
    /// Equal ends for a known quantity.
    pub ends: [(f64, f64); 3],
}

/// Reach of differences: short against the bends of influences, long against the nodes of a table.
const REACH: f64 = 1.0 / 32.0;
const STEP: f64 = 1e-3;
/// Least share across the other directions.
const LEAST_LEFT: f64 = 1e-3;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DistributedContactDirections {
    units: Vec<Vec<f64>>,
    is_line: bool,
}

impl DistributedContactDirections {
    /// `reads` returns the reading of a contact over the noise.
    pub fn at_contact(
        BoundedContact { at, ends }: BoundedContact,
        mut reads: impl FnMut([f64; 3]) -> Vec<f64>,
    ) -> Self {
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

    /// Squared component; on a line, 0 for the wrong sign.
    pub fn score(&self, residual: &[f64]) -> f64 {
        let along = |unit: &Vec<f64>| dot(unit, residual);
        match self.units.as_slice() {
            [unit] if self.is_line => along(unit).max(0.0).powi(2),
            units => units.iter().map(|unit| along(unit).powi(2)).sum(),
        }
    }

    pub fn on_line(self) -> Option<Vec<f64>> {
        self.units.into_iter().next().filter(|_| self.is_line)
    }
}

/// About the best point contact; `reads` as for [`DistributedContactDirections::at_contact`].
pub(crate) fn distributed_contact_score(
    about: BoundedContact,
    reading: impl IntoIterator<Item = f64>,
    mut reads: impl FnMut([f64; 3]) -> Vec<f64>,
) -> f64 {
    let residual: Vec<f64> = reading.into_iter().zip(reads(about.at)).map(|(d, f)| d - f).collect();
    DistributedContactDirections::at_contact(about, reads).score(&residual)
}

/// Critical value at [`SPREAD_RATE`].
pub(crate) fn distributed_contact_bound(dimensions: usize) -> f64 {
    // One-sided test on a line.
    static LINE: CriticalValues = CriticalValues::new(2.0 * SPREAD_RATE);
    static PLANE: CriticalValues = CriticalValues::new(SPREAD_RATE);
    if dimensions == 1 { LINE.at(1) } else { PLANE.at(3) }
}

fn combined(parts: &[(f64, Vec<f64>)]) -> Vec<f64> {
    let channels = parts.first().map_or(0, |(_, part)| part.len());
    (0..channels).map(|c| parts.iter().map(|(factor, part)| factor * part[c]).sum()).collect()
}

#[cfg(test)]
mod tests;
