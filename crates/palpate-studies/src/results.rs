//! Results of a study: the figures of each arm, as quantiles over the seeds.

use std::f64::consts::FRAC_2_PI;

use serde::{Deserialize, Serialize};

use super::{Arm, ArmOutcome, Judging, PreparedStudy, RunOptions, TrainedSeed};
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
    /// Every arm that has at least one fit.
    pub arms: Vec<ArmResults>,
}

/// Facts of a study's run, which every file of the run contains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFacts {
    /// Version of palpate.
    pub palpate: String,
    /// The study's name.
    pub study: String,
    /// SHA-256 of the study file, in hexadecimal.
    pub study_sha256: String,
    /// Seeds 0 to this less 1, of every arm.
    pub seeds: u64,
    /// Shards that were joined, where the study ran in shards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shards: Option<usize>,
    /// Number of threads; for shards the largest of theirs.
    pub threads: usize,
    /// Width of the numbers in training.
    pub precision: Precision,
    /// The arithmetic of the lanes, in words.
    pub arithmetic: String,
    /// Patterns presented to networks in this run; those of an earlier run do not count.
    pub presentations: u64,
    /// Wall-clock time of the fits, in seconds; the sum over shards.
    pub seconds: f64,
    /// Ratio of `presentations` to `seconds`.
    pub presentations_per_second: f64,
}

impl RunFacts {
    /// Facts of a run of `study`, with the number of presentations and the seconds that they took.
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

    /// Facts of a study joined from shards, by the facts of each; `None` without a shard.
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

/// An arm's figures over its seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmResults {
    /// The arm.
    pub name: String,
    /// Estimator and bench; `None` if all arms of the study have the same.
    #[serde(flatten)]
    pub set_up: Option<SetUp>,
    /// Seeds that were fitted.
    pub seeds: usize,
    /// Number of seeds with converged training; `None` for an estimator that is not trained by epochs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged: Option<usize>,
    /// Epochs of training; `None` for an estimator that is not trained by epochs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub epochs: Option<Quantiles>,
    /// Average percentage error over all positions.
    pub error_percent: Quantiles,
    /// Largest percentage error over all positions.
    pub max_error_percent: Quantiles,
    /// Share of the positions located within the tolerance, in %.
    pub effective_length_percent: Quantiles,
    /// Errors by portion; in JSON as `error_percent_20_380` and so on.
    #[serde(flatten, serialize_with = "portions_as_keys")]
    pub portions: Vec<PortionResults>,
    /// Errors between the outermost training positions and beyond them, if the study requests them.
    #[serde(flatten)]
    pub training_span: Option<TrainingSpanResults>,
    /// The limit; `None` without noise.
    #[serde(flatten)]
    pub limit: Option<LimitResults>,
    /// Share of the estimator's 95 % intervals that contain the contact, in %; `None` for an estimator without intervals.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage_percent: Option<Quantiles>,
}

/// Estimator and bench of an arm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetUp {
    /// The kind of its estimator.
    pub estimator: &'static str,
    /// Force of the contacts: known or unknown to the estimator.
    pub force: Force,
    /// The method of its layout; `None` for a layout given by positions.
    pub layout: Option<&'static str>,
    /// Sensors.
    pub sensors: Vec<SensorPlace>,
}

/// Kind and position of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensorPlace {
    /// Kind.
    pub measure: SensorKind,
    /// Position along the surface, in millimetres.
    pub position_mm: f64,
}

/// Errors within a portion.
#[derive(Clone, Debug, PartialEq)]
pub struct PortionResults {
    /// The portion.
    pub portion: Portion,
    /// Average percentage error.
    pub error_percent: Quantiles,
    /// Largest percentage error.
    pub max_error_percent: Quantiles,
    /// Average percentage error of an estimator at the limit; `None` without a limit.
    pub limit_error_percent: Option<f64>,
}

/// Errors between the outermost training positions, and beyond them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrainingSpanResults {
    /// Portion from one outermost training position to the other.
    pub training_span: Portion,
    /// Average percentage error between them; `None` without a position there.
    pub error_percent_within_training: Option<Quantiles>,
    /// Average percentage error beyond them; `None` without a position there.
    pub error_percent_beyond_training: Option<Quantiles>,
}

/// Cramér–Rao limit of an arm, as figures of error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitResults {
    /// Average percentage error of an estimator at the limit, over all positions. The contact is known to lie on the surface, also where
    /// the readings hardly determine the position. So the limit s counts as 1/√(1/s² + 12/l²), with l the surface's length.
    pub limit_error_percent: f64,
    /// Ratio of the average error to the average error at the limit; `None` without contacts that count. These are at least 1/80 of the
    /// length from the ends, and have a limit of at most 1/200 of the length.
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
    /// Summarizes the outcomes of a run of `study`, one for each arm.
    pub fn new(outcomes: &[ArmOutcome], study: &PreparedStudy) -> Self {
        let set_ups: Vec<SetUp> = study.study.arms.iter().map(SetUp::new).collect();
        // If all arms have the same, the study file states it.
        let same =
            |a: &SetUp, b: &SetUp| (a.estimator, a.force, &a.sensors) == (b.estimator, b.force, &b.sensors);
        let differ = set_ups.windows(2).any(|pair| !same(&pair[0], &pair[1]));
        let results = |outcome: &ArmOutcome| {
            let arm = study.study.arms.iter().position(|arm| arm.name == outcome.name)?;
            let set_up = differ.then(|| set_ups[arm].clone());
            ArmResults::new(outcome, &study.study.arms[arm], set_up, study.judging())
        };
        Self { arms: outcomes.iter().filter_map(results).collect() }
    }

    /// The arm with this name.
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
    fn new(outcome: &ArmOutcome, arm: &Arm, set_up: Option<SetUp>, judging: &Judging) -> Option<Self> {
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

/// The judged positions, with the mean error of an estimator at the limit at each, in metres.
fn allowed(arm: &Arm, judging: &Judging) -> Option<Vec<(Position, f64)>> {
    let force_n = arm.rig.setup.force_n().or(arm.rig.pressed_setup().ok()?.force_n())?;
    let errors_m = expected_errors_m(&arm.rig.setup, force_n, &judging.positions)?;
    Some(judging.positions.iter().copied().zip(errors_m).collect())
}

/// The mean over the figures within a portion, or over all.
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

/// One figure of the errors within a portion, in % of the length.
pub(super) fn percent(
    evaluation: &Evaluation,
    portion: Option<Portion>,
    pick: fn(ErrorSummary) -> f64,
) -> Option<f64> {
    evaluation.summary(portion).map(|summary| percentage_error(pick(summary), evaluation.extent.length_m()))
}

/// Average error of the contacts at the positions that `keep` accepts, in % of the length.
pub(super) fn average_percent(evaluation: &Evaluation, keep: impl Fn(Position) -> bool) -> Option<f64> {
    let located = evaluation.located.iter().filter(|located| keep(located.truth)).copied().collect();
    percent(&Evaluation { located, ..*evaluation }, None, |summary| summary.average_m)
}

/// Mean error, in metres, of an estimator at the limit at each of `positions`, for contacts of `force_n` newtons; `None` for a
/// bench without a limit.
///
/// Where readings hardly determine the position, the limit is unbounded, but the contact is known to lie on the surface. So
/// the bound's standard deviation s is combined with a flat prior of variance l²/12, as in the scores of a sensor design:
/// √(2/π) / √(1/s² + 12/l²), with l the surface's length. For small s, this is the mean error of the bound itself.
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
