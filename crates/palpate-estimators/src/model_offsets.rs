//! Offsets for methods without training.

use crate::locator_fault::LocatorFault;
use crate::recording::Recording;
use palpate_mechanics::sensing::Layout;
use std::borrow::Cow;

/// Offsets with their variance in the layout's noise: σ²/n of n untouched rows, else e²/3 for ±
/// `offset_error` e.
pub(crate) fn offsets_of(recording: &Recording, layout: &Layout) -> (Vec<f64>, Layout) {
    let offsets = recording.untouched_mean().unwrap_or_default();
    let untouched = recording.rows.iter().filter(|row| !row.touches()).count();
    let mut widened = layout.clone();
    // Every layout accepts a changed noise.
    let _ = widened.edit(|sensors| {
        for channel in sensors.iter_mut().map(|sensor| &mut sensor.channel) {
            let variance = match untouched {
                0 => channel.offset_error.powi(2) / 3.0,
                count => channel.reading_sd().powi(2) / count as f64,
            };
            // Unknown noise stays unknown.
            if channel.reading_sd() > 0.0 {
                channel.noise_sd = (channel.noise_sd.powi(2) + variance).sqrt();
            }
        }
    });
    (offsets, widened)
}

pub(crate) fn check_offsets(offsets: &[f64], channels: usize) -> Result<(), LocatorFault> {
    if !offsets.is_empty() {
        LocatorFault::check_count("offsets", channels, offsets.len())?;
    }
    LocatorFault::check_numbers("offset", offsets.iter().copied(), |_| true, "a finite number")
}

pub(crate) fn less_offsets<'a>(reading: &'a [f64], offsets: &[f64]) -> Cow<'a, [f64]> {
    if offsets.is_empty() {
        return Cow::Borrowed(reading);
    }
    Cow::Owned(reading.iter().zip(offsets).map(|(value, offset)| value - offset).collect())
}
