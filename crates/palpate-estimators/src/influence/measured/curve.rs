//! Readings at one position as a cubic in the nuisance coordinate, through four nodes.
//!
//! P(τ) = |z − μ(τ)|²/V is a polynomial of degree six. Where the minimum τ₀ is far from the ends, five-point
//! Gauss–Hermite quadrature with mean τ₀ and precision P″/2 gives ∫ exp(−P/2) dτ.

use super::line::Marginal;
use crate::influence::inversion::{FIVE_POINTS, Stencil};
use crate::influence::lanes::{Lanes, sum_of};
use palpate_numerics::simd::{Arithmetic, InstructionSet, Kernel, Simd, Vector};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub first: usize,
    pub nodes: usize,
}

impl Window {
    pub fn around(node: f64, nodes: usize) -> Self {
        let Stencil { first, used, .. } = Stencil::new(node, nodes);
        Self { first, nodes: used }
    }
}

/// Standard deviations to negligible density, e⁻¹⁰.
const CLEAR: f64 = 4.5;
/// Newton steps; below, the last one's length in standard deviations.
const MOST_STEPS: usize = 12;
const SMALL_STEP: f64 = 1e-3;

#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    window: Window,
    /// Coefficients of P about `origin`, from the constant up.
    powers: [f64; 7],
    origin: f64,
}

impl Curve {
    /// `means` are whitened, node by node; `weights` are 1/V.
    pub fn new(reading: &[Lanes], means: &[Lanes], weights: impl Fn(usize) -> Lanes, window: Window) -> Self {
        let (middle, coefficients) = coefficients(window.nodes);
        let products = InstructionSet::best().run(Products {
            reading,
            means,
            weights,
            coefficients: (middle, coefficients),
        });
        let [oo, oa, ob, oc, aa, ab, ac, bb, bc, cc] = products;
        let powers = [oo, 2.0 * oa, aa + 2.0 * ob, 2.0 * (ab + oc), bb + 2.0 * ac, 2.0 * bc, cc];
        Self { window, powers, origin: (window.first + middle) as f64 }
    }

    /// P at τ.
    fn residual_at(&self, tau: f64) -> f64 {
        self.powers.iter().rev().fold(0.0, |sum, power| sum * tau + power)
    }

    /// P′/2 and P″/2.
    fn slopes_at(&self, tau: f64) -> [f64; 2] {
        let [_, a, b, c, d, e, f] = self.powers;
        let slope = a + tau * (2.0 * b + tau * (3.0 * c + tau * (4.0 * d + tau * (5.0 * e + tau * 6.0 * f))));
        let bend = 2.0 * b + tau * (6.0 * c + tau * (12.0 * d + tau * (20.0 * e + tau * 30.0 * f)));
        [0.5 * slope, 0.5 * bend]
    }

    /// Minimum within the ends, and precision; `None` where P is not convex.
    fn minimum(&self, near: f64, ends: [f64; 2]) -> Option<(f64, f64)> {
        let mut tau = (near - self.origin).clamp(ends[0], ends[1]);
        for _ in 0..MOST_STEPS {
            let [slope, precision] = self.slopes_at(tau);
            if precision.is_nan() || precision <= 0.0 {
                return None;
            }
            let next = (tau - slope / precision).clamp(ends[0], ends[1]);
            let step = next - tau;
            tau = next;
            if step * step * precision < SMALL_STEP * SMALL_STEP {
                return Some((tau, precision));
            }
        }
        None
    }

    /// Least squared residual, and the integral relative to it.
    ///
    /// # Errors
    /// Near an end: the node of the next window, if known.
    pub fn integral(&self, near: f64) -> Result<(f64, Marginal), Option<f64>> {
        let start = self.window.first as f64 - self.origin;
        let end = start + (self.window.nodes - 1) as f64;
        let (least, precision) = self.minimum(near, [start, end]).ok_or(None)?;
        let deviation = precision.sqrt().recip();
        if least - CLEAR * deviation < start || least + CLEAR * deviation > end {
            return Err(Some(self.origin + least));
        }
        let misfit = self.residual_at(least);
        let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
        for (u, weight) in FIVE_POINTS {
            let rise = self.residual_at(least + u * deviation) - misfit;
            let weight = weight * (0.5 * (u * u - rise)).exp();
            sum += weight;
            first += weight * u;
            second += weight * u * u;
        }
        let mean = first / sum;
        let marginal = Marginal {
            weight: (2.0 * PI).sqrt() * deviation * sum,
            mean: self.origin + least + deviation * mean,
            variance: deviation * deviation * (second / sum - mean * mean).max(0.0),
        };
        Ok((misfit.max(0.0), marginal))
    }
}

/// Reference node, and weights of the nodes in the coefficients of τ, τ² and τ³.
fn coefficients(nodes: usize) -> (usize, [[f64; 4]; 3]) {
    match nodes {
        1 => (0, [[0.0; 4]; 3]),
        2 => (0, [[-1.0, 1.0, 0.0, 0.0], [0.0; 4], [0.0; 4]]),
        3 => (1, [[-0.5, 0.0, 0.5, 0.0], [0.5, -1.0, 0.5, 0.0], [0.0; 4]]),
        _ => (
            1,
            [[-1.0 / 3.0, -0.5, 1.0, -1.0 / 6.0], [0.5, -1.0, 0.5, 0.0], [-1.0 / 6.0, 0.5, -0.5, 1.0 / 6.0]],
        ),
    }
}

struct Products<'a, W> {
    reading: &'a [Lanes],
    means: &'a [Lanes],
    weights: W,
    coefficients: (usize, [[f64; 4]; 3]),
}

impl<W: Fn(usize) -> Lanes> Kernel for Products<'_, W> {
    type Output = [f64; 10];
    const FUSED: bool = true;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: Simd>(self) -> [f64; 10] {
        let Self { reading, means, weights, coefficients: (origin, [linear, square, cubic]) } = self;
        let groups = reading.len();
        let zero = S::F64::splat(0.0);
        let mut sums = [zero; 10];
        for (g, z) in reading.iter().enumerate() {
            let (mut a, mut b, mut c) = (zero, zero, zero);
            for (k, mean) in means[g..].iter().step_by(groups).enumerate() {
                let mean = S::F64::load(mean);
                a = mean.mul_add(S::F64::splat(-linear[k]), a);
                b = mean.mul_add(S::F64::splat(-square[k]), b);
                c = mean.mul_add(S::F64::splat(-cubic[k]), c);
            }
            let o = S::F64::load(z) - S::F64::load(&means[origin * groups + g]);
            let weights = S::F64::load(&weights(g));
            let [wo, wa, wb, wc] = [weights * o, weights * a, weights * b, weights * c];
            let terms =
                [(wo, o), (wo, a), (wo, b), (wo, c), (wa, a), (wa, b), (wa, c), (wb, b), (wb, c), (wc, c)];
            sums.iter_mut().zip(terms).for_each(|(sum, (p, q))| *sum = p.mul_add(q, *sum));
        }
        sums.map(sum_of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::influence::lanes::in_lanes;

    const NODES: usize = 9;
    const CHANNELS: usize = 11;

    fn mean(channel: usize, node: f64) -> f64 {
        let c = channel as f64;
        20.0 * (0.2 * node + 0.5 * c).sin() + 3.0 * c * node
    }

    fn weight(channel: usize) -> f64 {
        1.0 / (1.0 + 0.3 * channel as f64)
    }

    fn residual(reading: &[f64], node: f64, window: Window) -> f64 {
        let t = node - window.first as f64;
        let lagrange = |k: usize| -> f64 {
            (0..window.nodes).filter(|j| *j != k).map(|j| (t - j as f64) / (k as f64 - j as f64)).product()
        };
        let channel = |c: usize| -> f64 {
            let nodes = (0..window.nodes).map(|k| lagrange(k) * mean(c, (window.first + k) as f64));
            weight(c) * (reading[c] - nodes.sum::<f64>()).powi(2)
        };
        (0..CHANNELS).map(channel).sum()
    }

    fn found(reading: &[f64], near: f64, nodes: usize) -> (Window, Result<(f64, Marginal), Option<f64>>) {
        let window = Window::around(near, nodes);
        let means: Vec<Lanes> = (0..window.nodes)
            .flat_map(|k| {
                in_lanes(&(0..CHANNELS).map(|c| mean(c, (window.first + k) as f64)).collect::<Vec<_>>())
            })
            .collect();
        let weights: Vec<f64> = (0..CHANNELS).map(weight).collect();
        let weights = in_lanes(&weights);
        let curve = Curve::new(&in_lanes(reading), &means, |g| weights[g], window);
        (window, curve.integral(near))
    }

    #[test]
    fn integral_mean_and_variance_are_those_of_a_fine_sum() {
        const STEPS: usize = 40_000;
        for (node, off) in [(4.3, 0.0), (2.1, 0.5), (6.45, -1.0), (1.2, 2.0)] {
            let reading: Vec<f64> = (0..CHANNELS).map(|c| mean(c, node) + off * (c as f64).cos()).collect();
            for nodes in [NODES, 8] {
                let (window, integral) = found(&reading, node + 0.2, nodes);
                let (misfit, marginal) = integral.expect("it is clear of the ends");
                let at = |i: usize| {
                    window.first as f64 + (i as f64 + 0.5) / STEPS as f64 * (window.nodes - 1) as f64
                };
                let density = |i: usize| (0.5 * (misfit - residual(&reading, at(i), window))).exp();
                let step = (window.nodes - 1) as f64 / STEPS as f64;
                let moment = |power: i32, from: f64| -> f64 {
                    (0..STEPS).map(|i| step * density(i) * (at(i) - from).powi(power)).sum()
                };
                let weight = moment(0, 0.0);
                let mean = moment(1, 0.0) / weight;
                let variance = moment(2, mean) / weight;
                assert!((marginal.weight / weight - 1.0).abs() < 1e-4, "{node}: {marginal:?} {weight}");
                assert!((marginal.mean - mean).abs() < 1e-3 * variance.sqrt(), "{node}: {marginal:?} {mean}");
                assert!((marginal.variance / variance - 1.0).abs() < 1e-3, "{node}: {marginal:?} {variance}");
                assert!(
                    (residual(&reading, marginal.mean, window) - misfit).abs() < 1e-2,
                    "{node}: {misfit}"
                );
            }
        }
    }

    #[test]
    fn a_reading_beyond_a_curves_ends_tells_where_to_look() {
        let reading: Vec<f64> = (0..CHANNELS).map(|c| mean(c, 6.5)).collect();
        let (window, integral) = found(&reading, 1.0, NODES);
        assert_eq!(window, Window { first: 0, nodes: 4 });
        assert!(matches!(integral, Err(Some(node)) if node > 2.9), "{integral:?}");
    }
}
