//! What a rig's `[estimator] kind = "network"` says: topology, coding and training of a network.

use super::{Activation, Precision};

/// A feed-forward network and how it is trained. The default is the founding paper's: one hidden layer of ten
/// logistic nodes, a logistic output, and back-propagation with learning rate 0.7 and momentum 0.9.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Nodes of each hidden layer, input side first.
    pub hidden: Vec<usize>,
    /// Activation of every hidden layer.
    pub hidden_activation: Activation,
    /// Activation of the output layer.
    pub output_activation: Activation,
    /// Whether every node has a bias.
    pub biases: bool,
    /// What the output stands for.
    pub output: OutputCoding,
    /// How readings become inputs.
    pub input_scale: InputScale,
    /// How the weights are found.
    pub training: BackPropagation,
    /// The arithmetic of training; estimates are made in 64 bits whatever it is.
    pub precision: Precision,
}

impl Default for Network {
    fn default() -> Self {
        Self {
            hidden: vec![10],
            hidden_activation: Activation::Logistic,
            output_activation: Activation::Logistic,
            biases: true,
            output: OutputCoding::Normalized,
            input_scale: InputScale::FullScale,
            training: BackPropagation::default(),
            precision: Precision::F64,
        }
    }
}

/// What the network's output stands for (paper, section 2.3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutputCoding {
    /// The contact position in metres; a logistic output can overshoot a surface shorter than 1 m.
    Position,
    /// The contact position divided by the surface's length.
    Normalized,
}

/// How readings become network inputs. The paper does not say; the choice decides how fast and how well it trains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputScale {
    /// Each sensor kind divided by the largest reading that the contact force can cause anywhere on the surface; for
    /// a surface without a model, by the largest magnitude in the training recording.
    FullScale,
    /// Each channel shifted to mean 0 and divided by its standard deviation over the training recording.
    Standardized,
    /// Every channel divided by this reading, in the SI unit of the sensors (m, rad, 1, N) or raw.
    DivideBy(f64),
}

/// Back-propagation with momentum, one weight update a pattern (Rumelhart, Hinton and Williams 1986).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BackPropagation {
    /// η, the step along the gradient; greater than 0.
    pub learning_rate: f64,
    /// α, the share of the previous step that is repeated; 0 ≤ α < 1.
    pub momentum: f64,
    /// Training converges when the sum of squared output errors over one epoch is at most this.
    pub aggregate_error: f64,
    /// Training is capped after this many epochs.
    pub max_epochs: u32,
    /// In which order the patterns are presented.
    pub order: PresentationOrder,
    /// Weights start uniform within ± this.
    pub initial_weights: f64,
}

impl Default for BackPropagation {
    fn default() -> Self {
        Self {
            learning_rate: 0.7,
            momentum: 0.9,
            aggregate_error: 1e-5,
            max_epochs: 1_000_000,
            order: PresentationOrder::Shuffled,
            initial_weights: 0.5,
        }
    }
}

/// The order in which an epoch presents the patterns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PresentationOrder {
    /// A fresh random permutation every epoch.
    Shuffled,
    /// As recorded, every epoch alike.
    Fixed,
}
