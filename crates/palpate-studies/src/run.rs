//! Running a study: every arm's seeds, in lanes and threads.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::prepare::PreparedArm;
use super::seed_by_seed::SeedBySeed;
use super::{PreparedStudy, StudyRunError};
use palpate_estimators::estimator::{Locator, LocatorQueue};
use palpate_estimators::evaluation::Evaluation;
use palpate_estimators::network::TrainingOutcome;
use palpate_numerics::simd::InstructionSet;

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
    /// Fits every seed of every arm but those in `done`, which may hold networks trained in lanes only, and answers with all of them. A seed gives the same locator
    /// whatever the number of threads and whatever was done before.
    ///
    /// # Errors
    /// [`StudyRunError`] when an estimator cannot be fitted to what its arm's sensors read.
    pub fn run(
        &self,
        options: RunOptions,
        done: Vec<Trained>,
        observer: &dyn Observer,
    ) -> Result<Vec<ArmOutcome>, StudyRunError> {
        let is_done = |arm: usize, seed: u64| done.iter().any(|t| t.arm == arm && t.fit.seed == seed);
        let work: Vec<ArmWork> = (0..self.arms.len())
            .map(|arm| {
                let seeds = (0..options.seeds).filter(|seed| !is_done(arm, *seed)).collect();
                ArmWork { seeds, taken: AtomicU64::new(0) }
            })
            .collect();
        let finished = Mutex::new(done);
        let failed = Mutex::new(None);
        std::thread::scope(|scope| {
            for _ in 0..options.threads.max(1) {
                scope.spawn(|| {
                    let mut queue = Queue { study: self, arm: 0, work: &work, observer, finished: &finished };
                    for arm in self.arms_by_cost() {
                        queue.arm = arm;
                        match &self.arms[arm] {
                            PreparedArm::InLanes { fitting, .. } => {
                                fitting.fit_many(options.set, self.study.precision, &mut queue);
                            }
                            PreparedArm::SeedBySeed(prepared) => queue.fit_each(prepared, &failed),
                        }
                    }
                });
            }
        });
        match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => {
                Ok(self.by_arm(finished.into_inner().unwrap_or_else(PoisonError::into_inner), options.seeds))
            }
        }
    }

    /// Arms in lanes first, the costliest of them first; the seeds of others fill the ends of the threads.
    fn arms_by_cost(&self) -> Vec<usize> {
        let mut arms: Vec<usize> = (0..self.arms.len()).collect();
        arms.sort_by_key(|arm| std::cmp::Reverse((self.is_in_lanes(*arm), self.patterns(*arm))));
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

/// Where one thread takes the seeds of an arm from, and leaves its fits.
struct Queue<'a> {
    study: &'a PreparedStudy,
    arm: usize,
    work: &'a [ArmWork],
    observer: &'a dyn Observer,
    finished: &'a Mutex<Vec<Trained>>,
}

impl Queue<'_> {
    /// Fits seed after seed of an arm, until none is left, the observer says no, or some thread has failed.
    fn fit_each(&mut self, prepared: &SeedBySeed, failed: &Mutex<Option<StudyRunError>>) {
        let arm = &self.study.study.arms[self.arm];
        let observer = self.observer;
        let mut keep_going = || observer.keep_going() && lock(failed).is_none();
        while keep_going() {
            let Some(seed) = self.next_seed() else { return };
            match prepared.fit((&arm.name, &arm.rig), seed, &mut keep_going) {
                Ok(None) => return,
                Ok(Some(fit)) => self.finish(Trained { arm: self.arm, fit }),
                Err(error) => {
                    lock(failed).get_or_insert(error);
                }
            }
        }
    }

    fn finish(&self, trained: Trained) {
        self.observer.trained(&trained);
        lock(self.finished).push(trained);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl LocatorQueue for Queue<'_> {
    fn next_seed(&mut self) -> Option<u64> {
        let work = &self.work[self.arm];
        let next = work.taken.fetch_add(1, Ordering::Relaxed);
        work.seeds.get(usize::try_from(next).ok()?).copied()
    }

    fn fitted(&mut self, seed: u64, locator: Locator) {
        // A locator of the study's own fitting has the study's channels.
        if let Some(trained) = self.study.judge(self.arm, seed, locator) {
            self.finish(trained);
        }
    }

    fn keep_going(&mut self) -> bool {
        self.observer.keep_going()
    }
}
