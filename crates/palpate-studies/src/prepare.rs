//! A study made ready: its layouts found, its recordings made.

use std::ops::Range;

use super::layouts::lay_out;
use super::run::{Trained, TrainedSeed};
use super::seed_by_seed::{SeedBySeed, touched_bench};
use super::{Arm, Judging, Study};
use palpate_design::sensors::{DesignError, KeepGoing};
use palpate_estimators::estimator::{EstimatorConfig, FitError, Fitting, Locator, ReadingError};
use palpate_estimators::evaluation::Evaluation;
use palpate_estimators::network::TrainingOutcome;
use palpate_estimators::recording::Recording;
use palpate_estimators::simulate::simulate_at;
use palpate_mechanics::sensing::ChannelModel;
use palpate_rig::RigSimulationError;

/// Why a study cannot be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyRunError {
    /// The layout that an arm asks for cannot be had.
    #[error("arm `{arm}`: {error}")]
    Design {
        /// The arm.
        arm: String,
        /// The bytes of the study file that ask for it.
        place: Range<usize>,
        /// Why.
        error: DesignError,
    },
    /// An arm's bench cannot be simulated.
    #[error("arm `{arm}`: {error}")]
    Simulate {
        /// The arm.
        arm: String,
        /// Why.
        error: RigSimulationError,
    },
    /// An arm's estimator cannot be fitted.
    #[error("arm `{arm}`: {error}")]
    Fit {
        /// The arm.
        arm: String,
        /// Why.
        error: FitError,
    },
    /// An arm's locator does not take its readings.
    #[error("arm `{arm}`: {error}")]
    Reading {
        /// The arm.
        arm: String,
        /// Why.
        error: ReadingError,
    },
}

/// A study that is ready to be run.
#[derive(Clone, Debug)]
pub struct PreparedStudy {
    /// The study, with the layouts that its arms asked for.
    pub study: Study,
    pub(super) arms: Vec<PreparedArm>,
}

/// How an arm is fitted.
#[derive(Clone, Debug)]
pub(super) enum PreparedArm {
    /// Networks on perfect sensors: one recording for all seeds, and one to judge by.
    InLanes { fitting: Box<Fitting>, judged: Recording },
    /// Anything else.
    SeedBySeed(SeedBySeed),
}

impl PreparedStudy {
    /// Finds the layouts that arms ask for, and makes the recordings that all seeds of an arm share; `None` when `keep_going`,
    /// asked often while layouts are searched for, says no.
    ///
    /// # Errors
    /// [`StudyRunError`], naming the arm.
    pub fn new(study: Study, keep_going: &mut KeepGoing) -> Result<Option<Self>, StudyRunError> {
        let Some(study) = lay_out(study, keep_going)? else { return Ok(None) };
        let arms = study.arms.iter().map(|arm| PreparedArm::of(arm, &study.judging));
        let arms = arms.collect::<Result<_, _>>()?;
        Ok(Some(Self { study, arms }))
    }

    /// Whether an arm's networks are trained in lanes, and so kept in `networks.csv`. Others are fitted again when a run is resumed.
    pub fn is_in_lanes(&self, arm: usize) -> bool {
        matches!(self.arms[arm], PreparedArm::InLanes { .. })
    }

    /// Patterns that an epoch of each arm presents; 0 for an estimator that is not trained by epochs.
    pub fn patterns(&self, arm: usize) -> usize {
        match &self.arms[arm] {
            PreparedArm::InLanes { fitting, .. } => fitting.patterns(),
            PreparedArm::SeedBySeed(arm) => arm.patterns,
        }
    }

    /// Judges a network that was trained in lanes as its arm is judged; `None` for another arm or other channels.
    pub(super) fn judge(&self, arm: usize, seed: u64, locator: Locator) -> Option<Trained> {
        let PreparedArm::InLanes { judged, .. } = &self.arms[arm] else { return None };
        let evaluation = Evaluation::of(&locator, judged).ok()?;
        Some(Trained { arm, fit: TrainedSeed { seed, locator, evaluation } })
    }

    /// A network that was trained in lanes, from its weights and outcome, and judged; `None` when their number is not the network's,
    /// or for another arm.
    pub fn restore(
        &self,
        arm: usize,
        seed: u64,
        weights: Vec<f64>,
        outcome: TrainingOutcome,
    ) -> Option<Trained> {
        let PreparedArm::InLanes { fitting, .. } = &self.arms[arm] else { return None };
        self.judge(arm, seed, fitting.restore(seed, weights, outcome)?)
    }

    /// How the study judges.
    pub fn judging(&self) -> &Judging {
        &self.study.judging
    }
}

impl PreparedArm {
    fn of(arm: &Arm, judging: &Judging) -> Result<Self, StudyRunError> {
        let simulated = |error| StudyRunError::Simulate { arm: arm.name.clone(), error };
        let unfitted = |error| StudyRunError::Fit { arm: arm.name.clone(), error };
        let bench = &arm.rig.bench;
        let perfect = bench.layout.sensors.iter().all(|sensor| sensor.channel == ChannelModel::default());
        match &arm.rig.estimator {
            EstimatorConfig::Network(_) if perfect => {
                let judged = simulate_at(&touched_bench(&arm.rig), &judging.positions, 1, 0)
                    .map_err(|error| simulated(error.into()))?;
                let recording = arm.rig.simulate(0).map_err(simulated)?;
                let fitting = Fitting::prepare(bench, &arm.rig.estimator, &recording).map_err(unfitted)?;
                Ok(Self::InLanes { fitting: Box::new(fitting), judged })
            }
            EstimatorConfig::Auto => Err(unfitted(FitError::Undecided)),
            _ => Ok(Self::SeedBySeed(SeedBySeed::of(&arm.rig, judging).map_err(simulated)?)),
        }
    }
}
