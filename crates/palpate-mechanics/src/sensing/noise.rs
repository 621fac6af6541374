//! How noisy the sensors of a layout are.

use super::{ChannelModel, Layout, SensorKind};

/// A layout whose noise does not say how closely its readings are to be followed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoiseError {
    /// A live sensor has neither noise nor resolution: the noise is singular.
    #[error(
        "sensor {number} ({kind}) has noise {noise_sd} and resolution {resolution}; one of them must be greater than 0, or \
         nothing limits what it tells"
    )]
    Singular {
        /// Which sensor, from 1.
        number: usize,
        /// What it measures.
        kind: SensorKind,
        /// Standard deviation of its noise, in its SI unit.
        noise_sd: f64,
        /// Its quantisation step, in its SI unit.
        resolution: f64,
    },
    /// Every channel is dead.
    #[error("all {count} sensors are dead; at least 1 must be alive")]
    AllDead {
        /// How many sensors there are.
        count: usize,
    },
}

impl NoiseError {
    /// What to do about it, in a rig.
    pub const fn help(&self) -> &'static str {
        match self {
            Self::Singular { .. } => "add `noise = \"5 um\"` to [sensors], in the unit of the readings",
            Self::AllDead { .. } => "take sensors out of `dead` in [sensors]",
        }
    }
}

impl ChannelModel {
    /// Standard deviation of a reading, √(σ² + q²/12) with σ the noise and q the resolution, in the sensor's SI unit.
    pub fn reading_sd(&self) -> f64 {
        self.noise_sd.hypot(self.resolution / 12f64.sqrt())
    }
}

impl Layout {
    /// [`ChannelModel::reading_sd`] of each sensor; `None` for those that are dead.
    ///
    /// # Errors
    /// [`NoiseError`] for the first live sensor without noise, or when none is alive.
    pub fn reading_sds(&self) -> Result<Vec<Option<f64>>, NoiseError> {
        let sds = self.sensors.iter().enumerate().map(|(i, sensor)| {
            let ChannelModel { noise_sd, resolution, dead, .. } = sensor.channel;
            let sd = sensor.channel.reading_sd();
            if dead {
                Ok(None)
            } else if sd > 0.0 && sd.is_finite() {
                Ok(Some(sd))
            } else {
                Err(NoiseError::Singular { number: i + 1, kind: sensor.kind, noise_sd, resolution })
            }
        });
        let sds = sds.collect::<Result<Vec<_>, _>>()?;
        let lives = sds.iter().any(Option::is_some);
        if lives { Ok(sds) } else { Err(NoiseError::AllDead { count: self.len() }) }
    }
}
