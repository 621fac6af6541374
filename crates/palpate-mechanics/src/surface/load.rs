//! Distributed forces.

use super::InfluenceFunction;
use crate::contact::Position;

/// Quadrature points; the midpoint rule errs by less than 10⁻⁴ of full scale at kinks.
const POINTS_ALONG: usize = 100;
const POINTS_ACROSS: usize = 20;

/// A uniform force on an interval or a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformLoad {
    from: Position,
    to: Position,
    force_n: f64,
}

impl UniformLoad {
    /// Creates a load between two ends.
    ///
    /// ```
    /// use palpate_mechanics::surface::UniformLoad;
    ///
    /// let load = UniformLoad::along(0.15, 0.23, 3.0);
    /// assert!((load.centre().x_m - 0.19).abs() < 1e-12);
    /// ```
    pub const fn along(from_m: f64, to_m: f64, force_n: f64) -> Self {
        Self::new(Position::along(from_m), Position::along(to_m), force_n)
    }

    /// Creates a load between two opposite corners.
    pub const fn new(one: Position, other: Position, force_n: f64) -> Self {
        Self {
            from: Position { x_m: one.x_m.min(other.x_m), y_m: one.y_m.min(other.y_m) },
            to: Position { x_m: one.x_m.max(other.x_m), y_m: one.y_m.max(other.y_m) },
            force_n,
        }
    }

    /// Left end, or lower left corner.
    pub const fn from(&self) -> Position {
        self.from
    }

    /// Right end, or upper right corner.
    pub const fn to(&self) -> Position {
        self.to
    }

    /// Total force, positive downward.
    pub const fn force_n(&self) -> f64 {
        self.force_n
    }

    /// Centre of the load.
    pub fn centre(&self) -> Position {
        Position { x_m: self.from.x_m.midpoint(self.to.x_m), y_m: self.from.y_m.midpoint(self.to.y_m) }
    }

    /// Mean of an influence function over the load.
    pub fn mean(&self, influence: &dyn InfluenceFunction) -> f64 {
        let points = self.points();
        points.iter().map(|point| influence.at(*point)).sum::<f64>() / points.len() as f64
    }

    /// Derivatives of [`UniformLoad::mean`] by a translation.
    pub fn mean_gradient(&self, influence: &dyn InfluenceFunction) -> [f64; 2] {
        let points = self.points();
        let sum = points.iter().fold([0.0, 0.0], |[sum_x, sum_y], point| {
            let [x, y] = influence.gradient(*point);
            [sum_x + x, sum_y + y]
        });
        sum.map(|sum| sum / points.len() as f64)
    }

    fn points(&self) -> Vec<Position> {
        let across = if self.to.y_m > self.from.y_m { POINTS_ACROSS } else { 1 };
        midpoints(self.from, self.to, [POINTS_ALONG, across])
    }
}

/// Returns the centres of `counts` equal parts of a rectangle, row by row.
pub fn midpoints(from: Position, to: Position, counts: [usize; 2]) -> Vec<Position> {
    let at =
        |low: f64, high: f64, i: usize, count: usize| low + (high - low) * (i as f64 + 0.5) / count as f64;
    let [along, across] = counts;
    let point = |j, i| Position { x_m: at(from.x_m, to.x_m, i, along), y_m: at(from.y_m, to.y_m, j, across) };
    (0..across).flat_map(|j| (0..along).map(move |i| point(j, i))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensing::SensorKind;
    use crate::surface::{Beam, Surface};

    fn beam() -> Beam {
        Beam::new(0.4, 0.04, 1.2e-3, 200e9).unwrap()
    }

    /// Tables: 5·q·l⁴/(384·E·I), t·q·l²/(16·E·I), half.
    #[test]
    fn uniform_load_over_a_beam_bends_it_as_tabulated() {
        let (beam, l) = (beam(), 0.4);
        let load = UniformLoad::along(0.0, l, 1.0);
        let read = |kind, at| load.mean(&*beam.influence_function(kind, Position::along(at)));
        let stiffness = beam.bending_stiffness();
        let deflection = -5.0 * l.powi(3) / (384.0 * stiffness);
        assert!((read(SensorKind::Deflection, l / 2.0) / deflection - 1.0).abs() < 1e-4);
        let strain = 1.2e-3 * l / (16.0 * stiffness);
        assert!((read(SensorKind::Strain, l / 2.0) / strain - 1.0).abs() < 1e-4);
        assert!((read(SensorKind::Reaction, 0.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn moving_a_load_changes_readings_by_the_gradient() {
        let beam = beam();
        let load = |x_m: f64| UniformLoad::along(x_m - 0.01, x_m + 0.01, 1.0);
        let influence = beam.influence_function(SensorKind::Deflection, Position::along(0.13));
        let step = 1e-4;
        let slope = (load(0.2 + step).mean(&*influence) - load(0.2 - step).mean(&*influence)) / (2.0 * step);
        assert!((load(0.2).mean_gradient(&*influence)[0] / slope - 1.0).abs() < 1e-6);
        assert_eq!(load(0.2).centre(), Position::along(0.2));
    }
}
