//! Influence functions of the channels, for loads that add up.

use super::InfluenceLocator;
use palpate_mechanics::surface::InfluenceFunction;
use std::sync::Arc;

/// Influence function, offset and noise of a channel, in its unit.
#[derive(Clone)]
pub struct LoadChannel<'a> {
    /// Reading per newton.
    pub influence: Arc<dyn InfluenceFunction + 'a>,
    /// Reading without load.
    pub offset: f64,
    /// Noise standard deviation, greater than 0.
    pub noise_sd: f64,
}

/// Readings that are not the sum of those of several loads.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotProportional {
    /// Channels that saturate.
    #[error("loads add up only where readings are proportional to the force; these channels saturate")]
    Saturation,
    /// Response F^γ with γ ≠ 1.
    #[error(
        "loads add up only where readings are proportional to the force; these grow with its power {0:.2}"
    )]
    Exponent(f64),
    /// Free structure.
    #[error(
        "loads add up only where readings are proportional to the force; these have the structure `free`"
    )]
    Free,
}

impl NotProportional {
    /// Returns the remedy.
    pub fn help(self) -> &'static str {
        "fit the recording with the structure `force-linear`, within the forces where readings follow the force"
    }
}

impl InfluenceLocator {
    /// Returns the influence function of each channel; `None` for disabled channels.
    ///
    /// # Errors
    /// [`NotProportional`] for readings that are not proportional to the force.
    pub fn influences(&self) -> Result<Vec<Option<LoadChannel<'_>>>, NotProportional> {
        match self {
            Self::Beam(beam) => Ok(beam.influences()),
            Self::Plane(plane) => Ok(plane.influences()),
            Self::ForceLinear(linear) => linear.influences(),
            Self::Measured(_) => Err(NotProportional::Free),
        }
    }
}
