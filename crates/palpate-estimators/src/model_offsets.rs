//! Offsets for methods that compute from the model and the rig alone: the offsets of the untouched rows of a recording, and their uncertainty.

use crate::locator_fault::LocatorFault;
use crate::recording::Recording;
use palpate_mechanics::sensing::Layout;
use std::borrow::Cow;

/// Offset of each channel, and the layout with the uncertainty of the offsets in its noise.
///
/// The mean of n untouched rows has the variance σ²/n, which adds to the σ² of a reading. Without such a row an offset is anywhere within ± `offset_error` of
/// the rig, with the variance e²/3; then none is returned.
pub(crate) fn offsets_of(recording: &Recording, layout: &Layout) -> (Vec<f64>, Layout) {
    let offsets = recording.untouched_mean().unwrap_or_default();
    let untouched = recording.rows.iter().filter(|row| !row.touches()).count();
    let mut widened = layout.clone();
    // Only the noise changes, and every layout accepts it.
    let _ = widened.edit(|sensors| {
        for channel in sensors.iter_mut().map(|sensor| &mut sensor.channel) {
            let variance = match untouched {
                0 => channel.offset_error.powi(2) / 3.0,
                count => channel.reading_sd().powi(2) / count as f64,
            };
            // A channel with unknown noise keeps it unknown.
            if channel.reading_sd() > 0.0 {
                channel.noise_sd = (channel.noise_sd.powi(2) + variance).sqrt();
            }
        }
    });
    (offsets, widened)
}

/// Checks the offsets of a locator file.
///
/// # Errors
/// [`LocatorFault`] for another number of channels, and an offset that is not finite.
pub(crate) fn check_offsets(offsets: &[f64], channels: usize) -> Result<(), LocatorFault> {
    if !offsets.is_empty() {
        LocatorFault::check_count("offsets", channels, offsets.len())?;
    }
    LocatorFault::check_numbers("offset", offsets.iter().copied(), |_| true, "a finite number")
}

/// A reading less the offsets; unchanged without offsets.
pub(crate) fn less_offsets<'a>(reading: &'a [f64], offsets: &[f64]) -> Cow<'a, [f64]> {
    if offsets.is_empty() {
        return Cow::Borrowed(reading);
    }
    Cow::Owned(reading.iter().zip(offsets).map(|(value, offset)| value - offset).collect())
}
