use super::*;
use palpate_numerics::NORMAL_99;

fn log_normal(least_n: f64, greatest_n: f64) -> ForcePrior {
    ForcePrior::LogNormal(LogNormalPrior::new(least_n, greatest_n))
}

fn likelihood(b: f64, a: f64) -> ForceLikelihood {
    ForceLikelihood { b, a, at_n: 0.0, misfit: 0.0 }
}

fn cost(integral: ForceIntegral) -> f64 {
    integral.peak_cost + integral.width_cost
}

fn by_small_steps(range: (f64, f64), b: f64, a: f64) -> [f64; 3] {
    const STEPS: usize = 400_000;
    let (low, high) = (range.0.ln(), range.1.ln());
    let (median, sd) = (0.5 * (low + high), (high - low) / (2.0 * NORMAL_99));
    let from = median - 9.0 * sd;
    let step = (high - from) / STEPS as f64;
    let exponent = |t: f64| {
        let force_n = t.exp();
        force_n * (b - 0.5 * a * force_n) - 0.5 * ((t - median) / sd).powi(2)
    };
    let nodes = || (0..STEPS).map(|i| from + (i as f64 + 0.5) * step);
    let most = nodes().map(exponent).fold(f64::NEG_INFINITY, f64::max);
    let mut sums = [0.0; 3];
    for t in nodes() {
        let (share, force_n) = ((exponent(t) - most).exp(), t.exp());
        sums = [sums[0] + share, sums[1] + share * force_n, sums[2] + share * force_n * force_n];
    }
    let mean_n = sums[1] / sums[0];
    [-2.0 * (most + (sums[0] * step / sd).ln()), mean_n, sums[2] / sums[0] - mean_n * mean_n]
}

#[test]
fn integrals_are_those_of_small_steps() {
    for range in [(0.05, 50.0), (0.5, 10.0), (2.0, 3.0), (1e-3, 1e3)] {
        let prior = log_normal(range.0, range.1);
        let (low, high): (f64, f64) = range;
        // Costs are relative to that of a flat likelihood.
        let constant = cost(prior.integrate(likelihood(0.0, 0.0))) - by_small_steps(range, 0.0, 0.0)[0];
        for share in [-1.0, 0.2, 0.5, 0.8, 0.99] {
            let force_n = if share < 0.0 { -low } else { low * (high / low).powf(share) };
            for z in [0.1, 1.0, 3.0, 5.5, 7.0, 20.0, 100.0] {
                if share < 0.0 && z > 1.0 {
                    // At the lower end the posterior is in a tail without nodes.
                    continue;
                }
                let a = (z / force_n).powi(2);
                let [expected, mean_n, variance_n2] = by_small_steps(range, a * force_n, a);
                let found = prior.integrate(likelihood(a * force_n, a));
                let context =
                    format!("{range:?}, {force_n} N, z = {z}: {found:?}, {expected} {mean_n} {variance_n2}");
                assert!((cost(found) - constant - expected).abs() < 0.15, "{context}");
                assert!((found.mean_n - mean_n).abs() < 0.05 * variance_n2.sqrt(), "{context}");
                assert!((found.variance_n2 / variance_n2 - 1.0).abs() < 0.1, "{context}");
            }
        }
    }
}

#[test]
fn no_force_is_negative_or_greater_than_the_upper_end() {
    let normal = ForcePrior::Normal(NormalPrior { mean_n: 3.0, precision: 0.25, greatest_n: 15.0 });
    for prior in [log_normal(0.5, 10.0), log_normal(1e-300, 1e300), normal] {
        let (_, most_n) = prior.ends_n();
        for force_n in [-1e9, -1.0, 0.0, 1e-12, 1.0, 9.9, 10.1, 1e3, 1e12] {
            for a in [0.0, 1e-12, 1e-3, 1.0, 1e6, 1e18] {
                let found = prior.integrate(likelihood(a * force_n, a));
                assert!(!cost(found).is_nan() && found.variance_n2 >= 0.0, "{force_n} N, {a}: {found:?}");
                let is_possible = found.mean_n >= 0.0 && found.mean_n <= most_n * (1.0 + 1e-12);
                assert!(is_possible, "{prior:?}, {force_n} N, {a}: {found:?}");
                assert!((0.0..=most_n).contains(&prior.estimate_n(a * force_n, a)), "{force_n} N, {a}");
            }
        }
    }
}

#[test]
fn flat_likelihood_gives_the_prior() {
    let found = log_normal(0.5, 10.0).integrate(likelihood(0.0, 0.0));
    let [_, mean_n, variance_n2] = by_small_steps((0.5, 10.0), 0.0, 0.0);
    assert!((found.mean_n / mean_n - 1.0).abs() < 0.01, "{found:?} beside {mean_n}");
    assert!((found.variance_n2 / variance_n2 - 1.0).abs() < 0.02, "{found:?} beside {variance_n2}");
}

#[test]
fn refuses_ranges_that_are_none() {
    for (least_n, greatest_n) in
        [(0.0, 1.0), (-1.0, 1.0), (1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)]
    {
        assert!(ForceRange::new(least_n, greatest_n).is_err(), "{least_n} to {greatest_n}");
    }
}

#[test]
fn the_range_of_presses_is_a_decade_either_side_of_their_mean() {
    let range_of =
        |forces_n: &[f64]| ForceRange::of_presses(forces_n.iter().copied()).map(ForceRange::ends_n);
    assert_eq!(range_of(&[100.0; 3]), Some((10.0, 1000.0)));
    assert_eq!(range_of(&[490.0, 510.0]), Some((50.0, 5000.0)));
    assert_eq!(range_of(&[0.01, 2.99]), Some((0.01, 15.0)));
    for forces_n in [vec![], vec![0.0], vec![f64::NAN], vec![f64::MAX]] {
        assert_eq!(range_of(&forces_n), None, "{forces_n:?}");
    }
}
