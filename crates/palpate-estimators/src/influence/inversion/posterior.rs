//! Posterior of a contact over a grid with a flat prior.
//!
//! [Quadrature](super::quadrature) integrates a single, nearly normal mode, [tiles](super::tiles) all other
//! posteriors.

use super::cells::CellFit;
use super::minima::{Minimum, minima, modes};
use super::quadrature::{self, WeightedPlace};
use super::tiles::{CUT, Lattice, Leaf, candidates};
use super::{ContactLikelihood, PlaceFit};
use crate::influence::grid::{Axis, is_margin, middle};
use crate::influence::moments::Moments;
use crate::status::OTHER_PLACE;
use palpate_core::{BoundedList, ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::{extend_to, normal_interval_95};

/// Source of the force of an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::influence) enum ForceKnowledge {
    Estimated,
    /// In newtons.
    Known(f64),
    /// Unidentifiable force.
    Unknown,
}

/// Critical values for one contact at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::influence) struct Limits {
    /// χ².
    pub misfit: f64,
    /// Distributed-contact score; infinite without that test.
    pub spread: f64,
}

#[derive(Debug)]
pub(in crate::influence) struct Inversion<E> {
    reading: E,
    fits: Vec<CellFit>,
    minima: Vec<Minimum>,
}

impl<E: ContactLikelihood> Inversion<E> {
    pub fn new(mut reading: E) -> Self {
        let mut fits = Vec::with_capacity(reading.cells().len());
        reading.scan(&mut fits);
        let minima = minima(&mut reading, &fits);
        Self { reading, fits, minima }
    }

    pub fn misfit(&self) -> f64 {
        self.minima.iter().map(|minimum| minimum.found.misfit).fold(f64::INFINITY, f64::min)
    }

    pub fn spread(&mut self) -> f64 {
        let Self { reading, minima, .. } = self;
        minima.iter().map(|minimum| reading.spread(minimum.at)).fold(f64::INFINITY, f64::min)
    }

    fn is_explained(&mut self, limits: Limits) -> bool {
        let misfit = self.misfit();
        // χ² is at least as large as the score.
        misfit <= limits.misfit && (misfit <= limits.spread || self.spread() <= limits.spread)
    }

    /// Returns the most probable mode with the posterior's uncertainty; `outside_model` beyond the limits.
    pub fn estimate(mut self, force: ForceKnowledge, limits: Limits) -> Estimate {
        let axes = self.reading.axes();
        let nowhere = Estimate::of_position(middle(axes), Status::OutsideModel);
        if self.minima.is_empty() {
            return nowhere;
        }
        let Some(posterior) = self.quadrature().or_else(|| self.sum()) else { return nowhere };
        let contact = posterior.contact(force);
        if !self.is_explained(limits) {
            return Estimate::of_contact(contact, Status::OutsideModel);
        }
        let others = posterior.modes.get(1..).unwrap_or_default();
        if others.is_empty() {
            return Estimate::of_contact(contact, Status::Located);
        }
        let mut estimate = Estimate::of_contact(contact, Status::Ambiguous);
        estimate.modes = BoundedList::none(Mode::default());
        for mode in others {
            let probability = mode.everywhere.weight / posterior.all.everywhere.weight;
            if !estimate.modes.push(Mode { contact: mode.contact(force), probability }) {
                break;
            }
        }
        estimate
    }

    /// `None` unless one nearly normal mode is certain.
    fn quadrature(&mut self) -> Option<Posterior> {
        let Self { reading, minima, .. } = self;
        let best = minima[0];
        if reading.bounds_are_loose()
            || minima.get(1).is_some_and(|other| other.found.cost <= best.found.cost + CUT)
        {
            return None;
        }
        let mut posterior = Posterior::default();
        for WeightedPlace { place, weight, found } in quadrature::around(reading, &best)? {
            posterior.all.add(weight, contact_at(place, &found, reading), true);
        }
        posterior.modes = vec![posterior.all];
        Some(posterior)
    }

    /// `None` where the sum is not a positive number.
    fn sum(&mut self) -> Option<Posterior> {
        let Self { reading, fits, minima } = self;
        let axes = reading.axes();
        let modes = modes(reading, minima);
        let others = candidates(reading, fits, minima);
        let mut posterior =
            Posterior { modes: vec![Probable::default(); minima.len()], ..Posterior::default() };
        let mut slices = [Slices::default(), Slices::default()];
        for i in 0..minima.len() {
            let (lattice, leaves) = Lattice::cover(reading, minima, i, &others[i]);
            for Leaf { tile, weight, found } in leaves {
                let place = lattice.middle(tile);
                let contact = contact_at(place, &found, reading);
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
impl<E: ContactLikelihood> Inversion<E> {
    /// Reference for tests, over the whole grid.
    pub fn summed_everywhere(mut self, force: ForceKnowledge, per_node: usize) -> ContactEstimate {
        let axes = self.reading.axes();
        let count = |axis: Axis| ((axis.count - 1) * per_node).max(1);
        let at = |axis: Axis, i: usize| (i as f64 + 0.5) / count(axis) as f64 * (axis.count - 1) as f64;
        let best = self.minima[0];
        let mut all = Probable::default();
        for (i, j) in (0..count(axes[0])).flat_map(|i| (0..count(axes[1])).map(move |j| (i, j))) {
            let place = [at(axes[0], i), at(axes[1], j)];
            let found = self.reading.fit_place(place, best.at[2]);
            let weight = (0.5 * (best.found.cost - found.cost)).exp();
            if weight > 0.0 {
                let is_usual = !is_margin(axes, place);
                all.add(weight, contact_at(place, &found, &self.reading), is_usual);
            }
        }
        all.contact(force)
    }
}

#[derive(Clone, Debug, Default)]
struct Posterior {
    all: Probable,
    /// Most probable first; only modes above the threshold.
    modes: Vec<Probable>,
    /// 95 % intervals in metres; `None` for those of a normal distribution.
    intervals_m: Option<[(f64, f64); 2]>,
}

impl Posterior {
    /// Most probable mode with the overall uncertainty: the mean of a multimodal posterior would lie outside
    /// all modes.
    fn contact(&self, force: ForceKnowledge) -> ContactEstimate {
        let all = self.all.contact(force);
        let mut contact = self.modes.first().map_or(all, |first| first.contact(force));
        contact.uncertainty = all.uncertainty;
        if let Some(uncertainty) = &mut contact.uncertainty {
            let [x_95_m, y_95_m] = self.intervals_m.unwrap_or([uncertainty.x_95_m, uncertainty.y_95_m]);
            uncertainty.x_95_m = extend_to(x_95_m, contact.position.x_m);
            uncertainty.y_95_m = extend_to(y_95_m, contact.position.y_m);
        }
        contact
    }
}

type ProbableContact = ([f64; 3], f64);

fn contact_at<E: ContactLikelihood>([x, y]: [f64; 2], found: &PlaceFit, reading: &E) -> ProbableContact {
    let [x_axis, y_axis] = reading.axes();
    let (force_n, variance_n2) = reading.force(found.latent, found.latent_variance);
    ([x_axis.value(x), y_axis.value(y), force_n], variance_n2)
}

/// Part of the posterior, with and without the margins.
///
/// The estimate is the mean without the margins, as contacts there are rare; the covariance includes them.
#[derive(Clone, Copy, Debug, Default)]
struct Probable {
    /// First contact; sums of differences from it avoid cancellation.
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

    fn contact(&self, force: ForceKnowledge) -> ContactEstimate {
        /// With a smaller share outside the margins, the mean includes them.
        const LEAST_SHARE: f64 = 1e-6;
        let (mean, mut covariance) = self.everywhere.mean_and_covariance();
        let is_usual = self.usual.weight > LEAST_SHARE * self.everywhere.weight;
        let found = if is_usual { self.usual.mean_and_covariance().0 } else { mean };
        let [dx, dy, df] = std::array::from_fn(|k| mean[k] - found[k]);
        let origin = self.origin.unwrap_or_default();
        let [x_m, y_m, force_n] = std::array::from_fn(|k| origin[k] + found[k]);
        let squares = [dx * dx, dx * dy, dx * df, dy * dy, dy * df, df * df];
        covariance.iter_mut().zip(squares).for_each(|(value, square)| *value += square);
        let (force_n, covariance) = match force {
            ForceKnowledge::Estimated => (Some(force_n), covariance),
            other => {
                let force_n = if let ForceKnowledge::Known(force_n) = other { Some(force_n) } else { None };
                (force_n, [covariance[0], covariance[1], 0.0, covariance[3], 0.0, 0.0])
            }
        };
        let uncertainty = Uncertainty {
            covariance,
            x_95_m: normal_interval_95(x_m, covariance[0].sqrt()),
            y_95_m: normal_interval_95(y_m, covariance[3].sqrt()),
            force_95_n: None,
        };
        ContactEstimate { position: Position { x_m, y_m }, force_n, uncertainty: Some(uncertainty) }
    }
}

/// Mixture of uniform densities over spans.
#[derive(Clone, Debug, Default)]
struct Slices {
    /// Ends of the spans, with the change of the density.
    ends: Vec<(f64, f64)>,
}

impl Slices {
    fn add(&mut self, (from, to): (f64, f64), weight: f64) {
        if to > from {
            let density = weight / (to - from);
            self.ends.extend([(from, density), (to, -density)]);
        }
    }

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
