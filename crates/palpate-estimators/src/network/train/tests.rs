//! Equality of every arithmetic with the scalar reference, to the last bit.

use super::*;
use crate::network::{Activation, Network, PresentationOrder, TrainingStatus};

mod scalar;

/// Network by the scalar reference, in the arithmetic of this machine's lanes.
struct Twin<'a> {
    precision: Precision,
    task: &'a TrainingTask<'a>,
    seed: u64,
}

impl Kernel for Twin<'_> {
    type Output = TrainedNetwork;
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) -> TrainedNetwork {
        match self.precision {
            Precision::F64 => scalar::train::<S::Array<f64, 1>>(self.task, self.seed),
            Precision::F32 => scalar::train::<S::Array<f32, 1>>(self.task, self.seed),
        }
    }
}

/// y = sin x on a few points, without a symmetry that would hide exchanged inputs.
fn patterns(count: usize, inputs: usize, outputs: usize) -> TrainingSet {
    let value = |k: usize| 0.5 + 0.4 * (1.0 + k as f64 * 0.7).sin();
    TrainingSet {
        inputs,
        outputs,
        input_values: (0..count * inputs).map(value).collect(),
        target_values: (0..count * outputs).map(|k| value(k + 5)).collect(),
    }
}

fn networks(
    set: InstructionSet,
    precision: Precision,
    task: &TrainingTask,
    seeds: u64,
) -> Vec<TrainedNetwork> {
    let mut queue = SeedList::new(0..seeds);
    train_many(set, precision, task, &mut queue, Watch::NONE).unwrap();
    let trained = queue.into_results();
    assert!(trained.iter().map(|(seed, _)| *seed).eq(0..seeds));
    trained.into_iter().map(|(_, network)| network).collect()
}

fn compare_with_twin(config: &Network, patterns: &TrainingSet, seeds: u64) {
    let topology = Topology::new(config, patterns.inputs, patterns.outputs);
    let task = TrainingTask { topology: &topology, patterns, rule: &config.training };
    for precision in [Precision::F64, Precision::F32] {
        let twin: Vec<_> = (0..seeds).map(|seed| run_loops(Twin { precision, task: &task, seed })).collect();
        let alone: Vec<_> =
            (0..seeds).filter_map(|seed| train_one(precision, &task, seed, Watch::NONE).ok()).collect();
        assert_eq!(alone, twin, "one by one, {precision:?}, {config:?}");
        for set in InstructionSet::available() {
            assert_eq!(networks(set, precision, &task, seeds), twin, "{set}, {precision:?}, {config:?}");
        }
    }
}

fn config(max_epochs: u32) -> Network {
    let mut config = Network::default();
    config.training.max_epochs = max_epochs;
    config
}

#[test]
fn every_instruction_set_gives_the_twins_bits() {
    for count in [1, 2, 7, 10, 17, 30, 33, 70] {
        compare_with_twin(&config(60), &patterns(count, 8, 1), 21);
    }
}

#[test]
fn every_shape_gives_the_twins_bits() {
    for hidden in [vec![], vec![3], vec![5, 4], vec![1, 2, 3]] {
        for (hidden_activation, output_activation) in [
            (Activation::Tanh, Activation::Linear),
            (Activation::Logistic, Activation::Tanh),
            (Activation::Linear, Activation::Logistic),
        ] {
            for biases in [true, false] {
                let mut config = Network {
                    hidden: hidden.clone(),
                    hidden_activation,
                    output_activation,
                    biases,
                    ..config(25)
                };
                config.training.learning_rate = 0.1;
                compare_with_twin(&config, &patterns(9, 3, 2), 5);
            }
        }
    }
}

#[test]
fn lanes_refill_as_networks_converge_at_their_own_time() {
    let mut config = config(100_000);
    config.training.aggregate_error = 0.05;
    compare_with_twin(&config, &patterns(6, 4, 1), 40);
}

#[test]
fn a_fixed_order_is_the_same_for_all() {
    let mut config = config(40);
    config.training.order = PresentationOrder::Fixed;
    compare_with_twin(&config, &patterns(12, 8, 1), 10);
}

#[test]
fn divergent_step_is_reported() {
    let mut config = Network { output_activation: Activation::Linear, ..config(10_000) };
    config.training.learning_rate = 1e6;
    config.hidden_activation = Activation::Linear;
    let patterns = patterns(5, 3, 1);
    let topology = Topology::new(&config, 3, 1);
    let task = TrainingTask { topology: &topology, patterns: &patterns, rule: &config.training };
    for network in networks(InstructionSet::best(), Precision::F64, &task, 9) {
        assert_eq!(network.outcome.status, TrainingStatus::Diverged);
        assert!(network.outcome.epochs < 10_000);
    }
}

/// E = ½ Σ (t − a)², by the forward pass of the core.
fn half_squared_error(topology: &Topology, weights: &[f64], patterns: &TrainingSet, pattern: usize) -> f64 {
    let network = topology.network(weights);
    let mut outputs = vec![0.0; topology.outputs()];
    let mut scratch = vec![0.0; network.scratch_len()];
    let inputs = &patterns.input_values[pattern * patterns.inputs..][..patterns.inputs];
    network.forward_into(inputs, &mut outputs, &mut scratch).unwrap();
    let targets = &patterns.target_values[pattern * patterns.outputs..];
    outputs.iter().zip(targets).map(|(a, t)| (t - a).powi(2) / 2.0).sum()
}

#[test]
fn one_update_goes_down_the_gradient_of_finite_differences() {
    for activation in [Activation::Logistic, Activation::Tanh] {
        let mut config = Network { hidden: vec![4, 3], hidden_activation: activation, ..Network::default() };
        let rule = &mut config.training;
        (rule.learning_rate, rule.aggregate_error, rule.order) = (1e-3, 1e-300, PresentationOrder::Fixed);
        let patterns = patterns(1, 3, 2);
        let topology = Topology::new(&config, 3, 2);
        let after = |epochs: u32| {
            let rule = BackPropagation { max_epochs: epochs, ..config.training };
            let task = TrainingTask { topology: &topology, patterns: &patterns, rule: &rule };
            train_one(Precision::F64, &task, 3, Watch::NONE).unwrap().weights
        };
        let (first, second) = (after(1), after(2));
        // The first update has no momentum; the second repeats a share of it: Δw₂ = α Δw₁ − η ∂E/∂w.
        let before: Vec<f64> = {
            let mut stream = order::Streams::seeded(3);
            (0..topology.weight_count()).map(|_| stream.uniform(config.training.initial_weights)).collect()
        };
        let gradient = |weights: &[f64], k: usize| {
            let shifted = |step: f64| {
                let mut weights = weights.to_vec();
                weights[k] += step;
                half_squared_error(&topology, &weights, &patterns, 0)
            };
            (shifted(1e-6) - shifted(-1e-6)) / 2e-6
        };
        let BackPropagation { learning_rate: eta, momentum: alpha, .. } = config.training;
        for k in 0..topology.weight_count() {
            let step = first[k] - before[k];
            assert!((step + eta * gradient(&before, k)).abs() < 1e-12, "{activation:?}, weight {k}: {step}");
            let next = alpha * step - eta * gradient(&first, k);
            assert!((second[k] - first[k] - next).abs() < 1e-12, "{activation:?}, weight {k}");
        }
    }
}

#[test]
fn more_patterns_than_keys_can_number_give_the_twins_bits() {
    compare_with_twin(&config(2), &patterns((1 << 16) + 1, 2, 1), 2);
}

#[test]
fn training_on_many_patterns_is_capped_by_presentations() {
    let rule = BackPropagation::default();
    assert_eq!(rule.most_epochs(1 << 16), rule.max_epochs);
    assert_eq!(rule.most_epochs(100_000), 2000);
    assert_eq!(BackPropagation { max_epochs: 5, ..rule }.most_epochs(100_000), 5);
}
