//! How probable the surroundings of each minimum are, and the moments of position and force there.
//!
//! Minima that are narrow and clear of the edges are normal distributions (Laplace's approximation). Where one of them is
//! not, the probability is summed up over the surface instead: near an edge it is cut off, and where the readings tell
//! little it is bent. Of the coarse cells those that could matter are halved until the misfit is smooth within their parts, each
//! with the force that is best there; a part that is too far from the reading is left out with all that it holds. The prior is flat over the surface,
//! and in the size of the signal.

use super::coarse::{MOST_VALLEYS, Profile};
use super::refine::solve;
use super::search::{Minimum, Search};
use crate::influence::belief::ForceBelief;

/// The surroundings of a minimum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Mode {
    /// Its share of the probability.
    pub weight: f64,
    /// Mean of x, y and W.
    pub mean: [f64; 3],
    /// Covariance of the three: xx, xy, xf, yy, yf, ff.
    pub covariance: [f64; 6],
}

/// A minimum with a wider standard deviation, in lengths of a coarse cell, is no paraboloid.
const MOST_CELLS: f64 = 0.6;
/// So many standard deviations from an edge, an edge does not matter.
const CLEAR: f64 = 3.0;
/// A misfit this much above the best has no probability worth adding up: e⁻⁶.
const CUT: f64 = 12.0;
/// A block stands for its middle when its whitened length is no longer: the sum over a normal distribution at steps of h
/// standard deviations is off by 2·e^(−2π²/h²), a hundredth.
const FINE: f64 = 2.0;
/// No block is halved below this, however loud the readings are.
const LEAST_M: f64 = 1e-9;

impl Search {
    /// The surroundings of each of `minima`, the most probable first.
    pub fn modes(
        &self,
        whitened: &[f64],
        minima: &[Minimum],
        profile: &Profile,
    ) -> ([Mode; MOST_VALLEYS], usize) {
        let mut modes = [Mode::default(); MOST_VALLEYS];
        let are_plain = minima.iter().zip(&mut modes).all(|(minimum, mode)| {
            let plain = self.plain(minimum, minima[0].misfit);
            plain.inspect(|plain| *mode = *plain).is_some()
        });
        if !are_plain {
            self.sum_up(whitened, minima, profile, &mut modes);
        }
        let modes_sum: f64 = modes[..minima.len()].iter().map(|mode| mode.weight).sum();
        modes[..minima.len()].iter_mut().for_each(|mode| mode.weight /= modes_sum);
        modes[..minima.len()].sort_by(|a, b| b.weight.total_cmp(&a.weight));
        (modes, minima.len())
    }

    /// A minimum as a normal distribution, its weight relative to the misfit `reference`; `None` where it is wide, near an
    /// edge, or not told at all.
    fn plain(&self, minimum: &Minimum, reference: f64) -> Option<Mode> {
        let covariance = self.covariance(minimum)?;
        let [xx, xy, _, yy, ..] = covariance;
        let sd_m = [xx.sqrt(), yy.sqrt()];
        let narrow = (0..2).all(|k| {
            sd_m[k] <= MOST_CELLS * self.coarse.cell_m[k]
                && CLEAR * sd_m[k] < minimum.at[k]
                && CLEAR * sd_m[k] < self.size_m[k] - minimum.at[k]
        });
        let volume = 2.0 * std::f64::consts::PI * (xx * yy - xy * xy).max(0.0).sqrt();
        let weight = (0.5 * (reference - minimum.misfit)).exp() * volume;
        (narrow && weight.is_finite()).then_some(Mode { weight, mean: minimum.at, covariance })
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

    /// Sums the probability up: what lies nearest to a minimum is its mode's.
    fn sum_up(&self, whitened: &[f64], minima: &[Minimum], profile: &Profile, modes: &mut [Mode]) {
        let best = minima[0].misfit;
        let mut moments = [Moments::default(); MOST_VALLEYS];
        let most = best + CUT;
        let mut blocks = Vec::with_capacity(64);
        for cell in (0..self.coarse.cells()).filter(|cell| self.floor(profile, *cell) <= most) {
            let force_n = profile.force_n(cell, self.force);
            blocks.push(Block {
                middle_m: self.coarse.middle_m(cell),
                size_m: self.coarse.cell_m,
                length: self.coarse.lengths[cell].map(|length| force_n * length),
            });
            while let Some(block) = blocks.pop() {
                let (force_n, misfit) = self.profiled(whitened, block.middle_m);
                if block.floor(misfit) > most {
                    continue;
                }
                if let Some(halves) = block.halves() {
                    blocks.extend(halves);
                } else {
                    let weight = (0.5 * (best - misfit)).exp() * block.size_m[0] * block.size_m[1];
                    let [x_m, y_m] = block.middle_m;
                    moments[nearest(minima, block.middle_m)].add(weight, [x_m, y_m, force_n]);
                }
            }
        }
        for ((mode, moments), minimum) in modes.iter_mut().zip(&moments).zip(minima) {
            *mode = moments.mode(minimum);
            let told = minimum.information[2][2];
            if told > 0.0 && !matches!(self.force, ForceBelief::Known(_)) {
                mode.covariance[5] += 1.0 / told;
            }
        }
    }
}

/// A part of the surface, which is halved until its middle stands for it.
#[derive(Clone, Copy)]
struct Block {
    middle_m: [f64; 2],
    size_m: [f64; 2],
    /// How far apart the whitened readings of its ends are, along and across.
    length: [f64; 2],
}

impl Block {
    /// About the least misfit within it, from that of its middle.
    fn floor(&self, misfit: f64) -> f64 {
        let reach = 0.5 * self.length[0].hypot(self.length[1]);
        let closest = (misfit.max(0.0).sqrt() - reach).max(0.0);
        closest * closest
    }

    /// Its halves along the longer way; `None` of one that is short both ways.
    fn halves(&self) -> Option<[Self; 2]> {
        let k = usize::from(self.length[1] > self.length[0]);
        if self.length[k].is_nan() || self.length[k] <= FINE || self.size_m[k] <= LEAST_M {
            return None;
        }
        let half = |side: f64| {
            let mut block = *self;
            block.size_m[k] *= 0.5;
            block.length[k] *= 0.5;
            block.middle_m[k] += side * 0.5 * block.size_m[k];
            block
        };
        Some([half(-1.0), half(1.0)])
    }
}

/// Which minimum is nearest to a place.
fn nearest(minima: &[Minimum], at: [f64; 2]) -> usize {
    if minima.len() == 1 {
        return 0;
    }
    let square = |minimum: &Minimum| (minimum.at[0] - at[0]).powi(2) + (minimum.at[1] - at[1]).powi(2);
    let by_distance = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    minima.iter().map(square).enumerate().min_by(by_distance).map_or(0, |(i, _)| i)
}

/// Sums from which mean and covariance follow.
#[derive(Clone, Copy, Default)]
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

    /// The mode of these moments; where nothing was added, the minimum without a weight.
    fn mode(&self, minimum: &Minimum) -> Mode {
        if self.weight <= 0.0 {
            return Mode { weight: 0.0, mean: minimum.at, covariance: [0.0; 6] };
        }
        let mean @ [x, y, f] = self.first.map(|sum| sum / self.weight);
        let mut covariance = self.second.map(|sum| sum / self.weight);
        let squares = [x * x, x * y, x * f, y * y, y * f, f * f];
        covariance.iter_mut().zip(squares).for_each(|(value, square)| *value -= square);
        for variance in [0, 3, 5] {
            covariance[variance] = covariance[variance].max(0.0);
        }
        Mode { weight: self.weight, mean, covariance }
    }
}
