//! The forward pass of one network over one reading, four nodes a register.
//!
//! What bounds it: latency. A layer waits for the one below through four multiply-adds, the logistic function's dozen steps and its division,
//! some seventy cycles, and the machine's window holds little of the next reading meanwhile. Hence multiply-adds that round once, a
//! quotient for 2^r rather than a long polynomial, and registers of four: eight lanes would save work, which is not what is waited for.

use super::{Lanes, Real};
use crate::network::{Activation, Topology};
use palpate_core::Logistic;

/// Four numbers, one a node.
type Four = [f64; 4];

/// A layer, its weights in columns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layer {
    activation: Activation,
    inputs: usize,
    nodes: usize,
    /// For every four nodes a column an input, and the biases. Nodes that are not there weigh everything by 0.
    columns: Vec<Four>,
}

impl Layer {
    /// All layers of a network that has as many weights as `topology` asks for.
    pub(crate) fn all(topology: &Topology, mut weights: &[f64]) -> Vec<Self> {
        let mut layers = Vec::with_capacity(topology.layers());
        for k in 0..topology.layers() {
            let (inputs, nodes, row_len) = (topology.sizes[k], topology.rows(k), topology.row_len(k));
            let (rows, rest) = weights.split_at(nodes * row_len);
            weights = rest;
            let mut columns = vec![[0.0; 4]; nodes.div_ceil(4) * (inputs + 1)];
            for (i, weight) in rows.iter().enumerate() {
                let (node, input) = (i / row_len, i % row_len);
                columns[node / 4 * (inputs + 1) + input][node % 4] = *weight;
            }
            layers.push(Self { activation: topology.activation(k), inputs, nodes, columns });
        }
        layers
    }

    fn is(&self, inputs: usize, nodes: usize) -> bool {
        (self.inputs, self.nodes) == (inputs, nodes)
    }

    /// Registers that its outputs fill.
    fn registers(&self) -> usize {
        self.nodes.div_ceil(4)
    }
}

/// Stands for a number of inputs or nodes that is known only when the program runs.
const ANY: usize = 0;

#[inline(always)]
fn known_or<const KNOWN: usize>(count: usize) -> usize {
    if KNOWN == ANY { count } else { KNOWN }
}

/// Registers of the widest layer for which a layer's outputs lie on the stack: 32 nodes.
const FEW_REGISTERS: usize = 8;

/// Sends `inputs` through `layers`, of which there is at least one.
#[inline(always)]
pub(super) fn run<V: Lanes<4, Real = f64>>(layers: &[Layer], inputs: &[f64], outputs: &mut [f64]) {
    let registers = layers.iter().map(Layer::registers).max().unwrap_or(0);
    match layers {
        // The paper's: where the loops unroll, more of the next reading fits into the machine's window.
        [first, last] if first.is(8, 10) && last.is(10, 1) => {
            let (mut hidden, mut output) = ([[0.0; 4]; 3], [[0.0; 4]; 1]);
            pass::<V, 8, 10>(first, inputs, &mut hidden);
            pass::<V, 10, 1>(last, hidden.as_flattened(), &mut output);
            outputs.copy_from_slice(&output.as_flattened()[..1]);
        }
        _ if registers <= FEW_REGISTERS => {
            let (from, to) = (&mut [[0.0; 4]; FEW_REGISTERS], &mut [[0.0; 4]; FEW_REGISTERS]);
            run_any::<V>(layers, inputs, outputs, from, to);
        }
        _ => {
            let (mut from, mut to) = (vec![[0.0; 4]; registers], vec![[0.0; 4]; registers]);
            run_any::<V>(layers, inputs, outputs, &mut from, &mut to);
        }
    }
}

/// [`run`] for any shape, with room for the widest layer's outputs twice.
#[inline(always)]
fn run_any<'a, V: Lanes<4, Real = f64>>(
    layers: &[Layer],
    inputs: &[f64],
    outputs: &mut [f64],
    mut from: &'a mut [Four],
    mut to: &'a mut [Four],
) {
    for (k, layer) in layers.iter().enumerate() {
        pass::<V, ANY, ANY>(layer, if k == 0 { inputs } else { from.as_flattened() }, to);
        std::mem::swap(&mut from, &mut to);
    }
    outputs.copy_from_slice(&from.as_flattened()[..outputs.len()]);
}

/// a = f(W x + b)
#[inline(always)]
fn pass<V: Lanes<4, Real = f64>, const INPUTS: usize, const NODES: usize>(
    layer: &Layer,
    x: &[f64],
    a: &mut [Four],
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

/// Σ w·x + b in four sums, input i in sum i modulo 4, of which none waits for another.
#[inline(always)]
fn weighted_sums<V: Lanes<4, Real = f64>>(columns: &[Four], x: &[f64]) -> V {
    let (columns, biases) = columns.split_at(x.len());
    let zero = V::splat(0.0);
    let mut sums = [V::from_array(biases[0]), zero, zero, zero];
    let add = |sum: &mut V, w: &Four, x: &f64| *sum = V::from_array(*w).mul_add(V::splat(*x), *sum);
    let ((fours, last), (x_fours, last_x)) = (columns.as_chunks::<4>(), x.as_chunks::<4>());
    for (w, x) in fours.iter().zip(x_fours) {
        for k in 0..4 {
            add(&mut sums[k], &w[k], &x[k]);
        }
    }
    for ((sum, w), x) in sums.iter_mut().zip(last).zip(last_x) {
        add(sum, w, x);
    }
    sums[0].add(sums[2]).add(sums[1].add(sums[3]))
}

/// σ by [`Logistic`]. The bound comes first in a comparison, which keeps the second where it is not a number.
#[inline(always)]
fn logistic<V: Lanes<4, Real = f64>>(z: V) -> V {
    let ([e0, e1, e2], [o0, o1]) = (Logistic::EVEN.map(V::splat), Logistic::ODD.map(V::splat));
    let (rounder, to_binary) = (V::splat(<f64 as Real>::ROUNDER), V::splat(-std::f64::consts::LOG2_E));
    let z = V::splat(-Logistic::END).max(V::splat(Logistic::END).min(z));
    let shifted = z.mul_add(to_binary, rounder);
    let r = z.mul_sub(to_binary, shifted.sub(rounder));
    let u = r.mul(r);
    let (even, odd) = (u.mul_add(u.mul_add(e2, e1), e0), u.mul_add(u.add(o1), o0));
    let (below, above) = (even.sub(r.mul(odd)), r.mul_add(odd, even));
    below.div(shifted.power_of_two().mul_add(above, below))
}
