use super::RecordingError;
use crate::frame::Channel;
use crate::session::Estimation;
use palpate_estimators::estimator::Locator;
use palpate_mechanics::surface::Extent;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Description of the readings of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// Version of palpate.
    pub version: String,
    /// URL of the source.
    pub source: String,
    /// Channels of a reading.
    pub channels: Vec<RecordedChannel>,
    /// Method of estimation.
    pub estimation: Estimation,
}

/// Channel of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedChannel {
    /// Name of the sensor.
    pub name: String,
    /// Name in the frames.
    pub label: String,
    /// Symbol of the unit.
    pub unit: String,
}

#[derive(Clone, Debug)]
pub(super) struct Subject {
    pub head: Head,
    /// Text of the locator file.
    pub locator: String,
    pub channels: Vec<Channel>,
    pub extent: Extent,
}

impl Subject {
    pub fn new(locator: &Locator, estimation: Estimation, source: &str) -> Result<Self, RecordingError> {
        let channels = Channel::all_of(&locator.setup);
        let recorded = channels.iter().map(|channel| RecordedChannel {
            name: channel.name.clone(),
            label: channel.label.clone(),
            unit: channel.unit.to_string(),
        });
        let head = Head {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            source: source.to_owned(),
            channels: recorded.collect(),
            estimation,
        };
        let extent = locator.setup.surface().extent();
        let locator = locator.to_json().map_err(|error| RecordingError::Encode(error.to_string()))?;
        Ok(Self { head, locator, channels, extent })
    }
}

pub(super) const METADATA: &str = "palpate";
pub(super) const LOCATOR: &str = "locator.json";

impl Head {
    pub(super) fn metadata(&self) -> BTreeMap<String, String> {
        let channels = serde_json::to_string(&self.channels).unwrap_or_default();
        let estimation = serde_json::to_string(&self.estimation).unwrap_or_default();
        let of = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        BTreeMap::from([
            of("version", &self.version),
            of("source", &self.source),
            of("channels", &channels),
            of("estimation", &estimation),
        ])
    }

    /// Reads the head. A missing estimation means [`Estimation::Single`].
    pub(super) fn from_metadata(metadata: &BTreeMap<String, String>) -> Option<Self> {
        let text = |key: &str| metadata.get(key).cloned().unwrap_or_default();
        let estimation = match metadata.get("estimation") {
            Some(estimation) => serde_json::from_str(estimation).ok()?,
            None => Estimation::Single,
        };
        Some(Self {
            version: text("version"),
            estimation,
            source: text("source"),
            channels: serde_json::from_str(metadata.get("channels")?).ok()?,
        })
    }
}
