//! Properties of the regression, against a dense computation on the original rows.

use crate::watch::{Cancelled, Watch};
use ndarray::{Array1, Array2, Axis, array};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::blocks::{Blocks, Triangle};
use super::covariance::{Covariance, Points};
use super::evidence::Evidence;
use super::groups::Groups;
use super::{GaussianProcess, Hyperparameters, Kernel, Regression, RegressionError, Samples, Trend};
use crate::Cholesky;

const TREND_VARIANCE: f64 = 1e8;

fn samples<'a>(x: &'a Array2<f64>, y: &'a Array2<f64>, noise: Option<&'a [f64]>) -> Samples<'a> {
    Samples { coordinates: x.view(), outputs: y.view(), noise_variance: noise }
}

fn fit(regression: Regression, samples: Samples) -> GaussianProcess {
    regression.fit(samples, Watch::NONE).unwrap()
}

/// Points in a square, every one `repeats` times, and two noisy outputs.
fn noisy(points: usize, repeats: usize, noise: f64, seed: u64) -> (Array2<f64>, Array2<f64>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let places = Array2::from_shape_fn((points, 2), |_| rng.random_range(-1.0..3.0));
    let x: Array2<f64> = Array2::from_shape_fn((points * repeats, 2), |(r, k)| places[[r % points, k]]);
    let y = Array2::from_shape_fn((points * repeats, 2), |(r, j)| {
        let (a, b): (f64, f64) = (x[[r, 0]], x[[r, 1]]);
        let clean = if j == 0 { (2.0 * a).sin() + 0.3 * b } else { 5.0 * (a * b).cos() + 40.0 };
        let error: f64 = StandardNormal.sample(&mut rng);
        clean + noise * error
    });
    (x, y)
}

fn logarithms(h: &Hyperparameters) -> Vec<f64> {
    h.length_scales.iter().chain([&h.noise_ratio]).map(|value| value.ln()).collect()
}

/// Evidence and prediction from all original rows, by the textbook formulas.
struct Dense {
    log_evidence: f64,
    mean: Vec<f64>,
    variance: Vec<f64>,
}

fn dense(process: &GaussianProcess, regression: Regression, samples: Samples, at: [f64; 2]) -> Dense {
    let (x, y) = (samples.coordinates, samples.outputs);
    let (rows, d) = x.dim();
    let distinct = Groups::new(samples).unwrap();
    let h = process.hyperparameters();
    let covariance = |a: &[f64], b: &[f64]| {
        let mut r2 = 0.0;
        let mut trend = 1.0;
        for k in 0..d {
            r2 += ((a[k] - b[k]) / h.length_scales[k]).powi(2);
            let z = |v: f64| (v - distinct.centre[k]) / distinct.standard_deviations[k];
            if regression.trend == Trend::Linear {
                trend += z(a[k]) * z(b[k]);
            }
        }
        // The nugget against rounding is part of the model.
        let nugget = if a == b { 1e-12 } else { 0.0 };
        regression.kernel.correlation(r2) + nugget + TREND_VARIANCE * trend
    };
    let row = |i: usize| x.row(i).to_vec();
    let noise = |i: usize| h.noise_ratio * samples.noise_variance.map_or(1.0, |v| v[i]);
    let k = Array2::from_shape_fn((rows, rows), |(i, l)| {
        covariance(&row(i), &row(l)) + if i == l { noise(i) } else { 0.0 }
    });
    let factor = Cholesky::factor(k).unwrap();
    let here = Array1::from_shape_fn(rows, |i| covariance(&row(i), &at));
    let explained = here.dot(&factor.solve(&here));
    let mut found = Dense { log_evidence: 0.0, mean: vec![], variance: vec![] };
    for (j, column) in y.columns().into_iter().enumerate() {
        let centred = column.mapv(|v| v - distinct.offset[j]);
        let alpha = factor.solve(&centred);
        let quadratic = centred.dot(&alpha);
        let n = rows as f64;
        let s2 = if samples.noise_variance.is_some() { 1.0 / h.noise_ratio } else { quadratic / n };
        found.log_evidence -=
            0.5 * (n * (2.0 * std::f64::consts::PI * s2).ln() + factor.log_determinant() + quadratic / s2);
        found.mean.push(distinct.offset[j] + here.dot(&alpha));
        found.variance.push(s2 * (covariance(&at, &at) - explained));
    }
    found
}

#[test]
fn collapsing_repeats_changes_neither_evidence_nor_posterior() {
    let (x, y) = noisy(12, 3, 0.2, 1);
    let given: Vec<f64> = (0..36).map(|i| 0.02 + 0.001 * f64::from(i)).collect();
    for trend in [Trend::Constant, Trend::Linear] {
        for kernel in [Kernel::Matern52, Kernel::SquaredExponential] {
            for noise in [None, Some(&given[..])] {
                let regression = Regression { kernel, trend, ..Regression::default() };
                let ratio = if noise.is_some() { 0.2 } else { 0.03 };
                let h = Hyperparameters { length_scales: vec![0.9, 1.7], noise_ratio: ratio };
                let process = regression.condition(samples(&x, &y, noise), &h, Watch::NONE).unwrap();
                assert_eq!(process.points(), 12);
                let truth = dense(&process, regression, samples(&x, &y, noise), [0.4, 1.1]);
                let (mean, variance) = process.predict(&[0.4, 1.1]);
                // The dense matrix has entries of 10⁹ beside a noise of 10⁻², which costs 11 of 16 digits.
                let off = process.log_evidence() - truth.log_evidence;
                assert!(off.abs() < 3e-3, "{trend:?} {kernel:?} {off}");
                for j in 0..2 {
                    assert!((mean[j] - truth.mean[j]).abs() < 1e-4, "{mean:?} {:?}", truth.mean);
                    let off = variance[j] - truth.variance[j];
                    assert!(
                        off.abs() < 1e-3 * (1.0 + truth.variance[j]),
                        "{variance:?} {:?}",
                        truth.variance
                    );
                }
            }
        }
    }
}

#[test]
fn the_evidences_gradient_is_its_difference() {
    let (x, y) = noisy(15, 2, 0.3, 2);
    let given = [0.09; 30];
    for trend in [Trend::Constant, Trend::Linear] {
        for kernel in [Kernel::Matern52, Kernel::SquaredExponential] {
            for noise in [None, Some(&given[..])] {
                let groups = Groups::new(samples(&x, &y, noise)).unwrap();
                let evidence = Evidence { groups: &groups, kernel, trend };
                let at = [0.1, 0.7, -2.0];
                let value = |theta: &[f64], gradient: &mut [f64]| {
                    evidence.with_gradient(&Hyperparameters::from_logarithms(theta), gradient).unwrap()
                };
                let mut gradient = [0.0; 3];
                value(&at, &mut gradient);
                for i in 0..3 {
                    let step = 1e-5;
                    let (mut up, mut down) = (at, at);
                    up[i] += step;
                    down[i] -= step;
                    let difference = (value(&up, &mut [0.0; 3]) - value(&down, &mut [0.0; 3])) / (2.0 * step);
                    assert!(
                        (difference - gradient[i]).abs() < 1e-4 * (1.0 + gradient[i].abs()),
                        "{trend:?} {kernel:?} {i}: {difference} {}",
                        gradient[i]
                    );
                }
            }
        }
    }
}

#[test]
fn the_means_gradient_is_its_difference() {
    let (x, y) = noisy(40, 1, 0.01, 3);
    for trend in [Trend::Constant, Trend::Linear] {
        let process = fit(Regression { trend, ..Regression::default() }, samples(&x, &y, None));
        let (mut means, mut gradients) = ([0.0; 2], [0.0; 4]);
        let mut scratch = process.scratch();
        let at = [0.3, 0.9];
        process.mean_and_gradient_into(&at, &mut means, &mut gradients, &mut scratch);
        assert_eq!(means.to_vec(), process.predict(&at).0);
        for k in 0..2 {
            let (mut up, mut down) = (at, at);
            up[k] += 1e-5;
            down[k] -= 1e-5;
            let (up, down) = (process.predict(&up).0, process.predict(&down).0);
            for j in 0..2 {
                let difference = (up[j] - down[j]) / 2e-5;
                let found = gradients[j * 2 + k];
                assert!((difference - found).abs() < 1e-5 * (1.0 + found.abs()), "{difference} {found}");
            }
        }
    }
}

#[test]
fn without_noise_it_interpolates() {
    let (x, y) = noisy(25, 1, 0.0, 4);
    let zero = [0.0; 25];
    for kernel in [Kernel::Matern52, Kernel::SquaredExponential] {
        let regression = Regression { kernel, ..Regression::default() };
        let process = fit(regression, samples(&x, &y, Some(&zero)));
        for i in 0..25 {
            let (mean, variance) = process.predict(&x.row(i).to_vec());
            for j in 0..2 {
                assert!((mean[j] - y[[i, j]]).abs() < 1e-5, "{kernel:?} {mean:?} {:?}", y.row(i));
                assert!(variance[j] < 1e-6 * process.signal_variance(j), "{variance:?}");
            }
        }
    }
}

#[test]
fn posterior_far_away_equals_the_prior() {
    let (x, y) = noisy(30, 1, 0.1, 5);
    let process = fit(Regression::default(), samples(&x, &y, None));
    let (mean, variance) = process.predict(&[1e4, -1e4]);
    for j in 0..2 {
        // The constant trend has an error too.
        let more = variance[j] / process.signal_variance(j);
        assert!((1.0..2.0).contains(&more), "{more}");
        let values = y.column(j);
        let (least, most) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(least < mean[j] && mean[j] < most);
    }
    // At a distance that overflows r² the variance is finite too.
    assert!(process.predict(&[1e300, 0.0]).1.iter().all(|v| v.is_finite()));
}

#[test]
fn a_sampled_functions_hyperparameters_are_recovered() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
    let rows = 250;
    let x = Array2::from_shape_fn((rows, 2), |_| rng.random_range(0.0..4.0));
    let truth = Hyperparameters { length_scales: vec![0.5, 2.0], noise_ratio: 0.01 };
    let (signal, count) = (9.0, 3);
    let k = Array2::from_shape_fn((rows, rows), |(i, l)| {
        let apart = |c: usize| ((x[[i, c]] - x[[l, c]]) / truth.length_scales[c]).powi(2);
        let same = if i == l { truth.noise_ratio } else { 0.0 };
        signal * (Kernel::Matern52.correlation(apart(0) + apart(1)) + same)
    });
    let draws = Array2::from_shape_fn((rows, count), |_| StandardNormal.sample(&mut rng));
    let y = Cholesky::factor(k).unwrap().lower().dot(&draws);
    let process = fit(Regression::default(), samples(&x, &y, None));
    let found = process.hyperparameters();
    for (found, truth) in logarithms(found).iter().zip(logarithms(&truth)) {
        assert!((found - truth).abs() < 0.35, "{process:?}", process = process.hyperparameters());
    }
    for j in 0..count {
        assert!((process.signal_variance(j) / signal).ln().abs() < 0.7);
        assert!((process.noise_variance(j).unwrap() / 0.09).ln().abs() < 0.5);
    }
    // With a given noise, the fit recovers the signal variance too.
    let given = vec![0.09; rows];
    let process = fit(Regression::default(), samples(&x, &y, Some(&given)));
    assert!((process.signal_variance(0) / signal).ln().abs() < 0.5);
}

#[test]
fn repeats_alone_determine_the_noise() {
    // Eight places, too few to distinguish the function from noise without repeats.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let x = Array2::from_shape_fn((160, 1), |(r, _)| (r % 8) as f64);
    let y = Array2::from_shape_fn((160, 1), |(r, _)| {
        let error: f64 = StandardNormal.sample(&mut rng);
        [3.0, -2.0, 0.0, 5.0, 1.0, -4.0, 2.0, 2.5][r % 8] + 0.1 * error
    });
    let process = fit(Regression::default(), samples(&x, &y, None));
    let deviation = process.noise_variance(0).unwrap().sqrt();
    assert!((0.085..0.115).contains(&deviation), "{deviation}");
}

#[test]
fn pure_noise_is_not_learnt_and_a_line_is() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let x = Array2::from_shape_fn((80, 1), |(r, _)| r as f64);
    let y = Array2::from_shape_fn((80, 1), |_| StandardNormal.sample(&mut rng));
    let process = fit(Regression::default(), samples(&x, &y, None));
    let means = (0..80).map(|i| process.predict(&[f64::from(i) + 0.5]).0[0]);
    assert!(means.fold(0.0, |m: f64, v| m.max(v.abs())) < 0.7);

    let line = x.mapv(|x| 3.0 - 2.0 * x);
    let linear = Regression { trend: Trend::Linear, ..Regression::default() };
    let process = fit(linear, samples(&x, &line, None));
    assert!((process.predict(&[200.0]).0[0] + 397.0).abs() < 1e-2);
}

#[test]
fn awkward_samples_give_an_answer() {
    let alike = array![[1.0, 2.0], [1.0, 2.0], [1.0, 2.0]];
    let constant = array![[5.0], [5.0], [5.0]];
    let close = array![[0.0, 1.0], [1e-13, 1.0], [1.0, 1.0], [0.5, 1.0]];
    let disagreeing = array![[0.0], [1.0], [2.0], [3.0]];
    let zero = [0.0; 4];
    for trend in [Trend::Constant, Trend::Linear] {
        for kernel in [Kernel::Matern52, Kernel::SquaredExponential] {
            let regression = Regression { kernel, trend, ..Regression::default() };
            let (mean, variance) = fit(regression, samples(&alike, &constant, None)).predict(&[1.0, 2.0]);
            assert!((mean[0] - 5.0).abs() < 1e-6 && variance[0].is_finite());
            for noise in [None, Some(&zero[..])] {
                let process = fit(regression, samples(&close, &disagreeing, noise));
                let (mean, variance) = process.predict(&[0.7, 1.0]);
                assert!(mean[0].is_finite() && variance[0].is_finite());
            }
        }
    }
    let one = fit(Regression::default(), samples(&array![[1.0]], &array![[2.0]], None));
    assert_eq!(one.predict(&[1.0]).0, [2.0]);
}

#[test]
fn samples_that_are_none_are_refused() {
    let refused = |x: &Array2<f64>, y: &Array2<f64>, noise: Option<&[f64]>| {
        Regression::default().fit(samples(x, y, noise), Watch::NONE).unwrap_err()
    };
    let (x, y) = (array![[0.0], [1.0]], array![[0.0], [1.0]]);
    assert!(matches!(
        refused(&Array2::zeros((0, 1)), &Array2::zeros((0, 1)), None),
        RegressionError::Empty { rows: 0, .. }
    ));
    assert!(matches!(refused(&x, &array![[0.0]], None), RegressionError::Count { needed: 2, found: 1, .. }));
    let nan = array![[0.0], [f64::NAN]];
    assert!(matches!(refused(&x, &nan, None), RegressionError::NotFinite { what: "output", row: 2, .. }));
    assert!(matches!(
        refused(&x, &y, Some(&[0.0, -1.0])),
        RegressionError::NoiseVariance { row: 2, value: -1.0 }
    ));
    assert!(matches!(refused(&x, &y, Some(&[0.0])), RegressionError::Count { .. }));
    let h = Hyperparameters { length_scales: vec![0.0], noise_ratio: 1.0 };
    let error = Regression::default().condition(samples(&x, &y, None), &h, Watch::NONE).unwrap_err();
    assert!(matches!(error, RegressionError::Hyperparameter { number: 1, .. }));
    let stop = |_| false;
    let stopped = Regression::default().fit(samples(&x, &y, None), Watch::new(&stop)).unwrap_err();
    assert!(Cancelled::caused(&stopped), "{stopped}");
}

#[test]
fn it_comes_back_from_a_file_and_a_damaged_file_is_refused() {
    let (x, y) = noisy(20, 2, 0.1, 9);
    let process = fit(Regression { trend: Trend::Linear, ..Regression::default() }, samples(&x, &y, None));
    let text = serde_json::to_string(&process).unwrap();
    let back: GaussianProcess = serde_json::from_str(&text).unwrap();
    // Parsing a number may round its last digit.
    let (here, there) = (process.predict(&[0.1, 0.2]), back.predict(&[0.1, 0.2]));
    for j in 0..2 {
        assert!((here.0[j] - there.0[j]).abs() < 1e-9 && (here.1[j] - there.1[j]).abs() < 1e-9);
    }
    for (from, to) in
        [("\"weights\":[", "\"weights\":[1.0,"), ("\"length_scales\":[", "\"length_scales\":[-")]
    {
        assert!(serde_json::from_str::<GaussianProcess>(&text.replacen(from, to, 1)).is_err(), "{to}");
    }
}

/// Eight bell-shaped features of a position with noise, and the position.
fn features(rows: usize, seed: u64) -> (Array2<f64>, Array2<f64>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let y = Array2::from_shape_fn((rows, 1), |_| rng.random_range(0.0..1.0));
    let x = Array2::from_shape_fn((rows, 8), |(i, k)| {
        let error: f64 = StandardNormal.sample(&mut rng);
        (-(4.0 * y[[i, 0]] - 0.5 * k as f64).powi(2)).exp() + 0.01 * error
    });
    (x, y)
}

/// Largest differences of two processes' means and standard deviations of a new row, over the deviations of
/// the first.
fn difference(exact: &GaussianProcess, other: &GaussianProcess, at: &Array2<f64>) -> [f64; 2] {
    let mut worst = [0.0_f64; 2];
    for at in at.outer_iter() {
        let (mean, variance) = exact.predict(&at.to_vec());
        let (other_mean, other_variance) = other.predict(&at.to_vec());
        for j in 0..mean.len() {
            let row = |variance: f64| (variance + exact.noise_variance(j).unwrap_or(0.0)).sqrt();
            let sd = row(variance[j]);
            worst[0] = worst[0].max((mean[j] - other_mean[j]).abs() / sd);
            worst[1] = worst[1].max((row(other_variance[j]) / sd - 1.0).abs());
        }
    }
    worst
}

#[test]
fn chosen_points_predict_like_all_points() {
    for (samples_of, trend) in [
        (features as fn(usize, u64) -> (Array2<f64>, Array2<f64>), Trend::Constant),
        (|rows, seed| noisy(rows, 1, 0.2, seed), Trend::Linear),
    ] {
        let (x, y) = samples_of(900, 10);
        let regression = Regression { trend, search_points: 200, ..Regression::default() };
        let all = samples(&x, &y, None);
        let process = fit(regression, all);
        let found = process.hyperparameters();
        let groups = Groups::new(all).unwrap();
        let kernel = Kernel::Matern52;
        let sparse = GaussianProcess::of_chosen(&groups, kernel, trend, found, Watch::NONE).unwrap();
        // The textbook's variance, from all rows.
        let noise = groups.noise_ratios(found.noise_ratio);
        let scales = &found.length_scales;
        let points = Points::of_groups(&groups, scales, trend);
        let covariance = Covariance::regularised(&points, kernel, &noise).unwrap();
        let at = samples_of(50, 11).0;
        for at in at.outer_iter() {
            let standard = |k: usize, by: &[f64]| (at[k] - groups.centre[k]) / by[k];
            let d = scales.len();
            let here = Points::new(
                &at.insert_axis(Axis(1)).view(),
                &groups.centre,
                &groups.standard_deviations,
                scales,
                trend,
            );
            let correlations: Vec<f64> = (0..groups.len())
                .map(|i| {
                    let r2 = (0..d).map(|k| (standard(k, scales) - points.scaled[[k, i]]).powi(2)).sum();
                    kernel.correlation(r2)
                })
                .collect();
            let half = covariance.factor.solve_lower(&Array1::from(correlations));
            let rest = covariance.trend.solve_lower(&(&here.basis.row(0) - &half.dot(&covariance.basis)));
            let exact = 1.0 - half.dot(&half) + rest.dot(&rest);
            let variance = process.predict(&at.to_vec()).1[0] / process.signal_variance(0);
            let sd = |variance: f64| (variance + found.noise_ratio).sqrt();
            assert!((sd(variance) / sd(exact) - 1.0).abs() < 0.03, "{trend:?}: {variance} {exact}");
        }
        let [mean, sd] = difference(&process, &sparse, &at);
        assert!(mean < 0.05 && sd < 0.02, "{trend:?}: {mean} {sd}");
        let evidence = sparse.log_evidence() - process.log_evidence();
        assert!(evidence.abs() < 0.01 * process.log_evidence().abs(), "{trend:?}: {evidence}");
        assert_eq!((sparse.points(), sparse.point_count() < 900), (900, true));
        let text = serde_json::to_string(&sparse).unwrap();
        let back: GaussianProcess = serde_json::from_str(&text).unwrap();
        let [mean, sd] = difference(&sparse, &back, &at);
        assert!(mean < 1e-6 && sd < 1e-6, "{mean} {sd}");
        let damaged = text.replacen("\"factor\":[", "\"factor\":[-", 1);
        assert!(serde_json::from_str::<GaussianProcess>(&damaged).is_err());
    }
}

#[test]
fn tables_of_a_rough_process_are_as_sure_as_all_rows_make_them() {
    // Too rough for the few points of the reduced variance.
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
    let x = Array2::<f64>::from_shape_fn((2500, 2), |_| rng.random_range(0.0..1.0));
    let y = Array2::from_shape_fn((2500, 1), |(i, _)| (9.0 * x[[i, 0]]).sin() * (7.0 * x[[i, 1]]).cos());
    let groups = Groups::new(samples(&x, &y, None)).unwrap();
    let (kernel, trend) = (Kernel::Matern52, Trend::Linear);
    let found = Hyperparameters { length_scales: vec![0.08, 0.1], noise_ratio: 1e-3 };
    let [all, sparse] = [GaussianProcess::of_groups, GaussianProcess::of_chosen]
        .map(|posterior| posterior(&groups, kernel, trend, &found, Watch::NONE).unwrap());
    let points = Points::of_groups(&groups, &found.length_scales, trend);
    let noise = groups.noise_ratios(found.noise_ratio);
    let covariance = Covariance::regularised(&points, kernel, &noise).unwrap();
    let (mut means, mut scratch) = (vec![0.0], sparse.scratch());
    let mut sums = [0.0; 3];
    for _ in 0..100 {
        let at: Vec<f64> = (0..2).map(|_| rng.random_range(0.0..1.0)).collect();
        let here = Array2::from_shape_vec((2, 1), at.clone()).unwrap();
        let here = Points::new(
            &here.view(),
            &groups.centre,
            &groups.standard_deviations,
            &found.length_scales,
            trend,
        );
        let squares = |i: usize| (0..2).map(|k| (here.scaled[[k, 0]] - points.scaled[[k, i]]).powi(2)).sum();
        let correlations: Array1<f64> = (0..2500).map(|i| kernel.correlation(squares(i))).collect();
        let half = covariance.factor.solve_lower(&correlations);
        let rest = covariance.trend.solve_lower(&(&here.basis.row(0) - &half.dot(&covariance.basis)));
        let exact = 1.0 - half.dot(&half) + rest.dot(&rest);
        let tabled = sparse.tabulate_into(&at, &mut means, &mut scratch);
        let predicted = sparse.predict(&at).1[0] / sparse.signal_variance(0);
        assert!((means[0] - all.predict(&at).0[0]).abs() < 0.01, "{at:?}");
        assert!(tabled > 0.8 * exact && tabled <= predicted, "{at:?}: {tabled}, {predicted}, {exact}");
        sums.iter_mut().zip([exact, tabled, predicted]).for_each(|(sum, variance)| *sum += variance);
    }
    let [exact, tabled, predicted] = sums;
    eprintln!(
        "mean variance {:.2e} of all rows, {:.2} of it in tables, {:.2} in predictions",
        exact / 100.0,
        tabled / exact,
        predicted / exact
    );
    assert!(tabled < 2.0 * exact && predicted > 5.0 * exact, "{tabled} {predicted} {exact}");
}

#[test]
fn blocks_correlate_as_the_kernel_does() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let points = Array2::from_shape_fn((3, 21), |_| rng.random_range(-2.0..2.0));
    let weights = Array2::from_shape_fn((6, 21), |_| rng.random_range(-1.0..1.0));
    let u = [0.3, -0.4, 1.1];
    for kernel in [Kernel::Matern52, Kernel::Matern32, Kernel::SquaredExponential] {
        let blocks = Blocks::new(kernel, &points.view(), &weights.view());
        let (mut correlations, mut sums) = (vec![[0.0; 8]; blocks.len()], [0.0; 6]);
        blocks.sums_into(&u, &mut correlations, &mut sums);
        let correlations = Array1::from(correlations.as_flattened()[..21].to_vec());
        for (point, c) in points.columns().into_iter().zip(&correlations) {
            let r2 = point.iter().zip(u).map(|(a, b)| (a - b).powi(2)).sum();
            assert!((c - kernel.correlation(r2)).abs() < 1e-12, "{kernel:?}");
        }
        for (sum, row) in sums.iter().zip(weights.outer_iter()) {
            assert!((sum - row.dot(&correlations)).abs() < 1e-12);
        }
    }
    let square = Array2::from_shape_fn((21, 21), |_| rng.random_range(-1.0..1.0));
    let x: Vec<f64> = (0..21).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut product = [[0.0; 8]; 3];
    let length = Triangle::new(&square.view()).product_into(&x, &mut product);
    for (i, found) in product.as_flattened()[..21].iter().enumerate() {
        let truth: f64 = (0..=i).map(|j| square[[i, j]] * x[j]).sum();
        assert!((found - truth).abs() < 1e-12);
    }
    assert!((length - product.as_flattened().iter().map(|v| v * v).sum::<f64>()).abs() < 1e-12);
}
