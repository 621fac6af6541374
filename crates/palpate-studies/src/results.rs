//! Results of a study: quantiles over the seeds.

use std::f64::consts::FRAC_2_PI;

use serde::{Deserialize, Serialize};

use super::{Arm, ArmOutcome, EvaluationSettings, PreparedStudy, RunOptions, TrainedSeed};
use palpate_estimators::evaluation::{
    ErrorSummary, Evaluation, Portion, Quantiles, limit_ratio, percentage_error,
};
use palpate_estimators::network::{Precision, TrainingStatus};
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::{Bound, Force};
use palpate_mechanics::sensing::{Sensor, SensorKind};

/// Results of a study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyResults {
    /// Arms with at least one fit.
    pub arms: Vec<ArmResults>,
}

/// Facts of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFacts {
    /// Version of palpate.
    pub palpate: String,
    /// Name of the study.
    pub study: String,
    /// SHA-256 of the study file, hexadecimal.
    pub study_sha256: String,
    /// Number of seeds per arm.
    pub seeds: u64,
    /// Number of merged shards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shards: Option<usize>,
    /// Number of threads; the largest of the shards.
    pub threads: usize,
    /// Width of the numbers in training.
    pub precision: Precision,
    /// Arithmetic of the lanes, in words.
    pub arithmetic: String,
    /// Patterns presented in this run.
    pub presentations: u64,
    /// Wall-clock time of the fits, s; the sum over shards.
    pub seconds: f64,
    /// Ratio of `presentations` to `seconds`.
    pub presentations_per_second: f64,
}

impl RunFacts {
    /// Creates the facts of a run.
    pub fn new(
        study: &PreparedStudy,
        options: RunOptions,
        arithmetic: String,
        presentations: u64,
        seconds: f64,
    ) -> Self {
        Self {
            palpate: env!("CARGO_PKG_VERSION").to_owned(),
            study: study.study.name.clone(),
            study_sha256: study.study.digest.clone(),
            seeds: options.seeds,
            shards: None,
            threads: options.threads,
            precision: study.study.precision,
            arithmetic,
            presentations,
            seconds,
            presentations_per_second: presentations as f64 / seconds,
        }
    }

    /// Combines the facts of shards; `None` without shards.
    pub fn of_shards(shards: &[Self]) -> Option<Self> {
        let first = shards.first()?;
        let presentations = shards.iter().fold(0u64, |sum, shard| sum.saturating_add(shard.presentations));
        let seconds = shards.iter().map(|shard| shard.seconds).sum();
        let mut arithmetic: Vec<&str> = shards.iter().map(|shard| shard.arithmetic.as_str()).collect();
        arithmetic.sort_unstable();
        arithmetic.dedup();
        Some(Self {
            shards: Some(shards.len()),
            threads: shards.iter().map(|shard| shard.threads).max()?,
            arithmetic: arithmetic.join("; "),
            presentations,
            seconds,
            presentations_per_second: presentations as f64 / seconds,
            ..first.clone()
        })
    }
}

/// Results of an arm over its seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmResults {
    /// Name of the arm.
    pub name: String,
    /// Estimator and bench; `None` if equal in all arms.
    #[serde(flatten)]
    pub set_up: Option<SetUp>,
    /// Number of fitted seeds.
    pub seeds: usize,
    /// Number of converged trainings; `None` without epochs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<usize>,
    /// Epochs of training; `None` without epochs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub epochs: Option<Quantiles>,
    /// Average percentage error.
    pub error_percent: Quantiles,
    /// Largest percentage error.
    pub max_error_percent: Quantiles,
    /// Share of the positions within the tolerance, %.
    pub effective_length_percent: Quantiles,
    /// Errors by portion, in JSON `error_percent_20_380`.
    #[serde(flatten, serialize_with = "portions_as_keys")]
    pub portions: Vec<PortionResults>,
    /// Errors inside and outside the training span, if requested.
    #[serde(flatten)]
    pub training_span: Option<TrainingSpanResults>,
    /// Limit; `None` without noise.
    #[serde(flatten)]
    pub limit: Option<LimitResults>,
    /// Coverage of the 95 % intervals, %; `None` without intervals.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage_percent: Option<Quantiles>,
}

/// Estimator and bench of an arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetUp {
    /// Kind of the estimator.
    pub estimator: &'static str,
    /// Known if the estimator is given the force.
    pub force: Force,
    /// Method of the layout; `None` for given positions.
    pub layout: Option<&'static str>,
    /// Sensors.
    pub sensors: Vec<SensorPlace>,
}

/// Kind and position of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorPlace {
    /// Kind.
    pub measure: SensorKind,
    /// Position, mm.
    pub position_mm: f64,
}

/// Errors within a portion.
#[derive(Clone, Debug, PartialEq)]
pub struct PortionResults {
    /// Portion.
    pub portion: Portion,
    /// Average percentage error.
    pub error_percent: Quantiles,
    /// Largest percentage error.
    pub max_error_percent: Quantiles,
    /// Average percentage error at the limit; `None` without a limit.
    pub limit_error_percent: Option<f64>,
}

/// Errors inside and outside the training span.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrainingSpanResults {
    /// Portion between the outermost training positions.
    pub training_span: Portion,
    /// Average percentage error inside; `None` without positions.
    pub error_percent_within_training: Option<Quantiles>,
    /// Average percentage error outside; `None` without positions.
    pub error_percent_beyond_training: Option<Quantiles>,
}

/// Cramér–Rao limit of an arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitResults {
    /// Average percentage error at the limit s, as 1/√(1/s² + 12/l²) on a surface of length l.
    pub limit_error_percent: f64,
    /// Ratio of average error to limit, over contacts at least l/80 from the ends with limits up to l/200;
    /// `None` without any.
    pub error_over_limit: Option<Quantiles>,
}

fn portions_as_keys<S: serde::Serializer>(
    portions: &[PortionResults],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    use serde::ser::SerializeMap;
    let mut map = serializer.serialize_map(None)?;
    for results in portions {
        let key = results.portion.key();
        map.serialize_entry(&format!("error_percent_{key}"), &results.error_percent)?;
        map.serialize_entry(&format!("max_error_percent_{key}"), &results.max_error_percent)?;
        if let Some(limit) = results.limit_error_percent {
            map.serialize_entry(&format!("limit_error_percent_{key}"), &limit)?;
        }
    }
    map.end()
}

impl StudyResults {
    /// Summarizes the outcomes of a run.
    pub fn new(outcomes: &[ArmOutcome], study: &PreparedStudy) -> Self {
        let set_ups: Vec<SetUp> = study.study.arms.iter().map(SetUp::new).collect();
        // If all arms have the same, the study file states it.
        let same =
            |a: &SetUp, b: &SetUp| (a.estimator, a.force, &a.sensors) == (b.estimator, b.force, &b.sensors);
        let differ = set_ups.windows(2).any(|pair| !same(&pair[0], &pair[1]));
        let results = |outcome: &ArmOutcome| {
            let arm = study.study.arms.iter().position(|arm| arm.name == outcome.name)?;
            let set_up = differ.then(|| set_ups[arm].clone());
            ArmResults::new(outcome, &study.study.arms[arm], set_up, study.evaluation_settings())
        };
        Self { arms: outcomes.iter().filter_map(results).collect() }
    }

    /// Arm of this name.
    pub fn arm(&self, name: &str) -> Option<&ArmResults> {
        self.arms.iter().find(|arm| arm.name == name)
    }
}

impl SetUp {
    fn new(arm: &Arm) -> Self {
        let place =
            |sensor: &Sensor| SensorPlace { measure: sensor.kind, position_mm: 1e3 * sensor.position.x_m };
        let setup = &arm.rig.setup;
        Self {
            estimator: arm.rig.estimator.kind(),
            force: setup.force(),
            layout: arm.layout.as_ref().map(|asked| asked.method.name()),
            sensors: setup.layout().sensors().iter().map(place).collect(),
        }
    }
}

impl ArmResults {
    fn new(
        outcome: &ArmOutcome,
        arm: &Arm,
        set_up: Option<SetUp>,
        judging: &EvaluationSettings,
    ) -> Option<Self> {
        let spread = |figure: &dyn Fn(&TrainedSeed) -> Option<f64>| {
            Quantiles::from_values(outcome.fits.iter().filter_map(figure).collect())
        };
        let error = |portion: Option<Portion>, pick: fn(ErrorSummary) -> f64| {
            spread(&|fit: &TrainedSeed| percent(&fit.evaluation, portion, pick))
        };
        let length_m = arm.rig.setup.surface().extent().length_m();
        let allowed = allowed(arm, judging);
        let portions = judging.portions.iter().filter_map(|portion| {
            Some(PortionResults {
                portion: *portion,
                error_percent: error(Some(*portion), |s| s.average_m)?,
                max_error_percent: error(Some(*portion), |s| s.largest_m)?,
                limit_error_percent: allowed
                    .as_ref()
                    .and_then(|allowed| Some(percentage_error(mean(allowed, Some(*portion))?, length_m))),
            })
        });
        let outcomes = || outcome.fits.iter().filter_map(|fit| fit.training);
        let converged = outcomes().filter(|o| o.status == TrainingStatus::Converged).count();
        let limit = allowed.as_ref().and_then(|allowed| {
            Some(LimitResults {
                limit_error_percent: percentage_error(mean(allowed, None)?, length_m),
                error_over_limit: spread(&|fit| limit_ratio(&arm.rig.setup, &fit.evaluation)),
            })
        });
        Some(Self {
            name: outcome.name.clone(),
            set_up,
            seeds: outcome.fits.len(),
            converged: outcomes().next().map(|_| converged),
            epochs: Quantiles::from_values(outcomes().map(|outcome| f64::from(outcome.epochs)).collect()),
            error_percent: error(None, |s| s.average_m)?,
            max_error_percent: error(None, |s| s.largest_m)?,
            effective_length_percent: spread(&|fit| {
                Some(fit.evaluation.effective_percent(judging.tolerance_m))
            })?,
            portions: portions.collect(),
            training_span: judging.training_span.then(|| training_span(outcome, arm)).flatten(),
            limit,
            coverage_percent: spread(&|fit| fit.evaluation.coverage_percent()),
        })
    }
}

fn allowed(arm: &Arm, judging: &EvaluationSettings) -> Option<Vec<(Position, f64)>> {
    let force_n = arm.rig.setup.force_n().or(arm.rig.training_setup().ok()?.force_n())?;
    let errors_m = expected_errors_m(&arm.rig.setup, force_n, &judging.positions)?;
    Some(judging.positions.iter().copied().zip(errors_m).collect())
}

fn mean(figures: &[(Position, f64)], portion: Option<Portion>) -> Option<f64> {
    let inside = |at: Position| portion.is_none_or(|portion| portion.contains(at));
    let inner: Vec<f64> = figures.iter().filter(|(at, _)| inside(*at)).map(|(_, figure)| *figure).collect();
    (!inner.is_empty()).then(|| palpate_numerics::mean(inner))
}

fn training_span(outcome: &ArmOutcome, arm: &Arm) -> Option<TrainingSpanResults> {
    let training = arm.rig.training.as_ref()?;
    let positions = training.positions(arm.rig.setup.surface().extent()).ok()?;
    let (low, high) = positions
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at.x_m), high.max(at.x_m)));
    let span = Portion { from_m: low, to_m: high };
    let error = |inside: bool| {
        let part = |fit: &TrainedSeed| average_percent(&fit.evaluation, |at| span.contains(at) == inside);
        Quantiles::from_values(outcome.fits.iter().filter_map(part).collect())
    };
    Some(TrainingSpanResults {
        training_span: span,
        error_percent_within_training: error(true),
        error_percent_beyond_training: error(false),
    })
}

pub(super) fn percent(
    evaluation: &Evaluation,
    portion: Option<Portion>,
    pick: fn(ErrorSummary) -> f64,
) -> Option<f64> {
    evaluation.summary(portion).map(|summary| percentage_error(pick(summary), evaluation.extent.length_m()))
}

/// Average error at accepted positions, in % of the length.
pub(super) fn average_percent(evaluation: &Evaluation, keep: impl Fn(Position) -> bool) -> Option<f64> {
    let located = evaluation.located.iter().filter(|located| keep(located.truth)).copied().collect();
    percent(&Evaluation { located, ..*evaluation }, None, |summary| summary.average_m)
}

/// Returns the expected errors at the limit, m.
///
/// The bound s is combined with a flat prior of variance l²/12: √(2/π) / √(1/s² + 12/l²).
fn expected_errors_m(setup: &Setup, force_n: f64, positions: &[Position]) -> Option<Vec<f64>> {
    let limit = setup.cramer_rao_bound().ok()?;
    let force = setup.force();
    let length_m = setup.surface().extent().length_m();
    let at = |&position: &Position| {
        let bound = limit.bound_at(Contact { position, force_n }, force);
        expected_error_m(bound.as_ref(), length_m)
    };
    Some(positions.iter().map(at).collect())
}

fn expected_error_m(bound: Option<&Bound>, length_m: f64) -> f64 {
    let told = bound.map_or(0.0, |bound| bound.sd_position_m.powi(-2));
    FRAC_2_PI.sqrt() / (told + 12.0 / length_m.powi(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_rig::Rig;

    #[test]
    fn known_forces_expect_the_bounds_own_error_and_blind_ends_no_more_than_the_surface() {
        let text = include_str!("../../../examples/paper.toml");
        let setup = Rig::from_toml(text).unwrap().setup;
        let positions = [0.001, 0.2].map(Position::along);
        let known = expected_errors_m(&setup, 3.0, &positions).unwrap();
        let limit = setup.cramer_rao_bound().unwrap();
        for (at, expected_m) in positions.into_iter().zip(known) {
            let bound = limit.bound_at(Contact { position: at, force_n: 3.0 }, Force::Known).unwrap();
            assert!((expected_m / bound.mean_error_m() - 1.0).abs() < 1e-4);
        }
        let mut setup = setup.clone().unknown_force();
        let unknown = expected_errors_m(&setup, 3.0, &positions).unwrap();
        let most_m = 0.4 / 12.0_f64.sqrt() * FRAC_2_PI.sqrt();
        assert!(unknown[0] < most_m && unknown[0] > 0.99 * most_m, "{unknown:?}");
        let clean = |sensor: &mut Sensor| sensor.channel.noise_sd = 0.0;
        setup.edit_sensors(|sensors| sensors.iter_mut().for_each(clean)).unwrap();
        assert_eq!(expected_errors_m(&setup, 3.0, &positions), None);
    }
}
