//! Touch-off: height at which the finger touches the surface.
//!
//! The finger descends in steps: a coarse pass from the height of travel, a lift that must restore the
//! untouched reading, and a fine pass.

use super::baseline::{Baseline, NOISE_LIMIT_SD};
use super::guide::ONSET_READINGS;
use super::stretch::{Stretch, mean};
use palpate_rig::Stage;
use std::time::Duration;

/// Readings that show an untouched surface.
const CLEAR_READINGS: usize = 2 * ONSET_READINGS as usize;
/// Coarse step relative to the shallowest press, for a light touch.
const COARSE_SHARE: f64 = 0.1;
/// Fine step relative to the coarse one.
const FINE_SHARE: f64 = 0.1;
/// Smallest step in metres, the resolution of firmwares.
const LEAST_STEP_M: f64 = 1e-5;
/// Largest remainder of a touch after the lift.
const RETURN_SHARE: f64 = 0.5;
/// Time limit for rest, and for the return.
const SETTLES_WITHIN: Duration = Duration::from_secs(30);

/// Cause of a failed touch-off.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TouchOffFailure {
    /// No touch.
    #[error(
        "no reading shows a touch down to z {:.3} mm, `touch` less the deepest of `depths`: lower `touch` of [stage], or move over the surface",
        lowest_m * 1e3
    )]
    NoTouch {
        /// Lowest height, in machine coordinates.
        lowest_m: f64,
    },
    /// No rest.
    #[error(
        "the untouched readings have not settled within {} s: keep the surface free of other contacts",
        SETTLES_WITHIN.as_secs()
    )]
    NoRest,
    /// No return after the lift.
    #[error(
        "the readings did not return within {} s after the lift: they drift, or something else touches the surface",
        SETTLES_WITHIN.as_secs()
    )]
    NoReturn,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contact {
    Undecided,
    None,
    Touch,
}

#[derive(Clone, Debug, Default)]
pub(super) struct TouchDetector {
    stretch: Stretch,
    baseline: Option<Baseline>,
    count: usize,
    deviating: u32,
    is_touched: bool,
}

impl TouchDetector {
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

    pub fn forget_readings(&mut self) {
        *self = Self { baseline: self.baseline.take(), ..Self::default() };
    }

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

    /// Largest mean deviation at rest, in standard deviations.
    fn size(&self) -> Option<f64> {
        let readings: Vec<&[f64]> = self.stretch.last_second().collect();
        let baseline = self.baseline.as_ref().filter(|_| readings.len() >= CLEAR_READINGS)?;
        Some(baseline.size(&mean(&readings)))
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TouchOffAction {
    Wait,
    /// Descent to a machine z in metres.
    Lower(f64),
    Lift,
    Found(f64),
    Failed(TouchOffFailure),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Learn,
    Down {
        z_m: f64,
    },
    /// Lift after this deviation.
    Return {
        size: f64,
    },
    Failed(TouchOffFailure),
}

#[derive(Clone, Debug)]
pub(super) struct TouchOff {
    step: Step,
    /// Top, bottom and step of the pass, in machine coordinates.
    top_m: f64,
    lowest_m: f64,
    step_m: f64,
    coarse_m: Option<f64>,
    found_m: Option<f64>,
}

impl TouchOff {
    pub fn new(stage: &Stage) -> Self {
        let shallowest_m = stage.depths_m.iter().copied().fold(f64::INFINITY, f64::min);
        let step_m = (COARSE_SHARE * shallowest_m).max(LEAST_STEP_M);
        Self {
            step: Step::Learn,
            top_m: stage.travel_z_m() - step_m,
            lowest_m: stage.lowest_z_m(),
            step_m,
            coarse_m: None,
            found_m: None,
        }
    }

    /// Next action; `waited` since the last one.
    pub fn next(&mut self, waited: Duration, detector: &mut TouchDetector) -> TouchOffAction {
        match self.step {
            Step::Learn => self.learn(waited, detector),
            Step::Down { z_m } => self.next_action(z_m, detector),
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

    fn next_action(&mut self, z_m: f64, detector: &TouchDetector) -> TouchOffAction {
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

    fn check_return(&mut self, size: f64, waited: Duration, detector: &mut TouchDetector) -> TouchOffAction {
        match detector.size() {
            Some(now) if now < RETURN_SHARE * size => {}
            _ if waited > SETTLES_WITHIN => return TouchOffAction::Failed(TouchOffFailure::NoReturn),
            _ => return TouchOffAction::Wait,
        }
        if let Some(found_m) = self.found_m {
            return TouchOffAction::Found(found_m);
        }
        // The touch is within the last coarse step.
        let coarse_m = self.coarse_m.unwrap_or(self.top_m);
        (self.top_m, self.lowest_m) = (coarse_m + self.step_m, (coarse_m - self.step_m).max(self.lowest_m));
        self.step_m = (FINE_SHARE * self.step_m).max(LEAST_STEP_M);
        *detector = TouchDetector::default();
        self.step = Step::Learn;
        TouchOffAction::Wait
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    const TOUCH_M: f64 = 0.0217;
    const EVERY: Duration = Duration::from_millis(10);

    fn stage() -> Stage {
        Stage {
            origin_m: (0.0, 0.0),
            touch_z_m: 0.022,
            clearance_m: 5e-3,
            depths_m: vec![1e-3, 2e-3],
            travel_m_per_s: 0.05,
            press_m_per_s: 2e-3,
            load_cell: None,
            force_limit_n: None,
            dtr_reset: false,
        }
    }

    /// Outcome, lowest height and duration of a search.
    fn search(
        setup: &Stage,
        read: impl Fn(f64, f64) -> Vec<f64>,
    ) -> (Result<f64, TouchOffFailure>, f64, Duration) {
        let (mut detector, mut search) = (TouchDetector::default(), TouchOff::new(setup));
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let travel_m = setup.travel_z_m();
        let (mut z_m, mut lowest_m) = (travel_m, travel_m);
        let (mut now, mut since) = (Duration::ZERO, Duration::ZERO);
        loop {
            now += EVERY;
            let mut reading = read(z_m, now.as_secs_f64());
            reading.iter_mut().for_each(|value| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                *value += noise;
            });
            detector.add(now, &reading);
            z_m = match search.next(now - since, &mut detector) {
                TouchOffAction::Wait => continue,
                TouchOffAction::Lower(z_m) => z_m,
                TouchOffAction::Lift => travel_m,
                TouchOffAction::Found(z_m) => return (Ok(z_m), lowest_m, now),
                TouchOffAction::Failed(failure) => return (Err(failure), lowest_m, now),
            };
            detector.forget_readings();
            (since, lowest_m) = (now, lowest_m.min(z_m));
        }
    }

    /// 3,000 counts a millimetre, noise of 1 count.
    fn counts(z_m: f64) -> Vec<f64> {
        let depth_mm = (TOUCH_M - z_m).max(0.0) * 1e3;
        vec![500.0 + 3000.0 * depth_mm, -80.0 - 900.0 * depth_mm]
    }

    #[test]
    fn finds_the_touch_by_the_channels_within_a_fine_step() {
        let (found, lowest_m, time) = search(&stage(), |z_m, _| counts(z_m));
        let found_m = found.unwrap();
        // Fine step 0.01 mm.
        assert!((-1.5e-5..=1e-9).contains(&(found_m - TOUCH_M)), "{found_m}");
        assert!(TOUCH_M - lowest_m <= 1.001e-4, "it presses no deeper than a coarse step: {lowest_m}");
        assert!(time < Duration::from_secs(20), "{time:?}");
    }

    #[test]
    fn a_weak_reading_is_found_where_it_exceeds_the_noise() {
        // 20 counts a millimetre: detectable 0.4 mm below the surface.
        let weak = |z_m: f64, _| vec![20.0 * (TOUCH_M - z_m).max(0.0) * 1e3];
        let found_m = search(&stage(), weak).0.unwrap();
        assert!((3e-4..6e-4).contains(&(TOUCH_M - found_m)), "{found_m}");
    }

    #[test]
    fn ends_at_the_deepest_press_without_a_touch() {
        let (found, lowest_m, _) = search(&stage(), |_, _| vec![500.0]);
        assert!((lowest_m - stage().lowest_z_m()).abs() < 1e-12);
        assert!(matches!(found, Err(TouchOffFailure::NoTouch { .. })), "{found:?}");
    }

    #[test]
    fn drift_is_no_touch() {
        // 5 counts a second: 8 standard deviations in less than 2 s.
        let (found, ..) = search(&stage(), |_, time_s| vec![500.0 + 5.0 * time_s]);
        assert_eq!(found, Err(TouchOffFailure::NoReturn));
    }

    #[test]
    fn a_surface_that_swings_has_no_untouched_reading() {
        let swings = |_, time_s: f64| vec![500.0 + 400.0 * (3.0 * time_s).sin()];
        let (found, lowest_m, _) = search(&stage(), swings);
        assert_eq!((found, lowest_m), (Err(TouchOffFailure::NoRest), stage().travel_z_m()));
    }
}
