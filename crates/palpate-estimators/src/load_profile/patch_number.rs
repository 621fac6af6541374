//! Number of patches: how many even loads a reading needs.
//!
//! A profile shows where the load is, but smoothness can join two patches, and a light patch is hardly visible beside a dense one. The number of
//! patches is that of the profile unless the reading rejects it by a likelihood-ratio test of nested models: with M_k the least misfit of k even
//! loads, k loads are rejected where M_k − M_j, j > k, exceeds the χ² critical value of the unknowns that j loads have more. A patch is added
//! where the error of that is one in a thousand ([`OUTSIDE_MODEL_RATE`]). A number that is rejected at 5 % only is not resolved.

use super::cells::Cells;
use super::cumulative::CumulativeInfluence;
use super::even_loads::EvenLoads;
use crate::status::OUTSIDE_MODEL_RATE;
use ndarray::{Array1, Array2};
use palpate_mechanics::surface::UniformLoad;
use palpate_numerics::chi_squared_critical_value;

/// Error of a number of patches that is not resolved: that of a 95 % interval.
const UNRESOLVED_RATE: f64 = 0.05;

/// Even loads of a reading.
pub(super) struct PatchLoads<'a> {
    /// The patches that are significant.
    pub reported: EvenLoads<'a>,
    /// More loads, where the number of the reported ones is rejected at 5 %.
    pub unresolved: Option<EvenLoads<'a>>,
}

/// Influence functions of a bench: over even loads, and over its cells.
pub(super) struct Tables<'a> {
    pub cells: &'a Cells,
    pub cumulative: &'a CumulativeInfluence,
    pub influence: &'a Array2<f64>,
    /// The least misfit of loads of any shape on the cells.
    pub least_misfit: f64,
}

impl<'a> PatchLoads<'a> {
    /// The fewest loads that a whitened reading does not reject, from the loads of a profile; `None` without any.
    pub fn new(tables: &Tables<'a>, y: &'a Array1<f64>, starts: &[UniformLoad]) -> Option<Self> {
        let fits = fits(tables, y, starts);
        let fewest = |error_rate: f64| {
            let is_kept = |i: &usize| fits[i + 1..].iter().all(|more| !rejects(more, &fits[*i], error_rate));
            (0..fits.len()).find(is_kept)
        };
        let (reported, likely) = (fewest(OUTSIDE_MODEL_RATE)?, fewest(UNRESOLVED_RATE)?);
        let mut fits: Vec<Option<EvenLoads>> = fits.into_iter().map(Some).collect();
        Some(Self {
            unresolved: if likely > reported { fits[likely].take() } else { None },
            reported: fits[reported].take()?,
        })
    }
}

/// The best fits of as many loads as the profile has, and of more, to the first that does not reject one fewer, or to as many unknowns as the
/// reading has values.
fn fits<'a>(tables: &Tables<'a>, y: &'a Array1<f64>, starts: &[UniformLoad]) -> Vec<EvenLoads<'a>> {
    let mut fits: Vec<EvenLoads> = Vec::new();
    let mut next = EvenLoads::new(tables.cumulative, y, tables.cells.extent, starts);
    while let Some(fit) = next {
        let goes_on = fits.last().is_none_or(|fewer| rejects(&fit, fewer, UNRESOLVED_RATE));
        // More loads lower the misfit to that of loads of any shape at most.
        let gain = fit.misfit() - tables.least_misfit;
        let could_reject = gain > chi_squared_critical_value(UNRESOLVED_RATE, fit.unknowns() / fit.count());
        let has_freedom = fit.unknowns() < y.len();
        next = if goes_on && could_reject && has_freedom {
            fit.with_one_more(tables.cells, tables.influence)
        } else {
            None
        };
        fits.push(fit);
    }
    fits
}

/// True where a fit of more loads rejects that of fewer, with this error rate.
fn rejects(more: &EvenLoads, fewer: &EvenLoads, error_rate: f64) -> bool {
    let unknowns = more.unknowns() - fewer.unknowns();
    fewer.misfit() - more.misfit() > chi_squared_critical_value(error_rate, unknowns)
}
