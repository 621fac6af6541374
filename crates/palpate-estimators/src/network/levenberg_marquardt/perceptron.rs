//! A network's outputs and how they change with its weights.
//!
//! It is a pass by itself because the derivatives need the outputs of every layer, which the faster passes do not keep.
//!
//! Symbols: x inputs of a layer, a = f(W·x + b) its outputs, δ = ∂output/∂z for one of the network's outputs, sent back by
//! δ_below = f′ ∘ Wᵀ·δ; ∂output/∂w_ij = δ_i·x_j.

use ndarray::{Array2, ArrayView2};

use crate::network::{Activation, Topology};

/// Outputs of every row of inputs, a row each.
pub(super) fn outputs(topology: &Topology, weights: &[f64], inputs: &ArrayView2<f64>) -> Array2<f64> {
    let mut outputs = Array2::zeros((inputs.nrows(), topology.outputs()));
    let mut layers = Activations::new(topology);
    for (input, mut output) in inputs.outer_iter().zip(outputs.outer_iter_mut()) {
        layers.forward(topology, weights, input.iter().copied());
        output.iter_mut().zip(layers.last()).for_each(|(out, a)| *out = *a);
    }
    outputs
}

/// Outputs, and for every output the matrix of its derivatives: a row for each of the inputs' rows, a column a weight.
pub(super) fn jacobians(
    topology: &Topology,
    weights: &[f64],
    inputs: &ArrayView2<f64>,
) -> (Array2<f64>, Vec<Array2<f64>>) {
    let (rows, count) = (inputs.nrows(), topology.weight_count());
    let mut outputs = Array2::zeros((rows, topology.outputs()));
    let mut jacobians = vec![Array2::zeros((rows, count)); topology.outputs()];
    let mut layers = Activations::new(topology);
    for (row, input) in inputs.outer_iter().enumerate() {
        layers.forward(topology, weights, input.iter().copied());
        for (k, jacobian) in jacobians.iter_mut().enumerate() {
            outputs[[row, k]] = layers.last()[k];
            if let Some(gradient) = jacobian.row_mut(row).as_slice_mut() {
                layers.gradient(topology, weights, k, gradient);
            }
        }
    }
    (outputs, jacobians)
}

/// What flows through a network: the inputs first, then each layer's outputs.
struct Activations {
    layers: Vec<Vec<f64>>,
    delta: Vec<f64>,
    below: Vec<f64>,
}

impl Activations {
    fn new(topology: &Topology) -> Self {
        let layers = topology.sizes.iter().map(|size| vec![0.0; *size]).collect();
        Self { layers, delta: Vec::new(), below: Vec::new() }
    }

    fn last(&self) -> &[f64] {
        self.layers.last().map_or(&[], Vec::as_slice)
    }

    fn forward(&mut self, topology: &Topology, mut weights: &[f64], inputs: impl Iterator<Item = f64>) {
        self.layers[0].iter_mut().zip(inputs).for_each(|(x, input)| *x = input);
        for layer in 0..topology.layers() {
            let (below, above) = self.layers.split_at_mut(layer + 1);
            let (x, activation) = (&below[layer], topology.activation(layer));
            for a in above[0].iter_mut() {
                let (row, rest) = weights.split_at(topology.row_len(layer));
                weights = rest;
                let bias = if topology.biases { row[x.len()] } else { 0.0 };
                *a = activation.apply(row.iter().zip(x).map(|(w, x)| w * x).sum::<f64>() + bias);
            }
        }
    }

    /// ∂ output `k` / ∂ weights at the last forward pass.
    fn gradient(&mut self, topology: &Topology, weights: &[f64], k: usize, gradient: &mut [f64]) {
        self.delta.clear();
        self.delta.resize(topology.outputs(), 0.0);
        self.delta[k] = slope(topology.output_activation, self.last()[k]);
        let mut end = weights.len();
        for layer in (0..topology.layers()).rev() {
            let (row_len, rows) = (topology.row_len(layer), topology.rows(layer));
            let start = end - row_len * rows;
            let x = &self.layers[layer];
            self.below.clear();
            self.below.resize(x.len(), 0.0);
            for (i, delta) in self.delta.iter().enumerate() {
                let place = start + i * row_len;
                for (j, x) in x.iter().enumerate() {
                    gradient[place + j] = delta * x;
                    self.below[j] += delta * weights[place + j];
                }
                if topology.biases {
                    gradient[place + x.len()] = *delta;
                }
            }
            if layer > 0 {
                let activation = topology.activation(layer - 1);
                self.below.iter_mut().zip(x).for_each(|(delta, a)| *delta *= slope(activation, *a));
            }
            std::mem::swap(&mut self.delta, &mut self.below);
            end = start;
        }
    }
}

/// f′ from the output a.
fn slope(activation: Activation, a: f64) -> f64 {
    match activation {
        Activation::Logistic => a * (1.0 - a),
        Activation::Tanh => 1.0 - a * a,
        Activation::Linear => 1.0,
    }
}
