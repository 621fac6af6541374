//! The two traits of estimators: [`Fit`] calibrates, [`Locate`] locates; and the locator that fitting gives.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::fmt::Debug;

use palpate_core::{ContactEstimate, Estimate, Position, Status, Uncertainty};
use palpate_mechanics::sensing::{Layout, Sensor};
use palpate_mechanics::surface::Extent;
use palpate_numerics::FEWEST_FOR_95;
use palpate_numerics::watch::{Cancelled, Watch};

use crate::influence::LearningMemo;
use crate::interval_check::{HeldOutEstimate, IntervalCheck};
pub use crate::locator_fault::LocatorFault;
use crate::offset_course::OffsetCourse;
use crate::recording::{Provenance, Recording};
use crate::setup::Setup;
use crate::split::Split;
use crate::status::{FalseAlarmRate, unless_left_open};
use crate::thinning::thinned;
use crate::tried::Tried;
use crate::untouched_drift::UntouchedDrift;
use crate::untouched_scatter::{Deviations, UntouchedScatter};

/// Task of a fit: setup, recording and seed.
#[derive(Clone, Copy, Debug)]
pub struct FitTask<'a> {
    /// Surface, sensors, known force.
    pub setup: &'a Setup,
    /// Readings with their contacts; as many channels as the bench has sensors, and at least one row.
    pub recording: &'a Recording,
    /// Seed of the random numbers of the method.
    pub seed: u64,
    /// Watch over the fit: it receives the progress, and may stop the fit.
    pub watch: Watch<'a>,
    /// Influence functions that fits of this setup share.
    pub(crate) memo: Option<&'a LearningMemo<'a>>,
}

impl<'a> FitTask<'a> {
    /// A fit with seed 0, without a watch.
    pub fn new(setup: &'a Setup, recording: &'a Recording) -> Self {
        Self { setup, recording, seed: 0, watch: Watch::NONE, memo: None }
    }

    /// Sets the seed.
    #[must_use]
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// Sets the watch.
    #[must_use]
    pub fn watch(self, watch: Watch<'a>) -> Self {
        Self { watch, ..self }
    }

    /// Sets the shared influence functions, unless there are some.
    pub(crate) fn memo(self, memo: &'a LearningMemo<'a>) -> Self {
        Self { memo: self.memo.or(Some(memo)), ..self }
    }

    /// Checks that the recording has a channel for every sensor.
    ///
    /// # Errors
    /// [`ChannelMismatch`], with both numbers.
    pub fn check_channels(&self) -> Result<(), ChannelMismatch> {
        let (needed, found) = (self.setup.layout().len(), self.recording.channels.len());
        if needed == found { Ok(()) } else { Err(ChannelMismatch { needed, found }) }
    }
}

/// A recording with another number of channels than the setup has sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the recording has {found} channels; the bench has {needed} sensors")]
pub struct ChannelMismatch {
    /// Sensors of the setup.
    pub needed: usize,
    /// Channels of the recording.
    pub found: usize,
}

/// Queue of the seeds of pending fits, which takes their results.
pub trait SeedQueue<T> {
    /// The seed of the next fit; `None` when all are taken.
    fn next_seed(&mut self) -> Option<u64>;
    /// Takes the result of a fit.
    fn fitted(&mut self, seed: u64, result: T);
}

/// A queue of listed seeds, which keeps the results.
#[derive(Clone, Debug)]
pub struct SeedList<T> {
    waiting: VecDeque<u64>,
    fitted: Vec<(u64, T)>,
}

impl<T> SeedList<T> {
    /// A queue of these seeds, in this order.
    pub fn new(seeds: impl IntoIterator<Item = u64>) -> Self {
        Self { waiting: seeds.into_iter().collect(), fitted: Vec::new() }
    }

    /// Results of the seeds that have been fitted, by rising seed.
    pub fn into_results(mut self) -> Vec<(u64, T)> {
        self.fitted.sort_by_key(|(seed, _)| *seed);
        self.fitted
    }
}

impl<T> SeedQueue<T> for SeedList<T> {
    fn next_seed(&mut self) -> Option<u64> {
        self.waiting.pop_front()
    }

    fn fitted(&mut self, seed: u64, result: T) {
        self.fitted.push((seed, result));
    }
}

/// A queue of `U` as a queue of values that `map` converts into `U`.
pub(crate) struct Mapped<'a, U, F> {
    pub queue: &'a mut dyn SeedQueue<U>,
    pub map: F,
}

impl<T, U, F: Fn(u64, T) -> U> SeedQueue<T> for Mapped<'_, U, F> {
    fn next_seed(&mut self) -> Option<u64> {
        self.queue.next_seed()
    }

    fn fitted(&mut self, seed: u64, result: T) {
        self.queue.fitted(seed, (self.map)(seed, result));
    }
}

/// An estimator: a configured method that can be fitted.
///
/// ```
/// use palpate_estimators::arrangement::Training;
/// use palpate_estimators::fit::Fit;
/// use palpate_estimators::influence::Influence;
/// use palpate_estimators::setup::Setup;
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::Beam;
/// use palpate_mechanics::units::{gpa, mm, newtons, um};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(10), 0)?;
/// let locator = Influence::default().fit(&setup, &presses)?;
/// let estimate = locator.locate(&presses.rows[4].reading)?;
/// assert!((estimate.contact.position.x_m - mm(180.0)).abs() < mm(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Fit {
    /// The fitted method.
    type Method: Locate;
    /// Error of a fit.
    type Error: From<Cancelled> + From<ChannelMismatch> + std::error::Error + Send + Sync + 'static;

    /// Fits the method alone, to as many channels as the setup has sensors; see [`Fit::fit`].
    ///
    /// # Errors
    /// When the recording does not suit the method, or the watch stopped it.
    fn fit_method(&self, task: FitTask) -> Result<Self::Method, Self::Error>;

    /// Fits to a recording of a setup, with seed 0.
    ///
    /// # Errors
    /// When the recording does not suit the setup or the method.
    fn fit(&self, setup: &Setup, recording: &Recording) -> Result<Fitted<Self::Method>, Self::Error> {
        self.fit_task(FitTask::new(setup, recording))
    }

    /// Fits with a seed, watched. From 19 places on the 95 % intervals are checked at held-out places, and widened where they contain too few presses: see
    /// [`crate::interval_check`].
    ///
    /// # Errors
    /// When the recording does not suit the setup or the method, or the watch stopped it.
    fn fit_task(&self, task: FitTask) -> Result<Fitted<Self::Method>, Self::Error> {
        fit_with_interval_check(self, task)
    }

    /// Fits with a seed, watched, and leaves the intervals as the method gives them.
    ///
    /// # Errors
    /// When the recording does not suit the setup or the method, or the watch stopped it.
    fn fit_without_interval_check(&self, task: FitTask) -> Result<Fitted<Self::Method>, Self::Error> {
        Ok(self.fit_alone(task)?.with_scatter_of(task.recording))
    }

    /// Offsets of the channels at the rows of `asked` by the drift that the task's presses show; `None` where they show none.
    fn drift_course(&self, _task: FitTask, _asked: &Recording) -> Option<OffsetCourse> {
        None
    }

    /// Fits with a seed, watched, without a check of the estimates, for studies of a method.
    ///
    /// # Errors
    /// When the recording does not suit the setup or the method, or the watch stopped it.
    fn fit_alone(&self, task: FitTask) -> Result<Fitted<Self::Method>, Self::Error> {
        task.check_channels()?;
        Ok(Fitted::new(task, self.fit_method(task)?))
    }

    /// Fits once for every seed of a queue, to the task's recording; the task's own seed is not used. A seed gives the same locator as
    /// [`Fit::fit_alone`] does. Some methods fit many seeds at once.
    ///
    /// ```
    /// use palpate_estimators::fit::{Fit, FitTask, SeedList};
    /// use palpate_estimators::{arrangement::Training, neighbours::Neighbours, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let presses = setup.simulate(&Training::even(10), 0)?;
    /// let mut queue = SeedList::new(0..3);
    /// Neighbours::default().fit_many(FitTask::new(&setup, &presses), &mut queue)?;
    /// let (seed, locator) = queue.into_results().remove(2);
    /// assert_eq!((seed, locator.provenance.seed), (2, 2));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the recording does not suit the setup or the method, or the watch stopped it. The queue then contains the locators fitted so far.
    fn fit_many(
        &self,
        task: FitTask,
        queue: &mut dyn SeedQueue<Fitted<Self::Method>>,
    ) -> Result<(), Self::Error> {
        while let Some(seed) = queue.next_seed() {
            queue.fitted(seed, self.fit_alone(task.seed(seed))?);
        }
        Ok(())
    }
}

/// Number of folds in which intervals are checked: one for each place where places are few. A fold of several places leaves gaps that
/// contacts in use do not meet. Intervals over such gaps are wide, and do not represent those between presses.
pub(crate) fn check_folds(places: usize) -> usize {
    const MOST_ALONE: usize = 40;
    const OF_MANY: usize = 5;
    if places <= MOST_ALONE { places } else { OF_MANY }
}

/// Presses of a fold that are located, at most.
const MOST_PRESSES_CHECKED: usize = 400;

/// The locator that an estimator fits, with the check of its intervals.
pub(crate) fn fit_with_interval_check<E: Fit + ?Sized>(
    estimator: &E,
    task: FitTask,
) -> Result<Fitted<E::Method>, E::Error> {
    let memo = LearningMemo::new(task.setup);
    let task = task.memo(&memo);
    let locator = estimator.fit_without_interval_check(task)?;
    let interval_check = check_intervals(estimator, task)?;
    Ok(Fitted { interval_check, ..locator })
}

/// Checks the intervals of an estimator's locators at held-out places; `None` for fewer than [`FEWEST_FOR_95`] places, for a method without
/// intervals, and where the folds cannot be fitted. A drift that the presses show is subtracted from the held-out readings, as by a tare in
/// use.
fn check_intervals<E: Fit + ?Sized>(
    estimator: &E,
    task: FitTask,
) -> Result<Option<IntervalCheck>, Cancelled> {
    if task.recording.distinct_positions().len() < FEWEST_FOR_95 {
        return Ok(None);
    }
    let recording = &task.recording.clone().in_order();
    let folds = check_folds(recording.distinct_positions().len());
    let Ok(mut splits) = Split::by_folds(recording, folds) else { return Ok(None) };
    let drifts = estimator.drift_course(FitTask { recording, ..task }, recording).is_some();
    for Split { training, judged, offsets, .. } in &mut splits {
        let kept: Vec<usize> = thinned(judged.rows.len(), MOST_PRESSES_CHECKED).collect();
        *judged = judged.subset(&kept);
        *offsets =
            drifts.then(|| estimator.drift_course(FitTask { recording: training, ..task }, judged)).flatten();
    }
    let fit = |fold: usize, task: FitTask<'_>| {
        task.watch.counted("checking intervals", "folds", fold, folds)?;
        Ok((estimator.fit_without_interval_check(task)?, 0.0))
    };
    let FitTask { setup, seed, watch, memo, .. } = task;
    match (HoldOutTask { setup, splits: &splits, seed, clock: &|| 0.0, watch, memo }).run(fit) {
        Ok(held_out) => Ok(IntervalCheck::of_estimates(&held_out.estimates, task.setup.surface().extent())),
        Err(HoldOutError::<E::Error>::Fit(error)) if Cancelled::caused(&error) => Err(Cancelled),
        Err(_) => Ok(None),
    }
}

/// Estimates of held-out presses, and the seconds that fits and estimates took.
pub(crate) struct HeldOut {
    pub estimates: Vec<HeldOutEstimate>,
    pub fitting_s: f64,
    pub locating_s: f64,
}

/// Failure to fit to a split, or to locate its presses.
pub(crate) enum HoldOutError<E> {
    Fit(E),
    Reading(ReadingError),
}

/// Splits, and what locating their held-out presses requires.
pub(crate) struct HoldOutTask<'a> {
    pub setup: &'a Setup,
    pub splits: &'a [Split],
    pub seed: u64,
    /// Seconds since any fixed moment.
    pub clock: &'a dyn Fn() -> f64,
    pub watch: Watch<'a>,
    pub memo: Option<&'a LearningMemo<'a>>,
}

impl HoldOutTask<'_> {
    /// Locates the judged presses of each split with the locator that `fit` gives for its training part. `fit` receives the number of the split, and returns
    /// seconds too: those by which the fit would take longer alone.
    pub fn run<M: Locate, E>(
        &self,
        fit: impl Fn(usize, FitTask) -> Result<(Fitted<M>, f64), E>,
    ) -> Result<HeldOut, HoldOutError<E>> {
        let Self { setup, splits, seed, clock, watch, memo } = *self;
        let mut held_out = HeldOut { estimates: Vec::new(), fitting_s: 0.0, locating_s: 0.0 };
        for (fold, Split { training, judged, offsets, .. }) in splits.iter().enumerate() {
            let start = clock();
            let task = FitTask { setup, recording: training, seed, watch, memo };
            let (locator, shared_s) = fit(fold, task).map_err(HoldOutError::Fit)?;
            let fitted = clock();
            let tared =
                offsets.as_ref().map(|course| course.tared(judged, locator.method.offsets().as_deref()));
            let presses = tared.as_ref().unwrap_or(judged).rows.iter().filter(|row| row.touches());
            for row in presses {
                let estimate = locator.locate(&row.reading).map_err(HoldOutError::Reading)?;
                let (truth, force_n) = (row.position, row.force_n);
                held_out.estimates.push(HeldOutEstimate { truth, force_n, estimate, fold });
            }
            held_out.fitting_s += fitted - start + shared_s;
            held_out.locating_s += clock() - fitted;
        }
        Ok(held_out)
    }
}

/// A fitted method.
pub trait Locate {
    /// Check of its estimates that its locators may have.
    type Check: CheckEstimate;

    /// Estimates the contact from a reading: one finite value a channel, in SI units or raw.
    fn locate(&self, reading: &[f64]) -> Estimate;

    /// Estimates the contact of each of many readings, which lie one after the other, `channels` values each, and writes over `estimates`,
    /// one a reading. Each estimate equals that of [`Locate::locate`] to the last bit. Some methods locate many readings at once.
    fn locate_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate]) {
        for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
            *estimate = self.locate(reading);
        }
    }

    /// Offset of each channel, in its SI unit; `None` where the method does not learn it.
    fn offsets(&self) -> Option<Vec<f64>> {
        None
    }

    /// Standard deviation of each channel's noise, `None` for channels that are not in use; `None` for a method that does not learn it.
    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        None
    }

    /// Share of untouched readings that may be mistaken for a contact; `None` for a method that does not detect untouched readings.
    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        None
    }

    /// Checks the values read from a file.
    ///
    /// # Errors
    /// [`LocatorFault`], naming what does not fit together.
    fn check(&self, setup: &Setup) -> Result<(), LocatorFault>;
}

/// A check of estimates by other means than those of the method that made them.
pub trait CheckEstimate: Clone + Debug + PartialEq + Serialize + DeserializeOwned {
    /// Share of untouched readings that may be mistaken for a contact; `None` for a check that does not detect untouched readings.
    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        None
    }

    /// Standard deviation of each channel's noise, as [`Locate::noise_sd`].
    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        None
    }

    /// The estimate of a reading on a surface after the check.
    fn checked(&self, reading: &[f64], estimate: Estimate, extent: Extent) -> Estimate;

    /// Checks the estimates of many readings, which lie one after the other, `channels` values each, as [`CheckEstimate::checked`] does.
    fn check_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate], extent: Extent) {
        for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
            *estimate = self.checked(reading, *estimate, extent);
        }
    }

    /// Checks the values read from a file.
    ///
    /// # Errors
    /// [`LocatorFault`], naming what does not fit together.
    fn check(&self, setup: &Setup) -> Result<(), LocatorFault>;
}

/// The check of methods that need none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoCheck {}

impl CheckEstimate for NoCheck {
    fn checked(&self, _: &[f64], estimate: Estimate, _: Extent) -> Estimate {
        estimate
    }

    fn check(&self, _: &Setup) -> Result<(), LocatorFault> {
        Ok(())
    }
}

/// A locator: a fitted method with its setup and provenance. It contains everything that locating requires.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fitted<M: Locate> {
    /// The surface that is touched, and its sensors.
    pub setup: Setup,
    /// Provenance.
    pub provenance: LocatorProvenance,
    /// The method and what it learnt.
    pub method: M,
    /// Mean reading of the recording's rows without contact, where it has some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub untouched: Option<Vec<f64>>,
    /// Scatter of the untouched surface from one rest to the next, where noise alone does not explain it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub untouched_scatter: Option<UntouchedScatter>,
    /// Drift of the untouched reading in the course of the recording, where noise alone does not explain it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub untouched_drift: Option<UntouchedDrift>,
    /// The check of its 95 % intervals at held-out places, by which they are widened; `None` where they were not checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_check: Option<IntervalCheck>,
    /// The check of its estimates, where it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub check: Option<Box<M::Check>>,
}

/// Provenance of a locator.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LocatorProvenance {
    /// Version of palpate that fitted it.
    pub palpate: String,
    /// Seed of the fit.
    pub seed: u64,
    /// The recording that it was fitted to.
    pub recording: Provenance,
    /// Estimators among which this one was chosen, itself first, then the others by rising score; empty for an estimator that was named.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choice: Vec<Tried>,
}

impl<M: Locate> Fitted<M> {
    /// The locator of a method that was fitted to a task.
    pub fn new(task: FitTask, method: M) -> Self {
        let provenance = LocatorProvenance {
            palpate: env!("CARGO_PKG_VERSION").to_owned(),
            seed: task.seed,
            recording: task.recording.provenance.clone(),
            choice: Vec::new(),
        };
        let untouched = task.recording.untouched_mean();
        Self {
            setup: task.setup.clone(),
            provenance,
            method,
            untouched,
            untouched_scatter: None,
            untouched_drift: UntouchedDrift::of_recording(task.recording),
            interval_check: None,
            check: None,
        }
    }

    /// Converts the method to another type, and removes the check of its estimates.
    pub fn map<N: Locate>(self, convert: impl FnOnce(M) -> N) -> Fitted<N> {
        let Self { setup, provenance, method, untouched, untouched_scatter, untouched_drift, .. } = self;
        Fitted {
            setup,
            provenance,
            method: convert(method),
            untouched,
            untouched_scatter,
            untouched_drift,
            interval_check: self.interval_check,
            check: None,
        }
    }

    /// The sensors, a channel of a reading each.
    pub fn layout(&self) -> &Layout {
        self.setup.layout()
    }
}

impl<M: Locate> Fitted<M> {
    /// Estimates the contact from a reading: one value a channel, in SI units or raw.
    ///
    /// # Errors
    /// [`ReadingError`] for another number of channels or a value that is not finite.
    pub fn locate(&self, reading: &[f64]) -> Result<Estimate, ReadingError> {
        ReadingError::check(reading, self.setup.layout().len())?;
        let extent = self.setup.surface().extent();
        let estimate = self.method.locate(reading);
        let estimate = match &self.check {
            Some(check) => check.checked(reading, estimate, extent),
            None => estimate,
        };
        Ok(self.finished(estimate, reading))
    }

    /// The estimate of the method, after its check, as the locator gives it.
    pub(crate) fn finished(&self, estimate: Estimate, reading: &[f64]) -> Estimate {
        let estimate = match &self.interval_check {
            Some(check) => check.widening().widened(estimate, self.setup.surface().extent()),
            None => estimate,
        };
        self.by_scatter(limited(estimate, reading, &self.setup), reading)
    }

    /// The estimate of a reading that no contact explains.
    pub(crate) fn anywhere(&self) -> Estimate {
        anywhere_on(self.setup.surface().extent())
    }

    /// The estimate with the status `no_contact` where the reading is within the scatter of the untouched surface.
    fn by_scatter(&self, estimate: Estimate, reading: &[f64]) -> Estimate {
        match &self.untouched_scatter {
            Some(scatter) if estimate.status != Status::NoContact && scatter.contains(reading) => {
                Estimate::of_contact(estimate.contact, Status::NoContact)
            }
            _ => estimate,
        }
    }

    /// Adds the scatter of the untouched rows of the recording that the locator was fitted to, where its noise does not explain it at the 5
    /// % level. A scatter that hides most presses is not that of an untouched surface, and is omitted. A method without a rule of
    /// `no_contact` uses the scatter as its rule. Without rests, the scatter is then that of single untouched rows, or of repeats.
    #[must_use]
    pub fn with_scatter_of(self, recording: &Recording) -> Self {
        let of_check = || self.check.as_ref()?.false_alarm_rate();
        let rate = self.method.false_alarm_rate().or_else(of_check);
        let by_noise = || Deviations::of_single_rows(recording).or_else(|| Deviations::of_repeats(recording));
        let rests =
            Deviations::of_rests(recording).or_else(|| if rate.is_none() { by_noise() } else { None });
        let centre = self.method.offsets().or_else(|| self.untouched.clone());
        let Some((centre, rests)) = centre.zip(rests) else { return self };
        if rate.is_some() && self.noise_sd().is_some_and(|noise_sd| rests.are_noise(&noise_sd)) {
            return self;
        }
        let scatter = rests.scatter(centre, self.setup.layout(), rate.unwrap_or_default());
        self.with_scatter(scatter, recording)
    }

    /// Standard deviation of each channel's noise by the method, its check or the layout; `None` for a channel that is not in use.
    pub(crate) fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        let of_check = || self.check.as_ref()?.noise_sd();
        let of_layout = || self.setup.layout().reading_sds().ok();
        self.method.noise_sd().or_else(of_check).or_else(of_layout)
    }

    /// The locator with a scatter, unless this hides most presses.
    fn with_scatter(self, scatter: UntouchedScatter, recording: &Recording) -> Self {
        const MOST_HIDDEN: f64 = 0.5;
        let presses = || recording.rows.iter().filter(|row| row.touches());
        let hidden = presses().filter(|row| scatter.contains(&row.reading)).count();
        let is_right = hidden as f64 <= MOST_HIDDEN * presses().count() as f64;
        Self { untouched_scatter: if is_right { Some(scatter) } else { self.untouched_scatter }, ..self }
    }

    /// Checks the values read from a file.
    ///
    /// # Errors
    /// [`LocatorFault`], naming what does not fit together.
    pub fn check(&self) -> Result<(), LocatorFault> {
        if let Some(untouched) = &self.untouched {
            LocatorFault::check_count("untouched channels", self.setup.layout().len(), untouched.len())?;
            LocatorFault::check_numbers("untouched reading", untouched, |_| true, "a finite number")?;
        }
        if let Some(scatter) = &self.untouched_scatter {
            scatter.check(self.setup.layout().len())?;
        }
        if let Some(drift) = &self.untouched_drift {
            drift.check(self.setup.layout().len())?;
        }
        if let Some(check) = &self.interval_check {
            check.check()?;
        }
        if let Some(check) = &self.check {
            check.check(&self.setup)?;
        }
        self.method.check(&self.setup)
    }
}

/// Largest size of a number of a locator, as of a reading.
pub(crate) const LARGEST: f64 = palpate_core::LARGEST_READING;

/// The estimate that a locator returns for a reading: finite, and `located` only where the reading restricts the position.
fn limited(estimate: Estimate, reading: &[f64], setup: &Setup) -> Estimate {
    let extent = setup.surface().extent();
    let is_absurd = |(value, sensor): (&f64, &Sensor)| value.abs() > LARGEST && !sensor.channel.dead;
    if reading.iter().zip(setup.layout().sensors()).any(is_absurd) {
        return anywhere_on(extent);
    }
    // Where no contact explains a reading, and all are infinitely far from it, no contact excludes another.
    let is_point = estimate.status == Status::OutsideModel
        && estimate
            .contact
            .uncertainty
            .is_some_and(|uncertainty| uncertainty.x_95_m.0 >= uncertainty.x_95_m.1);
    if estimate.is_in_numbers() && !is_point {
        unless_left_open(estimate, extent)
    } else {
        anywhere_on(extent)
    }
}

/// The estimate in place of one with a value that is not a number, as for readings far beyond the range of a sensor: no contact explains
/// the reading, and no position of the surface is excluded.
fn anywhere_on(extent: Extent) -> Estimate {
    let (length_m, width_m) = (extent.length_m(), extent.width_m().unwrap_or(0.0));
    let uniform = |side_m: f64| side_m * side_m / 12.0;
    let uncertainty = Uncertainty {
        covariance: [uniform(length_m), 0.0, 0.0, uniform(width_m), 0.0, 0.0],
        x_95_m: (0.0, length_m),
        y_95_m: (0.0, width_m),
        force_95_n: None,
    };
    let position = Position { x_m: 0.5 * length_m, y_m: 0.5 * width_m };
    let contact = ContactEstimate { position, force_n: None, uncertainty: Some(uncertainty) };
    Estimate::of_contact(contact, Status::OutsideModel)
}

/// An invalid reading.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ReadingError {
    /// Another number of channels.
    #[error("the reading has {found} channels; the locator has {needed}")]
    Channels {
        /// Channels of the locator.
        needed: usize,
        /// Channels of the reading.
        found: usize,
    },
    /// A value that is not a number.
    #[error("channel {channel} reads {value}; it must be a finite number")]
    NotFinite {
        /// Which channel, from 1.
        channel: usize,
        /// Value.
        value: f64,
    },
}

impl ReadingError {
    /// Checks that a reading has `needed` values, all finite.
    ///
    /// # Errors
    /// [`ReadingError`], naming the first that is not.
    pub fn check(reading: &[f64], needed: usize) -> Result<(), Self> {
        let found = reading.len();
        if needed != found {
            return Err(Self::Channels { needed, found });
        }
        match reading.iter().position(|value| !value.is_finite()) {
            Some(i) => Err(Self::NotFinite { channel: i + 1, value: reading[i] }),
            None => Ok(()),
        }
    }
}
