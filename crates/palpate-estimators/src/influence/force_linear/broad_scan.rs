//! Coarse search with a log-normal prior of the force.
//!
//! Forces span decades, and variances grow with φ. The least-squares φ of a node is computed with the
//! variances of φ = 0 and of the largest φ; the larger result gives the node's variances. The prior of ln φ
//! adds the cost ln(1 + s²·z²) at the signal-to-noise ratio z.

use crate::force_prior::LogNormalPrior;
use crate::influence::inversion::CellBlocks;
use crate::influence::lanes::{LANES, Lanes};
use palpate_numerics::simd::EightLanes;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct BroadScan {
    prior: LogNormalPrior,
    places: usize,
    channels: usize,
    terms: Vec<Terms>,
    /// Lower bound of the log determinant.
    constants: Vec<Lanes>,
}

/// Influence f and variance noise + ω + φ·(2·β + φ·v) of a channel at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChannelAtPlace {
    pub f: f64,
    pub noise: f64,
    /// ω.
    pub offset_variance: f64,
    pub beta: f64,
    pub v: f64,
    pub least: f64,
}

impl ChannelAtPlace {
    pub fn scaled(self, noise: f64, calibration: f64) -> Self {
        Self {
            noise: noise * self.noise,
            offset_variance: calibration * self.offset_variance,
            beta: calibration * self.beta,
            v: calibration * self.v,
            ..self
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Terms {
    f: Lanes,
    noise: Lanes,
    offset_variance: Lanes,
    twice_beta: Lanes,
    v: Lanes,
}

/// Σ d²/S, Σ f·d/S and Σ f²/S.
struct Sums<V> {
    dd: V,
    fd: V,
    ff: V,
}

impl<V: EightLanes> Sums<V> {
    /// Least-squares φ.
    ///
    /// Not a closure: closures are not compiled for the instructions of the caller.
    #[inline(always)]
    fn response(&self, greatest: V) -> V {
        (self.fd / self.ff).max(V::splat(0.0)).min(greatest)
    }
}

impl BroadScan {
    pub fn new(
        places: usize,
        channels: usize,
        prior: LogNormalPrior,
        channel: impl Fn(usize, usize) -> ChannelAtPlace,
    ) -> Self {
        const NO_PLACE: Terms = Terms {
            f: [0.0; LANES],
            noise: [1.0; LANES],
            offset_variance: [0.0; LANES],
            twice_beta: [0.0; LANES],
            v: [0.0; LANES],
        };
        let blocks = places.div_ceil(LANES);
        let mut terms = vec![NO_PLACE; blocks * channels];
        let mut constants = vec![[0.0; LANES]; blocks];
        for place in 0..places {
            let (block, lane) = (place / LANES, place % LANES);
            for c in 0..channels {
                let ChannelAtPlace { f, noise, offset_variance, beta, v, least } = channel(place, c);
                let terms = &mut terms[block * channels + c];
                (terms.f[lane], terms.noise[lane], terms.offset_variance[lane]) = (f, noise, offset_variance);
                (terms.twice_beta[lane], terms.v[lane]) = (2.0 * beta, v);
                constants[block][lane] += least.ln();
            }
        }
        Self { prior, places, channels, terms, constants }
    }

    #[inline(always)] // Compiled for the instructions of its caller.
    fn sums<V: EightLanes>(&self, block: usize, reading: &[f64], response: V) -> Sums<V> {
        let zero = V::splat(0.0);
        let mut sums = Sums { dd: zero, fd: zero, ff: V::splat(f64::MIN_POSITIVE) };
        for (terms, d) in self.terms[block * self.channels..(block + 1) * self.channels].iter().zip(reading) {
            let (f, noise, offset_variance) =
                (V::load(&terms.f), V::load(&terms.noise), V::load(&terms.offset_variance));
            let (twice_beta, v) = (V::load(&terms.twice_beta), V::load(&terms.v));
            let variance =
                noise + response.mul_add(response.mul_add(v, twice_beta), offset_variance).max(zero);
            let (weight, d) = (V::splat(1.0) / variance, V::splat(*d));
            let (weighted_d, weighted_f) = (weight * d, weight * f);
            sums.dd = weighted_d.mul_add(d, sums.dd);
            sums.fd = weighted_f.mul_add(d, sums.fd);
            sums.ff = weighted_f.mul_add(f, sums.ff);
        }
        sums
    }
}

impl CellBlocks for BroadScan {
    fn cells(&self) -> usize {
        self.places
    }

    #[inline(always)]
    fn fits<V: EightLanes>(&self, block: usize, reading: &[f64]) -> [V; 3] {
        let (_, greatest_n) = self.prior.ends_n();
        let (zero, greatest) = (V::splat(0.0), V::splat(greatest_n));
        let by_noise = self.sums(block, reading, zero).response(greatest);
        let by_calibration = self.sums(block, reading, greatest).response(greatest);
        let sums = self.sums(block, reading, by_noise.max(by_calibration));
        let found = sums.response(greatest);
        let misfit = (sums.dd + found * (found * sums.ff - (sums.fd + sums.fd))).max(zero);
        let signals = (found * found * sums.ff).to_array().map(|square| self.prior.signal_cost(square));
        [misfit, misfit + V::load(&self.constants[block]) + V::load(&signals), found]
    }
}
