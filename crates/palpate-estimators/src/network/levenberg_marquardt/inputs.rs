//! From a reading to a network's inputs.

use ndarray::{Array1, Array2};
use serde::{Deserialize, Serialize};

use crate::features::{FeatureKind, FeatureSource, Features, NoFeatures};
use crate::fit::LocatorFault;
use crate::recording::Recording;
use palpate_mechanics::sensing::Layout;
use palpate_numerics::{mean, symmetric_eigen};

/// Whitened inputs: the reading's load-invariant [`Features`] along their principal axes, each with mean 0 and variance 1 over the
/// training recording.
///
/// They are load-invariant even where the force is known: near a support the readings themselves shrink to nothing, while their
/// direction still tells one end from the other.
///
/// Axes along which the recording has no more than noise are left out: where the layout says how noisy its channels are,
/// those with a variance below four times that of the noise; else those below 10⁻⁸ of the largest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkInputs {
    /// From a reading to features with mean 0 and variance 1.
    pub features: Features,
    /// A row an input: what each feature is multiplied by.
    pub axes: Vec<Vec<f64>>,
}

impl NetworkInputs {
    /// The inputs for a recording; none where its readings differ by no more than noise.
    pub(super) fn of(layout: &Layout, recording: &Recording) -> Result<Self, NoFeatures> {
        let features = Features::fit(FeatureKind::LoadInvariant, recording)?;
        let mut inputs = Self { features, axes: Vec::new() };
        let noise = inputs.feature_noise(layout, recording);
        // In units of the noise, where that is known, all that is not signal has variance 1 along every axis.
        let unit = noise.clone().unwrap_or_else(|| Array1::ones(inputs.features.len()));
        let mut covariance = Array2::zeros((unit.len(), unit.len()));
        for row in &recording.rows {
            let values = Array1::from(inputs.features.apply(&row.reading)) / &unit;
            let column = values.view().insert_axis(ndarray::Axis(1));
            covariance += &column.dot(&column.t());
        }
        covariance /= recording.rows.len() as f64;
        let (variances, axes) = symmetric_eigen(&covariance);
        let least = if noise.is_some() { 4.0 } else { 1e-8 * variances[0] };
        let seen = variances.iter().zip(axes.columns()).filter(|(variance, _)| **variance > least);
        inputs.axes = seen.map(|(variance, axis)| (&axis / &unit / variance.sqrt()).to_vec()).collect();
        Ok(inputs)
    }

    /// Standard deviation of every feature's noise, where the layout says how noisy its channels are; to first order at
    /// the mean norm where features are load-invariant: that of r/|r| is σ/|r|, that of ln |r| at most as large.
    fn feature_noise(&self, layout: &Layout, recording: &Recording) -> Option<Array1<f64>> {
        let Features { kind, channels, features, .. } = &self.features;
        let scaled: Vec<f64> = channels
            .iter()
            .map(|scale| {
                let channel = &layout.sensors[scale.channel].channel;
                channel.reading_sd() / scale.divisor
            })
            .collect();
        if scaled.contains(&0.0) {
            return None;
        }
        let largest = scaled.iter().fold(0.0, |m: f64, s| m.max(*s));
        let norm = match kind {
            FeatureKind::Readings => 1.0,
            FeatureKind::LoadInvariant => {
                let square = |reading: &[f64]| {
                    channels.iter().map(|s| (reading[s.channel] / s.divisor).powi(2)).sum::<f64>()
                };
                mean(recording.rows.iter().map(|row| square(&row.reading).sqrt()))
            }
        };
        let of_feature = |source| match source {
            FeatureSource::Channel(i) => scaled[i],
            FeatureSource::LogNorm => largest,
        };
        Some(features.iter().map(|feature| of_feature(feature.source) / norm / feature.spread).collect())
    }

    /// The inputs for a reading.
    pub fn values(&self, reading: &[f64]) -> Vec<f64> {
        let features = self.features.apply(reading);
        self.axes.iter().map(|axis| axis.iter().zip(&features).map(|(w, f)| w * f).sum()).collect()
    }

    pub(super) fn check(&self, channels: usize) -> Result<(), LocatorFault> {
        self.features.check(channels)?;
        for axis in &self.axes {
            LocatorFault::check_count("numbers of an axis", self.features.len(), axis.len())?;
            LocatorFault::check_numbers("axis", axis.iter().copied(), |_| true, "a finite number")?;
        }
        Ok(())
    }
}
