//! What fitting gives: all that a reading needs to become an estimate.

use crate::bench::Bench;
use crate::network::{NetworkLocator, TrainingOutcome};
use crate::recording::Provenance;
use palpate_core::{Estimate, Status};

/// A fitted estimator. It carries its surface, layout, scaling and provenance, so that nothing it needs is outside it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Locator {
    /// The surface that is touched, and its sensors.
    pub bench: Bench,
    /// Where it comes from.
    pub provenance: LocatorProvenance,
    /// The method and what it learned.
    pub method: Method,
}

/// Where a locator comes from.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LocatorProvenance {
    /// Version of palpate that fitted it.
    pub palpate: String,
    /// Seed of the fit.
    pub seed: u64,
    /// The recording that it was fitted to.
    pub recording: Provenance,
}

/// The methods that can locate.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The founding paper's network.
    Network(NetworkLocator),
}

/// A reading that no estimate can be made of.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ReadingError {
    /// Another number of channels.
    #[error("the reading has {found} channels; the locator has {needed}")]
    Channels {
        /// Channels of the locator.
        needed: usize,
        /// Channels of the reading.
        found: usize,
    },
    /// A value that is no number.
    #[error("channel {channel} reads {value}; it must be a finite number")]
    NotFinite {
        /// Which channel, from 1.
        channel: usize,
        /// Its value.
        value: f64,
    },
}

impl Locator {
    /// Where the surface is touched when the sensors read `reading`: one value a channel, in SI units or raw.
    ///
    /// # Errors
    /// [`ReadingError`] for another number of channels or a value that is not finite.
    pub fn locate(&self, reading: &[f64]) -> Result<Estimate, ReadingError> {
        let mismatch = ReadingError::Channels { needed: self.bench.layout.len(), found: reading.len() };
        if reading.len() != self.bench.layout.len() {
            return Err(mismatch);
        }
        if let Some(i) = reading.iter().position(|value| !value.is_finite()) {
            return Err(ReadingError::NotFinite { channel: i + 1, value: reading[i] });
        }
        let Method::Network(network) = &self.method;
        let position = network.position(reading).ok_or(mismatch)?;
        let on_surface = self.bench.surface.extent().contains(position);
        let status = if on_surface { Status::Located } else { Status::OutsideSurface };
        Ok(Estimate::of_position(position, status))
    }

    /// The `kind` under which a rig names its estimator.
    pub fn kind(&self) -> &'static str {
        match self.method {
            Method::Network(_) => "network",
        }
    }

    /// The numbers that fitting found.
    pub fn parameters(&self) -> &[f64] {
        let Method::Network(network) = &self.method;
        &network.weights
    }

    /// How its training ended.
    pub fn training_outcome(&self) -> TrainingOutcome {
        let Method::Network(network) = &self.method;
        network.outcome
    }
}
