//! Check of 95 % intervals at places that a locator was not fitted to, and their widening.
//!
//! An interval is right where the bench is as its method assumes. Presses at held-out places test this: a locator of the same estimator, fitted to the
//! other folds, locates them. The ratio of a press is its error over the half-width of its interval toward it; on a plane, the square root of
//! (e − t)ᵀ·C⁻¹·(e − t) over that of [`ELLIPSE_95`]. Intervals that are multiplied by a factor contain the presses whose ratio is at most this factor.
//!
//! The factor is the 95 % quantile of the ratios, with the correction for their number by which it covers a press at a further place with a probability of 0.95
//! (cross-conformal prediction: Vovk, *Annals of Mathematics and Artificial Intelligence* 74, 2015; the jackknife+ and CV+: Barber and others, *Annals of
//! Statistics* 49, 2021). Presses of one place may share an error, so places are what is counted: see [`conformal_95_of_groups`]. Fewer than
//! [`FEWEST_FOR_95`](palpate_numerics::FEWEST_FOR_95) of them bound nothing.
//!
//! Intervals are widened, and never narrowed: the factor of few places scatters, and intervals of a method that is right are right without it.

use crate::estimate_record::ContactRecord;
use crate::locator_fault::LocatorFault;
use crate::status::{OUTSIDE_MODEL_RATE, SIGNIFICANCE, SPREAD_RATE};
use palpate_core::{ContactEstimate, Estimate, Position, Status, Uncertainty};
use palpate_mechanics::surface::Extent;
use palpate_numerics::small::Ldl;
use palpate_numerics::{ELLIPSE_95, binomial_tail, conformal_95_of_groups};
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
    /// The check by estimates at held-out places; `None` of fewer than [`FEWEST_FOR_95`](palpate_numerics::FEWEST_FOR_95) places, and of a method without intervals.
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
        Widening { position: self.position.factor, force: self.force.map_or(1.0, |force| force.factor) }
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
}

impl PlaceRatios {
    /// The ratios of the estimates that have one.
    fn new(estimates: &[HeldOutEstimate], ratio: &dyn Fn(&HeldOutEstimate) -> Option<f64>) -> Self {
        let mut found: Vec<(Position, usize, f64)> = estimates
            .iter()
            // Such an estimate has no place.
            .filter(|held_out| held_out.estimate.status != Status::NoContact)
            .filter_map(|held_out| Some((held_out.truth, held_out.fold, ratio(held_out)?)))
            .collect();
        found.sort_by(|a, b| a.0.cmp_by_x_then_y(&b.0));
        let groups = found.chunk_by(|a, b| a.0 == b.0);
        let ratios = |group: &[(Position, usize, f64)]| group.iter().map(|(_, _, ratio)| *ratio).collect();
        Self { groups: groups.map(|group| (group[0].1, ratios(group))).collect() }
    }

    /// The factor of all places but those of a fold; `None` of too few.
    fn factor_without(&self, fold: Option<usize>) -> Option<f64> {
        let others = self.groups.iter().filter(|(of, _)| Some(*of) != fold);
        let groups: Vec<&[f64]> = others.map(|(_, ratios)| ratios.as_slice()).collect();
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

/// Ratio of an error to the half-width of an interval toward the truth.
fn ratio_of((low, high): (f64, f64), estimate: f64, truth: f64) -> f64 {
    let (error, half) = if truth >= estimate {
        (truth - estimate, high - estimate)
    } else {
        (estimate - truth, estimate - low)
    };
    match (error, half) {
        (0.0, _) => 0.0,
        (error, half) if half > 0.0 => (error / half).min(f64::MAX),
        _ => f64::MAX,
    }
}

fn position_ratio(held_out: &HeldOutEstimate, extent: Extent) -> Option<f64> {
    let ContactEstimate { position, uncertainty, .. } = held_out.estimate.contact;
    let Uncertainty { covariance: [xx, xy, _, yy, ..], x_95_m, .. } = uncertainty?;
    let truth = held_out.truth;
    if let Extent::Line { .. } = extent {
        return Some(ratio_of(x_95_m, position.x_m, truth.x_m));
    }
    let error = [position.x_m - truth.x_m, position.y_m - truth.y_m];
    let squared = Ldl::new(&[[xx, xy], [xy, yy]]).map(|factors| factors.quadratic(error) / ELLIPSE_95);
    Some(squared.filter(|squared| squared.is_finite()).map_or(f64::MAX, f64::sqrt))
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
        let (x_m, y_m) = (contact.position.x_m, contact.position.y_m);
        let of_force = |force_95_n, force_n| widened_interval(force_95_n, force_n, f, f64::INFINITY);
        let uncertainty = Uncertainty {
            covariance: [p * p * xx, p * p * xy, p * f * xf, p * p * yy, p * f * yf, f * f * ff],
            x_95_m: widened_interval(uncertainty.x_95_m, x_m, p, extent.length_m()),
            y_95_m: extent
                .width_m()
                .map_or(uncertainty.y_95_m, |width_m| widened_interval(uncertainty.y_95_m, y_m, p, width_m)),
            force_95_n: uncertainty.force_95_n.zip(contact.force_n).map(|(n, force_n)| of_force(n, force_n)),
        };
        ContactEstimate { uncertainty: Some(uncertainty), ..contact }
    }
}

/// An interval about a value with both half-widths multiplied, within 0 and `size` where it was.
fn widened_interval((low, high): (f64, f64), value: f64, factor: f64, size: f64) -> (f64, f64) {
    let wider = |end: f64| value + factor * (end - value);
    (wider(low).min(low).max(low.min(0.0)), wider(high).max(high).min(high.max(size)))
}

#[cfg(test)]
mod tests;
