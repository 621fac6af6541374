//! The channels of a locator with a model, besides their influence functions.

use super::belief::ForceBelief;
use crate::fit::LocatorFault;

/// What is learnt of the channels besides their influence functions.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Channels {
    /// Offset of each channel, in its SI unit.
    pub offsets: Vec<f64>,
    /// Noise of each channel, in its SI unit.
    pub noise_sd: Vec<f64>,
    /// Mean force of the presses, in newtons.
    pub reference_force_n: f64,
}

/// The marks of dead channels with one more, channel `channel` (from 0); `None` when no channel would be left.
pub(super) fn without(dead: &[bool], channel: usize) -> Option<Vec<bool>> {
    let mut dead = dead.to_vec();
    if let Some(dead) = dead.get_mut(channel) {
        *dead = true;
    }
    dead.contains(&false).then_some(dead)
}

/// Checks what a file may have got wrong of `sensors` channels.
///
/// # Errors
/// [`LocatorFault`] for a list of another length, a number out of its bounds, or when no channel lives.
pub(super) fn check(
    sensors: usize,
    offsets: &[f64],
    noise_sd: &[f64],
    dead: &[bool],
    force: ForceBelief,
) -> Result<(), LocatorFault> {
    let count = LocatorFault::check_count;
    count("offsets", sensors, offsets.len())?;
    count("noises", sensors, noise_sd.len())?;
    count("marks of dead channels", sensors, dead.len())?;
    if !dead.contains(&false) {
        return Err(LocatorFault::Count { what: "living channels", needed: 1, found: 0 });
    }
    LocatorFault::check_numbers("offset", offsets.iter().copied(), |_| true, "a finite number")?;
    LocatorFault::check_numbers("noise", noise_sd.iter().copied(), |sd| sd > 0.0, "greater than 0")?;
    let force = if force.is_usable() { 1.0 } else { f64::NAN };
    LocatorFault::check_numbers("belief about the force", [force], |_| true, "greater than 0")
}
