//! Parameters of the channels of a locator with a model, besides the influence functions.

use super::config::ForceBelief;
use super::loads::LoadChannel;
use crate::fit::LocatorFault;
use crate::force_prior::{DECADE, ForceRange};
use crate::status::FalseAlarmRate;
use palpate_mechanics::surface::InfluenceFunction;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Channels {
    /// Offset of each channel, in its SI unit.
    pub offsets: Vec<f64>,
    /// Noise of each channel, in its SI unit.
    pub noise_sd: Vec<f64>,
    pub dead: Vec<bool>,
    /// Mean force of the calibration.
    pub reference_force_n: f64,
    /// Stated upper bound of an unknown force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub greatest_force_n: Option<f64>,
    /// Stated lower bound of an unknown force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_force_n: Option<f64>,
    #[serde(default)]
    pub false_alarm_rate: FalseAlarmRate,
}

impl Channels {
    pub fn live(&self) -> Vec<usize> {
        (0..self.dead.len()).filter(|s| !self.dead[*s]).collect()
    }

    pub fn noise_in_use(&self) -> Vec<Option<f64>> {
        self.noise_sd.iter().zip(&self.dead).map(|(sd, dead)| (!dead).then_some(*sd)).collect()
    }

    /// Influence functions of the channels with those in use, in their order; `None` for disabled channels.
    pub fn influences<'a>(
        &'a self,
        in_use: impl Iterator<Item = Arc<dyn InfluenceFunction + 'a>>,
    ) -> Vec<Option<LoadChannel<'a>>> {
        let mut influences = vec![None; self.dead.len()];
        for (channel, influence) in self.live().into_iter().zip(in_use) {
            let (offset, noise_sd) = (self.offsets[channel], self.noise_sd[channel]);
            influences[channel] = Some(LoadChannel { influence, offset, noise_sd });
        }
        influences
    }

    /// Upper bound of an unknown force: as stated, or [`DECADE`] times the calibration's.
    pub fn greatest_force_n(&self) -> f64 {
        self.greatest_force_n.unwrap_or(DECADE * self.reference_force_n)
    }

    /// Range of an unknown force: as stated, or a decade on either side of the calibration's.
    pub fn force_range(&self) -> Option<ForceRange> {
        let greatest_n = self.greatest_force_n();
        let of_calibration = || (self.reference_force_n / DECADE).min(greatest_n / DECADE);
        ForceRange::new(self.least_force_n.unwrap_or_else(of_calibration), greatest_n).ok()
    }

    /// Disables a channel; `None` when no channel would remain.
    pub fn without(&self, channel: usize) -> Option<Self> {
        let mut channels = self.clone();
        if let Some(dead) = channels.dead.get_mut(channel) {
            *dead = true;
        }
        channels.dead.contains(&false).then_some(channels)
    }

    /// Checks the values of a locator file.
    ///
    /// # Errors
    /// [`LocatorFault`] for a wrong length, a number out of bounds, or no channel in use.
    pub fn check(&self, sensors: usize, force: ForceBelief) -> Result<(), LocatorFault> {
        let count = LocatorFault::check_count;
        count("offsets", sensors, self.offsets.len())?;
        count("noises", sensors, self.noise_sd.len())?;
        count("marks of dead channels", sensors, self.dead.len())?;
        if !self.dead.contains(&false) {
            return Err(LocatorFault::Count { what: "living channels", needed: 1, found: 0 });
        }
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        numbers("offset", &self.offsets, |_| true, "a finite number")?;
        numbers("noise", &self.noise_sd, |sd| sd > 0.0, "greater than 0")?;
        numbers("reference force", &[self.reference_force_n], |force| force > 0.0, "greater than 0")?;
        let greatest = LocatorFault::check_numbers(
            "greatest force",
            self.greatest_force_n,
            |force| force > 0.0,
            "greater than 0",
        );
        greatest?;
        let least = LocatorFault::check_numbers(
            "least force",
            self.least_force_n,
            |force| force > 0.0,
            "greater than 0",
        );
        least?;
        let force = if force.is_usable() { 1.0 } else { f64::NAN };
        numbers("belief about the force", &[force], |_| true, "greater than 0")
    }
}
