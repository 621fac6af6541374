//! Reference regression: reading = offset + force × Σ coefficient × basis(position), solved and inverted by least squares.

use crate::raw_bench::{MARGIN_M, PLATE_M, RawBench, STRIP_M};
use anyhow::{Context, Result};
use ndarray::{Array1, Array2};
use palpate::numerics::Cholesky;
use palpate::prelude::{Position, Row};
use std::rc::Rc;

#[derive(Clone)]
pub struct Regression {
    basis: Rc<dyn Fn(Position) -> Vec<f64>>,
    grid: Vec<Position>,
    drift: Drift,
}

/// Model of the offsets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drift {
    /// Constant.
    None,
    /// Linear in the time, or the row number.
    Linear,
}

impl Regression {
    /// Cubic spline on a strip, with a coefficient per place.
    pub fn spline(places: usize) -> Self {
        let span_m = STRIP_M - 2.0 * MARGIN_M;
        let basis = move |at: Position| cubic_basis((at.x_m - MARGIN_M) / span_m, places);
        Self { basis: Rc::new(basis), grid: strip_grid(), drift: Drift::None }
    }

    /// Cubic radial basis functions r³ around the places of a plate, and a plane.
    pub fn radial_basis(presses: &[Row]) -> Self {
        let mut centres: Vec<Position> = presses.iter().map(|row| row.position).collect();
        centres.sort_by(Position::cmp_by_x_then_y);
        centres.dedup();
        let unit_m = PLATE_M[0];
        let basis = move |at: Position| {
            let radial = centres.iter().map(|centre| (at.distance_m(*centre) / unit_m).powi(3));
            radial.chain([1.0, at.x_m / unit_m, at.y_m / unit_m]).collect()
        };
        Self { basis: Rc::new(basis), grid: plate_grid(), drift: Drift::None }
    }

    pub fn with_linear_drift(&self) -> Self {
        Self { drift: Drift::Linear, ..self.clone() }
    }

    pub fn errors_mm(&self, presses: &[Row], touches: &[Row]) -> Result<Vec<f64>> {
        let last = presses.last().context("there are no presses")?;
        // Time runs from −1 to 0, so that the constant is the offset at the recording's end.
        let time = |i: usize, row: &Row| match (self.drift, row.time_s, last.time_s) {
            (Drift::None, ..) => None,
            (Drift::Linear, Some(time), Some(end)) => Some(time / end - 1.0),
            (Drift::Linear, ..) => Some(i as f64 / (presses.len() - 1) as f64 - 1.0),
        };
        let row = |(i, row): (usize, &Row)| -> Vec<f64> {
            let force_n = row.force_n.unwrap_or(0.0);
            let influences = (self.basis)(row.position).into_iter().map(|value| force_n * value);
            std::iter::once(1.0).chain(influences).chain(time(i, row)).collect()
        };
        let rows: Vec<Vec<f64>> = presses.iter().enumerate().map(row).collect();
        let design = Array2::from_shape_fn((rows.len(), rows[0].len()), |(i, j)| rows[i][j]);
        let ridge = Array2::from_diag(&Array1::from_elem(rows[0].len(), 1e-7));
        let normal = Cholesky::factor(design.t().dot(&design) + ridge)?;
        let solutions: Vec<Array1<f64>> = (0..last.reading.len())
            .map(|c| {
                let counts: Array1<f64> = presses.iter().map(|press| press.reading[c]).collect();
                normal.solve(&design.t().dot(&counts))
            })
            .collect();
        let offsets: Vec<f64> = solutions.iter().map(|solution| solution[0]).collect();
        let influence = |at: Position| -> Vec<f64> {
            let basis = (self.basis)(at);
            let of_channel = |c: &Array1<f64>| basis.iter().zip(c.iter().skip(1)).map(|(b, c)| b * c).sum();
            solutions.iter().map(of_channel).collect()
        };
        Ok(located_mm(&self.grid, &offsets, influence, touches))
    }
}

/// Errors of least squares with the true influence functions and offsets.
pub fn errors_with_known_functions_mm(bench: &RawBench, touches: &[Row]) -> Vec<f64> {
    let grid = if bench.extent.width_m().is_some() { plate_grid() } else { strip_grid() };
    located_mm(&grid, &bench.offsets, &bench.influences, touches)
}

/// Locates at the node with the smallest residual, with the best non-negative force.
fn located_mm(
    grid: &[Position],
    offsets: &[f64],
    influence: impl Fn(Position) -> Vec<f64>,
    touches: &[Row],
) -> Vec<f64> {
    let table: Vec<Vec<f64>> = grid.iter().map(|at| influence(*at)).collect();
    let error_mm = |touch: &Row| {
        let d: Vec<f64> = touch.reading.iter().zip(offsets).map(|(counts, offset)| counts - offset).collect();
        let residual = |f: &[f64]| {
            let (fd, ff) = f.iter().zip(&d).fold((0.0, 0.0), |(fd, ff), (f, d)| (fd + f * d, ff + f * f));
            let force_n = (fd / ff).max(0.0);
            f.iter().zip(&d).map(|(f, d)| (d - force_n * f).powi(2)).sum::<f64>()
        };
        let (mut best, mut smallest) = (grid[0], f64::INFINITY);
        for (at, functions) in grid.iter().zip(&table) {
            let residual = residual(functions);
            if residual < smallest {
                (best, smallest) = (*at, residual);
            }
        }
        1e3 * best.distance_m(touch.position)
    };
    touches.iter().map(error_mm).collect()
}

fn strip_grid() -> Vec<Position> {
    const STEPS: usize = 1300;
    let span_m = STRIP_M - 2.0 * MARGIN_M;
    (0..=STEPS).map(|i| Position::along(MARGIN_M + span_m * i as f64 / STEPS as f64)).collect()
}

fn plate_grid() -> Vec<Position> {
    const STEPS: [usize; 2] = [160, 110];
    let place = |i: usize, n: usize, size_m: f64| MARGIN_M + (size_m - 2.0 * MARGIN_M) * i as f64 / n as f64;
    let node = |(i, j)| Position { x_m: place(i, STEPS[0], PLATE_M[0]), y_m: place(j, STEPS[1], PLATE_M[1]) };
    (0..=STEPS[0]).flat_map(|i| (0..=STEPS[1]).map(move |j| (i, j))).map(node).collect()
}

/// Cubic B-splines over even knots from 0 to 1 with fourfold ends (de Boor's recursion).
fn cubic_basis(t: f64, count: usize) -> Vec<f64> {
    let pieces = count - 3;
    let knot = |i: usize| (i.saturating_sub(3).min(pieces)) as f64 / pieces as f64;
    let t = t.clamp(0.0, 1.0);
    let cell = ((t * pieces as f64) as usize).min(pieces - 1) + 3;
    let mut values: Vec<f64> = (0..count + 3).map(|i| f64::from(u8::from(i == cell))).collect();
    for degree in 1..=3 {
        for i in 0..count + 3 - degree {
            let part = |from: usize, to: usize, at: f64| {
                let width = knot(to) - knot(from);
                if width > 0.0 { at / width } else { 0.0 }
            };
            let left = part(i, i + degree, t - knot(i));
            let right = part(i + 1, i + degree + 1, knot(i + degree + 1) - t);
            values[i] = left * values[i] + right * values.get(i + 1).copied().unwrap_or(0.0);
        }
    }
    values.truncate(count);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_sum_to_one_and_have_straight_lines() {
        for i in 0..=20 {
            let t = f64::from(i) / 20.0;
            let values = cubic_basis(t, 9);
            assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{t}: {values:?}");
            // Greville's abscissae: the mean of three knots.
            let knot = |i: usize| (i.saturating_sub(3).min(6)) as f64 / 6.0;
            let line: f64 = (0..9).map(|i| values[i] * (knot(i + 1) + knot(i + 2) + knot(i + 3)) / 3.0).sum();
            assert!((line - t).abs() < 1e-12, "{t}: {line}");
        }
    }

    #[test]
    fn contacts_without_noise_are_located_within_a_step_by_known_functions() {
        let mut bench = RawBench::strip(0, 20, 10).unwrap();
        let mut touches = bench.touches(20);
        for row in &mut touches {
            let contact = palpate::prelude::Contact { position: row.position, force_n: row.force_n.unwrap() };
            row.reading = bench.clean_reading(contact);
        }
        let errors_mm = errors_with_known_functions_mm(&bench, &touches);
        assert!(errors_mm.iter().all(|error_mm| *error_mm < 0.21), "{errors_mm:?}");
    }
}
