//! Restricted log evidence of a channel's presses under a prior (Patterson and Thompson, Biometrika 58, 1971;
//! Rasmussen and Williams, *Gaussian Processes for Machine Learning*, 2006, section 2.7).
//!
//! Let A = L·Lᵀ be the covariance over s², H the design matrix of offset and polynomials (flat priors), and M
//! the projection orthogonal to L⁻¹·H. The log evidence is −½·(ν·ln s² + ln|A| + ln|Hᵀ·A⁻¹·H|), with s² =
//! |M·L⁻¹·y|²/ν and ν the presses minus the columns of H. A source at p of amplitude variance τ·s² adds the
//! column u(p): |M·L⁻¹·y|² falls by τ·(vᵀ·w)²/(1 + τ·vᵀ·v), with v = M·L⁻¹·u and w = M·L⁻¹·y, and the
//! determinants grow by ln(1 + τ·vᵀ·v). Positions and powers of ten of τ are averaged.
//!
//! Under a prior of the noise variance ([`NoiseDensity`]), the density of |M·L⁻¹·y|² replaces s^(−ν).

use super::noise_prior::{NoiseDensity, ResidueMixture};
use super::prior::Prior;
use super::systematic_sample::systematic_sample;
use crate::influence::calibration::{CalibrationRows, Repeats};
use ndarray::linalg::general_mat_mul;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2};
use palpate_numerics::{Cholesky, NotPositiveDefinite, mean_and_variance};

/// Powers of ten of ρ.
type Decades = std::ops::RangeInclusive<i32>;
pub(super) const ALL_DECADES: Decades = -10..=1;
/// Powers of ten of τ.
const AMPLITUDES: std::ops::RangeInclusive<i32> = 0..=6;

/// Amplitude variances over the noise variance.
pub(super) fn amplitudes_over_noise() -> impl Iterator<Item = f64> {
    (1..=4).map(|k| 100f64.powi(k))
}
const LEAST_SHARE: f64 = 1e-3;

/// Covariance with offset and polynomials projected out.
pub(super) struct RestrictedCovariance {
    pub cholesky: Cholesky,
    /// L⁻¹·H, n × q.
    effects: Array2<f64>,
    /// Factor of Hᵀ·A⁻¹·H.
    gram: Cholesky,
    /// ln|A| + ln|Hᵀ·A⁻¹·H|.
    pub log_determinant: f64,
}

impl RestrictedCovariance {
    /// # Errors
    /// [`NotPositiveDefinite`] where offset and polynomials are unidentifiable.
    pub fn new(covariance: Array2<f64>, effects: &Array2<f64>) -> Result<Self, NotPositiveDefinite> {
        let cholesky = Cholesky::factor(covariance)?;
        let effects = cholesky.solve_lower_matrix(effects.clone());
        let gram = Cholesky::factor(effects.t().dot(&effects))?;
        let log_determinant = cholesky.log_determinant() + gram.log_determinant();
        Ok(Self { cholesky, effects, gram, log_determinant })
    }

    pub fn effects(&self) -> usize {
        self.effects.ncols()
    }

    /// Coefficients of H for columns of L⁻¹·y.
    pub fn coefficients(&self, white: &Array2<f64>) -> Array2<f64> {
        self.gram.solve_matrix(self.effects.t().dot(white))
    }

    /// M·L⁻¹·y and the coefficients of H, by columns of y.
    pub fn residuals(&self, columns: Array2<f64>) -> (Array2<f64>, Array2<f64>) {
        self.residuals_of_white(self.cholesky.solve_lower_matrix(columns))
    }

    /// M·L⁻¹.
    pub fn projection(&self) -> Array2<f64> {
        self.residuals_of_white(self.cholesky.inverse_lower()).0
    }

    fn residuals_of_white(&self, mut white: Array2<f64>) -> (Array2<f64>, Array2<f64>) {
        let coefficients = self.coefficients(&white);
        general_mat_mul(-1.0, &self.effects, &coefficients, 1.0, &mut white);
        (white, coefficients)
    }

    /// R⁻ᵀ·(h − Hᵀ·A⁻¹·k), with `white` = L⁻¹·k.
    pub fn unexplained_effects(&self, h: &Array2<f64>, white: &Array2<f64>) -> Array2<f64> {
        self.gram.solve_lower_matrix(h - &self.effects.t().dot(white))
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct SourceFit {
    pub place: usize,
    /// Posterior probability.
    pub weight: f64,
    /// Posterior mean, and variance over s².
    pub amplitude: f64,
    pub variance: f64,
}

#[derive(Clone, Debug)]
pub(super) struct ChannelFit {
    /// ρ: noise variance over s².
    pub ratio: f64,
    /// s².
    pub signal: f64,
    /// Log density, up to a constant.
    pub evidence: f64,
    pub sources: Vec<SourceFit>,
}

impl ChannelFit {
    pub fn noise_variance(&self) -> f64 {
        self.signal * self.ratio
    }

    pub fn most_probable_source(&self) -> Option<&SourceFit> {
        self.sources.iter().max_by(|a, b| a.weight.total_cmp(&b.weight))
    }
}

pub(super) struct Evidence<'a> {
    pub presses: &'a CalibrationRows,
    pub prior: &'a Prior,
    /// Without noise and drift.
    covariance: Array2<f64>,
    /// Noise and drift, over ρ.
    noise: Noise,
    effects: Array2<f64>,
    pub sources: Array2<f64>,
    repeats: RepeatedNoise,
    noise_priors: Vec<TypicalNoise>,
    /// Noise variance of each channel; empty for the most probable noise.
    densities: Vec<ResidueMixture>,
}

/// Prior of the most probable noise of few presses, which coefficients may fit exactly: 1 % of the signal within a factor
/// of three, heavy-tailed (Student's t, one degree of freedom), above rounding.
struct TypicalNoise {
    changes: f64,
    rounding: f64,
    /// [`CalibrationRows::fewness`].
    weight: f64,
}

impl TypicalNoise {
    fn of_channels(presses: &CalibrationRows) -> Vec<Self> {
        let channel = |c: usize| {
            let (_, changes) = mean_and_variance(presses.means.column(c).iter().copied());
            Self { changes, rounding: presses.rounding[c], weight: presses.fewness() }
        };
        (0..presses.centre.len()).map(channel).collect()
    }

    /// Log density of ln σ².
    fn log_density(&self, variance: f64) -> f64 {
        /// Centre over `changes`, and scale in powers of ten.
        const SHARE: f64 = 1e-4;
        const DECADES: f64 = 1.0;
        if self.weight == 0.0 || self.changes <= 0.0 || variance <= 0.0 {
            return 0.0;
        }
        let off = (variance / (SHARE * self.changes)).log10() / DECADES;
        -self.weight * ((off * off).ln_1p() + 0.5 * self.rounding / variance)
    }
}

/// Noise and drift, over the noise variance of an untouched row.
struct Noise {
    diagonal: Vec<f64>,
    drift: Option<Array2<f64>>,
}

impl Noise {
    fn new(presses: &CalibrationRows, prior: &Prior) -> Self {
        let n = presses.len();
        let time = &presses.time;
        let drift = || Array2::from_shape_fn((n, n), |(i, j)| prior.drift_between(time[i], time[j]));
        Self {
            diagonal: (0..n).map(|i| prior.relative_noise_of(presses, i) / presses.count[i]).collect(),
            drift: (prior.drift > 0.0).then(drift),
        }
    }

    /// K + ρ·(noise and drift).
    fn added_to(&self, covariance: &Array2<f64>, ratio: f64) -> Array2<f64> {
        let mut sum = covariance.clone();
        sum.diag_mut().iter_mut().zip(&self.diagonal).for_each(|(sum, noise)| *sum += ratio * noise);
        if let Some(drift) = &self.drift {
            sum.scaled_add(ratio, drift);
        }
        sum
    }
}

/// Squares of repeats, for the noise of untouched rows.
struct RepeatedNoise {
    freedom: f64,
    squares: Array1<f64>,
    /// Σ ν·ln of the relative variances.
    log_determinant: f64,
}

impl RepeatedNoise {
    fn new(presses: &CalibrationRows, prior: &Prior) -> Self {
        let Repeats { positions_m, force_n, degrees_of_freedom, squares } = &*presses.repeats;
        let relative: Array1<f64> = force_n
            .iter()
            .zip(positions_m)
            .map(|(force_n, position_m)| prior.relative_noise(*force_n, position_m))
            .collect();
        Self {
            freedom: degrees_of_freedom.iter().sum(),
            squares: squares.t().dot(&relative.mapv(f64::recip)),
            log_determinant: relative
                .iter()
                .zip(degrees_of_freedom)
                .map(|(variance, freedom)| freedom * variance.ln())
                .sum(),
        }
    }
}

impl<'a> Evidence<'a> {
    pub fn new(presses: &'a CalibrationRows, prior: &'a Prior, sensors_m: &[Vec<f64>]) -> Self {
        Self {
            presses,
            prior,
            covariance: prior.covariance(presses),
            noise: Noise::new(presses, prior),
            effects: prior.effects(presses),
            sources: prior.sources(presses, sensors_m),
            repeats: RepeatedNoise::new(presses, prior),
            noise_priors: TypicalNoise::of_channels(presses),
            densities: Vec::new(),
        }
    }

    /// The same evidence under priors of the channels' noise variances.
    pub fn with_noise(self, noises: &[NoiseDensity]) -> Self {
        let densities = noises.iter().map(|noise| ResidueMixture::new(noise, self.freedom())).collect();
        Self { densities, ..self }
    }

    pub fn freedom(&self) -> f64 {
        self.presses.len() as f64 + self.repeats.freedom - self.effects.ncols() as f64
    }

    pub fn restricted(&self, ratio: f64) -> Result<RestrictedCovariance, NotPositiveDefinite> {
        RestrictedCovariance::new(self.noise.added_to(&self.covariance, ratio), &self.effects)
    }

    /// τ, the amplitude variances over s².
    pub fn amplitudes(&self, ratio: f64) -> Vec<f64> {
        if self.densities.is_empty() {
            AMPLITUDES.map(|decade| 10f64.powi(decade)).collect()
        } else {
            amplitudes_over_noise().map(|tau| tau * ratio).collect()
        }
    }

    /// Fits at the best power of ten of ρ; `None` where offset and polynomials are unidentifiable.
    pub fn best_decades(&self, decades: Decades) -> Option<Vec<ChannelFit>> {
        let ratios = decades.map(|decade| 10f64.powi(decade));
        self.best_of(ratios)
    }

    /// Refines ρ to a quarter of a power of ten.
    pub fn refined(&self, fits: Vec<ChannelFit>) -> Vec<ChannelFit> {
        const STEPS: std::ops::RangeInclusive<i32> = -3..=3;
        let mut ratios: Vec<f64> = Vec::new();
        for fit in &fits {
            ratios.extend(STEPS.map(|step| fit.ratio * 10f64.powf(0.25 * f64::from(step))));
        }
        ratios.sort_by(f64::total_cmp);
        ratios.dedup_by(|a, b| *a < *b * 1.01);
        self.best_of(ratios.into_iter()).unwrap_or(fits)
    }

    fn best_of(&self, ratios: impl Iterator<Item = f64>) -> Option<Vec<ChannelFit>> {
        if self.freedom() < 1.0 {
            return None;
        }
        let mut best: Option<Vec<ChannelFit>> = None;
        for fits in ratios.filter_map(|ratio| self.with_ratio(ratio)) {
            match &mut best {
                None => best = Some(fits),
                Some(best) => {
                    for (best, fit) in best.iter_mut().zip(fits) {
                        if fit.evidence > best.evidence {
                            *best = fit;
                        }
                    }
                }
            }
        }
        best
    }

    fn with_ratio(&self, ratio: f64) -> Option<Vec<ChannelFit>> {
        let restricted = self.restricted(ratio).ok()?;
        let (white, _) = restricted.residuals(self.presses.means.clone());
        let sources =
            WhiteSources::new(restricted.residuals(self.sources.clone()).0, &self.amplitudes(ratio));
        let products = sources.products(&white.view());
        let fits = (0..self.presses.centre.len())
            .map(|c| {
                let fit =
                    self.channel(&restricted, ratio, c, &white.column(c), (&sources, &products.column(c)));
                let of_noise = self.noise_priors[c].log_density(fit.noise_variance());
                ChannelFit { evidence: fit.evidence + of_noise, ..fit }
            })
            .collect::<Vec<_>>();
        fits.iter().all(|fit| fit.evidence.is_finite()).then_some(fits)
    }

    /// Fit of channel `c`; `white` is M·L⁻¹·y.
    pub fn channel(
        &self,
        restricted: &RestrictedCovariance,
        ratio: f64,
        c: usize,
        white: &ArrayView1<f64>,
        (sources, products): (&WhiteSources, &ArrayView1<f64>),
    ) -> ChannelFit {
        let log_determinant = self.log_determinant(restricted, ratio);
        let fit = |Residue { square, log_weight, source, .. }: Residue| {
            let (log_density, signal) = match self.densities.get(c) {
                Some(density) => density.of_residue(square, ratio),
                None => {
                    let signal = square / self.freedom();
                    (-0.5 * self.freedom() * signal.ln(), signal)
                }
            };
            (log_density - 0.5 * log_determinant + log_weight, signal, source)
        };
        let residues = self.residues(ratio, (c, white.dot(white)), (sources, products));
        let tried: Vec<_> = residues.map(fit).collect();
        if self.densities.is_empty() { average(ratio, &tried) } else { sampled(ratio, &tried) }
    }

    /// ln of all determinants without a source's.
    pub fn log_determinant(&self, restricted: &RestrictedCovariance, ratio: f64) -> f64 {
        restricted.log_determinant + self.repeats.freedom * ratio.ln() + self.repeats.log_determinant
    }

    /// Residues of channel `c`, with |M·L⁻¹·y|² = `square`, without a source or with each source and amplitude.
    pub fn residues(
        &self,
        ratio: f64,
        (c, square): (usize, f64),
        (sources, products): (&WhiteSources, &ArrayView1<f64>),
    ) -> impl Iterator<Item = Residue> {
        let square = square + self.repeats.squares[c] / ratio;
        let without =
            sources.is_empty().then_some(Residue { square, log_weight: 0.0, weight: 1.0, source: None });
        let with = sources.amplitudes.iter().map(move |amplitude| {
            let Amplitude { place, variance, log_weight, weight } = *amplitude;
            let product = products[place];
            Residue {
                square: (square - variance * product * product).max(f64::MIN_POSITIVE),
                log_weight,
                weight,
                source: Some(SourceFit { place, weight: 0.0, amplitude: variance * product, variance }),
            }
        });
        without.into_iter().chain(with)
    }
}

/// Presses minus the best coefficients of offset, polynomials and a source.
pub(super) struct Residue {
    /// |M·L⁻¹·y|² over s².
    pub square: f64,
    /// −½·ln(1 + τ·vᵀ·v), and its exponential.
    log_weight: f64,
    pub weight: f64,
    source: Option<SourceFit>,
}

impl Residue {
    /// Index of the source's place.
    pub fn place(&self) -> Option<usize> {
        self.source.map(|source| source.place)
    }
}

#[derive(Clone)]
pub(super) struct WhiteSources {
    /// v, one column per position.
    pub columns: Array2<f64>,
    amplitudes: Vec<Amplitude>,
}

#[derive(Clone, Copy)]
struct Amplitude {
    place: usize,
    /// τ/(1 + τ·vᵀ·v).
    variance: f64,
    /// −½·ln(1 + τ·vᵀ·v), and its exponential, which all channels share.
    log_weight: f64,
    weight: f64,
}

impl WhiteSources {
    pub fn new(columns: Array2<f64>, taus: &[f64]) -> Self {
        let mut squares = vec![0.0; columns.ncols()];
        for row in columns.outer_iter() {
            squares.iter_mut().zip(row).for_each(|(square, v)| *square += v * v);
        }
        let amplitudes = squares.iter().enumerate().flat_map(|(place, length)| {
            taus.iter().map(move |tau| Amplitude {
                place,
                variance: tau / (1.0 + tau * length),
                log_weight: -0.5 * (tau * length).ln_1p(),
                weight: (1.0 + tau * length).sqrt().recip(),
            })
        });
        let amplitudes = amplitudes.collect();
        Self { columns, amplitudes }
    }

    fn is_empty(&self) -> bool {
        self.columns.ncols() == 0
    }

    /// vᵀ·w of each position.
    pub fn products(&self, white: &ArrayView2<f64>) -> Array2<f64> {
        self.columns.t().dot(white)
    }
}

fn average(ratio: f64, tried: &[(f64, f64, Option<SourceFit>)]) -> ChannelFit {
    let best = tried.iter().fold(f64::NEG_INFINITY, |best, (evidence, ..)| best.max(*evidence));
    let count = tried.len() as f64;
    let weights: Vec<f64> = tried.iter().map(|(evidence, ..)| (evidence - best).exp()).collect();
    let all: f64 = weights.iter().sum();
    let kept = || tried.iter().zip(&weights).filter(|(_, weight)| **weight >= LEAST_SHARE);
    let total: f64 = kept().map(|(_, weight)| weight).sum();
    let with_weight = |((.., source), weight): (&(f64, f64, Option<SourceFit>), &f64)| {
        source.map(|source| SourceFit { weight: weight / total, ..source })
    };
    ChannelFit {
        ratio,
        signal: kept().map(|((_, signal, _), weight)| weight * signal).sum::<f64>() / total,
        evidence: best + (all / count).ln(),
        sources: kept().filter_map(with_weight).collect(),
    }
}

/// The average over a systematic sample of the sources.
fn sampled(ratio: f64, tried: &[(f64, f64, Option<SourceFit>)]) -> ChannelFit {
    const SAMPLE: usize = 100;
    let best = tried.iter().fold(f64::NEG_INFINITY, |best, (evidence, ..)| best.max(*evidence));
    let weights: Vec<f64> = tried.iter().map(|(evidence, ..)| (evidence - best).exp()).collect();
    let all: f64 = weights.iter().sum();
    let signal =
        tried.iter().zip(&weights).map(|((_, signal, _), weight)| weight * signal).sum::<f64>() / all;
    let drawn = systematic_sample(weights.iter().map(|weight| weight / all), SAMPLE);
    let with_weight = |((.., source), drawn): (&(f64, f64, Option<SourceFit>), usize)| {
        let weight = drawn as f64 / SAMPLE as f64;
        source.filter(|_| drawn > 0).map(|source| SourceFit { weight, ..source })
    };
    let sources = tried.iter().zip(drawn).filter_map(with_weight).collect();
    ChannelFit { ratio, signal, evidence: best + (all / tried.len() as f64).ln(), sources }
}
