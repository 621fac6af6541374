//! Hyperparameters that the channels share, with the evidence of each channel.
//!
//! A component is a kernel with length scales, alone or beside a kind of point sensor and a load radius. Given
//! the component and the prior of the noise, channels are independent: each averages its own ratio ρ of noise
//! to signal, and its own source, by evidence.

use super::evidence::{Evidence, Residue, WhiteSources, amplitudes_over_noise};
use super::noise_prior::{NoisePrior, ResidueDensity, signal_variances};
use super::prior::Prior;
use super::source_grid::SourceGrid;
use crate::influence::calibration::CalibrationRows;
use ndarray::{Array2, Array3, Axis as Dimension, s};

pub(super) struct Component {
    pub prior: Prior,
    pub ratios: Vec<f64>,
    /// ln p(readings of channel c | ρ, noise prior k) at [c, k, ρ].
    pub log_densities: Array3<f64>,
    /// Largest log density of channel c with a source at place p, up to a constant of the channel, at [c, p].
    of_places: Array2<f64>,
}

impl Component {
    /// `None` where offset and polynomials are unidentifiable.
    pub fn new(
        presses: &CalibrationRows,
        prior: Prior,
        noises: &[NoisePrior],
        grid: &SourceGrid,
        ratios: Vec<f64>,
    ) -> Option<Self> {
        let sensors_m = if prior.source.is_some() { &grid.places_m[..] } else { &[] };
        let evidence = Evidence::new(presses, &prior, sensors_m);
        let freedom = evidence.freedom();
        if freedom < 1.0 {
            return None;
        }
        let channels = presses.centre.len();
        let units = signal_variances(presses);
        let mut log_densities = Array3::from_elem((channels, noises.len(), ratios.len()), f64::NEG_INFINITY);
        let mut of_places = Array2::from_elem((channels, sensors_m.len()), f64::NEG_INFINITY);
        // ρ has a log-uniform prior, and each value stands for a step.
        let log_step = ratios.windows(2).map(|pair| (pair[1] / pair[0]).log10()).fold(1.0, f64::min).ln();
        // Cells that are not evaluated have no probability.
        let evaluated = if sensors_m.is_empty() { 0.0 } else { (sensors_m.len() as f64 / grid.cells).ln() };
        for (r, ratio) in ratios.iter().enumerate() {
            let Ok(restricted) = evidence.restricted(*ratio) else { continue };
            let (white, _) = restricted.residuals(presses.means.clone());
            let taus: Vec<f64> = amplitudes_over_noise().map(|tau| tau * ratio).collect();
            let columns = restricted.residuals(evidence.sources.clone()).0;
            let sources = WhiteSources::new(columns, &taus);
            let products = sources.products(&white.view());
            let log_determinant = evidence.log_determinant(&restricted, *ratio);
            for c in 0..channels {
                let of_sources = (&sources, &products.column(c));
                let square = white.column(c).dot(&white.column(c));
                let densities: Vec<ResidueDensity> =
                    noises.iter().map(|noise| ResidueDensity::new(noise.scales[c], freedom)).collect();
                let Some(widest) = densities.iter().max_by(|a, b| a.scale().total_cmp(&b.scale())) else {
                    continue;
                };
                let residues = evidence.residues(*ratio, (c, square), of_sources);
                let residues = ChannelResidues::new(residues, *ratio, widest);
                // Readings in units of their standard deviation, so that flat priors of coefficients compare.
                let scale = log_step + evaluated - 0.5 * log_determinant
                    + 0.5 * freedom * (ratio.ln() + units[c].ln());
                let mut best = f64::NEG_INFINITY;
                for (k, density) in densities.iter().enumerate() {
                    log_densities[[c, k, r]] = scale + residues.log_mean(density);
                    best = best.max(log_densities[[c, k, r]]);
                }
                let k = (0..densities.len()).rfind(|k| log_densities[[c, *k, r]] == best);
                for (place, log) in k.into_iter().flat_map(|k| residues.of_places(densities[k])) {
                    of_places[[c, place]] = of_places[[c, place]].max(scale + log);
                }
            }
        }
        Some(Self { prior, ratios, log_densities, of_places })
    }

    /// ln p(readings of channel c | noise prior k), up to a constant.
    pub fn of_channel(&self, c: usize, k: usize) -> f64 {
        log_sum_exp(self.log_densities.slice(s![c, k, ..]).iter().copied())
    }

    /// ln p(readings | noise prior k), up to a constant, by k.
    pub fn by_noise(&self) -> Vec<f64> {
        let (channels, noises, _) = self.log_densities.dim();
        (0..noises).map(|k| (0..channels).map(|c| self.of_channel(c, k)).sum()).collect()
    }

    /// ln p(readings), up to a constant.
    pub fn log_evidence(&self) -> f64 {
        log_sum_exp(self.by_noise().into_iter())
    }

    /// Places of the sources of some channel with more than a ten-thousandth of the largest density, where one
    /// place has more than a fifth of a channel's probability; `None` where the places are dense enough.
    pub fn coarse_places(&self) -> Option<Vec<usize>> {
        const LEAST: f64 = 1e-4;
        const MOST: f64 = 0.2;
        let mut is_coarse = false;
        let mut probable = vec![false; self.of_places.ncols()];
        for logs in self.of_places.outer_iter() {
            let best = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let relative = || logs.iter().map(|log| (log - best).exp());
            is_coarse |= relative().sum::<f64>() < MOST.recip();
            relative().zip(&mut probable).for_each(|(density, found)| *found |= density >= LEAST);
        }
        let places = || (0..probable.len()).filter(|place| probable[*place]).collect();
        (is_coarse && !probable.is_empty()).then(places)
    }

    /// First and last index of the ratios that have a share of the probability of some channel.
    pub fn probable_ratios(&self, least: f64) -> (usize, usize) {
        let best = self.by_noise();
        let k = (0..best.len()).max_by(|a, b| best[*a].total_cmp(&best[*b])).unwrap_or(0);
        let mut found = (self.ratios.len(), 0);
        for channel in self.log_densities.index_axis(Dimension(1), k).outer_iter() {
            let all = log_sum_exp(channel.iter().copied());
            for (r, log) in channel.iter().enumerate() {
                if (log - all).exp() >= least {
                    found = (found.0.min(r), found.1.max(r));
                }
            }
        }
        if found.0 > found.1 { (0, self.ratios.len() - 1) } else { found }
    }
}

/// Residues of a channel with each source, without those that are improbable under every prior of the noise.
struct ChannelResidues {
    /// Squares over the noise variance, and weights.
    residues: Vec<(f64, f64)>,
    places: Vec<usize>,
    least_square: f64,
    /// Number with the improbable ones.
    count: f64,
}

impl ChannelResidues {
    /// Residues at the ratio ρ; `widest` has the largest noise, which distinguishes residues least.
    fn new(found: impl Iterator<Item = Residue>, ratio: f64, widest: &ResidueDensity) -> Self {
        let mut all: Vec<Residue> = found.collect();
        all.iter_mut().for_each(|residue| residue.square *= ratio);
        let least = all.iter().min_by(|a, b| a.square.total_cmp(&b.square));
        let (least_square, least_weight) = least.map_or((0.0, 1.0), |least| (least.square, least.weight));
        // A sum that contains the least square's density rounds smaller ones away.
        let is_probable = |residue: &&Residue| {
            residue.weight * widest.relative(residue.square, least_square) >= f64::EPSILON * least_weight
        };
        let kept = || all.iter().filter(is_probable);
        Self {
            residues: kept().map(|residue| (residue.square, residue.weight)).collect(),
            places: kept().filter_map(Residue::place).collect(),
            least_square,
            count: all.len() as f64,
        }
    }

    /// ln of the mean density.
    fn log_mean(&self, density: &ResidueDensity) -> f64 {
        density.log_sum_of(&self.residues, self.least_square) - self.count.ln()
    }

    /// Places of sources with their log densities.
    fn of_places(&self, density: ResidueDensity) -> impl Iterator<Item = (usize, f64)> + '_ {
        let log = move |(square, weight): &(f64, f64)| weight.ln() + density.log_of(*square);
        self.places.iter().copied().zip(self.residues.iter().map(log))
    }
}

pub(super) fn log_sum_exp(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most.is_finite() { most + logs.map(|log| (log - most).exp()).sum::<f64>().ln() } else { most }
}
