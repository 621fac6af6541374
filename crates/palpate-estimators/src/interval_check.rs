//! Check and widening of 95 % intervals at held-out positions.
//!
//! - A locator fitted to the other folds locates each fold's presses; up to 40 positions are a fold each.
//! - A half-width h becomes factor·√(h² + (1.96·τ)²), an ellipse's covariance C factor²·(C + τ²·I). τ
//!   represents unmodelled errors, which a factor understates in narrow intervals (normalized residuals:
//!   Papadopoulos, Vovk and Gammerman, *Journal of Artificial Intelligence Research* 40, 2011). It maximizes
//!   a normal likelihood, each position counted once, with a gain above 1 (Akaike, *IEEE Transactions on
//!   Automatic Control* 19, 1974).
//! - The ratio of a press is the least factor to contain it (Romano, Patterson and Candès, *NeurIPS*, 2019),
//!   on a plane the root of (e − t)ᵀ·C⁻¹·(e − t) over that of [`ELLIPSE_95`]. The factor is the conformal 95
//!   % quantile over positions (Vovk, *Annals of Mathematics and Artificial Intelligence* 74, 2015; Barber
//!   and others, *Annals of Statistics* 49, 2021), as presses of one share errors:
//!   [`conformal_95_of_groups`]. Fewer than [`FEWEST_FOR_95`] give none.
//! - Intervals are never narrowed, as factors of few positions scatter.

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

/// Check of 95 % intervals; see [the module](self).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntervalCheck {
    /// Number of positions.
    pub places: usize,
    /// Number of presses.
    pub presses: usize,
    /// Number of `outside_model` presses.
    pub outside_model: usize,
    /// Coverage of position intervals or ellipses.
    pub position: Coverage,
    /// Coverage of force intervals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<Coverage>,
}

/// Coverage and widening of intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coverage {
    /// Coverage of the method's intervals, by position.
    pub before_percent: f64,
    /// Coverage of intervals widened by other folds.
    pub after_percent: f64,
    /// Added standard deviation τ, in metres or newtons.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub added_sd: f64,
    /// Factor of the half-widths, at least 1.
    pub factor: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldOutEstimate {
    pub truth: Position,
    pub force_n: Option<f64>,
    pub estimate: Estimate,
    pub fold: usize,
}

impl IntervalCheck {
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

    /// Share of `outside_model` presses beyond noise.
    pub fn outside_model_percent(&self) -> Option<f64> {
        let Self { presses, outside_model, .. } = *self;
        let by_noise = binomial_tail(presses, outside_model, OUTSIDE_MODEL_RATE + SPREAD_RATE);
        (by_noise < SIGNIFICANCE).then(|| 100.0 * outside_model as f64 / presses as f64)
    }

    pub(crate) fn widening(&self) -> EstimateWidening {
        let force = self.force.map_or(Widening::NONE, |force| force.widening());
        EstimateWidening { position: self.position.widening(), force }
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault`].
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

struct PlaceRegions {
    groups: Vec<(usize, Vec<Region>)>,
    not_found: usize,
}

impl PlaceRegions {
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

    fn widening_without(&self, fold: Option<usize>) -> Option<Widening> {
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

    /// Undetected positions complete the number of few.
    fn factor(&self, places: &[&[Region]], added_sd: f64) -> Option<f64> {
        let ratios_of = |group: &&[Region]| group.iter().map(|region| region.ratio(added_sd)).collect();
        let mut ratios: Vec<Vec<f64>> = places.iter().map(ratios_of).collect();
        let lacking = FEWEST_FOR_95.saturating_sub(ratios.len()).min(self.not_found);
        ratios.extend(std::iter::repeat_n(vec![0.0], lacking));
        conformal_95_of_groups(&ratios.iter().map(Vec::as_slice).collect::<Vec<_>>())
    }

    fn covered_percent(&self, widening_of: impl Fn(usize) -> Widening) -> f64 {
        let of_place = |(fold, regions): &(usize, Vec<Region>)| {
            let Widening { added_sd, factor } = widening_of(*fold);
            regions.iter().filter(|region| region.ratio(added_sd) <= factor).count() as f64
                / regions.len() as f64
        };
        100.0 * self.groups.iter().map(of_place).sum::<f64>() / self.groups.len() as f64
    }
}

/// Akaike's price.
const PRICE_OF_A_PARAMETER: f64 = 1.0;

/// Log-likelihood, each position counted once; −∞ for an error in an interval of length 0.
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

/// Factor of unbounded intervals, a policy.
pub const UNBOUNDED: f64 = 1e6;

#[cfg(test)]
mod tests;
