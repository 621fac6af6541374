//! Touch-off: the height at which a machine's finger touches the untouched surface, found by the readings.
//!
//! The finger goes down in steps, at rest after each, until the readings show the touch. A coarse pass from the height of travel finds the step of the
//! touch; after a lift, which must bring the untouched reading back, a fine pass finds the height within that step.

use super::baseline::{Baseline, NOISE_LIMIT_SD};
use super::stretch::{Stretch, mean};
use palpate_rig::Stage;
use std::time::Duration;

/// Readings in a row that deviate where something touches, as in a calibration by hand.
const ONSET_READINGS: usize = 3;
/// Readings without such a row after which nothing touches.
const CLEAR_READINGS: usize = 2 * ONSET_READINGS;
/// Share of the shallowest press that a coarse step is: a touch-off presses no harder than that.
const COARSE_SHARE: f64 = 0.1;
/// Share of a coarse step that a fine one is.
const FINE_SHARE: f64 = 0.1;
/// Smallest step in metres: a firmware reports hundredths of a millimetre.
const LEAST_STEP_M: f64 = 1e-5;
/// Share of the deviation of a touch that may remain after the lift.
const RETURN_SHARE: f64 = 0.5;
/// Time in which the untouched reading must come to rest, and return after a lift.
const SETTLES_WITHIN: Duration = Duration::from_secs(30);

/// Reason for which a touch-off found no height.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TouchOffFailure {
    /// The lowest height was reached.
    #[error(
        "no reading shows a touch down to z {:.3} mm, `touch` less the deepest of `depths`: lower `touch` of [stage], or move over the surface",
        lowest_m * 1e3
    )]
    NoTouch {
        /// The lowest height, in metres of the machine.
        lowest_m: f64,
    },
    /// The untouched reading does not rest.
    #[error(
        "the untouched readings have not come to rest within {} s: see that nothing else touches the surface",
        SETTLES_WITHIN.as_secs()
    )]
    NoRest,
    /// The reading stays where it was when the finger is lifted.
    #[error(
        "the readings did not return within {} s after the lift: they drift, or something else touches the surface",
        SETTLES_WITHIN.as_secs()
    )]
    NoReturn,
}

/// Contact as the readings show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contact {
    /// Too few readings came since the last move.
    Undecided,
    None,
    Touch,
}

/// Readings of a finger at rest, compared with the untouched reading.
#[derive(Clone, Debug, Default)]
pub(super) struct TouchDetector {
    /// Readings since the last move.
    stretch: Stretch,
    baseline: Option<Baseline>,
    /// Readings since the last move, and those in a row that deviate by more than noise.
    count: usize,
    deviating: usize,
    is_touched: bool,
}

impl TouchDetector {
    /// Takes a reading: the load cell's value, or those of all channels.
    pub fn add(&mut self, at: Duration, reading: &[f64]) {
        self.stretch.add(at, reading);
        self.count += 1;
        match &self.baseline {
            None => self.baseline = Baseline::learn(&self.stretch),
            Some(baseline) => {
                let deviates = baseline.size(reading) > NOISE_LIMIT_SD;
                self.deviating = if deviates { self.deviating + 1 } else { 0 };
                self.is_touched |= self.deviating >= ONSET_READINGS;
            }
        }
    }

    /// Forgets the readings before a move; what is learnt stays.
    pub fn forget_readings(&mut self) {
        *self = Self { baseline: self.baseline.take(), ..Self::default() };
    }

    /// Untouched value of the last channel; `None` before it is learnt.
    pub fn untouched_last(&self) -> Option<f64> {
        self.baseline.as_ref()?.mean.last().copied()
    }

    fn contact(&self) -> Contact {
        match (self.is_touched, self.count >= CLEAR_READINGS) {
            (true, _) => Contact::Touch,
            (false, true) => Contact::None,
            (false, false) => Contact::Undecided,
        }
    }

    /// Largest deviation of the mean of the readings at rest, in standard deviations of the noise; `None` while there are too few.
    fn size(&self) -> Option<f64> {
        let readings: Vec<&[f64]> = self.stretch.last_second().collect();
        let baseline = self.baseline.as_ref().filter(|_| readings.len() >= CLEAR_READINGS)?;
        Some(baseline.size(&mean(&readings)))
    }
}

/// Next action of a touch-off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TouchOffAction {
    /// More readings are needed.
    Wait,
    /// The finger goes down to this height, in metres of the machine.
    Lower(f64),
    /// The finger is lifted to the height of travel.
    Lift,
    /// The finger is lifted, and touches at this height.
    Found(f64),
    /// The finger is lifted.
    Failed(TouchOffFailure),
}

/// Step of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    /// The untouched reading is learnt, with the finger lifted.
    Learn,
    /// The finger rests at a height.
    Down { z_m: f64 },
    /// The finger was lifted after a touch, whose deviation had this size.
    Return { size: f64 },
    /// The finger is lifted, and nothing was found.
    Failed(TouchOffFailure),
}

/// A search for the height of the touch.
#[derive(Clone, Debug)]
pub(super) struct TouchOff {
    step: Step,
    /// Heights of the present pass, in metres of the machine: the first, the lowest, and the distance of two.
    top_m: f64,
    lowest_m: f64,
    step_m: f64,
    /// Height of the touch in the coarse pass.
    coarse_m: Option<f64>,
    /// Height of the touch in the fine pass.
    found_m: Option<f64>,
}

impl TouchOff {
    /// A search in the machine's present place, from the height of travel to the deepest press.
    pub fn new(stage: &Stage) -> Self {
        let shallowest_m = stage.depths_m.iter().copied().fold(f64::INFINITY, f64::min);
        let step_m = (COARSE_SHARE * shallowest_m).max(LEAST_STEP_M);
        Self {
            step: Step::Learn,
            top_m: stage.touch_z_m + stage.clearance_m - step_m,
            lowest_m: stage.lowest_z_m(),
            step_m,
            coarse_m: None,
            found_m: None,
        }
    }

    /// The action that follows from the readings since the last one. `waited` is the time since then.
    pub fn next(&mut self, waited: Duration, detector: &mut TouchDetector) -> TouchOffAction {
        match self.step {
            Step::Learn => self.learn(waited, detector),
            Step::Down { z_m } => self.look(z_m, detector),
            Step::Return { size } => self.check_return(size, waited, detector),
            Step::Failed(failure) => TouchOffAction::Failed(failure),
        }
    }

    fn learn(&mut self, waited: Duration, detector: &TouchDetector) -> TouchOffAction {
        if detector.baseline.is_some() {
            return self.lower_to(self.top_m.max(self.lowest_m));
        }
        match waited > SETTLES_WITHIN {
            true => TouchOffAction::Failed(TouchOffFailure::NoRest),
            false => TouchOffAction::Wait,
        }
    }

    fn lower_to(&mut self, z_m: f64) -> TouchOffAction {
        self.step = Step::Down { z_m };
        TouchOffAction::Lower(z_m)
    }

    fn look(&mut self, z_m: f64, detector: &TouchDetector) -> TouchOffAction {
        match detector.contact() {
            Contact::Undecided => TouchOffAction::Wait,
            Contact::None if z_m <= self.lowest_m => {
                self.step = Step::Failed(TouchOffFailure::NoTouch { lowest_m: self.lowest_m });
                TouchOffAction::Lift
            }
            Contact::None => self.lower_to((z_m - self.step_m).max(self.lowest_m)),
            Contact::Touch => {
                let Some(size) = detector.size() else { return TouchOffAction::Wait };
                let found = if self.coarse_m.is_none() { &mut self.coarse_m } else { &mut self.found_m };
                *found = Some(z_m);
                self.step = Step::Return { size };
                TouchOffAction::Lift
            }
        }
    }

    /// A reading that stays after the lift was no touch.
    fn check_return(&mut self, size: f64, waited: Duration, detector: &mut TouchDetector) -> TouchOffAction {
        match detector.size() {
            Some(now) if now < RETURN_SHARE * size => {}
            _ if waited > SETTLES_WITHIN => return TouchOffAction::Failed(TouchOffFailure::NoReturn),
            _ => return TouchOffAction::Wait,
        }
        if let Some(found_m) = self.found_m {
            return TouchOffAction::Found(found_m);
        }
        // Nothing touched one coarse step higher.
        let coarse_m = self.coarse_m.unwrap_or(self.top_m);
        (self.top_m, self.lowest_m) = (coarse_m + self.step_m, (coarse_m - self.step_m).max(self.lowest_m));
        self.step_m = (FINE_SHARE * self.step_m).max(LEAST_STEP_M);
        *detector = TouchDetector::default();
        self.step = Step::Learn;
        TouchOffAction::Wait
    }
}
