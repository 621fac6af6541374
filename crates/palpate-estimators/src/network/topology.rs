//! The shape of a network: how many nodes each layer has and where their weights lie.

use super::{Activation, Network};

/// Layer sizes, activations and biases of a fully connected feed-forward network.
///
/// Weights are one flat list: layer by layer, node by node; a node's row holds one weight an input and, with biases,
/// the bias last, as the weight of an input that is always 1.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Topology {
    /// Nodes of every layer, inputs first and outputs last: `[8, 10, 1]` is the founding paper's.
    pub sizes: Vec<usize>,
    /// Whether every node has a bias.
    pub biases: bool,
    /// Activation of the hidden layers.
    pub hidden_activation: Activation,
    /// Activation of the output layer.
    pub output_activation: Activation,
}

impl Topology {
    /// The topology that `config` asks for between `inputs` readings and `outputs` coordinates.
    pub fn new(config: &Network, inputs: usize, outputs: usize) -> Self {
        let sizes = std::iter::once(inputs).chain(config.hidden.iter().copied()).chain([outputs]).collect();
        Self {
            sizes,
            biases: config.biases,
            hidden_activation: config.hidden_activation,
            output_activation: config.output_activation,
        }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.sizes.first().copied().unwrap_or(0)
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.sizes.last().copied().unwrap_or(0)
    }

    /// Number of layers with weights.
    pub fn layers(&self) -> usize {
        self.sizes.len().saturating_sub(1)
    }

    /// Weights of one node of weighted layer `layer` (0 is the first hidden one), its bias included.
    pub fn row_len(&self, layer: usize) -> usize {
        self.sizes[layer] + usize::from(self.biases)
    }

    /// Nodes of weighted layer `layer`.
    pub fn rows(&self, layer: usize) -> usize {
        self.sizes[layer + 1]
    }

    /// Activation of weighted layer `layer`.
    pub fn activation(&self, layer: usize) -> Activation {
        if layer + 1 == self.layers() { self.output_activation } else { self.hidden_activation }
    }

    /// Number of weights, biases included.
    pub fn weight_count(&self) -> usize {
        (0..self.layers()).map(|layer| self.rows(layer) * self.row_len(layer)).sum()
    }

    /// The same of a shape that may be nonsense: `None` when there is no such number.
    pub(crate) fn checked_weight_count(&self) -> Option<usize> {
        self.sizes.windows(2).try_fold(0usize, |sum, pair| {
            pair[1].checked_mul(pair[0].checked_add(usize::from(self.biases))?)?.checked_add(sum)
        })
    }
}
