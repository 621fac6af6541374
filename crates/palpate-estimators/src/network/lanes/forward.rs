//! The forward pass of one network over many readings, one reading a lane and G registers in step.
//!
//! A node's G sums are taken together and activated while they are in registers, so that in every layer, whatever its width, G chains of
//! multiply-adds run side by side and none is waited for.
//!
//! What bounds it: the two vector units. Of their slots in the paper's shape, for N readings, 90 are multiply-adds, 150 the eleven logistic
//! functions, and 24 turn readings into columns. AVX-512 needs about twice these slots' time; without the divisions, which wait for all
//! that comes before them, it would need an eighth less.

use super::logistic::activate_block;
use super::{Lanes, Real};
use crate::network::Topology;

/// A network in the numbers of the lanes, and what goes through it.
pub(crate) struct Batch<'a, R> {
    pub(crate) topology: &'a Topology,
    pub(crate) weights: &'a [R],
    /// Reading by reading.
    pub(crate) inputs: &'a [R],
}

/// Outputs of every reading, reading by reading: G · N readings at a time, and what is left over N at a time.
#[inline(always)]
pub(super) fn run<V: Lanes<N>, const N: usize, const G: usize>(
    batch: &Batch<V::Real>,
    outputs: &mut [V::Real],
) {
    let (inputs, out) = (batch.topology.inputs(), batch.topology.outputs());
    let blocks = batch.inputs.len() / (G * N * inputs).max(1);
    let (inputs, last_inputs) = batch.inputs.split_at(blocks * G * N * inputs);
    let (outputs, last_outputs) = outputs.split_at_mut(blocks * G * N * out);
    run_blocks::<V, N, G>(&Batch { inputs, ..*batch }, outputs);
    run_blocks::<V, N, 1>(&Batch { inputs: last_inputs, ..*batch }, last_outputs);
}

#[inline(always)]
fn run_blocks<V: Lanes<N>, const N: usize, const G: usize>(batch: &Batch<V::Real>, outputs: &mut [V::Real]) {
    if batch.inputs.is_empty() {
        return;
    }
    let (inputs, out) = (batch.topology.inputs(), batch.topology.outputs());
    let widest = batch.topology.sizes.iter().copied().max().unwrap_or(0);
    let mut from = vec![[V::splat(V::Real::from_f64(0.0)); G]; widest];
    let mut to = from.clone();
    for (readings, outputs) in batch.inputs.chunks(G * N * inputs).zip(outputs.chunks_mut(G * N * out)) {
        for (g, readings) in readings.chunks(N * inputs).enumerate() {
            load(readings, g, &mut from[..inputs]);
        }
        pass(batch, &mut from, &mut to);
        for (g, outputs) in outputs.chunks_mut(N * out).enumerate() {
            store(&from[..out], g, outputs);
        }
    }
}

/// Turns N readings, or fewer, into register `g` of every input.
#[inline(always)]
fn load<V: Lanes<N>, const N: usize, const G: usize>(readings: &[V::Real], g: usize, to: &mut [[V; G]]) {
    let inputs = to.len();
    if let (8, ([rows], [])) = (inputs, readings.as_chunks::<8>().0.as_chunks::<N>()) {
        for (column, registers) in V::transpose(rows).into_iter().zip(to) {
            registers[g] = column;
        }
        return;
    }
    for (input, registers) in to.iter_mut().enumerate() {
        let mut lanes = [V::Real::from_f64(0.0); N];
        for (lane, reading) in lanes.iter_mut().zip(readings.chunks_exact(inputs)) {
            *lane = reading[input];
        }
        registers[g] = V::from_array(lanes);
    }
}

/// Turns register `g` of every output into the outputs of N readings, or of as many as there is room for.
#[inline(always)]
fn store<V: Lanes<N>, const N: usize, const G: usize>(from: &[[V; G]], g: usize, outputs: &mut [V::Real]) {
    if let ([registers], [lanes]) = (from, outputs.as_chunks_mut::<N>().0) {
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
fn pass<V: Lanes<N>, const N: usize, const G: usize>(
    batch: &Batch<V::Real>,
    from: &mut Vec<[V; G]>,
    to: &mut Vec<[V; G]>,
) {
    let topology = batch.topology;
    let mut weights = batch.weights;
    for layer in 0..topology.layers() {
        let row_len = topology.row_len(layer);
        let (rows, rest) = weights.split_at(topology.rows(layer) * row_len);
        weights = rest;
        for (row, a) in rows.chunks_exact(row_len).zip(to.iter_mut()) {
            let (row, bias) = row.split_at(topology.sizes[layer]);
            let mut sums = [V::splat(bias.first().copied().unwrap_or(V::Real::from_f64(0.0))); G];
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
