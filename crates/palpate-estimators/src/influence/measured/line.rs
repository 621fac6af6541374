//! One place of the surface: its mean readings along the nuisance coordinate, and how well they explain a reading.
//!
//! Between two nodes the mean is taken as straight, so the integral over the nuisance coordinate is that of a normal
//! density along a straight line through the space of readings: a density across it times a share along it.

use std::f64::consts::{PI, SQRT_2};

use super::Whitening;

/// Nodes of one place along the nuisance coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Whitened means, node by node.
    pub means: &'a [f64],
    /// v at each node.
    pub variances: &'a [f64],
}

/// How probable a place is: the likelihood integrated over the nuisance coordinate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marginal {
    /// ∫ exp(−(residual − reference)/2), over the nuisance coordinate in nodes.
    pub weight: f64,
    /// The same with the nuisance coordinate, in nodes, as a factor; and with its square.
    pub nuisance: f64,
    pub hidden_square: f64,
}

/// A stretch between two nodes, as seen from a reading.
///
/// With a = z − μ₀ and d = μ₁ − μ₀, both divided by the standard deviations: |a − s·d|² for s from 0 to 1.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// |a|², a·d, |d|².
    aa: f64,
    ad: f64,
    dd: f64,
}

impl<'a> Line<'a> {
    /// The least squared residual of the whitened reading, over the variance of noise and process.
    pub fn residual(self, reading: &[f64], noise: &Whitening) -> f64 {
        let residuals = self.stretches(reading, noise).map(|stretch| stretch.residual_at(stretch.foot()));
        residuals.fold(f64::INFINITY, f64::min)
    }

    /// The integral over the nuisance coordinate, relative to the likelihood of the residual `reference`.
    pub fn marginal(self, reading: &[f64], noise: &Whitening, reference: f64) -> Marginal {
        let mut sum = Marginal::default();
        for (i, stretch) in self.stretches(reading, noise).enumerate() {
            let Share { weight, middle, spread } = stretch.integral(reference);
            let nuisance = i as f64 + middle;
            sum.weight += weight;
            sum.nuisance += weight * nuisance;
            sum.hidden_square += weight * (nuisance * nuisance + spread);
        }
        sum
    }

    /// From each node to the next; one of no length where there is a single node.
    fn stretches(self, reading: &'a [f64], noise: &'a Whitening) -> impl Iterator<Item = Stretch> + 'a {
        let (channels, nodes) = (noise.channels(), self.variances.len());
        let node = move |i: usize| &self.means[i * channels..(i + 1) * channels];
        (0..nodes.saturating_sub(1).max(1)).map(move |i| {
            let next = (i + 1).min(nodes - 1);
            let share = 0.5 * (self.variances[i] + self.variances[next]);
            let mut stretch = Stretch { aa: 0.0, ad: 0.0, dd: 0.0 };
            for (((z, from), to), signal) in reading.iter().zip(node(i)).zip(node(next)).zip(&noise.signal) {
                let variance = 1.0 + share * signal;
                let (a, d) = (z - from, to - from);
                stretch.aa += a * a / variance;
                stretch.ad += a * d / variance;
                stretch.dd += d * d / variance;
            }
            if noise.gain > 0.0 { stretch.with_gain(reading, node(i), share, noise) } else { stretch }
        })
    }
}

/// What a stretch adds to the integral.
#[derive(Clone, Copy, Debug)]
struct Share {
    weight: f64,
    /// Mean and variance of s there.
    middle: f64,
    spread: f64,
}

/// So small a share of a normal distribution is a point, at the end next to it.
const FARTHEST: f64 = 1e-12;
/// Beyond this many halved squares below the reference a stretch has no weight.
const NEGLIGIBLE: f64 = 60.0;
/// A stretch shorter than this has the same likelihood all along.
const SHORT: f64 = 1e-4;

impl Stretch {
    /// With a gain that scatters by γ about 1: the covariance grows by γ²·μ·μᵀ, so with V the variances,
    /// |a|² becomes |a|² − γ²·(μᵀ·V⁻¹·a)²/(1 + γ²·μᵀ·V⁻¹·μ) (Sherman and Morrison). For a stretch of no length only.
    fn with_gain(mut self, reading: &[f64], mean: &[f64], share: f64, noise: &Whitening) -> Self {
        let (mut mm, mut ma) = (0.0, 0.0);
        for ((z, mean), signal) in reading.iter().zip(mean).zip(&noise.signal) {
            let scaled = mean / (1.0 + share * signal);
            mm += mean * scaled;
            ma += (z - mean) * scaled;
        }
        let gain2 = noise.gain * noise.gain;
        let growth = 1.0 + gain2 * mm;
        self.aa = (self.aa - gain2 * ma * ma / growth).max(0.0);
        self
    }

    /// The s of the least residual.
    fn foot(self) -> f64 {
        if self.dd > 0.0 { (self.ad / self.dd).clamp(0.0, 1.0) } else { 0.0 }
    }

    fn residual_at(self, s: f64) -> f64 {
        (self.aa - 2.0 * s * self.ad + s * s * self.dd).max(0.0)
    }

    /// ∫₀¹ exp(−(residual(s) − reference)/2) ds.
    fn integral(self, reference: f64) -> Share {
        let foot = self.foot();
        let least = self.residual_at(foot);
        if least - reference > NEGLIGIBLE {
            return Share { weight: 0.0, middle: foot, spread: 0.0 };
        }
        let scale = |residual: f64| (-0.5 * (residual - reference)).exp();
        let length = self.dd.sqrt();
        if length < SHORT {
            return Share { weight: scale(least), middle: 0.5, spread: 1.0 / 12.0 };
        }
        // Across: the residual that no s takes away. Along: a normal density of mean s₀ and deviation 1/length.
        let middle = self.ad / self.dd;
        let across = (self.aa - self.ad * middle).max(0.0);
        let (from, to) = (-middle * length, (1.0 - middle) * length);
        let share = normal_share(from, to);
        let weight = (2.0 * PI).sqrt() / length * share * scale(across);
        if share < FARTHEST {
            return Share { weight, middle: foot, spread: 0.0 };
        }
        // Mean and variance of a normal distribution cut off at both ends.
        let (low, high) = (normal_density(from) / share, normal_density(to) / share);
        let moved = low - high;
        let spread = (1.0 + from * low - to * high - moved * moved).max(0.0) / (length * length);
        Share { weight, middle: (middle + moved / length).clamp(0.0, 1.0), spread }
    }
}

/// The standard normal density.
fn normal_density(n: f64) -> f64 {
    (-0.5 * n * n).exp() / (2.0 * PI).sqrt()
}

/// P(from < n < to) for a standard normal n, exact in the tails.
fn normal_share(from: f64, to: f64) -> f64 {
    let below = |n: f64| 0.5 * libm::erfc(-n / SQRT_2);
    if from > 0.0 { below(-from) - below(-to) } else { below(to) - below(from) }
}
