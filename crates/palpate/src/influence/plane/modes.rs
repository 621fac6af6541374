//! How probable the surroundings of a minimum are, and the moments of position and force there.
//!
//! A minimum that is narrow and clear of the edges is a normal distribution (Laplace's approximation). Any other is summed
//! up over a grid along the axes of its covariance, within the surface, with the force that is best at each point: near an
//! edge the distribution is cut off, and where the readings tell little it is bent. The grid follows the moments that it
//! finds, as the first covariance may be far off. A prior that is flat over the surface, and in the size of the signal.

use super::refine::solve;
use super::search::{Minimum, Search};
use crate::influence::belief::ForceBelief;

/// The surroundings of a minimum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Mode {
    /// Its share of the probability, once all are known; before that, up to a common factor.
    pub weight: f64,
    /// Mean of x, y and W.
    pub mean: [f64; 3],
    /// Covariance of the three: xx, xy, xf, yy, yf, ff.
    pub covariance: [f64; 6],
}

/// A minimum with a wider standard deviation, in spacings of the coarse nodes, is no paraboloid.
const MOST_SPACINGS: f64 = 0.4;
/// So many standard deviations from an edge, an edge does not matter.
const CLEAR: f64 = 4.0;
/// Points of the grid each way, and how far it reaches, in standard deviations.
const POINTS: usize = 13;
const REACH: f64 = 3.6;
/// How often the grid follows its moments, at most.
const ROUNDS: usize = 3;

impl Search {
    /// The surroundings of the first of `minima` number `i`, relative to the misfit `reference`.
    pub fn mode(&self, whitened: &[f64], minima: &[Minimum], i: usize) -> Mode {
        let (minimum, reference) = (&minima[i], minima[0].misfit);
        if let Some(covariance) = self.covariance(minimum)
            && self.is_plain(minimum, &covariance)
        {
            let [xx, xy, _, yy, ..] = covariance;
            let volume = 2.0 * std::f64::consts::PI * (xx * yy - xy * xy).max(0.0).sqrt();
            let weight = (0.5 * (reference - minimum.misfit)).exp() * volume;
            return Mode { weight, mean: minimum.at, covariance };
        }
        let mut mode = Mode { weight: 0.0, mean: minimum.at, covariance: self.guess(minimum) };
        for _ in 0..ROUNDS {
            let finer = self.sum_up(whitened, minima, i, &mode);
            let area = |mode: &Mode| mode.covariance[0] * mode.covariance[3] - mode.covariance[1].powi(2);
            let settled = area(&finer) > 0.5 * area(&mode) && area(&finer) < 2.0 * area(&mode);
            if finer.weight > 0.0 {
                mode = finer;
            }
            if settled || finer.weight <= 0.0 {
                break;
            }
        }
        mode
    }

    /// The inverse of the information; `None` where the reading does not tell.
    fn covariance(&self, minimum: &Minimum) -> Option<[f64; 6]> {
        let known = matches!(self.force, ForceBelief::Known(_));
        let free = [true, true, !known];
        let column = |k: usize| {
            let mut unit = [0.0; 3];
            unit[k] = 1.0;
            solve(minimum.information, unit, free)
        };
        let [x, y] = [column(0)?, column(1)?];
        let force = if known { [0.0; 3] } else { column(2)? };
        Some([x[0], x[1], x[2], y[1], y[2], force[2]])
    }

    /// Whether a minimum is narrow, and clear of the edges.
    fn is_plain(&self, minimum: &Minimum, covariance: &[f64; 6]) -> bool {
        let sd_m = [covariance[0].sqrt(), covariance[3].sqrt()];
        minimum.misfit.is_finite()
            && (0..2).all(|k| {
                sd_m[k] <= MOST_SPACINGS * self.coarse.spacing_m[k]
                    && CLEAR * sd_m[k] < minimum.at[k]
                    && CLEAR * sd_m[k] < self.size_m[k] - minimum.at[k]
            })
    }

    /// A first covariance of the position: that of the information and of a position anywhere on the surface.
    fn guess(&self, minimum: &Minimum) -> [f64; 6] {
        let i = &minimum.information;
        let by_force =
            if i[2][2] > 0.0 && !matches!(self.force, ForceBelief::Known(_)) { 1.0 / i[2][2] } else { 0.0 };
        let anywhere = |k: usize| 12.0 / self.size_m[k].powi(2);
        let xx = (i[0][0] - by_force * i[0][2] * i[0][2]).max(0.0) + anywhere(0);
        let yy = (i[1][1] - by_force * i[1][2] * i[1][2]).max(0.0) + anywhere(1);
        let xy = i[0][1] - by_force * i[0][2] * i[1][2];
        let determinant = xx * yy - xy * xy;
        if determinant > 0.0 {
            [yy / determinant, -xy / determinant, 0.0, xx / determinant, 0.0, 0.0]
        } else {
            [1.0 / xx, 0.0, 0.0, 1.0 / yy, 0.0, 0.0]
        }
    }

    /// Sums over a grid around a mode: of the points on the surface, those that are nearer to the minimum than to others.
    fn sum_up(&self, whitened: &[f64], minima: &[Minimum], i: usize, mode: &Mode) -> Mode {
        let [xx, xy, _, yy, ..] = mode.covariance;
        // Cholesky's factor of the position's covariance.
        let along = xx.sqrt();
        let (slope, across) = (xy / along, (yy - xy * xy / xx).max(1e-12 * yy).sqrt());
        let step = 2.0 * REACH / (POINTS - 1) as f64;
        let mut sums = Moments::default();
        for u in 0..POINTS {
            for v in 0..POINTS {
                let (u, v) = (u as f64 * step - REACH, v as f64 * step - REACH);
                let at = [mode.mean[0] + along * u, mode.mean[1] + slope * u + across * v];
                if self.is_on_surface(at) && nearest(minima, at) == i {
                    let (force_n, misfit) = self.profiled(whitened, at);
                    let weight = (0.5 * (minima[0].misfit - misfit)).exp();
                    sums.add(weight, [at[0] - mode.mean[0], at[1] - mode.mean[1], force_n]);
                }
            }
        }
        let mut found = sums.mode(step * step * along * across);
        found.mean[0] += mode.mean[0];
        found.mean[1] += mode.mean[1];
        // A distribution within one point of the grid is as wide as the grid's cells at least.
        found.covariance[0] += step * step * xx / 12.0;
        found.covariance[1] += step * step * xy / 12.0;
        found.covariance[3] += step * step * yy / 12.0;
        let ff = minima[i].information[2][2];
        if ff > 0.0 && !matches!(self.force, ForceBelief::Known(_)) {
            found.covariance[5] += 1.0 / ff;
        }
        found
    }

    fn is_on_surface(&self, at: [f64; 2]) -> bool {
        (0..2).all(|k| (0.0..=self.size_m[k]).contains(&at[k]))
    }
}

/// Which minimum is nearest to a place.
fn nearest(minima: &[Minimum], at: [f64; 2]) -> usize {
    let distance = |minimum: &Minimum| (minimum.at[0] - at[0]).hypot(minimum.at[1] - at[1]);
    let by_distance = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    minima.iter().map(distance).enumerate().min_by(by_distance).map_or(0, |(i, _)| i)
}

/// Sums from which mean and covariance follow.
#[derive(Default)]
struct Moments {
    weight: f64,
    first: [f64; 3],
    second: [f64; 6],
}

impl Moments {
    fn add(&mut self, weight: f64, [x, y, f]: [f64; 3]) {
        self.weight += weight;
        let squares = [x * x, x * y, x * f, y * y, y * f, f * f];
        self.first.iter_mut().zip([x, y, f]).for_each(|(sum, value)| *sum += weight * value);
        self.second.iter_mut().zip(squares).for_each(|(sum, value)| *sum += weight * value);
    }

    fn mode(&self, cell: f64) -> Mode {
        if self.weight <= 0.0 {
            return Mode::default();
        }
        let mean @ [x, y, f] = self.first.map(|sum| sum / self.weight);
        let mut covariance = self.second.map(|sum| sum / self.weight);
        let squares = [x * x, x * y, x * f, y * y, y * f, f * f];
        covariance.iter_mut().zip(squares).for_each(|(value, square)| *value -= square);
        for variance in [0, 3, 5] {
            covariance[variance] = covariance[variance].max(0.0);
        }
        Mode { weight: self.weight * cell, mean, covariance }
    }
}
