//! What a rig's `[estimator] kind = "influence"` says.

/// The influence estimator: learn what each sensor reads as a function of the contact, and invert it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Where the influence functions come from.
    pub from: InfluenceSource,
    /// The most contacts that may touch at once; 1 to 3.
    pub contacts: usize,
    /// Standard deviation of the contact's force about the bench's, in newtons, where it is known only roughly.
    pub force_sd_n: Option<f64>,
}

/// Where influence functions come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InfluenceSource {
    /// From the recording alone, by splines that the supports hold.
    Recording,
    /// From the mechanics alone; the recording tells the noise.
    Mechanics,
    /// From the mechanics, corrected by the recording: gains, offsets, sensors beside their place, and a remainder.
    Corrected,
}

impl Default for Influence {
    fn default() -> Self {
        Self { from: InfluenceSource::Corrected, contacts: 1, force_sd_n: None }
    }
}
