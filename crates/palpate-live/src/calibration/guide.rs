//! The guide of a calibration: the order of the presses, and the time at which the reading of each is recorded.
//!
//! Means over a stretch show whether a surface is at rest; the single reading in the middle of the stretch is recorded. A locator learns the noise
//! of a reading from the rows, and readings in use are single ones. From means it would learn noise that is too small by the square root of their
//! number. The last reading of a stretch may already be the first of a lift.
//!
//! The untouched row of a press is recorded together with the press. It is thus the last reading before the touch, after any drift in between.

use super::baseline::{Baseline, NOISE_LIMIT_SD};
use super::press::Press;
use super::repeat_check::{Doubt, GROWTH, RepeatCheck, TouchReading};
use super::stretch::{REST_SPAN, Stretch, mean};
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use serde::Serialize;
use std::time::Duration;

/// Consecutive deviating readings that count as a touch: one or two may be glitches.
pub(super) const ONSET_READINGS: u32 = 3;
/// Step of the untouched reading that is accepted at once, in standard deviations of the noise. A larger one may be a light finger, and must last
/// for [`PATIENCE`].
const FOLLOWED_STEP_SD: f64 = 2.0;
/// Share of the largest press below which a deviation does not count as a touch, because creep and hysteresis leave as much.
const RESIDUE_SHARE: f64 = 0.005;
/// Largest change of the reading of a press between both halves of a stretch at rest, as a share of the press: soft surfaces creep, and hands
/// tremble.
const REST_SHARE: f64 = 0.005;
/// `REST_SHARE` after [`PATIENCE`], so that a hand that never rests is still accepted.
const PATIENT_REST_SHARE: f64 = 0.02;
/// Largest change of the untouched reading while the surface recovers from creep, as a share of the press.
const RECOVERY_SHARE: f64 = 0.001;
/// Time after which the criterion of rest is less strict.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time after which a recovering surface counts as at rest.
const RECOVERY: Duration = Duration::from_millis(1500);
/// Share of a press that may remain after it was lifted, and share of the largest press that hysteresis may leave.
const LIFTED_SHARE: f64 = 0.1;
const HYSTERESIS_SHARE: f64 = 0.03;
/// Share of a press below which a reading at rest by noise alone for [`PARTLY_LIFTED`] counts as lifted.
const PARTLY_LIFTED_SHARE: f64 = 0.5;
const PARTLY_LIFTED: Duration = Duration::from_secs(2);
/// Share of the largest deviation of a touch below which a reading at rest counts as the rest of a lift.
const LIFT_TAIL_SHARE: f64 = 1.0 / 3.0;
/// Cosine of the angle to the last press below which a deviation counts as opposite to it.
const AGAINST: f64 = -0.8;
/// Smallest share of a press that develops within a second; a slower change counts as drift.
const ONSET_SHARE: f64 = 0.2;
/// Time for which a finger may rest lightly before it presses: a doubtful touch that rests for longer is requested again.
const LINGER: Duration = Duration::from_millis(1200);
/// Silence after which the untouched reading is learnt again, because the board may have restarted.
const SILENCE: Duration = Duration::from_secs(5);

/// Next step that a guide waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Waiting {
    /// The untouched reading is learnt; the surface must be left alone.
    Untouched,
    /// The next press.
    Press,
    /// The reading must come to rest.
    Rest,
    /// The surface must be let go.
    Release,
    /// All presses are done, or the calibration was ended.
    Nothing,
}

/// A row of the recording with the mean reading of its stretch at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct RestingRow {
    /// The row, with the reading in the middle of the stretch.
    pub row: Row,
    /// Mean reading of the stretch.
    pub mean: Vec<f64>,
}

/// Outcome of a reading.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// No change.
    None,
    /// The guide waits for another step.
    Waits(Waiting),
    /// A press was recorded.
    Pressed {
        /// The untouched surface before it; `None` if it was recorded already.
        untouched: Option<RestingRow>,
        /// The press.
        press: RestingRow,
    },
    /// The last press grew without a lift, and this row replaces it.
    Replaced(RestingRow),
    /// The untouched surface after the last press was recorded.
    Untouched(RestingRow),
    /// The press is requested again.
    AskedAgain(Doubt),
    /// The recorded press is taken back, and requested again.
    TakenBack(Doubt),
}

/// A touch since its onset.
#[derive(Clone, Copy, Debug, Default)]
struct Touch {
    /// Number of consecutive deviating readings before the onset.
    onset: u32,
    /// Largest deviation of [`ONSET_READINGS`] consecutive readings, in standard deviations of the noise.
    peak: f64,
    /// Deviations of the last two readings.
    recent: [f64; 2],
    /// Largest growth within a second, in standard deviations of the noise.
    fastest: f64,
    /// Instant since which the reading rests and is doubtful.
    doubtful_since: Option<Duration>,
}

/// Growth of a touch after its reading was recorded.
#[derive(Clone, Debug, Default)]
struct Growth {
    /// Instant since which the readings are larger, and their number.
    since: Duration,
    readings: u32,
    /// True once the growth has lasted: a hand may jerk as it lifts.
    has_lasted: bool,
    /// Largest deviation.
    deviation: Vec<f64>,
}

/// The guide of a calibration.
#[derive(Clone, Debug)]
pub struct Guide {
    plan: Vec<Press>,
    /// Index of the next press.
    next: usize,
    waiting: Waiting,
    /// Instant since which the guide waits, or of the last update of the untouched reading.
    since: Duration,
    /// Instant of the last reading, also of one that repeats the reading before it.
    last_at: Option<Duration>,
    /// True if the source repeats readings because it is faster than its sensors: each counts once.
    is_sample_and_hold: bool,
    stretch: Stretch,
    /// Untouched reading, updated with the drift while the surface is untouched.
    baseline: Option<Baseline>,
    /// The last untouched reading at rest, which is recorded with the next press.
    untouched: Option<RestingRow>,
    /// Mean untouched reading that was learnt or recorded with a press last. A reading that returns to it does not count as a press.
    reference: Vec<f64>,
    touch: Touch,
    /// Deviation of the press that must be released: recorded, or requested again.
    pressed: Vec<f64>,
    is_recorded: bool,
    growth: Growth,
    /// Largest effect of a finger that may remain after the last lift, in standard deviations of the noise; 0 once it is gone.
    lingering: f64,
    /// True from a lift until the untouched reading is at rest by noise alone: soft surfaces creep back.
    is_recovering: bool,
    checks: RepeatCheck,
}

impl Guide {
    /// A guide for a plan.
    pub fn new(plan: Vec<Press>) -> Self {
        let waiting = if plan.is_empty() { Waiting::Nothing } else { Waiting::Untouched };
        Self {
            plan,
            next: 0,
            waiting,
            since: Duration::ZERO,
            last_at: None,
            is_sample_and_hold: false,
            stretch: Stretch::default(),
            baseline: None,
            untouched: None,
            reference: Vec::new(),
            touch: Touch::default(),
            pressed: Vec::new(),
            is_recorded: false,
            growth: Growth::default(),
            lingering: 0.0,
            is_recovering: false,
            checks: RepeatCheck::default(),
        }
    }

    /// Sets the rows of earlier presses, with which new presses are also compared.
    pub fn with_rows(mut self, rows: &[Row]) -> Self {
        self.checks = RepeatCheck::new(rows);
        self
    }

    /// The next press, and its number in the plan from 0; `None` after the last.
    pub fn next_press(&self) -> Option<(usize, Press)> {
        self.plan.get(self.next).map(|press| (self.next, *press))
    }

    /// Number of recorded presses of the plan.
    pub fn taken(&self) -> usize {
        self.next
    }

    /// Presses of the plan.
    pub fn plan(&self) -> &[Press] {
        &self.plan
    }

    /// The step that the guide waits for.
    pub fn waiting(&self) -> Waiting {
        self.waiting
    }

    /// True if the source repeats readings because it is faster than its sensors: each counts once.
    pub fn is_sample_and_hold(&self) -> bool {
        self.is_sample_and_hold
    }

    /// Present mean untouched reading; `None` before it is learnt.
    pub fn untouched_reading(&self) -> Option<&[f64]> {
        self.baseline.as_ref().map(|baseline| baseline.mean.as_slice())
    }

    /// Standard deviation of the noise of each channel; `None` before it is learnt.
    pub fn noise_sd(&self) -> Option<Vec<f64>> {
        self.baseline.as_ref().map(Baseline::noise_sd)
    }

    /// The awaited condition and the present reading, in a sentence; `None` if the step itself is explanation enough.
    pub fn explain(&self) -> Option<String> {
        let Some(baseline) = &self.baseline else {
            return (self.waiting == Waiting::Untouched)
                .then(|| "the reading must rest for a second; it still changes".to_owned());
        };
        let latest = mean(&self.stretch.latest()?);
        let size = baseline.size(&latest);
        match self.waiting {
            Waiting::Press => {
                let smallest = self.checks.smallest_size(baseline)?;
                Some(format!(
                    "the reading is {:.1} % of the smallest press off the untouched one",
                    100.0 * size / smallest
                ))
            }
            Waiting::Rest => {
                let percent = 100.0 * baseline.change(&self.stretch.latest()?) / size.max(1.0);
                Some(format!(
                    "the reading must rest; it changes by {percent:.1} % in 0.2 s ({:.1} % at most)",
                    100.0 * REST_SHARE
                ))
            }
            Waiting::Release => Some(format!(
                "the reading is still at {:.0} % of the press; if the surface is untouched, take this reading as untouched",
                100.0 * size / baseline.size_of(&self.pressed).max(1.0)
            )),
            Waiting::Untouched | Waiting::Nothing => None,
        }
    }

    /// Processes a reading at an instant.
    pub fn add(&mut self, at: Duration, reading: &[f64]) -> Progress {
        if self.last_at.is_some_and(|last| at.saturating_sub(last) > SILENCE) {
            self.relearn();
        }
        self.last_at = Some(at);
        if self.is_sample_and_hold && self.stretch.is_repeat(reading) {
            return Progress::None;
        }
        self.stretch.add(at, reading);
        match (self.waiting, self.baseline.take()) {
            (Waiting::Nothing, baseline) => {
                self.baseline = baseline;
                Progress::None
            }
            (Waiting::Untouched, _) | (_, None) => self.learn_baseline(at),
            (waiting, Some(mut baseline)) => {
                self.touch.follow(&baseline, reading, &self.stretch);
                let progress = match waiting {
                    Waiting::Press => self.await_press(at, &mut baseline),
                    Waiting::Rest => self.await_rest(at, &mut baseline),
                    _ => self.await_release(at, &mut baseline),
                };
                // In a step that waits for the untouched reading, the old one is discarded.
                if self.waiting != Waiting::Untouched {
                    self.baseline = Some(baseline);
                }
                progress
            }
        }
    }

    /// Takes back the last press, which is requested again; false if there is none.
    pub fn redo(&mut self) -> bool {
        if self.next == 0 {
            return false;
        }
        self.next -= 1;
        self.checks.forget_last();
        self.is_recorded = false;
        self.restart();
        true
    }

    /// Leaves out the next press.
    pub fn skip(&mut self) {
        if self.next < self.plan.len() {
            self.plan.remove(self.next);
            self.checks.forget_request();
            self.is_recorded = false;
            self.restart();
        }
    }

    /// Learns the untouched reading again, after the operator has stated that the surface is untouched, or after the source was lost.
    pub fn relearn(&mut self) {
        self.stretch.clear();
        self.touch = Touch::default();
        if self.waiting != Waiting::Nothing {
            self.baseline = None;
            self.untouched = None;
            self.reference.clear();
            self.waiting = Waiting::Untouched;
        }
    }

    /// Ends the calibration early.
    pub fn stop(&mut self) {
        self.plan.truncate(self.next);
        self.waiting = Waiting::Nothing;
    }

    /// Adds presses to the plan.
    pub fn extend(&mut self, presses: impl IntoIterator<Item = Press>) {
        self.plan.extend(presses);
        if self.waiting == Waiting::Nothing {
            self.restart();
        }
    }

    /// Discards the readings of the last seconds, for example those before a move of a machine; the baseline is kept.
    pub fn forget_readings(&mut self) {
        self.stretch.clear();
    }

    /// Returns to the first step that the next press needs.
    fn restart(&mut self) {
        self.waiting = match self.waiting {
            _ if self.next >= self.plan.len() => Waiting::Nothing,
            _ if self.baseline.is_none() => Waiting::Untouched,
            // The present touch does not belong to a press of the plan.
            Waiting::Rest => {
                self.pressed = self.present_deviation();
                Waiting::Release
            }
            Waiting::Release => Waiting::Release,
            Waiting::Untouched | Waiting::Press | Waiting::Nothing => Waiting::Press,
        };
    }

    /// Deviation of the last reading from the untouched reading.
    fn present_deviation(&self) -> Vec<f64> {
        match (&self.baseline, self.stretch.last()) {
            (Some(baseline), Some(reading)) => baseline.deviation(reading),
            _ => Vec::new(),
        }
    }

    fn wait(&mut self, at: Duration, waiting: Waiting) -> Progress {
        self.waiting = waiting;
        self.since = at;
        Progress::Waits(waiting)
    }

    fn learn_baseline(&mut self, at: Duration) -> Progress {
        self.count_repeats_once();
        let Some(baseline) = Baseline::learn(&self.stretch) else { return Progress::None };
        if self.reference.is_empty() {
            self.reference.clone_from(&baseline.mean);
        }
        self.untouched = Some(self.untouched_row(baseline.mean.clone()));
        self.baseline = Some(baseline);
        self.begin_press(at)
    }

    /// Removes repeated readings if the source is faster than its sensors. A touch changes all channels together in any source. The readings must
    /// therefore be at rest.
    fn count_repeats_once(&mut self) {
        let Some(distinct) = self.stretch.without_repeats().filter(|_| !self.is_sample_and_hold) else {
            return;
        };
        let is_at_rest = [&self.stretch, &distinct].iter().any(|stretch| Baseline::learn(stretch).is_some());
        if is_at_rest && self.stretch.is_sample_and_hold() {
            self.is_sample_and_hold = true;
            self.stretch = distinct;
        }
    }

    /// Waits for the next press, or ends with the untouched row after the last one.
    fn begin_press(&mut self, at: Duration) -> Progress {
        self.touch = Touch::default();
        if self.next < self.plan.len() {
            return self.wait(at, Waiting::Press);
        }
        self.wait(at, Waiting::Nothing);
        self.untouched.take().map_or(Progress::Waits(Waiting::Nothing), Progress::Untouched)
    }

    /// Updates the untouched reading until a touch begins.
    fn await_press(&mut self, at: Duration, baseline: &mut Baseline) -> Progress {
        let recovery = if self.is_recovering { self.checks.largest_size(baseline) } else { 0.0 };
        let least = NOISE_LIMIT_SD.max(RESIDUE_SHARE * recovery);
        if self.touch.has_begun(least) {
            return self.wait(at, Waiting::Rest);
        }
        if let Some(latest) = self.stretch.latest() {
            let mean = mean(&latest);
            let step = if self.is_recovering || at.saturating_sub(self.since) > PATIENCE {
                least
            } else {
                FOLLOWED_STEP_SD
            };
            if baseline.size(&mean) <= step && baseline.is_at_rest(&latest, RECOVERY_SHARE * recovery) {
                self.since = at;
                self.is_recovering &= !baseline.is_at_rest(&latest, 0.0);
                baseline.mean.clone_from(&mean);
                self.untouched = Some(self.untouched_row(mean));
                self.touch.fastest = 0.0;
            }
        }
        Progress::None
    }

    /// Records a press once its reading is at rest.
    fn await_rest(&mut self, at: Duration, baseline: &mut Baseline) -> Progress {
        let Some(latest) = self.stretch.latest() else { return Progress::None };
        let mean = mean(&latest);
        let size = baseline.size(&mean);
        if size <= NOISE_LIMIT_SD || size < LIFT_TAIL_SHARE * self.touch.peak {
            // The touch ended before its reading came to rest.
            return match baseline.is_at_rest(&latest, 0.0) {
                true => self.return_to_untouched(at, mean, baseline),
                false => Progress::None,
            };
        }
        let share = if at.saturating_sub(self.since) > PATIENCE { PATIENT_REST_SHARE } else { REST_SHARE };
        if !baseline.is_at_rest(&latest, share * size) {
            self.touch.doubtful_since = None;
            return Progress::None;
        }
        if self.is_return(&mean, baseline) || self.is_late_lift(&mean, baseline) {
            self.lingering = 0.0;
            return self.return_to_untouched(at, mean, baseline);
        }
        if self.touch.fastest < ONSET_SHARE * size {
            // If it was a touch after all, its lift returns to the reference.
            let reference = std::mem::take(&mut self.reference);
            self.relearn();
            self.reference = reference;
            return Progress::AskedAgain(Doubt::Drift);
        }
        self.take_press(at, mean, baseline)
    }

    fn take_press(&mut self, at: Duration, mean: Vec<f64>, baseline: &Baseline) -> Progress {
        let Some(press) = self.plan.get(self.next).copied() else { return Progress::None };
        let touch = TouchReading { deviation: baseline.deviation(&mean), reading: mean.clone() };
        let doubt = self.checks.doubt(&press, &touch, baseline);
        if doubt.is_some() && at.saturating_sub(*self.touch.doubtful_since.get_or_insert(at)) < LINGER {
            return Progress::None;
        }
        self.pressed.clone_from(&touch.deviation);
        self.growth = Growth::default();
        self.wait(at, Waiting::Release);
        if let Some(doubt) = doubt {
            self.checks.refuse(touch);
            self.is_recorded = false;
            return Progress::AskedAgain(doubt);
        }
        self.checks.record(&press, touch);
        self.next += 1;
        self.is_recorded = true;
        let untouched = self.untouched.take();
        if let Some(untouched) = &untouched {
            let change = untouched.mean.iter().zip(&self.reference).map(|(mean, before)| mean - before);
            self.checks.add_residue(change.collect(), baseline);
            self.reference.clone_from(&untouched.mean);
        }
        Progress::Pressed { untouched, press: self.press_row(&press, mean) }
    }

    /// Waits until a press is lifted, or replaces it by a firmer one.
    fn await_release(&mut self, at: Duration, baseline: &mut Baseline) -> Progress {
        if let Some(reading) = self.stretch.last() {
            self.growth.follow(at, baseline.deviation(reading), &self.pressed, baseline);
        }
        let Some(latest) = self.stretch.latest() else { return Progress::None };
        let mean = mean(&latest);
        let (size, pressed) = (baseline.size(&mean), baseline.size_of(&self.pressed));
        if size > GROWTH * pressed && baseline.is_at_rest(&latest, REST_SHARE * size) {
            return self.replace_press(at, mean, baseline);
        }
        let largest = self.checks.largest_size(baseline).max(pressed);
        let by_hysteresis = (HYSTERESIS_SHARE * largest).min(PARTLY_LIFTED_SHARE * pressed);
        let limit = NOISE_LIMIT_SD.max(LIFTED_SHARE * pressed).max(by_hysteresis);
        let is_lifted = if size <= limit {
            // Time since the reading fell below the limit.
            let waited = at.saturating_sub(self.since);
            baseline.is_at_rest(&latest, 0.0)
                || waited > RECOVERY && baseline.is_at_rest(&latest, RECOVERY_SHARE * largest)
        } else {
            // An unrecorded touch may not have been one: a reading that rests for long is the untouched one.
            let (share, patience) = if self.is_recorded {
                (PARTLY_LIFTED_SHARE, PARTLY_LIFTED)
            } else {
                (f64::INFINITY, PATIENCE)
            };
            if size > share * pressed || !baseline.is_at_rest(&latest, 0.0) {
                self.since = at;
            }
            at.saturating_sub(self.since) > patience
        };
        if !is_lifted {
            return Progress::None;
        }
        if self.is_recorded && self.growth.has_lasted {
            return self.take_back(at, mean, baseline);
        }
        self.lingering = limit.max(size);
        self.is_recovering = !baseline.is_at_rest(&latest, 0.0);
        self.return_to_untouched(at, mean, baseline)
    }

    /// Takes back a press that grew after its reading was recorded, and never came to rest.
    fn take_back(&mut self, at: Duration, mean: Vec<f64>, baseline: &mut Baseline) -> Progress {
        self.next = self.next.saturating_sub(1);
        self.checks.outgrow_last(std::mem::take(&mut self.growth.deviation));
        self.is_recorded = false;
        self.is_recovering = !self.stretch.latest().is_some_and(|latest| baseline.is_at_rest(&latest, 0.0));
        self.return_to_untouched(at, mean, baseline);
        Progress::TakenBack(Doubt::Grew)
    }

    /// Replaces a press by a firmer touch without a lift in between: the lighter touch was not the press.
    fn replace_press(&mut self, at: Duration, mean: Vec<f64>, baseline: &Baseline) -> Progress {
        if !self.is_recorded {
            return self.wait(at, Waiting::Rest);
        }
        let Some(press) = self.next.checked_sub(1).and_then(|last| self.plan.get(last)).copied() else {
            return Progress::None;
        };
        let deviation = baseline.deviation(&mean);
        self.checks.forget_last();
        self.checks.record(&press, TouchReading { deviation: deviation.clone(), reading: mean.clone() });
        self.pressed = deviation;
        self.growth = Growth::default();
        self.since = at;
        Progress::Replaced(self.press_row(&press, mean))
    }

    fn return_to_untouched(&mut self, at: Duration, mean: Vec<f64>, baseline: &mut Baseline) -> Progress {
        baseline.mean.clone_from(&mean);
        self.untouched = Some(self.untouched_row(mean));
        self.begin_press(at)
    }

    fn untouched_row(&self, mean: Vec<f64>) -> RestingRow {
        self.resting_row(Position::default(), Some(0.0), mean)
    }

    fn press_row(&self, press: &Press, mean: Vec<f64>) -> RestingRow {
        self.resting_row(press.position, press.force_n, mean)
    }

    fn resting_row(&self, position: Position, force_n: Option<f64>, mean: Vec<f64>) -> RestingRow {
        let (at, reading) = self.stretch.middle().unwrap_or((Duration::ZERO, mean.as_slice()));
        let (time_s, reading) = (Some(at.as_secs_f64()), reading.to_vec());
        RestingRow { row: Row { position, force_n, nuisances: Vec::new(), time_s, reading }, mean }
    }

    /// True for a mean reading that has returned most of the way to the last untouched one: a finger that lingered has lifted.
    fn is_return(&self, mean: &[f64], baseline: &Baseline) -> bool {
        let from_reference = |reading: &[f64]| {
            let difference: Vec<f64> =
                reading.iter().zip(&self.reference).map(|(value, reference)| value - reference).collect();
            baseline.length_of(&difference)
        };
        from_reference(mean) < 0.5 * from_reference(&baseline.mean)
    }

    /// True for a mean reading that is opposite to the last press, by at most the effect of a lingering finger. This is possible once after a
    /// press.
    fn is_late_lift(&self, mean: &[f64], baseline: &Baseline) -> bool {
        let deviation = baseline.deviation(mean);
        let lengths = baseline.length_of(&deviation) * baseline.length_of(&self.pressed);
        baseline.size_of(&deviation) <= self.lingering
            && baseline.product_of(&deviation, &self.pressed) < AGAINST * lengths
    }
}

impl Growth {
    /// Compares the deviation of a reading with that of the press.
    fn follow(&mut self, at: Duration, deviation: Vec<f64>, pressed: &[f64], baseline: &Baseline) {
        let size = baseline.size_of(&deviation);
        if size <= GROWTH * baseline.size_of(pressed) {
            self.readings = 0;
            return;
        }
        if self.readings == 0 {
            self.since = at;
        }
        self.readings += 1;
        self.has_lasted |= self.readings >= ONSET_READINGS && at.saturating_sub(self.since) >= REST_SPAN / 2;
        if size > baseline.size_of(&self.deviation) {
            self.deviation = deviation;
        }
    }
}

impl Touch {
    /// Updates the touch with the last reading of a stretch.
    fn follow(&mut self, baseline: &Baseline, reading: &[f64], stretch: &Stretch) {
        let size = baseline.size(reading);
        self.peak = self.peak.max(size.min(self.recent[0]).min(self.recent[1]));
        self.recent = [self.recent[1], size];
        if size > NOISE_LIMIT_SD {
            let least = stretch.last_second().map(|reading| baseline.size(reading)).fold(size, f64::min);
            // After a move of a machine, only one reading is available: it is compared with the untouched reading.
            let growth = if stretch.has_one_reading() { size } else { size - least };
            self.fastest = self.fastest.max(growth);
        }
    }

    /// True once [`ONSET_READINGS`] consecutive readings deviate by more than `least` standard deviations.
    fn has_begun(&mut self, least: f64) -> bool {
        self.onset = if self.recent[1] > least { self.onset + 1 } else { 0 };
        self.onset >= ONSET_READINGS
    }
}
