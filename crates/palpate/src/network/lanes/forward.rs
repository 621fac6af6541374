//! The forward pass of one network over many readings, one reading a lane.
//!
//! What bounds it: eleven polynomials and six divisions a reading group in the paper's shape, on top of 90 multiply-adds whose weights come
//! straight from memory as broadcast operands.

use super::{Lanes, Real, activate};
use crate::network::Topology;

/// A network in the numbers of the lanes, and what goes through it.
pub(crate) struct Batch<'a, R> {
    pub(crate) topology: &'a Topology,
    pub(crate) weights: &'a [R],
    /// Reading by reading.
    pub(crate) inputs: &'a [R],
}

/// Outputs of every reading, reading by reading.
#[inline(always)]
pub(super) fn run<V: Lanes<N>, const N: usize>(batch: &Batch<V::Real>, outputs: &mut [V::Real]) {
    let topology = batch.topology;
    if topology.layers() == 2 && topology.sizes == [8, 10, 1] && topology.biases {
        run_shape::<V, N, 8, 10>(batch, outputs);
    } else {
        run_shape::<V, N, ANY, ANY>(batch, outputs);
    }
}

/// Stands for a number of inputs that is known only when the program runs.
const ANY: usize = 0;

#[inline(always)]
fn known_or<const KNOWN: usize>(count: usize) -> usize {
    if KNOWN == ANY { count } else { KNOWN }
}

/// [`run`] for `FIRST` inputs of the first layer and `UPPER` of every other.
#[inline(always)]
fn run_shape<V: Lanes<N>, const N: usize, const FIRST: usize, const UPPER: usize>(
    batch: &Batch<V::Real>,
    outputs: &mut [V::Real],
) {
    let (inputs, out) = (known_or::<FIRST>(batch.topology.inputs()), batch.topology.outputs());
    let zero = V::Real::from_f64(0.0);
    let widest = batch.topology.sizes.iter().copied().max().unwrap_or(0);
    let mut from = vec![V::splat(zero); widest];
    let mut to = from.clone();
    let mut padded = vec![zero; inputs * N];
    for (readings, outputs) in batch.inputs.chunks(inputs * N).zip(outputs.chunks_mut(out * N)) {
        if readings.len() == inputs * N {
            load(readings, inputs, &mut from);
        } else {
            padded[..readings.len()].copy_from_slice(readings);
            load(&padded, inputs, &mut from);
        }
        pass::<V, N, FIRST, UPPER>(batch, &mut from, &mut to);
        for (k, values) in from[..out].iter().enumerate() {
            let lanes = values.to_array();
            outputs.iter_mut().skip(k).step_by(out).zip(lanes).for_each(|(output, lane)| *output = lane);
        }
    }
}

/// Turns N readings into one register an input.
#[inline(always)]
fn load<V: Lanes<N>, const N: usize>(readings: &[V::Real], inputs: usize, to: &mut [V]) {
    let readings = &readings[..inputs * N];
    for (input, register) in to[..inputs].iter_mut().enumerate() {
        let mut lanes = [V::Real::from_f64(0.0); N];
        for (lane, value) in lanes.iter_mut().enumerate() {
            *value = readings[lane * inputs + input];
        }
        *register = V::from_array(lanes);
    }
}

/// Sends `from` through every layer and back into `from`.
#[inline(always)]
fn pass<V: Lanes<N>, const N: usize, const FIRST: usize, const UPPER: usize>(
    batch: &Batch<V::Real>,
    from: &mut Vec<V>,
    to: &mut Vec<V>,
) {
    let topology = batch.topology;
    let mut weights = batch.weights;
    for layer in 0..topology.layers() {
        let size = topology.sizes[layer];
        let inputs = if layer == 0 { known_or::<FIRST>(size) } else { known_or::<UPPER>(size) };
        let row_len = inputs + usize::from(topology.biases);
        let (rows, rest) = weights.split_at(topology.rows(layer) * row_len);
        weights = rest;
        let x = &from[..inputs];
        for (row, z) in rows.chunks_exact(row_len).zip(to.iter_mut()) {
            let bias = if topology.biases { row[inputs] } else { V::Real::from_f64(0.0) };
            let mut sum = V::splat(bias);
            for (w, x) in row[..inputs].iter().zip(x) {
                sum = x.mul_add(V::splat(*w), sum);
            }
            *z = sum;
        }
        activate(topology.activation(layer), &mut to[..topology.rows(layer)]);
        std::mem::swap(from, to);
    }
}
