//! Check of 95 % intervals at places that a locator was not fitted to, and their widening.
//!
//! An interval is right where the bench is as its method assumes. Presses at held-out places test this: a locator of the same estimator, fitted to the
//! other folds, locates them. Up to 40 places, each is a fold. The ratio of a press is the least factor by which its interval, lengthened to both sides alike,
//! contains it (Romano, Patterson and Candès, *NeurIPS*, 2019: conformalized quantile regression); on a plane, the square root of
//! (e − t)ᵀ·C⁻¹·(e − t) over that of [`ELLIPSE_95`]. Intervals that are lengthened by a factor contain the presses whose ratio is at most this factor.
//!
//! The factor is the 95 % quantile of the ratios, with the correction for their number by which it covers a press at a further place with a probability of 0.95
//! (cross-conformal prediction: Vovk, *Annals of Mathematics and Artificial Intelligence* 74, 2015; the jackknife+ and CV+: Barber and others, *Annals of
//! Statistics* 49, 2021). Presses of one place may share an error, so places are what is counted: see [`conformal_95_of_groups`]. Fewer than
//! [`FEWEST_FOR_95`] of them bound nothing.
//!
//! Intervals are widened, and never narrowed: the factor of few places scatters, and intervals of a method that is right are right without it.

use crate::estimate_record::ContactRecord;
use crate::locator_fault::LocatorFault;
use crate::status::{OUTSIDE_MODEL_RATE, SIGNIFICANCE, SPREAD_RATE};
use palpate_core::{ContactEstimate, Estimate, Position, Status, Uncertainty};
use palpate_mechanics::surface::Extent;
use palpate_numerics::small::Ldl;
use palpate_numerics::{ELLIPSE_95, FEWEST_FOR_95, binomial_tail, conformal_95_of_groups};
use serde::{Deserialize, Serialize};

/// Check of a locator's 95 % intervals at held-out places; see [the module](self).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntervalCheck {
    /// Number of places.
    pub places: usize,
    /// Number of presses at these places.
    pub presses: usize,
    /// Number of them that are `outside_model`. Their intervals count too: a press is one contact, also where the model does not explain it.
    pub outside_model: usize,
    /// Intervals of the position; on a plane, its ellipse.
    pub position: Coverage,
    /// Intervals of the force, where it is estimated and was recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<Coverage>,
}

/// Coverage of intervals at held-out places, and the factor that widens them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coverage {
    /// Share of the presses that the method's intervals contain, in %. Every place has the same weight.
    pub before_percent: f64,
    /// The same by intervals that are widened by the factor of the other folds, in %.
    pub after_percent: f64,
    /// Factor of the half-widths, at least 1.
    pub factor: f64,
}

/// Factors of the half-widths of intervals, at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Widening {
    position: f64,
    force: f64,
}

/// Estimate of a press at a place that its locator was not fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldOutEstimate {
    pub truth: Position,
    pub force_n: Option<f64>,
    pub estimate: Estimate,
    /// Number of its fold.
    pub fold: usize,
}

impl IntervalCheck {
    /// The check by estimates at held-out places; `None` of fewer than [`FEWEST_FOR_95`] places, and of a method without intervals.
    pub(crate) fn of_estimates(estimates: &[HeldOutEstimate], extent: Extent) -> Option<Self> {
        let ratios = |ratio: &dyn Fn(&HeldOutEstimate) -> Option<f64>| PlaceRatios::new(estimates, ratio);
        let positions = ratios(&|held_out| position_ratio(held_out, extent));
        let places = positions.groups.len();
        let position = positions.coverage()?;
        let outside = estimates.iter().filter(|held_out| held_out.estimate.status == Status::OutsideModel);
        Some(Self {
            places,
            presses: estimates.len(),
            outside_model: outside.count(),
            position,
            force: ratios(&|held_out| force_ratio(held_out, extent)).coverage(),
        })
    }

    /// Share of the presses that are `outside_model`, in %, where these are more than noise makes so; `None` elsewhere.
    pub fn outside_model_percent(&self) -> Option<f64> {
        let Self { presses, outside_model, .. } = *self;
        let by_noise = binomial_tail(presses, outside_model, OUTSIDE_MODEL_RATE + SPREAD_RATE);
        (by_noise < SIGNIFICANCE).then(|| 100.0 * outside_model as f64 / presses as f64)
    }

    /// The factors of its intervals.
    pub(crate) fn widening(&self) -> Widening {
        let of = |coverage: Coverage| coverage.factor.min(UNBOUNDED);
        Widening { position: of(self.position), force: self.force.map_or(1.0, of) }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`LocatorFault`], naming what does not fit together.
    pub fn check(&self) -> Result<(), LocatorFault> {
        let coverages = || [self.position].into_iter().chain(self.force);
        let factors = coverages().map(|coverage| coverage.factor);
        LocatorFault::check_numbers(
            "factor of intervals",
            factors,
            |factor| factor >= 1.0,
            "finite and at least 1",
        )?;
        let outside = [self.outside_model as f64 / self.presses as f64];
        let is_share = |share| (0.0..=1.0).contains(&share);
        LocatorFault::check_numbers("share of presses that are outside_model", outside, is_share, "0 to 1")?;
        let percents = coverages().flat_map(|coverage| [coverage.before_percent, coverage.after_percent]);
        let is_percent = |percent| (0.0..=100.0).contains(&percent);
        LocatorFault::check_numbers("coverage of intervals", percents, is_percent, "0 to 100 %")
    }
}

/// Widens each estimate by the factors of the other folds; without any where these have too few places.
pub(crate) fn widen_by_other_folds(estimates: &mut [HeldOutEstimate], extent: Extent) {
    let last = estimates.iter().map(|held_out| held_out.fold).max();
    let of_others = |fold: usize| {
        let others: Vec<HeldOutEstimate> =
            estimates.iter().filter(|held_out| held_out.fold != fold).copied().collect();
        IntervalCheck::of_estimates(&others, extent).map(|check| check.widening())
    };
    let widenings: Vec<Option<Widening>> =
        last.map_or_else(Vec::new, |last| (0..=last).map(of_others).collect());
    for held_out in estimates {
        if let Some(widening) = widenings[held_out.fold] {
            held_out.estimate = widening.widened(held_out.estimate, extent);
        }
    }
}

/// Ratios of the presses of each place, with the fold of the place.
struct PlaceRatios {
    groups: Vec<(usize, Vec<f64>)>,
    /// Number of places whose presses are all `no_contact`, so that they have no interval.
    not_found: usize,
}

impl PlaceRatios {
    /// The ratios of the estimates that have one.
    fn new(estimates: &[HeldOutEstimate], ratio: &dyn Fn(&HeldOutEstimate) -> Option<f64>) -> Self {
        let mut sorted: Vec<&HeldOutEstimate> = estimates.iter().collect();
        sorted.sort_by(|a, b| a.truth.cmp_by_x_then_y(&b.truth));
        let mut ratios = Self { groups: Vec::new(), not_found: 0 };
        for place in sorted.chunk_by(|a, b| a.truth == b.truth) {
            let found = || place.iter().filter(|one| one.estimate.status != Status::NoContact);
            let group: Vec<f64> = found().filter_map(|one| ratio(one)).collect();
            if !group.is_empty() {
                ratios.groups.push((place[0].fold, group));
            }
            ratios.not_found += usize::from(found().next().is_none());
        }
        ratios
    }

    /// The factor of all places but those of a fold; `None` for too few. Where fewer than [`FEWEST_FOR_95`] places have an interval, places that were not
    /// found complete their number, and the factor is about the largest ratio.
    fn factor_without(&self, fold: Option<usize>) -> Option<f64> {
        let others = self.groups.iter().filter(|(of, _)| Some(*of) != fold);
        let mut groups: Vec<&[f64]> = others.map(|(_, ratios)| ratios.as_slice()).collect();
        let lacking = FEWEST_FOR_95.saturating_sub(groups.len()).min(self.not_found);
        groups.extend(std::iter::repeat_n(&[0.0][..], lacking));
        conformal_95_of_groups(&groups).map(|factor| factor.max(1.0))
    }

    /// Share of the presses whose ratio is at most that of their fold, in %; every place counts alike.
    fn covered_percent(&self, factor_of: impl Fn(usize) -> f64) -> f64 {
        let of_place = |(fold, ratios): &(usize, Vec<f64>)| {
            let factor = factor_of(*fold);
            ratios.iter().filter(|ratio| **ratio <= factor).count() as f64 / ratios.len() as f64
        };
        100.0 * self.groups.iter().map(of_place).sum::<f64>() / self.groups.len() as f64
    }

    fn coverage(&self) -> Option<Coverage> {
        let factor = self.factor_without(None)?;
        let folds = self.groups.iter().map(|(fold, _)| fold + 1).max()?;
        let of_others: Vec<f64> =
            (0..folds).map(|fold| self.factor_without(Some(fold)).unwrap_or(factor)).collect();
        Some(Coverage {
            before_percent: self.covered_percent(|_| 1.0),
            after_percent: self.covered_percent(|fold| of_others[fold]),
            factor,
        })
    }
}

/// Factor from which on intervals count as unbounded. A policy: one of a micrometre is then a metre long. Files keep finite numbers.
pub const UNBOUNDED: f64 = 1e6;

/// Least factor by which an interval contains the truth: within the interval the share of its half-width toward the truth; beyond it the distance from the
/// nearer end counts in halves of its whole length, so that an interval that ends at its own estimate is widened too.
fn ratio_of((low, high): (f64, f64), estimate: f64, truth: f64) -> f64 {
    let beyond = (low - truth).max(truth - high);
    let (error, half) = if truth >= estimate {
        (truth - estimate, high - estimate)
    } else {
        (estimate - truth, estimate - low)
    };
    let ratio = if beyond > 0.0 {
        1.0 + beyond / (0.5 * (high - low).max(0.0))
    } else if half > 0.0 {
        (error / half).min(1.0)
    } else {
        0.0
    };
    ratio.min(UNBOUNDED)
}

fn position_ratio(held_out: &HeldOutEstimate, extent: Extent) -> Option<f64> {
    let ContactEstimate { position, uncertainty, .. } = held_out.estimate.contact;
    let Uncertainty { covariance: [xx, xy, _, yy, ..], x_95_m, y_95_m, .. } = uncertainty?;
    let truth = held_out.truth;
    let along_x = ratio_of(x_95_m, position.x_m, truth.x_m);
    if let Extent::Line { .. } = extent {
        return Some(along_x);
    }
    let error = [position.x_m - truth.x_m, position.y_m - truth.y_m];
    let ellipse = Ldl::new(&[[xx, xy], [xy, yy]]).map(|factors| factors.quadratic(error) / ELLIPSE_95);
    // An ellipse without an area says nothing of the errors across it; its intervals do.
    let of_intervals = || along_x.max(ratio_of(y_95_m, position.y_m, truth.y_m));
    let ratio = ellipse.map(f64::sqrt).filter(|ratio| ratio.is_finite()).unwrap_or_else(of_intervals);
    Some(ratio.min(UNBOUNDED))
}

fn force_ratio(held_out: &HeldOutEstimate, extent: Extent) -> Option<f64> {
    let contact = &held_out.estimate.contact;
    let interval_n = ContactRecord::new(contact, extent).force_interval_95_n()?;
    Some(ratio_of(interval_n.into(), contact.force_n?, held_out.force_n?))
}

impl Widening {
    /// The estimate with wider intervals of all its contacts. They end where the surface does, and a force interval at 0, where they did before.
    pub fn widened(&self, estimate: Estimate, extent: Extent) -> Estimate {
        if *self == (Self { position: 1.0, force: 1.0 }) {
            return estimate;
        }
        let mut wider = Estimate { contact: self.widened_contact(estimate.contact, extent), ..estimate };
        wider.modes.clear();
        for mode in estimate.modes.as_slice() {
            let contact = self.widened_contact(mode.contact, extent);
            wider.modes.push(palpate_core::Mode { contact, ..*mode });
        }
        wider.further.clear();
        for contact in estimate.further.as_slice() {
            wider.further.push(self.widened_contact(*contact, extent));
        }
        wider
    }

    fn widened_contact(&self, contact: ContactEstimate, extent: Extent) -> ContactEstimate {
        let Some(uncertainty) = contact.uncertainty else { return contact };
        let Self { position: p, force: f } = *self;
        let [xx, xy, xf, yy, yf, ff] = uncertainty.covariance;
        let uncertainty = Uncertainty {
            covariance: [p * p * xx, p * p * xy, p * f * xf, p * p * yy, p * f * yf, f * f * ff],
            x_95_m: widened_interval(uncertainty.x_95_m, p, extent.length_m()),
            y_95_m: extent
                .width_m()
                .map_or(uncertainty.y_95_m, |width_m| widened_interval(uncertainty.y_95_m, p, width_m)),
            force_95_n: uncertainty
                .force_95_n
                .map(|force_95_n| widened_interval(force_95_n, f, f64::INFINITY)),
        };
        ContactEstimate { uncertainty: Some(uncertainty), ..contact }
    }
}

/// An interval whose length is multiplied by a factor, to both sides alike. It ends at 0 and `size` where it ended within them.
fn widened_interval((low, high): (f64, f64), factor: f64, size: f64) -> (f64, f64) {
    let more = (factor - 1.0) * 0.5 * (high - low).max(0.0);
    ((low - more).max(low.min(0.0)), (high + more).min(high.max(size)))
}

#[cfg(test)]
mod tests;
