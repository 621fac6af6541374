//! Directions of the distributed-contact test about every place of a line; see [`crate::distributed_contact`].

use super::gauss_newton::{GaussNewton, Minimum, grouped, interpolate};
use super::table::InfluenceTable;
use crate::distributed_contact::{BoundedContact, DistributedContactDirections, distributed_contact_bound};
use crate::influence::config::ForceBelief;
use palpate_numerics::simd::{Arithmetic, Array, EightLanes, Vector};

type Group = Array<f64, 8, false>;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpreadTable {
    /// u·√w: u the direction, w the weights of the cell; 0 without a direction.
    units: Vec<[f64; 8]>,
    /// Σ u²·(1 − w): the calibration's part of the variance along u.
    calibrated: Vec<f64>,
    /// Critical value of the score.
    pub bound: f64,
}

impl SpreadTable {
    pub fn new(table: &InfluenceTable, gauss_newton: &GaussNewton, force: ForceBelief) -> Self {
        let (mut units, mut calibrated) = (Vec::new(), Vec::new());
        let force_ends = force.known_n().map_or((0.0, f64::INFINITY), |_| (1.0, 1.0));
        for cell in 0..table.nodes() - 1 {
            let middle_m = (cell as f64 + 0.5) * table.spacing_m();
            let weights = &gauss_newton.weights[cell * gauss_newton.groups..][..gauss_newton.groups];
            let weights = &weights.as_flattened()[..table.sensors];
            let about = BoundedContact {
                at: [middle_m, 0.0, 1.0],
                ends: [(0.0, table.length_m), (0.0, 0.0), force_ends],
            };
            let directions = DistributedContactDirections::at_contact(about, |[x_m, _, force_n]| {
                let mut reads = vec![0.0; table.sensors];
                table.for_each(table.cell(x_m), |s, f, _| reads[s] = weights[s].sqrt() * force_n * f);
                reads
            });
            let unit = directions.on_line().unwrap_or_else(|| vec![0.0; table.sensors]);
            calibrated.push(unit.iter().zip(weights).map(|(u, w)| u * u * (1.0 - w)).sum());
            let weighted: Vec<f64> = unit.iter().zip(weights).map(|(u, w)| u * w.sqrt()).collect();
            units.extend(grouped(&weighted, table.sensors, 0.0));
        }
        Self { units, calibrated, bound: distributed_contact_bound(1) }
    }

    #[inline]
    pub fn is_told(&self, gauss_newton: &GaussNewton, whitened: &[[f64; 8]], minimum: &Minimum) -> bool {
        let (cell, groups) = (gauss_newton.spacing.cell(minimum.x_m), gauss_newton.groups);
        let node = cell.node as usize;
        let (left, right) = gauss_newton.rows[node * groups..][..2 * groups].split_at(groups);
        let units = &self.units[node * groups..][..groups];
        let mut along = Group::splat(0.0);
        for (((d, unit), left), right) in whitened.iter().zip(units).zip(left).zip(right) {
            let (f, _) = interpolate::<Group>(&cell, left, right);
            along = along + Group::load(unit) * (Group::load(d) - Group::splat(minimum.force_n) * f);
        }
        let z = along.sum();
        let grown = gauss_newton.weights_grown(minimum.force_n);
        let variance = 1.0 + (grown - 1.0) * self.calibrated[node];
        z > 0.0 && z * z > self.bound * variance
    }
}
