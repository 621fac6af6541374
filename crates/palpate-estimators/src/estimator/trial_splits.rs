//! Splits of a comparison, with shared reading checks.

use super::{Estimator, FitError, Locator, is_learnt};
use crate::evaluation::{EvaluationError, Split, TimedEvaluation, evaluate_held_out};
use crate::fit::{FitTask, HoldOutTask};
use crate::fit_memo::FitMemo;
use crate::reading_check::ReadingCheck;
use crate::setup::Setup;
use palpate_numerics::watch::Watch;
use std::cell::OnceCell;

pub(super) struct TrialSplits<'a> {
    setup: &'a Setup,
    splits: &'a [Split],
    seed: u64,
    clock: &'a dyn Fn() -> f64,
    memo: Option<&'a FitMemo<'a>>,
    checks: Vec<OnceCell<TimedCheck>>,
}

struct TimedCheck {
    check: Option<ReadingCheck>,
    seconds: f64,
}

impl<'a> TrialSplits<'a> {
    pub fn new(setup: &'a Setup, splits: &'a [Split], seed: u64, clock: &'a dyn Fn() -> f64) -> Self {
        let checks = splits.iter().map(|_| OnceCell::new()).collect();
        Self { setup, splits, seed, clock, memo: None, checks }
    }

    /// Shares influence functions among the estimators. The time of learning them then counts for the first alone.
    pub fn memo(self, memo: &'a FitMemo<'a>) -> Self {
        Self { memo: Some(memo), ..self }
    }

    /// A shared check's time counts for each estimator.
    pub fn evaluate(
        &self,
        estimator: &Estimator,
        watch: Watch,
    ) -> Result<TimedEvaluation, EvaluationError<FitError>> {
        let fit = |split: usize, task: FitTask<'_>| self.fit(estimator, split, task);
        let Self { setup, splits, seed, clock, memo, .. } = *self;
        evaluate_held_out(&HoldOutTask { setup, splits, seed, clock, watch, memo }, fit)
    }

    fn fit(&self, estimator: &Estimator, split: usize, task: FitTask) -> Result<(Locator, f64), FitError> {
        let known = self.checks[split].get().filter(|_| is_learnt(estimator.kind()));
        let known_s = known.map_or(0.0, |known| known.seconds);
        let locator = estimator.fit_with_check(task, || match known {
            Some(known) => Ok(known.check.clone()),
            None => {
                let start = (self.clock)();
                let check = ReadingCheck::fit(task)?;
                let seconds = (self.clock)() - start;
                Ok(self.checks[split].get_or_init(|| TimedCheck { check, seconds }).check.clone())
            }
        })?;
        Ok((locator, known_s))
    }
}
