//! Hyperparameters that the channels share, with the evidence of each channel.
//!
//! A component is a kernel with length scales, alone or beside a kind of point sensor and a load radius. Given
//! the component and the prior of the noise, channels are independent: each averages its own ratio ρ of noise
//! to signal, and its own source, by evidence.

use super::evidence::{Evidence, WhiteSources, amplitudes_over_noise};
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
        // Cells that are not evaluated have no probability.
        let evaluated = if sensors_m.is_empty() { 0.0 } else { (sensors_m.len() as f64 / grid.cells).ln() };
        for (r, ratio) in ratios.iter().enumerate() {
            let Ok(restricted) = evidence.restricted(*ratio) else { continue };
            let (white, _) = restricted.residuals(presses.means.clone());
            let taus: Vec<f64> = amplitudes_over_noise().map(|tau| tau * ratio).collect();
            let columns = restricted.residuals(evidence.sources.clone()).0;
            let sources = WhiteSources::new(columns, &taus);
            let products = sources.products(&white.view());
            for c in 0..channels {
                let of_sources = (&sources, &products.column(c));
                let square = white.column(c).dot(&white.column(c));
                let residues_of_sources = evidence.residues(&restricted, *ratio, (c, square), of_sources);
                let (mut residues, mut places) = (Vec::new(), Vec::new());
                for found in residues_of_sources {
                    residues.push((ratio * found.square, -0.5 * found.log_determinant));
                    places.extend(found.place());
                }
                let least = residues.iter().map(|(square, _)| *square).fold(f64::INFINITY, f64::min);
                let most = residues.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
                residues.iter_mut().for_each(|(_, log)| *log = (*log - most).exp());
                // Readings in units of their standard deviation, so that flat priors of coefficients compare.
                let scale = evaluated + 0.5 * freedom * (ratio.ln() + units[c].ln());
                for (k, noise) in noises.iter().enumerate() {
                    let density = ResidueDensity::new(noise.scales[c], freedom);
                    log_densities[[c, k, r]] = scale + most + density.log_mean_of(&residues, least);
                }
                let best = |k: &usize| log_densities[[c, *k, r]];
                let Some(k) = (0..noises.len()).max_by(|a, b| best(a).total_cmp(&best(b))) else { continue };
                let density = ResidueDensity::new(noises[k].scales[c], freedom);
                for (place, (square, weight)) in places.into_iter().zip(&residues) {
                    let log = scale + most + weight.ln() + density.log_of(*square);
                    of_places[[c, place]] = log.max(of_places[[c, place]]);
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

pub(super) fn log_sum_exp(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most.is_finite() { most + logs.map(|log| (log - most).exp()).sum::<f64>().ln() } else { most }
}
