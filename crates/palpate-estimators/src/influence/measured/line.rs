//! Integration over the nuisance coordinate in straight segments: a normal density across times a probability
//! along.

use crate::influence::lanes::{Lanes, in_lanes, sum_of};
use crate::influence::noise::Whitening;
use palpate_numerics::normal_between;
use palpate_numerics::simd::{Arithmetic, InstructionSet, Kernel, Simd, Vector};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Whitened, node by node.
    pub means: &'a [Lanes],
    /// v.
    pub variances: &'a [f64],
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct WhiteNoise {
    /// d: signal over noise variance.
    pub signal: Vec<Lanes>,
    /// γ: standard deviation of a common gain.
    pub gain: f64,
}

impl WhiteNoise {
    pub fn new(whitening: &Whitening) -> Self {
        Self { signal: in_lanes(&whitening.signal), gain: whitening.gain }
    }

    /// 1/V of a group.
    pub fn weights(&self, v: f64, group: usize) -> Lanes {
        self.signal[group].map(|signal| 1.0 / (1.0 + v * signal))
    }

    pub fn without_gain(&self) -> Self {
        Self { signal: self.signal.clone(), gain: 0.0 }
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marginal {
    /// ∫ exp(−(residual − reference)/2), over the nuisance coordinate in nodes.
    pub weight: f64,
    /// Mean and variance, in nodes.
    pub mean: f64,
    pub variance: f64,
}

/// Segment between nodes: |a − s·d|² for s from 0 to 1, with a = z − μ₀ and d = μ₁ − μ₀ over the standard
/// deviations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// |a|², a·d, |d|².
    aa: f64,
    ad: f64,
    dd: f64,
}

impl Line<'_> {
    /// Least squared residual, and the integral relative to it.
    pub fn marginal(
        self,
        reading: &[Lanes],
        noise: &WhiteNoise,
        stretches: &mut Vec<Stretch>,
    ) -> (f64, Marginal) {
        let least = self.residual(reading, noise, stretches);
        let (mut weight, mut first, mut second) = (0.0, 0.0, 0.0);
        for (i, stretch) in stretches.iter().enumerate() {
            let share = stretch.integral(least);
            let nuisance = i as f64 + share.middle;
            weight += share.weight;
            first += share.weight * nuisance;
            second += share.weight * (nuisance * nuisance + share.spread);
        }
        let mean = first / weight;
        (least, Marginal { weight, mean, variance: (second / weight - mean * mean).max(0.0) })
    }

    /// Least squared residual; writes the segments to `stretches`.
    pub fn residual(self, reading: &[Lanes], noise: &WhiteNoise, stretches: &mut Vec<Stretch>) -> f64 {
        InstructionSet::best().run(FindStretches {
            line: self,
            reading,
            signal: &noise.signal,
            out: stretches,
        });
        if let ([stretch], true) = (&mut stretches[..], noise.gain > 0.0) {
            stretch.explain_by_gain(reading, self, noise);
        }
        stretches.iter().map(|stretch| stretch.residual_at(stretch.foot())).fold(f64::INFINITY, f64::min)
    }
}

/// Segments between nodes; one of zero length for a single node.
struct FindStretches<'a> {
    line: Line<'a>,
    reading: &'a [Lanes],
    signal: &'a [Lanes],
    out: &'a mut Vec<Stretch>,
}

impl Kernel for FindStretches<'_> {
    type Output = ();
    const FUSED: bool = true;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: Simd>(self) {
        let Self { line: Line { means, variances }, reading, signal, out } = self;
        let (groups, nodes) = (reading.len(), variances.len());
        let (zero, one) = (S::F64::splat(0.0), S::F64::splat(1.0));
        out.clear();
        for i in 0..nodes.saturating_sub(1).max(1) {
            let next = (i + 1).min(nodes - 1);
            let share = S::F64::splat(0.5 * (variances[i] + variances[next]));
            let mut sums = [zero; 3];
            for g in 0..groups {
                let [z, signal, from, to] =
                    [&reading[g], &signal[g], &means[i * groups + g], &means[next * groups + g]]
                        .map(S::F64::load);
                let weights = one / share.mul_add(signal, one);
                let (a, d) = (z - from, to - from);
                let (wa, wd) = (weights * a, weights * d);
                sums.iter_mut()
                    .zip([(wa, a), (wa, d), (wd, d)])
                    .for_each(|(sum, (p, q))| *sum = p.mul_add(q, *sum));
            }
            let [aa, ad, dd] = sums.map(sum_of);
            out.push(Stretch { aa, ad, dd });
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Share {
    weight: f64,
    /// Mean and variance of s.
    middle: f64,
    spread: f64,
}

/// Negligible excess of the squared residual.
const NEGLIGIBLE: f64 = 60.0;
const SHORT: f64 = 1e-4;

impl Stretch {
    /// Adds a common gain error, for zero length: |a|² becomes |a|² − γ²·(μᵀ·V⁻¹·a)²/(1 + γ²·μᵀ·V⁻¹·μ)
    /// (Sherman and Morrison).
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

    /// s of the least residual.
    fn foot(self) -> f64 {
        if self.dd > 0.0 { (self.ad / self.dd).clamp(0.0, 1.0) } else { 0.0 }
    }

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
        // Across: residual perpendicular to the segment. Along: a normal density of mean s₀ and standard
        // deviation 1/length.
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
