//! The rest after a touch: readings at which an untouched surface settles again.
//!
//! The reading after a touch differs from the one before it: hysteresis and creep leave a residue, and the offsets have drifted meanwhile. A
//! reading is a rest if it is steady, and small compared with the touch.

use super::{LET_GO, next_in_row};
use crate::Status;

/// Fewest consecutive steady readings of a surface at rest.
const AT_REST: u32 = 2 * LET_GO;
/// Shortest duration of these readings in seconds: [`AT_REST`] readings at 100 a second. Over less, the slow beginning of a touch looks steady.
const AT_REST_S: f64 = 0.1;
/// Untouched readings after a touch that make a surface at rest, steady or not.
const UNTOUCHED: u32 = 10 * AT_REST;
/// Duration of these readings in seconds, where they have times.
const UNTOUCHED_S: f64 = 10.0 * AT_REST_S;
/// Fewest untouched readings for an estimate of the noise.
const NOISE_KNOWN: u32 = 20;
/// Largest size of a residue, as a share of the touch before it. Gauges on elastic surfaces leave up to 3 % by hysteresis, and as much by creep.
const RESIDUE: f64 = 0.05;
/// Largest change of a reading at rest, as a share of the touch: a tenth of the residue.
const CHANGE: f64 = 0.1 * RESIDUE;

/// State of the surface after a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Course {
    /// No touch has ended.
    Steady,
    /// A touch has ended, and readings have not yet come to rest.
    Settling,
    /// A touch has ended, and readings are at rest: their mean is [`RestWatch::rest`].
    AtRest,
}

/// Readings that make a rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RestLength {
    stays: u32,
    untouched: u32,
}

impl RestLength {
    /// Numbers for readings without times.
    pub const COUNTED: Self = Self { stays: AT_REST, untouched: UNTOUCHED };

    /// Numbers for readings `interval_s` apart.
    pub fn of_interval(interval_s: f64) -> Self {
        // The conversions saturate.
        let readings = |seconds: f64| libm::ceil(seconds / interval_s) as u32;
        Self { stays: readings(AT_REST_S).max(AT_REST), untouched: readings(UNTOUCHED_S).max(AT_REST) }
    }
}

/// Watch for the rest after a touch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RestWatch<B> {
    /// Variance of the noise of each channel about the baseline, from untouched readings.
    noise: B,
    /// Readings in this mean, at most a time constant.
    readings: u32,
    /// Squared sizes of the last readings of a touch over the variance of the noise, in a ring.
    sizes: [f64; LET_GO as usize],
    /// Readings of the touch.
    touched: u32,
    /// Greatest squared size that [`LET_GO`] consecutive readings reached.
    touch_size: f64,
    /// Mean of the last steady readings.
    rest: B,
    /// Readings in this mean.
    rested: u32,
    /// Untouched readings since the touch.
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

    /// Mean of the readings at rest.
    pub fn rest(&self) -> &[f64] {
        self.rest.as_ref()
    }

    /// True where the rest is farther from a baseline than one reading is by noise.
    pub fn has_moved(&self, baseline: &[f64]) -> bool {
        self.distance(self.rest(), baseline) > baseline.len() as f64
    }

    /// Number of readings in the mean at rest.
    pub fn rested(&self) -> u32 {
        self.rested
    }

    /// True unless the last readings are known to change.
    pub fn stays(&self) -> bool {
        self.readings < NOISE_KNOWN || self.rested >= LET_GO
    }

    /// Forgets the touch.
    pub fn forget_touch(&mut self) {
        (self.touched, self.touch_size, self.rested, self.untouched) = (0, 0.0, 0, 0);
    }

    /// Adds a reading with its status by the baseline.
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
                // Noise was mistaken for a contact.
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

    /// Adds a reading to the rest, or begins another rest with it.
    fn follow_rest(&mut self, reading: &[f64]) {
        let channels = reading.len() as f64;
        // For any number of channels, noise is within 2·channels + 8 in 99.7 % of readings.
        let by_noise = (2.0 * channels + 8.0) * (1.0 + 1.0 / f64::from(self.rested.max(1)));
        let stays =
            self.distance(reading, self.rest.as_ref()) <= by_noise.max(CHANGE * CHANGE * self.touch_size);
        self.rested = next_in_row(self.rested, self.rested > 0 && stays).max(1);
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

    /// Σ (a − b)² over the variances of the noise. A channel without noise, as from a coarse converter, gets the mean noise.
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
