//! Many readings through one network.

use super::Topology;
use super::lanes::{Batch, InstructionSet, forward_lanes};
use palpate_core::BufferMismatch;

/// A network in single precision, ready for batches.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchNetwork {
    topology: Topology,
    weights: Vec<f32>,
}

impl BatchNetwork {
    /// Takes a network's shape and its weights, in the order that [`Topology`] states.
    ///
    /// # Errors
    /// [`BufferMismatch`] when there are not as many weights as the shape asks for.
    pub fn new(topology: &Topology, weights: &[f64]) -> Result<Self, BufferMismatch> {
        check(topology.weight_count(), weights.len())?;
        Ok(Self { topology: topology.clone(), weights: weights.iter().map(|w| *w as f32).collect() })
    }

    /// The outputs for many inputs, both row by row, one row a lane of `set`, which is replaced by the portable one where the machine does
    /// not have it. With weights of size 1 the outputs are those of [`palpate_core::Network::forward_into`] to within
    /// 2·10⁻⁶.
    ///
    /// # Errors
    /// [`BufferMismatch`] when `inputs` is no whole number of rows, or `outputs` does not hold as many.
    pub fn forward_into(
        &self,
        set: InstructionSet,
        inputs: &[f32],
        outputs: &mut [f32],
    ) -> Result<(), BufferMismatch> {
        let rows = inputs.len() / self.topology.inputs().max(1);
        check(rows * self.topology.inputs(), inputs.len())?;
        check(rows * self.topology.outputs(), outputs.len())?;
        forward_lanes(set, &Batch { topology: &self.topology, weights: &self.weights, inputs }, outputs);
        Ok(())
    }
}

fn check(needed: usize, found: usize) -> Result<(), BufferMismatch> {
    if needed == found { Ok(()) } else { Err(BufferMismatch { needed, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::Activation;

    fn compare(sizes: &[usize], biases: bool, activations: (Activation, Activation), rows: usize) {
        let (hidden_activation, output_activation) = activations;
        let topology = Topology { sizes: sizes.to_vec(), biases, hidden_activation, output_activation };
        let weights: Vec<f64> = (0..topology.weight_count()).map(|k| (k as f64 * 1.3).sin()).collect();
        let inputs: Vec<f32> = (0..rows * topology.inputs()).map(|k| (k as f32 * 0.37).cos()).collect();
        let batch = BatchNetwork::new(&topology, &weights).unwrap();
        let network =
            palpate_core::Network { sizes, biases, hidden_activation, output_activation, weights: &weights };
        for set in InstructionSet::available() {
            let mut outputs = vec![0.0; rows * topology.outputs()];
            batch.forward_into(set, &inputs, &mut outputs).unwrap();
            for row in 0..rows {
                let reading: Vec<f64> = inputs[row * topology.inputs()..][..topology.inputs()]
                    .iter()
                    .map(|x| f64::from(*x))
                    .collect();
                let mut expected = vec![0.0; topology.outputs()];
                network.forward_into(&reading, &mut expected, &mut vec![0.0; network.scratch_len()]).unwrap();
                for (k, expected) in expected.into_iter().enumerate() {
                    let found = f64::from(outputs[row * topology.outputs() + k]);
                    assert!(
                        (found - expected).abs() < 2e-6,
                        "{set}, {sizes:?}, row {row}: {found}, {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn every_instruction_set_gives_the_single_pass() {
        use Activation::{Linear, Logistic, Tanh};
        // From none to more than all the groups that any instruction set takes together, and some left over.
        for rows in [0, 1, 15, 16, 17, 100, 300] {
            compare(&[8, 10, 1], true, (Logistic, Logistic), rows);
            compare(&[8, 10, 1], false, (Tanh, Linear), rows);
            compare(&[3, 4, 5, 2], true, (Tanh, Logistic), rows);
            compare(&[2, 1], true, (Linear, Linear), rows);
        }
    }

    #[test]
    fn buffers_that_do_not_fit_are_refused() {
        let topology = Topology {
            sizes: vec![3, 2],
            biases: true,
            hidden_activation: Activation::Tanh,
            output_activation: Activation::Linear,
        };
        assert_eq!(BatchNetwork::new(&topology, &[0.0; 7]), Err(BufferMismatch { needed: 8, found: 7 }));
        let batch = BatchNetwork::new(&topology, &[0.0; 8]).unwrap();
        let set = InstructionSet::best();
        assert_eq!(batch.forward_into(set, &[0.0; 6], &mut [0.0; 4]), Ok(()));
        assert!(batch.forward_into(set, &[0.0; 7], &mut [0.0; 4]).is_err());
        assert!(batch.forward_into(set, &[0.0; 6], &mut [0.0; 5]).is_err());
    }
}
