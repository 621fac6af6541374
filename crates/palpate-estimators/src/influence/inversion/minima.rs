//! Local minima of a reading's cost, and their modes.

use super::cells::CellFit;
use super::{ContactLikelihood, PlaceFit};
use crate::influence::levenberg::{Unknowns, descend};
use palpate_numerics::small::Matrix;

#[derive(Clone, Copy, Debug)]
pub(super) struct Minimum {
    pub at: Unknowns,
    pub found: PlaceFit,
    pub information: Matrix<3>,
}

/// A minimum this far above the best has e⁻¹² of its probability.
const NEGLIGIBLE: f64 = 24.0;
/// More minima rarely compete.
const MOST_MINIMA: usize = 8;
/// Least decrease of χ² per step: a thirtieth of a standard deviation, squared.
const SMALL: f64 = 1e-3;

/// Returns the relevant minima, best first.
pub(super) fn minima<E: ContactLikelihood>(reading: &mut E, fits: &[CellFit]) -> Vec<Minimum> {
    let cells = reading.cells();
    let mut found: Vec<Minimum> = Vec::with_capacity(MOST_MINIMA);
    let mut best = f64::INFINITY;
    for cell in cells.local_minima(fits, MOST_MINIMA) {
        let CellFit { latent, .. } = fits[cell];
        if least_cost(reading, cell, &fits[cell]) > best + NEGLIGIBLE {
            continue;
        }
        let [x, y] = cells.middle(cell).map(|node| node as f64);
        let minimum = refined(reading, [x, y, latent]);
        if !minimum.found.cost.is_finite() {
            continue;
        }
        best = best.min(minimum.found.cost);
        match (0..found.len()).find(|i| same(reading, &found[*i], &minimum)) {
            Some(i) if minimum.found.cost < found[i].found.cost => found[i] = minimum,
            Some(_) => {}
            None => found.push(minimum),
        }
    }
    found.sort_by(|a, b| a.found.cost.total_cmp(&b.found.cost));
    found.retain(|minimum| minimum.found.cost <= best + NEGLIGIBLE);
    found
}

/// Approximate lower bound of the cost within a cell.
pub(super) fn least_cost<E: ContactLikelihood>(reading: &E, cell: usize, fit: &CellFit) -> f64 {
    let cells = reading.cells();
    let [along, across] = reading.lengths(cells.middle(cell), fit.latent);
    let [(x0, x1), (y0, y1)] = cells.span(cell);
    let reach = 0.5 * (along * (x1 - x0)).hypot(across * (y1 - y0));
    let closest = (fit.misfit.max(0.0).sqrt() - reach).max(0.0);
    closest * closest + (fit.cost - fit.misfit)
}

/// True of one local minimum: on the line between both the cost rises by at most 1.
fn same<E: ContactLikelihood>(reading: &mut E, a: &Minimum, b: &Minimum) -> bool {
    const RISE: f64 = 1.0;
    const CLOSE: f64 = 0.05;
    let close = (0..2).all(|k| (a.at[k] - b.at[k]).abs() < CLOSE);
    close || highest_between(reading, a, b) <= a.found.cost.max(b.found.cost) + RISE
}

/// Returns the mode of each minimum; within a mode the density between minima stays above a hundredth of the
/// best.
pub(super) fn modes<E: ContactLikelihood>(reading: &mut E, minima: &[Minimum]) -> Vec<usize> {
    const VALLEY: f64 = 0.01;
    let rise = -2.0 * VALLEY.ln();
    let mut modes: Vec<usize> = Vec::with_capacity(minima.len());
    let mut count = 0;
    for (i, minimum) in minima.iter().enumerate() {
        let most = minima[0].found.cost + rise;
        let of = (0..i).find(|other| highest_between(reading, &minima[*other], minimum) <= most);
        modes.push(of.map_or(count, |other| modes[other]));
        count += usize::from(of.is_none());
    }
    modes
}

fn highest_between<E: ContactLikelihood>(reading: &mut E, a: &Minimum, b: &Minimum) -> f64 {
    const STEPS: usize = 8;
    let costs = (1..STEPS).map(|step| {
        let t = step as f64 / STEPS as f64;
        let [x, y, latent] = std::array::from_fn(|k| a.at[k] + t * (b.at[k] - a.at[k]));
        reading.fit_place([x, y], latent).cost
    });
    costs.fold(f64::NEG_INFINITY, f64::max)
}

fn refined<E: ContactLikelihood>(reading: &mut E, start: Unknowns) -> Minimum {
    let [x, y] = reading.axes().map(|axis| (0.0, (axis.count - 1) as f64));
    let ends = [x, y, reading.range().unwrap_or((start[2], start[2]))];
    let descend_from = |reading: &mut E, start| {
        reading.weigh(start);
        descend(start, ends, SMALL, |at| reading.equations(at))
    };
    // Constant variances within one descent make χ² comparable.
    let start = [start[0], start[1], start[2].clamp(ends[2].0, ends[2].1)];
    let (near, _) = descend_from(reading, start);
    let (at, equations) = descend_from(reading, near);
    let found = reading.fit_place([at[0], at[1]], at[2]);
    Minimum { at, found, information: equations.information }
}
