//! Number of patches that a reading requires.
//!
//! Smoothness can join patches and hide light ones. In a likelihood-ratio test of nested models, k uniform
//! loads are rejected if the misfit decrease M_k − M_j, j > k, exceeds the χ² critical value. A patch is
//! added at [`OUTSIDE_MODEL_RATE`]; a number rejected only at 5 % is unresolved.

use super::cells::Cells;
use super::cumulative::CumulativeInfluence;
use super::even_loads::EvenLoads;
use crate::status::OUTSIDE_MODEL_RATE;
use ndarray::{Array1, Array2};
use palpate_mechanics::surface::UniformLoad;
use palpate_numerics::chi_squared_critical_value;

const UNRESOLVED_RATE: f64 = 0.05;

pub(super) struct PatchLoads<'a> {
    /// Significant loads.
    pub reported: EvenLoads<'a>,
    /// More loads, if significant at 5 %.
    pub unresolved: Option<EvenLoads<'a>>,
}

/// Influence functions.
pub(super) struct Tables<'a> {
    pub cells: &'a Cells,
    pub cumulative: &'a CumulativeInfluence,
    pub influence: &'a Array2<f64>,
    /// For loads of any shape.
    pub least_misfit: f64,
}

impl<'a> PatchLoads<'a> {
    /// Fewest loads that are not rejected.
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

/// Increasing numbers of loads, to the first insignificant one or the last with degrees of freedom.
fn fits<'a>(tables: &Tables<'a>, y: &'a Array1<f64>, starts: &[UniformLoad]) -> Vec<EvenLoads<'a>> {
    let mut fits: Vec<EvenLoads> = Vec::new();
    let mut next = EvenLoads::new(tables.cumulative, y, tables.cells.extent, starts);
    while let Some(fit) = next {
        let goes_on = fits.last().is_none_or(|fewer| rejects(&fit, fewer, UNRESOLVED_RATE));
        // More loads reduce the misfit at most to that of loads of any shape.
        let gain = fit.chi_squared() - tables.least_misfit;
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

fn rejects(more: &EvenLoads, fewer: &EvenLoads, error_rate: f64) -> bool {
    let unknowns = more.unknowns() - fewer.unknowns();
    fewer.chi_squared() - more.chi_squared() > chi_squared_critical_value(error_rate, unknowns)
}
