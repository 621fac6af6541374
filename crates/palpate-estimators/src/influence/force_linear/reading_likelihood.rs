//! Likelihood of a reading on a force-linear surface.
//!
//! Let d be the reading minus the offsets and f the influences, over the noise. Channel k has the variance
//! S_k(F) = 1 + r_k·w_k(F), w_k(F) = ω_k + 2F·β_k + F²·v_k (posterior variances ω of the offset and v of the
//! influence, covariance β), and the common-mode error g_k = u_k·√w_k ([`super::shared_errors`]). For the
//! [prior](crate::force_prior) p(F),
//!
//! p(a | d) ∝ ∫ p(F)·|V|^(−½)·exp(−½·(d − F·f)ᵀ·V⁻¹·(d − F·f)) dF, V = diag(S) + g·gᵀ,
//!
//! with m(a) for the 1 if noise depends on the position, and φ(F) for F. Without the determinant, large v
//! between presses would fit every reading.

use super::locator::{
    COVARIANCES, CellScan, ForceLinearContents, ForceLinearLocator, LAYERS, VALUES, VARIANCES,
};
use crate::distributed_contact::{BoundedContact, distributed_contact_bound, distributed_contact_score};
use crate::force_prior::{ForceIntegral, ForceLikelihood};
use crate::influence::grid::Axis;
use crate::influence::inversion::{
    CellFit, Cells, ContactLikelihood, ForceKnowledge, Inversion, Limits, PlaceFit, Slopes, fit_cells,
};
use crate::influence::lanes::{LANES, Lanes, in_lanes};
use crate::influence::levenberg::{Equations, Unknowns};
use crate::recording::Recording;
use crate::status::{chi_squared_bound, recording_bounds};
use palpate_core::Estimate;
use palpate_numerics::{SharedError, simd, with_shared_error};

impl ForceLinearLocator {
    pub(super) fn likelihood(&self, relative: &[f64]) -> ReadingLikelihood<'_> {
        ReadingLikelihood {
            locator: self,
            reading: in_lanes(relative),
            noise: 1.0,
            between: Vec::new(),
            slopes: Vec::new(),
            weights: Vec::new(),
            shared: Vec::new(),
        }
    }

    pub(super) fn limit_residuals(&mut self, recording: &Recording) {
        let freedom = self.stored.live.len().saturating_sub(self.unknowns());
        let normal =
            [chi_squared_bound(freedom), distributed_contact_bound(self.stored.prior.extent.dimensions())];
        let [misfit, spread] = recording_bounds(normal, recording, |reading| {
            let mut likelihood = Inversion::new(self.likelihood(&self.relative(reading)));
            [likelihood.misfit(), likelihood.spread()]
        });
        (self.stored.residual_limit, self.stored.spread_limit) = (misfit, Some(spread));
    }

    fn force_knowledge(&self) -> ForceKnowledge {
        self.stored.known_force_n.map_or(ForceKnowledge::Estimated, ForceKnowledge::Known)
    }

    pub(super) fn estimate(&self, relative: &[f64]) -> Estimate {
        let ForceLinearContents { residual_limit, spread_limit, .. } = self.stored;
        let limits = Limits { misfit: residual_limit, spread: spread_limit.unwrap_or(f64::INFINITY) };
        Inversion::new(self.likelihood(relative)).estimate(self.force_knowledge(), limits)
    }

    /// Contact by summation over the grid.
    #[cfg(test)]
    pub fn summed_everywhere(&self, reading: &[f64], per_node: usize) -> palpate_core::ContactEstimate {
        Inversion::new(self.likelihood(&self.relative(reading)))
            .summed_everywhere(self.force_knowledge(), per_node)
    }
}

#[derive(Debug)]
pub(super) struct ReadingLikelihood<'a> {
    locator: &'a ForceLinearLocator,
    reading: Vec<Lanes>,
    /// Noise variance at the position over an untouched board's.
    noise: f64,
    between: Vec<Lanes>,
    slopes: Vec<Slopes>,
    weights: Vec<Lanes>,
    /// g.
    shared: Vec<Lanes>,
}

struct WeighChannels<'a, const SHARED: bool> {
    reading: &'a [Lanes],
    /// f, v and β.
    functions: [&'a [Lanes]; LAYERS],
    offset_variances: &'a [Lanes],
    /// r and u.
    own: &'a [Lanes],
    shared: &'a [Lanes],
    noise: f64,
    force_n: f64,
}

/// dᵀ·V⁻¹·d, fᵀ·V⁻¹·d, fᵀ·V⁻¹·f and ln|V|, over the noise.
#[derive(Clone, Copy, Debug)]
struct WeightedSums {
    dd: f64,
    fd: f64,
    ff: f64,
    log_determinant: f64,
}

impl<const SHARED: bool> simd::Kernel for WeighChannels<'_, SHARED> {
    type Output = WeightedSums;
    const FUSED: bool = false;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: simd::Simd>(self) -> WeightedSums {
        const LARGE: f64 = 1e30;
        let Self {
            reading,
            functions: [values, variances, covariances],
            offset_variances,
            own,
            shared,
            noise,
            force_n,
        } = self;
        let mut sums = [[0.0; LANES]; 3];
        // Σ g·d/S, Σ g·f/S and Σ g²/S.
        let mut with_shared = [[0.0; LANES]; 3];
        // One logarithm for many channels, taken ahead of overflow of the product.
        let (mut product, mut log_determinant) = ([1.0; LANES], 0.0);
        for g in 0..reading.len() {
            let (mut spreads, mut weights) = ([0.0; LANES], [0.0; LANES]);
            for l in 0..LANES {
                let (v, beta) = (variances[g][l].max(0.0), covariances[g][l]);
                spreads[l] = (offset_variances[g][l] + force_n * (2.0 * beta + force_n * v)).max(0.0);
                let own = if SHARED { own[g][l] * spreads[l] } else { spreads[l] };
                weights[l] = 1.0 / (noise + own);
                let (d, f) = (reading[g][l], values[g][l]);
                sums[0][l] += weights[l] * d * d;
                sums[1][l] += weights[l] * f * d;
                sums[2][l] += weights[l] * f * f;
                product[l] *= 1.0 + own / noise;
            }
            if SHARED {
                for l in 0..LANES {
                    let error = shared[g][l] * spreads[l].sqrt();
                    let weighed = weights[l] * error;
                    with_shared[0][l] += weighed * reading[g][l];
                    with_shared[1][l] += weighed * values[g][l];
                    with_shared[2][l] += weighed * error;
                }
            }
            if product.iter().any(|product| *product > LARGE) {
                log_determinant += product.iter().map(|product| product.ln()).sum::<f64>();
                product = [1.0; LANES];
            }
        }
        let [low, high] = [0, 4].map(|i| product[i] * product[i + 1] * product[i + 2] * product[i + 3]);
        let [dd, fd, ff] = sums.map(|lanes| lanes.iter().sum());
        log_determinant += low.ln() + high.ln();
        if !SHARED {
            return WeightedSums { dd, fd, ff, log_determinant };
        }
        let [gd, gf, gg] = with_shared.map(|lanes| lanes.iter().sum());
        WeightedSums {
            dd: with_shared_error(dd, gd, gd, gg),
            fd: with_shared_error(fd, gd, gf, gg),
            ff: with_shared_error(ff, gf, gf, gg),
            log_determinant: log_determinant + gg.ln_1p(),
        }
    }
}

impl ReadingLikelihood<'_> {
    fn weighed(&self, force_n: f64) -> WeightedSums {
        let ForceLinearLocator { offset_variances, own, shared, layers, .. } = self.locator;
        let of = |layer: usize| &self.between[layer * layers.groups()..(layer + 1) * layers.groups()];
        let functions = [of(VALUES), of(VARIANCES), of(COVARIANCES)];
        let noise = self.locator.noise() * self.noise;
        let reading = &self.reading;
        let weighed = if shared.is_empty() {
            let channels =
                WeighChannels::<false> { reading, functions, offset_variances, own, shared, noise, force_n };
            simd::run_loops(channels)
        } else {
            let channels =
                WeighChannels::<true> { reading, functions, offset_variances, own, shared, noise, force_n };
            simd::run_loops(channels)
        };
        // `log_determinant` is relative to the local noise.
        let of_place = self.locator.stored.live.len() as f64 * self.noise.ln();
        let share = self.locator.stored.channels_as_one.recip();
        WeightedSums {
            dd: share * weighed.dd,
            fd: share * weighed.fd,
            ff: share * weighed.ff,
            log_determinant: share * (weighed.log_determinant + of_place),
        }
    }

    /// Writes whitened d and f; returns the log determinant up to a constant.
    pub(super) fn whiten(&mut self, at: Unknowns, channels: &mut Vec<[f64; 2]>) -> f64 {
        self.weigh(at);
        let ForceLinearLocator { layers, stored, .. } = self.locator;
        layers.interpolate([at[0], at[1]], VALUES..VALUES + 1, &mut self.between);
        let [weights, reading, values] =
            [&self.weights, &self.reading, &self.between].map(|lanes| lanes.as_flattened());
        let live = stored.live.len();
        channels.clear();
        channels.extend((0..live).map(|c| [reading[c], values[c]].map(|value| weights[c].sqrt() * value)));
        let mut log_determinant = -weights[..live].iter().map(|weight| weight.ln()).sum::<f64>();
        if !self.shared.is_empty() {
            let shared = self.shared_error();
            shared.whiten(channels);
            log_determinant += shared.log_determinant();
        }
        log_determinant / stored.channels_as_one
    }

    /// Values over the independent standard deviations.
    fn over_own(&self, values: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
        let weights = self.weights.as_flattened().iter().take(self.locator.stored.live.len());
        weights.zip(values).map(|(weight, value)| weight.sqrt() * value)
    }

    fn shared_error(&self) -> SharedError {
        SharedError::new(self.over_own(self.shared.as_flattened().iter().copied()).collect())
    }
}

impl ContactLikelihood for ReadingLikelihood<'_> {
    fn axes(&self) -> [Axis; 2] {
        self.locator.axes()
    }

    fn cells(&self) -> Cells {
        Cells::new(self.axes().map(|axis| axis.count), 1)
    }

    fn scan(&self, fits: &mut Vec<CellFit>) {
        let live = self.locator.stored.live.len();
        match &self.locator.scan {
            CellScan::Bounded(scan) => fit_cells(scan, &self.reading, live, fits),
            CellScan::Broad(scan) => fit_cells(scan, &self.reading, live, fits),
        }
    }

    /// Large variances of the calibration change too much between nodes.
    fn bounds_are_loose(&self) -> bool {
        let ForceLinearContents { channels_as_one, .. } = self.locator.stored;
        !self.locator.shared.is_empty() || channels_as_one > 1.0 || self.locator.is_uncertain
    }

    fn lengths(&self, [x, y]: [usize; 2], response_n: f64) -> [f64; 2] {
        self.locator.lengths[x * self.locator.stored.y.count + y].map(|way| way * response_n.abs())
    }

    /// Range of φ.
    fn range(&self) -> Option<(f64, f64)> {
        self.locator.known_response_n().is_none().then(|| self.locator.force_prior.ends_n())
    }

    fn weigh(&mut self, [x, y, response_n]: Unknowns) {
        let ForceLinearLocator { layers, offset_variances, own, shared, .. } = self.locator;
        layers.interpolate([x, y], VARIANCES..LAYERS, &mut self.between);
        let noise = self.locator.noise() * self.locator.noise_at([x, y]);
        let as_one = self.locator.stored.channels_as_one;
        let (variances, covariances) = self.between.split_at(self.reading.len());
        let spread = |g: usize, l: usize| {
            let v = variances[g][l].max(0.0);
            (offset_variances[g][l] + response_n * (2.0 * covariances[g][l] + response_n * v)).max(0.0)
        };
        let weight = |g: usize, l: usize| 1.0 / (as_one * (noise + own[g][l] * spread(g, l)));
        let error = |g: usize, l: usize| shared[g][l] * (as_one * spread(g, l)).sqrt();
        self.weights.clear();
        self.weights.extend((0..self.reading.len()).map(|g| std::array::from_fn(|l| weight(g, l))));
        self.shared.clear();
        self.shared.extend((0..shared.len()).map(|g| std::array::from_fn(|l| error(g, l))));
    }

    fn equations(&mut self, [x, y, response_n]: Unknowns) -> Equations {
        let ForceLinearLocator { layers, force_prior, .. } = self.locator;
        layers.interpolate_slopes([x, y], VALUES..VALUES + 1, &mut self.slopes);
        let of_group = |g: usize| {
            let [f, along, across] = &self.slopes[g];
            let residual = std::array::from_fn(|l| self.reading[g][l] - response_n * f[l]);
            let times = |slopes: &Lanes| slopes.map(|slope| response_n * slope);
            (self.weights[g], residual, [times(along), times(across), *f])
        };
        let mut equations = Equations::new((0..self.reading.len()).map(of_group));
        if !self.shared.is_empty() {
            let errors = self.shared.iter().enumerate().map(|(g, shared)| (of_group(g), *shared));
            equations = equations.with_shared_errors(errors);
        }
        match self.range() {
            Some(_) => equations.with_prior(force_prior.terms(response_n)),
            None => equations,
        }
    }

    fn spread(&mut self, at: Unknowns) -> f64 {
        self.weigh(at);
        let shared = self.shared_error();
        let whitened = |values: &mut dyn Iterator<Item = f64>| {
            let mut rows: Vec<[f64; 1]> = self.over_own(values).map(|value| [value]).collect();
            shared.whiten(&mut rows);
            rows.into_flattened()
        };
        let mut values = Vec::new();
        let reads = |[x, y, response_n]: Unknowns| -> Vec<f64> {
            self.locator.layers.interpolate([x, y], VALUES..VALUES + 1, &mut values);
            whitened(&mut values.as_flattened().iter().map(|f| response_n * f))
        };
        let [x, y] = self.axes().map(|axis| (0.0, (axis.count - 1) as f64));
        let about = BoundedContact { at, ends: [x, y, self.range().unwrap_or((at[2], at[2]))] };
        let reading = whitened(&mut self.reading.as_flattened().iter().copied());
        distributed_contact_score(about, reading, reads)
    }

    /// φ by steps from `latent`, each with the last one's variances.
    fn fit_place(&mut self, place: [f64; 2], latent: f64) -> PlaceFit {
        /// Two steps leave less than a thousandth.
        const STEPS: usize = 2;
        let [x, y] = self.axes();
        let margin = x.margin_cost(place[0]) + y.margin_cost(place[1]);
        self.locator.layers.interpolate(place, 0..LAYERS, &mut self.between);
        self.noise = self.locator.noise_at(place);
        if self.range().is_none() {
            let WeightedSums { dd, fd, ff, log_determinant } = self.weighed(latent);
            let misfit = (dd + latent * (latent * ff - 2.0 * fd)).max(0.0);
            return PlaceFit {
                misfit,
                cost: misfit + log_determinant + margin,
                latent,
                latent_variance: 0.0,
            };
        }
        let prior = &self.locator.force_prior;
        let response_n = (0..STEPS).fold(latent, |response_n, _| {
            let WeightedSums { fd, ff, .. } = self.weighed(response_n);
            prior.estimate_n(fd, ff)
        });
        let WeightedSums { dd, fd, ff, log_determinant } = self.weighed(response_n);
        let misfit = (dd + response_n * (response_n * ff - 2.0 * fd)).max(0.0);
        let likelihood = ForceLikelihood { b: fd, a: ff, at_n: response_n, misfit };
        let ForceIntegral { peak_cost, width_cost, mean_n, variance_n2 } = prior.integrate(likelihood);
        PlaceFit {
            misfit,
            cost: peak_cost + log_determinant + width_cost + margin,
            latent: mean_n,
            latent_variance: variance_n2,
        }
    }

    fn force(&self, latent: f64, variance: f64) -> (f64, f64) {
        self.locator.stored.prior.force_of_response(latent, variance)
    }
}
