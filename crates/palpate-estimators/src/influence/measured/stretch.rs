//! What lies between two nodes of the table along the nuisance coordinate, as seen from a reading.
//!
//! The mean is taken as straight between the nodes: with a = z − μ₀ and d = μ₁ − μ₀, both over the standard deviations, the residual
//! is |a − s·d|² for s from 0 to 1, and its likelihood a normal density of s, cut off at both ends.

use palpate_numerics::simd::Eight;
use std::f64::consts::PI;

/// Means of the nodes, in eights of channels, and their mean v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch<'a> {
    pub from: &'a [[f64; 8]],
    pub to: &'a [[f64; 8]],
    pub share: f64,
}

impl Stretch<'_> {
    /// As a whitened reading sees it. With a gain that scatters by γ about 1, the covariance grows by γ²·μ·μᵀ, so with V the variances |a|²
    /// becomes |a|² − γ²·(μᵀ·V⁻¹·a)²/(1 + γ²·μᵀ·V⁻¹·μ) (Sherman and Morrison); then the stretch has no length.
    #[inline(always)]
    pub fn seen<V: Eight>(self, reading: &[[f64; 8]], signal: &[[f64; 8]], gain: f64) -> Seen {
        let share = V::splat(self.share);
        let one = V::splat(1.0);
        let mut sums = [V::splat(0.0); 3];
        let with_gain = gain > 0.0;
        for (((z, from), to), signal) in reading.iter().zip(self.from).zip(self.to).zip(signal) {
            let (from, to) = (V::load(from), V::load(to));
            let weight = one / share.mul_add(V::load(signal), one);
            let a = V::load(z) - from;
            let d = if with_gain { from } else { to - from };
            sums[0] = (a * weight).mul_add(a, sums[0]);
            sums[1] = (a * weight).mul_add(d, sums[1]);
            sums[2] = (d * weight).mul_add(d, sums[2]);
        }
        let [aa, ad, dd] = [sums[0].sum(), sums[1].sum(), sums[2].sum()];
        if with_gain {
            let gain2 = gain * gain;
            return Seen { aa: (aa - gain2 * ad * ad / (1.0 + gain2 * dd)).max(0.0), ad: 0.0, dd: 0.0 };
        }
        Seen { aa, ad, dd }
    }
}

/// |a|², a·d and |d|².
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub aa: f64,
    pub ad: f64,
    pub dd: f64,
}

/// Contribution of a stretch to the integral over the nuisance coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    pub weight: f64,
    /// Mean and variance of s there.
    pub middle: f64,
    pub spread: f64,
}

/// Beyond this many halved squares below the reference a stretch has no weight.
const NEGLIGIBLE: f64 = 60.0;
/// A stretch shorter than this has the same likelihood all along.
const SHORT: f64 = 1e-4;
/// The residual this far above the least of a stretch ends the integral.
const END: f64 = 24.0;
/// Nodes and weights of Gauss and Legendre's rule with eight points from −1 to 1 (Abramowitz and Stegun, table 25.4).
const NODES: [f64; 8] = [
    -0.960_289_856_497_536_2,
    -0.796_666_477_413_626_7,
    -0.525_532_409_916_329,
    -0.183_434_642_495_649_8,
    0.183_434_642_495_649_8,
    0.525_532_409_916_329,
    0.796_666_477_413_626_7,
    0.960_289_856_497_536_2,
];
const WEIGHTS: [f64; 8] = [
    0.101_228_536_290_376_26,
    0.222_381_034_453_374_47,
    0.313_706_645_877_887_3,
    0.362_683_783_378_362,
    0.362_683_783_378_362,
    0.313_706_645_877_887_3,
    0.222_381_034_453_374_47,
    0.101_228_536_290_376_26,
];

impl Seen {
    /// The s of the least residual.
    #[inline(always)]
    pub fn foot(self) -> f64 {
        if self.dd > 0.0 { (self.ad / self.dd).clamp(0.0, 1.0) } else { 0.0 }
    }

    #[inline(always)]
    pub fn residual_at(self, s: f64) -> f64 {
        (self.aa - 2.0 * s * self.ad + s * s * self.dd).max(0.0)
    }

    /// ∫₀¹ exp(−(residual(s) − reference)/2) ds: in closed form where the normal density lies within, by Gauss and Legendre's rule over the
    /// part that matters where an end cuts it.
    #[inline(always)]
    pub fn integral<V: Eight>(self, reference: f64) -> Share {
        let foot = self.foot();
        let least = self.residual_at(foot);
        if least - reference > NEGLIGIBLE {
            return Share { weight: 0.0, middle: foot, spread: 0.0 };
        }
        let length = self.dd.sqrt();
        if length < SHORT {
            return Share { weight: (-0.5 * (least - reference)).exp(), middle: 0.5, spread: 1.0 / 12.0 };
        }
        // From a foot beyond an end, the residual rises faster.
        let slope = (self.ad / length - foot * length).abs();
        let far = ((slope * slope + END).sqrt() - slope) / length;
        if foot - far >= 0.0 && foot + far <= 1.0 {
            let weight = (2.0 * PI).sqrt() / length * (-0.5 * (least - reference)).exp();
            return Share { weight, middle: foot, spread: 1.0 / (length * length) };
        }
        let (from, to) = ((foot - far).max(0.0), (foot + far).min(1.0));
        let parts = if (to - from) * length > 5.0 { 2 } else { 1 };
        let half = 0.5 * (to - from) / f64::from(parts);
        let [mut weight, mut first, mut second] = [0.0; 3];
        for part in 0..parts {
            let middle = from + half * f64::from(2 * part + 1);
            let s = V::load(&NODES).mul_add(V::splat(half), V::splat(middle));
            let rise = s.mul_add(V::splat(self.dd), V::splat(-2.0 * self.ad));
            let residual = s.mul_add(rise, V::splat(self.aa - reference));
            let density = (residual * V::splat(-0.5)).exponential() * V::load(&WEIGHTS) * V::splat(half);
            let off = s - V::splat(foot);
            weight += density.sum();
            first += (density * off).sum();
            second += (density * off * off).sum();
        }
        let mean = first / weight;
        Share { weight, middle: foot + mean, spread: (second / weight - mean * mean).max(0.0) }
    }
}
