//! Comparison of estimators on equal splits.

use super::trial_splits::TrialSplits;
use super::{Estimator, FitCost};
use crate::evaluation::{Split, TimedEvaluation};
use crate::setup::Setup;
use palpate_numerics::watch::{Cancelled, Watch};

/// Evaluation of one estimator.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Estimator.
    pub estimator: Estimator,
    /// Evaluation and computing times.
    pub timed: TimedEvaluation,
}

/// Options of a comparison.
#[derive(Clone, Copy)]
pub struct CompareOptions<'a> {
    /// Seed of the fits.
    pub seed: u64,
    /// Clock in seconds from any origin.
    pub clock: &'a dyn Fn() -> f64,
    /// Reason to omit an estimator of this cost.
    pub refuse: &'a dyn Fn(&Estimator, FitCost) -> Option<String>,
    /// Watch of the current estimator and the completed number.
    pub watch: Watch<'a>,
}

/// Result of a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ComparisonResult {
    /// Evaluations by rising mean error.
    pub comparisons: Vec<Comparison>,
    /// Omitted estimators with reasons.
    pub omitted: Vec<(&'static str, String)>,
}

/// Fits and evaluates each suitable estimator on every split.
///
/// ```
/// use palpate_estimators::estimator::{CompareOptions, Estimator, compare, contenders, select};
/// use palpate_estimators::{arrangement::Training, evaluation::Split, setup::Setup};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
/// use palpate_numerics::watch::Watch;
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let trials = Split::by_folds(&setup.simulate(&Training::even(10).repeated(3), 0)?, 5)?;
/// let all = contenders(&setup, &Estimator::default(), 24);
/// let contenders = select(all, &["influence".to_owned(), "neighbours".to_owned()])?;
/// let options = CompareOptions { seed: 0, clock: &|| 0.0, refuse: &|_, _| None, watch: Watch::NONE };
/// let compared = compare(&setup, contenders, &trials, options)?;
/// assert_eq!(compared.comparisons[0].estimator.kind(), "influence");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Cancelled`].
pub fn compare(
    setup: &Setup,
    contenders: Vec<Estimator>,
    trials: &[Split],
    options: CompareOptions,
) -> Result<ComparisonResult, Cancelled> {
    let mut compared = ComparisonResult::default();
    let of = contenders.len();
    let splits = TrialSplits::new(setup, trials, options.seed, options.clock);
    for (done, estimator) in contenders.into_iter().enumerate() {
        let name = estimator.name();
        let observe = || options.watch.counted(name, "estimators", done, of);
        observe()?;
        let cost = trials.first().map(|trial| estimator.fit_cost(setup, &trial.training));
        if let Some(why) = cost.and_then(|cost| (options.refuse)(&estimator, cost)) {
            compared.omitted.push((name, why));
            continue;
        }
        let go_on = |_| observe().is_ok();
        match splits.evaluate(&estimator, Watch::new(&go_on)) {
            Ok(timed) => compared.comparisons.push(Comparison { estimator, timed }),
            Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
            Err(error) => compared.omitted.push((name, error.to_string())),
        }
    }
    let mean_m = |comparison: &Comparison| {
        comparison.timed.evaluation.summary(None).map_or(f64::INFINITY, |summary| summary.average_m)
    };
    compared.comparisons.sort_by(|a, b| mean_m(a).total_cmp(&mean_m(b)));
    Ok(compared)
}
