//! Features of a reading for inverse methods.

use crate::fit::LocatorFault;
use crate::recording::{Recording, is_one_force};
use crate::setup::Setup;
use palpate_numerics::mean_and_variance;

/// Kind of features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeatureKind {
    /// Readings.
    Readings,
    /// r/‖r‖, independent of the force for proportional readings, and ln ‖r‖.
    LoadInvariant,
    /// r/‖r‖ alone, as ln ‖r‖ from one force misleads at others.
    Direction,
    /// ln r of positive readings, for channels of different powers of the force.
    Logarithms,
}

impl FeatureKind {
    /// Returns the kinds to compare: readings and r/‖r‖ with ln ‖r‖ for a known force, else load-invariant
    /// features and logarithms. Only proportions distinguish the ends of a beam.
    pub fn contenders(setup: &Setup, recording: &Recording) -> Vec<Self> {
        if setup.force_n().is_some() {
            return vec![Self::Readings, Self::LoadInvariant];
        }
        let mut readings = recording.rows.iter().flat_map(|row| &row.reading);
        let logarithms = readings.all(|value| *value > 0.0).then_some(Self::Logarithms);
        std::iter::once(Self::load_invariant(setup, recording)).chain(logarithms).collect()
    }

    /// Returns the load-invariant kind, without ln ‖r‖ for presses of one force and unknown forces.
    pub fn load_invariant(setup: &Setup, recording: &Recording) -> Self {
        let forces_n: Option<Vec<f64>> =
            recording.rows.iter().filter(|row| row.touches()).map(|row| row.force_n).collect();
        let has_one_force = forces_n.is_some_and(is_one_force);
        if setup.force_n().is_none() && has_one_force { Self::Direction } else { Self::LoadInvariant }
    }
}

/// Recording of constant readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("all {channels} channels of the recording are constant over its {rows} rows; at least 1 must vary")]
pub struct NoFeatures {
    /// Channels of the recording.
    pub channels: usize,
    /// Rows of the recording.
    pub rows: usize,
}

/// Standardized features (source − centre)/spread, without constant ones.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Features {
    /// Kind of features.
    pub kind: FeatureKind,
    /// Channels in use.
    pub channels: Vec<ChannelScale>,
    /// Least ‖r‖; greater than 0.
    pub least_norm: f64,
    /// Features in order.
    pub features: Vec<Feature>,
}

/// Divisor of a channel, for comparable kinds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelScale {
    /// Channel of a reading, from 0.
    pub channel: usize,
    /// Root mean square of its kind; greater than 0.
    pub divisor: f64,
}

/// Standardized feature.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Source.
    pub source: FeatureSource,
    /// Mean over the recording.
    pub centre: f64,
    /// Standard deviation over the recording; greater than 0.
    #[serde(rename = "spread")]
    pub standard_deviation: f64,
}

/// Source of a feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeatureSource {
    /// r, r/‖r‖ or ln r by index in [`Features::channels`].
    Channel(usize),
    /// ln ‖r‖.
    LogNorm,
}

/// Lower bound of norms and readings, relative to the least.
const LEAST_NORM: f64 = 1e-3;
const ROUNDING: f64 = 1e-12;

impl Features {
    /// Computes the features of a recording.
    ///
    /// # Errors
    /// [`NoFeatures`] for constant channels.
    pub fn fit(kind: FeatureKind, recording: &Recording) -> Result<Self, NoFeatures> {
        let rows = recording.rows.len();
        let none = NoFeatures { channels: recording.channels.len(), rows };
        let channels = channel_scales(recording);
        let mut features = Self { kind, channels, least_norm: 1.0, features: Vec::new() };
        let norms = recording.rows.iter().map(|row| features.norm(&row.reading)).filter(|norm| *norm > 0.0);
        let least = norms.fold(f64::INFINITY, f64::min);
        if !least.is_finite() {
            return Err(none);
        }
        features.least_norm = LEAST_NORM * least;
        let channels = (0..features.channels.len()).map(FeatureSource::Channel);
        let log_norm = (kind == FeatureKind::LoadInvariant).then_some(FeatureSource::LogNorm);
        let found = channels.chain(log_norm).filter_map(|source| features.standardized(source, recording));
        features.features = found.collect();
        if features.features.is_empty() { Err(none) } else { Ok(features) }
    }

    /// Number of features.
    pub fn len(&self) -> usize {
        self.features.len()
    }

    /// True without features, which [`Features::fit`] excludes.
    pub fn is_empty(&self) -> bool {
        self.features.is_empty()
    }

    /// Returns the features of a reading.
    pub fn apply(&self, reading: &[f64]) -> Vec<f64> {
        let norm = self.norm(reading).max(self.least_norm);
        let standardized = |feature: &Feature| {
            (self.raw(feature.source, reading, norm) - feature.centre) / feature.standard_deviation
        };
        self.features.iter().map(standardized).collect()
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault`].
    pub fn check(&self, channels: usize) -> Result<(), LocatorFault> {
        let positive = |what, numbers: &mut dyn Iterator<Item = f64>| {
            LocatorFault::check_numbers(what, numbers, |value| value > 0.0, "finite and greater than 0")
        };
        positive("least norm", &mut [self.least_norm].into_iter())?;
        positive("channel divisor", &mut self.channels.iter().map(|scale| scale.divisor))?;
        positive("feature spread", &mut self.features.iter().map(|feature| feature.standard_deviation))?;
        let centres = self.features.iter().map(|feature| feature.centre);
        LocatorFault::check_numbers("feature centre", centres, |_| true, "finite")?;
        let known = self.channels.iter().filter(|scale| scale.channel < channels).count();
        LocatorFault::check_count("channel scales of known channels", self.channels.len(), known)?;
        let made = |feature: &&Feature| match feature.source {
            FeatureSource::Channel(i) => i < self.channels.len(),
            FeatureSource::LogNorm => self.kind == FeatureKind::LoadInvariant,
        };
        let made = self.features.iter().filter(made).count();
        LocatorFault::check_count("features of known sources", self.features.len().max(1), made)
    }

    pub(crate) fn norm(&self, reading: &[f64]) -> f64 {
        let square = |scale: &ChannelScale| (value(reading, scale.channel) / scale.divisor).powi(2);
        self.channels.iter().map(square).sum::<f64>().sqrt()
    }

    fn raw(&self, source: FeatureSource, reading: &[f64], norm: f64) -> f64 {
        let FeatureSource::Channel(i) = source else { return norm.ln() };
        let ChannelScale { channel, divisor } = self.channels[i];
        let scaled = value(reading, channel) / divisor;
        match self.kind {
            FeatureKind::Readings => scaled,
            FeatureKind::LoadInvariant | FeatureKind::Direction => scaled / norm,
            FeatureKind::Logarithms => scaled.max(self.least_norm).ln(),
        }
    }

    fn standardized(&self, source: FeatureSource, recording: &Recording) -> Option<Feature> {
        let raw = |reading: &[f64]| self.raw(source, reading, self.norm(reading).max(self.least_norm));
        let values: Vec<f64> = recording.rows.iter().map(|row| raw(&row.reading)).collect();
        let (centre, variance) = mean_and_variance(values.iter().copied());
        let spread = variance.sqrt();
        let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        (spread > ROUNDING * largest && spread.is_finite()).then_some(Feature {
            source,
            centre,
            standard_deviation: spread,
        })
    }
}

fn channel_scales(recording: &Recording) -> Vec<ChannelScale> {
    let column = |channel: usize| recording.rows.iter().map(move |row| value(&row.reading, channel));
    let varies = |channel: &usize| {
        let (least, most) =
            column(*channel).fold((f64::MAX, f64::MIN), |(a, b), value| (a.min(value), b.max(value)));
        most - least > ROUNDING * least.abs().max(most.abs())
    };
    let live: Vec<usize> = (0..recording.channels.len()).filter(varies).collect();
    let kind = |channel: usize| recording.kinds.get(channel);
    let of_one = |&channel: &usize| {
        let alike = live.iter().filter(|other| kind(**other) == kind(channel));
        let (sum, count) = alike
            .flat_map(|other| column(*other))
            .fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
        ChannelScale { channel, divisor: (sum / count).sqrt() }
    };
    live.iter().map(of_one).filter(|scale| scale.divisor.is_finite() && scale.divisor > 0.0).collect()
}

fn value(reading: &[f64], channel: usize) -> f64 {
    reading.get(channel).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
