//! Where a reading's misfit is least: Levenberg's steps down the valleys (K. Levenberg, Quart. Appl. Math. 2, 1944, with Marquardt's scaling by
//! the diagonal).

use super::cells::Look;
use super::layers::{LANES, Lanes};
use super::{Explain, Unknowns};
use palpate_numerics::small::{Ldl, Matrix};

/// JᵀV⁻¹J and JᵀV⁻¹e of some unknowns, V the variances, e the residual and J the reading's derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::influence) struct Equations {
    /// eᵀV⁻¹e.
    pub misfit: f64,
    pub right: [f64; 3],
    pub information: Matrix<3>,
}

impl Equations {
    /// From the weights V⁻¹, the residual and the derivatives of groups of channels.
    #[inline(always)]
    pub fn of(channels: impl Iterator<Item = (Lanes, Lanes, [Lanes; 3])>) -> Self {
        let mut sums = [[0.0; LANES]; 10];
        for (weights, e, j) in channels {
            for l in 0..LANES {
                let [x, y, t] = [j[0][l], j[1][l], j[2][l]];
                let (we, wx, wy) = (weights[l] * e[l], weights[l] * x, weights[l] * y);
                let terms = [
                    we * e[l],
                    we * x,
                    we * y,
                    we * t,
                    wx * x,
                    wx * y,
                    wx * t,
                    wy * y,
                    wy * t,
                    weights[l] * t * t,
                ];
                for k in 0..10 {
                    sums[k][l] += terms[k];
                }
            }
        }
        let [misfit, ex, ey, et, xx, xy, xt, yy, yt, tt] = sums.map(|lanes| lanes.iter().sum::<f64>());
        Self { misfit, right: [ex, ey, et], information: [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]] }
    }

    /// With what is expected of the latent number: a normal density of this mean and precision.
    pub fn with_expected(mut self, latent: f64, [mean, precision]: [f64; 2]) -> Self {
        let off = latent - mean;
        self.misfit += off * off * precision;
        self.right[2] -= off * precision;
        self.information[2][2] += precision;
        self
    }
}

/// A minimum of the misfit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Minimum {
    pub at: Unknowns,
    /// −2·ln of the posterior density of its place, less a constant, and χ² there.
    pub cost: f64,
    pub misfit: f64,
    pub information: Matrix<3>,
}

/// A minimum this much above the best has a share of e⁻¹² of the probability.
const NEGLIGIBLE: f64 = 24.0;
/// Valleys that may matter; more hardly ever compete.
const MOST_VALLEYS: usize = 8;
/// Steps, those that were refused included.
const MOST_STEPS: usize = 40;
/// A step that lowers the misfit by less than this, a thirtieth of a standard deviation, is the last one.
const SMALL: f64 = 1e-3;
/// Times that the variances are taken anew.
const ROUNDS: usize = 2;

/// The minima that matter, best first; none where no cell explains the reading at all.
pub(super) fn minima<E: Explain>(reading: &mut E, looks: &[Look]) -> Vec<Minimum> {
    let cells = reading.cells();
    let mut found: Vec<Minimum> = Vec::with_capacity(MOST_VALLEYS);
    let mut best = f64::INFINITY;
    for cell in cells.valleys(looks, MOST_VALLEYS) {
        let Look { misfit, cost, latent } = looks[cell];
        let [along, across] = reading.lengths(cells.middle(cell), latent);
        let [(x0, x1), (y0, y1)] = cells.span(cell);
        let reach = 0.5 * (along * (x1 - x0)).hypot(across * (y1 - y0));
        if floor(misfit, reach) + (cost - misfit) > best + NEGLIGIBLE {
            continue;
        }
        let [x, y] = cells.middle(cell).map(|node| node as f64);
        let minimum = refined(reading, [x, y, latent]);
        if !minimum.cost.is_finite() {
            continue;
        }
        best = best.min(minimum.cost);
        match (0..found.len()).find(|i| same(reading, &found[*i], &minimum)) {
            Some(i) if minimum.cost < found[i].cost => found[i] = minimum,
            Some(_) => {}
            None => found.push(minimum),
        }
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    found.retain(|minimum| minimum.cost <= best + NEGLIGIBLE);
    found
}

/// About the least misfit within `reach` of a place, over the noise.
pub(super) fn floor(misfit: f64, reach: f64) -> f64 {
    let closest = (misfit.max(0.0).sqrt() - reach).max(0.0);
    closest * closest
}

/// Whether two minima lie in one valley: on the straight way between them the cost hardly rises.
fn same<E: Explain>(reading: &mut E, a: &Minimum, b: &Minimum) -> bool {
    const RISE: f64 = 1.0;
    const CLOSE: f64 = 0.05;
    let close = (0..2).all(|k| (a.at[k] - b.at[k]).abs() < CLOSE);
    close || highest_between(reading, a, b) <= a.cost.max(b.cost) + RISE
}

/// Number of the mode of each minimum, from 0: minima between which the density does not fall to a hundredth of the best one's are one mode.
pub(super) fn modes<E: Explain>(reading: &mut E, minima: &[Minimum]) -> Vec<usize> {
    let valley = -2.0 * 0.01_f64.ln();
    let mut modes: Vec<usize> = Vec::with_capacity(minima.len());
    let mut count = 0;
    for (i, minimum) in minima.iter().enumerate() {
        let most = minima[0].cost + valley;
        let of = (0..i).find(|other| highest_between(reading, &minima[*other], minimum) <= most);
        modes.push(of.map_or(count, |other| modes[other]));
        count += usize::from(of.is_none());
    }
    modes
}

/// The highest cost on the straight way between two minima.
fn highest_between<E: Explain>(reading: &mut E, a: &Minimum, b: &Minimum) -> f64 {
    const STEPS: usize = 8;
    let costs = (1..STEPS).map(|step| {
        let t = step as f64 / STEPS as f64;
        let [x, y, latent] = std::array::from_fn(|k| a.at[k] + t * (b.at[k] - a.at[k]));
        reading.explain([x, y], latent).cost
    });
    costs.fold(f64::NEG_INFINITY, f64::max)
}

/// The minimum near a contact.
fn refined<E: Explain>(reading: &mut E, start: Unknowns) -> Minimum {
    let nodes = reading.axes().map(|axis| (axis.count - 1) as f64);
    let (least, most) = reading.range().unwrap_or((start[2], start[2]));
    let ends = [(0.0, nodes[0]), (0.0, nodes[1]), (least, most)];
    let held = |at: Unknowns| std::array::from_fn(|k| at[k].clamp(ends[k].0, ends[k].1));
    let mut at: Unknowns = held(start);
    let mut here = Equations::default();
    for _ in 0..ROUNDS {
        // Within one round the variances stay, so that misfits can be compared.
        let near = at;
        here = reading.equations(at, near);
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let Some(step) = damped_step(&here, at, &ends, damping) else { break };
            let next = held(std::array::from_fn(|k| at[k] + step[k]));
            let gain: f64 = (0..3).map(|k| (next[k] - at[k]) * here.right[k]).sum();
            let there = reading.equations(next, near);
            if there.misfit <= here.misfit {
                (at, here) = (next, there);
                damping = (0.1 * damping).max(1e-9);
            } else {
                damping = (10.0 * damping).max(1e-3);
            }
            if gain.abs() <= SMALL {
                break;
            }
        }
    }
    let explained = reading.explain([at[0], at[1]], at[2]);
    Minimum { at, cost: explained.cost, misfit: explained.misfit, information: here.information }
}

/// The damped step of those unknowns that are free: at an end, the one that leads beyond it is not. `None` where no unknown is free or the
/// reading tells nothing.
fn damped_step(
    equations: &Equations,
    at: Unknowns,
    ends: &[(f64, f64); 3],
    damping: f64,
) -> Option<Unknowns> {
    let free: [bool; 3] = std::array::from_fn(|k| {
        let (least, most) = ends[k];
        let right = equations.right[k];
        least < most && !(at[k] <= least && right < 0.0 || at[k] >= most && right > 0.0)
    });
    if free == [false; 3] {
        return None;
    }
    let mut matrix = equations.information;
    for (k, row) in matrix.iter_mut().enumerate() {
        row[k] *= 1.0 + damping;
    }
    Some(Ldl::of_free(&matrix, free)?.solve(equations.right))
}
