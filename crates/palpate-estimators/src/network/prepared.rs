//! Forward pass of one network, four nodes per register.
//!
//! Latency bounds the pass, hence fused multiply-adds, a rational 2^r and registers of four.

use super::{Activation, Topology};
use palpate_core::{BufferMismatch, Logistic};
use palpate_numerics::simd::{Kernel, Real, Simd, Vector, run_loops};

/// Network with weights in columns. Outputs equal [`palpate_core::Network::forward_into`] within 10⁻¹⁴.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedNetwork {
    layers: Vec<Layer>,
    inputs: usize,
    outputs: usize,
}

impl PreparedNetwork {
    /// Prepares weights in the order of [`Topology`]; `None` for an invalid topology or number of weights.
    pub fn new(topology: &Topology, weights: &[f64]) -> Option<Self> {
        let usable = topology.layers() > 0 && !topology.sizes.contains(&0);
        if !usable || topology.checked_weight_count() != Some(weights.len()) {
            return None;
        }
        let (inputs, outputs) = (topology.inputs(), topology.outputs());
        Some(Self { layers: Layer::all(topology, weights), inputs, outputs })
    }

    /// Computes a = f(W x + b) by layer.
    ///
    /// # Errors
    /// [`BufferMismatch`] for a wrong length.
    pub fn forward_into(&self, inputs: &[f64], outputs: &mut [f64]) -> Result<(), BufferMismatch> {
        check(self.inputs, inputs.len())?;
        check(self.outputs, outputs.len())?;
        run_loops(Pass { layers: &self.layers, inputs, outputs });
        Ok(())
    }
}

fn check(needed: usize, found: usize) -> Result<(), BufferMismatch> {
    if needed == found { Ok(()) } else { Err(BufferMismatch { needed, found }) }
}

type FourLanes = [f64; 4];

/// Aligned, so that no column crosses a cache line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
struct Column(FourLanes);

#[derive(Clone, Debug, PartialEq)]
struct Layer {
    activation: Activation,
    inputs: usize,
    nodes: usize,
    /// Missing nodes have weights of 0.
    columns: Vec<Column>,
}

impl Layer {
    fn all(topology: &Topology, mut weights: &[f64]) -> Vec<Self> {
        let mut layers = Vec::with_capacity(topology.layers());
        for k in 0..topology.layers() {
            let (inputs, nodes, row_len) = (topology.sizes[k], topology.rows(k), topology.row_len(k));
            let (rows, rest) = weights.split_at(nodes * row_len);
            weights = rest;
            let mut columns = vec![Column([0.0; 4]); nodes.div_ceil(4) * (inputs + 1)];
            for (i, weight) in rows.iter().enumerate() {
                let (node, input) = (i / row_len, i % row_len);
                columns[node / 4 * (inputs + 1) + input].0[node % 4] = *weight;
            }
            layers.push(Self { activation: topology.activation(k), inputs, nodes, columns });
        }
        layers
    }

    fn is(&self, inputs: usize, nodes: usize) -> bool {
        (self.inputs, self.nodes) == (inputs, nodes)
    }

    fn registers(&self) -> usize {
        self.nodes.div_ceil(4)
    }
}

/// Size known only at run time.
const ANY: usize = 0;

#[inline(always)]
fn known_or<const KNOWN: usize>(count: usize) -> usize {
    if KNOWN == ANY { count } else { KNOWN }
}

const FEW_REGISTERS: usize = 8;

struct Pass<'a> {
    layers: &'a [Layer],
    inputs: &'a [f64],
    outputs: &'a mut [f64],
}

impl Kernel for Pass<'_> {
    type Output = ();
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) {
        run::<S::Array<f64, 4>>(self.layers, self.inputs, self.outputs);
    }
}

#[inline(always)]
fn run<V: Vector<4, Real = f64>>(layers: &[Layer], inputs: &[f64], outputs: &mut [f64]) {
    // The paper's shape: unrolled loops let more of the next reading into the machine's window.
    if let [first, last] = layers
        && first.is(8, 10)
        && last.is(10, 1)
    {
        let (mut hidden, mut output) = ([[0.0; 4]; 3], [[0.0; 4]; 1]);
        pass::<V, 8, 10>(first, inputs, &mut hidden);
        pass::<V, 10, 1>(last, hidden.as_flattened(), &mut output);
        outputs.copy_from_slice(&output.as_flattened()[..1]);
        return;
    }
    let registers = layers.iter().map(Layer::registers).max().unwrap_or(0);
    if registers <= FEW_REGISTERS {
        let (from, to) = (&mut [[0.0; 4]; FEW_REGISTERS], &mut [[0.0; 4]; FEW_REGISTERS]);
        run_any::<V>(layers, inputs, outputs, from, to);
    } else {
        let (mut from, mut to) = (vec![[0.0; 4]; registers], vec![[0.0; 4]; registers]);
        run_any::<V>(layers, inputs, outputs, &mut from, &mut to);
    }
}

#[inline(always)]
fn run_any<'a, V: Vector<4, Real = f64>>(
    layers: &[Layer],
    inputs: &[f64],
    outputs: &mut [f64],
    mut from: &'a mut [FourLanes],
    mut to: &'a mut [FourLanes],
) {
    for (k, layer) in layers.iter().enumerate() {
        pass::<V, ANY, ANY>(layer, if k == 0 { inputs } else { from.as_flattened() }, to);
        std::mem::swap(&mut from, &mut to);
    }
    outputs.copy_from_slice(&from.as_flattened()[..outputs.len()]);
}

/// a = f(W x + b)
#[inline(always)]
fn pass<V: Vector<4, Real = f64>, const INPUTS: usize, const NODES: usize>(
    layer: &Layer,
    x: &[f64],
    a: &mut [FourLanes],
) {
    let (inputs, nodes) = (known_or::<INPUTS>(layer.inputs), known_or::<NODES>(layer.nodes));
    let (x, a) = (&x[..inputs], &mut a[..nodes.div_ceil(4)]);
    let columns = &layer.columns[..a.len() * (inputs + 1)];
    let activation = layer.activation;
    for (columns, a) in columns.chunks_exact(inputs + 1).zip(a.iter_mut()) {
        let z = weighted_sums::<V>(columns, x);
        *a = if activation == Activation::Logistic { logistic(z) } else { z }.to_array();
    }
    if activation != Activation::Logistic {
        activation.apply_all(&mut a.as_flattened_mut()[..nodes]);
    }
}

/// Four independent sums, input i in sum i modulo 4.
#[inline(always)]
fn weighted_sums<V: Vector<4, Real = f64>>(columns: &[Column], x: &[f64]) -> V {
    let (columns, biases) = columns.split_at(x.len());
    let zero = V::splat(0.0);
    let mut sums = [V::load(&biases[0].0), zero, zero, zero];
    let add = |sum: &mut V, w: &Column, x: &f64| *sum = V::load(&w.0).mul_add(V::splat(*x), *sum);
    let ((fours, last), (x_fours, last_x)) = (columns.as_chunks::<4>(), x.as_chunks::<4>());
    for (w, x) in fours.iter().zip(x_fours) {
        for k in 0..4 {
            add(&mut sums[k], &w[k], &x[k]);
        }
    }
    for ((sum, w), x) in sums.iter_mut().zip(last).zip(last_x) {
        add(sum, w, x);
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// The bound is the first operand of a comparison, which returns the second for NaN.
#[inline(always)]
fn logistic<V: Vector<4, Real = f64>>(z: V) -> V {
    let ([e0, e1, e2], [o0, o1]) = (Logistic::EVEN.map(V::splat), Logistic::ODD.map(V::splat));
    let (rounder, to_binary) = (V::splat(<f64 as Real>::ROUNDER), V::splat(-std::f64::consts::LOG2_E));
    let z = V::splat(-Logistic::END).max(V::splat(Logistic::END).min(z));
    let shifted = z.mul_add(to_binary, rounder);
    let r = z.mul_sub(to_binary, shifted - rounder);
    let u = r * r;
    let (even, odd) = (u.mul_add(u.mul_add(e2, e1), e0), u.mul_add(u + o1, o0));
    let (below, above) = (even - r * odd, r.mul_add(odd, even));
    below / shifted.power_of_two().mul_add(above, below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use Activation::{Linear, Logistic, Tanh};
    use palpate_numerics::simd::Array;

    fn topology(sizes: &[usize], biases: bool, activations: (Activation, Activation)) -> Topology {
        let (hidden_activation, output_activation) = activations;
        Topology { sizes: sizes.to_vec(), biases, hidden_activation, output_activation }
    }

    fn weights(topology: &Topology) -> Vec<f64> {
        (0..topology.weight_count()).map(|k| (k as f64 * 1.3).sin()).collect()
    }

    fn core(topology: &Topology, weights: &[f64], inputs: &[f64]) -> Vec<f64> {
        let network = topology.network(weights);
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
                        run::<Array<f64, 4, false>>(&prepared.layers, &x, &mut twin);
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
