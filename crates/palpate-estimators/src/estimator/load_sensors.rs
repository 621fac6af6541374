//! What a load profile is told by: the sensors of a bench, or the influence functions that a locator was fitted to.

use std::sync::Arc;

use super::{Locator, Method};
use crate::influence::InfluenceLocator;
use crate::load_profile::{LoadChannel, LoadSensors, LoadSensorsError, Profiler};
use crate::setup::Bench;

/// The sensors of a bench, by mechanics.
///
/// # Errors
/// [`LoadSensorsError`] for a surface without a model, a live sensor without noise, or when none is alive.
pub fn bench_load_sensors(bench: &Bench) -> Result<LoadSensors<'_>, LoadSensorsError> {
    LoadSensors::new(bench.surface.model().ok_or(LoadSensorsError::NoModel)?, &bench.layout)
}

impl<'a> Profiler<'a> {
    /// For readings of a setup, by mechanics.
    ///
    /// # Errors
    /// [`LoadSensorsError`] as for [`bench_load_sensors`].
    pub fn of(bench: &'a Bench) -> Result<Self, LoadSensorsError> {
        Ok(Self::new(bench_load_sensors(bench)?))
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
                Ok(LoadSensors { extent: self.bench.surface.extent(), channels: channels.collect() })
            }
            _ => bench_load_sensors(&self.bench),
        }
    }
}
