//! A fitted network: scaling, weights and coding, all that a reading needs to become a position.

use super::{Topology, TrainingOutcome};
use crate::bench::Bench;
use crate::contact::Position;
use crate::mechanics::Extent;
use crate::method::{Locate, LocatorFault};
use palpate_core::{Estimate, Status};

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

impl NetworkLocator {
    fn check_numbers(&self, channels: usize) -> Result<(), LocatorFault> {
        let sizes = &self.topology.sizes;
        let count = LocatorFault::check_count;
        if sizes.len() < 2 {
            return Err(LocatorFault::Count { what: "layers", needed: 2, found: sizes.len() });
        }
        let nodes = sizes.iter().map(|nodes| *nodes as f64);
        LocatorFault::check_numbers("layer", nodes, |nodes| nodes > 0.0, "of at least 1 node")?;
        count("inputs", channels, self.topology.inputs())?;
        count("channel scalings", channels, self.scaling.len())?;
        count("output scales", self.topology.outputs(), self.output_scale_m.len())?;
        count("outputs", 1 + usize::from(self.extent.width_m.is_some()), self.topology.outputs())?;
        let weights = sizes.windows(2).try_fold(0usize, |sum, pair| {
            pair[1].checked_mul(pair[0].checked_add(usize::from(self.topology.biases))?)?.checked_add(sum)
        });
        count("weights", weights.unwrap_or(usize::MAX), self.weights.len())?;
        let finite = "a finite number";
        LocatorFault::check_numbers("weight", self.weights.iter().copied(), |_| true, finite)?;
        let offsets = self.scaling.iter().map(|scaling| scaling.offset);
        LocatorFault::check_numbers("scaling's offset", offsets, |_| true, finite)?;
        let scales =
            self.scaling.iter().map(|scaling| scaling.divisor).chain(self.output_scale_m.iter().copied());
        LocatorFault::check_numbers("scale", scales, |scale| scale > 0.0, "greater than 0")
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

impl Locate for NetworkLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let position = self.position(reading).unwrap_or(Position::along(f64::NAN));
        let on_surface = self.extent.contains(position);
        Estimate::of_position(position, if on_surface { Status::Located } else { Status::OutsideSurface })
    }

    fn check(&self, bench: &Bench) -> Result<(), LocatorFault> {
        self.check_numbers(bench.layout.len())
    }
}
