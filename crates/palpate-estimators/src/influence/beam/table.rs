//! Influence functions along a line as a table: values and slopes at evenly spaced nodes, cubic between them.

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::InfluenceFunction;
use palpate_numerics::simd::Number;
use serde::{Deserialize, Serialize};

/// Reading of every sensor per newton, with its uncertainty, as a function of the contact's position along the surface.
///
/// Between nodes the functions are cubic Hermite polynomials. Numbers are stored node by node, and within a node
/// sensor by sensor, so that all sensors of a place lie side by side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InfluenceTable {
    /// Sensors S.
    pub sensors: usize,
    /// Length of the surface in metres; nodes are at i·length/(nodes − 1).
    pub length_m: f64,
    /// Reading per newton, in the sensors' SI units or raw, nodes × S.
    pub values: Vec<f64>,
    /// Derivative of the values along the surface, per metre, nodes × S.
    pub slopes: Vec<f64>,
    /// Variance of the values, from calibrating with finitely many noisy presses, nodes × S.
    pub variances: Vec<f64>,
}

/// A place between two nodes, or several side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell<N> {
    /// The node to the left.
    pub node: N,
    /// Weights of left value, right value, left slope, right slope in the function.
    pub value: [N; 4],
    /// The same for the function's derivative.
    pub slope: [N; 4],
}

/// Evenly spaced nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spacing {
    /// Distance between nodes, in metres.
    pub h_m: f64,
    inverse_h: f64,
    /// The last node.
    last: usize,
}

impl Spacing {
    /// The cell that holds `x_m`, which is held to the surface.
    #[inline(always)]
    pub fn cell<N: Number>(&self, x_m: N) -> Cell<N> {
        let n = N::splat;
        let (h, inverse_h) = (n(self.h_m), n(self.inverse_h));
        let place = (x_m * inverse_h).max(n(0.0)).min(n(self.last as f64));
        let node = place.truncate().min(n((self.last - 1) as f64));
        let t = place - node;
        let (t2, t3) = (t * t, t * t * t);
        let bump = n(6.0) * (t - t2) * inverse_h;
        let (two_t3, three_t2) = (n(2.0) * t3, n(3.0) * t2);
        Cell {
            node,
            value: [two_t3 - three_t2 + n(1.0), three_t2 - two_t3, h * (t3 - n(2.0) * t2 + t), h * (t3 - t2)],
            slope: [n(0.0) - bump, bump, three_t2 - n(4.0) * t + n(1.0), three_t2 - n(2.0) * t],
        }
    }
}

impl InfluenceTable {
    /// A table of zeros.
    pub(super) fn empty(sensors: usize, length_m: f64) -> Self {
        let zeros = vec![0.0; sensors * Self::NODES];
        Self { sensors, length_m, values: zeros.clone(), slopes: zeros.clone(), variances: zeros }
    }

    /// The channels `live` of it, multiplied by `inverse_sd`, one over the noise of each.
    pub(super) fn whitened(&self, live: &[usize], inverse_sd: &[f64]) -> Self {
        let whiten = |values: &[f64], power: i32| {
            let rows = values.chunks_exact(self.sensors);
            let row = |row: &[f64]| -> Vec<f64> {
                live.iter().zip(inverse_sd).map(|(s, inverse)| row[*s] * inverse.powi(power)).collect()
            };
            rows.flat_map(row).collect::<Vec<f64>>()
        };
        Self {
            sensors: live.len(),
            length_m: self.length_m,
            values: whiten(&self.values, 1),
            slopes: whiten(&self.slopes, 1),
            variances: whiten(&self.variances, 2),
        }
    }

    /// Nodes of a table: eight sensors' influence functions are then interpolated to 10⁻⁷ of full scale.
    pub const NODES: usize = 129;

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.values.len() / self.sensors.max(1)
    }

    /// Distance between nodes, in metres.
    pub fn spacing_m(&self) -> f64 {
        self.length_m / (self.nodes() - 1) as f64
    }

    /// Position of a node, in metres.
    pub fn node_m(&self, node: usize) -> f64 {
        node as f64 * self.spacing_m()
    }

    /// The values of all sensors at a node.
    pub fn at_node(&self, node: usize) -> &[f64] {
        &self.values[node * self.sensors..(node + 1) * self.sensors]
    }

    /// Spacing of the nodes.
    pub(super) fn spacing(&self) -> Spacing {
        let h_m = self.spacing_m();
        Spacing { h_m, inverse_h: 1.0 / h_m, last: self.nodes() - 1 }
    }

    /// The cell that holds `x_m`, which is held to the surface.
    pub(super) fn cell(&self, x_m: f64) -> Cell<f64> {
        self.spacing().cell(x_m)
    }

    /// Calls `each` with sensor, value and slope, for every sensor at a place.
    #[inline]
    pub(super) fn for_each(&self, cell: Cell<f64>, mut each: impl FnMut(usize, f64, f64)) {
        let s = self.sensors;
        let left = cell.node as usize * s;
        let right = left + s;
        let (v0, v1) = (&self.values[left..right], &self.values[right..right + s]);
        let (d0, d1) = (&self.slopes[left..right], &self.slopes[right..right + s]);
        for i in 0..s {
            let mix = |w: &[f64; 4]| w[0] * v0[i] + w[1] * v1[i] + w[2] * d0[i] + w[3] * d1[i];
            each(i, mix(&cell.value), mix(&cell.slope));
        }
    }

    /// Value and slope of one sensor at a place.
    #[inline]
    pub(super) fn value_and_slope(&self, cell: &Cell<f64>, sensor: usize) -> (f64, f64) {
        let left = cell.node as usize * self.sensors + sensor;
        let right = left + self.sensors;
        let nodes = [self.values[left], self.values[right], self.slopes[left], self.slopes[right]];
        let mix = |w: &[f64; 4]| w[0] * nodes[0] + w[1] * nodes[1] + w[2] * nodes[2] + w[3] * nodes[3];
        (mix(&cell.value), mix(&cell.slope))
    }

    /// The variances of all sensors at the node nearest to a place.
    #[inline]
    pub(super) fn variances_near(&self, x_m: f64) -> &[f64] {
        let node = ((x_m / self.spacing_m()).round().max(0.0) as usize).min(self.nodes() - 1);
        &self.variances[node * self.sensors..(node + 1) * self.sensors]
    }
}

/// The influence function of one sensor of a table.
#[derive(Clone, Copy, Debug)]
pub struct FittedInfluence<'a> {
    table: &'a InfluenceTable,
    sensor: usize,
}

impl InfluenceTable {
    /// The influence function of a sensor, from 0; 0 everywhere for one that the table does not have.
    pub fn function(&self, sensor: usize) -> FittedInfluence<'_> {
        FittedInfluence { table: self, sensor }
    }
}

impl FittedInfluence<'_> {
    fn value_and_slope(&self, x_m: f64) -> (f64, f64) {
        if self.sensor < self.table.sensors {
            self.table.value_and_slope(&self.table.cell(x_m), self.sensor)
        } else {
            (0.0, 0.0)
        }
    }
}

impl InfluenceFunction for FittedInfluence<'_> {
    fn at(&self, contact: Position) -> f64 {
        self.value_and_slope(contact.x_m).0
    }

    fn gradient(&self, contact: Position) -> [f64; 2] {
        [self.value_and_slope(contact.x_m).1, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubic() -> InfluenceTable {
        let f = |x: f64| 2.0 * x * x * x - x + 0.5;
        let d = |x: f64| 6.0 * x * x - 1.0;
        let nodes = (0..9).map(|i| f64::from(i) * 0.4 / 8.0);
        InfluenceTable {
            sensors: 1,
            length_m: 0.4,
            values: nodes.clone().map(f).collect(),
            slopes: nodes.map(d).collect(),
            variances: vec![0.0; 9],
        }
    }

    #[test]
    fn a_cubic_is_given_back() {
        let table = cubic();
        for i in 0..=100 {
            let x = f64::from(i) * 0.004;
            table.for_each(table.cell(x), |_, value, slope| {
                assert!((value - (2.0 * x * x * x - x + 0.5)).abs() < 1e-14, "{x}");
                assert!((slope - (6.0 * x * x - 1.0)).abs() < 1e-12, "{x}");
            });
        }
    }

    #[test]
    fn places_beyond_the_ends_are_held_to_them() {
        let table = cubic();
        table.for_each(table.cell(-1.0), |_, value, _| assert_eq!(value, 0.5));
        table.for_each(table.cell(9.0), |_, value, _| assert!((value - 0.228).abs() < 1e-12));
        assert_eq!(table.variances_near(f64::INFINITY).len(), 1);
    }
}
