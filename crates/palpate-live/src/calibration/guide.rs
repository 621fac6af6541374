//! Guide of a calibration: order of the presses, and detection of rest.
//!
//! Means over a stretch detect rest, but the row is its middle reading: the locator learns the noise of
//! single readings. The last reading may belong to a lift.
//!
//! The untouched row is recorded with its press, after any drift.

use super::baseline::{Baseline, NOISE_LIMIT_SD};
use super::press::Press;
use super::repeat_check::{GROWTH, RepeatCheck, RetakeReason, TouchReading};
use super::stretch::{REST_SPAN, Stretch, mean};
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use serde::Serialize;
use std::time::Duration;

/// Consecutive deviating readings of a touch; fewer may be glitches.
pub(super) const ONSET_READINGS: u32 = 3;
/// Step of the baseline accepted at once, in standard deviations; larger steps may be light touches, and must
/// last [`PATIENCE`].
const FOLLOWED_STEP_SD: f64 = 2.0;
/// Share of the largest press attributed to creep or hysteresis.
const RESIDUE_SHARE: f64 = 0.005;
/// Largest relative change of a press at rest: soft surfaces creep, and hands tremble.
const REST_SHARE: f64 = 0.005;
/// `REST_SHARE` after [`PATIENCE`].
const PATIENT_REST_SHARE: f64 = 0.02;
/// Largest relative change at rest during recovery from creep.
const RECOVERY_SHARE: f64 = 0.001;
const PATIENCE: Duration = Duration::from_secs(5);
const RECOVERY: Duration = Duration::from_millis(1500);
/// Share of a press that may remain after a lift, and share of the largest press left by hysteresis.
const LIFTED_SHARE: f64 = 0.1;
const HYSTERESIS_SHARE: f64 = 0.03;
/// Share of a press below which rest for [`PARTLY_LIFTED`] is a lift.
const PARTLY_LIFTED_SHARE: f64 = 0.5;
const PARTLY_LIFTED: Duration = Duration::from_secs(2);
/// Share of the peak below which a reading at rest is a lift.
const LIFT_TAIL_SHARE: f64 = 1.0 / 3.0;
/// Cosine of opposite deviations.
const AGAINST: f64 = -0.8;
/// Smallest growth of a press within a second, relative; slower changes are drift.
const ONSET_SHARE: f64 = 0.2;
/// Rest of a doubtful touch before a new request.
const LINGER: Duration = Duration::from_millis(1200);
/// Silence after which the board may have restarted.
const SILENCE: Duration = Duration::from_secs(5);

/// Awaited step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AwaitedStep {
    /// Learning of the baseline.
    Untouched,
    /// Next press.
    Press,
    /// Rest of the reading.
    Rest,
    /// End of the calibration.
    Release,
    /// End.
    Nothing,
}

/// Row with the mean reading of its stretch at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct RestingRow {
    /// Row with the middle reading.
    pub row: Row,
    /// Mean reading of the stretch.
    pub mean: Vec<f64>,
}

/// Outcome of a reading.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// No change.
    None,
    /// Another step is awaited.
    Waits(AwaitedStep),
    /// A press was recorded.
    Pressed {
        /// Untouched row before it; `None` if already recorded.
        untouched: Option<RestingRow>,
        /// Press.
        press: RestingRow,
    },
    /// The last press grew and is replaced.
    Replaced(RestingRow),
    /// The last untouched row was recorded.
    Untouched(RestingRow),
    /// The press is requested again.
    AskedAgain(RetakeReason),
    /// The recorded press is requested again.
    TakenBack(RetakeReason),
}

#[derive(Clone, Copy, Debug, Default)]
struct Touch {
    onset: u32,
    /// Largest minimum of [`ONSET_READINGS`] consecutive deviations.
    peak: f64,
    recent: [f64; 2],
    /// Largest growth within a second.
    fastest: f64,
    doubtful_since: Option<Duration>,
}

#[derive(Clone, Debug, Default)]
struct Growth {
    since: Duration,
    readings: u32,
    /// A hand may jerk during a lift.
    has_lasted: bool,
    deviation: Vec<f64>,
}

/// Guide of a calibration.
#[derive(Clone, Debug)]
pub struct Guide {
    plan: Vec<Press>,
    next: usize,
    awaited: AwaitedStep,
    /// Start of the wait, or last update of the baseline.
    since: Duration,
    last_at: Option<Duration>,
    is_sample_and_hold: bool,
    stretch: Stretch,
    baseline: Option<Baseline>,
    untouched: Option<RestingRow>,
    /// Untouched mean learnt or recorded last.
    reference: Vec<f64>,
    touch: Touch,
    /// Deviation before the release.
    press_deviation: Vec<f64>,
    is_recorded: bool,
    growth: Growth,
    /// Largest remaining effect of a finger after a lift.
    lingering: f64,
    /// From a lift to rest within noise.
    is_recovering: bool,
    checks: RepeatCheck,
}

impl Guide {
    /// Guide of a plan.
    pub fn new(plan: Vec<Press>) -> Self {
        let waiting = if plan.is_empty() { AwaitedStep::Nothing } else { AwaitedStep::Untouched };
        Self {
            plan,
            next: 0,
            awaited: waiting,
            since: Duration::ZERO,
            last_at: None,
            is_sample_and_hold: false,
            stretch: Stretch::default(),
            baseline: None,
            untouched: None,
            reference: Vec::new(),
            touch: Touch::default(),
            press_deviation: Vec::new(),
            is_recorded: false,
            growth: Growth::default(),
            lingering: 0.0,
            is_recovering: false,
            checks: RepeatCheck::default(),
        }
    }

    /// Sets the rows of earlier presses for comparison.
    pub fn with_rows(mut self, rows: &[Row]) -> Self {
        self.checks = RepeatCheck::new(rows);
        self
    }

    /// Index and next press; `None` after the last.
    pub fn next_press(&self) -> Option<(usize, Press)> {
        self.plan.get(self.next).map(|press| (self.next, *press))
    }

    /// Recorded presses of the plan.
    pub fn taken(&self) -> usize {
        self.next
    }

    /// Presses of the plan.
    pub fn plan(&self) -> &[Press] {
        &self.plan
    }

    /// Awaited step.
    pub fn awaited_step(&self) -> AwaitedStep {
        self.awaited
    }

    /// True if the source repeats readings: its sensors are slower.
    pub fn is_sample_and_hold(&self) -> bool {
        self.is_sample_and_hold
    }

    /// Mean untouched reading, if learnt.
    pub fn untouched_reading(&self) -> Option<&[f64]> {
        self.baseline.as_ref().map(|baseline| baseline.mean.as_slice())
    }

    /// Standard deviation of each channel, if learnt.
    pub fn noise_sd(&self) -> Option<Vec<f64>> {
        self.baseline.as_ref().map(Baseline::noise_sd)
    }

    /// Explains the awaited condition, if necessary.
    pub fn explain(&self) -> Option<String> {
        let Some(baseline) = &self.baseline else {
            return (self.awaited == AwaitedStep::Untouched)
                .then(|| "the reading must rest for a second; it still changes".to_owned());
        };
        let latest = mean(&self.stretch.latest()?);
        let size = baseline.size(&latest);
        match self.awaited {
            AwaitedStep::Press => {
                let smallest = self.checks.smallest_size(baseline)?;
                Some(format!(
                    "the reading is {:.1} % of the smallest press off the untouched one",
                    100.0 * size / smallest
                ))
            }
            AwaitedStep::Rest => {
                let percent = 100.0 * baseline.change(&self.stretch.latest()?) / size.max(1.0);
                Some(format!(
                    "the reading must rest; it changes by {percent:.1} % in 0.2 s ({:.1} % at most)",
                    100.0 * REST_SHARE
                ))
            }
            AwaitedStep::Release => Some(format!(
                "the reading is still at {:.0} % of the press; if the surface is untouched, take this reading as untouched",
                100.0 * size / baseline.size_of(&self.press_deviation).max(1.0)
            )),
            AwaitedStep::Untouched | AwaitedStep::Nothing => None,
        }
    }

    /// Processes a reading.
    pub fn add(&mut self, at: Duration, reading: &[f64]) -> Progress {
        if self.last_at.is_some_and(|last| at.saturating_sub(last) > SILENCE) {
            self.relearn();
        }
        self.last_at = Some(at);
        if self.is_sample_and_hold && self.stretch.is_repeat(reading) {
            return Progress::None;
        }
        self.stretch.add(at, reading);
        match (self.awaited, self.baseline.take()) {
            (AwaitedStep::Nothing, baseline) => {
                self.baseline = baseline;
                Progress::None
            }
            (AwaitedStep::Untouched, _) | (_, None) => self.learn_baseline(at),
            (waiting, Some(mut baseline)) => {
                self.touch.update(&baseline, reading, &self.stretch);
                let progress = match waiting {
                    AwaitedStep::Press => self.await_press(at, &mut baseline),
                    AwaitedStep::Rest => self.await_rest(at, &mut baseline),
                    _ => self.await_release(at, &mut baseline),
                };
                // In a step that waits for the untouched reading, the old one is discarded.
                if self.awaited != AwaitedStep::Untouched {
                    self.baseline = Some(baseline);
                }
                progress
            }
        }
    }

    /// Removes the last press and requests it again; false without one.
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

    /// Skips the next press.
    pub fn skip(&mut self) {
        if self.next < self.plan.len() {
            self.plan.remove(self.next);
            self.checks.forget_request();
            self.is_recorded = false;
            self.restart();
        }
    }

    /// Learns the baseline again.
    pub fn relearn(&mut self) {
        self.stretch.clear();
        self.touch = Touch::default();
        if self.awaited != AwaitedStep::Nothing {
            self.baseline = None;
            self.untouched = None;
            self.reference.clear();
            self.awaited = AwaitedStep::Untouched;
        }
    }

    /// Ends the calibration early.
    pub fn stop(&mut self) {
        self.plan.truncate(self.next);
        self.awaited = AwaitedStep::Nothing;
    }

    /// Adds presses to the plan.
    pub fn extend(&mut self, presses: impl IntoIterator<Item = Press>) {
        self.plan.extend(presses);
        if self.awaited == AwaitedStep::Nothing {
            self.restart();
        }
    }

    /// Discards the recent readings, but not the baseline.
    pub fn forget_readings(&mut self) {
        self.stretch.clear();
    }

    fn restart(&mut self) {
        self.awaited = match self.awaited {
            _ if self.next >= self.plan.len() => AwaitedStep::Nothing,
            _ if self.baseline.is_none() => AwaitedStep::Untouched,
            // The present touch belongs to another press.
            AwaitedStep::Rest => {
                self.press_deviation = self.current_deviation();
                AwaitedStep::Release
            }
            AwaitedStep::Release => AwaitedStep::Release,
            AwaitedStep::Untouched | AwaitedStep::Press | AwaitedStep::Nothing => AwaitedStep::Press,
        };
    }

    fn current_deviation(&self) -> Vec<f64> {
        match (&self.baseline, self.stretch.last()) {
            (Some(baseline), Some(reading)) => baseline.deviation(reading),
            _ => Vec::new(),
        }
    }

    fn wait(&mut self, at: Duration, waiting: AwaitedStep) -> Progress {
        self.awaited = waiting;
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

    /// Removes repeated readings of a source faster than its sensors. Only at rest, because a touch changes
    /// all channels together.
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

    fn begin_press(&mut self, at: Duration) -> Progress {
        self.touch = Touch::default();
        if self.next < self.plan.len() {
            return self.wait(at, AwaitedStep::Press);
        }
        self.wait(at, AwaitedStep::Nothing);
        self.untouched.take().map_or(Progress::Waits(AwaitedStep::Nothing), Progress::Untouched)
    }

    fn await_press(&mut self, at: Duration, baseline: &mut Baseline) -> Progress {
        let recovery = if self.is_recovering { self.checks.largest_size(baseline) } else { 0.0 };
        let least = NOISE_LIMIT_SD.max(RESIDUE_SHARE * recovery);
        if self.touch.has_begun(least) {
            return self.wait(at, AwaitedStep::Rest);
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

    fn await_rest(&mut self, at: Duration, baseline: &mut Baseline) -> Progress {
        let Some(latest) = self.stretch.latest() else { return Progress::None };
        let mean = mean(&latest);
        let size = baseline.size(&mean);
        if size <= NOISE_LIMIT_SD || size < LIFT_TAIL_SHARE * self.touch.peak {
            // The touch ended before rest.
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
            // The lift of a slow touch returns to the reference.
            let reference = std::mem::take(&mut self.reference);
            self.relearn();
            self.reference = reference;
            return Progress::AskedAgain(RetakeReason::Drift);
        }
        self.take_press(at, mean, baseline)
    }

    fn take_press(&mut self, at: Duration, mean: Vec<f64>, baseline: &Baseline) -> Progress {
        let Some(press) = self.plan.get(self.next).copied() else { return Progress::None };
        let touch = TouchReading { deviation: baseline.deviation(&mean), reading: mean.clone() };
        let doubt = self.checks.retake_reason(&press, &touch, baseline);
        if doubt.is_some() && at.saturating_sub(*self.touch.doubtful_since.get_or_insert(at)) < LINGER {
            return Progress::None;
        }
        self.press_deviation.clone_from(&touch.deviation);
        self.growth = Growth::default();
        self.wait(at, AwaitedStep::Release);
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

    fn await_release(&mut self, at: Duration, baseline: &mut Baseline) -> Progress {
        if let Some(reading) = self.stretch.last() {
            self.growth.update(at, baseline.deviation(reading), &self.press_deviation, baseline);
        }
        let Some(latest) = self.stretch.latest() else { return Progress::None };
        let mean = mean(&latest);
        let (size, pressed) = (baseline.size(&mean), baseline.size_of(&self.press_deviation));
        if size > GROWTH * pressed && baseline.is_at_rest(&latest, REST_SHARE * size) {
            return self.replace_press(at, mean, baseline);
        }
        let largest = self.checks.largest_size(baseline).max(pressed);
        let by_hysteresis = (HYSTERESIS_SHARE * largest).min(PARTLY_LIFTED_SHARE * pressed);
        let limit = NOISE_LIMIT_SD.max(LIFTED_SHARE * pressed).max(by_hysteresis);
        let is_lifted = if size <= limit {
            let waited = at.saturating_sub(self.since);
            baseline.is_at_rest(&latest, 0.0)
                || waited > RECOVERY && baseline.is_at_rest(&latest, RECOVERY_SHARE * largest)
        } else {
            // Before a recording, any reading at long rest is untouched.
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
            return self.undo_press(at, mean, baseline);
        }
        self.lingering = limit.max(size);
        self.is_recovering = !baseline.is_at_rest(&latest, 0.0);
        self.return_to_untouched(at, mean, baseline)
    }

    fn undo_press(&mut self, at: Duration, mean: Vec<f64>, baseline: &mut Baseline) -> Progress {
        self.next = self.next.saturating_sub(1);
        self.checks.outgrow_last(std::mem::take(&mut self.growth.deviation));
        self.is_recorded = false;
        self.is_recovering = !self.stretch.latest().is_some_and(|latest| baseline.is_at_rest(&latest, 0.0));
        self.return_to_untouched(at, mean, baseline);
        Progress::TakenBack(RetakeReason::Grew)
    }

    fn replace_press(&mut self, at: Duration, mean: Vec<f64>, baseline: &Baseline) -> Progress {
        if !self.is_recorded {
            return self.wait(at, AwaitedStep::Rest);
        }
        let Some(press) = self.next.checked_sub(1).and_then(|last| self.plan.get(last)).copied() else {
            return Progress::None;
        };
        let deviation = baseline.deviation(&mean);
        self.checks.forget_last();
        self.checks.record(&press, TouchReading { deviation: deviation.clone(), reading: mean.clone() });
        self.press_deviation = deviation;
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

    /// True if a lingering finger has lifted.
    fn is_return(&self, mean: &[f64], baseline: &Baseline) -> bool {
        let from_reference = |reading: &[f64]| {
            let difference: Vec<f64> =
                reading.iter().zip(&self.reference).map(|(value, reference)| value - reference).collect();
            baseline.length_of(&difference)
        };
        from_reference(mean) < 0.5 * from_reference(&baseline.mean)
    }

    /// True for a mean opposite to the last press, by at most the effect of a lingering finger.
    fn is_late_lift(&self, mean: &[f64], baseline: &Baseline) -> bool {
        let deviation = baseline.deviation(mean);
        let lengths = baseline.length_of(&deviation) * baseline.length_of(&self.press_deviation);
        baseline.size_of(&deviation) <= self.lingering
            && baseline.product_of(&deviation, &self.press_deviation) < AGAINST * lengths
    }
}

impl Growth {
    fn update(&mut self, at: Duration, deviation: Vec<f64>, pressed: &[f64], baseline: &Baseline) {
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
    fn update(&mut self, baseline: &Baseline, reading: &[f64], stretch: &Stretch) {
        let size = baseline.size(reading);
        self.peak = self.peak.max(size.min(self.recent[0]).min(self.recent[1]));
        self.recent = [self.recent[1], size];
        if size > NOISE_LIMIT_SD {
            let least = stretch.last_second().map(|reading| baseline.size(reading)).fold(size, f64::min);
            // After a move of a machine, a single reading is compared with the baseline.
            let growth = if stretch.has_one_reading() { size } else { size - least };
            self.fastest = self.fastest.max(growth);
        }
    }

    fn has_begun(&mut self, least: f64) -> bool {
        self.onset = if self.recent[1] > least { self.onset + 1 } else { 0 };
        self.onset >= ONSET_READINGS
    }
}
