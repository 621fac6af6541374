//! The limit as a criterion, with one more sensor as a rank-1 update.
//!
//! A contact has P unknowns θ = (ln W, x, y), without a known force W and without y on a line. A sensor with
//! derivatives j = ∂y/∂θ / σ adds j·jᵀ to the information (see [`palpate_mechanics::limit`]). Priors are the
//! flat one of the surface, with variance l²/12 along each side, and a nearly uninformative one of the force.
//! So the covariance C = (prior + Σ j·jᵀ)⁻¹ exists for every layout. One more sensor changes it to
//!
//! ```text
//! C − (C·j)·(C·j)ᵀ / (1 + jᵀ·C·j)        (Sherman and Morrison)
//! ```

mod sums;

use std::sync::Arc;

use super::design::DesignCriterion;
use super::objective::{Block, ForceBelief, LANES, Objective, State};
use palpate_numerics::small::{Ldl, add_outer};
use sums::{Contacts, Mean, Shrinking, Sums, Without, Worst, folded};

/// Prior information on ln W: a standard deviation of 1000 times the force, and of 1 time.
const VAGUE: f64 = 1e-6;
const ROUGH: f64 = 1.0;
/// Weight of the mean limit relative to the criterion, to break ties.
const TIE_BREAK: f64 = 1e-3;

pub(super) struct LimitObjective<const P: usize, const FIRST: usize> {
    /// [candidate][unknown][block of contacts]
    table: Arc<Vec<Block>>,
    blocks: usize,
    weights: Vec<Block>,
    /// 12/l² of each side; 0 for the force, which has one of two priors.
    prior: [f64; P],
    criterion: DesignCriterion,
    /// Variance at the tolerance.
    good_enough: f64,
    /// Prior standard deviation of the position.
    unknown_m: f64,
}

impl<const P: usize, const FIRST: usize> LimitObjective<P, FIRST> {
    /// `table`: per candidate P·⌈contacts/8⌉ blocks; `sides_m`: one side per unknown of the position.
    pub fn new(
        table: Arc<Vec<Block>>,
        weights: &[f64],
        sides_m: &[f64],
        criterion: DesignCriterion,
        tolerance_m: f64,
    ) -> Self {
        let information =
            |k: usize| if k < FIRST { 0.0 } else { 12.0 / (sides_m[k - FIRST] * sides_m[k - FIRST]) };
        let prior: [f64; P] = std::array::from_fn(information);
        let variance: f64 = prior[FIRST..].iter().map(|information| 1.0 / information).sum();
        Self {
            table,
            blocks: weights.len().div_ceil(LANES),
            weights: padded(weights),
            prior,
            criterion,
            good_enough: 1.0 / (1.0 / (tolerance_m * tolerance_m) + 1.0 / variance),
            unknown_m: variance.sqrt(),
        }
    }

    fn folded<S: Sums>(&self, state: &State, row: &[Block], sums: &S) -> [f64; 2] {
        folded::<P, FIRST, S>(Contacts { covariances: &state.values, row, weights: &self.weights }, sums)
    }

    fn sums(&self, state: &State, row: &[Block]) -> [f64; 2] {
        match self.criterion {
            DesignCriterion::MeanLimit => self.folded(state, row, &Mean),
            DesignCriterion::WorstLimit => self.folded(state, row, &Worst),
            DesignCriterion::WithinTolerance => self.folded(state, row, &Without(self.good_enough)),
            DesignCriterion::DOptimality => {
                let [sum, _] = self.folded(state, row, &Shrinking);
                [state.constant + sum, 0.0]
            }
        }
    }

    fn silent_row(&self) -> Vec<Block> {
        vec![[0.0; LANES]; P * self.blocks]
    }

    fn search_score(&self, [sum, mean_m]: [f64; 2]) -> f64 {
        match self.criterion {
            DesignCriterion::MeanLimit | DesignCriterion::DOptimality => sum,
            DesignCriterion::WorstLimit => sum.sqrt() + TIE_BREAK * mean_m,
            DesignCriterion::WithinTolerance => sum + TIE_BREAK * mean_m / self.unknown_m,
        }
    }
}

impl<const P: usize, const FIRST: usize> Objective for LimitObjective<P, FIRST> {
    fn row(&self, candidate: usize) -> &[Block] {
        let size = P * self.blocks;
        &self.table[candidate * size..(candidate + 1) * size]
    }

    fn state(&self, rows: &[&[Block]], belief: ForceBelief) -> State {
        let n = self.blocks;
        let mut values = vec![[0.0; LANES]; packed(P, 0) * n];
        let mut prior = self.prior;
        if FIRST == 1 {
            prior[0] = if belief == ForceBelief::Rough { ROUGH } else { VAGUE };
        }
        let mut constant = 0.0;
        for at in 0..n {
            for lane in 0..LANES {
                let mut information = [[0.0; P]; P];
                for (k, prior) in prior.iter().enumerate() {
                    information[k][k] = *prior;
                }
                for row in rows {
                    add_outer(&mut information, 1.0, &std::array::from_fn(|k| row[k * n + at][lane]));
                }
                // The prior makes it positive definite.
                let factors = Ldl::regularised(&information);
                let covariance = factors.inverse();
                for i in 0..P {
                    for k in 0..=i {
                        values[packed(i, k) * n + at][lane] = covariance[i][k];
                    }
                }
                constant -= 0.5 * self.weights[at][lane] * factors.log_determinant();
            }
        }
        // Padding has no effect, also if only the largest variance counts.
        for block in values.chunks_exact_mut(n.max(1)) {
            for (value, weight) in block.iter_mut().flatten().zip(self.weights.iter().flatten()) {
                if *weight == 0.0 {
                    *value = 0.0;
                }
            }
        }
        State { values, constant }
    }

    fn score(&self, state: &State) -> f64 {
        self.score_with(state, &self.silent_row())
    }

    fn score_with(&self, state: &State, row: &[Block]) -> f64 {
        self.search_score(self.sums(state, row))
    }

    #[expect(clippy::needless_range_loop, reason = "as the formula has its indices")]
    fn updated(&self, state: &State, row: &[Block]) -> State {
        let n = self.blocks;
        let mut with = state.clone();
        for at in 0..n {
            for lane in 0..LANES {
                let covariance = |i: usize, k: usize| state.values[packed(i, k) * n + at][lane];
                let told: [f64; P] =
                    std::array::from_fn(|i| (0..P).map(|k| covariance(i, k) * row[k * n + at][lane]).sum());
                let shrink = 1.0 + (0..P).map(|k| row[k * n + at][lane] * told[k]).sum::<f64>();
                for i in 0..P {
                    for k in 0..=i {
                        with.values[packed(i, k) * n + at][lane] -= told[i] * told[k] / shrink;
                    }
                }
                with.constant -= 0.5 * self.weights[at][lane] * shrink.ln();
            }
        }
        with
    }

    fn value(&self, state: &State) -> f64 {
        let [sum, _] = self.sums(state, &self.silent_row());
        if self.criterion == DesignCriterion::WorstLimit { sum.sqrt() } else { sum }
    }
}

/// Index of entry (i, k) in the lower triangle, row by row.
const fn packed(i: usize, k: usize) -> usize {
    if i >= k { i * (i + 1) / 2 + k } else { k * (k + 1) / 2 + i }
}

pub(super) fn padded(values: &[f64]) -> Vec<Block> {
    let block = |values: &[f64]| std::array::from_fn(|lane| values.get(lane).copied().unwrap_or(0.0));
    values.chunks(LANES).map(block).collect()
}

#[cfg(test)]
mod tests;
