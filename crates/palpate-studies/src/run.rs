//! Running a study: every arm's seeds, in lanes and threads.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::prepare::{InLanes, PreparedArm};
use super::seed_by_seed::SeedBySeed;
use super::{PreparedStudy, StudyRunError};
use palpate_estimators::estimator::{FitError, Locator, Method};
use palpate_estimators::evaluation::{Calibrated, EvaluationError, Located, Quantiles};
use palpate_estimators::fit::{Fit, SeedQueue};
use palpate_numerics::watch::{Cancelled, Watch};

/// One fitted seed of an arm.
pub type TrainedSeed = Calibrated<Method>;

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

impl ArmOutcome {
    /// The spread over the seeds of a figure of each contact, the mean of all readings of a seed at a position: by x in metres.
    pub fn by_position(&self, figure: impl Fn(&Located) -> f64) -> Vec<(f64, Quantiles)> {
        let means = |fit: &TrainedSeed| -> Vec<(f64, f64)> {
            let positions = fit.evaluation.located.chunk_by(|a, b| a.truth == b.truth);
            let mean =
                |readings: &[Located]| readings.iter().map(&figure).sum::<f64>() / readings.len() as f64;
            positions.map(|readings| (readings[0].truth.x_m, mean(readings))).collect()
        };
        let seeds: Vec<Vec<(f64, f64)>> = self.fits.iter().map(means).collect();
        let at = |i: usize| Quantiles::of(seeds.iter().filter_map(|seed| Some(seed.get(i)?.1)).collect());
        let first = seeds.first().into_iter().flatten();
        first.enumerate().filter_map(|(i, (x_m, _))| Some((*x_m, at(i)?))).collect()
    }
}

/// How a study is run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Seeds 0 to this less 1.
    pub seeds: u64,
    /// Threads that fit; at least 1.
    pub threads: usize,
}

/// Is told of every seed that is fitted, from many threads at once.
pub type OnTrained<'a> = dyn Fn(&Trained) + Sync + 'a;

impl PreparedStudy {
    /// Fits every seed of every arm but those in `done`, which may hold networks trained in lanes only, and answers with all of them. A seed gives the same locator
    /// whatever the number of threads and whatever was done before.
    ///
    /// # Errors
    /// [`StudyRunError`] when an estimator cannot be fitted to what its arm's sensors read, or when `watch` stopped the run; what
    /// was finished by then `on_trained` has been told of.
    pub fn run(
        &self,
        options: RunOptions,
        done: Vec<Trained>,
        on_trained: &OnTrained,
        watch: Watch,
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
        // A failure of one thread stops the others.
        let go_on = |progress| lock(&failed).is_none() && watch.report(progress).is_ok();
        let watch = Watch::new(&go_on);
        std::thread::scope(|scope| {
            for _ in 0..options.threads.max(1) {
                scope.spawn(|| {
                    let mut queue =
                        Queue { study: self, arm: 0, work: &work, on_trained, finished: &finished };
                    for arm in self.arms_by_cost() {
                        queue.arm = arm;
                        let fitted = match &self.arms[arm] {
                            PreparedArm::InLanes(prepared) => queue.fit_in_lanes(prepared, watch),
                            PreparedArm::SeedBySeed(prepared) => queue.fit_each(prepared, watch),
                        };
                        if let Err(error) = fitted {
                            // The first error is the cause; a cancellation by it comes later.
                            lock(&failed).get_or_insert(error);
                            return;
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
    on_trained: &'a OnTrained<'a>,
    finished: &'a Mutex<Vec<Trained>>,
}

impl Queue<'_> {
    /// Fits many seeds of an arm side by side.
    fn fit_in_lanes(&mut self, prepared: &InLanes, watch: Watch) -> Result<(), StudyRunError> {
        let name = &self.study.study.arms[self.arm].name;
        prepared
            .estimator
            .fit_many(prepared.task(watch), self)
            .map_err(|error| unfitted(name, EvaluationError::Fit(error)))
    }

    /// Fits seed after seed of an arm, until none is left.
    fn fit_each(&mut self, prepared: &SeedBySeed, watch: Watch) -> Result<(), StudyRunError> {
        let arm = &self.study.study.arms[self.arm];
        while let Some(seed) = self.next_seed() {
            watch.round()?;
            let fit = prepared.fit((&arm.name, &arm.rig), seed, watch)?;
            self.finish(Trained { arm: self.arm, fit });
        }
        Ok(())
    }

    fn finish(&self, trained: Trained) {
        (self.on_trained)(&trained);
        lock(self.finished).push(trained);
    }
}

/// Why an arm cannot be fitted, or that it was stopped.
pub(super) fn unfitted(arm: &str, error: EvaluationError<FitError>) -> StudyRunError {
    if Cancelled::caused(&error) {
        return Cancelled.into();
    }
    StudyRunError::Fit { arm: arm.to_owned(), error }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SeedQueue<Locator> for Queue<'_> {
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
}
