//! The forward pass of one network over many readings, one reading a lane and G registers in step.
//!
//! It is a pass by itself because a reading takes a seventh of the time that it takes alone ([`super::PreparedNetwork`]): no reading waits for
//! another, and all lanes are busy. A node's G sums are taken together and activated while they are in registers, so that in every layer,
//! whatever its width, G chains of multiply-adds run side by side and none is waited for.
//!
//! What bounds it: the two vector units. Of their slots in the paper's shape, for sixteen readings, 90 are multiply-adds, 150 the eleven
//! logistic functions, and 24 turn readings into columns. AVX-512 needs about twice these slots' time; without the divisions, which wait for
//! all that comes before them, it would need an eighth less.

use super::Topology;
use super::logistic::activate_block;
use palpate_core::BufferMismatch;
use palpate_numerics::simd::{InstructionSet, Kernel, Simd, Vector};

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

    /// The outputs for many inputs, both row by row, one row a lane of `set`. With weights of size 1 the outputs are those of
    /// [`palpate_core::Network::forward_into`] to within 2·10⁻⁶.
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
        set.run(Pass { network: self, inputs, outputs });
        Ok(())
    }
}

fn check(needed: usize, found: usize) -> Result<(), BufferMismatch> {
    if needed == found { Ok(()) } else { Err(BufferMismatch { needed, found }) }
}

/// Readings side by side.
const LANES: usize = 16;

/// Readings through a network, both they and its outputs reading by reading.
struct Pass<'a> {
    network: &'a BatchNetwork,
    inputs: &'a [f32],
    outputs: &'a mut [f32],
}

impl Kernel for Pass<'_> {
    type Output = ();
    const FUSED: bool = true;

    /// G registers of readings at a time, and what is left over one at a time.
    #[inline(always)]
    fn run<S: Simd>(self) {
        let Self { network, inputs, outputs } = self;
        let (width, out) = (network.topology.inputs(), network.topology.outputs());
        let group = LANES * if S::REGISTERS >= 32 { 8 } else { 4 };
        let groups = inputs.len() / (group * width).max(1);
        let (inputs, last_inputs) = inputs.split_at(groups * group * width);
        let (outputs, last_outputs) = outputs.split_at_mut(groups * group * out);
        let whole = Pass { network, inputs, outputs };
        if const { S::REGISTERS >= 32 } {
            whole.run_groups::<S::F32, 8>();
        } else {
            whole.run_groups::<S::F32, 4>();
        }
        Pass { network, inputs: last_inputs, outputs: last_outputs }.run_groups::<S::F32, 1>();
    }
}

impl Pass<'_> {
    #[inline(always)]
    fn run_groups<V: Vector<LANES, Real = f32>, const G: usize>(self) {
        let topology = &self.network.topology;
        let (inputs, out) = (topology.inputs(), topology.outputs());
        let widest = topology.sizes.iter().copied().max().unwrap_or(0);
        let mut from = vec![[V::splat(0.0); G]; widest];
        let mut to = from.clone();
        let readings = self.inputs.chunks((G * LANES * inputs).max(1));
        for (readings, outputs) in readings.zip(self.outputs.chunks_mut((G * LANES * out).max(1))) {
            for (g, readings) in readings.chunks(LANES * inputs).enumerate() {
                load(readings, g, &mut from[..inputs]);
            }
            pass(self.network, &mut from, &mut to);
            for (g, outputs) in outputs.chunks_mut(LANES * out).enumerate() {
                store(&from[..out], g, outputs);
            }
        }
    }
}

/// Turns sixteen readings, or fewer, into register `g` of every input.
#[inline(always)]
fn load<V: Vector<LANES, Real = f32>, const G: usize>(readings: &[f32], g: usize, to: &mut [[V; G]]) {
    let inputs = to.len();
    if let (8, ([rows], [])) = (inputs, readings.as_chunks::<8>().0.as_chunks::<LANES>()) {
        for (column, registers) in V::transpose(rows).into_iter().zip(to) {
            registers[g] = column;
        }
        return;
    }
    for (input, registers) in to.iter_mut().enumerate() {
        let mut lanes = [0.0; LANES];
        for (lane, reading) in lanes.iter_mut().zip(readings.chunks_exact(inputs)) {
            *lane = reading[input];
        }
        registers[g] = V::load(&lanes);
    }
}

/// Turns register `g` of every output into the outputs of sixteen readings, or of as many as there is room for.
#[inline(always)]
fn store<V: Vector<LANES, Real = f32>, const G: usize>(from: &[[V; G]], g: usize, outputs: &mut [f32]) {
    if let ([registers], [lanes]) = (from, outputs.as_chunks_mut::<LANES>().0) {
        *lanes = registers[g].to_array();
        return;
    }
    for (k, registers) in from.iter().enumerate() {
        let places = outputs.iter_mut().skip(k).step_by(from.len());
        places.zip(registers[g].to_array()).for_each(|(output, lane)| *output = lane);
    }
}

/// Sends `from` through every layer and back into `from`.
#[inline(always)]
fn pass<V: Vector<LANES, Real = f32>, const G: usize>(
    network: &BatchNetwork,
    from: &mut Vec<[V; G]>,
    to: &mut Vec<[V; G]>,
) {
    let topology = &network.topology;
    let mut weights = &network.weights[..];
    for layer in 0..topology.layers() {
        let row_len = topology.row_len(layer);
        let (rows, rest) = weights.split_at(topology.rows(layer) * row_len);
        weights = rest;
        for (row, a) in rows.chunks_exact(row_len).zip(to.iter_mut()) {
            let (row, bias) = row.split_at(topology.sizes[layer]);
            let mut sums = [V::splat(bias.first().copied().unwrap_or(0.0)); G];
            for (w, x) in row.iter().zip(from.iter()) {
                let w = V::splat(*w);
                for g in 0..G {
                    sums[g] = w.mul_add(x[g], sums[g]);
                }
            }
            activate_block(topology.activation(layer), &mut sums);
            *a = sums;
        }
        std::mem::swap(from, to);
    }
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
