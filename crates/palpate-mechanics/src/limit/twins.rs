//! Contacts far apart whose readings are alike.

use super::grid::Grid;
use super::information::norm;
use super::{CramerRaoBound, Force};
use crate::contact::{Contact, Position};
use palpate_numerics::small::dot;

/// Points of the straight way between two contacts at which their difference is looked at.
const WAY_POINTS: u32 = 48;
/// The search for the nearest reading ends at this share of the grid's pitch.
const FINEST: f64 = 1e-3;

/// The contact whose readings are nearest, somewhere else on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Twin {
    pub position: Position,
    /// How far apart the readings are, in standard deviations of their noise.
    pub distance: f64,
}

/// The whitened readings of a whole surface, to be compared with.
///
/// For a known force W two contacts differ by |y(a) − y(b)|. For an unknown force the second one may have any force, and
/// what is left is the distance of y(a) from the ray through y(b): |y(a)|·sin of the angle between their directions.
pub(super) struct TwinSearch<'a> {
    limit: &'a CramerRaoBound<'a>,
    force_n: f64,
    force: Force,
    /// Two contacts further apart than this are told apart.
    bound: f64,
    grid: Grid,
    /// The shape of the reading at each position of the grid.
    shapes: Vec<Vec<f64>>,
    /// The largest difference of its shape from a neighbour's.
    spreads: Vec<f64>,
}

impl<'a> TwinSearch<'a> {
    pub fn new(limit: &'a CramerRaoBound<'a>, force_n: f64, force: Force, bound: f64) -> Self {
        let grid = Grid::over(limit.surface.extent());
        let mut search = Self { limit, force_n, force, bound, grid, shapes: Vec::new(), spreads: Vec::new() };
        search.shapes = search.grid.positions.iter().map(|&position| search.shape(position).0).collect();
        let spread = |i: usize| {
            let differences =
                search.grid.neighbours(i).map(|j| difference(&search.shapes[i], &search.shapes[j]));
            differences.fold(0.0, f64::max)
        };
        search.spreads = (0..search.shapes.len()).map(spread).collect();
        search
    }

    /// The nearest twin within the bound that is not just a neighbour: on the way to it the readings differ by more.
    pub fn twin_of(&self, position: Position) -> Option<Twin> {
        let target = self.shape(position);
        let distances: Vec<f64> = self.shapes.iter().map(|shape| self.distance(&target, shape)).collect();
        let scale = if self.force == Force::Known { 1.0 } else { target.1 };
        let reachable = |i: &usize| distances[*i] - scale * self.spreads[*i] <= self.bound;
        let lowest = |i: &usize| self.grid.neighbours(*i).all(|j| distances[*i] <= distances[j]);
        let starts = (0..distances.len()).filter(reachable).filter(lowest);
        let twins = starts.map(|i| self.descend(&target, self.grid.positions[i], distances[i]));
        twins
            .filter(|twin| twin.distance <= self.bound && self.apart(&target, position, twin.position))
            .min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// What is compared of the reading at a position, and the length of the whitened reading: the reading itself for a
    /// known force, its direction for an unknown one.
    fn shape(&self, position: Position) -> (Vec<f64>, f64) {
        let mut reading = self.limit.whitened_reading(Contact { position, force_n: self.force_n });
        let length = norm(&reading);
        if self.force == Force::Unknown && length > 0.0 {
            reading.iter_mut().for_each(|value| *value /= length);
        }
        (reading, length)
    }

    fn distance(&self, (shape, length): &(Vec<f64>, f64), other: &[f64]) -> f64 {
        match self.force {
            Force::Known => difference(shape, other),
            Force::Unknown => {
                // A force pushes, so a direction that points the other way is no nearer than no contact at all.
                let along = dot(shape, other).max(0.0);
                let off = shape.iter().zip(other).map(|(a, b)| (a - along * b).powi(2)).sum::<f64>();
                length * off.sqrt()
            }
        }
    }

    /// From a position of the grid down to the nearest reading around it, by ever smaller steps along x and y.
    fn descend(&self, target: &(Vec<f64>, f64), start: Position, distance: f64) -> Twin {
        let mut twin = Twin { position: start, distance };
        let finest_m = FINEST * self.grid.pitch_m();
        let mut step_m = 0.5 * self.grid.pitch_m();
        while step_m > finest_m {
            let Position { x_m, y_m } = twin.position;
            let around = [(step_m, 0.0), (-step_m, 0.0), (0.0, step_m), (0.0, -step_m)];
            let better = around
                .map(|(dx, dy)| Position { x_m: x_m + dx, y_m: y_m + dy })
                .into_iter()
                .filter(|&position| self.limit.surface.contains(position))
                .map(|position| Twin { position, distance: self.distance(target, &self.shape(position).0) })
                .find(|near| near.distance < twin.distance);
            match better {
                Some(near) => twin = near,
                None => step_m *= 0.5,
            }
        }
        twin
    }

    fn apart(&self, target: &(Vec<f64>, f64), from: Position, to: Position) -> bool {
        (1..WAY_POINTS).any(|i| {
            let share = f64::from(i) / f64::from(WAY_POINTS);
            let between = |a: f64, b: f64| a + share * (b - a);
            let at = Position { x_m: between(from.x_m, to.x_m), y_m: between(from.y_m, to.y_m) };
            self.distance(target, &self.shape(at).0) > self.bound
        })
    }
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
