//! A study made ready: its layouts found, its recordings made.

use std::ops::Range;

use super::layouts::lay_out;
use super::run::{Trained, TrainedSeed};
use super::seed_by_seed::SeedBySeed;
use super::{Arm, Judging, Study};
use palpate_design::sensors::DesignError;
use palpate_estimators::estimator::{Estimator, FitError, Locator, Method};
use palpate_estimators::evaluation::{Evaluation, EvaluationError, Split};
use palpate_estimators::fit::FitTask;
use palpate_estimators::network::{Network, TrainingOutcome};
use palpate_estimators::setup::Setup;
use palpate_mechanics::sensing::ChannelModel;
use palpate_numerics::watch::{Cancelled, Watch};
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
    /// An arm's estimator cannot be fitted, or evaluated.
    #[error("arm `{arm}`: {error}")]
    Fit {
        /// The arm.
        arm: String,
        /// Why.
        error: EvaluationError<FitError>,
    },
    /// The run was stopped; what was finished has been observed.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
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
    InLanes(Box<InLanes>),
    /// Anything else.
    SeedBySeed(Box<SeedBySeed>),
}

/// An arm of networks on perfect sensors.
#[derive(Clone, Debug)]
pub(super) struct InLanes {
    /// What is fitted: networks.
    pub estimator: Estimator,
    pub setup: Setup,
    pub trial: Split,
}

impl InLanes {
    pub fn task<'a>(&'a self, watch: Watch<'a>) -> FitTask<'a> {
        FitTask::new(&self.setup, &self.trial.training).watch(watch)
    }
}

impl PreparedStudy {
    /// Finds the layouts that arms ask for, and makes the recordings that all seeds of an arm share.
    ///
    /// # Errors
    /// [`StudyRunError`], naming the arm, or when `watch` stopped the search for layouts.
    pub fn new(study: Study, watch: Watch) -> Result<Self, StudyRunError> {
        let study = lay_out(study, watch)?;
        let arms = study.arms.iter().map(|arm| PreparedArm::of(arm, &study));
        let arms = arms.collect::<Result<_, _>>()?;
        Ok(Self { study, arms })
    }

    /// Whether an arm's networks are trained in lanes, and so kept in `networks.csv`. Others are fitted again when a run is resumed.
    pub fn is_in_lanes(&self, arm: usize) -> bool {
        matches!(self.arms[arm], PreparedArm::InLanes(_))
    }

    /// Patterns that an epoch of each arm presents; 0 for an estimator that is not trained by epochs.
    pub fn patterns(&self, arm: usize) -> usize {
        match &self.arms[arm] {
            PreparedArm::InLanes(arm) => arm.trial.training.rows.len(),
            PreparedArm::SeedBySeed(arm) => arm.patterns,
        }
    }

    /// Judges a network that was trained in lanes as its arm is judged; `None` for another arm or other channels.
    pub(super) fn judge(&self, arm: usize, seed: u64, locator: Locator) -> Option<Trained> {
        let PreparedArm::InLanes(prepared) = &self.arms[arm] else { return None };
        let evaluation = Evaluation::of(&locator, &prepared.trial.judged).ok()?;
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
        let PreparedArm::InLanes(prepared) = &self.arms[arm] else { return None };
        let Estimator::Network(network) = &prepared.estimator else { return None };
        let task = prepared.task(Watch::NONE).seed(seed);
        let locator = network.restore(task, weights, outcome).ok()??;
        self.judge(arm, seed, locator.map(Method::Network))
    }

    /// How the study judges.
    pub fn judging(&self) -> &Judging {
        &self.study.judging
    }
}

impl PreparedArm {
    fn of(arm: &Arm, study: &Study) -> Result<Self, StudyRunError> {
        let judging = &study.judging;
        let simulated = |error| StudyRunError::Simulate { arm: arm.name.clone(), error };
        let setup = &arm.rig.setup;
        let perfect = setup.layout.sensors().iter().all(|sensor| sensor.channel == ChannelModel::default());
        match &arm.rig.estimator {
            Estimator::Network(network) if perfect => {
                let calibration = arm.rig.calibration().map_err(simulated)?.judged_at(&judging.positions, 1);
                let trial = calibration.simulate(0).map_err(|error| simulated(error.into()))?;
                let network = Network { precision: study.precision, ..network.clone() };
                let estimator = Estimator::Network(network);
                Ok(Self::InLanes(Box::new(InLanes { estimator, setup: setup.clone(), trial })))
            }
            _ => Ok(Self::SeedBySeed(Box::new(SeedBySeed::of(&arm.rig, judging).map_err(simulated)?))),
        }
    }
}
