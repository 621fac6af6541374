//! Forward pass of a fully connected network, without allocation.

use crate::Activation;

/// A trained network that borrows its weights.
#[derive(Clone, Copy, Debug)]
pub struct Network<'a> {
    /// Nodes of every layer, inputs first.
    pub sizes: &'a [usize],
    /// True if every node has a bias.
    pub biases: bool,
    /// Activation of the hidden layers.
    pub hidden_activation: Activation,
    /// Activation of the output layer.
    pub output_activation: Activation,
    /// Layer by layer, node by node: one weight per input, then the bias.
    pub weights: &'a [f64],
}

/// A buffer of the wrong length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferMismatch {
    /// Required length.
    pub needed: usize,
    /// Actual length.
    pub found: usize,
}

impl Network<'_> {
    /// Number of weights for `sizes`.
    pub fn weight_count(&self) -> usize {
        self.sizes.windows(2).map(|pair| pair[1] * (pair[0] + usize::from(self.biases))).sum()
    }

    /// Length of scratch for [`Network::forward_into`].
    pub fn scratch_len(&self) -> usize {
        2 * self.sizes.iter().copied().max().unwrap_or(0)
    }

    /// Computes a = f(W x + b) layer by layer.
    ///
    /// # Errors
    /// [`BufferMismatch`]; `scratch` may be longer than required.
    pub fn forward_into(
        &self,
        inputs: &[f64],
        outputs: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<(), BufferMismatch> {
        check(self.sizes.first().copied().unwrap_or(0), inputs.len())?;
        check(self.sizes.last().copied().unwrap_or(0), outputs.len())?;
        check(self.weight_count(), self.weights.len())?;
        let widest = self.scratch_len() / 2;
        if scratch.len() < 2 * widest {
            return Err(BufferMismatch { needed: 2 * widest, found: scratch.len() });
        }
        let (mut from, mut to) = scratch.split_at_mut(widest);
        from[..inputs.len()].copy_from_slice(inputs);
        let mut weights = self.weights;
        let layers = self.sizes.len().saturating_sub(1);
        for (layer, pair) in self.sizes.windows(2).enumerate() {
            let last = layer + 1 == layers;
            let activation = if last { self.output_activation } else { self.hidden_activation };
            for node in &mut to[..pair[1]] {
                let (row, rest) = weights.split_at(pair[0] + usize::from(self.biases));
                weights = rest;
                let bias = if self.biases { row[pair[0]] } else { 0.0 };
                *node = dot(&row[..pair[0]], &from[..pair[0]]) + bias;
            }
            activation.apply_all(&mut to[..pair[1]]);
            core::mem::swap(&mut from, &mut to);
        }
        outputs.copy_from_slice(&from[..outputs.len()]);
        Ok(())
    }
}

fn dot(weights: &[f64], inputs: &[f64]) -> f64 {
    let ((weights, last_weights), (inputs, last_inputs)) =
        (weights.as_chunks::<4>(), inputs.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (w, x) in weights.iter().zip(inputs) {
        for k in 0..4 {
            sums[k] += w[k] * x[k];
        }
    }
    for ((sum, w), x) in sums.iter_mut().zip(last_weights).zip(last_inputs) {
        *sum += w * x;
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

fn check(needed: usize, found: usize) -> Result<(), BufferMismatch> {
    if needed == found { Ok(()) } else { Err(BufferMismatch { needed, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_network_by_hand() {
        let network = Network {
            sizes: &[2, 1, 1],
            biases: true,
            hidden_activation: Activation::Tanh,
            output_activation: Activation::Linear,
            weights: &[1.0, -2.0, 0.5, 3.0, 0.25],
        };
        let mut output = [0.0];
        network.forward_into(&[0.3, 0.1], &mut output, &mut [0.0; 4]).unwrap();
        assert!((output[0] - (3.0 * libm::tanh(0.6) + 0.25)).abs() < 1e-15);
    }

    #[test]
    fn buffers_that_do_not_fit_are_refused() {
        let network = Network {
            sizes: &[2, 3],
            biases: false,
            hidden_activation: Activation::Linear,
            output_activation: Activation::Logistic,
            weights: &[0.0; 6],
        };
        let scratch = &mut [0.0; 6];
        let short = network.forward_into(&[1.0], &mut [0.0; 3], scratch);
        assert_eq!(short, Err(BufferMismatch { needed: 2, found: 1 }));
        assert!(network.forward_into(&[1.0; 2], &mut [0.0; 2], scratch).is_err());
        assert!(network.forward_into(&[1.0; 2], &mut [0.0; 3], &mut [0.0; 5]).is_err());
        let thin = Network { weights: &[0.0; 5], ..network };
        assert!(thin.forward_into(&[1.0; 2], &mut [0.0; 3], scratch).is_err());
    }
}
