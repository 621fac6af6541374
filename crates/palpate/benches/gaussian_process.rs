//! Seconds to fit an exact Gaussian process to 3,000 presses, eight deflections to one position, with its
//! hyperparameters; microseconds a prediction; one core, in CPU time, medians.

use cpu_time::ThreadTime;
use ndarray::Array2;
use palpate_numerics::regression::{Regression, Samples};
use palpate_numerics::watch::Watch;
use palpate_numerics::{Cholesky, median};
use palpate_testing::figure::figure;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const ROUNDS: usize = 3;
/// Noise of a reading over its full scale.
const NOISE: f64 = 1e-3;

fn main() {
    for rows in [300, 1000, 3000] {
        let (readings, positions) = presses(rows);
        let samples =
            Samples { coordinates: readings.view(), outputs: positions.view(), noise_variance: None };
        let regression = Regression::default();
        let fit = || regression.fit(samples, Watch::NONE).expect("the presses suit");
        let process = fit();
        let found = process.hyperparameters().clone();
        let fit_s = seconds(|| drop(std::hint::black_box(fit())));
        let factor_s =
            seconds(|| drop(std::hint::black_box(regression.condition(samples, &found, Watch::NONE))));
        figure(&format!("gaussian_process: fit of {rows} presses"), fit_s, "s");
        println!("{rows} presses: fitted in {fit_s:.2} s, of which {factor_s:.2} s with all rows");

        let mut scratch = process.scratch();
        let (mut mean, mut variance, mut gradient) = ([0.0], [0.0], [0.0; 8]);
        let points: Vec<Vec<f64>> = presses(100).0.outer_iter().map(|row| row.to_vec()).collect();
        let mean_s = seconds(|| {
            points.iter().for_each(|at| process.mean_into(at, &mut mean, &mut scratch));
        });
        let gradient_s = seconds(|| {
            points.iter().for_each(|at| {
                process.mean_and_gradient_into(at, &mut mean, &mut gradient, &mut scratch);
            });
        });
        let variance_s = seconds(|| {
            points.iter().for_each(|at| process.predict_into(at, &mut mean, &mut variance, &mut scratch));
        });
        let [mean_us, gradient_us, variance_us] = [mean_s, gradient_s, variance_s].map(|s| s * 1e4);
        for (name, time_us) in [("mean", mean_us), ("gradient", gradient_us), ("variance", variance_us)] {
            figure(&format!("gaussian_process: {name} of {rows} presses"), time_us, "us");
        }
        println!(
            "    a prediction: mean {mean_us:.1} us, with gradient {gradient_us:.1} us, with variance {variance_us:.1} us"
        );
    }
    for size in [500, 3000] {
        let matrix = Array2::from_shape_fn((size, size), |(i, j)| (-(i as f64 - j as f64).abs()).exp());
        let seconds = seconds(|| drop(std::hint::black_box(Cholesky::factor(matrix.clone()))));
        let rate = (size as f64).powi(3) / 3.0 / seconds / 1e9;
        figure(&format!("gaussian_process: Cholesky of {size}"), seconds * 1e3, "ms");
        println!("Cholesky of {size}: {:.1} ms, {rate:.1} Gflop/s", seconds * 1e3);
    }
}

/// Median of the CPU seconds of some rounds.
fn seconds(mut work: impl FnMut()) -> f64 {
    let seconds = (0..ROUNDS)
        .map(|_| {
            let start = ThreadTime::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    median(seconds).expect("rounds")
}

/// Noisy deflections of a beam at 8 sensors, over the largest, and the position of the load over the length.
fn presses(rows: usize) -> (Array2<f64>, Array2<f64>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(rows as u64);
    let positions = Array2::from_shape_fn((rows, 1), |_| rng.random_range(0.02..0.98));
    let readings = Array2::from_shape_fn((rows, 8), |(row, sensor)| {
        let (a, x): (f64, f64) = (positions[[row, 0]], (sensor + 1) as f64 / 9.0);
        let (x, a) = if x <= a { (x, a) } else { (1.0 - x, 1.0 - a) };
        let b = 1.0 - a;
        let noise: f64 = StandardNormal.sample(&mut rng);
        8.0 * b * x * (1.0 - b * b - x * x) + NOISE * noise
    });
    (readings, positions)
}
