//! Influence functions on a plane, as a table over a grid.

use serde::{Deserialize, Serialize};

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// What every sensor reads per newton, with its uncertainty, at the nodes of a grid over a rectangle.
///
/// Between nodes the functions are bicubic (see `Patches`). Node (column, row) is number row·columns + column, and within a
/// node the numbers are stored sensor by sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneTable {
    /// Sensors S.
    pub sensors: usize,
    /// Length of the rectangle in metres; column i is at i·length/(columns − 1).
    pub length_m: f64,
    /// Its width in metres; row j is at j·width/(rows − 1).
    pub width_m: f64,
    /// Nodes along the length; odd, at least [`PlaneTable::LEAST_SIDE`].
    pub columns: usize,
    /// Nodes across the width; odd, at least [`PlaneTable::LEAST_SIDE`].
    pub rows: usize,
    /// Reading per newton, in the sensors' SI units, nodes × S.
    pub values: Vec<f64>,
    /// Variance of the values, from calibrating with finitely many noisy presses, nodes × S.
    pub variances: Vec<f64>,
}

impl PlaneTable {
    /// The fewest nodes along a side: differences of fourth order take five.
    pub const LEAST_SIDE: usize = 9;
    /// About how many nodes there are: on a square 49 × 49, a fiftieth of a side apart.
    const NODES: f64 = 2401.0;

    /// A table of zeros over a surface; nodes are about as far apart along as across.
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

    /// How many nodes there are.
    pub fn nodes(&self) -> usize {
        self.columns * self.rows
    }

    /// Distance of neighbouring nodes along and across, in metres.
    pub fn spacing_m(&self) -> [f64; 2] {
        [self.length_m / (self.columns - 1) as f64, self.width_m / (self.rows - 1) as f64]
    }

    /// Where a node is.
    pub fn node(&self, node: usize) -> Position {
        let [along_m, across_m] = self.spacing_m();
        let (column, row) = (node % self.columns, node / self.columns);
        Position { x_m: column as f64 * along_m, y_m: row as f64 * across_m }
    }

    /// The value of every node for one sensor.
    pub(super) fn of_sensor(&self, sensor: usize) -> impl Iterator<Item = f64> + '_ {
        self.values.iter().skip(sensor).step_by(self.sensors).copied()
    }
}
