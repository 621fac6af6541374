//! The posterior of a contact over a grid: moments of position and force, 95 % intervals, modes, and the estimate that they give.
//!
//! Around a minimum that is alone and clear of the edges the posterior is nearly normal: it is summed by Gauss and Hermite's rule, 5 points on a line and
//! 3 × 3 on a plane, on the ellipse of Laplace's approximation. Any other is summed over tiles: near an edge it is cut off, where readings tell
//! little it is bent, and several minima share it. From each minimum the sum goes on to neighbouring tiles as long as they matter. The
//! prior is flat over the grid, less likely only in its margins.

use super::cells::Look;
use super::minima::{Minimum, floor, minima, modes};
use super::{Explain, Explained};
use crate::influence::grid::{Axis, is_margin, middle};
use crate::influence::moments::Moments;
use crate::status::OTHER_PLACE;
use palpate_core::{BoundedList, ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::normal_interval_95;
use palpate_numerics::small::Ldl;

/// Source of the force of an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::influence) enum ToldForce {
    /// The reading tells it.
    Estimated,
    /// It is known, in newtons.
    Known(f64),
    /// Nobody knows it.
    Untold,
}

/// A reading with the minima of its misfit.
#[derive(Debug)]
pub(in crate::influence) struct Inversion<E> {
    reading: E,
    looks: Vec<Look>,
    minima: Vec<Minimum>,
}

/// Standard deviations from an edge beyond which the edge does not matter.
const CLEAR: f64 = 3.0;
/// A cost this much above the least has no probability worth adding up: e⁻⁸.
const CUT: f64 = 16.0;
/// Greatest difference of the cost from a paraboloid, as a share of the paraboloid's rise.
const MOST_BENT: f64 = 1.0 / 3.0;
/// A tile stands for its middle when readings move no further within it, over the noise.
const FINE: f64 = 1.0;
/// Least and longest side of a tile, in nodes, of which a length scale has eight.
const LEAST_STEP: f64 = 1e-6;
const MOST_STEP: f64 = 2.0;
/// Tiles from a minimum that are looked at to either side; where that is not enough they are made larger.
const MOST_TILES: usize = 60;

/// Points and weights of Gauss and Hermite's rules for a standard normal density (Abramowitz and Stegun, 25.4.46).
const FIVE_POINTS: [(f64, f64); 5] = [
    (0.0, 8.0 / 15.0),
    (1.355_626_179_974_265_8, 0.222_075_922_005_612_64),
    (-1.355_626_179_974_265_8, 0.222_075_922_005_612_64),
    (2.856_970_013_872_805_7, 0.011_257_411_327_720_69),
    (-2.856_970_013_872_805_7, 0.011_257_411_327_720_69),
];
const THREE_POINTS: [(f64, f64); 3] =
    [(0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0), (-1.732_050_807_568_877_2, 1.0 / 6.0)];

impl<E: Explain> Inversion<E> {
    /// Looks for the minima of a reading.
    pub fn new(mut reading: E) -> Self {
        let mut looks = Vec::with_capacity(reading.cells().len());
        reading.scan(&mut looks);
        let minima = minima(&mut reading, &looks);
        Self { reading, looks, minima }
    }

    /// The least squared residual, in variances.
    pub fn misfit(&self) -> f64 {
        self.minima.iter().map(|minimum| minimum.misfit).fold(f64::INFINITY, f64::min)
    }

    /// The posterior's mean and covariance; that of the most probable mode where there are several; `outside_model` above the residual limit.
    pub fn estimate(mut self, told: ToldForce, residual_limit: f64) -> Estimate {
        let axes = self.reading.axes();
        let nowhere = Estimate::of_position(middle(axes), Status::OutsideModel);
        if self.minima.is_empty() {
            return nowhere;
        }
        let Some(posterior) = self.quadrature().or_else(|| self.sum()) else { return nowhere };
        let mut contact = posterior.all.contact(told);
        if let (Some(uncertainty), Some([x_95_m, y_95_m])) = (&mut contact.uncertainty, posterior.intervals_m)
        {
            (uncertainty.x_95_m, uncertainty.y_95_m) = (x_95_m, y_95_m);
        }
        if self.misfit() > residual_limit {
            return Estimate::of_contact(contact, Status::OutsideModel);
        }
        let Some((first, others)) = posterior.modes.split_first().filter(|(_, others)| !others.is_empty())
        else {
            return Estimate::of_contact(contact, Status::Located);
        };
        // The most probable place, with the uncertainty of all.
        let most_probable = ContactEstimate { uncertainty: contact.uncertainty, ..first.contact(told) };
        let mut estimate = Estimate::of_contact(most_probable, Status::Ambiguous);
        estimate.modes = BoundedList::none(Mode::default());
        for mode in others {
            let probability = mode.everywhere.weight / posterior.all.everywhere.weight;
            if !estimate.modes.push(Mode { contact: mode.contact(told), probability }) {
                break;
            }
        }
        estimate
    }

    /// The posterior around a minimum that is alone and nearly normal; `None` of any other.
    fn quadrature(&mut self) -> Option<Posterior> {
        let Self { reading, minima, .. } = self;
        let best = minima[0];
        if minima.get(1).is_some_and(|other| other.cost <= best.cost + CUT) {
            return None;
        }
        let axes = reading.axes();
        let varies = axes.map(|axis| axis.count > 1);
        let free = [varies[0], varies[1], reading.range().is_some()];
        let [[xx, xy, _], [_, yy, _], _] = Ldl::of_free(&best.information, free)?.inverse();
        let is_clear = |k: usize, variance: f64| {
            let (at, end, margin) = (best.at[k], (axes[k].count - 1) as f64, CLEAR * variance.sqrt());
            let [before, behind] = axes[k].margins;
            !varies[k] || margin < at - before && margin < end - behind - at
        };
        if !(is_clear(0, xx) && is_clear(1, yy)) {
            return None;
        }
        // The root of the covariance, by which standard normal numbers become steps over the grid.
        let along = xx.sqrt();
        let both = if along > 0.0 { xy / along } else { 0.0 };
        let across = (yy - both * both).max(0.0).sqrt();
        let none: &[(f64, f64)] = &[(0.0, 1.0)];
        let [rule_x, rule_y]: [&[(f64, f64)]; 2] = match varies {
            [true, true] => [&THREE_POINTS, &THREE_POINTS],
            [true, false] => [&FIVE_POINTS, none],
            [false, true] => [none, &FIVE_POINTS],
            [false, false] => [none, none],
        };
        let mut posterior = Posterior::default();
        for (u, weight_u) in rule_x {
            for (v, weight_v) in rule_y {
                let place = [best.at[0] + along * u, best.at[1] + both * u + across * v];
                let found = reading.explain(place, best.at[2]);
                let rise = u * u + v * v;
                let bent = found.cost - best.cost - rise;
                if bent.is_nan() || bent.abs() > MOST_BENT * rise.max(1.0) {
                    return None;
                }
                let weight = weight_u * weight_v * (-0.5 * bent).exp();
                posterior.all.add(weight, contact_at(place, &found, reading), true);
            }
        }
        posterior.modes = vec![posterior.all];
        Some(posterior)
    }

    /// The posterior summed up around every minimum; `None` where it is no number.
    fn sum(&mut self) -> Option<Posterior> {
        let Self { reading, looks, minima } = self;
        let axes = reading.axes();
        let modes = modes(reading, minima);
        let others = candidates(reading, looks, minima);
        let mut posterior =
            Posterior { modes: vec![Probable::default(); minima.len()], ..Posterior::default() };
        let mut slices = [Slices::default(), Slices::default()];
        for i in 0..minima.len() {
            let (lattice, leaves) = Lattice::cover(reading, minima, i, &others[i]);
            for Leaf { tile, weight, contact } in leaves {
                let place = lattice.middle(tile);
                let is_usual = !is_margin(axes, place);
                for sums in [&mut posterior.all, &mut posterior.modes[modes[i]]] {
                    sums.add(weight, contact, is_usual);
                }
                for (k, slices) in slices.iter_mut().enumerate() {
                    slices.add(lattice.span(tile, k), weight);
                }
            }
        }
        let total = posterior.all.everywhere.weight;
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        posterior.modes.sort_by(|a, b| b.everywhere.weight.total_cmp(&a.everywhere.weight));
        posterior.modes.retain(|mode| mode.everywhere.weight >= OTHER_PLACE * total);
        let interval = |slices: Slices, axis: Axis| {
            if axis.count == 1 {
                return (axis.start, axis.start);
            }
            let [low, high] = slices.quantiles([0.025, 0.975]);
            (axis.value(low), axis.value(high))
        };
        let [x, y] = slices;
        posterior.intervals_m = Some([interval(x, axes[0]), interval(y, axes[1])]);
        Some(posterior)
    }
}

#[cfg(test)]
impl<E: Explain> Inversion<E> {
    /// The contact of a plain sum over the whole grid at so many places a node each way, without bounds: what the search must not change.
    pub fn summed_everywhere(mut self, told: ToldForce, per_node: usize) -> ContactEstimate {
        let axes = self.reading.axes();
        let count = |axis: Axis| ((axis.count - 1) * per_node).max(1);
        let at = |axis: Axis, i: usize| (i as f64 + 0.5) / count(axis) as f64 * (axis.count - 1) as f64;
        let best = self.minima[0];
        let mut all = Probable::default();
        for (i, j) in (0..count(axes[0])).flat_map(|i| (0..count(axes[1])).map(move |j| (i, j))) {
            let place = [at(axes[0], i), at(axes[1], j)];
            let found = self.reading.explain(place, best.at[2]);
            let weight = (0.5 * (best.cost - found.cost)).exp();
            if weight > 0.0 {
                let is_usual = !is_margin(axes, place);
                all.add(weight, contact_at(place, &found, &self.reading), is_usual);
            }
        }
        all.contact(told)
    }
}

/// Moments of a contact.
#[derive(Clone, Debug, Default)]
struct Posterior {
    all: Probable,
    /// Of what lies nearest to the minima of each mode, the most probable first; only those that are noticeable.
    modes: Vec<Probable>,
    /// 95 % intervals along and across, in metres; `None` where they are those of a normal distribution.
    intervals_m: Option<[(f64, f64); 2]>,
}

/// Position and force of a contact, and the force's variance.
type ProbableContact = ([f64; 3], f64);

/// Contact at a place.
fn contact_at<E: Explain>([x, y]: [f64; 2], found: &Explained, reading: &E) -> ProbableContact {
    let [x_axis, y_axis] = reading.axes();
    let (force_n, variance_n2) = reading.force(found.latent, found.latent_variance);
    ([x_axis.value(x), y_axis.value(y), force_n], variance_n2)
}

/// Some of the probability: everywhere, and without the margins of the grid.
///
/// An estimate is the mean without the margins, as contacts hardly ever are beyond where presses were made. How sure it is is told by all.
#[derive(Clone, Copy, Debug, Default)]
struct Probable {
    /// The first contact: sums are taken of what others differ from it, as their squares may be far larger than the variance.
    origin: Option<[f64; 3]>,
    everywhere: Moments,
    usual: Moments,
}

impl Probable {
    fn add(&mut self, weight: f64, (contact, force_variance_n2): ProbableContact, is_usual: bool) {
        let origin = *self.origin.get_or_insert(contact);
        let contact = std::array::from_fn(|k| contact[k] - origin[k]);
        for moments in std::iter::once(&mut self.everywhere).chain(is_usual.then_some(&mut self.usual)) {
            moments.add(weight, contact);
            moments.add_force_variance(weight, force_variance_n2);
        }
    }

    /// The contact that it describes, its intervals those of a normal distribution.
    fn contact(&self, told: ToldForce) -> ContactEstimate {
        /// With a smaller share, the reading speaks for a contact in the margins.
        const LEAST_SHARE: f64 = 1e-6;
        let (mean, mut covariance) = self.everywhere.mean_and_covariance();
        let is_usual = self.usual.weight > LEAST_SHARE * self.everywhere.weight;
        let found = if is_usual { self.usual.mean_and_covariance().0 } else { mean };
        let [dx, dy, df] = std::array::from_fn(|k| mean[k] - found[k]);
        let origin = self.origin.unwrap_or_default();
        let [x_m, y_m, force_n] = std::array::from_fn(|k| origin[k] + found[k]);
        let squares = [dx * dx, dx * dy, dx * df, dy * dy, dy * df, df * df];
        covariance.iter_mut().zip(squares).for_each(|(value, square)| *value += square);
        let (force_n, covariance) = match told {
            ToldForce::Estimated => (Some(force_n), covariance),
            other => {
                let force_n = if let ToldForce::Known(force_n) = other { Some(force_n) } else { None };
                (force_n, [covariance[0], covariance[1], 0.0, covariance[3], 0.0, 0.0])
            }
        };
        let uncertainty = Uncertainty {
            covariance,
            x_95_m: normal_interval_95(x_m, covariance[0].sqrt()),
            y_95_m: normal_interval_95(y_m, covariance[3].sqrt()),
        };
        ContactEstimate { position: Position { x_m, y_m }, force_n, uncertainty: Some(uncertainty) }
    }
}

/// Number of the minimum that is nearest to a place.
fn nearest(minima: &[Minimum], [x, y]: [f64; 2]) -> usize {
    let square = |minimum: &Minimum| (minimum.at[0] - x).powi(2) + (minimum.at[1] - y).powi(2);
    let by_distance = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    minima.iter().map(square).enumerate().min_by(by_distance).map_or(0, |(i, _)| i)
}

/// A place that may matter, with about its latent number.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    place: [f64; 2],
    latent: f64,
}

/// The middles of cells that may matter beside the best minimum, by the minimum that is nearest.
fn candidates<E: Explain>(reading: &E, looks: &[Look], minima: &[Minimum]) -> Vec<Vec<Candidate>> {
    let cells = reading.cells();
    let mut candidates = vec![Vec::new(); minima.len()];
    for (cell, Look { misfit, cost, latent }) in looks.iter().enumerate() {
        let middle = cells.middle(cell);
        let [along, across] = reading.lengths(middle, *latent);
        // Half the way to the next middle.
        if floor(*misfit, 0.5 * along.hypot(across)) + (cost - misfit) <= minima[0].cost + CUT {
            let place = middle.map(|node| node as f64);
            candidates[nearest(minima, place)].push(Candidate { place, latent: *latent });
        }
    }
    candidates
}

/// Tiles of equal size that cover a grid.
#[derive(Clone, Copy, Debug)]
struct Lattice {
    /// Tiles along and across, and the length of one in nodes.
    counts: [usize; 2],
    steps: [f64; 2],
}

/// A tile that its middle stands for.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    tile: [usize; 2],
    weight: f64,
    contact: ProbableContact,
}

impl Lattice {
    fn new(nodes: [usize; 2], steps: [f64; 2]) -> Self {
        let counts = [0, 1].map(|k| ((nodes[k] - 1) as f64 / steps[k]).ceil().max(1.0) as usize);
        Self { counts, steps: [0, 1].map(|k| (nodes[k] - 1) as f64 / counts[k] as f64) }
    }

    /// Steps within which readings move by [`FINE`] near a minimum, whatever the latent number.
    fn fine_steps<E: Explain>(reading: &E, minimum: &Minimum) -> [f64; 2] {
        let [x, y, latent] = minimum.at;
        let lengths = reading.lengths([x, y].map(|at| at.round() as usize), latent);
        let [[xx, _, xt], [_, yy, yt], [_, _, tt]] = minimum.information;
        let step = |own: f64, with_latent: f64, length: f64| {
            let told = if tt > 0.0 { own - with_latent * with_latent / tt } else { own };
            (FINE / told.max(0.0).sqrt().max(length)).clamp(LEAST_STEP, MOST_STEP)
        };
        [step(xx, xt, lengths[0]), step(yy, yt, lengths[1])]
    }

    /// The tiles around minimum `i` that matter and lie nearest to it, from neighbour to neighbour, their weights relative to that of the best minimum.
    fn cover<E: Explain>(
        reading: &mut E,
        minima: &[Minimum],
        i: usize,
        others: &[Candidate],
    ) -> (Self, Vec<Leaf>) {
        let nodes = reading.axes().map(|axis| axis.count);
        let mut steps = Self::fine_steps(reading, &minima[i]);
        loop {
            let lattice = Self::new(nodes, steps);
            if let Some(leaves) = lattice.leaves(reading, minima, i, others) {
                return (lattice, leaves);
            }
            steps = steps.map(|step| 2.0 * step);
        }
    }

    /// `None` where they reach too far.
    fn leaves<E: Explain>(
        self,
        reading: &mut E,
        minima: &[Minimum],
        i: usize,
        others: &[Candidate],
    ) -> Option<Vec<Leaf>> {
        let Minimum { at, .. } = minima[i];
        let best = minima[0].cost;
        let start = self.tile([at[0], at[1]]);
        let corner = start.map(|tile| tile.saturating_sub(MOST_TILES));
        let seen_at = |tile: [usize; 2]| (tile[0] - corner[0]) * (2 * MOST_TILES + 1) + (tile[1] - corner[1]);
        let wide = |k: usize| (start[k] + MOST_TILES + 1).min(self.counts[k]) - corner[k];
        let is_near = |tile: [usize; 2]| (0..2).all(|k| tile[k].abs_diff(start[k]) <= MOST_TILES);
        let mut seen = vec![false; (wide(0) - 1) * (2 * MOST_TILES + 1) + wide(1)];
        seen[seen_at(start)] = true;
        let (mut open, mut leaves) = (vec![(start, at[2])], Vec::new());
        let mut others = others.iter();
        loop {
            while let Some((tile, latent)) = open.pop() {
                let place = self.middle(tile);
                let found = reading.explain(place, latent);
                // The tile of the minimum itself counts however far its middle is.
                let matters = found.cost <= best + CUT || tile == start;
                if !matters || minima.len() > 1 && nearest(minima, place) != i {
                    continue;
                }
                let weight = (0.5 * (best - found.cost)).exp() * self.area();
                if weight > 0.0 {
                    leaves.push(Leaf { tile, weight, contact: contact_at(place, &found, reading) });
                }
                let around = |k: usize| tile[k].saturating_sub(1)..(tile[k] + 2).min(self.counts[k]);
                for next in around(0).flat_map(|x| around(1).map(move |y| [x, y])) {
                    if !is_near(next) {
                        return None;
                    }
                    if !std::mem::replace(&mut seen[seen_at(next)], true) {
                        open.push((next, found.latent));
                    }
                }
            }
            // Whatever else may matter, apart from all that was reached.
            let Some(Candidate { place, latent }) = others.next() else { return Some(leaves) };
            let tile = self.tile(*place);
            if is_near(tile) {
                if !std::mem::replace(&mut seen[seen_at(tile)], true) {
                    open.push((tile, *latent));
                }
            } else if reading.explain(*place, *latent).cost <= best + CUT {
                return None;
            }
        }
    }

    /// The tile of a place.
    fn tile(self, place: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|k| {
            let tile = if self.steps[k] > 0.0 { (place[k] / self.steps[k]) as usize } else { 0 };
            tile.min(self.counts[k] - 1)
        })
    }

    fn middle(self, tile: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|k| (tile[k] as f64 + 0.5) * self.steps[k])
    }

    /// From one end of a tile to the other along axis k, in nodes.
    fn span(self, tile: [usize; 2], k: usize) -> (f64, f64) {
        (tile[k] as f64 * self.steps[k], (tile[k] + 1) as f64 * self.steps[k])
    }

    /// In nodes; an axis that does not vary counts for nothing.
    fn area(self) -> f64 {
        self.steps.iter().map(|step| if *step > 0.0 { *step } else { 1.0 }).product()
    }
}

/// Weights that are spread evenly over spans, which may overlap.
#[derive(Clone, Debug, Default)]
struct Slices {
    /// Ends of the spans, with the change of the density there.
    ends: Vec<(f64, f64)>,
}

impl Slices {
    fn add(&mut self, (from, to): (f64, f64), weight: f64) {
        if to > from {
            let density = weight / (to - from);
            self.ends.extend([(from, density), (to, -density)]);
        }
    }

    /// The places below which two shares of the weight lie, the lower first.
    fn quantiles(mut self, shares: [f64; 2]) -> [f64; 2] {
        self.ends.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let last = self.ends.last().map_or(0.0, |end| end.0);
        let pieces = || {
            let mut density = 0.0;
            self.ends.windows(2).map(move |pair| {
                density += pair[0].1;
                (pair[0].0, pair[1].0 - pair[0].0, density)
            })
        };
        let total: f64 = pieces().map(|(_, length, density)| length * density).sum();
        shares.map(|share| {
            let mut left = share * total;
            for (from, length, density) in pieces() {
                let weight = length * density;
                if weight >= left && weight > 0.0 {
                    return from + length * left / weight;
                }
                left -= weight;
            }
            last
        })
    }
}
