//! What a load profile is told by: the sensors of a bench, or the influence functions that a locator was fitted to.

use std::sync::Arc;

use super::{Locator, Method};
use crate::influence::InfluenceLocator;
use crate::load_profile::{LoadChannel, LoadSensors, LoadSensorsError, Profiler};
use crate::setup::Setup;

/// The sensors of a bench, by mechanics.
///
/// # Errors
/// [`LoadSensorsError`] for a surface without a model, a live sensor without noise, or when none is alive.
pub fn setup_load_sensors(setup: &Setup) -> Result<LoadSensors<'_>, LoadSensorsError> {
    LoadSensors::new(setup.surface.model().ok_or(LoadSensorsError::NoModel)?, &setup.layout)
}

impl<'a> Profiler<'a> {
    /// For readings of a setup, by mechanics.
    ///
    /// # Errors
    /// [`LoadSensorsError`] as for [`setup_load_sensors`].
    pub fn of(setup: &'a Setup) -> Result<Self, LoadSensorsError> {
        Ok(Self::new(setup_load_sensors(setup)?))
    }
}

impl Locator {
    /// What a spread load reads: by the fitted influence functions of an influence locator, with its offsets and noise, and
    /// by the mechanics of the bench for any other.
    ///
    /// # Errors
    /// [`LoadSensorsError`] for a measured surface, a live sensor without noise, or when none is alive.
    pub fn load_sensors(&self) -> Result<LoadSensors<'_>, LoadSensorsError> {
        match &self.method {
            Method::Influence(InfluenceLocator::Beam(beam)) => {
                let channels = beam.channels().map(|channel| {
                    let (influence, offset, noise_sd) = channel?;
                    Some(LoadChannel { influence: Arc::new(influence), offset, noise_sd })
                });
                Ok(LoadSensors { extent: self.setup.surface.extent(), channels: channels.collect() })
            }
            _ => setup_load_sensors(&self.setup),
        }
    }
}
