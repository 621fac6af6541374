//! What a trainer is shown: scaled inputs and coded targets.

/// Training patterns, already scaled and coded.
#[derive(Clone, Debug, PartialEq)]
pub struct Patterns {
    /// Inputs of a pattern.
    pub inputs: usize,
    /// Outputs of a pattern.
    pub outputs: usize,
    /// Inputs, pattern by pattern.
    pub input_values: Vec<f64>,
    /// Targets, pattern by pattern.
    pub target_values: Vec<f64>,
}

impl Patterns {
    /// The largest number of patterns that the presentation order can number.
    pub const MOST: usize = 1 << 16;

    /// Number of patterns.
    pub fn count(&self) -> usize {
        self.target_values.len() / self.outputs.max(1)
    }

    /// The inputs of pattern `p`.
    pub fn input(&self, p: usize) -> &[f64] {
        &self.input_values[p * self.inputs..][..self.inputs]
    }

    /// The targets of pattern `p`.
    pub fn target(&self, p: usize) -> &[f64] {
        &self.target_values[p * self.outputs..][..self.outputs]
    }
}
