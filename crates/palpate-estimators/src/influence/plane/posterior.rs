//! The posterior of a contact on a plane: how probable the surroundings of each minimum are, moments of position and force there, and the
//! estimate that they give.
//!
//! A minimum that is alone, narrow, clear of the edges and no more bent than a paraboloid is a normal distribution (Laplace's
//! approximation), of places and, where the best force is straight as well, of forces. Any other reading's probability is summed up over
//! the surface: near an edge it is cut off, where the readings tell little it is bent, and several minima share it. Of the coarse cells
//! those that could matter are halved until the misfit is smooth within their parts, each with the force that is best there; a part that
//! is too far from the reading is left out with all that it holds. The prior is flat over the surface, and in the size of the signal.
//! Intervals of what is no normal distribution are those of `not_excluded` where nothing is known of the force.

use super::coarse::{MOST_VALLEYS, Profile};
use super::not_excluded::Looked;
use super::search::{Minimum, Profiled, Search};
use crate::influence::config::ForceBelief;
use crate::influence::levenberg::Unknowns;
use crate::influence::moments::Moments;
use crate::status::OTHER_PLACE;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::small::{Ldl, principal_direction, principal_variances};
use palpate_numerics::{ELLIPSE_95, clamped_interval, normal_interval_95};

/// Memory for locating readings.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    whitened: Vec<f64>,
    profile: Profile,
    /// Parts of the surface that are still to be looked at.
    blocks: Vec<Block>,
    /// Those that hold the probability.
    leaves: Vec<Leaf>,
}

/// The estimate of one contact.
///
/// The time of a plain reading is that of the scan, a product for every coarse cell and channel, and of some six of
/// Levenberg's steps, 16 corner numbers × 3 sums for every group of eight channels each. Where the probability is summed up
/// instead, it is that of the misfit at a thousand places or so.
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
        let looked = scratch.leaves.iter().map(|leaf| leaf.looked);
        search.not_excluded((&scratch.whitened, square), minima, looked, modes[0].mean).write(uncertainty);
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

/// A contact with an uncertainty that is held to the surface.
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
        // A mean of forces at the bound is beyond it by rounding.
        force_n: Some(mode.mean[2].min(search.greatest_force_n)),
        uncertainty: Some(uncertainty),
    }
}

/// The surroundings of a minimum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Mode {
    /// Share of the probability.
    pub weight: f64,
    /// Mean of x, y and W.
    pub mean: [f64; 3],
    /// Covariance of the three: xx, xy, xf, yy, yf, ff.
    pub covariance: [f64; 6],
}

/// The posterior of a contact, mode by mode.
#[derive(Clone, Copy, Debug)]
struct Surroundings {
    modes: [Mode; MOST_VALLEYS],
    count: usize,
    /// Covariance about the mean of the first mode: of the normal distribution whose 95 % ellipse is as large as one of this
    /// shape must be to hold 95 % of the probability.
    pub region: [f64; 6],
    pub shape: Shape,
}

/// Shape of the posterior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// A normal distribution.
    Normal,
    /// A normal distribution of places, but not of forces.
    Bent,
    /// Summed up over parts of the surface.
    Summed,
    /// None, of a reading that could not be summed up.
    Unexplained,
}

impl Surroundings {
    /// The most probable first.
    pub fn modes(&self) -> &[Mode] {
        &self.modes[..self.count]
    }
}

/// A minimum with a wider standard deviation, in lengths of a coarse cell, is no paraboloid.
const MOST_CELLS: f64 = 0.6;
/// So many standard deviations from an edge, an edge does not matter.
const CLEAR: f64 = 3.0;
/// At two standard deviations a paraboloid is 4 above its minimum; what is off by more than this is bent.
const MOST_BENT: f64 = 1.0;
/// So many standard deviations the best force there may be off the straight way.
const MOST_BENT_FORCE: f64 = 0.25;
/// A misfit this much above the best has no probability worth adding up: e⁻⁶.
const CUT: f64 = 12.0;
/// A block stands for its middle when its whitened length is no longer: the sum over a normal distribution at steps of h
/// standard deviations is off by 2·e^(−2π²/h²), a hundredth.
const FINE: f64 = 2.0;
/// A part in whose middle the best force is more than so much of the greatest may have places where that holds it.
const HELD: f64 = 0.5;
/// No block is halved below this, however loud the readings are.
const LEAST_M: f64 = 1e-9;
/// More parts than any reading takes that the surface explains. One that is far too loud for it has as many as there are
/// nanometres, all of them as far from it.
const MOST_BLOCKS: usize = 200_000;

impl Search {
    /// The surroundings of `minima`, best first, of the reading in the scratch.
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

    /// A minimum as a normal distribution, its weight relative to that of `best`; `None` where it is wide, near an edge, or
    /// not told at all.
    fn plain(&self, minimum: &Minimum, best: &Minimum) -> Option<Mode> {
        let covariance = self.covariance(minimum)?;
        let [xx, xy, _, yy, ..] = covariance;
        let sd_m = [xx.sqrt(), yy.sqrt()];
        let narrow = (0..2).all(|k| {
            sd_m[k] <= MOST_CELLS * self.coarse.cell_m[k]
                && CLEAR * sd_m[k] < minimum.at[k]
                && CLEAR * sd_m[k] < self.size_m[k] - minimum.at[k]
        });
        // An infinite bound is above all.
        let is_free = CLEAR * covariance[5].sqrt() < self.greatest_force_n - minimum.at[2];
        let volume = 2.0 * std::f64::consts::PI * (xx * yy - xy * xy).max(0.0).sqrt();
        let weight = (0.5 * (self.cost(best) - self.cost(minimum))).exp() * volume;
        (narrow && is_free && weight.is_finite()).then_some(Mode { weight, mean: minimum.at, covariance })
    }

    /// Minus twice the logarithm of the likelihood, but for a constant.
    fn cost(&self, minimum: &Minimum) -> f64 {
        minimum.misfit + self.spread([minimum.at[0], minimum.at[1]])
    }

    /// Shape of the posterior of a mode that is alone, by the misfit and the best force two standard deviations away along both axes.
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
        let is_straight = |[ahead, behind]: &[Profiled; 2]| {
            let bent_n = 0.5 * (ahead.force_n + behind.force_n) - here.force_n;
            bent_n.abs() <= MOST_BENT_FORCE * ff.sqrt()
        };
        if ends.iter().all(is_straight) { Shape::Normal } else { Shape::Bent }
    }

    /// The inverse of the information; `None` where the reading does not tell.
    fn covariance(&self, minimum: &Minimum) -> Option<[f64; 6]> {
        let free = [true, true, self.force.known_n().is_none()];
        let [[xx, xy, xf], [_, yy, yf], [_, _, ff]] = Ldl::of_free(&minimum.information, free)?.inverse();
        Some([xx, xy, xf, yy, yf, ff])
    }

    /// Puts the parts of the surface that hold the probability into the scratch; false where they are too many.
    fn sum_up(&self, minima: &[Minimum], scratch: &mut Scratch) -> bool {
        let Scratch { whitened, profile, blocks, leaves } = scratch;
        leaves.clear();
        blocks.clear();
        let mut looked_at = 0;
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
                looked_at += 1;
                if looked_at > MOST_BLOCKS {
                    return false;
                }
                let there = self.profiled(whitened, block.middle_m);
                let Profiled { force_n, misfit, .. } = there;
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
                        looked: Looked {
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

    /// The modes of what was summed up: what lies nearest to a minimum is its mode's.
    fn summed(&self, minima: &[Minimum], leaves: &mut [Leaf]) -> Surroundings {
        let mut moments = [Moments::default(); MOST_VALLEYS];
        let mut all = Moments::default();
        for leaf in &*leaves {
            moments[leaf.mode].add(leaf.weight, leaf.looked.at);
            all.add(leaf.weight, leaf.looked.at);
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

    /// Variance of a force at a place that is known.
    fn own_variance(&self, minimum: &Minimum) -> f64 {
        let told = minimum.information[2][2];
        if self.force.known_n().is_some() || told <= 0.0 { 0.0 } else { 1.0 / told }
    }

    /// The posterior of a reading that no part of the surface explains: its minimum, with the variance of the whole surface.
    fn nothing_summed(&self, minimum: &Minimum) -> Surroundings {
        let [xx, yy] = self.size_m.map(|size_m| size_m * size_m / 12.0);
        let region = [xx, 0.0, 0.0, yy, 0.0, self.own_variance(minimum)];
        let mut modes = [Mode::default(); MOST_VALLEYS];
        modes[0] = Mode { weight: 1.0, mean: minimum.at, covariance: region };
        Surroundings { modes, count: 1, region, shape: Shape::Unexplained }
    }
}

/// The mode of what lies nearest to a minimum; without a weight where that is nothing.
fn mode_of(moments: &Moments, minimum: &Minimum) -> Mode {
    if moments.weight <= 0.0 {
        return Mode { weight: 0.0, mean: minimum.at, covariance: [0.0; 6] };
    }
    let (mean, covariance) = moments.mean_and_covariance();
    Mode { weight: moments.weight, mean, covariance }
}

/// Factor by which a covariance must grow for its 95 % ellipse about a place to hold 95 % of the leaves.
fn growth(leaves: &mut [Leaf], about: [f64; 3], covariance: &[f64; 6]) -> f64 {
    let [xx, xy, _, yy, ..] = *covariance;
    let Some(factors) = Ldl::new(&[[xx, xy], [xy, yy]]) else { return 1.0 };
    for leaf in &mut *leaves {
        leaf.distance = factors.quadratic([leaf.looked.at[0] - about[0], leaf.looked.at[1] - about[1]]);
    }
    leaves.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance));
    let all: f64 = leaves.iter().map(|leaf| leaf.weight).sum();
    // Half of a leaf lies within the ellipse through its middle; between leaves the share is straight.
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

/// A part of the surface that its middle stands for.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    /// Probability, but for a factor.
    weight: f64,
    looked: Looked,
    /// Index of the nearest minimum.
    mode: usize,
    /// Squared, from the estimate, in standard deviations.
    distance: f64,
}

/// A part of the surface, which is halved until its middle stands for it.
#[derive(Clone, Copy, Debug)]
struct Block {
    middle_m: [f64; 2],
    size_m: [f64; 2],
    /// Distance of the whitened readings of its ends, along and across.
    length: [f64; 2],
    /// The same of contacts with the greatest force, which does not make up for what the place changes.
    held_length: [f64; 2],
}

impl Block {
    /// Lengths where the greatest force could hold contacts within it, by the best in its middle, or those of elsewhere.
    fn length_with(&self, best: &Profiled, greatest_force_n: f64) -> [f64; 2] {
        let is_near = best.force_n > HELD * greatest_force_n;
        // The readings of contacts with the greatest force, as weak as anywhere within, are then weaker than the best's in the middle.
        let reach = 0.5 * self.held_length[0].hypot(self.held_length[1]);
        if is_near && greatest_force_n - best.force_n < reach * best.sd_n() {
            self.held_length
        } else {
            self.length
        }
    }

    /// Halves along the longer way; `None` where it is short both ways.
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

/// About the least misfit within a part of such lengths, from that of its middle.
fn floor_within(misfit: f64, length: [f64; 2]) -> f64 {
    let reach = 0.5 * length[0].hypot(length[1]);
    let closest = (misfit.max(0.0).sqrt() - reach).max(0.0);
    closest * closest
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
