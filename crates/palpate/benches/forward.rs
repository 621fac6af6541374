//! The forward pass of the paper's 8–10–1 network: one reading after the other in double precision, as a chip does it and as this machine's
//! locator does; and in batches of single precision by each instruction set. One core, in CPU time, the rounds interleaved so that a
//! busy machine slows all alike; medians.

use std::hint::black_box;

use cpu_time::ThreadTime;
use palpate_estimators::network::{BatchNetwork, InstructionSet, Network, PreparedNetwork, Topology};
use palpate_numerics::median;

const ROUNDS: usize = 15;
const READINGS: usize = 4096;
const REPEATS: usize = 50;

fn main() {
    let topology = Topology::new(&Network::default(), 8, 1);
    let weights: Vec<f64> = (0..topology.weight_count()).map(|k| (k as f64 * 1.3).sin()).collect();
    let inputs: Vec<f64> = (0..8 * READINGS).map(|k| (k as f64 * 0.37).cos()).collect();
    let singles: Vec<f32> = inputs.iter().map(|x| *x as f32).collect();
    let prepared = PreparedNetwork::new(&topology, &weights).expect("the weights are the topology's");
    let batch = BatchNetwork::new(&topology, &weights).expect("the weights are the topology's");
    let sets = InstructionSet::available();
    let mut times = vec![Vec::new(); sets.len() + 2];
    let mut outputs = vec![0.0; READINGS];
    for _ in 0..ROUNDS {
        times[0].push(seconds_a_reading(&mut || one_by_one(&topology, &weights, &inputs)));
        times[1].push(seconds_a_reading(&mut || one_by_one_prepared(&prepared, &inputs)));
        for (set, times) in sets.iter().zip(&mut times[2..]) {
            times.push(seconds_a_reading(&mut || {
                let sent = batch.forward_into(*set, black_box(&singles), &mut outputs);
                sent.expect("the buffers hold whole readings");
                black_box(&outputs);
            }));
        }
    }
    let medians: Vec<f64> = times.into_iter().map(|t| median(t).expect("rounds")).collect();
    println!("8-10-1");
    let names = ["one reading, f64, core".into(), "one reading, f64, prepared".into()];
    let names = names.into_iter().chain(sets.iter().map(|set| format!("batch, f32, {set}")));
    for (name, time) in names.zip(&medians) {
        let (nanoseconds, millions) = (1e9 * time, 1e-6 / time);
        println!(
            "    {name:<27} {nanoseconds:>6.1} ns  {millions:>6.1} M readings/s  {:>5.1} x",
            medians[0] / time
        );
    }
}

fn one_by_one_prepared(network: &PreparedNetwork, inputs: &[f64]) {
    let mut output = [0.0];
    for reading in inputs.chunks_exact(8) {
        network.forward_into(black_box(reading), &mut output).expect("the buffers are the network's");
        black_box(&output);
    }
}

fn one_by_one(topology: &Topology, weights: &[f64], inputs: &[f64]) {
    let network = palpate_core::Network {
        sizes: &topology.sizes,
        biases: topology.biases,
        hidden_activation: topology.hidden_activation,
        output_activation: topology.output_activation,
        weights,
    };
    let (mut output, mut scratch) = ([0.0], [0.0; 20]);
    for reading in inputs.chunks_exact(8) {
        let sent = network.forward_into(black_box(reading), &mut output, &mut scratch);
        sent.expect("the buffers are the network's");
        black_box(&output);
    }
}

fn seconds_a_reading(pass: &mut dyn FnMut()) -> f64 {
    let start = ThreadTime::now();
    for _ in 0..REPEATS {
        pass();
    }
    start.elapsed().as_secs_f64() / (REPEATS * READINGS) as f64
}
