//! How a channel turns the true value into what it reports.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::Layout;

/// The faults of one channel, in the SI unit of its sensor (or raw). The default channel is perfect.
///
/// reading = saturate(quantise((1 + g)·value + o + noise)), and 0 always when the channel is dead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChannelModel {
    /// Standard deviation of the Gaussian noise of a reading; at least 0.
    pub noise_sd: f64,
    /// Quantisation step; 0 where there is none.
    pub resolution: f64,
    /// Gain errors g lie uniformly within ± this; at least 0 and below 1.
    pub gain_error: f64,
    /// Offset errors o lie uniformly within ± this; at least 0.
    pub offset_error: f64,
    /// The sensor sits within ± this of its place, uniformly, along each side of the surface, in metres; at least 0.
    pub position_error_m: f64,
    /// Lowest and highest value that it can report, where it saturates.
    pub range: Option<(f64, f64)>,
    /// Whether it reports 0 whatever happens.
    pub dead: bool,
}

/// The gains and offsets that one simulated bench happens to have, a value per sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelErrors {
    /// g of each sensor.
    pub gains: Vec<f64>,
    /// o of each sensor, in the SI unit of the sensor (or raw).
    pub offsets: Vec<f64>,
}

impl ChannelErrors {
    /// Draws a gain and an offset for each sensor of `layout`, once per simulated recording.
    pub fn draw(layout: &Layout, rng: &mut impl Rng) -> Self {
        let mut errors = Self::none(layout);
        for (i, sensor) in layout.sensors.iter().enumerate() {
            errors.gains[i] = sensor.channel.gain_error * rng.random_range(-1.0..=1.0);
            errors.offsets[i] = sensor.channel.offset_error * rng.random_range(-1.0..=1.0);
        }
        errors
    }

    /// No gain and no offset errors.
    pub fn none(layout: &Layout) -> Self {
        Self { gains: vec![0.0; layout.len()], offsets: vec![0.0; layout.len()] }
    }
}

/// What the sensors of `layout` report when the true values are `clean_reading`: gains and offsets `errors`, fresh noise
/// from `rng`, quantisation, saturation.
///
/// One normal number is drawn per sensor whatever its faults, so a fault of one channel leaves the noise of the others
/// as it was. Values without a sensor are left out.
pub fn measure(
    layout: &Layout,
    clean_reading: &[f64],
    errors: &ChannelErrors,
    rng: &mut impl Rng,
) -> Vec<f64> {
    let drawn = errors.gains.iter().zip(&errors.offsets);
    let channels = layout.sensors.iter().map(|sensor| &sensor.channel);
    channels
        .zip(clean_reading)
        .zip(drawn)
        .map(|((channel, value), (gain, offset))| {
            let noise: f64 = rng.sample(StandardNormal);
            channel.report((1.0 + gain) * value + offset + channel.noise_sd * noise)
        })
        .collect()
}

impl ChannelModel {
    /// Quantises and saturates the analogue `value`; 0 when dead.
    fn report(&self, value: f64) -> f64 {
        if self.dead {
            return 0.0;
        }
        let quantised =
            if self.resolution > 0.0 { (value / self.resolution).round() * self.resolution } else { value };
        match self.range {
            Some((low, high)) => quantised.max(low).min(high),
            None => quantised,
        }
    }
}
