//! The sensors that read a load, with their noise.

use std::sync::Arc;

use crate::mechanics::{Extent, InfluenceFunction, Surface};
use crate::sensing::{Layout, SensorKind};

/// One channel of a reading.
#[derive(Clone)]
pub struct LoadChannel<'a> {
    /// What it reads per newton.
    pub influence: Arc<dyn InfluenceFunction + 'a>,
    /// What it reads without load, in its SI unit.
    pub offset: f64,
    /// Standard deviation of its noise, in its SI unit; greater than 0.
    pub noise_sd: f64,
}

/// What a reading is made by: a channel each, or `None` for those that are dead.
#[derive(Clone)]
pub struct LoadSensors<'a> {
    /// The surface.
    pub extent: Extent,
    /// Its channels, in the order of a reading.
    pub channels: Vec<Option<LoadChannel<'a>>>,
}

/// Why readings cannot become a profile.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LoadSensorsError {
    /// The surface has no model, and nothing was fitted.
    #[error(
        "a measured surface has no influence functions of a spread load; give a surface with a model, such as a beam"
    )]
    NoModel,
    /// A live sensor whose noise is not a positive number.
    #[error(
        "sensor {number} ({kind}) has noise {noise_sd} and resolution {resolution}; one of them must be greater than 0, or \
         nothing says how closely its reading is to be followed"
    )]
    SingularNoise {
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

impl<'a> LoadSensors<'a> {
    /// The sensors of `layout` under a surface with a model; the noise of each is √(σ² + q²/12), q being its resolution.
    ///
    /// # Errors
    /// [`LoadSensorsError`] for a live sensor without noise, or when none is alive.
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Result<Self, LoadSensorsError> {
        let channels = layout.sensors.iter().enumerate().map(|(i, sensor)| {
            let (noise_sd, resolution) = (sensor.channel.noise_sd, sensor.channel.resolution);
            if sensor.channel.dead {
                return Ok(None);
            }
            let sd = noise_sd.hypot(resolution / 12f64.sqrt());
            if !(sd > 0.0 && sd.is_finite()) {
                let (number, kind) = (i + 1, sensor.kind);
                return Err(LoadSensorsError::SingularNoise { number, kind, noise_sd, resolution });
            }
            let influence = surface.influence_function(sensor.kind, sensor.position);
            Ok(Some(LoadChannel { influence, offset: 0.0, noise_sd: sd }))
        });
        let channels = channels.collect::<Result<Vec<_>, _>>()?;
        if channels.iter().all(Option::is_none) {
            return Err(LoadSensorsError::AllDead { count: layout.len() });
        }
        Ok(Self { extent: surface.extent(), channels })
    }

    /// The channels that live.
    pub fn alive(&self) -> impl Iterator<Item = &LoadChannel<'a>> {
        self.channels.iter().flatten()
    }
}
