//! Traits of estimators and locators: [`Fit`] and [`Locate`].

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::fmt::Debug;

use palpate_core::{ContactEstimate, Estimate, Position, Status, Uncertainty};
use palpate_mechanics::sensing::{Layout, Sensor};
use palpate_mechanics::surface::Extent;
use palpate_numerics::FEWEST_FOR_95;
use palpate_numerics::watch::{Cancelled, Watch};

use crate::candidate_errors::CandidateErrors;
use crate::fit_memo::FitMemo;
use crate::interval_check::{HeldOutEstimate, IntervalCheck};
pub use crate::locator_fault::LocatorFault;
use crate::offset_course::OffsetCourse;
use crate::recording::{Provenance, Recording};
use crate::setup::Setup;
use crate::split::Split;
use crate::status::{FalseAlarmRate, mark_undetermined};
use crate::thinning::thinned;
use crate::untouched_drift::UntouchedDrift;
use crate::untouched_scatter::{Deviations, UntouchedScatter};

/// Task of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitTask<'a> {
    /// Surface, sensors and known force.
    pub setup: &'a Setup,
    /// Readings with contacts: a channel per sensor, at least one row.
    pub recording: &'a Recording,
    /// Seed of random numbers.
    pub seed: u64,
    /// Watch, for progress and cancellation.
    pub watch: Watch<'a>,
    /// Influence functions that fits of this setup share.
    pub(crate) memo: Option<&'a FitMemo<'a>>,
}

impl<'a> FitTask<'a> {
    /// Returns a task with seed 0.
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
    pub(crate) fn memo(self, memo: &'a FitMemo<'a>) -> Self {
        Self { memo: self.memo.or(Some(memo)), ..self }
    }

    /// Checks for a channel per sensor.
    ///
    /// # Errors
    /// [`ChannelMismatch`].
    pub fn check_channels(&self) -> Result<(), ChannelMismatch> {
        let (needed, found) = (self.setup.layout().len(), self.recording.channels.len());
        if needed == found { Ok(()) } else { Err(ChannelMismatch { needed, found }) }
    }
}

/// Channel mismatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the recording has {found} channels; the bench has {needed} sensors")]
pub struct ChannelMismatch {
    /// Sensors of the setup.
    pub needed: usize,
    /// Channels of the recording.
    pub found: usize,
}

/// Queue of seeds and their results.
pub trait SeedQueue<T> {
    /// Returns the next seed; `None` at the end.
    fn next_seed(&mut self) -> Option<u64>;
    /// Receives the result of a fit.
    fn fitted(&mut self, seed: u64, result: T);
}

/// List of seeds with results.
#[derive(Clone, Debug)]
pub struct SeedList<T> {
    waiting: VecDeque<u64>,
    fitted: Vec<(u64, T)>,
}

impl<T> SeedList<T> {
    /// Returns a queue of these seeds.
    pub fn new(seeds: impl IntoIterator<Item = u64>) -> Self {
        Self { waiting: seeds.into_iter().collect(), fitted: Vec::new() }
    }

    /// Returns the results by rising seed.
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

pub(crate) struct MappedQueue<'a, U, F> {
    pub queue: &'a mut dyn SeedQueue<U>,
    pub map: F,
}

impl<T, U, F: Fn(u64, T) -> U> SeedQueue<T> for MappedQueue<'_, U, F> {
    fn next_seed(&mut self) -> Option<u64> {
        self.queue.next_seed()
    }

    fn fitted(&mut self, seed: u64, result: T) {
        self.queue.fitted(seed, (self.map)(seed, result));
    }
}

/// Estimator: a configured method that can be fitted.
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
    /// Fitted method.
    type Method: Locate;
    /// Error of a fit.
    type Error: From<Cancelled> + From<ChannelMismatch> + std::error::Error + Send + Sync + 'static;

    /// Fits the method alone.
    ///
    /// # Errors
    /// Unsuitable recording or cancellation.
    fn fit_method(&self, task: FitTask) -> Result<Self::Method, Self::Error>;

    /// Fits with seed 0.
    ///
    /// # Errors
    /// Unsuitable recording.
    fn fit(&self, setup: &Setup, recording: &Recording) -> Result<MethodLocator<Self::Method>, Self::Error> {
        self.fit_task(FitTask::new(setup, recording))
    }

    /// Fits, and from 19 positions on checks and widens the 95 % intervals: see [`crate::interval_check`].
    ///
    /// # Errors
    /// Unsuitable recording or cancellation.
    fn fit_task(&self, task: FitTask) -> Result<MethodLocator<Self::Method>, Self::Error> {
        fit_with_interval_check(self, task)
    }

    /// Fits without an interval check.
    ///
    /// # Errors
    /// Unsuitable recording or cancellation.
    fn fit_without_interval_check(&self, task: FitTask) -> Result<MethodLocator<Self::Method>, Self::Error> {
        Ok(self.fit_unchecked(task)?.with_scatter_of(task.recording))
    }

    /// Returns the offsets at the rows of `asked` by the drift of the task's presses.
    fn drift_course(&self, _task: FitTask, _asked: &Recording) -> Option<OffsetCourse> {
        None
    }

    /// Fits without any check, for studies.
    ///
    /// # Errors
    /// Unsuitable recording or cancellation.
    fn fit_unchecked(&self, task: FitTask) -> Result<MethodLocator<Self::Method>, Self::Error> {
        task.check_channels()?;
        Ok(MethodLocator::new(task, self.fit_method(task)?))
    }

    /// Fits every seed of a queue, equal to [`Fit::fit_unchecked`]; some methods fit several at once.
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
    /// Unsuitable recording or cancellation, with completed locators in the queue.
    fn fit_many(
        &self,
        task: FitTask,
        queue: &mut dyn SeedQueue<MethodLocator<Self::Method>>,
    ) -> Result<(), Self::Error> {
        while let Some(seed) = queue.next_seed() {
            queue.fitted(seed, self.fit_unchecked(task.seed(seed))?);
        }
        Ok(())
    }
}

/// One fold per position for few: larger folds would leave gaps that contacts in use do not meet.
pub(crate) fn check_folds(places: usize) -> usize {
    const MOST_ALONE: usize = 40;
    const OF_MANY: usize = 5;
    if places <= MOST_ALONE { places } else { OF_MANY }
}

const MOST_PRESSES_CHECKED: usize = 400;

pub(crate) fn fit_with_interval_check<E: Fit + ?Sized>(
    estimator: &E,
    task: FitTask,
) -> Result<MethodLocator<E::Method>, E::Error> {
    let memo = FitMemo::new(task.setup);
    let task = task.memo(&memo);
    let locator = estimator.fit_without_interval_check(task)?;
    let interval_check = check_intervals(estimator, task)?;
    Ok(MethodLocator { interval_check, ..locator })
}

/// Interval check; `None` for fewer than [`FEWEST_FOR_95`] positions, no intervals, or a failed fold. Drift
/// is subtracted, as by a tare.
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
    for Split { training, held_out, offsets, .. } in &mut splits {
        let kept: Vec<usize> = thinned(held_out.rows.len(), MOST_PRESSES_CHECKED).collect();
        *held_out = held_out.subset(&kept);
        *offsets = drifts
            .then(|| estimator.drift_course(FitTask { recording: training, ..task }, held_out))
            .flatten();
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

pub(crate) struct HeldOut {
    pub estimates: Vec<HeldOutEstimate>,
    pub fitting_s: f64,
    pub locating_s: f64,
}

pub(crate) enum HoldOutError<E> {
    Fit(E),
    Reading(ReadingError),
}

pub(crate) struct HoldOutTask<'a> {
    pub setup: &'a Setup,
    pub splits: &'a [Split],
    pub seed: u64,
    pub clock: &'a dyn Fn() -> f64,
    pub watch: Watch<'a>,
    pub memo: Option<&'a FitMemo<'a>>,
}

impl HoldOutTask<'_> {
    /// `fit` receives the split's number, and also returns seconds that it saved.
    pub fn run<M: Locate, E>(
        &self,
        fit: impl Fn(usize, FitTask) -> Result<(MethodLocator<M>, f64), E>,
    ) -> Result<HeldOut, HoldOutError<E>> {
        let Self { setup, splits, seed, clock, watch, memo } = *self;
        let mut results = HeldOut { estimates: Vec::new(), fitting_s: 0.0, locating_s: 0.0 };
        for (fold, Split { training, held_out, offsets, .. }) in splits.iter().enumerate() {
            let start = clock();
            let task = FitTask { setup, recording: training, seed, watch, memo };
            let (locator, shared_s) = fit(fold, task).map_err(HoldOutError::Fit)?;
            let fitted = clock();
            let tared =
                offsets.as_ref().map(|course| course.tared(held_out, locator.method.offsets().as_deref()));
            let presses = tared.as_ref().unwrap_or(held_out).rows.iter().filter(|row| row.touches());
            for row in presses {
                let estimate = locator.locate(&row.reading).map_err(HoldOutError::Reading)?;
                let (truth, force_n) = (row.position, row.force_n);
                results.estimates.push(HeldOutEstimate { truth, force_n, estimate, fold });
            }
            results.fitting_s += fitted - start + shared_s;
            results.locating_s += clock() - fitted;
        }
        Ok(results)
    }
}

/// Fitted method.
pub trait Locate {
    /// Check of estimates.
    type Check: CheckEstimate;

    /// Estimates the contact of a finite reading.
    fn locate(&self, reading: &[f64]) -> Estimate;

    /// Estimates the contacts of consecutive readings, equal to [`Locate::locate`] to the last bit.
    fn locate_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate]) {
        for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
            *estimate = self.locate(reading);
        }
    }

    /// Learnt offsets in SI units; `None` without them.
    fn offsets(&self) -> Option<Vec<f64>> {
        None
    }

    /// Learnt noise standard deviations of used channels.
    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        None
    }

    /// False-alarm rate; `None` for a method without detection.
    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        None
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault`].
    fn check(&self, setup: &Setup) -> Result<(), LocatorFault>;
}

/// Check of estimates by a second method.
pub trait CheckEstimate: Clone + Debug + PartialEq + Serialize + DeserializeOwned {
    /// False-alarm rate; `None` for a check without detection.
    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        None
    }

    /// Noise standard deviations, as [`Locate::noise_sd`].
    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        None
    }

    /// Returns the checked estimate of a reading.
    fn checked(&self, reading: &[f64], estimate: Estimate, extent: Extent) -> Estimate;

    /// Checks the estimates of consecutive readings.
    fn check_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate], extent: Extent) {
        for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
            *estimate = self.checked(reading, *estimate, extent);
        }
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault`].
    fn check(&self, setup: &Setup) -> Result<(), LocatorFault>;
}

/// Check of methods that need none.
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

/// Locator: fitted method, setup and provenance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodLocator<M: Locate> {
    /// Surface and sensors.
    pub setup: Setup,
    /// Provenance.
    pub provenance: LocatorProvenance,
    /// Method with learnt parameters.
    pub method: M,
    /// Mean reading of untouched rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub untouched: Option<Vec<f64>>,
    /// Scatter of the untouched surface beyond noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub untouched_scatter: Option<UntouchedScatter>,
    /// Drift of the untouched reading beyond noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub untouched_drift: Option<UntouchedDrift>,
    /// Interval check, which widens the 95 % intervals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_check: Option<IntervalCheck>,
    /// Check of estimates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub check: Option<Box<M::Check>>,
}

/// Provenance of a locator.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LocatorProvenance {
    /// Version of palpate.
    pub palpate: String,
    /// Seed of the fit.
    pub seed: u64,
    /// Recording of the fit.
    pub recording: Provenance,
    /// Candidates of a choice, the chosen one first, by rising score.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choice: Vec<CandidateErrors>,
}

impl<M: Locate> MethodLocator<M> {
    /// Returns the locator of a fitted method.
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

    /// Converts the method, without the check of estimates.
    pub fn map<N: Locate>(self, convert: impl FnOnce(M) -> N) -> MethodLocator<N> {
        let Self { setup, provenance, method, untouched, untouched_scatter, untouched_drift, .. } = self;
        MethodLocator {
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

    /// Sensors, one per channel.
    pub fn layout(&self) -> &Layout {
        self.setup.layout()
    }
}

impl<M: Locate> MethodLocator<M> {
    /// Estimates the contact of a reading.
    ///
    /// # Errors
    /// [`ReadingError`].
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

    pub(crate) fn finished(&self, estimate: Estimate, reading: &[f64]) -> Estimate {
        let estimate = match &self.interval_check {
            Some(check) => check.widening().widened(estimate, self.setup.surface().extent()),
            None => estimate,
        };
        self.by_scatter(limited(estimate, reading, &self.setup), reading)
    }

    pub(crate) fn whole_surface_estimate(&self) -> Estimate {
        whole_surface_estimate_on(self.setup.surface().extent())
    }

    fn by_scatter(&self, estimate: Estimate, reading: &[f64]) -> Estimate {
        match &self.untouched_scatter {
            Some(scatter) if estimate.status != Status::NoContact && scatter.contains(reading) => {
                Estimate::of_contact(estimate.contact, Status::NoContact)
            }
            _ => estimate,
        }
    }

    /// Adds the scatter of untouched rows beyond noise (5 % level), unless it hides most presses. A method
    /// without detection takes it as its rule, without rests from single rows or repeats.
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

    /// Noise standard deviations of used channels.
    pub(crate) fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        let of_check = || self.check.as_ref()?.noise_sd();
        let of_layout = || self.setup.layout().reading_sds().ok();
        self.method.noise_sd().or_else(of_check).or_else(of_layout)
    }

    fn with_scatter(self, scatter: UntouchedScatter, recording: &Recording) -> Self {
        const MOST_HIDDEN: f64 = 0.5;
        let presses = || recording.rows.iter().filter(|row| row.touches());
        let hidden = presses().filter(|row| scatter.contains(&row.reading)).count();
        let is_right = hidden as f64 <= MOST_HIDDEN * presses().count() as f64;
        Self { untouched_scatter: if is_right { Some(scatter) } else { self.untouched_scatter }, ..self }
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault`].
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

/// Largest magnitude of a number.
pub(crate) const LARGEST: f64 = palpate_core::LARGEST_READING;

/// Makes an estimate finite, and `located` only for a restricted position.
fn limited(estimate: Estimate, reading: &[f64], setup: &Setup) -> Estimate {
    let extent = setup.surface().extent();
    let is_absurd = |(value, sensor): (&f64, &Sensor)| value.abs() > LARGEST && !sensor.channel.disabled;
    if reading.iter().zip(setup.layout().sensors()).any(is_absurd) {
        return whole_surface_estimate_on(extent);
    }
    // Where every contact is infinitely far from a reading, no contact excludes another.
    let is_point = estimate.status == Status::OutsideModel
        && estimate
            .contact
            .uncertainty
            .is_some_and(|uncertainty| uncertainty.x_95_m.0 >= uncertainty.x_95_m.1);
    if estimate.is_in_numbers() && !is_point {
        mark_undetermined(estimate, extent)
    } else {
        whole_surface_estimate_on(extent)
    }
}

/// Estimate `outside_model` in place of an infinite one.
fn whole_surface_estimate_on(extent: Extent) -> Estimate {
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

/// Invalid reading.
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
    /// Value that is not finite.
    #[error("channel {channel} reads {value}; it must be a finite number")]
    NotFinite {
        /// Channel number, from 1.
        channel: usize,
        /// Value.
        value: f64,
    },
}

impl ReadingError {
    /// Checks for `needed` finite values.
    ///
    /// # Errors
    /// [`ReadingError`].
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
