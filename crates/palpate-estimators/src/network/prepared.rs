//! A network laid out for one reading at a time.

use super::Topology;
use super::lanes::{Layer, forward_one};
use palpate_core::BufferMismatch;

/// A network in double precision whose weights lie in columns, as vector units want them. With weights of size 1 its outputs are those of
/// [`palpate_core::Network::forward_into`] to within 10⁻¹⁴.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedNetwork {
    layers: Vec<Layer>,
    inputs: usize,
    outputs: usize,
}

impl PreparedNetwork {
    /// Takes a network's shape and its weights, in the order that [`Topology`] states; `None` when the shape has fewer than two layers or
    /// one without nodes, or when there are not as many weights as it asks for.
    pub fn new(topology: &Topology, weights: &[f64]) -> Option<Self> {
        let usable = topology.layers() > 0 && !topology.sizes.contains(&0);
        if !usable || topology.checked_weight_count() != Some(weights.len()) {
            return None;
        }
        let (inputs, outputs) = (topology.inputs(), topology.outputs());
        Some(Self { layers: Layer::all(topology, weights), inputs, outputs })
    }

    /// a = f(W x + b), layer by layer, from scaled inputs to outputs.
    ///
    /// # Errors
    /// [`BufferMismatch`] when `inputs` or `outputs` have another length than the network asks for.
    pub fn forward_into(&self, inputs: &[f64], outputs: &mut [f64]) -> Result<(), BufferMismatch> {
        check(self.inputs, inputs.len())?;
        check(self.outputs, outputs.len())?;
        forward_one(&self.layers, inputs, outputs);
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
    use crate::network::lanes::forward_one_portable;
    use Activation::{Linear, Logistic, Tanh};

    fn topology(sizes: &[usize], biases: bool, activations: (Activation, Activation)) -> Topology {
        let (hidden_activation, output_activation) = activations;
        Topology { sizes: sizes.to_vec(), biases, hidden_activation, output_activation }
    }

    fn weights(topology: &Topology) -> Vec<f64> {
        (0..topology.weight_count()).map(|k| (k as f64 * 1.3).sin()).collect()
    }

    /// The pass of `palpate-core`.
    fn core(topology: &Topology, weights: &[f64], inputs: &[f64]) -> Vec<f64> {
        let network = palpate_core::Network {
            sizes: &topology.sizes,
            biases: topology.biases,
            hidden_activation: topology.hidden_activation,
            output_activation: topology.output_activation,
            weights,
        };
        let mut outputs = vec![0.0; topology.outputs()];
        network.forward_into(inputs, &mut outputs, &mut vec![0.0; network.scratch_len()]).unwrap();
        outputs
    }

    #[test]
    fn this_machine_and_its_portable_twin_give_the_pass_of_the_core() {
        for sizes in [&[8, 10, 1][..], &[7, 3, 2], &[2, 1], &[3, 4, 5, 6], &[1, 33, 40, 2], &[9, 64, 1]] {
            for activations in [(Logistic, Logistic), (Tanh, Logistic), (Logistic, Linear)] {
                for biases in [true, false] {
                    let topology = topology(sizes, biases, activations);
                    let weights = weights(&topology);
                    let prepared = PreparedNetwork::new(&topology, &weights).unwrap();
                    for reading in 0..50 {
                        let x: Vec<f64> =
                            (0..sizes[0]).map(|i| ((reading * 8 + i) as f64 * 0.37).cos()).collect();
                        let expected = core(&topology, &weights, &x);
                        let [mut found, mut twin] = [vec![0.0; expected.len()], vec![0.0; expected.len()]];
                        prepared.forward_into(&x, &mut found).unwrap();
                        forward_one_portable(&prepared.layers, &x, &mut twin);
                        for ((found, twin), expected) in found.iter().zip(&twin).zip(expected) {
                            assert!((found - expected).abs() < 1e-14, "{topology:?}: {found}, {expected}");
                            assert!((twin - expected).abs() < 1e-14, "{topology:?}: {twin}, {expected}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn inputs_without_bounds_and_without_values_go_through() {
        let topology = topology(&[1, 1], false, (Logistic, Logistic));
        let prepared = PreparedNetwork::new(&topology, &[1.0]).unwrap();
        for x in [1e3, 1e30, f64::MAX, f64::INFINITY, f64::NAN] {
            let [mut low, mut high] = [[0.5], [0.5]];
            prepared.forward_into(&[-x], &mut low).unwrap();
            prepared.forward_into(&[x], &mut high).unwrap();
            if x.is_nan() {
                assert!(low[0].is_nan() && high[0].is_nan());
            } else {
                assert!((0.0..1e-300).contains(&low[0]) && high[0] == 1.0, "{x}: {low:?}, {high:?}");
            }
        }
    }

    #[test]
    fn shapes_and_buffers_that_do_not_fit_are_refused() {
        let activations = (Logistic, Logistic);
        let shape = |sizes: &[usize]| topology(sizes, true, activations);
        assert_eq!(PreparedNetwork::new(&shape(&[3, 2]), &[0.0; 7]), None);
        assert_eq!(PreparedNetwork::new(&shape(&[3]), &[]), None);
        assert_eq!(PreparedNetwork::new(&shape(&[]), &[]), None);
        assert_eq!(PreparedNetwork::new(&shape(&[3, 0]), &[]), None);
        assert_eq!(PreparedNetwork::new(&shape(&[usize::MAX, 2]), &[]), None);
        let prepared = PreparedNetwork::new(&shape(&[3, 2]), &[0.0; 8]).unwrap();
        assert_eq!(prepared.forward_into(&[0.0; 3], &mut [0.0; 2]), Ok(()));
        assert!(prepared.forward_into(&[0.0; 2], &mut [0.0; 2]).is_err());
        assert!(prepared.forward_into(&[0.0; 3], &mut [0.0; 3]).is_err());
    }
}
