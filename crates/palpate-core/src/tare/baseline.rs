//! Untouched reading with a linear drift, by sequential least squares.

use super::{LET_GO, is_contact, run_length};
use crate::Status;

/// Fewest readings of a drift: the level then has 4/50 of the variance of a reading.
const DRIFT_FROM: u32 = 50;
/// Fewest readings of an extrapolated drift: over as many readings its error is √(12/200), a quarter of the
/// noise.
const DRIFT_KNOWN: u32 = 200;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Baseline<B> {
    pub values: B,
    /// Change per reading.
    drift: B,
    /// Readings since the last update, over which the drift was extrapolated.
    extrapolated: u32,
    since_rest: u32,
    /// Averaged readings; 0 for the offsets of the calibration.
    pub weight: u32,
    touched: u32,
    untouched: u32,
}

impl<B: AsRef<[f64]> + AsMut<[f64]> + Clone> Baseline<B> {
    pub fn new(values: B, weight: u32) -> Self {
        let mut drift = values.clone();
        drift.as_mut().fill(0.0);
        Self { values, drift, extrapolated: 0, since_rest: u32::MAX, weight, touched: 0, untouched: 0 }
    }

    /// Writes r − b + o for the offsets `calibration`.
    pub fn subtract(&self, reading: &[f64], calibration: &[f64], tared: &mut [f64]) {
        let baselines = self.values.as_ref().iter().zip(calibration);
        for ((tared, value), (baseline, offset)) in tared.iter_mut().zip(reading).zip(baselines) {
            *tared = value - baseline + offset;
        }
    }

    /// Extrapolates the drift, at most over as many readings as it was fitted to.
    pub fn extrapolate_drift(&mut self) {
        let is_known = self.weight >= DRIFT_KNOWN && self.extrapolated < self.weight;
        if is_known || (self.weight > 0 && self.extrapolated == 0) {
            self.extrapolated += 1;
            let drift = self.drift.as_ref().iter();
            self.values.as_mut().iter_mut().zip(drift).for_each(|(value, drift)| *value += drift);
        }
    }

    /// Adds a reading to the mean over at most `memory` readings.
    pub fn average(&mut self, reading: &[f64], memory: u32) {
        self.weight = self.weight.saturating_add(1).min(memory);
        let share = 1.0 / f64::from(self.weight);
        for (baseline, value) in self.values.as_mut().iter_mut().zip(reading) {
            *baseline += share * (value - *baseline);
        }
    }

    /// Updates level and drift by least squares with a memory that grows to the time constant (Morrison,
    /// *Introduction to Sequential Smoothing and Prediction*, 1969: expanding-memory filter of degree 1). For
    /// the first readings, and after a rest, the level is their mean.
    pub fn update(&mut self, reading: &[f64], time_constant: u32) {
        self.extrapolated = 0;
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

    /// Sets the level to the mean of `readings` readings of a rest, and keeps the drift.
    pub fn set_level(&mut self, mean: &[f64], readings: u32) {
        self.values.as_mut().copy_from_slice(mean);
        (self.since_rest, self.extrapolated) = (readings, 0);
    }

    /// Gives the level the memory of a rest that confirms it.
    pub fn shorten_level_memory(&mut self) {
        self.since_rest = DRIFT_FROM;
    }

    /// Counts contacts and the untouched readings after them.
    pub fn count(&mut self, status: Status) {
        self.untouched = run_length(self.untouched, status == Status::NoContact);
        if self.touched < LET_GO {
            self.touched = run_length(self.touched, is_contact(status));
        }
    }

    /// True once a contact has begun and ended.
    pub fn has_complete_touch(&self) -> bool {
        self.touched >= LET_GO && self.untouched >= LET_GO
    }

    pub fn forget_touch(&mut self) {
        (self.touched, self.untouched) = (0, 0);
    }

    pub fn interrupt_untouched_run(&mut self) {
        self.untouched = 0;
    }
}
