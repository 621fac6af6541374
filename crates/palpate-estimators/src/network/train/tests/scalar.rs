//! Textbook back-propagation, the reference for SIMD lanes (Rumelhart, Hinton and Williams, Nature 323,
//! 1986).
//!
//! Symbols: w weights, Δw last step, x inputs of a layer, z weighted sums, a outputs, t targets, δ = −∂E/∂z
//! for E = ½ Σ (t − a)², η learning rate, α momentum:
//!
//! ```text
//! δ = (t − a) f′(z)             at the output
//! δ = f′(z) Σ w δ_above         below it
//! Δw = η δ x + α Δw_last
//! ```
//!
//! `V` is one SIMD lane, for equal rounding.

use crate::network::logistic::{activate, derivative};
use crate::network::train::Layer;
use crate::network::train::order::{OrderDrawer, Streams};
use crate::network::{PresentationOrder, TrainedNetwork, TrainingOutcome, TrainingTask};
use palpate_numerics::simd::{Real, Vector};

#[inline(always)]
pub(super) fn train<V: Vector<1>>(task: &TrainingTask, seed: u64) -> TrainedNetwork {
    let patterns = task.patterns;
    let inputs = inputs_with_bias::<V>(task);
    let targets: Vec<V> = patterns.target_values.iter().map(|&t| value(t)).collect();
    let mut stream = Streams::seeded(seed);
    let mut network = Network::<V>::new(task, &mut stream);
    let drawer = OrderDrawer::new(patterns.count());
    let mut order: Vec<u32> = (0..patterns.count() as u32).collect();
    let mut epochs = 0;
    loop {
        if task.rule.order == PresentationOrder::Shuffled {
            drawer.draw_one(&mut stream, &mut order);
        }
        let mut error = value(0.0);
        for &pattern in &order {
            let x = &inputs[pattern as usize * task.topology.row_len(0)..][..task.topology.row_len(0)];
            let t = &targets[pattern as usize * patterns.outputs..][..patterns.outputs];
            network.forward(x);
            error = network.compare(t, error);
            network.send_back();
            network.update(x);
        }
        epochs += 1;
        let [error] = error.to_array();
        if let Some(outcome) = TrainingOutcome::after_epoch(epochs, error.to_f64(), task) {
            return TrainedNetwork { topology: task.topology.clone(), weights: network.weights(), outcome };
        }
    }
}

#[inline(always)]
fn value<V: Vector<1>>(x: f64) -> V {
    V::splat(V::Real::from_f64(x))
}

fn inputs_with_bias<V: Vector<1>>(task: &TrainingTask) -> Vec<V> {
    let bias = task.topology.biases.then_some(1.0);
    let rows = task.patterns.input_values.chunks_exact(task.patterns.inputs);
    rows.flat_map(|row| row.iter().copied().chain(bias)).map(value).collect()
}

struct Network<V> {
    layers: Vec<Layer<V>>,
    eta: V,
    alpha: V,
}

impl<V: Vector<1>> Network<V> {
    fn new(task: &TrainingTask, stream: &mut Streams<1>) -> Self {
        let topology = task.topology;
        let mut layer = |k: usize| {
            let mut layer = Layer::new(topology, k, value(0.0), value(1.0));
            layer.weights.fill_with(|| value(stream.uniform(task.rule.initial_weights)));
            layer.before.clone_from(&layer.weights);
            layer
        };
        Self {
            layers: (0..topology.layers()).map(&mut layer).collect(),
            eta: value(task.rule.learning_rate),
            alpha: value(task.rule.momentum),
        }
    }

    #[inline(always)]
    fn forward(&mut self, inputs: &[V]) {
        for k in 0..self.layers.len() {
            let (below, layer) = self.layers.split_at_mut(k);
            let (x, layer) = (below.last().map_or(inputs, |below| &below.outputs), &mut layer[0]);
            for (row, output) in layer.weights.chunks_exact(layer.row_len).zip(&mut layer.outputs) {
                let mut z = value(0.0);
                for (w, x) in row.iter().zip(x) {
                    z = w.mul_add(*x, z);
                }
                *output = z;
            }
            let nodes = layer.weights.len() / layer.row_len;
            activate(layer.activation, &mut layer.outputs[..nodes]);
        }
    }

    #[inline(always)]
    fn compare(&mut self, targets: &[V], mut error: V) -> V {
        if let Some(layer) = self.layers.last_mut() {
            for ((t, a), delta) in targets.iter().zip(&layer.outputs).zip(&mut layer.deltas) {
                let difference = *t - *a;
                error = difference.mul_add(difference, error);
                *delta = difference * derivative(layer.activation, *a);
            }
        }
        error
    }

    #[inline(always)]
    fn send_back(&mut self) {
        for k in (1..self.layers.len()).rev() {
            let (below, layer) = self.layers.split_at_mut(k);
            let (below, layer) = (&mut below[k - 1], &layer[0]);
            below.deltas.fill(value(0.0));
            for (row, delta) in layer.weights.chunks_exact(layer.row_len).zip(&layer.deltas) {
                for (w, back) in row.iter().zip(&mut below.deltas) {
                    *back = w.mul_add(*delta, *back);
                }
            }
            for (delta, a) in below.deltas.iter_mut().zip(&below.outputs) {
                *delta = *delta * derivative(below.activation, *a);
            }
        }
    }

    /// w ← w + α Δw + η δ x
    #[inline(always)]
    fn update(&mut self, inputs: &[V]) {
        let (eta, alpha) = (self.eta, self.alpha);
        for k in 0..self.layers.len() {
            let (below, layer) = self.layers.split_at_mut(k);
            let (x, layer) = (below.last().map_or(inputs, |below| &below.outputs), &mut layer[0]);
            let rows = layer.weights.chunks_exact_mut(layer.row_len);
            for ((row, before), delta) in
                rows.zip(layer.before.chunks_exact_mut(layer.row_len)).zip(&layer.deltas)
            {
                let step = eta * *delta;
                for ((w, before), x) in row.iter_mut().zip(before).zip(x) {
                    let new = step.mul_add(*x, alpha.mul_add(*w - *before, *w));
                    *before = *w;
                    *w = new;
                }
            }
        }
    }

    fn weights(&self) -> Vec<f64> {
        self.layers.iter().flat_map(|layer| &layer.weights).map(|w| w.to_array()[0].to_f64()).collect()
    }
}
