//! Check of 95 % intervals at places that a locator was not fitted to, and their widening.
//!
//! Intervals are valid where the bench fulfils the assumptions of the method. Presses at held-out places test this: a locator of the same
//! estimator, fitted to the other folds, locates them. With up to 40 places, each place is a fold.
//!
//! Two numbers widen intervals: a standard deviation τ that is added to each one's own, and a factor. With the half-width h of an interval, the wider one has
//! factor·√(h² + (1.96·τ)²); an ellipse of the covariance C has factor²·(C + τ²·I). The added standard deviation represents errors that the
//! method does not model, such as presses beside their places. Without it, a factor that is right for wide intervals is too small for
//! narrow ones (Papadopoulos, Vovk and Gammerman, *Journal of Artificial Intelligence Research* 40, 2011, normalize residuals alike). τ is
//! the value with which normal errors of the widened standard deviations, times any factor, are most likely. It is added where it raises
//! the log-likelihood by more than 1, the price of a parameter (Akaike, *IEEE Transactions on Automatic Control* 19, 1974), with each place
//! counted once.
//!
//! The ratio of a press is the least factor by which its interval contains it, lengthened to both sides alike (Romano, Patterson and Candès, *NeurIPS*, 2019:
//! conformalized quantile regression); on a plane, the square root of (e − t)ᵀ·C⁻¹·(e − t) over that of [`ELLIPSE_95`]. The factor is the 95 % quantile of
//! the ratios, with the correction for their number by which it covers a press at a further place with a probability of 0.95 (cross-conformal
//! prediction: Vovk, *Annals of Mathematics and Artificial Intelligence* 74, 2015; the jackknife+ and CV+: Barber and others, *Annals of Statistics* 49, 2021).
//! Presses of one place may share an error, so places are counted, not presses: see [`conformal_95_of_groups`]. Fewer than
//! [`FEWEST_FOR_95`] places give no bound.
//!
//! Intervals are widened, and never narrowed: the factor of few places scatters, and the intervals of a valid method need no factor.

mod region;
mod widening;

use crate::locator_fault::LocatorFault;
use crate::status::{OUTSIDE_MODEL_RATE, SIGNIFICANCE, SPREAD_RATE};
use palpate_core::{Estimate, Position, Status};
use palpate_mechanics::surface::Extent;
#[cfg(doc)]
use palpate_numerics::ELLIPSE_95;
use palpate_numerics::{FEWEST_FOR_95, binomial_tail, conformal_95_of_groups, root_mean_square};
use region::Region;
use serde::{Deserialize, Serialize};
pub(crate) use widening::EstimateWidening;
use widening::Widening;

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

/// Coverage of intervals at held-out places, and their widening.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coverage {
    /// Share of the presses that the method's intervals contain, in %. Every place has the same weight.
    pub before_percent: f64,
    /// Share of the presses that intervals widened by the other folds contain, in %. Every place has the same weight.
    pub after_percent: f64,
    /// Standard deviation that is added to that of each estimate, in metres or newtons.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub added_sd: f64,
    /// Factor of the half-widths, at least 1.
    pub factor: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
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
    /// The check by estimates at held-out places; `None` for fewer than [`FEWEST_FOR_95`] places, and for a method without intervals.
    pub(crate) fn of_estimates(estimates: &[HeldOutEstimate], extent: Extent) -> Option<Self> {
        let positions = PlaceRegions::new(estimates, |held_out| Region::of_position(held_out, extent));
        let forces = PlaceRegions::new(estimates, |held_out| Region::of_force(held_out, extent));
        let places = positions.groups.len();
        let position = positions.coverage()?;
        let outside = estimates.iter().filter(|held_out| held_out.estimate.status == Status::OutsideModel);
        Some(Self {
            places,
            presses: estimates.len(),
            outside_model: outside.count(),
            position,
            force: forces.coverage(),
        })
    }

    /// Share of the presses that are `outside_model`, in %, where noise alone does not explain their number; `None` elsewhere.
    pub fn outside_model_percent(&self) -> Option<f64> {
        let Self { presses, outside_model, .. } = *self;
        let by_noise = binomial_tail(presses, outside_model, OUTSIDE_MODEL_RATE + SPREAD_RATE);
        (by_noise < SIGNIFICANCE).then(|| 100.0 * outside_model as f64 / presses as f64)
    }

    /// Widening of the intervals of estimates.
    pub(crate) fn widening(&self) -> EstimateWidening {
        let force = self.force.map_or(Widening::NONE, |force| force.widening());
        EstimateWidening { position: self.position.widening(), force }
    }

    /// Checks the values read from a file.
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
        let added = coverages().map(|coverage| coverage.added_sd);
        LocatorFault::check_numbers(
            "added standard deviation",
            added,
            |sd| sd >= 0.0,
            "finite and at least 0",
        )?;
        let outside = [self.outside_model as f64 / self.presses as f64];
        let is_share = |share| (0.0..=1.0).contains(&share);
        LocatorFault::check_numbers("share of presses that are outside_model", outside, is_share, "0 to 1")?;
        let percents = coverages().flat_map(|coverage| [coverage.before_percent, coverage.after_percent]);
        let is_percent = |percent| (0.0..=100.0).contains(&percent);
        LocatorFault::check_numbers("coverage of intervals", percents, is_percent, "0 to 100 %")
    }
}

impl Coverage {
    fn widening(self) -> Widening {
        Widening { added_sd: self.added_sd, factor: self.factor.min(UNBOUNDED) }
    }
}

/// Widens each estimate by the check of the other folds. Estimates stay unchanged where these have too few places.
pub(crate) fn widen_by_other_folds(estimates: &mut [HeldOutEstimate], extent: Extent) {
    let last = estimates.iter().map(|held_out| held_out.fold).max();
    let of_others = |fold: usize| {
        let others: Vec<HeldOutEstimate> =
            estimates.iter().filter(|held_out| held_out.fold != fold).copied().collect();
        IntervalCheck::of_estimates(&others, extent).map(|check| check.widening())
    };
    let widenings: Vec<Option<EstimateWidening>> =
        last.map_or_else(Vec::new, |last| (0..=last).map(of_others).collect());
    for held_out in estimates {
        if let Some(widening) = widenings[held_out.fold] {
            held_out.estimate = widening.widened(held_out.estimate, extent);
        }
    }
}

/// Regions of the presses of each place, with the fold of the place.
struct PlaceRegions {
    groups: Vec<(usize, Vec<Region>)>,
    /// Number of places where all presses are `no_contact`, and so have no interval.
    not_found: usize,
}

impl PlaceRegions {
    /// The regions of the estimates that have one.
    fn new(estimates: &[HeldOutEstimate], region_of: impl Fn(&HeldOutEstimate) -> Option<Region>) -> Self {
        let mut sorted: Vec<&HeldOutEstimate> = estimates.iter().collect();
        sorted.sort_by(|a, b| a.truth.cmp_by_x_then_y(&b.truth));
        let mut regions = Self { groups: Vec::new(), not_found: 0 };
        for place in sorted.chunk_by(|a, b| a.truth == b.truth) {
            let found = || place.iter().filter(|one| one.estimate.status != Status::NoContact);
            let group: Vec<Region> = found().filter_map(|one| region_of(one)).collect();
            if !group.is_empty() {
                regions.groups.push((place[0].fold, group));
            }
            regions.not_found += usize::from(found().next().is_none());
        }
        regions
    }

    fn coverage(&self) -> Option<Coverage> {
        let of_all = self.widening_without(None)?;
        let folds = self.groups.iter().map(|(fold, _)| fold + 1).max()?;
        let of_others: Vec<Widening> =
            (0..folds).map(|fold| self.widening_without(Some(fold)).unwrap_or(of_all)).collect();
        Some(Coverage {
            before_percent: self.covered_percent(|_| Widening::NONE),
            after_percent: self.covered_percent(|fold| of_others[fold]),
            added_sd: of_all.added_sd,
            factor: of_all.factor,
        })
    }

    /// Widening of intervals by all places except those of a fold; `None` for too few places.
    fn widening_without(&self, fold: Option<usize>) -> Option<Widening> {
        /// Added standard deviations that are tried, in powers of √2 of the root mean square error.
        const TRIED: std::ops::RangeInclusive<i32> = -10..=6;
        let others: Vec<&[Region]> = self
            .groups
            .iter()
            .filter(|(of, _)| Some(*of) != fold)
            .map(|(_, group)| group.as_slice())
            .collect();
        let mut best = Widening { added_sd: 0.0, factor: self.factor(&others, 0.0)?.max(1.0) };
        let mut highest = log_likelihood(&others, 0.0) + PRICE_OF_A_PARAMETER;
        let errors: Vec<f64> = others.iter().copied().flatten().map(Region::error).collect();
        for power in TRIED {
            let added_sd = root_mean_square(&errors) * f64::from(power).exp2().sqrt();
            let Some(factor) = self.factor(&others, added_sd).filter(|factor| *factor >= 1.0) else {
                continue;
            };
            let likelihood = log_likelihood(&others, added_sd);
            if likelihood > highest {
                (best, highest) = (Widening { added_sd, factor }, likelihood);
            }
        }
        Some(best)
    }

    /// The 95 % quantile of the ratios of some places; `None` for too few. Where fewer than [`FEWEST_FOR_95`] places have an interval,
    /// places without a detection complete their number, and the factor is about the largest ratio.
    fn factor(&self, places: &[&[Region]], added_sd: f64) -> Option<f64> {
        let ratios_of = |group: &&[Region]| group.iter().map(|region| region.ratio(added_sd)).collect();
        let mut ratios: Vec<Vec<f64>> = places.iter().map(ratios_of).collect();
        let lacking = FEWEST_FOR_95.saturating_sub(ratios.len()).min(self.not_found);
        ratios.extend(std::iter::repeat_n(vec![0.0], lacking));
        conformal_95_of_groups(&ratios.iter().map(Vec::as_slice).collect::<Vec<_>>())
    }

    /// Share of the presses that widened intervals contain, in %; every place counts alike.
    fn covered_percent(&self, widening_of: impl Fn(usize) -> Widening) -> f64 {
        let of_place = |(fold, regions): &(usize, Vec<Region>)| {
            let Widening { added_sd, factor } = widening_of(*fold);
            regions.iter().filter(|region| region.ratio(added_sd) <= factor).count() as f64
                / regions.len() as f64
        };
        100.0 * self.groups.iter().map(of_place).sum::<f64>() / self.groups.len() as f64
    }
}

/// Price of a parameter in the log-likelihood, by Akaike's criterion.
const PRICE_OF_A_PARAMETER: f64 = 1.0;

/// Log-likelihood of the errors at some places, each counted once, where they are normal with the standard deviations of the intervals and
/// the added one, times the most likely factor. A constant is omitted; −∞ where an error lies in an interval without a length.
fn log_likelihood(places: &[&[Region]], added_sd: f64) -> f64 {
    let (mut log_sizes, mut squares, mut dimensions) = (0.0, 0.0, 0.0);
    for place in places {
        let share = 1.0 / place.len() as f64;
        for region in *place {
            log_sizes += share * region.log_size(added_sd);
            squares += share * region.square(added_sd);
            dimensions += share * region.dimensions();
        }
    }
    let log_likelihood = -log_sizes - 0.5 * dimensions * (squares / dimensions).ln();
    if log_likelihood.is_finite() { log_likelihood } else { f64::NEG_INFINITY }
}

/// Factor from which intervals count as unbounded. A policy: an interval of a micrometre is then a metre long. Files keep finite numbers.
pub const UNBOUNDED: f64 = 1e6;

#[cfg(test)]
mod tests;
