//! Tare: r − b + o, with the reading r, its baseline b (the current untouched reading), and the untouched
//! reading o at calibration.

mod rest;

use crate::{Estimate, LARGEST_READING, Status};
use rest::{Course, RestLength, RestWatch};

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
    zero: Zero,
    /// Mean and start of a moment, for [`Zero::Last`].
    moment: Option<(Baseline<B>, f64)>,
    current: Baseline<B>,
    is_confirmed: bool,
    /// Alternative to an unconfirmed baseline, or the replaced one.
    alternative: Option<Baseline<B>>,
    /// Run of readings that are `outside_model` by both baselines.
    strange: u32,
    /// Run of readings with a contact as negative.
    let_go: u32,
    /// Run of readings that only the calibration's offsets fit.
    as_learnt: u32,
    rest: RestWatch<B>,
    takes_rests: bool,
    drift: Option<CalibrationDrift<B>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Zero {
    Followed,
    Last,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Clock {
    last_s: f64,
    step_s: f64,
    interval_s: f64,
    intervals: u32,
}

#[derive(Clone, Debug, PartialEq)]
struct CalibrationDrift<B> {
    last: B,
    largest_changes: B,
}

#[derive(Clone, Debug, PartialEq)]
struct Baseline<B> {
    values: B,
    drift: B,
    carried: u32,
    since_rest: u32,
    /// Averaged readings; 0 for the offsets of the calibration.
    weight: u32,
    touched: u32,
    untouched: u32,
}

/// Error of a reading that does not fit a tare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TareError {
    /// A wrong number of channels.
    Channels {
        /// Channels of the tare.
        needed: usize,
        /// Channels of the reading.
        found: usize,
    },
    /// A value that is not finite.
    NotFinite {
        /// Channel, from 1.
        channel: usize,
        /// Value.
        value: f64,
    },
}

impl core::fmt::Display for TareError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Channels { needed, found } => {
                write!(f, "the reading has {found} channels; the tare has {needed}")
            }
            Self::NotFinite { channel, value } => {
                write!(f, "channel {channel} reads {value}; it must be a finite number")
            }
        }
    }
}

impl core::error::Error for TareError {}

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
    pub fn new(learnt: B) -> Result<Self, TareError> {
        check(learnt.as_ref(), learnt.as_ref().len())?;
        Ok(Self::of_learnt(learnt))
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
        Self { zero: Zero::Last, ..self }
    }

    /// Sets the time of the next reading in seconds, by any clock; time constant and rests are then in
    /// seconds, too. A time that does not increase restarts the clock.
    pub fn note_time(&mut self, time_s: f64) {
        let new = Clock { last_s: time_s, step_s: f64::INFINITY, interval_s: 0.0, intervals: 0 };
        let Some(mut clock) = self.clock.filter(|clock| time_s > clock.last_s) else {
            self.clock = time_s.is_finite().then_some(new);
            return;
        };
        clock.step_s = time_s - clock.last_s;
        clock.intervals = clock.intervals.saturating_add(1).min(self.time_constant);
        clock.interval_s += (clock.step_s - clock.interval_s) / f64::from(clock.intervals);
        clock.last_s = time_s;
        self.clock = clock.interval_s.is_finite().then_some(clock);
        // The conversion saturates.
        self.time_constant = ((Self::TIME_CONSTANT_S / clock.interval_s) as u32).max(Self::SETTLED);
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

    fn of_learnt(learnt: B) -> Self {
        Self {
            current: Baseline::new(learnt.clone(), 0),
            rest: RestWatch::new(&learnt),
            takes_rests: true,
            drift: None,
            calibration: learnt,
            time_constant: Self::TIME_CONSTANT,
            clock: None,
            zero: Zero::Followed,
            moment: None,
            is_confirmed: false,
            alternative: None,
            strange: 0,
            let_go: 0,
            as_learnt: 0,
        }
    }

    /// A tare with these settings, without a baseline.
    #[must_use]
    pub fn restarted(&self) -> Self {
        let Self { time_constant, clock, zero, takes_rests, .. } = *self;
        let drift = self.drift.clone();
        Self { time_constant, clock, zero, takes_rests, drift, ..Self::of_learnt(self.calibration.clone()) }
    }

    /// Estimated current untouched reading.
    pub fn baseline(&self) -> &[f64] {
        self.current.values.as_ref()
    }

    /// Untouched reading at calibration.
    pub fn calibration_baseline(&self) -> &[f64] {
        self.calibration.as_ref()
    }

    /// False while the baseline may be that of a touch.
    pub fn is_confirmed(&self) -> bool {
        self.is_confirmed
    }

    /// Adds a known untouched reading to the mean.
    ///
    /// # Errors
    /// A wrong number of channels, or a value that is not finite.
    pub fn add_untouched(&mut self, reading: &[f64]) -> Result<(), TareError> {
        check(reading, self.calibration.as_ref().len())?;
        self.is_confirmed = true;
        self.alternative = None;
        self.current.average(reading, u32::MAX);
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
        self.current.subtract_baseline(reading, self.calibration_baseline(), tared);
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
        self.current.extrapolate_drift();
        self.apply(reading, tared)?;
        let estimate = locate(tared);
        let status = estimate.status;
        if self.current.weight == 0 && is_contact(status) && self.has_drifted_to(reading) {
            self.begin_at(reading);
            self.apply(reading, tared)?;
            return Ok(locate(tared));
        }
        let course =
            match self.takes_rests && self.current.weight >= Self::SETTLED && self.is_possible(reading) {
                true => self.add_to_rest(reading, status),
                false => Course::Steady,
            };
        if course == Course::AtRest {
            if status != Status::NoContact || self.rest.has_moved(self.current.values.as_ref()) {
                self.current.put_to(self.rest.rest(), self.rest.rested());
            } else {
                self.current.since_rest = DRIFT_FROM;
            }
            self.rest.forget_touch();
            (self.let_go, self.as_learnt, self.strange) = (0, 0, 0);
        }
        if status == Status::OutsideModel {
            self.moment = None;
            if course == Course::AtRest {
                return Ok(estimate);
            }
            if self.current.weight >= Self::SETTLED {
                self.test_alternatives(reading, tared, &mut locate);
            } else {
                self.begin_at(reading);
            }
            return Ok(estimate);
        }
        (self.let_go, self.as_learnt, self.strange) = (0, 0, 0);
        if let Some(other) = &mut self.alternative {
            other.untouched = 0;
        }
        if status == Status::NoContact && self.current.weight == 0 {
            // Fitting offsets of the calibration count as a settled baseline.
            self.current.weight = Self::SETTLED;
            self.is_confirmed = true;
        }
        if status == Status::NoContact && course == Course::Steady {
            match self.zero {
                Zero::Followed => self.current.follow(reading, self.time_constant),
                Zero::Last => self.take_last(reading),
            }
        } else {
            self.moment = None;
        }
        self.current.count(status);
        if !self.is_confirmed && self.current.has_complete_touch() {
            self.is_confirmed = true;
            self.alternative = None;
        }
        Ok(estimate)
    }

    fn add_to_rest(&mut self, reading: &[f64], status: Status) -> Course {
        let length = match self.clock {
            Some(Clock { intervals: 1.., interval_s, .. }) => RestLength::of_interval(interval_s),
            _ => RestLength::COUNTED,
        };
        self.rest.add(reading, self.current.values.as_ref(), status, self.time_constant, length)
    }

    /// A reading without a time, or after a gap, is a moment by itself. A touch discards the moment with its
    /// slow beginning.
    fn take_last(&mut self, reading: &[f64]) {
        if self.current.weight < Self::SETTLED {
            self.current.average(reading, Self::SETTLED);
        }
        let Some(clock) = self.clock else {
            self.current.put_to(reading, 1);
            return;
        };
        let learnt = &self.calibration;
        let (mean, since_s) =
            self.moment.get_or_insert_with(|| (Baseline::new(learnt.clone(), 0), clock.last_s));
        mean.average(reading, u32::MAX);
        if clock.step_s.max(clock.last_s - *since_s) >= Self::MOMENT_S {
            self.current.put_to(mean.values.as_ref(), mean.weight);
            self.moment = None;
        }
    }

    /// Tests other baselines than the settled one.
    fn test_alternatives(
        &mut self,
        reading: &[f64],
        tared: &[f64],
        locate: &mut impl FnMut(&[f64]) -> Estimate,
    ) {
        let mut scratch = self.calibration.clone();
        let mut status_of = |values: &[f64]| {
            let is_finite = values.iter().all(|value| value.is_finite());
            if is_finite { locate(values).status } else { Status::OutsideModel }
        };
        for ((opposite, value), learnt) in
            scratch.as_mut().iter_mut().zip(tared).zip(self.calibration.as_ref())
        {
            *opposite = 2.0 * learnt - value;
        }
        self.let_go = next_in_row(self.let_go, is_contact(status_of(scratch.as_ref())));
        self.as_learnt = next_in_row(self.as_learnt, status_of(reading) == Status::NoContact);
        if self.as_learnt >= LET_GO {
            self.current = Baseline::new(self.calibration.clone(), Self::SETTLED);
            (self.is_confirmed, self.alternative) = (true, None);
            self.rest.forget_touch();
            self.as_learnt = 0;
            return;
        }
        // The beginning of a touch resembles a release, but its readings are not steady.
        if self.let_go >= LET_GO && self.rest.stays() {
            self.begin_at(reading);
            return;
        }
        let status = self.alternative.as_ref().map_or(Status::OutsideModel, |other| {
            other.subtract_baseline(reading, self.calibration.as_ref(), scratch.as_mut());
            status_of(scratch.as_ref())
        });
        self.update_alternative(reading, status);
    }

    /// Updates, exchanges or replaces the alternative baseline.
    fn update_alternative(&mut self, reading: &[f64], status: Status) {
        if let Some(other) = &mut self.alternative {
            self.strange = next_in_row(self.strange, status == Status::OutsideModel);
            if status == Status::NoContact {
                other.follow(reading, self.time_constant);
            }
            other.count(status);
            if other.has_complete_touch() {
                core::mem::swap(&mut self.current, other);
                other.forget_touch();
                self.rest.forget_touch();
                (self.is_confirmed, self.let_go, self.as_learnt) = (true, 0, 0);
            }
        }
        let is_wanting = self.alternative.as_ref().is_none_or(|other| {
            status == Status::OutsideModel && (other.weight < Self::SETTLED || self.strange >= LET_GO)
        });
        if !self.is_confirmed && is_wanting && self.is_possible(reading) {
            self.alternative = Some(self.baseline_at(reading));
            self.strange = 0;
        }
    }

    fn begin_at(&mut self, reading: &[f64]) {
        if !self.is_possible(reading) {
            return;
        }
        self.current = self.baseline_at(reading);
        (self.is_confirmed, self.alternative) = (false, None);
        self.rest.forget_touch();
        (self.let_go, self.as_learnt) = (0, 0);
    }

    fn baseline_at(&self, reading: &[f64]) -> Baseline<B> {
        let mut baseline = Baseline::new(self.calibration.clone(), 0);
        baseline.average(reading, self.time_constant);
        baseline
    }

    fn has_drifted_to(&self, reading: &[f64]) -> bool {
        self.drift.as_ref().is_some_and(|CalibrationDrift { last, largest_changes }| {
            let mut channels = reading.iter().zip(last.as_ref()).zip(largest_changes.as_ref());
            channels.all(|((value, last), largest)| (value - last).abs() <= *largest)
        })
    }

    fn is_possible(&self, reading: &[f64]) -> bool {
        reading.iter().all(|value| value.abs() <= LARGEST_READING)
    }
}

const LET_GO: u32 = Tare::<[f64; 0]>::LET_GO;

/// Fewest readings of a drift: the level then has 4/50 of the variance of a reading.
const DRIFT_FROM: u32 = 50;
/// Fewest readings of an extrapolated drift: over as many readings its error is √(12/200), a quarter of the
/// noise.
const DRIFT_KNOWN: u32 = 200;

impl<B: AsRef<[f64]> + AsMut<[f64]> + Clone> Baseline<B> {
    fn new(values: B, weight: u32) -> Self {
        let mut drift = values.clone();
        drift.as_mut().fill(0.0);
        Self { values, drift, carried: 0, since_rest: u32::MAX, weight, touched: 0, untouched: 0 }
    }

    /// Extrapolates the drift, at most over as many readings as it was fitted to.
    fn extrapolate_drift(&mut self) {
        let is_known = self.weight >= DRIFT_KNOWN && self.carried < self.weight;
        if is_known || (self.weight > 0 && self.carried == 0) {
            self.carried += 1;
            let drift = self.drift.as_ref().iter();
            self.values.as_mut().iter_mut().zip(drift).for_each(|(value, drift)| *value += drift);
        }
    }

    fn put_to(&mut self, rest: &[f64], readings: u32) {
        self.values.as_mut().copy_from_slice(rest);
        (self.since_rest, self.carried) = (readings, 0);
    }

    fn subtract_baseline(&self, reading: &[f64], learnt: &[f64], tared: &mut [f64]) {
        let baselines = self.values.as_ref().iter().zip(learnt);
        for ((tared, value), (baseline, learnt)) in tared.iter_mut().zip(reading).zip(baselines) {
            *tared = value - baseline + learnt;
        }
    }

    fn count(&mut self, status: Status) {
        self.untouched = next_in_row(self.untouched, status == Status::NoContact);
        if self.touched < LET_GO {
            self.touched = next_in_row(self.touched, is_contact(status));
        }
    }

    fn has_complete_touch(&self) -> bool {
        self.touched >= LET_GO && self.untouched >= LET_GO
    }

    fn forget_touch(&mut self) {
        (self.touched, self.untouched) = (0, 0);
    }

    fn average(&mut self, reading: &[f64], most: u32) {
        self.weight = self.weight.saturating_add(1).min(most);
        let share = 1.0 / f64::from(self.weight);
        for (baseline, value) in self.values.as_mut().iter_mut().zip(reading) {
            *baseline += share * (value - *baseline);
        }
    }

    /// Updates level and drift by least squares with a memory that grows to the time constant (Morrison,
    /// *Introduction to Sequential Smoothing and Prediction*, 1969: expanding-memory filter of degree 1). For
    /// the first readings, and after a rest, the level is their mean.
    fn follow(&mut self, reading: &[f64], time_constant: u32) {
        self.carried = 0;
        self.since_rest = self.since_rest.saturating_add(1);
        if self.weight < DRIFT_FROM.min(time_constant) {
            self.average(reading, time_constant);
            return;
        }
        self.weight = self.weight.saturating_add(1).min(time_constant);
        let count = f64::from(self.weight);
        let of_line = 2.0 * (2.0 * count - 1.0) / (count * (count + 1.0));
        let of_drift = 6.0 / (count * (count + 1.0));
        let of_level = of_line.max(1.0 / f64::from(self.since_rest));
        let channels = self.values.as_mut().iter_mut().zip(self.drift.as_mut()).zip(reading);
        for ((baseline, drift), value) in channels {
            let error = value - *baseline;
            *baseline += of_level * error;
            *drift += of_drift * error;
        }
    }
}

fn next_in_row(before: u32, is_one: bool) -> u32 {
    if is_one { before.saturating_add(1) } else { 0 }
}

fn is_contact(status: Status) -> bool {
    matches!(status, Status::Located | Status::Ambiguous)
}

fn check(reading: &[f64], needed: usize) -> Result<(), TareError> {
    if reading.len() != needed {
        return Err(TareError::Channels { needed, found: reading.len() });
    }
    match reading.iter().position(|value| !value.is_finite()) {
        Some(i) => Err(TareError::NotFinite { channel: i + 1, value: reading[i] }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Position;

    const LEARNT: [f64; 4] = [50.0, -20.0, 0.0, 7.0];

    /// Reading for one newton at `x`, 0 to 1.
    fn influence(x: f64) -> [f64; 4] {
        [40.0 * (1.0 - x), 40.0 * x, 60.0 * x * (1.0 - x), 25.0 * (1.0 - x * x)]
    }

    /// Least squares for noise of 1 count.
    fn locate(reading: &[f64]) -> Estimate {
        let d: [f64; 4] = core::array::from_fn(|c| reading[c] - LEARNT[c]);
        let square: f64 = d.iter().map(|d| d * d).sum();
        let misfit = |x: f64| {
            let f = influence(x);
            let (fd, ff) = f.iter().zip(&d).fold((0.0, 0.0), |(fd, ff), (f, d)| (fd + f * d, ff + f * f));
            square - fd.max(0.0) * fd.max(0.0) / ff
        };
        let places = (0..=200).map(|i| f64::from(i) / 200.0);
        let x = places.min_by(|a, b| misfit(*a).total_cmp(&misfit(*b))).unwrap();
        let status = match misfit(x) {
            _ if square < 20.0 => Status::NoContact,
            misfit if misfit < 15.0 => Status::Located,
            _ => Status::OutsideModel,
        };
        Estimate::of_position(Position::along(x), status)
    }

    fn reading(number: u32, moved: [f64; 4], force: f64, x: f64) -> [f64; 4] {
        let f = influence(x);
        core::array::from_fn(|c| {
            let phase = (number * (3 + 2 * c as u32)) % 101;
            let noise = 1.7 * (f64::from(phase) / 50.0 - 1.0);
            LEARNT[c] + moved[c] + force * f[c] + noise
        })
    }

    const MOVED: [f64; 4] = [-30.0, 12.0, 45.0, 20.0];

    fn follow(tare: &mut Tare<[f64; 4]>, reading: [f64; 4]) -> Estimate {
        let mut tared = [0.0; 4];
        let estimate = tare.locate_and_update(&reading, &mut tared, locate).unwrap();
        assert!((tared[0] - reading[0]).abs() < 200.0);
        estimate
    }

    fn follow_many(tare: &mut Tare<[f64; 4]>, numbers: core::ops::Range<u32>, (force, x): (f64, f64)) {
        for number in numbers {
            follow(tare, reading(number, MOVED, force, x));
        }
    }

    fn is_right(tare: &Tare<[f64; 4]>, moved: [f64; 4]) -> bool {
        let expected = LEARNT.iter().zip(moved).map(|(learnt, moved)| learnt + moved);
        tare.baseline().iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1.0)
    }

    #[test]
    fn forgets_over_seconds_where_readings_have_times() {
        for (rate_hz, readings) in [(10.0, 100), (100.0, 1000), (1000.0, 10_000), (0.5, 20)] {
            let mut tare = Tare::new(LEARNT).unwrap();
            for i in 0..=200 {
                tare.note_time(5.0 + f64::from(i) / rate_hz);
            }
            assert!(tare.time_constant.abs_diff(readings) <= 1, "{rate_hz} Hz: {}", tare.time_constant);
        }
        let mut tare = Tare::new(LEARNT).unwrap();
        for time_s in [0.0, f64::NAN, 1.0, f64::INFINITY, 0.5, 0.5, -1.0, 1e308, f64::MAX] {
            tare.note_time(time_s);
        }
        assert!(tare.time_constant >= Tare::<[f64; 4]>::SETTLED);
    }

    #[test]
    fn follows_a_drift_of_a_minute_at_ten_readings_a_second() {
        // Largest error of the baseline in ten minutes, in counts.
        let worst_error = |has_times: bool| {
            let mut tare = Tare::new(LEARNT).unwrap();
            (0..6000).fold(0.0, |worst: f64, i| {
                let time_s = f64::from(i) / 10.0;
                let moved = 2.0 * libm::sin(core::f64::consts::TAU * time_s / 60.0);
                if has_times {
                    tare.note_time(time_s);
                }
                follow(&mut tare, reading(i, [moved; 4], 0.0, 0.0));
                let error = (tare.baseline()[0] - LEARNT[0] - moved).abs();
                if i < 1000 { worst } else { worst.max(error) }
            })
        };
        let (timed, counted) = (worst_error(true), worst_error(false));
        assert!(timed < 1.0 && counted > 1.5, "{timed} {counted}");
    }

    #[test]
    fn the_latest_untouched_reading_is_the_zero() {
        let mut tare = Tare::new(LEARNT).unwrap().with_last_zero();
        for i in 0..40 {
            let moved = [0.5 * f64::from(i); 4];
            let untouched = reading(i, moved, 0.0, 0.0);
            assert_eq!(follow(&mut tare, untouched).status, Status::NoContact, "{i}");
            assert_eq!(tare.baseline(), untouched);
            assert_eq!(follow(&mut tare, reading(i, moved, 1.5, 0.3)).status, Status::Located, "{i}");
            assert_eq!(tare.baseline(), untouched);
        }
    }

    #[test]
    fn a_slow_touch_does_not_go_into_the_baseline_of_a_fast_board() {
        // The force grows from 0 to 1.5 within 0.8 s at 1,000 readings a second, after rests of several
        // lengths.
        for is_last in [false, true] {
            for rest in [1500_u32, 1700, 1950, 2300] {
                let tare = Tare::new(LEARNT).unwrap();
                let mut tare = if is_last { tare.with_last_zero() } else { tare };
                for i in 0..rest + 1500 {
                    tare.note_time(f64::from(i) * 1e-3);
                    let force = 1.5 * f64::from(i.saturating_sub(rest).min(800)) / 800.0;
                    follow(&mut tare, reading(i, MOVED, force, 0.3));
                }
                // The error of the baseline is below the detection threshold.
                let errors = (0..4).map(|c| tare.baseline()[c] - LEARNT[c] - MOVED[c]);
                let square: f64 = errors.map(|error| error * error).sum();
                assert!(square < 20.0, "{is_last}, {rest}: {square}");
            }
        }
    }

    #[test]
    fn a_surface_that_moved_is_found_and_a_held_contact_stays() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
        for i in 0..5000 {
            let estimate = follow(&mut tare, reading(i, MOVED, 1.5, 0.3));
            assert_eq!(estimate.status, Status::Located);
            assert!((estimate.contact.position.x_m - 0.3).abs() < 0.05);
        }
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
        assert_eq!(follow(&mut tare, reading(1, MOVED, 0.0, 0.0)).status, Status::NoContact);
    }

    #[test]
    fn the_drift_of_a_calibration_goes_on_until_the_first_reading() {
        // The channels have drifted like a contact of 1.5 at 0.3; a sixth of the drift follows the
        // calibration.
        let drifted = influence(0.3).map(|influence| 1.5 * influence);
        let last: [f64; 4] = core::array::from_fn(|c| LEARNT[c] + drifted[c] / 1.2);
        let moved = |i: u32, force: f64| reading(i, drifted, force, 0.7);
        let mut unaware = Tare::new(LEARNT).unwrap();
        let mut aware = unaware.clone().with_drift(last, drifted.map(|d| d.abs().max(5.0))).unwrap();
        assert_eq!(follow(&mut unaware, moved(0, 0.0)).status, Status::Located);
        for i in 0..1000 {
            let force = if (300..500).contains(&i) { 1.0 } else { 0.0 };
            let estimate = follow(&mut aware, moved(i, force));
            assert_eq!(estimate.status == Status::NoContact, force == 0.0, "{i}");
        }
        assert!(is_right(&aware, drifted), "{:?}", aware.baseline());
        // A contact at another position does not count as drift. After a contact within the reach the
        // baseline is correct.
        let mut touched = aware.restarted();
        assert_eq!(follow(&mut touched, reading(0, [0.0; 4], 4.0, 0.7)).status, Status::Located);
        let mut touched = aware.restarted();
        for i in 0..400 {
            follow(&mut touched, reading(i, drifted, if i < 200 { 0.5 } else { 0.0 }, 0.3));
        }
        assert!(is_right(&touched, drifted), "{:?}", touched.baseline());
    }

    #[test]
    fn a_slow_drift_is_followed_while_nothing_touches() {
        let mut tare = Tare::new(LEARNT).unwrap();
        let moved = |i: u32| MOVED.map(|moved| moved * f64::from(i) / 100_000.0);
        for i in 0..100_000 {
            let touched = i % 500 < 50;
            let estimate = follow(&mut tare, reading(i, moved(i), if touched { 1.0 } else { 0.0 }, 0.7));
            assert_eq!(estimate.status == Status::NoContact, !touched, "{i}");
        }
        assert!(is_right(&tare, moved(100_000)), "{:?}", tare.baseline());
    }

    /// Locator for a known force of 15.
    fn locate_known(reading: &[f64]) -> Estimate {
        let d: [f64; 4] = core::array::from_fn(|c| reading[c] - LEARNT[c]);
        let square: f64 = d.iter().map(|d| d * d).sum();
        let misfit = |x: f64| {
            let f = influence(x);
            f.iter().zip(&d).map(|(f, d)| (d - 15.0 * f) * (d - 15.0 * f)).sum::<f64>()
        };
        let places = (0..=2000).map(|i| f64::from(i) / 2000.0);
        let x = places.min_by(|a, b| misfit(*a).total_cmp(&misfit(*b))).unwrap();
        let status = match misfit(x) {
            _ if square < 20.0 => Status::NoContact,
            misfit if misfit < 40.0 => Status::Located,
            _ => Status::OutsideModel,
        };
        Estimate::of_position(Position::along(x), status)
    }

    /// Presses of 15 with a drift per reading and a residue, at 100 Hz.
    fn presses_end(locate: fn(&[f64]) -> Estimate, drift: f64, residue: f64) {
        let mut tare = Tare::new(LEARNT).unwrap();
        let mut number = 0;
        let mut next = |tare: &mut Tare<[f64; 4]>, force: f64, x: f64, left: f64| {
            number += 1;
            let moved = core::array::from_fn(|c| {
                let way = if c % 2 == 0 { 1.0 } else { -0.6 };
                MOVED[c] + drift * way * f64::from(number) + left * way
            });
            let mut tared = [0.0; 4];
            tare.locate_and_update(&reading(number, moved, force, x), &mut tared, locate).unwrap().status
        };
        for _ in 0..300 {
            next(&mut tare, 0.0, 0.0, 0.0);
        }
        for press in 0..20 {
            let x = f64::from(press * 7 % 20) / 20.0;
            let left = if press % 3 == 0 { -residue } else { residue };
            let hold = 100 + press * 15;
            for i in 0..hold + 100 {
                let share = f64::from((i + 1).min(50).min(hold + 100 - i)) / 50.0;
                next(&mut tare, 15.0 * share, x, left);
            }
            let rest: [Status; 150] = core::array::from_fn(|_| next(&mut tare, 0.0, 0.0, left));
            let late = rest[100..].iter().filter(|status| **status != Status::NoContact).count();
            assert!(late == 0, "press {press}: {late} of 50 readings are not at rest");
            for _ in 0..press * 23 {
                next(&mut tare, 0.0, 0.0, left);
            }
        }
    }

    #[test]
    fn a_press_ends_within_a_second_on_a_board_that_drifts_and_leaves_a_residue() {
        presses_end(locate_known, 0.02, 0.0);
        presses_end(locate, 0.02, 0.0);
        presses_end(locate, 0.01, 6.0);
    }

    #[test]
    fn a_board_that_is_touched_while_it_starts_is_right_once_it_is_let_go() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..300, (2.0, 0.4));
        assert!(!is_right(&tare, MOVED));
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    fn follow_palm(tare: &mut Tare<[f64; 4]>, numbers: core::ops::Range<u32>, moved: [f64; 4]) -> Estimate {
        let mut estimate = None;
        for number in numbers {
            let palm: [f64; 4] =
                core::array::from_fn(|c| reading(number, moved, 2.0, 0.0)[c] + 2.0 * influence(1.0)[c]);
            estimate = Some(follow(tare, palm));
        }
        estimate.unwrap()
    }

    #[test]
    fn a_palm_while_a_board_starts_that_has_not_moved_is_forgotten_once_it_is_gone() {
        let mut tare = Tare::new(LEARNT).unwrap();
        assert_eq!(follow_palm(&mut tare, 0..300, [0.0; 4]).status, Status::NoContact);
        assert!(!tare.is_confirmed());
        for number in 0..10 {
            follow(&mut tare, reading(number, [0.0; 4], 0.0, 0.0));
        }
        assert!(is_right(&tare, [0.0; 4]) && tare.is_confirmed(), "{:?}", tare.baseline());
    }

    #[test]
    fn a_palm_while_a_moved_board_starts_is_forgotten_once_a_contact_has_come_and_gone() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_palm(&mut tare, 0..300, MOVED);
        // These readings resemble a palm on an untouched board.
        follow_many(&mut tare, 0..100, (0.0, 0.0));
        assert_eq!(follow(&mut tare, reading(1, MOVED, 0.0, 0.0)).status, Status::OutsideModel);
        follow_many(&mut tare, 0..20, (1.5, 0.6));
        follow_many(&mut tare, 0..20, (0.0, 0.0));
        assert!(is_right(&tare, MOVED) && tare.is_confirmed(), "{:?}", tare.baseline());
        assert_eq!(follow_palm(&mut tare, 0..3000, MOVED).status, Status::OutsideModel);
    }

    #[test]
    fn object_on_a_moved_board_from_the_start_may_be_touched_and_removed() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        // A finger presses on the object first: that confirms the wrong baseline.
        follow_palm(&mut tare, 0..60, MOVED);
        let mut on_top = MOVED;
        for (c, moved) in on_top.iter_mut().enumerate() {
            *moved += 2.0 * (influence(0.0)[c] + influence(1.0)[c]);
        }
        for (number, force) in
            [(0..20, 1.5), (20..40, 0.0)].into_iter().flat_map(|(r, f)| r.map(move |n| (n, f)))
        {
            follow(&mut tare, reading(number, on_top, force, 0.6));
        }
        assert!(is_right(&tare, on_top), "{:?}", tare.baseline());
        follow_many(&mut tare, 0..20, (0.0, 0.0));
        follow_many(&mut tare, 0..20, (1.5, 0.3));
        follow_many(&mut tare, 0..20, (0.0, 0.0));
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    #[test]
    fn two_contacts_of_which_one_comes_and_goes_are_not_tared_away() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        follow_many(&mut tare, 0..20, (1.5, 0.3));
        follow_many(&mut tare, 0..20, (0.0, 0.0));
        for i in 0..3000 {
            let further = if i % 100 < 50 { 1.5 } else { 0.0 };
            let palm: [f64; 4] = core::array::from_fn(|c| {
                reading(i, MOVED, 2.0, 0.0)[c] + 2.0 * influence(1.0)[c] + further * influence(0.4)[c]
            });
            follow(&mut tare, palm);
        }
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    #[test]
    fn immense_readings_are_no_baseline() {
        let mut tare = Tare::new([0.0; 4]).unwrap();
        let mut tared = [0.0; 4];
        for _ in 0..100 {
            let estimate = tare.locate_and_update(&[1e308; 4], &mut tared, |_| {
                Estimate::of_position(Position::along(0.5), Status::OutsideModel)
            });
            assert_eq!(estimate.unwrap().status, Status::OutsideModel);
        }
        assert_eq!(tare, Tare::new([0.0; 4]).unwrap());
    }

    #[test]
    fn one_loud_reading_is_not_taken_for_a_surface_that_was_let_go() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..2000, (0.0, 0.0));
        // The negative of a contact.
        for _ in 0..Tare::<[f64; 4]>::LET_GO - 1 {
            assert_eq!(follow(&mut tare, reading(7, MOVED, -0.4, 0.4)).status, Status::OutsideModel);
        }
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
        follow_many(&mut tare, 0..1, (0.0, 0.0));
        follow(&mut tare, reading(7, MOVED, -0.4, 0.4));
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    #[test]
    fn a_palm_is_not_tared_away() {
        let mut tare = Tare::new(LEARNT).unwrap();
        follow_many(&mut tare, 0..60, (0.0, 0.0));
        for i in 0..3000 {
            assert_eq!(follow_palm(&mut tare, i..i + 1, MOVED).status, Status::OutsideModel);
        }
        assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    }

    #[test]
    fn bad_readings_are_refused_and_leave_the_baseline() {
        let mut tare = Tare::new([1.0, 2.0]).unwrap();
        let channels = TareError::Channels { needed: 2, found: 1 };
        assert_eq!(tare.add_untouched(&[1.0]), Err(channels));
        assert_eq!(tare.apply(&[1.0, 2.0], &mut [0.0]), Err(channels));
        assert!(matches!(tare.add_untouched(&[1.0, f64::NAN]), Err(TareError::NotFinite { channel: 2, .. })));
        assert!(matches!(Tare::new([f64::INFINITY]), Err(TareError::NotFinite { channel: 1, .. })));
        assert_eq!(tare, Tare::new([1.0, 2.0]).unwrap());
    }
}
