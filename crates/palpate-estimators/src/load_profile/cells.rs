//! Cells of a surface.

use std::ops::RangeInclusive;

use ndarray::Array2;

use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, UniformLoad, midpoints};

const ON_A_LINE: usize = 80;
const ON_A_PLANE: usize = 20;
/// Midpoints for mean influence, along x and y.
const POINTS_ON_A_LINE: [usize; 2] = [8, 1];
const POINTS_ON_A_PLANE: [usize; 2] = [3, 3];

/// Equal cells of a surface, numbered along x, then y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cells {
    /// Surface extent.
    pub extent: Extent,
    /// Cells along x, at least 1.
    pub columns: usize,
    /// Cells along y; 1 on a line.
    pub rows: usize,
}

impl Cells {
    /// Creates 80 cells on a line, or nearly square ones on a plane, 20 on the longer side.
    pub fn new(extent: Extent) -> Self {
        let Some(width_m) = extent.width_m() else { return Self { extent, columns: ON_A_LINE, rows: 1 } };
        let most = ON_A_PLANE as f64;
        let count = |side_m: f64| {
            // A strip gets at least one row of cells, for any ratio of its sides.
            (most * side_m / extent.length_m().max(width_m)).round().clamp(1.0, most) as usize
        };
        Self { extent, columns: count(extent.length_m()), rows: count(width_m) }
    }

    /// Creates about `count` nearly square cells, with numbers per side within `sides`.
    pub fn nearly_square(extent: Extent, count: f64, sides: RangeInclusive<usize>) -> Self {
        let aspect = extent.width_m().unwrap_or(extent.length_m()) / extent.length_m();
        let side = |ratio: f64| ((count * ratio).sqrt().round() as usize).clamp(*sides.start(), *sides.end());
        Self { extent, columns: side(1.0 / aspect), rows: side(aspect) }
    }

    /// Number of cells.
    #[expect(clippy::len_without_is_empty, reason = "there is at least one")]
    pub fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Sides in metres; the second is 0 on a line.
    pub fn sides_m(&self) -> [f64; 2] {
        let across = self.extent.width_m().map_or(0.0, |width_m| width_m / self.rows as f64);
        [self.extent.length_m() / self.columns as f64, across]
    }

    /// Length in metres, or area in m².
    pub fn measure(&self) -> f64 {
        let [along, across] = self.sides_m();
        match self.extent {
            Extent::Line { .. } => along,
            Extent::Plane { .. } => along * across,
        }
    }

    /// Centres of all cells.
    pub fn centres(&self) -> impl Iterator<Item = Position> {
        (0..self.len()).map(|cell| self.centre(cell))
    }

    /// Cell of a position, or the nearest.
    pub fn cell_of(&self, position: Position) -> usize {
        let number = |at_m: f64, size_m: f64, count: usize| {
            ((at_m / size_m * count as f64).max(0.0) as usize).min(count - 1)
        };
        let column = number(position.x_m, self.extent.length_m(), self.columns);
        let row = self.extent.width_m().map_or(0, |width_m| number(position.y_m, width_m, self.rows));
        row * self.columns + column
    }

    /// Mean density in N/m, or N/m² on a plane.
    pub fn mean_density(&self, loads: &[UniformLoad]) -> Vec<f64> {
        let shared = |a: f64, b: f64, from: f64, to: f64| {
            if b > a { (b.min(to) - a.max(from)).max(0.0) / (b - a) } else { 1.0 }
        };
        let density = |cell| {
            let (from, to) = self.corners(cell);
            let force_n = |load: &UniformLoad| {
                load.force_n()
                    * shared(load.from().x_m, load.to().x_m, from.x_m, to.x_m)
                    * shared(load.from().y_m, load.to().y_m, from.y_m, to.y_m)
            };
            loads.iter().map(force_n).sum::<f64>() / self.measure()
        };
        (0..self.len()).map(density).collect()
    }

    /// Centre of a cell.
    pub fn centre(&self, cell: usize) -> Position {
        let (from, to) = self.corners(cell);
        Position { x_m: from.x_m.midpoint(to.x_m), y_m: from.y_m.midpoint(to.y_m) }
    }

    /// Distance of the far side from the nearest edge, in metres.
    pub(super) fn edge_distance_m(&self, cell: usize) -> f64 {
        let (from, to) = self.corners(cell);
        let near = |from_m: f64, to_m: f64, side_m: f64| to_m.min(side_m - from_m);
        let along = near(from.x_m, to.x_m, self.extent.length_m());
        self.extent.width_m().map_or(along, |width_m| along.min(near(from.y_m, to.y_m, width_m)))
    }

    /// Lower left and upper right corners.
    pub fn corners(&self, cell: usize) -> (Position, Position) {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let [along, across] = self.sides_m();
        let corner = |i: usize, j: usize| Position { x_m: along * i as f64, y_m: across * j as f64 };
        (corner(column, row), corner(column + 1, row + 1))
    }

    pub(super) fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let beside = [
            (column > 0).then(|| cell - 1),
            (column + 1 < self.columns).then_some(cell + 1),
            (row > 0).then(|| cell - self.columns),
            (row + 1 < self.rows).then_some(cell + self.columns),
        ];
        beside.into_iter().flatten()
    }

    pub(super) fn points(&self, cell: usize) -> Vec<Position> {
        let (from, to) = self.corners(cell);
        midpoints(from, to, self.points_a_side())
    }

    pub(super) fn points_a_side(&self) -> [usize; 2] {
        match self.extent {
            Extent::Line { .. } => POINTS_ON_A_LINE,
            Extent::Plane { .. } => POINTS_ON_A_PLANE,
        }
    }

    /// P: xᵀP·x is the sum of squared second differences, or Σ x_uu² + 2·x_uv² + x_vv² (bending energy) on a
    /// plane, in cells along x. Beyond the edges x = 0, so P is positive definite.
    pub(super) fn roughness(&self) -> Array2<f64> {
        let mut roughness = Array2::zeros((self.len(), self.len()));
        let [along, across] = self.sides_m();
        let bend = |start: [isize; 2], step: [isize; 2]| {
            let place = |k: isize| self.cell_at([start[0] + k * step[0], start[1] + k * step[1]]);
            [(place(-1), 1.0), (place(0), -2.0), (place(1), 1.0)]
        };
        for [i, j] in self.cells_and_rim() {
            add_square(&mut roughness, &bend([i, j], [1, 0]), 1.0);
        }
        if let Extent::Plane { .. } = self.extent {
            let ratio = along / across;
            for [i, j] in self.cells_and_rim() {
                add_square(&mut roughness, &bend([i, j], [0, 1]), ratio.powi(4));
                let corner = |a, b, sign| (self.cell_at([i + a, j + b]), sign);
                let twist = [corner(0, 0, 1.0), corner(1, 0, -1.0), corner(0, 1, -1.0), corner(1, 1, 1.0)];
                add_square(&mut roughness, &twist, 2.0 * ratio * ratio);
            }
        }
        roughness
    }

    /// One cell wide.
    fn cells_and_rim(&self) -> impl Iterator<Item = [isize; 2]> {
        let (columns, rows) = (self.columns as isize, self.rows as isize);
        (-1..=rows).flat_map(move |j| (-1..=columns).map(move |i| [i, j]))
    }

    fn cell_at(&self, [column, row]: [isize; 2]) -> Option<usize> {
        let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
        (column < self.columns && row < self.rows).then(|| row * self.columns + column)
    }
}

/// Adds weight·(Σ c_k·x_k)².
fn add_square(form: &mut Array2<f64>, terms: &[(Option<usize>, f64)], weight: f64) {
    let terms: Vec<(usize, f64)> = terms.iter().filter_map(|(cell, c)| Some((((*cell)?), *c))).collect();
    for (i, a) in &terms {
        for (j, b) in &terms {
            form[[*i, *j]] += weight * a * b;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array1;

    fn line(columns: usize) -> Cells {
        Cells { extent: Extent::line(0.4).unwrap(), columns, rows: 1 }
    }

    #[test]
    fn roughness_is_the_sum_of_squared_second_differences() {
        let cells = line(7);
        let x = Array1::from_shape_fn(7, |i| (1.3 * i as f64).sin());
        let at = |i: isize| usize::try_from(i).ok().and_then(|i| x.get(i)).copied().unwrap_or(0.0);
        let direct: f64 = (-1..=7).map(|i| (at(i - 1) - 2.0 * at(i) + at(i + 1)).powi(2)).sum();
        assert!((x.dot(&cells.roughness().dot(&x)) - direct).abs() < 1e-12);
    }

    #[test]
    fn every_cell_holds_its_middle() {
        let plane = Extent::plane(0.3, 0.15).unwrap();
        let cells = Cells::nearly_square(plane, 200.0, 5..=60);
        assert_eq!((cells.columns, cells.rows), (20, 10));
        assert!(cells.centres().enumerate().all(|(cell, centre)| cells.cell_of(centre) == cell));
        assert_eq!(cells.cell_of(Position { x_m: 9.0, y_m: -9.0 }), 19);
        assert_eq!(line(7).cell_of(Position::along(0.4)), 6);
    }

    #[test]
    fn the_density_of_a_load_sums_up_to_its_force() {
        let at = |x_m, y_m| Position { x_m, y_m };
        let on_line = UniformLoad::new(at(0.05, 0.0), at(0.17, 0.0), 3.0);
        let on_plane = UniformLoad::new(at(0.05, 0.02), at(0.17, 0.09), 3.0);
        let plane = Cells::new(Extent::plane(0.3, 0.15).unwrap());
        for (cells, load) in [(line(7), on_line), (plane, on_plane)] {
            let density = cells.mean_density(&[load, load]);
            assert!((density.iter().sum::<f64>() * cells.measure() - 6.0).abs() < 1e-12);
        }
    }

    #[test]
    fn on_a_plane_a_tilt_costs_nothing_inside() {
        let extent = Extent::plane(0.3, 0.15).unwrap();
        let cells = Cells::new(extent);
        assert_eq!((cells.columns, cells.rows), (20, 10));
        let tilt = Array1::from_shape_fn(cells.len(), |cell| {
            let Position { x_m, y_m } = cells.centre(cell);
            1.0 + 2.0 * x_m - 3.0 * y_m
        });
        let force = cells.roughness().dot(&tilt);
        let inside = |cell: &usize| {
            let (i, j) = (cell % 20, cell / 20);
            (2..18).contains(&i) && (2..8).contains(&j)
        };
        assert!((0..cells.len()).filter(inside).all(|cell| force[cell].abs() < 1e-12));
        assert_eq!(cells.neighbours(0).collect::<Vec<_>>(), [1, 20]);
        assert!((cells.measure() * cells.len() as f64 - 0.3 * 0.15).abs() < 1e-12);
    }
}
