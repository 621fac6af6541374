//! What a study found: each arm's figures, with their spread over the seeds.

use serde::Serialize;

use super::{ArmOutcome, Judging, TrainedSeed};
use crate::evaluation::{ErrorSummary, Evaluation, Portion, Spread, percentage_error};
use crate::network::{Precision, TrainingStatus};

/// What a study found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyResults {
    /// Every arm that has at least one fit.
    pub arms: Vec<ArmResults>,
}

/// How a study was run, as every file that it writes says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunFacts {
    /// Version of palpate.
    pub palpate: &'static str,
    /// The study's name.
    pub study: String,
    /// SHA-256 of the study file, in hexadecimal.
    pub study_sha256: String,
    /// Seeds 0 to this less 1, of every arm.
    pub seeds: u64,
    /// Threads that fitted.
    pub threads: usize,
    /// Width of the numbers in training.
    pub precision: Precision,
    /// The arithmetic of the lanes, in words.
    pub arithmetic: String,
    /// Patterns presented to networks in this run; what an earlier run left is not counted.
    pub presentations: u64,
    /// Wall-clock time of the fits, in seconds.
    pub seconds: f64,
    /// Their ratio.
    pub presentations_per_second: f64,
}

/// An arm's figures over its seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmResults {
    /// The arm.
    pub name: String,
    /// Seeds that were fitted.
    pub seeds: usize,
    /// Seeds whose training converged.
    pub converged: usize,
    /// Epochs of training.
    pub epochs: Spread,
    /// Average percentage error over all positions.
    pub error_percent: Spread,
    /// Largest percentage error over all positions.
    pub max_error_percent: Spread,
    /// Share of the positions located within the tolerance, in %.
    pub effective_length_percent: Spread,
    /// The same errors by portion; in JSON as `error_percent_20_380` and so on.
    #[serde(flatten, serialize_with = "portions_as_keys")]
    pub portions: Vec<PortionResults>,
}

/// Errors within a portion.
#[derive(Clone, Debug, PartialEq)]
pub struct PortionResults {
    /// The portion.
    pub portion: Portion,
    /// Average percentage error.
    pub error_percent: Spread,
    /// Largest percentage error.
    pub max_error_percent: Spread,
}

impl Portion {
    /// "20_380" for 20–380 mm.
    pub fn key(&self) -> String {
        format!("{}_{}", self.from_m * 1e3, self.to_m * 1e3)
    }
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
    }
    map.end()
}

impl StudyResults {
    /// Sums up the outcomes of a run.
    pub fn of(outcomes: &[ArmOutcome], judging: &Judging) -> Self {
        Self { arms: outcomes.iter().filter_map(|outcome| ArmResults::of(outcome, judging)).collect() }
    }

    /// The arm called `name`.
    pub fn arm(&self, name: &str) -> Option<&ArmResults> {
        self.arms.iter().find(|arm| arm.name == name)
    }
}

impl ArmResults {
    fn of(outcome: &ArmOutcome, judging: &Judging) -> Option<Self> {
        let spread = |figure: &dyn Fn(&TrainedSeed) -> Option<f64>| {
            Spread::of(outcome.fits.iter().filter_map(figure).collect())
        };
        let error = |portion: Option<Portion>, pick: fn(ErrorSummary) -> f64| {
            spread(&|fit: &TrainedSeed| percent(&fit.evaluation, portion, pick))
        };
        let portions = judging.portions.iter().filter_map(|portion| {
            Some(PortionResults {
                portion: *portion,
                error_percent: error(Some(*portion), |s| s.average_m)?,
                max_error_percent: error(Some(*portion), |s| s.largest_m)?,
            })
        });
        let converged = |fit: &&TrainedSeed| fit.outcome().status == TrainingStatus::Converged;
        Some(Self {
            name: outcome.name.clone(),
            seeds: outcome.fits.len(),
            converged: outcome.fits.iter().filter(converged).count(),
            epochs: spread(&|fit| Some(f64::from(fit.outcome().epochs)))?,
            error_percent: error(None, |s| s.average_m)?,
            max_error_percent: error(None, |s| s.largest_m)?,
            effective_length_percent: spread(&|fit| {
                Some(fit.evaluation.effective_percent(judging.tolerance_m))
            })?,
            portions: portions.collect(),
        })
    }
}

/// One figure of the errors within a portion, in % of the length.
pub(super) fn percent(
    evaluation: &Evaluation,
    portion: Option<Portion>,
    pick: fn(ErrorSummary) -> f64,
) -> Option<f64> {
    evaluation.summary(portion).map(|summary| percentage_error(pick(summary), evaluation.length_m))
}
