//! Distant contacts with nearly equal readings.

use super::bound::norm;
use super::zone::Grid;
use super::{Columns, CramerRaoBound, Force};
use crate::contact::{Contact, Position};
use palpate_numerics::small::Ldl;

/// Largest distance of ambiguous contacts, in standard deviations: more than 1 of 100 readings are confused
/// (2·2.326).
pub(super) const AMBIGUOUS_DISTANCE: f64 = 4.653;
const WAY_POINTS: i32 = 47;
/// Radius of the search, in pitches. Farther away a search along a valley ends at the contact itself.
const REACH: f64 = 1.5;
/// Largest excess over the bound, as a multiple of the last gain.
const HOPELESS: f64 = 10.0;
/// Final step, in pitches.
const FINEST: f64 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Twin {
    pub position: Position,
    pub distance: f64,
}

/// Search for twins.
///
/// Contacts differ by |y(a) − y(b)| for a known force, otherwise by the distance of y(a) from the ray through
/// y(b).
pub(super) struct TwinSearch<'a> {
    limit: &'a CramerRaoBound<'a>,
    force_n: f64,
    force: Force,
    grid: Grid,
    places: Vec<Place>,
}

struct Place {
    shape: Shape,
    spread: f64,
    /// Per metre.
    slopes: [Vec<f64>; 2],
    /// Largest prediction error of the derivatives at a neighbour.
    bend: f64,
}

/// Compared part of a reading; its direction for an unknown force.
#[derive(Clone)]
struct Shape {
    values: Vec<f64>,
    length: f64,
}

impl<'a> TwinSearch<'a> {
    pub fn new(limit: &'a CramerRaoBound<'a>, force_n: f64, force: Force) -> Self {
        let grid = Grid::over_surface(limit.extent);
        let mut search = Self { limit, force_n, force, grid, places: Vec::new() };
        let positions = &search.grid.positions;
        let shapes: Vec<Shape> = positions.iter().map(|position| search.shape(*position)).collect();
        let place = |(i, shape): (usize, &Shape)| {
            let slopes = search.slopes(positions[i], shape);
            let apart = |j: usize| [positions[j].x_m - positions[i].x_m, positions[j].y_m - positions[i].y_m];
            let bent =
                |j: usize| squared_residual(&slopes, apart(j), &difference(&shapes[j].values, &shape.values));
            let spreads = search.grid.neighbours(i).map(|j| distance(&shape.values, &shapes[j].values));
            Place {
                spread: spreads.fold(0.0, f64::max),
                bend: search.grid.neighbours(i).map(bent).fold(0.0, f64::max),
                shape: shape.clone(),
                slopes,
            }
        };
        search.places = shapes.iter().enumerate().map(place).collect();
        search
    }

    /// Returns the nearest ambiguous contact beyond a region of distinct readings.
    pub fn twin_of(&self, position: Position) -> Option<Twin> {
        let target = self.shape(position);
        let distances: Vec<f64> =
            self.places.iter().map(|place| self.distance(&target, &place.shape.values)).collect();
        // A search from the contact itself finds no twin.
        let elsewhere = |i: &usize| self.grid.positions[*i] != position;
        let lowest = |i: &usize| self.grid.neighbours(*i).all(|j| distances[*i] <= distances[j]);
        let starts = (0..distances.len())
            .filter(elsewhere)
            .filter(|i| self.is_reachable(&target, *i, distances[*i]))
            .filter(lowest);
        let twins = starts.map(|i| self.descend(&target, self.grid.positions[i], distances[i]));
        twins
            .filter(|twin| {
                twin.distance <= AMBIGUOUS_DISTANCE && self.is_separated(&target, position, twin.position)
            })
            .min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    fn is_reachable(&self, target: &Shape, i: usize, found: f64) -> bool {
        let place = &self.places[i];
        let scale = if self.force == Force::Known { 1.0 } else { target.length };
        if found - scale * place.spread > AMBIGUOUS_DISTANCE {
            return false;
        }
        let left = difference(&target.values, &place.shape.values);
        let most_m = REACH * self.grid.pitch_m();
        let step_m = predicted_step(&place.slopes, &left).map(|step_m| step_m.clamp(-most_m, most_m));
        scale * (squared_residual(&place.slopes, step_m, &left) - place.bend) <= AMBIGUOUS_DISTANCE
    }

    fn shape(&self, position: Position) -> Shape {
        self.shapes(&[position]).pop().unwrap_or_else(|| Shape { values: Vec::new(), length: 0.0 })
    }

    fn shapes(&self, positions: &[Position]) -> Vec<Shape> {
        let readings = self.limit.whitened_readings(positions, self.force_n);
        let shape = |mut values: Vec<f64>| {
            let length = norm(&values);
            if self.force == Force::Unknown && length > 0.0 {
                values.iter_mut().for_each(|value| *value /= length);
            }
            Shape { values, length }
        };
        readings.into_iter().map(shape).collect()
    }

    fn slopes(&self, position: Position, shape: &Shape) -> [Vec<f64>; 2] {
        let Columns { along, y: across, .. } =
            self.limit.derivatives(Contact { position, force_n: self.force_n });
        let mut slopes = [along, across.unwrap_or_default()];
        if self.force == Force::Unknown && shape.length > 0.0 {
            for slope in &mut slopes {
                let part = dot(slope, &shape.values);
                for (slope, value) in slope.iter_mut().zip(&shape.values) {
                    *slope = (*slope - part * value) / shape.length;
                }
            }
        }
        slopes
    }

    fn distance(&self, target: &Shape, other: &[f64]) -> f64 {
        match self.force {
            Force::Known => distance(&target.values, other),
            Force::Unknown => {
                // A force only pushes, so a contact of opposite direction is not nearer than no contact at
                // all.
                let along = dot(&target.values, other).max(0.0);
                let off = sum_in_strands(&target.values, other, |a, b| (a - along * b).powi(2));
                target.length * off.sqrt()
            }
        }
    }

    /// Compass search around a grid position. Gauss–Newton steps would follow a curved valley to the contact
    /// itself.
    fn descend(&self, target: &Shape, start: Position, distance: f64) -> Twin {
        let mut twin = Twin { position: start, distance };
        let (finest_m, reach_m) = (FINEST * self.grid.pitch_m(), REACH * self.grid.pitch_m());
        // Distance before the steps of this length, and whether longer steps are done.
        let (mut before, mut tried) = (distance, false);
        let mut step_m = 0.5 * self.grid.pitch_m();
        while step_m > finest_m {
            let Position { x_m, y_m } = twin.position;
            let around = [(step_m, 0.0), (-step_m, 0.0), (0.0, step_m), (0.0, -step_m)];
            let mut around = around.map(|(dx, dy)| Position { x_m: x_m + dx, y_m: y_m + dy }).to_vec();
            around.retain(|&at| self.limit.extent.contains(at) && start.distance_m(at) <= reach_m);
            let distances = self.shapes(&around).into_iter().map(|near| self.distance(target, &near.values));
            let near = around.iter().zip(distances).find(|(_, distance)| *distance < twin.distance);
            match near {
                Some((&position, distance)) => twin = Twin { position, distance },
                None => {
                    let gained = before - twin.distance;
                    if tried && twin.distance - AMBIGUOUS_DISTANCE > HOPELESS * gained {
                        return twin;
                    }
                    (before, tried) = (twin.distance, true);
                    step_m *= 0.5;
                }
            }
        }
        twin
    }

    fn is_separated(&self, target: &Shape, from: Position, to: Position) -> bool {
        let mut shares: Vec<f64> =
            (1..=WAY_POINTS).map(|i| f64::from(i) / f64::from(WAY_POINTS + 1)).collect();
        shares.sort_by(|a, b| (a - 0.5).abs().total_cmp(&(b - 0.5).abs()));
        let between = |a: f64, b: f64, share: f64| a + share * (b - a);
        let at = |share: &f64| Position {
            x_m: between(from.x_m, to.x_m, *share),
            y_m: between(from.y_m, to.y_m, *share),
        };
        shares.iter().map(at).any(|at| self.distance(target, &self.shape(at).values) > AMBIGUOUS_DISTANCE)
    }
}

fn predicted_step([along, across]: &[Vec<f64>; 2], left: &[f64]) -> [f64; 2] {
    let both = dot(along, across);
    let products = [[dot(along, along), both], [both, dot(across, across)]];
    Ldl::semidefinite(&products).solve([dot(along, left), dot(across, left)])
}

fn squared_residual([along, across]: &[Vec<f64>; 2], [dx_m, dy_m]: [f64; 2], difference: &[f64]) -> f64 {
    let mut left = difference.to_vec();
    for (slope, step_m) in [(along, dx_m), (across, dy_m)] {
        left.iter_mut().zip(slope).for_each(|(left, slope)| *left -= step_m * slope);
    }
    norm(&left)
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    sum_in_strands(a, b, |a, b| (a - b).powi(2)).sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    sum_in_strands(a, b, |a, b| a * b)
}

/// Sum in eight independent strands, for speed.
fn sum_in_strands(a: &[f64], b: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut strands = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for (strand, (a, b)) in strands.iter_mut().zip(a.iter().zip(b)) {
            *strand += term(*a, *b);
        }
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| term(*a, *b));
    strands.into_iter().chain(rest).sum()
}
