//! A fitted network: scaling, weights and coding, all that a reading needs to become a position.

use super::{Topology, TrainingOutcome};
use crate::contact::Position;
use crate::mechanics::Extent;

/// How a channel's reading r becomes an input: (r − offset) / divisor.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelScaling {
    /// In the channel's SI unit, or raw.
    pub offset: f64,
    /// In the channel's SI unit, or raw; greater than 0.
    pub divisor: f64,
}

impl ChannelScaling {
    /// The input for a reading.
    pub fn apply(self, reading: f64) -> f64 {
        (reading - self.offset) / self.divisor
    }
}

/// A network that locates.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkLocator {
    /// Its shape.
    pub topology: Topology,
    /// Its weights, in the order that [`Topology`] states.
    pub weights: Vec<f64>,
    /// Scaling of each channel.
    pub scaling: Vec<ChannelScaling>,
    /// The length in metres that an output of 1 stands for, by coordinate.
    pub output_scale_m: Vec<f64>,
    /// The surface.
    pub extent: Extent,
    /// How its training ended.
    pub outcome: TrainingOutcome,
}

/// A network locator whose numbers do not fit together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NetworkLocatorError {
    /// A list has the wrong length.
    #[error("the network has {found} {what}; its layers ask for {needed}")]
    Count {
        /// What the list holds.
        what: &'static str,
        /// Length that the topology asks for.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// A layer without nodes, or no layer at all.
    #[error("the network's layers are not at least 2, each with at least 1 node")]
    EmptyLayer,
    /// A number that is infinite or not a number, or a scale that is not greater than 0.
    #[error("the network's {what} number {number} is not a usable number")]
    BadNumber {
        /// What the list holds.
        what: &'static str,
        /// Which one, from 1.
        number: usize,
    },
}

impl NetworkLocator {
    /// Checks what a file may have got wrong, for locators of `channels` channels.
    ///
    /// # Errors
    /// [`NetworkLocatorError`], naming the list.
    pub fn check(&self, channels: usize) -> Result<(), NetworkLocatorError> {
        let sizes = &self.topology.sizes;
        if sizes.len() < 2 || sizes.contains(&0) {
            return Err(NetworkLocatorError::EmptyLayer);
        }
        let count = |what, needed, found| {
            if needed == found { Ok(()) } else { Err(NetworkLocatorError::Count { what, needed, found }) }
        };
        count("inputs", channels, self.topology.inputs())?;
        count("channel scalings", channels, self.scaling.len())?;
        count("output scales", self.topology.outputs(), self.output_scale_m.len())?;
        count("outputs", 1 + usize::from(self.extent.width_m.is_some()), self.topology.outputs())?;
        let weights = sizes.windows(2).try_fold(0usize, |sum, pair| {
            pair[1].checked_mul(pair[0].checked_add(usize::from(self.topology.biases))?)?.checked_add(sum)
        });
        count("weights", weights.unwrap_or(usize::MAX), self.weights.len())?;
        usable("weight", self.weights.iter().map(|w| w.is_finite()))?;
        let scaled = |s: &ChannelScaling| s.offset.is_finite() && s.divisor.is_finite() && s.divisor > 0.0;
        usable("scaling", self.scaling.iter().map(scaled))?;
        usable("output scale", self.output_scale_m.iter().map(|s| s.is_finite() && *s > 0.0))
    }

    /// The position for a reading of as many channels as the network has inputs; elsewhere `None`.
    pub fn position(&self, reading: &[f64]) -> Option<Position> {
        let topology = &self.topology;
        let network = palpate_core::Network {
            sizes: &topology.sizes,
            biases: topology.biases,
            hidden_activation: topology.hidden_activation,
            output_activation: topology.output_activation,
            weights: &self.weights,
        };
        let inputs: Vec<f64> = reading.iter().zip(&self.scaling).map(|(r, s)| s.apply(*r)).collect();
        let mut outputs = vec![0.0; topology.outputs()];
        network.forward_into(&inputs, &mut outputs, &mut vec![0.0; network.scratch_len()]).ok()?;
        let mut coordinates = outputs.iter().zip(&self.output_scale_m).map(|(a, scale)| a * scale);
        Some(Position { x_m: coordinates.next()?, y_m: coordinates.next().unwrap_or(0.0) })
    }
}

fn usable(what: &'static str, mut ok: impl Iterator<Item = bool>) -> Result<(), NetworkLocatorError> {
    match ok.position(|ok| !ok) {
        Some(i) => Err(NetworkLocatorError::BadNumber { what, number: i + 1 }),
        None => Ok(()),
    }
}
