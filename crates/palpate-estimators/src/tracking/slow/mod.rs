//! Slow states of the channels: drift of the offsets and creep of the surface.
//!
//! Over each channel's noise, a reading less the calibrated offsets is y = s + c·z + d + n with the contacts'
//! reading s = h(θ), the [creep](creep) c·z, the [drift](drift) d and white noise n.

mod block;
mod consider;
mod creep;
mod drift;

pub(super) use consider::widen;
pub use creep::Creep;
pub use drift::Drift;

use super::TrackedContact;
use crate::likelihood::Likelihood;
use crate::untouched_drift::UntouchedDrift;
use block::Block;
use creep::CreepFilter;
use drift::DriftFilter;
use ndarray::Array2;
use palpate_mechanics::contact::{Contact, Position};

/// Least probability of the number of contacts for an observation of the drift.
const LEAST_PROBABILITY: f64 = 0.95;

#[derive(Clone, Debug)]
pub(super) struct SlowState {
    /// Channel and noise per value.
    noise: Vec<(usize, f64)>,
    drift: Option<DriftFilter>,
    creep: Option<CreepFilter>,
    block: Block,
    time_s: f64,
}

impl SlowState {
    pub fn new(
        likelihood: &dyn Likelihood,
        channels: usize,
        drift: Option<Drift>,
        creep: Option<Creep>,
    ) -> Self {
        let noise = noise(likelihood, channels);
        let calibrated = likelihood.untouched_drift();
        let in_noise = |values: &[f64]| -> Vec<f64> {
            let value = |channel: usize| values.get(channel).copied().unwrap_or(0.0);
            noise.iter().map(|(channel, noise)| value(*channel) / noise.abs()).collect()
        };
        let of_calibration = |drift: &UntouchedDrift| {
            Drift::up_to(in_noise(&drift.walk_per_root_s).into_iter().fold(0.0, f64::max))
        };
        // Standard deviation of an offset that is uniform over the range.
        let uniform_sd = |drift: &UntouchedDrift| {
            in_noise(&drift.range).iter().map(|range| range / 12f64.sqrt()).collect()
        };
        let offset_sd: Vec<f64> = calibrated.map_or_else(|| vec![1.0; noise.len()], uniform_sd);
        let drift = drift.or_else(|| calibrated.map(of_calibration));
        Self {
            drift: drift.map(|config| DriftFilter::new(config, &offset_sd)),
            creep: creep.map(|creep| CreepFilter::new(creep, noise.len())),
            noise,
            block: Block::default(),
            time_s: 0.0,
        }
    }

    /// Corrects a reading and its whitened values.
    pub fn subtract(
        &mut self,
        time_s: f64,
        duration_s: Option<f64>,
        whitened: &mut [f64],
        reading: &mut [f64],
    ) {
        self.time_s = time_s;
        let step_share = self.creep.as_ref().map_or(0.0, |creep| creep.step_share(duration_s));
        for (i, value) in whitened.iter_mut().enumerate() {
            let before = *value;
            if let Some(drift) = &self.drift {
                *value -= drift.offset_at(i, time_s);
            }
            if let Some(creep) = &mut self.creep {
                *value = creep.subtract(i, *value, step_share);
            }
            let (channel, noise) = self.noise[i];
            reading[channel] += noise * (*value - before);
        }
    }

    /// Updates by a corrected reading; `probability` is that of the number of contacts.
    pub fn learn(
        &mut self,
        likelihood: &dyn Likelihood,
        whitened: &[f64],
        contacts: &[TrackedContact],
        probability: f64,
    ) {
        let Some(drift) = &mut self.drift else { return };
        let contacts: Vec<Contact> = contacts.iter().map(contact_of).collect();
        if self.block.ends_before(self.time_s, &contacts) {
            drift.observe(likelihood, &std::mem::take(&mut self.block));
        }
        if probability < LEAST_PROBABILITY {
            return;
        }
        let predicted = likelihood.linearised(&contacts).reading;
        let time_s = self.time_s;
        let residuals = whitened.iter().zip(&predicted).enumerate();
        let offsets = residuals.map(|(i, (value, own))| value - own + drift.offset_at(i, time_s));
        self.block.add(time_s, offsets, &contacts);
    }

    /// Covariance of the drift over the noise.
    pub fn drift_covariance(&self) -> Option<&Array2<f64>> {
        self.drift.as_ref().map(|drift| &drift.covariance)
    }

    /// Moves the states with the baseline of the readings, and restarts them where it is a new one.
    pub fn move_baseline(&mut self, by: &[f64]) {
        let moved: Vec<f64> = self.noise.iter().map(|(channel, noise)| by[*channel] / noise).collect();
        let is_new = moved.iter().any(|moved| moved.abs() > 1.0);
        if is_new {
            self.creep.iter_mut().for_each(CreepFilter::reset);
        }
        let Some(drift) = &mut self.drift else { return };
        if is_new {
            self.block = Block::default();
            // A new baseline, with the noise of its readings.
            *drift = DriftFilter::new(drift.config, &vec![1.0; self.noise.len()]);
        } else {
            drift.move_by(&moved);
            self.block.move_by(&moved);
        }
    }
}

/// Whitening is affine: 1 in a channel adds 1/noise.
fn noise(likelihood: &dyn Likelihood, channels: usize) -> Vec<(usize, f64)> {
    let (mut reading, mut from, mut to) = (vec![0.0; channels], Vec::new(), Vec::new());
    likelihood.whiten(&reading, &mut from);
    let mut noise = vec![(0, f64::INFINITY); from.len()];
    for channel in 0..channels {
        reading[channel] = 1.0;
        likelihood.whiten(&reading, &mut to);
        reading[channel] = 0.0;
        for (own, (to, from)) in noise.iter_mut().zip(to.iter().zip(&from)) {
            if to != from {
                *own = (channel, 1.0 / (to - from));
            }
        }
    }
    noise
}

fn contact_of(tracked: &TrackedContact) -> Contact {
    let y_m = tracked.transverse.map_or(0.0, |across| across.y_m);
    Contact { position: Position { x_m: tracked.x_m, y_m }, force_n: tracked.force_n }
}

#[cfg(test)]
mod tests;
