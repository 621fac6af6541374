//! Learnt readings, tabulated over position and nuisance coordinate, and how well the places of the table explain a reading.
//!
//! Along the nuisance coordinate the mean is taken as straight between two nodes, so the integral over it is that of a normal density
//! along a straight line through the space of readings: a density across it times a share along it.

use crate::influence::grid::Axis;
use crate::influence::lanes::{LANES, Lanes, in_lanes};
use crate::influence::noise::Whitening;
use palpate_numerics::normal_between;
use palpate_numerics::simd::{Kernel, Simd, run_loops};
use std::f64::consts::PI;

/// Whitened mean readings and their relative variance at the nodes of a grid.
///
/// Index of a node: (x·count_y + y)·count_nuisance + nuisance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Along the surface, in metres.
    pub x: Axis,
    /// Across it, in metres; a single node on a one-dimensional surface.
    pub y: Axis,
    /// The nuisance coordinate on its scale; a single node where there is none.
    pub nuisance: Axis,
    /// W·f̄, channel by channel, node by node.
    pub means: Vec<f64>,
    /// v: the process's variance over its signal's, 0 to 1, node by node.
    pub variances: Vec<f64>,
}

impl Table {
    /// The same for noise of `factor` times the deviation.
    pub(super) fn widened(mut self, factor: f64) -> Self {
        self.means.iter_mut().for_each(|value| *value /= factor);
        self
    }

    /// Places (x, y).
    pub fn places(&self) -> usize {
        self.x.count * self.y.count
    }

    /// Channels of a reading.
    pub(super) fn channels(&self) -> usize {
        self.means.len() / self.variances.len().max(1)
    }

    /// The mean of a channel at a node of a place.
    pub(super) fn mean(&self, place: usize, node: usize, channel: usize) -> f64 {
        self.means[(place * self.nuisance.count + node) * self.channels() + channel]
    }
}

/// Nodes of one place along the nuisance coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Whitened means, eight channels side by side, node by node.
    pub means: &'a [Lanes],
    /// v at each node.
    pub variances: &'a [f64],
}

/// Noise of whitened channels, eight side by side.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct WhiteNoise {
    /// d: the signal's variance over the noise's.
    pub signal: Vec<Lanes>,
    /// γ: the deviation of a gain that all channels share.
    pub gain: f64,
}

impl WhiteNoise {
    pub fn new(whitening: &Whitening) -> Self {
        Self { signal: in_lanes(&whitening.signal), gain: whitening.gain }
    }

    /// The same of a process that knows everything, and without a gain.
    pub fn unit(&self) -> Self {
        Self { signal: vec![[0.0; LANES]; self.signal.len()], gain: 0.0 }
    }
}

/// Probability of a place: the likelihood integrated over the nuisance coordinate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marginal {
    /// ∫ exp(−(residual − reference)/2), over the nuisance coordinate in nodes.
    pub weight: f64,
    /// The same with the nuisance coordinate, in nodes, as a factor; and with its square.
    pub nuisance: f64,
    pub nuisance_square: f64,
}

impl Marginal {
    /// The same of a nuisance coordinate that is so many nodes further.
    pub fn shift(&mut self, nodes: f64) {
        self.nuisance_square += nodes * (2.0 * self.nuisance + nodes * self.weight);
        self.nuisance += nodes * self.weight;
    }
}

/// A stretch between two nodes, as seen from a reading.
///
/// With a = z − μ₀ and d = μ₁ − μ₀, both divided by the standard deviations: |a − s·d|² for s from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// |a|², a·d, |d|².
    aa: f64,
    ad: f64,
    dd: f64,
}

impl Line<'_> {
    /// The least squared residual of the whitened reading, over the variance of noise and process, and the integral over the
    /// nuisance coordinate relative to the likelihood of that residual.
    pub fn explain(
        self,
        reading: &[Lanes],
        noise: &WhiteNoise,
        stretches: &mut Vec<Stretch>,
    ) -> (f64, Marginal) {
        let least = self.residual(reading, noise, stretches);
        let mut sum = Marginal::default();
        for (i, stretch) in stretches.iter().enumerate() {
            let Share { weight, middle, spread } = stretch.integral(least);
            let nuisance = i as f64 + middle;
            sum.weight += weight;
            sum.nuisance += weight * nuisance;
            sum.nuisance_square += weight * (nuisance * nuisance + spread);
        }
        (least, sum)
    }

    /// The least squared residual; `stretches` become those of the line.
    pub fn residual(self, reading: &[Lanes], noise: &WhiteNoise, stretches: &mut Vec<Stretch>) -> f64 {
        run_loops(FindStretches { line: self, reading, signal: &noise.signal, out: stretches });
        if let ([stretch], true) = (&mut stretches[..], noise.gain > 0.0) {
            stretch.explain_by_gain(reading, self, noise);
        }
        stretches.iter().map(|stretch| stretch.residual_at(stretch.foot())).fold(f64::INFINITY, f64::min)
    }
}

/// Finds the stretches from each node of a line to the next; one of no length where there is a single node.
struct FindStretches<'a> {
    line: Line<'a>,
    reading: &'a [Lanes],
    signal: &'a [Lanes],
    out: &'a mut Vec<Stretch>,
}

impl Kernel for FindStretches<'_> {
    type Output = ();
    const FUSED: bool = false;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: Simd>(self) {
        let Self { line: Line { means, variances }, reading, signal, out } = self;
        let (groups, nodes) = (reading.len(), variances.len());
        out.clear();
        for i in 0..nodes.saturating_sub(1).max(1) {
            let next = (i + 1).min(nodes - 1);
            let share = 0.5 * (variances[i] + variances[next]);
            let mut sums = [[0.0; LANES]; 3];
            for g in 0..groups {
                let (z, signal) = (&reading[g], &signal[g]);
                let (from, to) = (&means[i * groups + g], &means[next * groups + g]);
                for l in 0..LANES {
                    let weight = 1.0 / (1.0 + share * signal[l]);
                    let (a, d) = (z[l] - from[l], to[l] - from[l]);
                    sums[0][l] += a * a * weight;
                    sums[1][l] += a * d * weight;
                    sums[2][l] += d * d * weight;
                }
            }
            let [aa, ad, dd] = sums.map(|lanes| lanes.iter().sum());
            out.push(Stretch { aa, ad, dd });
        }
    }
}

/// Contribution of a stretch to the integral.
#[derive(Clone, Copy, Debug)]
struct Share {
    weight: f64,
    /// Mean and variance of s there.
    middle: f64,
    spread: f64,
}

/// Beyond this many halved squares below the reference a stretch has no weight.
const NEGLIGIBLE: f64 = 60.0;
/// A stretch shorter than this has the same likelihood all along.
const SHORT: f64 = 1e-4;

impl Stretch {
    /// With a gain that scatters by γ about 1: the covariance grows by γ²·μ·μᵀ, so with V the variances,
    /// |a|² becomes |a|² − γ²·(μᵀ·V⁻¹·a)²/(1 + γ²·μᵀ·V⁻¹·μ) (Sherman and Morrison). For a stretch of no length only.
    fn explain_by_gain(&mut self, reading: &[Lanes], line: Line, noise: &WhiteNoise) {
        let (mut mm, mut ma) = (0.0, 0.0);
        let channels = reading.as_flattened().iter().zip(line.means.as_flattened());
        for ((z, mean), signal) in channels.zip(noise.signal.as_flattened()) {
            let scaled = mean / (1.0 + line.variances[0] * signal);
            mm += mean * scaled;
            ma += (z - mean) * scaled;
        }
        let gain2 = noise.gain * noise.gain;
        self.aa = (self.aa - gain2 * ma * ma / (1.0 + gain2 * mm)).max(0.0);
    }

    /// The s of the least residual.
    fn foot(self) -> f64 {
        if self.dd > 0.0 { (self.ad / self.dd).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The squared residual at s.
    pub fn residual_at(self, s: f64) -> f64 {
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
        let part = normal_between(from, to);
        Share {
            weight: ((2.0 * PI).sqrt().ln() + part.ln_share - 0.5 * (across - reference)).exp() / length,
            middle: (middle + part.mean / length).clamp(0.0, 1.0),
            spread: part.variance / (length * length),
        }
    }
}
