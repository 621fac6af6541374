//! Activation functions of a network's nodes.

/// What a node does with its weighted sum z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Activation {
    /// σ(z) = 1 / (1 + exp(−z)), between 0 and 1.
    Logistic,
    /// tanh(z), between −1 and 1.
    Tanh,
    /// z itself.
    Linear,
}

impl Activation {
    /// The node's output for the weighted sum `z`.
    pub fn apply(self, z: f64) -> f64 {
        match self {
            Self::Logistic => 1.0 / (1.0 + libm::exp(-z)),
            Self::Tanh => libm::tanh(z),
            Self::Linear => z,
        }
    }
}
