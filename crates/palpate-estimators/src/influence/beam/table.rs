//! Table of influence functions along a line, with cubic Hermite interpolation.

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::InfluenceFunction;
use palpate_numerics::simd::Number;
use serde::{Deserialize, Serialize};

/// Influence functions of all sensors at evenly spaced nodes, stored by node, then by sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InfluenceTable {
    /// Number of sensors S.
    pub sensors: usize,
    /// Length of the line in metres; node i is at i·length/(nodes − 1).
    pub length_m: f64,
    /// Reading per newton, SI or raw, nodes × S.
    pub values: Vec<f64>,
    /// Derivative of the values per metre, nodes × S.
    pub slopes: Vec<f64>,
    /// Posterior variance of the values, nodes × S.
    pub variances: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Cell<N> {
    /// Left node.
    pub node: N,
    /// Weights of left value, right value, left slope, right slope.
    pub value: [N; 4],
    /// Weights of the derivative.
    pub slope: [N; 4],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spacing {
    pub h_m: f64,
    inverse_h: f64,
    last: usize,
}

impl Spacing {
    /// Cell of `x_m`, clamped to the line.
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
    pub(super) fn empty(sensors: usize, length_m: f64) -> Self {
        let zeros = vec![0.0; sensors * Self::NODES];
        Self { sensors, length_m, values: zeros.clone(), slopes: zeros.clone(), variances: zeros }
    }

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

    /// Nodes of a table; they interpolate eight sensors to 10⁻⁷ of full scale.
    pub const NODES: usize = 129;

    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        self.values.len() / self.sensors.max(1)
    }

    /// Returns the distance between nodes, in metres.
    pub fn spacing_m(&self) -> f64 {
        self.length_m / (self.nodes() - 1) as f64
    }

    /// Returns the position of a node, in metres.
    pub fn node_m(&self, node: usize) -> f64 {
        node as f64 * self.spacing_m()
    }

    /// Returns the values of all sensors at a node.
    pub fn at_node(&self, node: usize) -> &[f64] {
        &self.values[node * self.sensors..(node + 1) * self.sensors]
    }

    pub(super) fn spacing(&self) -> Spacing {
        let h_m = self.spacing_m();
        Spacing { h_m, inverse_h: 1.0 / h_m, last: self.nodes() - 1 }
    }

    pub(super) fn cell(&self, x_m: f64) -> Cell<f64> {
        self.spacing().cell(x_m)
    }

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

    #[inline]
    pub(super) fn value_and_slope(&self, cell: &Cell<f64>, sensor: usize) -> (f64, f64) {
        let left = cell.node as usize * self.sensors + sensor;
        let right = left + self.sensors;
        let nodes = [self.values[left], self.values[right], self.slopes[left], self.slopes[right]];
        let mix = |w: &[f64; 4]| w[0] * nodes[0] + w[1] * nodes[1] + w[2] * nodes[2] + w[3] * nodes[3];
        (mix(&cell.value), mix(&cell.slope))
    }

    #[inline]
    pub(super) fn nearest_node(&self, x_m: f64) -> usize {
        ((x_m / self.spacing_m()).round().max(0.0) as usize).min(self.nodes() - 1)
    }

    #[inline]
    pub(super) fn variances_near(&self, x_m: f64) -> &[f64] {
        let node = self.nearest_node(x_m);
        &self.variances[node * self.sensors..(node + 1) * self.sensors]
    }
}

/// Influence function of one sensor of a table.
#[derive(Clone, Copy, Debug)]
pub struct FittedInfluence<'a> {
    table: &'a InfluenceTable,
    sensor: usize,
}

impl InfluenceTable {
    /// Returns the influence function of a sensor, from 0; 0 for a missing index.
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
