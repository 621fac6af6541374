//! Drift of the channels: random walk with a rate that is an Ornstein–Uhlenbeck process.
//!
//! Symbols, over each channel's noise: offset d, rate v with correlation time τ_v and standard deviation r,
//! walk w.
//!
//!   ḋ = v + w·ξ,  v̇ = −v/τ_v + r·√(2/τ_v)·η
//!
//! with ξ and η white (exponentially correlated rate, one derivative below R. A. Singer, *IEEE Trans. Aerosp.
//! Electron. Syst.* 6, 1970). Nine Kalman filters, three walks w times three rates r, are weighted by untouched
//! readings (D. T. Magill, *IEEE Trans. Autom. Control* 10, 1965).

use super::block::Block;
use super::consider::observation_covariance;
use crate::likelihood::Likelihood;
use ndarray::{Array1, Array2, s};
use palpate_numerics::Cholesky;

/// Drift of offsets, in units of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Candidate random walks, standard deviation after a second.
    pub walks_per_root_s: [f64; 3],
    /// Candidate standard deviations of the rate, in 1/s.
    pub rates_per_s: [f64; 3],
    /// Correlation time of the rate, in seconds.
    pub rate_s: f64,
}

impl Drift {
    /// Greatest walk of at least `walk_per_root_s`.
    pub(super) fn up_to(walk_per_root_s: f64) -> Self {
        let mut drift = Self::default();
        let [.., greatest] = &mut drift.walks_per_root_s;
        *greatest = greatest.max(walk_per_root_s);
        drift
    }
}

impl Default for Drift {
    /// Up to a tenth of the noise in a second; rates correlate over minutes.
    fn default() -> Self {
        Self { walks_per_root_s: [1e-3, 0.01, 0.1], rates_per_s: [0.0, 0.01, 0.1], rate_s: 300.0 }
    }
}

/// Longest prediction without observations.
const LONGEST_PREDICTION_S: f64 = 600.0;
/// Factor of the log evidence per observation: a memory of some minutes.
const FORGETTING: f64 = 0.999;

#[derive(Clone, Debug)]
pub(super) struct DriftFilter {
    pub config: Drift,
    models: Vec<DriftModel>,
    time_s: Option<f64>,
    /// d, v and covariance of d, mixed.
    offset: Array1<f64>,
    rate: Array1<f64>,
    pub covariance: Array2<f64>,
}

/// One walk and rate, with state (d, v).
#[derive(Clone, Debug)]
struct DriftModel {
    walk: f64,
    rate: f64,
    log_weight: f64,
    mean: Array1<f64>,
    covariance: Array2<f64>,
}

impl DriftFilter {
    /// Initial standard deviations over the noise, at least 1.
    pub fn new(config: Drift, offset_sd: &[f64]) -> Self {
        let channels = offset_sd.len();
        let variance = |i: usize| offset_sd[i].powi(2).max(1.0);
        let model = |walk: f64, rate: f64| {
            let variance = |i: usize| if i < channels { variance(i) } else { rate * rate };
            let covariance = Array2::from_diag(&Array1::from_iter((0..2 * channels).map(variance)));
            DriftModel { walk, rate, log_weight: 0.0, mean: Array1::zeros(2 * channels), covariance }
        };
        let walks = config.walks_per_root_s.into_iter();
        Self {
            config,
            models: walks.flat_map(|walk| config.rates_per_s.map(|rate| model(walk, rate))).collect(),
            time_s: None,
            offset: Array1::zeros(channels),
            rate: Array1::zeros(channels),
            covariance: Array2::from_diag(&Array1::from_iter((0..channels).map(variance))),
        }
    }

    pub fn offset_at(&self, i: usize, time_s: f64) -> f64 {
        let since_s = self.time_s.map_or(0.0, |own_s| (time_s - own_s).clamp(0.0, LONGEST_PREDICTION_S));
        self.offset[i] + since_s * self.rate[i]
    }

    pub fn observe(&mut self, likelihood: &dyn Likelihood, block: &Block) {
        let (time_s, offsets, contacts) = (block.time_s(), block.offsets(), block.contacts());
        let duration_s = self.time_s.map_or(0.0, |own_s| (time_s - own_s).clamp(0.0, LONGEST_PREDICTION_S));
        let noise = observation_covariance(likelihood.linearised(&contacts), block.count);
        let is_untouched = contacts.is_empty();
        for model in &mut self.models {
            model.predict(duration_s, self.config.rate_s);
            let evidence = model.update(&offsets, &noise);
            if is_untouched {
                model.log_weight = FORGETTING * model.log_weight + evidence.unwrap_or(0.0);
            }
        }
        self.time_s = Some(time_s);
        self.mix();
    }

    pub fn move_by(&mut self, moved: &[f64]) {
        for mean in self.models.iter_mut().map(|model| &mut model.mean).chain([&mut self.offset]) {
            mean.iter_mut().zip(moved).for_each(|(mean, moved)| *mean -= moved);
        }
    }

    fn mix(&mut self) {
        let channels = self.offset.len();
        let best = self.models.iter().map(|model| model.log_weight).fold(f64::NEG_INFINITY, f64::max);
        let shares: Vec<f64> = self.models.iter().map(|model| (model.log_weight - best).exp()).collect();
        let sum: f64 = shares.iter().sum();
        self.offset.fill(0.0);
        self.rate.fill(0.0);
        self.covariance.fill(0.0);
        for (model, share) in self.models.iter().zip(&shares) {
            self.offset.scaled_add(share / sum, &model.mean.slice(s![..channels]));
            self.rate.scaled_add(share / sum, &model.mean.slice(s![channels..]));
        }
        for (model, share) in self.models.iter().zip(&shares) {
            let off = &model.mean.slice(s![..channels]) - &self.offset;
            let column = off.view().insert_axis(ndarray::Axis(1));
            let own = &model.covariance.slice(s![..channels, ..channels]) + &column.dot(&column.t());
            self.covariance.scaled_add(share / sum, &own);
        }
    }
}

impl DriftModel {
    fn predict(&mut self, duration_s: f64, rate_s: f64) {
        let channels = self.mean.len() / 2;
        let (d, v) = (s![..channels], s![channels..]);
        let stays = (-duration_s / rate_s).exp();
        let rate = self.mean.slice(v).to_owned();
        self.mean.slice_mut(d).scaled_add(duration_s, &rate);
        self.mean.slice_mut(v).mapv_inplace(|rate| stays * rate);
        let (dd, dv) = (s![..channels, ..channels], s![..channels, channels..]);
        let (vd, vv) = (s![channels.., ..channels], s![channels.., channels..]);
        let rates = self.covariance.slice(vv).to_owned();
        let cross = self.covariance.slice(dv).to_owned();
        let mut offsets = self.covariance.slice_mut(dd);
        offsets.scaled_add(duration_s, &cross);
        offsets.scaled_add(duration_s, &cross.t());
        offsets.scaled_add(duration_s * duration_s, &rates);
        let mut moved = cross;
        moved.scaled_add(duration_s, &rates);
        moved.mapv_inplace(|cross| stays * cross);
        self.covariance.slice_mut(dv).assign(&moved);
        self.covariance.slice_mut(vd).assign(&moved.t());
        self.covariance.slice_mut(vv).mapv_inplace(|rates| stays * stays * rates);
        // Process noise of the rate in the step, approximated as uniform.
        let unrest = self.rate * self.rate * (1.0 - stays * stays);
        for i in 0..channels {
            let at = channels + i;
            self.covariance[[i, i]] +=
                self.walk * self.walk * duration_s + unrest * duration_s * duration_s / 3.0;
            self.covariance[[i, at]] += 0.5 * unrest * duration_s;
            self.covariance[[at, i]] += 0.5 * unrest * duration_s;
            self.covariance[[at, at]] += unrest;
        }
    }

    /// Log probability; `None`, without update, for an outlier.
    fn update(&mut self, observed: &Array1<f64>, noise: &Array2<f64>) -> Option<f64> {
        let channels = observed.len();
        let innovation = observed - &self.mean.slice(s![..channels]);
        let sum = &self.covariance.slice(s![..channels, ..channels]) + noise;
        let factor = Cholesky::factor(sum).ok()?;
        let chi_squared: f64 = factor.solve_lower(&innovation).iter().map(|part| part * part).sum();
        let most = channels as f64 + 6.0 * (2.0 * channels as f64).sqrt();
        if chi_squared > most {
            return None;
        }
        // K = P·Hᵀ·S⁻¹, by its transpose.
        let cross = self.covariance.slice(s![.., ..channels]).to_owned();
        let halves = factor.solve_lower_matrix(cross.t().to_owned());
        let moved = halves.t().dot(&factor.solve_lower(&innovation));
        self.mean += &moved;
        self.covariance -= &halves.t().dot(&halves);
        Some(-0.5 * (chi_squared + factor.log_determinant()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::SilentModel;
    use super::*;

    /// Steady variance of a random walk in noise: (√(q² + 4·q·r) − q)/2.
    #[test]
    fn a_walk_s_variance_is_that_of_the_steady_filter() {
        let (walk, noise, every_s) = (0.3, 0.05, 0.2);
        let mut filter = DriftFilter::new(Drift { walks_per_root_s: [walk; 3], ..Drift::default() }, &[1.0]);
        let model = &mut filter.models[0];
        model.covariance[[1, 1]] = 0.0;
        model.rate = 0.0;
        for _ in 0..200 {
            model.predict(every_s, 300.0);
            model.update(&Array1::from(vec![0.0]), &Array2::from_elem((1, 1), noise)).unwrap();
        }
        let q = walk * walk * every_s;
        let steady = 0.5 * ((q * q + 4.0 * q * noise).sqrt() - q);
        assert!((model.covariance[[0, 0]] / steady - 1.0).abs() < 1e-9);
    }

    /// d integrates v.
    #[test]
    fn one_long_step_is_many_short_ones() {
        let start = || {
            let filter = DriftFilter::new(Drift::default(), &[1.0; 2]);
            let mut model = filter.models[8].clone();
            model.mean.iter_mut().enumerate().for_each(|(i, mean)| *mean = 0.1 * (i + 1) as f64);
            model
        };
        let (mut long, mut short) = (start(), start());
        long.predict(2.0, 300.0);
        (0..200).for_each(|_| short.predict(0.01, 300.0));
        for (long, short) in long.mean.iter().zip(&short.mean) {
            assert!((long - short).abs() < 5e-3 * short.abs(), "{long} {short}");
        }
        for (long, short) in long.covariance.iter().zip(&short.covariance) {
            assert!((long - short).abs() < 0.01 * short.abs() + 1e-12, "{long} {short}");
        }
    }

    #[test]
    fn a_line_is_found_by_its_rate_and_carried_on() {
        let mut filter = DriftFilter::new(Drift::default(), &[1.0; 3]);
        let likelihood = SilentModel(3);
        let mut offset = [0.0; 3];
        for i in 0..600_u32 {
            let time_s = 0.2 * f64::from(i);
            // Noise of a mean of 20 that never repeats.
            let noise = |c: u32| 0.2 * (f64::from((i * (7 + 3 * c)) % 101) / 50.0 - 1.0);
            offset = [0.02, -0.02, 0.0].map(|rate| rate * time_s);
            let offsets = (0..3).map(|c| 20.0 * (offset[c as usize] + noise(c))).collect();
            filter.observe(
                &likelihood,
                &Block {
                    count: 20.0,
                    start_s: time_s,
                    times_s: 20.0 * time_s,
                    offsets,
                    contacts: Vec::new(),
                },
            );
        }
        for (c, rate) in [0.02, -0.02, 0.0].into_iter().enumerate() {
            assert!((filter.rate[c] - rate).abs() < 4e-3, "{}", filter.rate);
            let later = filter.offset_at(c, 119.8 + 30.0);
            assert!((later - offset[c] - 30.0 * rate).abs() < 0.25, "{c}: {later}");
        }
    }
}
