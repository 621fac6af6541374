//! Table of influence functions on a plane, with bicubic Hermite interpolation.
//!
//! Derivatives at the nodes are fourth-order differences (Abramowitz and Stegun, table 25.2, five points;
//! one-sided at the edges).

use crate::influence::lanes::{LANES, Lanes};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, InfluenceFunction};
use serde::{Deserialize, Serialize};

/// Influence functions of all sensors at the nodes of a grid over a rectangle.
///
/// Node (column, row) has the index row·columns + column; values are stored by node, then by sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneTable {
    /// Number of sensors S.
    pub sensors: usize,
    /// Length in metres; column i is at i·length/(columns − 1).
    pub length_m: f64,
    /// Width in metres; row j is at j·width/(rows − 1).
    pub width_m: f64,
    /// Nodes along the length; odd, at least [`PlaneTable::LEAST_SIDE`].
    pub columns: usize,
    /// Nodes across the width; odd, at least [`PlaneTable::LEAST_SIDE`].
    pub rows: usize,
    /// Reading per newton, in SI units, nodes × S.
    pub values: Vec<f64>,
    /// Posterior variance of the values, nodes × S.
    pub variances: Vec<f64>,
}

impl PlaneTable {
    /// Fewest nodes along a side; fourth-order differences need five.
    pub const LEAST_SIDE: usize = 9;
    /// Approximate number of nodes; 49 × 49 on a square.
    const NODES: f64 = 2401.0;

    pub(super) fn empty(sensors: usize, extent: Extent) -> Self {
        let (length_m, width_m) = (extent.length_m(), extent.width_m().unwrap_or(extent.length_m()));
        let side = |ratio: f64| {
            let half = (0.5 * (Self::NODES * ratio).sqrt()).floor();
            2 * half.clamp(0.5 * (Self::LEAST_SIDE - 1) as f64, 250.0) as usize + 1
        };
        let (columns, rows) = (side(length_m / width_m), side(width_m / length_m));
        let zeros = vec![0.0; sensors * columns * rows];
        Self { sensors, length_m, width_m, columns, rows, values: zeros.clone(), variances: zeros }
    }

    pub(crate) fn places(extent: Extent) -> usize {
        let Self { columns, rows, .. } = Self::empty(0, extent);
        (columns - 1) / 2 * ((rows - 1) / 2)
    }

    pub(crate) fn nodes_over(extent: Extent) -> usize {
        Self::empty(0, extent).nodes()
    }

    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        self.columns * self.rows
    }

    /// Returns the distance of neighbouring nodes along and across, in metres.
    pub fn spacing_m(&self) -> [f64; 2] {
        [self.length_m / (self.columns - 1) as f64, self.width_m / (self.rows - 1) as f64]
    }

    /// Returns the position of a node.
    pub fn node(&self, node: usize) -> Position {
        let [along_m, across_m] = self.spacing_m();
        let (column, row) = (node % self.columns, node / self.columns);
        Position { x_m: column as f64 * along_m, y_m: row as f64 * across_m }
    }

    pub(super) fn of_sensor(&self, sensor: usize) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().skip(sensor).step_by(self.sensors).copied()
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Patches {
    columns: usize,
    rows: usize,
    inverse_spacing: [f64; 2],
    pub groups: usize,
    /// f and derivatives by column, row and both.
    nodes: Vec<[Lanes; 4]>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct PatchPoint {
    /// Lower left corner.
    node: usize,
    /// Weights of f and of the derivative: left and right value, left and right slope.
    along: [[f64; 4]; 2],
    across: [[f64; 4]; 2],
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Values {
    pub f: Lanes,
    pub along: Lanes,
    pub across: Lanes,
}

impl Patches {
    pub fn new(table: &PlaneTable, live: &[usize], factors: &[f64]) -> Self {
        let groups = live.len().div_ceil(8);
        let mut nodes = vec![[[0.0; 8]; 4]; table.nodes() * groups];
        for (i, (sensor, factor)) in live.iter().zip(factors).enumerate() {
            let (group, lane) = (i / 8, i % 8);
            let values: Vec<f64> = table.of_sensor(*sensor).map(|value| factor * value).collect();
            let by_column = differences(&values, table.columns, table.rows, 1, table.columns);
            let by_row = differences(&values, table.rows, table.columns, table.columns, 1);
            let by_both = differences(&by_column, table.rows, table.columns, table.columns, 1);
            for (kind, list) in [values, by_column, by_row, by_both].iter().enumerate() {
                for (node, value) in list.iter().enumerate() {
                    nodes[node * groups + group][kind][lane] = *value;
                }
            }
        }
        let inverse_spacing = table.spacing_m().map(|spacing_m| 1.0 / spacing_m);
        Self { columns: table.columns, rows: table.rows, inverse_spacing, groups, nodes }
    }

    /// Patch of a place, clamped to the surface.
    #[inline]
    pub fn place(&self, x_m: f64, y_m: f64) -> PatchPoint {
        let (column, along) = hermite(x_m * self.inverse_spacing[0], self.columns);
        let (row, across) = hermite(y_m * self.inverse_spacing[1], self.rows);
        PatchPoint { node: row * self.columns + column, along, across }
    }

    #[inline]
    pub fn values(&self, place: &PatchPoint, group: usize) -> Values {
        let PatchPoint { node, along: [u, du], across: [v, dv] } = place;
        let mut values = Values { f: [0.0; 8], along: [0.0; 8], across: [0.0; 8] };
        for side in 0..4 {
            let (right, up) = (side % 2, side / 2);
            let corner = &self.nodes[(node + right + up * self.columns) * self.groups + group];
            for (kind, lanes) in corner.iter().enumerate() {
                // Derivatives by column pair with the slope weights along, and so on.
                let (i, j) = (right + 2 * (kind % 2), up + 2 * (kind / 2));
                let (f, along, across) = (u[i] * v[j], du[i] * v[j], u[i] * dv[j]);
                for (lane, value) in lanes.iter().enumerate() {
                    values.f[lane] += f * value;
                    values.along[lane] += along * value;
                    values.across[lane] += across * value;
                }
            }
        }
        for lane in 0..8 {
            values.along[lane] *= self.inverse_spacing[0];
            values.across[lane] *= self.inverse_spacing[1];
        }
        values
    }

    #[inline]
    pub fn value(&self, place: &PatchPoint, group: usize) -> Lanes {
        let PatchPoint { node, along: [u, _], across: [v, _] } = place;
        let mut value = [0.0; 8];
        for side in 0..4 {
            let (right, up) = (side % 2, side / 2);
            let corner = &self.nodes[(node + right + up * self.columns) * self.groups + group];
            for (kind, lanes) in corner.iter().enumerate() {
                let weight = u[right + 2 * (kind % 2)] * v[up + 2 * (kind / 2)];
                for lane in 0..8 {
                    value[lane] += weight * lanes[lane];
                }
            }
        }
        value
    }

    pub fn at_node(&self, column: usize, row: usize, group: usize) -> &Lanes {
        &self.nodes[(row * self.columns + column) * self.groups + group][0]
    }

    #[inline]
    pub fn nearest(&self, x_m: f64, y_m: f64) -> usize {
        let near = |at: f64, count: usize| (at.round().max(0.0) as usize).min(count - 1);
        let (column, row) = (
            near(x_m * self.inverse_spacing[0], self.columns),
            near(y_m * self.inverse_spacing[1], self.rows),
        );
        row * self.columns + column
    }
}

/// Influence function of one channel of the patches.
#[derive(Clone, Copy, Debug)]
pub(super) struct FittedInfluence<'a> {
    patches: &'a Patches,
    channel: usize,
    scale: f64,
}

impl Patches {
    /// Influence function of a channel, counted from 0, times `scale`.
    pub fn function(&self, channel: usize, scale: f64) -> FittedInfluence<'_> {
        FittedInfluence { patches: self, channel, scale }
    }
}

impl InfluenceFunction for FittedInfluence<'_> {
    fn at(&self, Position { x_m, y_m }: Position) -> f64 {
        let values = self.patches.value(&self.patches.place(x_m, y_m), self.channel / LANES);
        self.scale * values[self.channel % LANES]
    }

    fn gradient(&self, Position { x_m, y_m }: Position) -> [f64; 2] {
        let values = self.patches.values(&self.patches.place(x_m, y_m), self.channel / LANES);
        [values.along, values.across].map(|lanes| self.scale * lanes[self.channel % LANES])
    }
}

/// Cell, and Hermite weights of the function and of the derivative.
#[inline]
fn hermite(place: f64, count: usize) -> (usize, [[f64; 4]; 2]) {
    let place = place.clamp(0.0, (count - 1) as f64);
    let cell = (place as usize).min(count - 2);
    let t = place - cell as f64;
    let (t2, t3) = (t * t, t * t * t);
    let bump = 6.0 * (t - t2);
    let value = [2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3, t3 - 2.0 * t2 + t, t3 - t2];
    (cell, [value, [-bump, bump, 3.0 * t2 - 4.0 * t + 1.0, 3.0 * t2 - 2.0 * t]])
}

/// Derivatives per node along `lines` lines (`pitch` apart) of `count` values (`step` apart).
fn differences(values: &[f64], count: usize, lines: usize, step: usize, pitch: usize) -> Vec<f64> {
    const INNER: [f64; 5] = [1.0, -8.0, 0.0, 8.0, -1.0];
    const SECOND: [f64; 5] = [-3.0, -10.0, 18.0, -6.0, 1.0];
    const FIRST: [f64; 5] = [-25.0, 48.0, -36.0, 16.0, -3.0];
    let mut derivatives = vec![0.0; values.len()];
    for line in 0..lines {
        let at = |i: usize| line * pitch + i * step;
        for i in 0..count {
            let behind = count - 1 - i;
            let (first, weights, mirrored) = match (i, behind) {
                (0, _) => (0, FIRST, false),
                (1, _) => (0, SECOND, false),
                (_, 0) => (count - 1, FIRST, true),
                (_, 1) => (count - 1, SECOND, true),
                _ => (i - 2, INNER, false),
            };
            let term = |(k, weight): (usize, &f64)| {
                if mirrored { -weight * values[at(first - k)] } else { weight * values[at(first + k)] }
            };
            derivatives[at(i)] = weights.iter().enumerate().map(term).sum::<f64>() / 12.0;
        }
    }
    derivatives
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mechanics::surface::Extent;

    fn cubic(x: f64, y: f64) -> f64 {
        (x * x * x - 0.3 * x + 0.1) * (2.0 * y * y * y + y * y - 0.2)
    }

    #[test]
    fn a_bicubic_is_given_back_with_its_gradient() {
        let mut table = PlaneTable::empty(3, Extent::plane(0.6, 0.4).unwrap());
        for node in 0..table.nodes() {
            let at = table.node(node);
            table.values[3 * node + 1] = cubic(at.x_m, at.y_m);
        }
        let patches = Patches::new(&table, &[0, 1], &[1.0, 2.0]);
        for i in 0..=30 {
            for j in 0..=20 {
                let (x, y) = (f64::from(i) * 0.02, f64::from(j) * 0.02);
                let values = patches.values(&patches.place(x, y), 0);
                assert!((values.f[1] - 2.0 * cubic(x, y)).abs() < 1e-13, "{x}, {y}");
                let (dx, dy) = ((3.0 * x * x - 0.3), (6.0 * y * y + 2.0 * y));
                let along = 2.0 * dx * (2.0 * y * y * y + y * y - 0.2);
                let across = 2.0 * dy * (x * x * x - 0.3 * x + 0.1);
                assert!((values.along[1] - along).abs() < 1e-11 && (values.across[1] - across).abs() < 1e-11);
                assert_eq!((values.f[0], values.f[2]), (0.0, 0.0));
            }
        }
        let (inside, beyond) = (patches.place(0.6, 0.4), patches.place(f64::INFINITY, 9.0));
        assert_eq!(patches.values(&inside, 0).f, patches.values(&beyond, 0).f);
    }
}
