//! Rest after a touch: steady readings that are small compared with it.

use super::{LET_GO, run_length};
use crate::Status;

const AT_REST: u32 = 2 * LET_GO;
/// Shortest rest in seconds, [`AT_REST`] readings at 100 Hz; the slow beginning of a touch looks steady over
/// less.
const AT_REST_S: f64 = 0.1;
const UNTOUCHED: u32 = 10 * AT_REST;
const UNTOUCHED_S: f64 = 10.0 * AT_REST_S;
const NOISE_KNOWN: u32 = 20;
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

#[derive(Clone, Debug, PartialEq)]
pub(super) struct RestWatch<B> {
    /// Variance of each channel about the baseline.
    noise: B,
    readings: u32,
    sizes: [f64; LET_GO as usize],
    touched: u32,
    /// Greatest size of [`LET_GO`] consecutive readings.
    touch_size: f64,
    rest: B,
    rested: u32,
    untouched: u32,
}

impl<B: AsRef<[f64]> + AsMut<[f64]> + Clone> RestWatch<B> {
    pub fn new(zero: &B) -> Self {
        let mut noise = zero.clone();
        noise.as_mut().fill(0.0);
        Self {
            rest: noise.clone(),
            noise,
            readings: 0,
            sizes: [0.0; LET_GO as usize],
            touched: 0,
            touch_size: 0.0,
            rested: 0,
            untouched: 0,
        }
    }

    pub fn rest(&self) -> &[f64] {
        self.rest.as_ref()
    }

    pub fn has_moved(&self, baseline: &[f64]) -> bool {
        self.distance(self.rest(), baseline) > baseline.len() as f64
    }

    pub fn rested(&self) -> u32 {
        self.rested
    }

    pub fn stays(&self) -> bool {
        self.readings < NOISE_KNOWN || self.rested >= LET_GO
    }

    pub fn forget_touch(&mut self) {
        (self.touched, self.touch_size, self.rested, self.untouched) = (0, 0.0, 0, 0);
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
        if is_untouched && self.touched == 0 {
            self.learn_noise(reading, baseline, time_constant);
        }
        if self.readings < NOISE_KNOWN {
            return Course::Steady;
        }
        let size = self.distance(reading, baseline);
        if is_untouched {
            if self.touched < LET_GO {
                // Noise caused a false alarm.
                self.forget_touch();
                return Course::Steady;
            }
            self.untouched = self.untouched.saturating_add(1);
        } else {
            self.untouched = 0;
            self.sizes[(self.touched % LET_GO) as usize] = size;
            self.touched = self.touched.saturating_add(1);
            if self.touched >= LET_GO {
                self.touch_size =
                    self.sizes.iter().copied().fold(f64::INFINITY, f64::min).max(self.touch_size);
            }
        }
        self.follow_rest(reading);
        let is_residue = is_untouched || size <= RESIDUE * RESIDUE * self.touch_size;
        if (is_residue && self.rested >= length.stays) || self.untouched >= length.untouched {
            Course::AtRest
        } else if is_untouched {
            Course::Settling
        } else {
            Course::Steady
        }
    }

    fn follow_rest(&mut self, reading: &[f64]) {
        let channels = reading.len() as f64;
        // For any number of channels, noise is within 2·channels + 8 in 99.7 % of readings.
        let by_noise = (2.0 * channels + 8.0) * (1.0 + 1.0 / f64::from(self.rested.max(1)));
        let stays =
            self.distance(reading, self.rest.as_ref()) <= by_noise.max(CHANGE * CHANGE * self.touch_size);
        self.rested = run_length(self.rested, self.rested > 0 && stays).max(1);
        let share = 1.0 / f64::from(self.rested);
        for (rest, value) in self.rest.as_mut().iter_mut().zip(reading) {
            *rest += share * (value - *rest);
        }
    }

    fn learn_noise(&mut self, reading: &[f64], baseline: &[f64], time_constant: u32) {
        self.readings = self.readings.saturating_add(1).min(time_constant);
        let share = 1.0 / f64::from(self.readings);
        for ((noise, value), baseline) in self.noise.as_mut().iter_mut().zip(reading).zip(baseline) {
            let deviation = value - baseline;
            *noise += share * (deviation * deviation - *noise);
        }
    }

    /// Σ (a − b)² / variance. A channel without noise, as from a coarse converter, gets the mean variance.
    fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let noise = self.noise.as_ref();
        let mean = noise.iter().sum::<f64>() / noise.len().max(1) as f64;
        let variance = |own: f64| match (own > 0.0, mean > 0.0) {
            (true, _) => own,
            (false, true) => mean,
            (false, false) => 1.0,
        };
        let channels = a.iter().zip(b).zip(noise);
        channels.map(|((a, b), noise)| (a - b) * (a - b) / variance(*noise)).sum()
    }
}
