//! Posterior of a contact on a plane with a prior flat over the surface and in the size of the signal.
//!
//! A single minimum that is narrow, away from the edges and nearly parabolic is a normal distribution
//! (Laplace's approximation). Any other posterior is integrated: relevant coarse cells are halved until χ² is
//! smooth within each part, at the best force. For an unknown force, `not_excluded` then gives the intervals.

use super::coarse::{MOST_VALLEYS, Profile};
use super::confidence_region::PlaceProfile;
use super::search::{ForceProfile, Minimum, Search};
use crate::influence::config::ForceBelief;
use crate::influence::levenberg::Unknowns;
use crate::influence::moments::Moments;
use crate::status::OTHER_PLACE;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::small::{Ldl, principal_direction, principal_variances};
use palpate_numerics::{ELLIPSE_95, clamped_interval, normal_interval_95};

#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    whitened: Vec<f64>,
    profile: Profile,
    blocks: Vec<Block>,
    leaves: Vec<Leaf>,
}

pub(super) fn locate(search: &Search, reading: &[f64], scratch: &mut Scratch) -> Estimate {
    let square = search.whiten(reading, &mut scratch.whitened);
    let (minima, count) = search.minima(square, &scratch.whitened, &mut scratch.profile);
    let (minima, best) = (&minima[..count], minima[0]);
    if search.rule.is_no_contact(square, best.misfit) {
        return Estimate::of_position(position(best.at), Status::NoContact);
    }
    let surroundings = search.surroundings(minima, scratch);
    let modes = surroundings.modes();
    let alone = |mode: &Mode| contact(search, mode, mode.covariance);
    let mut estimate = Estimate::of_contact(contact(search, &modes[0], surroundings.region), Status::Located);
    let is_traded_off =
        matches!(surroundings.shape, Shape::Bent | Shape::Summed) && search.force == ForceBelief::Unknown;
    if let (true, Some(uncertainty)) = (is_traded_off, &mut estimate.contact.uncertainty) {
        let profile = scratch.leaves.iter().map(|leaf| leaf.profile);
        search
            .confidence_region((&scratch.whitened, square), minima, profile, modes[0].mean)
            .write(uncertainty);
    }
    for mode in modes[1..].iter().filter(|mode| mode.weight >= OTHER_PLACE) {
        estimate.modes.push(palpate_core::Mode { contact: alone(mode), probability: mode.weight });
        estimate.status = Status::Ambiguous;
    }
    if !search.is_explained(best.misfit, minima, &scratch.whitened) {
        estimate.status = Status::OutsideModel;
    }
    estimate
}

fn position([x_m, y_m, _]: Unknowns) -> Position {
    Position { x_m, y_m }
}

fn contact(search: &Search, mode: &Mode, covariance: [f64; 6]) -> ContactEstimate {
    let interval = |k: usize, variance: f64| {
        clamped_interval(normal_interval_95(mode.mean[k], variance.sqrt()), search.size_m[k])
    };
    let uncertainty = Uncertainty {
        covariance,
        x_95_m: interval(0, covariance[0]),
        y_95_m: interval(1, covariance[3]),
        force_95_n: None,
    };
    ContactEstimate {
        position: position(mode.mean),
        // Rounding can move a mean of forces beyond the bound.
        force_n: Some(mode.mean[2].min(search.greatest_force_n)),
        uncertainty: Some(uncertainty),
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Mode {
    /// Probability.
    pub weight: f64,
    /// x, y and W.
    pub mean: [f64; 3],
    /// xx, xy, xf, yy, yf, ff.
    pub covariance: [f64; 6],
}

#[derive(Clone, Copy, Debug)]
struct Surroundings {
    modes: [Mode; MOST_VALLEYS],
    count: usize,
    /// Covariance of a 95 % ellipse with 95 % of the probability.
    pub region: [f64; 6],
    pub shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// Normal in places and forces.
    Normal,
    /// Normal in places only.
    Bent,
    /// Integrated over parts.
    Summed,
    /// Without a fit.
    Unexplained,
}

impl Surroundings {
    /// Most probable first.
    pub fn modes(&self) -> &[Mode] {
        &self.modes[..self.count]
    }
}

/// Greatest standard deviation of a paraboloid, in lengths of a coarse cell.
const MOST_CELLS: f64 = 0.6;
/// Distance from an edge without effect, in standard deviations.
const CLEAR: f64 = 3.0;
/// Greatest deviation from a rise of 4 at two standard deviations.
const MOST_BENT: f64 = 1.0;
/// Greatest nonlinearity of the best force, in standard deviations.
const MOST_BENT_FORCE: f64 = 0.25;
/// Rise of the cost to a negligible probability: e⁻⁶.
const CUT: f64 = 12.0;
/// Greatest whitened length of a block: a sum over a normal distribution at steps of h standard deviations
/// errs by 2·e^(−2π²/h²), a hundredth.
const FINE: f64 = 2.0;
/// Share of the greatest force above which that bound may be active within a block.
const HELD: f64 = 0.5;
const LEAST_M: f64 = 1e-9;
/// Only readings far beyond the model need more.
const MOST_BLOCKS: usize = 200_000;

impl Search {
    fn surroundings(&self, minima: &[Minimum], scratch: &mut Scratch) -> Surroundings {
        let mut modes = [Mode::default(); MOST_VALLEYS];
        let are_plain = minima.iter().zip(&mut modes).all(|(minimum, mode)| {
            let plain = self.plain(minimum, &minima[0]);
            plain.inspect(|plain| *mode = *plain).is_some()
        });
        let sum: f64 = modes.iter().map(|mode| mode.weight).sum();
        let is_alone = are_plain && modes[0].weight >= (1.0 - OTHER_PLACE) * sum;
        let alone = if is_alone { self.shape(&scratch.whitened, &modes[0]) } else { Shape::Summed };
        if alone != Shape::Summed {
            modes[0].weight = 1.0;
            scratch.leaves.clear();
            return Surroundings { modes, count: 1, region: modes[0].covariance, shape: alone };
        }
        if self.sum_up(minima, scratch) {
            self.summed(minima, &mut scratch.leaves)
        } else {
            self.nothing_summed(&minima[0])
        }
    }

    /// Normal distribution weighted relative to `best`; `None` where the minimum is wide, near a bound or
    /// undetermined.
    fn plain(&self, minimum: &Minimum, best: &Minimum) -> Option<Mode> {
        let covariance = self.covariance(minimum)?;
        let [xx, xy, _, yy, ..] = covariance;
        let sd_m = [xx.sqrt(), yy.sqrt()];
        let narrow = (0..2).all(|k| {
            sd_m[k] <= MOST_CELLS * self.coarse.cell_m[k]
                && CLEAR * sd_m[k] < minimum.at[k]
                && CLEAR * sd_m[k] < self.size_m[k] - minimum.at[k]
        });
        // Also true of an infinite bound.
        let is_free = CLEAR * covariance[5].sqrt() < self.greatest_force_n - minimum.at[2];
        let volume = 2.0 * std::f64::consts::PI * (xx * yy - xy * xy).max(0.0).sqrt();
        let weight = (0.5 * (self.cost(best) - self.cost(minimum))).exp() * volume;
        (narrow && is_free && weight.is_finite()).then_some(Mode { weight, mean: minimum.at, covariance })
    }

    /// −2·ln of the likelihood, less a constant.
    fn cost(&self, minimum: &Minimum) -> f64 {
        minimum.misfit + self.spread([minimum.at[0], minimum.at[1]])
    }

    /// Shape by χ² and best force two standard deviations away along both axes.
    fn shape(&self, whitened: &[f64], mode: &Mode) -> Shape {
        let [xx, xy, _, yy, _, ff] = mode.covariance;
        let [longer, shorter] = principal_variances([xx, xy, yy]).map(f64::sqrt);
        let [cos, sin] = principal_direction([xx, xy, yy]);
        let [x_m, y_m, _] = mode.mean;
        let here = self.profiled(whitened, [x_m, y_m]);
        let axes = [[longer * cos, longer * sin], [-shorter * sin, shorter * cos]];
        let ends = axes.map(|[along, across]| {
            [2.0, -2.0].map(|side| self.profiled(whitened, [x_m + side * along, y_m + side * across]))
        });
        if ends.as_flattened().iter().any(|there| (there.misfit - here.misfit - 4.0).abs() > MOST_BENT) {
            return Shape::Summed;
        }
        let is_straight = |[ahead, behind]: &[ForceProfile; 2]| {
            let bent_n = 0.5 * (ahead.force_n + behind.force_n) - here.force_n;
            bent_n.abs() <= MOST_BENT_FORCE * ff.sqrt()
        };
        if ends.iter().all(is_straight) { Shape::Normal } else { Shape::Bent }
    }

    fn covariance(&self, minimum: &Minimum) -> Option<[f64; 6]> {
        let free = [true, true, self.force.known_n().is_none()];
        let [[xx, xy, xf], [_, yy, yf], [_, _, ff]] = Ldl::of_free(&minimum.information, free)?.inverse();
        Some([xx, xy, xf, yy, yf, ff])
    }

    /// Collects relevant parts in `leaves`; false where they are too many.
    fn sum_up(&self, minima: &[Minimum], scratch: &mut Scratch) -> bool {
        let Scratch { whitened, profile, blocks, leaves } = scratch;
        leaves.clear();
        blocks.clear();
        let mut profile_of = 0;
        let best = self.cost(&minima[0]);
        let most = best + CUT;
        for cell in 0..self.coarse.cells() {
            let middle_m = self.coarse.middle_m(cell);
            if self.floor(profile, cell) + self.spread(middle_m) > most {
                continue;
            }
            let force_n = profile.force_n(cell, self.force).min(self.greatest_force_n);
            blocks.push(Block {
                middle_m,
                size_m: self.coarse.cell_m,
                length: self.coarse.lengths[cell].map(|length| force_n * length),
                held_length: self.coarse.whole_lengths[cell].map(|length| self.greatest_force_n * length),
            });
            while let Some(block) = blocks.pop() {
                profile_of += 1;
                if profile_of > MOST_BLOCKS {
                    return false;
                }
                let there = self.profiled(whitened, block.middle_m);
                let ForceProfile { force_n, misfit, .. } = there;
                let length = block.length_with(&there, self.greatest_force_n);
                let spread = self.spread(block.middle_m);
                if floor_within(misfit, length) + spread > most {
                    continue;
                }
                if let Some(halves) = block.halves(length) {
                    blocks.extend(halves);
                } else {
                    let area = block.size_m[0] * block.size_m[1];
                    let [x_m, y_m] = block.middle_m;
                    leaves.push(Leaf {
                        weight: (0.5 * (best - misfit - spread)).exp() * area,
                        profile: PlaceProfile {
                            at: [x_m, y_m, force_n],
                            cost: misfit + spread,
                            steps: [0.5 * block.size_m[0], 0.5 * block.size_m[1], there.sd_n()],
                        },
                        mode: nearest(minima, block.middle_m),
                        distance: 0.0,
                    });
                }
            }
        }
        true
    }

    fn summed(&self, minima: &[Minimum], leaves: &mut [Leaf]) -> Surroundings {
        let mut moments = [Moments::default(); MOST_VALLEYS];
        let mut all = Moments::default();
        for leaf in &*leaves {
            moments[leaf.mode].add(leaf.weight, leaf.profile.at);
            all.add(leaf.weight, leaf.profile.at);
        }
        if !(all.weight.is_finite() && all.weight > 0.0) {
            return self.nothing_summed(&minima[0]);
        }
        let mut modes = [Mode::default(); MOST_VALLEYS];
        for ((mode, moments), minimum) in modes.iter_mut().zip(&moments).zip(minima) {
            *mode = mode_of(moments, minimum);
            mode.weight /= all.weight;
            mode.covariance[5] += self.own_variance(minimum);
        }
        let count = minima.len();
        modes[..count].sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let ([x, y, f], mut covariance) = all.mean_and_covariance();
        let [dx, dy, df] = [x - modes[0].mean[0], y - modes[0].mean[1], f - modes[0].mean[2]];
        let squares = [dx * dx, dx * dy, dx * df, dy * dy, dy * df, df * df];
        covariance.iter_mut().zip(squares).for_each(|(value, square)| *value += square);
        covariance[5] += self.own_variance(&minima[0]);
        let growth = growth(leaves, modes[0].mean, &covariance);
        Surroundings { modes, count, region: covariance.map(|value| growth * value), shape: Shape::Summed }
    }

    fn own_variance(&self, minimum: &Minimum) -> f64 {
        let told = minimum.information[2][2];
        if self.force.known_n().is_some() || told <= 0.0 { 0.0 } else { 1.0 / told }
    }

    /// Variance of a uniform distribution over the surface.
    fn nothing_summed(&self, minimum: &Minimum) -> Surroundings {
        let [xx, yy] = self.size_m.map(|size_m| size_m * size_m / 12.0);
        let region = [xx, 0.0, 0.0, yy, 0.0, self.own_variance(minimum)];
        let mut modes = [Mode::default(); MOST_VALLEYS];
        modes[0] = Mode { weight: 1.0, mean: minimum.at, covariance: region };
        Surroundings { modes, count: 1, region, shape: Shape::Unexplained }
    }
}

fn mode_of(moments: &Moments, minimum: &Minimum) -> Mode {
    if moments.weight <= 0.0 {
        return Mode { weight: 0.0, mean: minimum.at, covariance: [0.0; 6] };
    }
    let (mean, covariance) = moments.mean_and_covariance();
    Mode { weight: moments.weight, mean, covariance }
}

/// Factor of a covariance for a 95 % ellipse with 95 % of the leaves.
fn growth(leaves: &mut [Leaf], about: [f64; 3], covariance: &[f64; 6]) -> f64 {
    let [xx, xy, _, yy, ..] = *covariance;
    let Some(factors) = Ldl::new(&[[xx, xy], [xy, yy]]) else { return 1.0 };
    for leaf in &mut *leaves {
        leaf.distance = factors.quadratic([leaf.profile.at[0] - about[0], leaf.profile.at[1] - about[1]]);
    }
    leaves.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance));
    let all: f64 = leaves.iter().map(|leaf| leaf.weight).sum();
    // Half of a leaf lies within the ellipse through its middle; shares are interpolated between leaves.
    let (mut inside, mut last) = (0.0, (0.0, 0.0));
    for leaf in &*leaves {
        let held = (inside + 0.5 * leaf.weight) / all;
        if held >= 0.95 {
            let (distance, share) = last;
            let part = if held > share { (0.95 - share) / (held - share) } else { 1.0 };
            return (distance + part * (leaf.distance - distance)) / ELLIPSE_95;
        }
        inside += leaf.weight;
        last = (leaf.distance, held);
    }
    1.0
}

#[derive(Clone, Copy, Debug)]
struct Leaf {
    /// Unnormalized.
    weight: f64,
    profile: PlaceProfile,
    mode: usize,
    /// Squared distance from the estimate, in standard deviations.
    distance: f64,
}

/// Part of the surface, halved until its middle represents it.
#[derive(Clone, Copy, Debug)]
struct Block {
    middle_m: [f64; 2],
    size_m: [f64; 2],
    /// Whitened distance between the readings of its ends.
    length: [f64; 2],
    /// Length at the greatest force.
    held_length: [f64; 2],
}

impl Block {
    /// Lengths at the greatest force where that bound may be active.
    fn length_with(&self, best: &ForceProfile, greatest_force_n: f64) -> [f64; 2] {
        let is_near = best.force_n > HELD * greatest_force_n;
        // At the weakest place within, the greatest force then reads less than the best force in the middle.
        let reach = 0.5 * self.held_length[0].hypot(self.held_length[1]);
        if is_near && greatest_force_n - best.force_n < reach * best.sd_n() {
            self.held_length
        } else {
            self.length
        }
    }

    /// Halves the longer side; `None` where both are short.
    fn halves(&self, length: [f64; 2]) -> Option<[Self; 2]> {
        let k = usize::from(length[1] > length[0]);
        if length[k].is_nan() || length[k] <= FINE || self.size_m[k] <= LEAST_M {
            return None;
        }
        let half = |side: f64| {
            let mut block = *self;
            block.size_m[k] *= 0.5;
            block.length[k] *= 0.5;
            block.held_length[k] *= 0.5;
            block.middle_m[k] += side * 0.5 * block.size_m[k];
            block
        };
        Some([half(-1.0), half(1.0)])
    }
}

/// Approximate lower bound of χ² within a part.
fn floor_within(misfit: f64, length: [f64; 2]) -> f64 {
    let reach = 0.5 * length[0].hypot(length[1]);
    let closest = (misfit.max(0.0).sqrt() - reach).max(0.0);
    closest * closest
}

fn nearest(minima: &[Minimum], at: [f64; 2]) -> usize {
    if minima.len() == 1 {
        return 0;
    }
    let square = |minimum: &Minimum| (minimum.at[0] - at[0]).powi(2) + (minimum.at[1] - at[1]).powi(2);
    let by_distance = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    minima.iter().map(square).enumerate().min_by(by_distance).map_or(0, |(i, _)| i)
}
