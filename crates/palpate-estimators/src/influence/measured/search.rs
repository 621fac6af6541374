//! Where the table explains a reading: stretches of places from boxes within boxes, the best contact by Gauss–Newton steps, and the
//! posterior over the cells that could matter.
//!
//! A *stretch* is what lies between two nodes along the nuisance coordinate of a place; without one it is the node itself. Boxes hold up to
//! eight stretches, or boxes, that lie next to each other. A box knows a reading c in its middle, how far from it anything within may read,
//! r, and the least weights w of the channels there, so that no contact in it leaves a residual below (√(Σ w·(z − c)²) − r)². With a gain of
//! deviation γ, the root is at least (√(that of c) − r)/(1 + γ·r): the residual of μ is that of (z − (1 + g)·μ, g/γ) at the best g, which
//! moves by at most |1 + g| times what μ does, and |g| is at most γ times its root.

use super::locator::MeasuredLocator;
use super::stretch::{Seen, Stretch};
use crate::influence::grid::{Axis, CUT, GridPosterior, PartOfCell, Parts, ToldForce, cubic, neighbours};
use palpate_numerics::simd::{Eight, InstructionSet, Kernel, Simd};
use palpate_numerics::small::Ldl;
use std::marker::PhantomData;

/// A mean between the nodes of the table may lie this much further than halfway to a neighbour.
const CURVED: f64 = 1.25;
/// Modes that are refined.
const MOST_MODES: usize = 4;

/// The table as it is searched.
#[derive(Clone, Debug)]
pub(super) struct Search {
    x: Axis,
    y: Axis,
    nuisance: Axis,
    /// Channels, in eights.
    groups: usize,
    /// Whitened means, node by node, filled up with zeros.
    means: Vec<[f64; 8]>,
    /// v, node by node.
    variances: Vec<f64>,
    /// How far from a node's mean that of anywhere in its cell may lie.
    reaches: Vec<f64>,
    /// How far from a node the line of anywhere in its cell may lie.
    line_reaches: Vec<f64>,
    signal: Vec<[f64; 8]>,
    gain: f64,
    /// Boxes of stretches, boxes of those, and so on, up to at most eight.
    levels: Vec<Level>,
    /// Into how many parts a cell is cut along each axis.
    parts: usize,
}

/// Boxes of one size. The boxes within one box of the next level lie side by side.
#[derive(Clone, Debug)]
struct Level {
    /// How many stretches, or boxes of the level below, a box holds along each axis.
    held: [usize; 3],
    /// Boxes along x, y and the nuisance coordinate.
    counts: [usize; 3],
    /// How many of them a box of the next level holds along each axis.
    side_by_side: [usize; 3],
    /// c and w of eight boxes, channel by channel, and r, which is minus infinity where no box is.
    middles: Vec<[f64; 8]>,
    weights: Vec<[f64; 8]>,
    radii: Vec<[f64; 8]>,
}

/// A box on its way into a level.
struct Ball {
    middle: Vec<f64>,
    weights: Vec<f64>,
    radius: f64,
}

impl Search {
    pub fn new(locator: &MeasuredLocator) -> Self {
        let (table, whitening) = (&locator.table, &locator.whitening);
        let channels = whitening.channels();
        let groups = channels.div_ceil(8);
        let padded = |values: &[f64]| -> Vec<[f64; 8]> {
            let eight = |eight: &[f64]| std::array::from_fn(|lane| eight.get(lane).copied().unwrap_or(0.0));
            values.chunks(8).map(eight).collect()
        };
        let mut search = Self {
            x: table.x,
            y: table.y,
            nuisance: table.nuisance,
            groups,
            means: table.means.chunks_exact(channels.max(1)).flat_map(padded).collect(),
            variances: table.variances.clone(),
            reaches: Vec::new(),
            line_reaches: table.line_reaches(),
            signal: padded(&whitening.signal),
            gain: whitening.gain,
            levels: Vec::new(),
            parts: table.parts,
        };
        search.reaches = (0..search.variances.len()).map(|node| search.reach(node)).collect();
        search.build(channels);
        search
    }

    fn reach(&self, node: usize) -> f64 {
        let (place, k) = (node / self.nuisance.count, node % self.nuisance.count);
        let square = |other: usize| -> f64 {
            let pairs = self.mean(node).iter().flatten().zip(self.mean(other).iter().flatten());
            pairs.map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let others = neighbours([self.x, self.y], place).map(|other| other * self.nuisance.count + k);
        0.5 * CURVED * others.map(square).fold(0.0, f64::max).sqrt()
    }

    fn mean(&self, node: usize) -> &[[f64; 8]] {
        &self.means[node * self.groups..(node + 1) * self.groups]
    }

    /// Stretches of a place.
    fn stretches(&self) -> usize {
        self.nuisance.count.saturating_sub(1).max(1)
    }

    /// Node at the start and at the end of a stretch.
    fn ends(&self, place: usize, stretch: usize) -> [usize; 2] {
        let first = place * self.nuisance.count + stretch;
        [first, if self.nuisance.count > 1 { first + 1 } else { first }]
    }

    fn build(&mut self, channels: usize) {
        let mut counts = [self.x.count, self.y.count, self.stretches()];
        let mut balls = self.balls(channels);
        let mut held = share_of_eight(counts);
        while counts.iter().product::<usize>() > 1 || self.levels.is_empty() {
            let above: [usize; 3] = std::array::from_fn(|k| counts[k].div_ceil(held[k]));
            let boxes = indices(above)
                .map(|at| within(at, held, counts).map(|at| &balls[index(at, counts)]).collect());
            let boxes: Vec<Ball> = boxes.map(|balls: Vec<&Ball>| Ball::around(&balls)).collect();
            let side_by_side = share_of_eight(above);
            let parents: [usize; 3] = std::array::from_fn(|k| above[k].div_ceil(side_by_side[k]));
            let mut level = Level {
                held,
                counts: above,
                side_by_side,
                middles: Vec::new(),
                weights: Vec::new(),
                radii: Vec::new(),
            };
            for parent in indices(parents) {
                let inside: Vec<&Ball> =
                    within(parent, side_by_side, above).map(|at| &boxes[index(at, above)]).collect();
                level.push(&inside, channels);
            }
            self.levels.push(level);
            (counts, balls, held) = (above, boxes, side_by_side);
        }
    }

    /// Every stretch with its cell.
    fn balls(&self, channels: usize) -> Vec<Ball> {
        let stretch = |place: usize, stretch: usize| {
            let [from, to] = self.ends(place, stretch);
            let pairs = self.mean(from).iter().flatten().zip(self.mean(to).iter().flatten()).take(channels);
            let middle: Vec<f64> = pairs.clone().map(|(a, b)| 0.5 * (a + b)).collect();
            let half = 0.5 * pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
            let around = neighbours([self.x, self.y], place).chain([place]);
            let known = around.flat_map(|place| self.ends(place, stretch)).map(|node| self.variances[node]);
            let variance = known.fold(0.0, f64::max);
            let signal = self.signal.iter().flatten().take(channels);
            Ball {
                middle,
                weights: signal.map(|signal| 1.0 / (1.0 + variance * signal)).collect(),
                radius: half + self.reaches[from].max(self.reaches[to]),
            }
        };
        let places = self.x.count * self.y.count;
        (0..places)
            .flat_map(|place| (0..self.stretches()).map(move |k| (place, k)))
            .map(|(p, k)| stretch(p, k))
            .collect()
    }
}

/// How many of eight boxes lie along each axis: along axes that have so many, those of the position first.
fn share_of_eight(counts: [usize; 3]) -> [usize; 3] {
    let mut share = [1, 1, 1];
    let mut left = 3;
    while left > 0 {
        let Some(k) = (0..3)
            .filter(|k| share[*k] < counts[*k])
            .max_by(|a, b| (counts[*a] / share[*a]).cmp(&(counts[*b] / share[*b])).then(b.cmp(a)))
        else {
            break;
        };
        share[k] *= 2;
        left -= 1;
    }
    share
}

/// Number of what lies at `at`.
fn index(at: [usize; 3], counts: [usize; 3]) -> usize {
    (at[0] * counts[1] + at[1]) * counts[2] + at[2]
}

/// What has this number.
fn at(index: usize, counts: [usize; 3]) -> [usize; 3] {
    [index / counts[2] / counts[1], index / counts[2] % counts[1], index % counts[2]]
}

fn indices(counts: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..counts.iter().product()).map(move |i| at(i, counts))
}

/// What a box at `parent` holds that is `held` long.
fn within(parent: [usize; 3], held: [usize; 3], counts: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    let inside = move |at: &[usize; 3]| (0..3).all(|k| at[k] < counts[k]);
    indices(held).map(move |own| std::array::from_fn(|k| parent[k] * held[k] + own[k])).filter(inside)
}

impl Ball {
    /// The least box around some.
    fn around(balls: &[&Self]) -> Self {
        let channels = balls[0].middle.len();
        let all = |channel: usize| balls.iter().map(move |ball| ball.middle[channel]);
        let middle: Vec<f64> = (0..channels)
            .map(|c| 0.5 * (all(c).fold(f64::INFINITY, f64::min) + all(c).fold(f64::NEG_INFINITY, f64::max)))
            .collect();
        let weights: Vec<f64> = (0..channels)
            .map(|c| balls.iter().map(|ball| ball.weights[c]).fold(f64::INFINITY, f64::min))
            .collect();
        let reach = |ball: &&Self| {
            let square: f64 = (0..channels).map(|c| weights[c] * (ball.middle[c] - middle[c]).powi(2)).sum();
            square.sqrt() + ball.radius
        };
        let radius = balls.iter().map(reach).fold(0.0, f64::max);
        Self { middle, weights, radius }
    }
}

impl Level {
    /// Adds the boxes within one box of the next level.
    fn push(&mut self, boxes: &[&Ball], channels: usize) {
        let lanes = |of: &dyn Fn(&Ball) -> f64, nothing: f64| {
            std::array::from_fn(|lane| boxes.get(lane).map_or(nothing, |ball| of(ball)))
        };
        for channel in 0..channels {
            self.middles.push(lanes(&|ball| ball.middle[channel], 0.0));
            self.weights.push(lanes(&|ball| ball.weights[channel], 0.0));
        }
        self.radii.push(lanes(&|ball| ball.radius, f64::NEG_INFINITY));
    }
}

/// A stretch that may explain the reading.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    place: usize,
    stretch: usize,
    residual: f64,
}

/// A local best contact.
#[derive(Clone, Copy, Debug)]
struct Mode {
    /// x, y and the nuisance coordinate, in nodes.
    at: [f64; 3],
    residual: f64,
    /// Information of x and y, the nuisance coordinate being free; in nodes.
    information: [[f64; 2]; 2],
}

impl Mode {
    /// The residual at (x, y) if it rises as it does at the mode.
    fn predicted(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.at[0], y - self.at[1]);
        let [[xx, _], [xy, yy]] = self.information;
        self.residual + xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy
    }
}

/// What is asked of a search.
#[derive(Clone, Copy, Debug)]
struct Asked<'a> {
    search: &'a Search,
    /// z, filled up with zeros.
    reading: &'a [[f64; 8]],
}

impl Search {
    /// The least squared residual of a whitened reading, over the variances.
    pub fn residual(&self, whitened: &[f64]) -> f64 {
        struct Least<'a>(Asked<'a>);
        impl Kernel for Least<'_> {
            type Output = f64;
            const FUSED: bool = true;
            #[inline(always)]
            fn run<S: Simd>(self) -> f64 {
                let mut candidates = Vec::new();
                let best =
                    if self.0.is_finite() { self.0.candidates::<S::F64>(&mut candidates) } else { None };
                match best {
                    Some(best) => self.0.refine::<S::F64>(best).residual,
                    None => f64::INFINITY,
                }
            }
        }
        let reading = self.padded(whitened);
        InstructionSet::best().run(Least(Asked { search: self, reading: &reading }))
    }

    /// The posterior of a whitened reading; `force` tells mean and variance of the force from those of the nuisance coordinate, in nodes.
    pub fn posterior(
        &self,
        whitened: &[f64],
        told: ToldForce,
        force: impl Fn(f64, f64) -> (f64, f64),
    ) -> GridPosterior {
        struct Sum<'a, F>(Asked<'a>, ToldForce, F);
        impl<F: Fn(f64, f64) -> (f64, f64)> Kernel for Sum<'_, F> {
            type Output = GridPosterior;
            const FUSED: bool = true;
            #[inline(always)]
            fn run<S: Simd>(self) -> GridPosterior {
                self.0.posterior::<S::F64>(self.1, self.2)
            }
        }
        let reading = self.padded(whitened);
        InstructionSet::best().run(Sum(Asked { search: self, reading: &reading }, told, force))
    }

    fn padded(&self, whitened: &[f64]) -> Vec<[f64; 8]> {
        let mut reading = vec![[0.0; 8]; self.groups];
        reading.as_flattened_mut()[..whitened.len()].copy_from_slice(whitened);
        reading
    }
}

impl Asked<'_> {
    /// Whether residuals can be: not of infinities, nor of what has an infinite square.
    fn is_finite(&self) -> bool {
        self.reading.as_flattened().iter().all(|z| z.abs() < 1e150)
    }

    /// How far each of eight boxes is from the reading, and what no contact in it leaves less than.
    #[inline(always)]
    fn bounds<V: Eight>(&self, level: &Level, parent: usize) -> ([f64; 8], [f64; 8]) {
        let channels = level.middles.len() / level.radii.len();
        let these = parent * channels..(parent + 1) * channels;
        let reading = self.reading.as_flattened();
        let mut sums = [V::splat(0.0); 3];
        let (middles, weights) = (&level.middles[these.clone()], &level.weights[these]);
        let mut square = [V::splat(0.0); 2];
        if self.search.gain > 0.0 {
            for ((middle, weight), z) in middles.iter().zip(weights).zip(reading) {
                let (middle, weight) = (V::load(middle), V::load(weight));
                let (off, scaled) = (V::splat(*z) - middle, weight * middle);
                sums[0] = (off * weight).mul_add(off, sums[0]);
                sums[1] = scaled.mul_add(off, sums[1]);
                sums[2] = scaled.mul_add(middle, sums[2]);
            }
            let gain2 = V::splat(self.search.gain * self.search.gain);
            let taken = gain2 * sums[1] * sums[1] / gain2.mul_add(sums[2], V::splat(1.0));
            square[0] = (sums[0] - taken).max(V::splat(0.0));
        } else {
            for (i, ((middle, weight), z)) in middles.iter().zip(weights).zip(reading).enumerate() {
                let off = V::splat(*z) - V::load(middle);
                square[i % 2] = (off * V::load(weight)).mul_add(off, square[i % 2]);
            }
        }
        let root = (square[0] + square[1]).square_root();
        let radius = V::load(&level.radii[parent]);
        let growth = V::splat(self.search.gain).mul_add(radius.max(V::splat(0.0)), V::splat(1.0));
        let bound = ((root - radius) / growth).max(V::splat(0.0));
        (root.to_array(), (bound * bound).to_array())
    }

    /// Collects the stretches that may matter beside the best, which is returned.
    #[inline(always)]
    fn candidates<V: Eight>(&self, found: &mut Vec<Candidate>) -> Option<Candidate> {
        let levels = &self.search.levels;
        let mut best: Option<Candidate> = None;
        // Boxes to look into: level and number, with what they leave at least.
        let mut waiting: Vec<(usize, usize, f64)> = Vec::with_capacity(64);
        waiting.push((levels.len(), 0, 0.0));
        let mut order: [(f64, usize, f64); 8];
        while let Some((above, number, bound)) = waiting.pop() {
            if best.is_some_and(|best| bound > best.residual + CUT) {
                continue;
            }
            if above == 0 {
                self.look_into::<V>(number, found, &mut best);
                continue;
            }
            let level = &levels[above - 1];
            let (roots, bounds) = self.bounds::<V>(level, number);
            order = std::array::from_fn(|lane| (roots[lane], lane, bounds[lane]));
            // The nearest is looked into first.
            order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            let parents: [usize; 3] =
                std::array::from_fn(|k| level.counts[k].div_ceil(level.side_by_side[k]));
            let parent = at(number, parents);
            // Lanes are filled in the order of the boxes that there are.
            let own: [usize; 3] = std::array::from_fn(|k| {
                level.side_by_side[k].min(level.counts[k] - parent[k] * level.side_by_side[k])
            });
            let count = own.iter().product::<usize>();
            for (_, lane, bound) in order {
                if lane < count && best.is_none_or(|best| bound <= best.residual + CUT) {
                    let inside = at(lane, own);
                    let place = std::array::from_fn(|k| parent[k] * level.side_by_side[k] + inside[k]);
                    waiting.push((above - 1, index(place, level.counts), bound));
                }
            }
        }
        best
    }

    /// Looks at the stretches of a box of the lowest level.
    #[inline(always)]
    fn look_into<V: Eight>(&self, number: usize, found: &mut Vec<Candidate>, best: &mut Option<Candidate>) {
        let search = self.search;
        let level = &search.levels[0];
        let counts = [search.x.count, search.y.count, search.stretches()];
        let (parent, held) = (at(number, level.counts), level.held);
        for x in parent[0] * held[0]..(parent[0] * held[0] + held[0]).min(counts[0]) {
            for y in parent[1] * held[1]..(parent[1] * held[1] + held[1]).min(counts[1]) {
                for stretch in parent[2] * held[2]..(parent[2] * held[2] + held[2]).min(counts[2]) {
                    let place = x * counts[1] + y;
                    let ends = search.ends(place, stretch);
                    let [from, to] = ends.map(|node| search.mean(node));
                    let share = 0.5 * (search.variances[ends[0]] + search.variances[ends[1]]);
                    let seen = self.seen::<V>(from, to, share);
                    let residual = seen.residual_at(seen.foot());
                    let candidate = Candidate { place, stretch, residual };
                    if best.is_none_or(|best| residual < best.residual) {
                        *best = Some(candidate);
                    }
                    let reach = search.reaches[ends[0]].max(search.reaches[ends[1]]);
                    if best.is_none_or(|best| search.least_near(residual, reach) <= best.residual + CUT) {
                        found.push(candidate);
                    }
                }
            }
        }
    }

    /// A stretch as seen from the reading.
    #[inline(always)]
    fn seen<V: Eight>(&self, from: &[[f64; 8]], to: &[[f64; 8]], share: f64) -> Seen {
        let stretch = Stretch { from, to, share };
        stretch.seen::<V>(self.reading, &self.search.signal, self.search.gain)
    }
}

impl Search {
    /// The least residual within `reach` of a mean whose residual is known.
    fn least_near(&self, residual: f64, reach: f64) -> f64 {
        let root = (residual.sqrt() - reach).max(0.0) / (1.0 + self.gain * reach);
        root * root
    }
}

/// Weights of the four nodes around a place, the first of them, and the weights' derivatives.
#[derive(Clone, Copy)]
struct Around {
    first: usize,
    weights: [f64; 4],
    slopes: [f64; 4],
}

impl Around {
    #[inline(always)]
    fn new(place: f64, count: usize) -> Self {
        if count < 4 {
            let (first, weights) = cubic(place, count);
            // Differences are exact for the parabolas of so few nodes, all of which are around any place.
            let [(_, after), (_, before)] = [0.5, -0.5].map(|off| cubic(place + off, count));
            return Self { first, weights, slopes: std::array::from_fn(|i| after[i] - before[i]) };
        }
        let first = ((place.floor() - 1.0).max(0.0) as usize).min(count - 4);
        let [a, b, c, d] = [0.0, 1.0, 2.0, 3.0].map(|node| place - first as f64 - node);
        let sixth = 1.0 / 6.0;
        Self {
            first,
            weights: [-sixth * b * c * d, 0.5 * a * c * d, -0.5 * a * b * d, sixth * a * b * c],
            slopes: [
                -sixth * (b * c + b * d + c * d),
                0.5 * (a * c + a * d + c * d),
                -0.5 * (a * b + a * d + b * d),
                sixth * (a * b + a * c + b * c),
            ],
        }
    }
}

/// Steps of a refinement.
const MOST_STEPS: usize = 12;
/// A step that lowers the residual by less than this is the last one.
const SMALL: f64 = 1e-3;

/// Normal equations of x, y and the nuisance coordinate at a contact.
#[derive(Clone, Copy, Debug)]
struct Equations {
    residual: f64,
    right: [f64; 3],
    information: [[f64; 3]; 3],
}

impl Asked<'_> {
    /// The best contact near a candidate.
    #[inline(always)]
    fn refine<V: Eight>(&self, from: Candidate) -> Mode {
        let search = self.search;
        let axes = [search.x, search.y, search.nuisance];
        let ends = axes.map(|axis| (axis.count - 1) as f64);
        let [node, next] = search.ends(from.place, from.stretch);
        let share = 0.5 * (search.variances[node] + search.variances[next]);
        let foot = self.seen::<V>(search.mean(node), search.mean(next), share).foot();
        let x = (from.place / search.y.count) as f64;
        let y = (from.place % search.y.count) as f64;
        let mut at = [x, y, if search.nuisance.count > 1 { from.stretch as f64 + foot } else { 0.0 }];
        let mut here = self.equations::<V>(at);
        let free = |at: [f64; 3], here: &Equations| {
            std::array::from_fn(|k| {
                let held = at[k] <= 0.0 && here.right[k] < 0.0 || at[k] >= ends[k] && here.right[k] > 0.0;
                axes[k].count > 1 && !held
            })
        };
        let mut scale = 1.0;
        for _ in 0..MOST_STEPS {
            let Some(factors) = Ldl::of_free(&here.information, free(at, &here)) else { break };
            let step = factors.solve(here.right);
            // Beyond the next nodes the mean is another one.
            let longest = step.iter().fold(1.0, |most: f64, step| most.max(step.abs()));
            let next: [f64; 3] =
                std::array::from_fn(|k| (at[k] + scale / longest * step[k]).clamp(0.0, ends[k]));
            let gain: f64 = (0..3).map(|k| (next[k] - at[k]) * here.right[k]).sum();
            let there = self.equations::<V>(next);
            if there.residual <= here.residual {
                (at, here) = (next, there);
                scale = 1.0;
            } else {
                scale *= 0.25;
            }
            if gain.abs() < SMALL {
                break;
            }
        }
        let of_place = of_place(&here.information, free(at, &here)[2]);
        Mode { at, residual: here.residual, information: of_place }
    }

    /// Normal equations at a contact, in nodes.
    #[inline(always)]
    fn equations<V: Eight>(&self, at: [f64; 3]) -> Equations {
        let search = self.search;
        let (along, across) = (Around::new(at[0], search.x.count), Around::new(at[1], search.y.count));
        let nodes = search.nuisance.count;
        let stretch = (at[2].floor() as usize).min(search.stretches() - 1);
        let t = at[2] - stretch as f64;
        let ends = if nodes > 1 { 2 } else { 1 };
        let (used_x, used_y) = (search.x.count.min(4), search.y.count.min(4));
        let mut variance = 0.0;
        // Products of z − μ, ∂μ/∂x, ∂μ/∂y, ∂μ/∂s and μ.
        let mut sums = [[V::splat(0.0); 5]; 5];
        for i in 0..used_x {
            for j in 0..used_y {
                let place = (along.first + i) * search.y.count + across.first + j;
                let weight = along.weights[i] * across.weights[j];
                let [from, to] = search.ends(place, stretch).map(|node| search.variances[node]);
                variance += weight * 0.5 * (from + to);
            }
        }
        let variance = V::splat(variance.max(0.0));
        for group in 0..search.groups {
            let mut values = [V::splat(0.0); 4];
            for i in 0..used_x {
                for j in 0..used_y {
                    let place = (along.first + i) * search.y.count + across.first + j;
                    let (wx, wy) = (along.weights[i], across.weights[j]);
                    let of = [along.slopes[i] * wy, wx * across.slopes[j], wx * wy];
                    for end in 0..ends {
                        let mean = V::load(&search.mean(place * nodes + stretch + end)[group]);
                        let (share, sign) = match (ends, end) {
                            (1, _) => (1.0, 0.0),
                            (_, 0) => (1.0 - t, -1.0),
                            _ => (t, 1.0),
                        };
                        values[0] = mean.mul_add(V::splat(share * of[0]), values[0]);
                        values[1] = mean.mul_add(V::splat(share * of[1]), values[1]);
                        values[2] = mean.mul_add(V::splat(sign * of[2]), values[2]);
                        values[3] = mean.mul_add(V::splat(share * of[2]), values[3]);
                    }
                }
            }
            let weight = V::splat(1.0) / variance.mul_add(V::load(&search.signal[group]), V::splat(1.0));
            let off = V::load(&self.reading[group]) - values[3];
            let columns = [off, values[0], values[1], values[2], values[3]];
            for a in 0..5 {
                let scaled = columns[a] * weight;
                for b in 0..=a {
                    sums[a][b] = scaled.mul_add(columns[b], sums[a][b]);
                }
            }
        }
        let mut products = [[0.0; 5]; 5];
        for a in 0..5 {
            for b in 0..=a {
                products[a][b] = sums[a][b].sum();
                products[b][a] = products[a][b];
            }
        }
        let gain2 = search.gain * search.gain;
        let growth = 1.0 + gain2 * products[4][4];
        let product = |a: usize, b: usize| products[a][b] - gain2 * products[a][4] * products[b][4] / growth;
        Equations {
            residual: product(0, 0).max(0.0),
            right: std::array::from_fn(|k| product(0, k + 1)),
            information: std::array::from_fn(|k| std::array::from_fn(|l| product(k + 1, l + 1))),
        }
    }

    /// The posterior, cell by cell.
    #[inline(always)]
    fn posterior<V: Eight>(&self, told: ToldForce, force: impl Fn(f64, f64) -> (f64, f64)) -> GridPosterior {
        let search = self.search;
        let mut posterior = GridPosterior::new([search.x, search.y], told);
        let mut candidates = Vec::with_capacity(64);
        // No contact explains an infinity.
        let best = if self.is_finite() { self.candidates::<V>(&mut candidates) } else { None };
        let Some(best) = best else { return posterior };
        let mut modes = vec![self.refine::<V>(best)];
        let least = modes[0].residual.min(best.residual);
        let reach = |c: &Candidate| {
            let [from, to] = search.ends(c.place, c.stretch);
            search.reaches[from].max(search.reaches[to])
        };
        candidates.retain(|c| search.least_near(c.residual, reach(c)) <= least + CUT);
        candidates.sort_unstable_by_key(|c| (c.place, c.stretch));
        let mut cells: Vec<Cell> = candidates.chunk_by(|a, b| a.place == b.place).map(Cell::of).collect();
        // The line of a place is nearer to its neighbours' than their stretches are to each other.
        cells.retain(|cell| search.least_near(cell.best.residual, search.line_reach(cell)) <= least + CUT);
        let mut claims: Vec<Option<usize>> = vec![None; cells.len()];
        loop {
            let newest = modes.len() - 1;
            for (claim, cell) in claims.iter_mut().zip(&cells) {
                if claim.is_none() && search.explains(&modes[newest], cell) {
                    *claim = Some(newest);
                }
            }
            let left = claims.iter().zip(&cells).filter(|(claim, _)| claim.is_none()).map(|(_, cell)| cell);
            let next = left.min_by(|a, b| a.best.residual.total_cmp(&b.best.residual));
            let Some(next) = next.filter(|_| modes.len() < MOST_MODES && search.parts > 1) else {
                break;
            };
            modes.push(self.refine::<V>(next.best));
        }
        let least = modes.iter().map(|mode| mode.residual).fold(least, f64::min);
        let mut sums = CellSums { asked: *self, least, force, between: Between::new(search) };
        let parts = [search.x, search.y].map(|axis| if axis.count > 1 { search.parts } else { 1 });
        for (cell, claim) in cells.iter().zip(claims) {
            let mode = claim.map(|claim| modes[claim]);
            sums.add::<V>(&mut posterior, cell, mode.as_ref(), parts);
        }
        posterior.residual = posterior.residual.min(least);
        posterior
    }
}

/// Information of x and y, of that of x, y and the nuisance coordinate, which is free or held.
fn of_place(information: &[[f64; 3]; 3], is_free: bool) -> [[f64; 2]; 2] {
    let of_nuisance = information[2][2];
    std::array::from_fn(|k| {
        std::array::from_fn(|l| {
            let taken = if is_free && of_nuisance > 0.0 {
                information[k][2] * information[l][2] / of_nuisance
            } else {
                0.0
            };
            information[k][l] - taken
        })
    })
}

/// A place with the stretches that may matter.
#[derive(Clone, Copy, Debug)]
struct Cell {
    best: Candidate,
    first: usize,
    last: usize,
}

impl Cell {
    fn of(candidates: &[Candidate]) -> Self {
        let best = candidates.iter().copied().min_by(|a, b| a.residual.total_cmp(&b.residual));
        let (first, last) = (candidates[0], candidates[candidates.len() - 1]);
        Self { best: best.unwrap_or(first), first: first.stretch, last: last.stretch }
    }
}

/// Predicted residuals beyond this above the least are not worth a look: a mode claims a cell only where the residual rises at least
/// half as fast as it predicts.
const PREDICTED: f64 = 2.0 * CUT;

impl Search {
    /// How far from the stretches of a cell that may matter the line of anywhere in the cell may lie.
    fn line_reach(&self, cell: &Cell) -> f64 {
        let [first, _] = self.ends(cell.best.place, cell.first);
        let [_, last] = self.ends(cell.best.place, cell.last);
        self.line_reaches[first..=last].iter().copied().fold(0.0, f64::max)
    }

    /// Whether the residual in a cell rises about as a mode predicts.
    fn explains(&self, mode: &Mode, cell: &Cell) -> bool {
        let (x, y) = (cell.best.place / self.y.count, cell.best.place % self.y.count);
        let rise = mode.predicted(x as f64, y as f64) - mode.residual;
        let found = cell.best.residual - mode.residual;
        found >= 0.5 * rise - 2.0 && rise.is_finite()
    }
}

/// Sums over the parts of cells.
struct CellSums<'a, F> {
    asked: Asked<'a>,
    least: f64,
    force: F,
    between: Between<'a>,
}

/// A cell is looked at in this many blocks of parts along each axis before its parts are.
const BLOCKS: usize = 3;

impl<F: Fn(f64, f64) -> (f64, f64)> CellSums<'_, F> {
    #[inline(always)]
    fn add<V: Eight>(
        &mut self,
        posterior: &mut GridPosterior,
        cell: &Cell,
        mode: Option<&Mode>,
        parts: [usize; 2],
    ) {
        self.between.begin(cell);
        let matters = self.blocks_that_matter::<V>(cell, mode, parts);
        let place = cell.best.place;
        let mut parts_of_cell =
            PartsOfCell::<V, F> { sums: self, cell, mode, parts, matters, vectors: PhantomData };
        posterior.add_cut_cell(place, parts, &mut parts_of_cell);
    }

    /// Whether anything in each block of a cell's parts can matter, by the residual in its middle.
    #[inline(always)]
    fn blocks_that_matter<V: Eight>(
        &mut self,
        cell: &Cell,
        mode: Option<&Mode>,
        parts: [usize; 2],
    ) -> [bool; BLOCKS * BLOCKS] {
        /// Fewer parts are looked at as they are.
        const LEAST_PARTS: usize = 2 * BLOCKS;
        let mut matters = [true; BLOCKS * BLOCKS];
        if parts.iter().max().is_none_or(|most| *most < LEAST_PARTS) {
            return matters;
        }
        let search = self.asked.search;
        let place = [cell.best.place / search.y.count, cell.best.place % search.y.count];
        let reach = CURVED * search.line_reach(cell) / BLOCKS as f64;
        for (block, matters) in matters.iter_mut().enumerate() {
            let middle = |k: usize, block: usize| {
                let off = (block as f64 + 0.5) / BLOCKS as f64 - 0.5;
                let count = [search.x.count, search.y.count][k];
                if count > 1 { (place[k] as f64 + off).clamp(0.0, (count - 1) as f64) } else { 0.0 }
            };
            let (x, y) = (middle(0, block / BLOCKS), middle(1, block % BLOCKS));
            if mode.is_some_and(|mode| mode.predicted(x, y) > self.least + 4.0 * PREDICTED) {
                *matters = false;
                continue;
            }
            self.between.at::<V>(x, y);
            let residual = self.asked.least_of_line::<V>(&self.between.line, &self.between.variances);
            *matters = search.least_near(residual, reach) <= self.least + CUT;
        }
        matters
    }
}

/// Parts of a cell as the posterior asks for them.
struct PartsOfCell<'s, 'a, V, F> {
    sums: &'s mut CellSums<'a, F>,
    cell: &'s Cell,
    mode: Option<&'s Mode>,
    parts: [usize; 2],
    matters: [bool; BLOCKS * BLOCKS],
    vectors: PhantomData<V>,
}

impl<V: Eight, F: Fn(f64, f64) -> (f64, f64)> Parts for PartsOfCell<'_, '_, V, F> {
    #[inline(always)]
    fn part(&mut self, [column, row]: [usize; 2], [x, y]: [f64; 2]) -> PartOfCell {
        let CellSums { asked, least, force, between } = &mut *self.sums;
        let (search, first) = (asked.search, self.cell.first);
        if self.parts == [1, 1] {
            let node = self.cell.best.place * search.nuisance.count + first;
            let means = &search.means[node * search.groups..(node + between.nodes) * search.groups];
            let variances = &search.variances[node..node + between.nodes];
            return asked.part::<V>(means, variances, first, *least, force);
        }
        if !self.matters[column * BLOCKS / self.parts[0] * BLOCKS + row * BLOCKS / self.parts[1]] {
            return PartOfCell::default();
        }
        if let Some(mode) = self.mode
            && mode.predicted(x, y) > *least + PREDICTED
        {
            return PartOfCell::default();
        }
        between.at::<V>(x, y);
        asked.part::<V>(&between.line, &between.variances, first, *least, force)
    }
}

/// The table between places, for the nodes of a cell.
struct Between<'a> {
    search: &'a Search,
    first: usize,
    nodes: usize,
    /// Means and v of a column: of four rows, node by node; and which column it is.
    columns: Vec<[f64; 8]>,
    column_variances: Vec<f64>,
    column_at: (f64, usize),
    /// Means and v at a place, node by node.
    line: Vec<[f64; 8]>,
    variances: Vec<f64>,
}

impl<'a> Between<'a> {
    fn new(search: &'a Search) -> Self {
        Self {
            search,
            first: 0,
            nodes: 0,
            columns: Vec::new(),
            column_variances: Vec::new(),
            column_at: (f64::NAN, 0),
            line: Vec::new(),
            variances: Vec::new(),
        }
    }

    /// Begins with a cell: from the first node of its first stretch to the last of its last.
    fn begin(&mut self, cell: &Cell) {
        self.first = cell.first;
        self.nodes = if self.search.nuisance.count > 1 { cell.last - cell.first + 2 } else { 1 };
        let size = self.nodes * self.search.groups;
        self.columns.resize(4 * size, [0.0; 8]);
        self.column_variances.resize(4 * self.nodes, 0.0);
        self.column_at = (f64::NAN, 0);
        self.line.resize(size, [0.0; 8]);
        self.variances.resize(self.nodes, 0.0);
    }

    /// Interpolates at (x, y), in nodes, through four places each way.
    #[inline(always)]
    fn at<V: Eight>(&mut self, x: f64, y: f64) {
        let search = self.search;
        let (groups, nodes, y_count) = (search.groups, self.nodes, search.y.count);
        let (rows, used) = (y_count.min(4), search.x.count.min(4));
        let across = Around::new(y, y_count);
        if self.column_at != (x, across.first) {
            self.column_at = (x, across.first);
            let along = Around::new(x, search.x.count);
            for j in 0..rows {
                let node = |i: usize| {
                    ((along.first + i) * y_count + across.first + j) * search.nuisance.count + self.first
                };
                for at in 0..nodes * groups {
                    let mut sum = V::splat(0.0);
                    for i in 0..used {
                        let mean = V::load(&search.means[node(i) * groups + at]);
                        sum = mean.mul_add(V::splat(along.weights[i]), sum);
                    }
                    self.columns[j * nodes * groups + at] = sum.to_array();
                }
                for n in 0..nodes {
                    self.column_variances[j * nodes + n] =
                        (0..used).map(|i| along.weights[i] * search.variances[node(i) + n]).sum();
                }
            }
        }
        for at in 0..nodes * groups {
            let mut sum = V::splat(0.0);
            for j in 0..rows {
                let mean = V::load(&self.columns[j * nodes * groups + at]);
                sum = mean.mul_add(V::splat(across.weights[j]), sum);
            }
            self.line[at] = sum.to_array();
        }
        for n in 0..nodes {
            let sum: f64 = (0..rows).map(|j| across.weights[j] * self.column_variances[j * nodes + n]).sum();
            self.variances[n] = sum.max(0.0);
        }
    }
}

impl Asked<'_> {
    /// The least residual along the nodes of a line.
    #[inline(always)]
    fn least_of_line<V: Eight>(&self, means: &[[f64; 8]], variances: &[f64]) -> f64 {
        let groups = self.search.groups;
        let node = |n: usize| &means[n * groups..(n + 1) * groups];
        let mut least = f64::INFINITY;
        for n in 0..variances.len().saturating_sub(1).max(1) {
            let next = (n + 1).min(variances.len() - 1);
            let seen = self.seen::<V>(node(n), node(next), 0.5 * (variances[n] + variances[next]));
            least = least.min(seen.residual_at(seen.foot()));
        }
        least
    }
}

impl Asked<'_> {
    /// Weight, force and residual of a part, from the means of its nodes from `first` on, relative to the residual `least`.
    #[inline(always)]
    fn part<V: Eight>(
        &self,
        means: &[[f64; 8]],
        variances: &[f64],
        first: usize,
        least: f64,
        force: &impl Fn(f64, f64) -> (f64, f64),
    ) -> PartOfCell {
        let groups = self.search.groups;
        let node = |n: usize| &means[n * groups..(n + 1) * groups];
        let (mut weight, mut sum, mut square, mut residual) = (0.0, 0.0, 0.0, f64::INFINITY);
        for n in 0..variances.len().saturating_sub(1).max(1) {
            let next = (n + 1).min(variances.len() - 1);
            let seen = self.seen::<V>(node(n), node(next), 0.5 * (variances[n] + variances[next]));
            residual = residual.min(seen.residual_at(seen.foot()));
            let share = seen.integral::<V>(least);
            let nuisance = (first + n) as f64 + share.middle;
            weight += share.weight;
            sum += share.weight * nuisance;
            square += share.weight * (nuisance * nuisance + share.spread);
        }
        if weight <= 0.0 {
            return PartOfCell::default();
        }
        let node = sum / weight;
        let (force_n, force_variance_n2) = force(node, (square / weight - node * node).max(0.0));
        PartOfCell { weight, force_n, force_variance_n2, residual }
    }
}
