//! The forward pass of the paper's 8–10–1 network: one reading after the other in double precision, as a chip does it and as this machine's
//! locator does. One core, in CPU time, the rounds interleaved so that a busy machine slows all alike; medians.

use std::hint::black_box;

use cpu_time::ThreadTime;
use palpate_estimators::network::{Network, PreparedNetwork, Topology};
use palpate_numerics::median;
use palpate_testing::figure::figure;

const ROUNDS: usize = 15;
const READINGS: usize = 4096;
const REPEATS: usize = 50;

fn main() {
    let topology = Topology::new(&Network::default(), 8, 1);
    let weights: Vec<f64> = (0..topology.weight_count()).map(|k| (k as f64 * 1.3).sin()).collect();
    let inputs: Vec<f64> = (0..8 * READINGS).map(|k| (k as f64 * 0.37).cos()).collect();
    let prepared = PreparedNetwork::new(&topology, &weights).expect("the weights are the topology's");
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        times[0].push(seconds_a_reading(&mut || one_by_one(&topology, &weights, &inputs)));
        times[1].push(seconds_a_reading(&mut || one_by_one_prepared(&prepared, &inputs)));
    }
    let medians = times.map(|t| median(t).expect("rounds"));
    println!("8-10-1");
    for (name, time) in ["one reading, f64, core", "one reading, f64, prepared"].into_iter().zip(&medians) {
        let (nanoseconds, millions) = (1e9 * time, 1e-6 / time);
        figure(&format!("forward: {name}"), nanoseconds, "ns");
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
    let network = topology.network(weights);
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
