//! Running a study: every arm's seeds, in lanes and threads.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use super::{Judging, Study};
use crate::estimator::{EstimatorConfig, FitError, Fitting, Locator, LocatorQueue, ReadingError};
use crate::evaluation::Evaluation;
use crate::network::{InstructionSet, TrainingOutcome};
use crate::recording::Recording;
use crate::simulate::{SimulateError, simulate, simulate_at};

/// Why a study cannot be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// An arm's bench cannot be simulated.
    #[error("arm `{arm}`: {error}")]
    Simulate {
        /// The arm.
        arm: String,
        /// Why.
        error: SimulateError,
    },
    /// An arm's estimator is not trained from seeds.
    #[error(
        "arm `{arm}` is of kind `{kind}`; a study trains networks: `palpate compare` puts methods side by side"
    )]
    NotANetwork {
        /// The arm.
        arm: String,
        /// The kind of its estimator.
        kind: &'static str,
    },
    /// An arm's estimator cannot be fitted.
    #[error("arm `{arm}`: {error}")]
    Fit {
        /// The arm.
        arm: String,
        /// Why.
        error: FitError,
    },
}

/// A study whose recordings are made, ready to be run.
#[derive(Clone, Debug)]
pub struct PreparedStudy {
    /// The study.
    pub study: Study,
    arms: Vec<PreparedArm>,
}

#[derive(Clone, Debug)]
struct PreparedArm {
    fitting: Fitting,
    /// Clean readings at the positions where locators are judged.
    judged: Recording,
}

/// One fitted seed of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainedSeed {
    /// The seed.
    pub seed: u64,
    /// What was fitted.
    pub locator: Locator,
    /// Its answers where the study judges.
    pub evaluation: Evaluation,
}

impl TrainedSeed {
    /// How its training ended.
    pub fn outcome(&self) -> TrainingOutcome {
        self.locator.training_outcome().unwrap_or_default()
    }
}

/// A fitted seed with the place of its arm in the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Trained {
    /// Index of the arm.
    pub arm: usize,
    /// The fit.
    pub fit: TrainedSeed,
}

/// All fitted seeds of an arm, by seed.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmOutcome {
    /// The arm's name.
    pub name: String,
    /// The fits, by rising seed.
    pub fits: Vec<TrainedSeed>,
}

/// How a study is run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Seeds 0 to this less 1.
    pub seeds: u64,
    /// Threads that fit; at least 1.
    pub threads: usize,
    /// The arithmetic of the lanes.
    pub set: InstructionSet,
}

/// Watches a run from many threads at once.
pub trait Observer: Sync {
    /// A seed was fitted.
    fn trained(&self, trained: &Trained);
    /// Asked often; on `false` the run gives up what is not finished.
    fn keep_going(&self) -> bool;
}

impl PreparedStudy {
    /// Makes every arm's training recording and the clean one that judges it.
    ///
    /// # Errors
    /// [`PrepareError`], naming the arm.
    pub fn new(study: Study) -> Result<Self, PrepareError> {
        let arms = study.arms.iter().map(|arm| {
            if !matches!(arm.rig.estimator, EstimatorConfig::Network(_)) {
                let kind = arm.rig.estimator.kind();
                return Err(PrepareError::NotANetwork { arm: arm.name.clone(), kind });
            }
            let simulated = |error| PrepareError::Simulate { arm: arm.name.clone(), error };
            let mut clean = arm.rig.bench.clone();
            for sensor in &mut clean.layout.sensors {
                sensor.channel = crate::sensing::ChannelModel::default();
            }
            let judged = simulate_at(&clean, &study.judging.positions, 1, 0).map_err(simulated)?;
            let recording = simulate(&arm.rig, 0).map_err(simulated)?;
            let fitting = Fitting::prepare(&arm.rig.bench, &arm.rig.estimator, &recording)
                .map_err(|error| PrepareError::Fit { arm: arm.name.clone(), error })?;
            Ok(PreparedArm { fitting, judged })
        });
        let arms = arms.collect::<Result<_, _>>()?;
        Ok(Self { study, arms })
    }

    /// Patterns that an epoch of each arm presents.
    pub fn patterns(&self, arm: usize) -> usize {
        self.arms[arm].fitting.patterns()
    }

    /// Judges a locator as the study's arm `arm` is judged.
    ///
    /// # Errors
    /// [`ReadingError`] when the locator has other channels.
    pub fn judge(&self, arm: usize, seed: u64, locator: Locator) -> Result<Trained, ReadingError> {
        let evaluation = Evaluation::of(&locator, &self.arms[arm].judged)?;
        Ok(Trained { arm, fit: TrainedSeed { seed, locator, evaluation } })
    }

    /// The fitting of an arm, to restore locators by.
    pub fn fitting(&self, arm: usize) -> &Fitting {
        &self.arms[arm].fitting
    }

    /// How the study judges.
    pub fn judging(&self) -> &Judging {
        &self.study.judging
    }

    /// Fits every seed of every arm but those in `done`, and answers with all of them. A seed gives the same locator
    /// whatever the number of threads and whatever was done before.
    pub fn run(&self, options: RunOptions, done: Vec<Trained>, observer: &dyn Observer) -> Vec<ArmOutcome> {
        let is_done = |arm: usize, seed: u64| done.iter().any(|t| t.arm == arm && t.fit.seed == seed);
        let work: Vec<ArmWork> = (0..self.arms.len())
            .map(|arm| {
                let seeds = (0..options.seeds).filter(|seed| !is_done(arm, *seed)).collect();
                ArmWork { seeds, taken: AtomicU64::new(0) }
            })
            .collect();
        let finished = Mutex::new(done);
        std::thread::scope(|scope| {
            for _ in 0..options.threads.max(1) {
                scope.spawn(|| {
                    let mut group =
                        LaneGroup { study: self, arm: 0, work: &work, observer, finished: &finished };
                    // The costliest arms first, so that the ends of the threads lie close together.
                    for arm in self.arms_by_cost() {
                        group.arm = arm;
                        self.arms[arm].fitting.fit_many(options.set, self.study.precision, &mut group);
                    }
                });
            }
        });
        self.by_arm(finished.into_inner().unwrap_or_else(PoisonError::into_inner), options.seeds)
    }

    fn arms_by_cost(&self) -> Vec<usize> {
        let mut arms: Vec<usize> = (0..self.arms.len()).collect();
        arms.sort_by_key(|arm| std::cmp::Reverse(self.patterns(*arm)));
        arms
    }

    fn by_arm(&self, finished: Vec<Trained>, seeds: u64) -> Vec<ArmOutcome> {
        let mut outcomes: Vec<ArmOutcome> = self
            .study
            .arms
            .iter()
            .map(|arm| ArmOutcome { name: arm.name.clone(), fits: Vec::new() })
            .collect();
        for trained in finished {
            if trained.fit.seed < seeds {
                outcomes[trained.arm].fits.push(trained.fit);
            }
        }
        for outcome in &mut outcomes {
            outcome.fits.sort_by_key(|fit| fit.seed);
        }
        outcomes
    }
}

/// The seeds of an arm that are to be fitted, and how many are taken.
struct ArmWork {
    seeds: Vec<u64>,
    taken: AtomicU64,
}

/// One thread's lanes.
struct LaneGroup<'a> {
    study: &'a PreparedStudy,
    arm: usize,
    work: &'a [ArmWork],
    observer: &'a dyn Observer,
    finished: &'a Mutex<Vec<Trained>>,
}

impl LocatorQueue for LaneGroup<'_> {
    fn next_seed(&mut self) -> Option<u64> {
        let work = &self.work[self.arm];
        let next = work.taken.fetch_add(1, Ordering::Relaxed);
        work.seeds.get(usize::try_from(next).ok()?).copied()
    }

    fn fitted(&mut self, seed: u64, locator: Locator) {
        // A locator of the study's own fitting has the study's channels.
        if let Ok(trained) = self.study.judge(self.arm, seed, locator) {
            self.observer.trained(&trained);
            self.finished.lock().unwrap_or_else(PoisonError::into_inner).push(trained);
        }
    }

    fn keep_going(&mut self) -> bool {
        self.observer.keep_going()
    }
}
