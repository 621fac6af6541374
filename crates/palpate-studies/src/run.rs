//! Preparation and run of a study: layouts, recordings and fits.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use palpate_design::sensors::{DesignError, Method as DesignMethod, SensorDesign, SensorProblem};
use palpate_estimators::estimator::{Estimator, FitError, Locator, Method};
use palpate_estimators::evaluation::{
    Calibration, CalibrationTrial, EvaluatedContact, Evaluation, EvaluationError, Quantiles, Split,
};
use palpate_estimators::fit::{Fit, FitTask, SeedQueue};
use palpate_estimators::network::{Network, TrainingOutcome};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulateError;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::sensing::{ChannelModel, Layout};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_rig::{Arm, EvaluationSettings, RequestedLayout, RigSimulationError, Study};

use super::task::Task;

/// Error of running a study.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyRunError {
    /// Failed layout design.
    #[error("arm `{arm}`: {error}")]
    Design {
        /// Arm.
        arm: String,
        /// Bytes of the method in the study file.
        span: Range<usize>,
        /// Problem.
        error: Box<DesignError>,
    },
    /// Failed simulation.
    #[error("arm `{arm}`: {error}")]
    Simulate {
        /// Arm.
        arm: String,
        /// Problem.
        error: RigSimulationError,
    },
    /// Failed fit or evaluation.
    #[error("arm `{arm}`: {error}")]
    Fit {
        /// Arm.
        arm: String,
        /// Problem.
        error: EvaluationError<FitError>,
    },
    /// Unknown arm.
    #[error("the study has no arm `{arm}`; it has {}", .known.join(", "))]
    NoArm {
        /// Arm.
        arm: String,
        /// Arms of the study.
        known: Vec<String>,
    },
    /// Cancelled after some fits.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Study ready to run.
#[derive(Clone, Debug)]
pub struct PreparedStudy {
    /// Study with its designed layouts.
    pub study: Study,
    arms: Vec<PreparedArm>,
}

#[derive(Clone, Debug)]
enum PreparedArm {
    /// Networks on perfect sensors: shared recording and evaluation.
    InLanes(Box<InLanes>),
    /// Other arms: a new calibration for each seed.
    SeedBySeed {
        calibration: Box<Calibration>,
        /// Contacts by reading.
        contacts: Vec<Contact>,
        /// Patterns of an epoch; 0 without epochs.
        patterns: usize,
    },
}

#[derive(Clone, Debug)]
struct InLanes {
    estimator: Estimator,
    setup: Setup,
    trial: Split,
}

impl InLanes {
    fn task<'a>(&'a self, watch: Watch<'a>) -> FitTask<'a> {
        FitTask::new(&self.setup, &self.trial.training).watch(watch)
    }
}

impl PreparedStudy {
    /// Designs the layouts and simulates the shared recordings.
    ///
    /// # Errors
    /// [`StudyRunError`] with the arm, or if cancelled.
    pub fn new(study: Study, watch: Watch) -> Result<Self, StudyRunError> {
        let study = lay_out(study, watch)?;
        let arms = study.arms.iter().map(|arm| PreparedArm::new(arm, &study));
        let arms = arms.collect::<Result<_, _>>()?;
        Ok(Self { study, arms })
    }

    /// True for networks, restored from weights in `networks.csv`; `evaluations.csv` keeps the positions of
    /// other fits.
    pub fn keeps_weights(&self, arm: usize) -> bool {
        matches!(self.study.arms[arm].rig.estimator, Estimator::Network(_))
    }

    /// True if an arm's networks train in lanes.
    pub fn is_in_lanes(&self, arm: usize) -> bool {
        matches!(self.arms[arm], PreparedArm::InLanes(_))
    }

    /// Patterns of an epoch; 0 without epochs.
    pub fn patterns(&self, arm: usize) -> usize {
        match &self.arms[arm] {
            PreparedArm::InLanes(arm) => arm.trial.training.rows.len(),
            PreparedArm::SeedBySeed { patterns, .. } => *patterns,
        }
    }

    /// Patterns presented in a fit; 0 without epochs.
    pub fn presentations(&self, ArmFit { arm, fit }: &ArmFit) -> u64 {
        fit.training.map_or(0, |training| u64::from(training.epochs) * self.patterns(*arm) as u64)
    }

    fn evaluate(&self, arm: usize, seed: u64, locator: Locator) -> Option<ArmFit> {
        let PreparedArm::InLanes(prepared) = &self.arms[arm] else { return None };
        let evaluation = Evaluation::new(&locator, &prepared.trial.held_out).ok()?;
        Some(ArmFit { arm, fit: CalibrationTrial { seed, locator, evaluation }.into() })
    }

    /// Index of an arm.
    ///
    /// # Errors
    /// [`StudyRunError::NoArm`] with the known names.
    pub fn arm(&self, name: &str) -> Result<usize, StudyRunError> {
        self.study.arms.iter().position(|arm| arm.name == name).ok_or_else(|| StudyRunError::NoArm {
            arm: name.to_owned(),
            known: self.study.arms.iter().map(|arm| arm.name.clone()).collect(),
        })
    }

    /// Contacts by reading; empty for an arm in lanes.
    pub(crate) fn contacts(&self, arm: usize) -> &[Contact] {
        match &self.arms[arm] {
            PreparedArm::InLanes(_) => &[],
            PreparedArm::SeedBySeed { contacts, .. } => contacts,
        }
    }

    /// Restores and judges a network; `None` for unsuitable weights or estimators.
    pub fn restore(
        &self,
        arm: usize,
        seed: u64,
        weights: Vec<f64>,
        outcome: TrainingOutcome,
    ) -> Option<ArmFit> {
        match &self.arms[arm] {
            PreparedArm::InLanes(prepared) => {
                let Estimator::Network(network) = &prepared.estimator else { return None };
                let task = prepared.task(Watch::NONE).seed(seed);
                let locator = network.restore(task, weights, outcome).ok()??;
                self.evaluate(arm, seed, locator.map(Method::Network))
            }
            PreparedArm::SeedBySeed { calibration, .. } => {
                let Estimator::Network(network) = &self.study.arms[arm].rig.estimator else { return None };
                // The recording of a seed is simulated again; it is the same to the last bit.
                let restored = |task: FitTask| match network.restore(task, weights, outcome) {
                    Ok(Some(locator)) => Ok(locator.map(Method::Network)),
                    Ok(None) | Err(_) => Err(Cancelled),
                };
                let fit = calibration.run_with(seed, Watch::NONE, restored).ok()?;
                Some(ArmFit { arm, fit: fit.into() })
            }
        }
    }

    /// Positions and tolerance of the evaluation.
    pub fn evaluation_settings(&self) -> &EvaluationSettings {
        &self.study.evaluation
    }
}

impl PreparedArm {
    fn new(arm: &Arm, study: &Study) -> Result<Self, StudyRunError> {
        let judging = &study.evaluation;
        let simulated = |error| StudyRunError::Simulate { arm: arm.name.clone(), error };
        let setup = &arm.rig.setup;
        let perfect = setup.layout().sensors().iter().all(|sensor| sensor.channel == ChannelModel::default());
        match &arm.rig.estimator {
            Estimator::Network(network) if perfect => {
                let calibration =
                    arm.rig.calibration().map_err(simulated)?.with_contacts(&judging.positions, 1);
                let trial = calibration.simulate(0).map_err(|error| simulated(error.into()))?;
                let network = Network { precision: study.precision, ..network.clone() };
                let estimator = Estimator::Network(network);
                Ok(Self::InLanes(Box::new(InLanes { estimator, setup: setup.clone(), trial })))
            }
            estimator => {
                // With noisy sensors, locators are judged by the study's number of readings at each position.
                let noisy = setup.layout().sensors().iter().any(|sensor| sensor.channel.noise_sd > 0.0);
                let readings = if noisy { judging.readings } else { 1 };
                let calibration = arm.rig.calibration().map_err(simulated)?;
                let calibration = calibration.with_contacts(&judging.positions, readings);
                let is_network = matches!(estimator, Estimator::Network(_));
                let patterns = if is_network { calibration.presses().len() } else { 0 };
                let contacts = calibration.contacts().map_err(|error| simulated(error.into()))?;
                Ok(Self::SeedBySeed { calibration: Box::new(calibration), contacts, patterns })
            }
        }
    }
}

/// A layout is part of its arm and independent of the study's seeds.
const LAYOUT_SEED: u64 = 0;

/// Designs all layouts; equal requests share one result.
fn lay_out(mut study: Study, watch: Watch) -> Result<Study, StudyRunError> {
    let mut found: Vec<(LayoutRequest, Layout)> = Vec::new();
    for arm in &mut study.arms {
        let Some((asked, request)) = request(arm) else { continue };
        let layout = match found.iter().find(|(other, _)| *other == request) {
            Some((_, layout)) => layout.clone(),
            None => {
                let layout = request.layout(watch).map_err(|error| match error {
                    DesignError::Cancelled(cancelled) => StudyRunError::Cancelled(cancelled),
                    error => StudyRunError::Design {
                        arm: arm.name.clone(),
                        span: asked.span,
                        error: Box::new(error),
                    },
                })?;
                found.push((request, layout.clone()));
                layout
            }
        };
        arm.rig.setup = arm.rig.setup.clone().with_layout(layout).map_err(|error| {
            StudyRunError::Simulate { arm: arm.name.clone(), error: SimulateError::from(error).into() }
        })?;
    }
    Ok(study)
}

#[derive(PartialEq)]
struct LayoutRequest {
    method: DesignMethod,
    setup: Setup,
    design: SensorDesign,
}

impl LayoutRequest {
    fn layout(&self, watch: Watch) -> Result<Layout, DesignError> {
        let problem = SensorProblem::new(&self.setup, &self.design, watch)?;
        Ok(problem.by_method(self.method, LAYOUT_SEED, watch)?.layout)
    }
}

fn request(arm: &Arm) -> Option<(RequestedLayout, LayoutRequest)> {
    let asked = arm.layout.clone()?;
    let setup = arm.rig.training_setup().ok()?;
    let design = arm.rig.design.clone().or_else(|| SensorDesign::for_setup(&arm.rig.setup).ok())?;
    let method = asked.method;
    Some((asked, LayoutRequest { method, setup, design }))
}

/// One fitted seed of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainedSeed {
    /// Seed.
    pub seed: u64,
    /// Outcome of training; `None` without epochs.
    pub training: Option<TrainingOutcome>,
    /// Weights of a network; else empty.
    pub weights: Vec<f64>,
    /// Located contacts.
    pub evaluation: Evaluation,
}

impl From<CalibrationTrial<Method>> for TrainedSeed {
    fn from(CalibrationTrial { seed, locator, mut evaluation }: CalibrationTrial<Method>) -> Self {
        let training = locator.training_outcome();
        // Files of a study contain neither, and the results must not depend on whether a fit comes from one.
        for located in &mut evaluation.located {
            (located.status, located.force) = (None, None);
        }
        Self { seed, training, weights: locator.weights().to_vec(), evaluation }
    }
}

/// Fitted seed with its arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmFit {
    /// Index of the arm.
    pub arm: usize,
    /// Fit.
    pub fit: TrainedSeed,
}

/// All fitted seeds of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmOutcome {
    /// Name of the arm.
    pub name: String,
    /// Fits by rising seed.
    pub fits: Vec<TrainedSeed>,
}

impl ArmOutcome {
    /// Quantiles over the seeds of the mean figure at each x, m.
    pub fn by_position(&self, figure: impl Fn(&EvaluatedContact) -> f64) -> Vec<(f64, Quantiles)> {
        let means = |fit: &TrainedSeed| -> Vec<(f64, f64)> {
            let positions = fit.evaluation.located.chunk_by(|a, b| a.truth == b.truth);
            let mean = |readings: &[EvaluatedContact]| {
                readings.iter().map(&figure).sum::<f64>() / readings.len() as f64
            };
            positions.map(|readings| (readings[0].truth.x_m, mean(readings))).collect()
        };
        let seeds: Vec<Vec<(f64, f64)>> = self.fits.iter().map(means).collect();
        let at =
            |i: usize| Quantiles::from_values(seeds.iter().filter_map(|seed| Some(seed.get(i)?.1)).collect());
        let first = seeds.first().into_iter().flatten();
        first.enumerate().filter_map(|(i, (x_m, _))| Some((*x_m, at(i)?))).collect()
    }
}

/// Options of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Number of seeds.
    pub seeds: u64,
    /// Number of threads; at least 1.
    pub threads: usize,
}

/// Callback for fitted seeds; several threads call it at once.
pub type FitCallback<'a> = dyn Fn(&ArmFit) + Sync + 'a;

impl PreparedStudy {
    /// Number of parallel networks; blocks should be multiples.
    pub fn lanes(&self) -> u64 {
        self.study.precision.lanes() as u64
    }

    /// Lists the tasks in blocks of `block` seeds, costliest arms first.
    pub fn tasks(&self, seeds: u64, block: u64) -> Vec<Task> {
        let arms = self.arms_by_cost().into_iter();
        arms.flat_map(|arm| Task::blocks(&self.study.arms[arm].name, seeds, block)).collect()
    }

    /// Lists the unfinished tasks in the order of [`PreparedStudy::tasks`], in blocks of successive seeds.
    pub fn tasks_left(&self, seeds: u64, block: u64, done: &[ArmFit]) -> Vec<Task> {
        let done: HashSet<(usize, u64)> = done.iter().map(|t| (t.arm, t.fit.seed)).collect();
        let mut left: Vec<Task> = Vec::new();
        for arm in self.arms_by_cost() {
            for seed in (0..seeds).filter(|seed| !done.contains(&(arm, *seed))) {
                let name = &self.study.arms[arm].name;
                match left.last_mut() {
                    Some(task) if task.arm == *name && task.seeds.end == seed && task.fits() < block => {
                        task.seeds.end = seed + 1;
                    }
                    _ => left.push(Task { arm: name.clone(), seeds: seed..seed + 1 }),
                }
            }
        }
        left
    }

    /// Fits all seeds except those in `done` and returns all fits, independent of threads.
    ///
    /// # Errors
    /// [`StudyRunError`] if a fit fails or if cancelled; `on_trained` has received the finished fits.
    pub fn run(
        &self,
        options: RunOptions,
        mut done: Vec<ArmFit>,
        on_trained: &FitCallback,
        watch: Watch,
    ) -> Result<Vec<ArmOutcome>, StudyRunError> {
        let tasks = self.tasks(options.seeds, self.lanes());
        done.extend(self.fit_tasks(&tasks, &done, options.threads, on_trained, watch)?);
        Ok(self.by_arm(done, options.seeds))
    }

    /// Fits the seeds of tasks except those in `done`.
    ///
    /// # Errors
    /// As [`PreparedStudy::run`], and for an unknown arm.
    pub fn fit_tasks(
        &self,
        tasks: &[Task],
        done: &[ArmFit],
        threads: usize,
        on_trained: &FitCallback,
        watch: Watch,
    ) -> Result<Vec<ArmFit>, StudyRunError> {
        let work = self.work(tasks, done)?;
        let finished = Mutex::new(Vec::new());
        let failed = Mutex::new(None);
        // A failure of one thread stops the others.
        let go_on = |progress| lock(&failed).is_none() && watch.report(progress).is_ok();
        let watch = Watch::new(&go_on);
        let fit = || {
            let mut queue = Queue { study: self, arm: 0, work: &work, on_trained, finished: &finished };
            for arm in self.arms_by_cost() {
                queue.arm = arm;
                let fitted = match &self.arms[arm] {
                    PreparedArm::InLanes(prepared) => queue.fit_in_lanes(prepared, watch),
                    PreparedArm::SeedBySeed { calibration, .. } => queue.fit_each(calibration, watch),
                };
                if let Err(error) = fitted {
                    // The first error is the cause; a cancellation that it causes comes later.
                    lock(&failed).get_or_insert(error);
                    return;
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..threads.max(1) {
                scope.spawn(fit);
            }
        });
        match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(finished.into_inner().unwrap_or_else(PoisonError::into_inner)),
        }
    }

    fn work(&self, tasks: &[Task], done: &[ArmFit]) -> Result<Vec<ArmWork>, StudyRunError> {
        let mut taken: HashSet<(usize, u64)> = done.iter().map(|t| (t.arm, t.fit.seed)).collect();
        let mut seeds = vec![Vec::new(); self.arms.len()];
        for task in tasks {
            let arm = self.arm(&task.arm)?;
            seeds[arm].extend(task.seeds.clone().filter(|seed| taken.insert((arm, *seed))));
        }
        Ok(seeds.into_iter().map(|seeds| ArmWork { seeds, taken: AtomicU64::new(0) }).collect())
    }

    /// Costliest arms in lanes first; seeds of other arms keep all threads busy at the end.
    fn arms_by_cost(&self) -> Vec<usize> {
        let mut arms: Vec<usize> = (0..self.arms.len()).collect();
        arms.sort_by_key(|arm| std::cmp::Reverse((self.is_in_lanes(*arm), self.patterns(*arm))));
        arms
    }

    /// Sorts fits with seeds below `seeds` into outcomes.
    pub fn by_arm(&self, finished: Vec<ArmFit>, seeds: u64) -> Vec<ArmOutcome> {
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

struct ArmWork {
    seeds: Vec<u64>,
    taken: AtomicU64,
}

struct Queue<'a> {
    study: &'a PreparedStudy,
    arm: usize,
    work: &'a [ArmWork],
    on_trained: &'a FitCallback<'a>,
    finished: &'a Mutex<Vec<ArmFit>>,
}

impl Queue<'_> {
    fn fit_in_lanes(&mut self, prepared: &InLanes, watch: Watch) -> Result<(), StudyRunError> {
        let name = &self.study.study.arms[self.arm].name;
        prepared
            .estimator
            .fit_many(prepared.task(watch), self)
            .map_err(|error| unfitted(name, EvaluationError::Fit(error)))
    }

    fn fit_each(&mut self, calibration: &Calibration, watch: Watch) -> Result<(), StudyRunError> {
        let arm = &self.study.study.arms[self.arm];
        while let Some(seed) = self.next_seed() {
            watch.round()?;
            let fit = calibration.run(&arm.rig.estimator, seed, watch);
            let fit = fit.map_err(|error| unfitted(&arm.name, error))?;
            self.finish(ArmFit { arm: self.arm, fit: fit.into() });
        }
        Ok(())
    }

    fn finish(&self, trained: ArmFit) {
        (self.on_trained)(&trained);
        lock(self.finished).push(trained);
    }
}

fn unfitted(arm: &str, error: EvaluationError<FitError>) -> StudyRunError {
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
        // A locator that the study fitted has the study's channels.
        if let Some(trained) = self.study.evaluate(self.arm, seed, locator) {
            self.finish(trained);
        }
    }
}
