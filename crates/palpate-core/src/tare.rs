//! Tare: r − b + o, with the reading r, its baseline b (the current untouched reading), and the untouched
//! reading o at calibration.

mod baseline;
mod clock;
mod error;
mod noise;
mod rest;
mod state;

pub use error::TareError;

use crate::{Estimate, LARGEST_READING, Status};
use baseline::Baseline;
use clock::Clock;
use error::check;
use rest::{Course, RestLength, RestWatch};
use state::{Alternative, OutsideRuns, State};

/// Baseline of the channels: mean of known untouched readings ([`Tare::add_untouched`]), or tracked
/// ([`Tare::locate_and_update`]).
///
/// ```
/// use palpate_core::Tare;
///
/// let mut tare = Tare::new([100.0, 200.0])?;
/// tare.add_untouched(&[109.0, 195.0])?;
/// tare.add_untouched(&[111.0, 195.0])?;
/// let mut tared = [0.0; 2];
/// tare.apply(&[140.0, 200.0], &mut tared)?;
/// assert_eq!(tared, [130.0, 205.0]);
/// # Ok::<(), palpate_core::TareError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Tare<B> {
    calibration: B,
    time_constant: u32,
    clock: Option<Clock>,
    zero: Zero<B>,
    takes_rests: bool,
    drift: Option<CalibrationDrift<B>>,
    baseline: Baseline<B>,
    state: State<B>,
    runs: OutsideRuns,
    rest: RestWatch<B>,
}

#[derive(Clone, Debug, PartialEq)]
enum Zero<B> {
    Tracked,
    Last { moment: Option<Moment<B>> },
}

/// Mean of the readings since a time.
#[derive(Clone, Debug, PartialEq)]
struct Moment<B> {
    mean: Baseline<B>,
    since_s: f64,
}

impl<B> Zero<B> {
    fn end_moment(&mut self) {
        if let Self::Last { moment } = self {
            *moment = None;
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
struct CalibrationDrift<B> {
    last: B,
    largest_changes: B,
}

impl<B: AsRef<[f64]>> CalibrationDrift<B> {
    fn reaches(&self, reading: &[f64]) -> bool {
        let mut channels = reading.iter().zip(self.last.as_ref()).zip(self.largest_changes.as_ref());
        channels.all(|((value, last), largest)| (value - last).abs() <= *largest)
    }
}

impl<B: AsRef<[f64]> + AsMut<[f64]> + Clone> Tare<B> {
    /// Fewest readings of a settled baseline; the mean has a fifth of the noise.
    pub const SETTLED: u32 = 20;
    /// Time constant of a tracked baseline in seconds ([`Tare::note_time`]).
    pub const TIME_CONSTANT_S: f64 = 10.0;
    /// Averaging time of [`Tare::with_last_zero`] in seconds, longer than a touch takes to build up.
    pub const MOMENT_S: f64 = 1.0;
    /// Time constant in readings without times: [`Tare::TIME_CONSTANT_S`] at 100 Hz.
    pub const TIME_CONSTANT: u32 = 1000;

    /// Consecutive readings of a release; 0.3 % of the readings of noise are outside the model.
    pub const LET_GO: u32 = 5;

    /// Creates a tare with the untouched reading at calibration.
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn new(calibration: B) -> Result<Self, TareError> {
        check(calibration.as_ref(), calibration.as_ref().len())?;
        Ok(Self::of_calibration(calibration))
    }

    fn of_calibration(calibration: B) -> Self {
        Self {
            baseline: Baseline::new(calibration.clone(), 0),
            rest: RestWatch::new(&calibration),
            calibration,
            time_constant: Self::TIME_CONSTANT,
            clock: None,
            zero: Zero::Tracked,
            takes_rests: true,
            drift: None,
            state: State::Calibration,
            runs: OutsideRuns::default(),
        }
    }

    /// Sets the time constant in readings; at least [`Tare::SETTLED`].
    #[must_use]
    pub fn with_time_constant(self, readings: u32) -> Self {
        Self { time_constant: readings.max(Self::SETTLED), ..self }
    }

    /// Uses the latest untouched reading (mean over [`Tare::MOMENT_S`]) as baseline, for calibrations with an
    /// offset per press.
    #[must_use]
    pub fn with_last_zero(self) -> Self {
        Self { zero: Zero::Last { moment: None }, ..self }
    }

    /// Keeps the residue of a touch, for callers that correct creep.
    #[must_use]
    pub fn without_rests(self) -> Self {
        Self { takes_rests: false, ..self }
    }

    /// Sets the drift of the calibration: first readings within `largest_changes` of the `last` untouched one are
    /// untouched.
    ///
    /// # Errors
    /// A wrong number of channels, or a value of `last` that is not finite.
    pub fn with_drift(mut self, last: B, largest_changes: B) -> Result<Self, TareError> {
        let needed = self.calibration.as_ref().len();
        check(last.as_ref(), needed)?;
        if largest_changes.as_ref().len() != needed {
            return Err(TareError::Channels { needed, found: largest_changes.as_ref().len() });
        }
        self.drift = Some(CalibrationDrift { last, largest_changes });
        Ok(self)
    }

    /// A tare with these settings, without a baseline.
    #[must_use]
    pub fn restarted(&self) -> Self {
        let mut zero = self.zero.clone();
        zero.end_moment();
        Self {
            time_constant: self.time_constant,
            clock: self.clock,
            zero,
            takes_rests: self.takes_rests,
            drift: self.drift.clone(),
            ..Self::of_calibration(self.calibration.clone())
        }
    }

    /// Sets the time of the next reading in seconds, by any clock; time constant and rests are then in
    /// seconds, too. A time that does not increase restarts the clock.
    pub fn note_time(&mut self, time_s: f64) {
        let Some(mut clock) = self.clock.filter(|clock| time_s > clock.last_s) else {
            self.clock = Clock::starting_at(time_s);
            return;
        };
        let interval_s = clock.advance_to(time_s, self.time_constant);
        self.clock = interval_s.is_finite().then_some(clock);
        // The conversion saturates.
        self.time_constant = ((Self::TIME_CONSTANT_S / interval_s) as u32).max(Self::SETTLED);
    }

    /// Estimated current untouched reading.
    pub fn baseline(&self) -> &[f64] {
        self.baseline.values.as_ref()
    }

    /// Untouched reading at calibration.
    pub fn calibration_baseline(&self) -> &[f64] {
        self.calibration.as_ref()
    }

    /// False while the baseline may be that of a touch.
    pub fn is_confirmed(&self) -> bool {
        matches!(self.state, State::Confirmed { .. })
    }

    /// Adds a known untouched reading to the mean.
    ///
    /// # Errors
    /// A wrong number of channels, or a value that is not finite.
    pub fn add_untouched(&mut self, reading: &[f64]) -> Result<(), TareError> {
        check(reading, self.calibration.as_ref().len())?;
        self.state = State::CONFIRMED;
        self.baseline.average(reading, u32::MAX);
        Ok(())
    }

    /// Writes the tared reading, r − b + o.
    ///
    /// # Errors
    /// A wrong number of channels, or a value that is not finite.
    pub fn apply(&self, reading: &[f64], tared: &mut [f64]) -> Result<(), TareError> {
        let needed = self.calibration.as_ref().len();
        check(reading, needed)?;
        if tared.len() != needed {
            return Err(TareError::Channels { needed, found: tared.len() });
        }
        self.baseline.subtract(reading, self.calibration_baseline(), tared);
        // The difference of finite readings can overflow.
        check(tared, needed)
    }

    /// Writes the tared reading into `tared`, locates it, and updates the baseline by its status:
    /// - `no_contact`: level and slope of a line through such readings of the last [`Tare::TIME_CONSTANT_S`];
    /// - contact: extrapolation over as many readings as the slope was fitted to. A first reading within the
    ///   drift of the calibration is the baseline ([`Tare::with_drift`]);
    /// - steady readings after a touch, `no_contact` or small compared with it (hysteresis, creep, drift):
    ///   their mean;
    /// - `outside_model` by a baseline of fewer than [`Tare::SETTLED`] readings: the reading, unless beyond
    ///   ±[`LARGEST_READING`];
    /// - `outside_model` by a settled baseline: unchanged, because a palm is not a contact of the model
    ///   either. Exceptions after [`Tare::LET_GO`] readings:
    ///   - their negative is a contact, so the surface was touched during the tare: the reading;
    ///   - the offsets of the calibration fit: these;
    ///   - a contact has begun and ended by an alternative baseline, and the current one is unconfirmed: the
    ///     alternative.
    ///
    /// Known untouched readings, fitting offsets of the calibration, or a contact that begins and ends
    /// confirm a baseline. After a touch during the start the baseline is correct from the release on, or
    /// from the end of the first valid contact on. Contacts below the detection threshold go into the
    /// baseline.
    ///
    /// # Errors
    /// As for [`Tare::apply`].
    pub fn locate_and_update(
        &mut self,
        reading: &[f64],
        tared: &mut [f64],
        mut locate: impl FnMut(&[f64]) -> Estimate,
    ) -> Result<Estimate, TareError> {
        check(reading, self.calibration.as_ref().len())?;
        self.baseline.extrapolate_drift();
        self.apply(reading, tared)?;
        let estimate = locate(tared);
        let status = estimate.status;
        if self.is_drift_of_calibration(reading, status) {
            self.restart_at(reading);
            self.apply(reading, tared)?;
            return Ok(locate(tared));
        }
        let course = self.update_rest(reading, status);
        if status != Status::OutsideModel {
            self.update_inside_model(reading, status, course);
            return Ok(estimate);
        }
        self.zero.end_moment();
        match course {
            Course::AtRest => {}
            _ if self.baseline.weight < Self::SETTLED => self.restart_at(reading),
            _ => self.update_outside_model(reading, tared, &mut locate),
        }
        Ok(estimate)
    }

    fn is_drift_of_calibration(&self, reading: &[f64], status: Status) -> bool {
        matches!(self.state, State::Calibration)
            && is_contact(status)
            && self.drift.as_ref().is_some_and(|drift| drift.reaches(reading))
    }

    /// At rest after a touch, the mean of the rest is the baseline.
    fn update_rest(&mut self, reading: &[f64], status: Status) -> Course {
        if !self.takes_rests || self.baseline.weight < Self::SETTLED || !is_possible(reading) {
            return Course::Steady;
        }
        let interval_s = self.clock.and_then(|clock| clock.interval_s());
        let length = interval_s.map_or(RestLength::COUNTED, RestLength::of_interval);
        let course =
            self.rest.add(reading, self.baseline.values.as_ref(), status, self.time_constant, length);
        if course == Course::AtRest {
            if status != Status::NoContact || self.rest.has_moved(self.baseline.values.as_ref()) {
                let (mean, readings) = self.rest.rest();
                self.baseline.set_level(mean, readings);
            } else {
                self.baseline.shorten_level_memory();
            }
            self.rest.forget_touch();
            self.interrupt_outside_runs();
        }
        course
    }

    fn update_inside_model(&mut self, reading: &[f64], status: Status, course: Course) {
        self.interrupt_outside_runs();
        if status == Status::NoContact && matches!(self.state, State::Calibration) {
            // Fitting offsets of the calibration count as a settled baseline.
            self.baseline.weight = Self::SETTLED;
            self.state = State::CONFIRMED;
        }
        if status == Status::NoContact && course == Course::Steady {
            match self.zero {
                Zero::Tracked => self.baseline.update(reading, self.time_constant),
                Zero::Last { .. } => self.update_last_zero(reading),
            }
        } else {
            self.zero.end_moment();
        }
        self.baseline.count(status);
        if !self.is_confirmed() && self.baseline.has_complete_touch() {
            self.state = State::CONFIRMED;
        }
    }

    /// A reading without a time, or after a gap, is a moment by itself. A touch discards the moment with its
    /// slow beginning.
    fn update_last_zero(&mut self, reading: &[f64]) {
        let Zero::Last { moment } = &mut self.zero else { return };
        if self.baseline.weight < Self::SETTLED {
            self.baseline.average(reading, Self::SETTLED);
        }
        let Some(clock) = self.clock else {
            self.baseline.set_level(reading, 1);
            return;
        };
        let calibration = &self.calibration;
        let Moment { mean, since_s } = moment.get_or_insert_with(|| Moment {
            mean: Baseline::new(calibration.clone(), 0),
            since_s: clock.last_s,
        });
        mean.average(reading, u32::MAX);
        if clock.step_s.max(clock.last_s - *since_s) >= Self::MOMENT_S {
            self.baseline.set_level(mean.values.as_ref(), mean.weight);
            *moment = None;
        }
    }

    /// Tests other baselines than the settled one.
    fn update_outside_model(
        &mut self,
        reading: &[f64],
        tared: &[f64],
        locate: &mut impl FnMut(&[f64]) -> Estimate,
    ) {
        let mut other = self.calibration.clone();
        let mut status_of = |values: &[f64]| {
            let is_finite = values.iter().all(|value| value.is_finite());
            if is_finite { locate(values).status } else { Status::OutsideModel }
        };
        for ((negative, value), offset) in other.as_mut().iter_mut().zip(tared).zip(self.calibration.as_ref())
        {
            *negative = 2.0 * offset - value;
        }
        let runs = &mut self.runs;
        runs.negative_contact = run_length(runs.negative_contact, is_contact(status_of(other.as_ref())));
        runs.calibration_fits = run_length(runs.calibration_fits, status_of(reading) == Status::NoContact);
        if runs.calibration_fits >= LET_GO {
            self.restore_calibration();
            return;
        }
        // The beginning of a touch resembles a release, but its readings are not steady.
        if runs.negative_contact >= LET_GO && self.rest.is_steady() {
            self.restart_at(reading);
            return;
        }
        let status = self.state.alternative().map_or(Status::OutsideModel, |alternative| {
            alternative.baseline.subtract(reading, self.calibration.as_ref(), other.as_mut());
            status_of(other.as_ref())
        });
        self.update_alternative(reading, status);
    }

    /// Updates, exchanges or replaces the alternative baseline.
    fn update_alternative(&mut self, reading: &[f64], status: Status) {
        if let Some(other) = self.state.alternative() {
            other.update(reading, status, self.time_constant);
            if other.baseline.has_complete_touch() {
                self.exchange_baselines();
                return;
            }
        }
        let start = is_possible(reading).then(|| self.baseline_at(reading));
        if let (State::Unconfirmed { alternative }, Some(start)) = (&mut self.state, start)
            && alternative.as_ref().is_none_or(|other| other.is_refuted(Self::SETTLED))
        {
            *alternative = Some(Alternative::new(start));
        }
    }

    /// Uses the alternative baseline, and keeps the one in use as its alternative.
    fn exchange_baselines(&mut self) {
        let state = core::mem::replace(&mut self.state, State::CONFIRMED);
        let (State::Unconfirmed { alternative: other } | State::Confirmed { replaced: other }) = state else {
            return;
        };
        let replaced = other.map(|mut other| {
            core::mem::swap(&mut self.baseline, &mut other.baseline);
            other.baseline.forget_touch();
            other
        });
        self.state = State::Confirmed { replaced };
        self.rest.forget_touch();
        self.runs = OutsideRuns::default();
    }

    fn restore_calibration(&mut self) {
        self.baseline = Baseline::new(self.calibration.clone(), Self::SETTLED);
        self.state = State::CONFIRMED;
        self.rest.forget_touch();
        self.runs = OutsideRuns::default();
    }

    /// Makes a reading the baseline, unless it is beyond ±[`LARGEST_READING`].
    fn restart_at(&mut self, reading: &[f64]) {
        if !is_possible(reading) {
            return;
        }
        self.baseline = self.baseline_at(reading);
        self.state = State::UNCONFIRMED;
        self.rest.forget_touch();
        self.runs = OutsideRuns::default();
    }

    fn baseline_at(&self, reading: &[f64]) -> Baseline<B> {
        let mut baseline = Baseline::new(self.calibration.clone(), 0);
        baseline.average(reading, self.time_constant);
        baseline
    }

    fn interrupt_outside_runs(&mut self) {
        self.runs = OutsideRuns::default();
        if let Some(other) = self.state.alternative() {
            other.interrupt();
        }
    }
}

const LET_GO: u32 = Tare::<[f64; 0]>::LET_GO;

fn is_possible(reading: &[f64]) -> bool {
    reading.iter().all(|value| value.abs() <= LARGEST_READING)
}

fn is_contact(status: Status) -> bool {
    matches!(status, Status::Located | Status::Ambiguous)
}

/// Length of a run with one more element.
fn run_length(before: u32, continues: bool) -> u32 {
    if continues { before.saturating_add(1) } else { 0 }
}

#[cfg(test)]
mod tests;
