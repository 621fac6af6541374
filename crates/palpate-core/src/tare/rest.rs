//! Rest after a touch: steady readings that are small compared with it.

use super::noise::NoiseEstimate;
use super::{LET_GO, run_length};
use crate::Status;

const AT_REST: u32 = 2 * LET_GO;
/// Shortest rest in seconds, [`AT_REST`] readings at 100 Hz; the slow beginning of a touch looks steady over
/// less.
const AT_REST_S: f64 = 0.1;
const UNTOUCHED: u32 = 10 * AT_REST;
const UNTOUCHED_S: f64 = 10.0 * AT_REST_S;
/// Largest residue as a share of the touch: gauges on elastic surfaces have 3 % of hysteresis, and as much
/// creep.
const RESIDUE: f64 = 0.05;
/// Largest change at rest as a share of the touch: a tenth of the residue.
const CHANGE: f64 = 0.1 * RESIDUE;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Course {
    Steady,
    /// Not yet at rest after a touch.
    Settling,
    /// At rest after a touch.
    AtRest,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RestLength {
    stays: u32,
    untouched: u32,
}

impl RestLength {
    pub const COUNTED: Self = Self { stays: AT_REST, untouched: UNTOUCHED };

    pub fn of_interval(interval_s: f64) -> Self {
        // The conversions saturate.
        let readings = |seconds: f64| libm::ceil(seconds / interval_s) as u32;
        Self { stays: readings(AT_REST_S).max(AT_REST), untouched: readings(UNTOUCHED_S).max(AT_REST) }
    }
}

/// Size of a touch: the greatest size that [`LET_GO`] consecutive readings reach, as a squared distance from
/// the baseline over the noise.
#[derive(Clone, Debug, PartialEq)]
struct Touch {
    readings: u32,
    recent: [f64; LET_GO as usize],
    size: f64,
}

impl Touch {
    const NONE: Self = Self { readings: 0, recent: [0.0; LET_GO as usize], size: 0.0 };

    fn add(&mut self, size: f64) {
        self.recent[(self.readings % LET_GO) as usize] = size;
        self.readings = self.readings.saturating_add(1);
        if self.is_certain() {
            self.size = self.recent.iter().copied().fold(f64::INFINITY, f64::min).max(self.size);
        }
    }

    /// False where noise may have caused a false alarm.
    fn is_certain(&self) -> bool {
        self.readings >= LET_GO
    }
}

/// Mean of steady consecutive readings.
#[derive(Clone, Debug, PartialEq)]
struct SteadyMean<B> {
    mean: B,
    readings: u32,
}

impl<B: AsRef<[f64]> + AsMut<[f64]>> SteadyMean<B> {
    /// Adds a reading to the mean; one that `is_steady` excludes begins a new mean.
    fn add(&mut self, reading: &[f64], is_steady: bool) {
        self.readings = run_length(self.readings, self.readings > 0 && is_steady).max(1);
        let share = 1.0 / f64::from(self.readings);
        for (mean, value) in self.mean.as_mut().iter_mut().zip(reading) {
            *mean += share * (value - *mean);
        }
    }
}

/// Finds the rest after a touch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RestWatch<B> {
    noise: NoiseEstimate<B>,
    touch: Touch,
    rest: SteadyMean<B>,
    /// Run of untouched readings since the touch.
    untouched: u32,
}

impl<B: AsRef<[f64]> + AsMut<[f64]> + Clone> RestWatch<B> {
    pub fn new(baseline: &B) -> Self {
        let mut zeros = baseline.clone();
        zeros.as_mut().fill(0.0);
        Self {
            rest: SteadyMean { mean: zeros.clone(), readings: 0 },
            noise: NoiseEstimate::new(zeros),
            touch: Touch::NONE,
            untouched: 0,
        }
    }

    /// Mean of the rest, and its number of readings.
    pub fn rest(&self) -> (&[f64], u32) {
        (self.rest.mean.as_ref(), self.rest.readings)
    }

    /// True where the rest is further from the baseline than a reading by noise on average.
    pub fn has_moved(&self, baseline: &[f64]) -> bool {
        self.noise.square_distance(self.rest.mean.as_ref(), baseline) > baseline.len() as f64
    }

    /// True for steady readings, or an unknown noise.
    pub fn is_steady(&self) -> bool {
        !self.noise.is_known() || self.rest.readings >= LET_GO
    }

    pub fn forget_touch(&mut self) {
        (self.touch, self.rest.readings, self.untouched) = (Touch::NONE, 0, 0);
    }

    pub fn add(
        &mut self,
        reading: &[f64],
        baseline: &[f64],
        status: Status,
        time_constant: u32,
        length: RestLength,
    ) -> Course {
        let is_untouched = status == Status::NoContact;
        if is_untouched && self.touch.readings == 0 {
            self.noise.add(reading, baseline, time_constant);
        }
        if !self.noise.is_known() {
            return Course::Steady;
        }
        if is_untouched && !self.touch.is_certain() {
            self.forget_touch();
            return Course::Steady;
        }
        let size = self.noise.square_distance(reading, baseline);
        if !is_untouched {
            self.touch.add(size);
        }
        self.untouched = run_length(self.untouched, is_untouched);
        self.rest.add(reading, self.continues_rest(reading));
        let is_residue = is_untouched || size <= RESIDUE * RESIDUE * self.touch.size;
        if (is_residue && self.rest.readings >= length.stays) || self.untouched >= length.untouched {
            Course::AtRest
        } else if is_untouched {
            Course::Settling
        } else {
            Course::Steady
        }
    }

    fn continues_rest(&self, reading: &[f64]) -> bool {
        let (rest, readings) = self.rest();
        // For any number of channels, noise is within 2·channels + 8 in 99.7 % of readings.
        let by_noise = (2.0 * reading.len() as f64 + 8.0) * (1.0 + 1.0 / f64::from(readings.max(1)));
        self.noise.square_distance(reading, rest) <= by_noise.max(CHANGE * CHANGE * self.touch.size)
    }
}
