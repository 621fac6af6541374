//! The sensors that read a load, with their noise.

use std::sync::Arc;

use palpate_mechanics::sensing::{Layout, NoiseError, Sensor};
use palpate_mechanics::surface::{Extent, InfluenceFunction, Surface};

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
    /// A live sensor has no noise, or none is alive.
    #[error(transparent)]
    Noise(#[from] NoiseError),
}

impl<'a> LoadSensors<'a> {
    /// The sensors of `layout` under a surface with a model; the noise of each is √(σ² + q²/12), q being its resolution.
    ///
    /// # Errors
    /// [`LoadSensorsError`] for a live sensor without noise, or when none is alive.
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Result<Self, LoadSensorsError> {
        let channel = |(sensor, sd): (&Sensor, Option<f64>)| {
            let noise_sd = sd?;
            let influence = surface.influence_function(sensor.kind, sensor.position);
            Some(LoadChannel { influence, offset: 0.0, noise_sd })
        };
        let channels = layout.sensors.iter().zip(layout.reading_sds()?).map(channel).collect();
        Ok(Self { extent: surface.extent(), channels })
    }

    /// The channels that live.
    pub fn alive(&self) -> impl Iterator<Item = &LoadChannel<'a>> {
        self.channels.iter().flatten()
    }
}
