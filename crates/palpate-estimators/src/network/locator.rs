//! A fitted network: scaling, weights and coding, all that a reading needs to become a position.

use super::{PreparedNetwork, Topology, TrainingOutcome};
use crate::fit::{Locate, LocatorFault};
use crate::setup::Setup;
use palpate_core::{Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

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

/// What training a network gives, and what a locator file holds of it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkParts {
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

/// A network that locates.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(from = "NetworkParts", into = "NetworkParts")]
pub struct NetworkLocator {
    parts: NetworkParts,
    /// `None` where a file's numbers do not fit together, which [`Locate::check`] reports.
    network: Option<PreparedNetwork>,
}

impl From<NetworkParts> for NetworkLocator {
    fn from(parts: NetworkParts) -> Self {
        Self { network: PreparedNetwork::new(&parts.topology, &parts.weights), parts }
    }
}

impl From<NetworkLocator> for NetworkParts {
    fn from(locator: NetworkLocator) -> Self {
        locator.parts
    }
}

impl NetworkParts {
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
        let weights = self.topology.checked_weight_count();
        count("weights", weights.unwrap_or(usize::MAX), self.weights.len())?;
        let finite = "a finite number";
        LocatorFault::check_numbers("weight", self.weights.iter().copied(), |_| true, finite)?;
        let offsets = self.scaling.iter().map(|scaling| scaling.offset);
        LocatorFault::check_numbers("scaling's offset", offsets, |_| true, finite)?;
        let scales =
            self.scaling.iter().map(|scaling| scaling.divisor).chain(self.output_scale_m.iter().copied());
        LocatorFault::check_numbers("scale", scales, |scale| scale > 0.0, "greater than 0")
    }
}

/// Channels for which the inputs lie on the stack.
const FEW_CHANNELS: usize = 16;

impl NetworkLocator {
    /// What it was made from.
    pub fn parts(&self) -> &NetworkParts {
        &self.parts
    }

    /// The position for a reading of as many channels as the network has inputs; elsewhere `None`.
    pub fn position(&self, reading: &[f64]) -> Option<Position> {
        let (mut few, mut many) = ([0.0; FEW_CHANNELS], Vec::new());
        let inputs = if let Some(inputs) = few.get_mut(..reading.len()) {
            inputs
        } else {
            many.resize(reading.len(), 0.0);
            &mut many[..]
        };
        for ((input, r), scaling) in inputs.iter_mut().zip(reading).zip(&self.parts.scaling) {
            *input = scaling.apply(*r);
        }
        let mut outputs = [0.0; 2];
        let outputs = outputs.get_mut(..self.parts.topology.outputs())?;
        self.network.as_ref()?.forward_into(inputs, outputs).ok()?;
        let mut coordinates = outputs.iter().zip(&self.parts.output_scale_m).map(|(a, scale)| a * scale);
        Some(Position { x_m: coordinates.next()?, y_m: coordinates.next().unwrap_or(0.0) })
    }
}

impl Locate for NetworkLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let position = self.position(reading).unwrap_or(Position::along(f64::NAN));
        let on_surface = self.parts.extent.contains(position);
        Estimate::of_position(position, if on_surface { Status::Located } else { Status::OutsideSurface })
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.parts.check_numbers(setup.layout.len())
    }
}
