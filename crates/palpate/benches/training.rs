//! Presentations per second of the paper's 8–10–1 network: side by side by each instruction set, against one
//! after the other; one core, in CPU time, the rounds interleaved so that a busy machine slows all alike; medians.

use cpu_time::ThreadTime;
use palpate_estimators::fit::SeedList;
use palpate_estimators::network::{
    BackPropagation, Network, Precision, PresentationOrder, Topology, TrainingSet, TrainingTask, train_many,
    train_one,
};
use palpate_numerics::median;
use palpate_numerics::simd::InstructionSet;
use palpate_numerics::watch::Watch;
use palpate_testing::figure::figure;

const ROUNDS: usize = 9;
const EPOCHS: u32 = 400;

fn main() {
    for precision in [Precision::F64, Precision::F32] {
        for count in [10, 20, 30] {
            compare(count, precision);
        }
        price_of_shuffling(precision);
    }
}

/// Cost of drawing a fresh order every epoch, against presenting the patterns as they are.
fn price_of_shuffling(precision: Precision) {
    let patterns = beam_patterns(30);
    let topology = Topology::new(&Network::default(), patterns.inputs, patterns.outputs);
    let set = InstructionSet::best();
    let mut shares = Vec::new();
    for _ in 0..ROUNDS {
        let seconds = [PresentationOrder::Shuffled, PresentationOrder::Fixed].map(|order| {
            let rule = BackPropagation {
                aggregate_error: 0.0,
                max_epochs: EPOCHS,
                order,
                ..BackPropagation::default()
            };
            let task = TrainingTask { topology: &topology, patterns: &patterns, rule: &rule };
            let mut queue = SeedList::new(0..4 * precision.lanes() as u64);
            let start = ThreadTime::now();
            train_many(set, precision, &task, &mut queue, Watch::NONE).expect("nobody stops it");
            start.elapsed().as_secs_f64()
        });
        shares.push(100.0 * (seconds[0] - seconds[1]) / seconds[0]);
    }
    println!(
        "30 patterns, {precision:?}, {set}: shuffling takes {:.1} % of the time",
        median(shares).expect("rounds")
    );
}

fn compare(count: usize, precision: Precision) {
    let patterns = beam_patterns(count);
    let topology = Topology::new(&Network::default(), patterns.inputs, patterns.outputs);
    let rule = BackPropagation { aggregate_error: 0.0, max_epochs: EPOCHS, ..BackPropagation::default() };
    let task = TrainingTask { topology: &topology, patterns: &patterns, rule: &rule };
    let sets = InstructionSet::available();
    let mut rates = vec![Vec::new(); sets.len() + 1];
    for _ in 0..ROUNDS {
        let start = ThreadTime::now();
        for seed in 0..4 {
            train_one(precision, &task, seed, Watch::NONE).expect("nobody stops it");
        }
        rates[0].push(f64::from(4 * EPOCHS) * count as f64 / start.elapsed().as_secs_f64());
        for (set, rates) in sets.iter().zip(&mut rates[1..]) {
            let mut queue = SeedList::new(0..4 * precision.lanes() as u64);
            let start = ThreadTime::now();
            train_many(*set, precision, &task, &mut queue, Watch::NONE).expect("nobody stops it");
            let presentations = f64::from(EPOCHS) * (count * 4 * precision.lanes()) as f64;
            rates.push(presentations / start.elapsed().as_secs_f64());
        }
    }
    let medians: Vec<f64> = rates.into_iter().map(|r| median(r).expect("rounds")).collect();
    println!("{count} patterns, {precision:?}: one after the other {:.2} M/s", medians[0] / 1e6);
    figure(
        &format!("training: {count} patterns, {precision:?}, one after the other"),
        medians[0] / 1e6,
        "M/s",
    );
    for (set, rate) in sets.iter().zip(&medians[1..]) {
        figure(&format!("training: {count} patterns, {precision:?}, {set}"), rate / 1e6, "M/s");
        println!("    {set:<12} {:>7.2} M/s  {:>5.2} x", rate / 1e6, rate / medians[0]);
    }
}

fn beam_patterns(count: usize) -> TrainingSet {
    let mut patterns = TrainingSet { inputs: 8, outputs: 1, input_values: vec![], target_values: vec![] };
    for p in 0..count {
        let a = (p as f64 + 0.5) / count as f64;
        for i in 1..=8 {
            let x = i as f64 / 9.0;
            let (x, a) = if x <= a { (x, a) } else { (1.0 - x, 1.0 - a) };
            let b = 1.0 - a;
            patterns.input_values.push(-8.0 * b * x * (1.0 - b * b - x * x));
        }
        patterns.target_values.push(a);
    }
    patterns
}
