//! Evidence of a channel's presses under a prior, by the restricted likelihood: offsets and polynomials are projected out, as their
//! coefficients are as likely as any others (Patterson and Thompson, Biometrika 58, 1971; Rasmussen and Williams, *Gaussian Processes for
//! Machine Learning*, 2006, section 2.7).
//!
//! With A = L·Lᵀ the covariance of the presses over s², H what they read of offset and polynomials, and M the projection of L⁻¹·y
//! onto what H leaves, the evidence of presses y is −½·(ν·ln s² + ln|A| + ln|Hᵀ·A⁻¹·H|), with s² = |M·L⁻¹·y|²/ν at its most probable
//! and ν the number of presses less that of the columns of H. A source at p whose amplitude has the variance τ·s² adds the column u(p) to
//! the covariance, a rank-1 change: |M·L⁻¹·y|² falls by τ·(vᵀ·w)²/(1 + τ·vᵀ·v), with v = M·L⁻¹·u and w = M·L⁻¹·y, and the
//! determinants grow by ln(1 + τ·vᵀ·v). Places and orders of magnitude of τ are averaged over.

use super::presses::{Presses, Repeated};
use super::prior::Prior;
use ndarray::{Array1, Array2, ArrayView1, Axis as Dimension};
use palpate_numerics::{Cholesky, NotPositiveDefinite};

/// Powers of ten of ρ.
type Decades = std::ops::RangeInclusive<i32>;
/// Those that are tried where nothing is known of them.
pub(super) const ALL_DECADES: Decades = -10..=1;
/// Powers of ten of τ, all as likely.
const AMPLITUDES: std::ops::RangeInclusive<i32> = 0..=6;
/// Sources less probable than this share of the most probable one are left out.
const LEAST_SHARE: f64 = 1e-3;

/// A covariance with its factor, and what is left beside offset and polynomials.
pub(super) struct Restricted {
    pub cholesky: Cholesky,
    /// L⁻¹·H, n × q.
    effects: Array2<f64>,
    /// Of Hᵀ·A⁻¹·H.
    gram: Cholesky,
    /// ln|A| + ln|Hᵀ·A⁻¹·H|.
    pub log_determinant: f64,
}

impl Restricted {
    /// # Errors
    /// [`NotPositiveDefinite`] where the presses do not tell offset and polynomials apart.
    pub fn new(covariance: Array2<f64>, effects: &Array2<f64>) -> Result<Self, NotPositiveDefinite> {
        let cholesky = Cholesky::factor(covariance)?;
        let effects = cholesky.solve_lower_matrix(effects.clone());
        let gram = Cholesky::factor(effects.t().dot(&effects))?;
        let log_determinant = cholesky.log_determinant() + gram.log_determinant();
        Ok(Self { cholesky, effects, gram, log_determinant })
    }

    /// Number of columns of H.
    pub fn effects(&self) -> usize {
        self.effects.ncols()
    }

    /// The coefficients of H in each column of L⁻¹·y.
    pub fn coefficients(&self, white: &Array2<f64>) -> Array2<f64> {
        let right = self.effects.t().dot(white);
        let mut solved = Array2::zeros(right.dim());
        for (column, mut out) in right.columns().into_iter().zip(solved.columns_mut()) {
            out.assign(&self.gram.solve(&column.to_owned()));
        }
        solved
    }

    /// M·L⁻¹·y of each column of y, with the coefficients of H.
    pub fn residuals(&self, columns: Array2<f64>) -> (Array2<f64>, Array2<f64>) {
        let mut white = self.cholesky.solve_lower_matrix(columns);
        let coefficients = self.coefficients(&white);
        white -= &self.effects.dot(&coefficients);
        (white, coefficients)
    }

    /// R⁻ᵀ·(h − Hᵀ·A⁻¹·k) for columns of `h` and L⁻¹·k, `white`: scalar products of its columns are covariances.
    pub fn open_effects(&self, h: &Array2<f64>, white: &Array2<f64>) -> Array2<f64> {
        self.gram.solve_lower_matrix(h - &self.effects.t().dot(white))
    }
}

/// A source of a channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct SourceFit {
    /// Number of its place in the list of places.
    pub place: usize,
    /// Posterior probability, and the share of 1 that all weights sum to.
    pub weight: f64,
    /// Mean of its amplitude, and its variance over s².
    pub amplitude: f64,
    pub variance: f64,
}

/// Noise and signal of one channel under a prior, and its sources.
#[derive(Clone, Debug)]
pub(super) struct ChannelFit {
    /// ρ, the noise's variance over s².
    pub ratio: f64,
    /// s².
    pub signal: f64,
    /// ln of the probability density of the channel's presses, less a constant.
    pub evidence: f64,
    pub sources: Vec<SourceFit>,
}

impl ChannelFit {
    pub fn noise_variance(&self) -> f64 {
        self.signal * self.ratio
    }
}

/// Presses whose evidence is asked under one prior, and the places of sensors that are tried.
pub(super) struct Evidence<'a> {
    pub presses: &'a Presses,
    pub prior: &'a Prior,
    covariance: Array2<f64>,
    effects: Array2<f64>,
    /// Readings of the presses by a source of unit amplitude at each place.
    sources: Array2<f64>,
    repeats: RepeatedNoise,
}

/// Noise of untouched rows as the scatter of repeats tells it.
struct RepeatedNoise {
    freedom: f64,
    /// Sum of squared deviations of each channel, each over the noise's variance relative to that of untouched rows.
    squares: Array1<f64>,
    /// Σ ln of those relative variances.
    log_determinant: f64,
}

impl RepeatedNoise {
    fn new(presses: &Presses, prior: &Prior) -> Self {
        let Repeated { positions_m, force_n, freedom, squares } = &presses.repeated;
        let relative: Array1<f64> = force_n
            .iter()
            .zip(positions_m)
            .map(|(force_n, position_m)| prior.relative_noise(*force_n, position_m))
            .collect();
        Self {
            freedom: freedom.iter().sum(),
            squares: squares.t().dot(&relative.mapv(f64::recip)),
            log_determinant: relative
                .iter()
                .zip(freedom)
                .map(|(variance, freedom)| freedom * variance.ln())
                .sum(),
        }
    }
}

impl<'a> Evidence<'a> {
    pub fn new(presses: &'a Presses, prior: &'a Prior, sensors_m: &[Vec<f64>]) -> Self {
        Self {
            presses,
            prior,
            covariance: prior.covariance(presses),
            effects: prior.effects(presses),
            sources: prior.sources(presses, sensors_m),
            repeats: RepeatedNoise::new(presses, prior),
        }
    }

    /// Degrees of freedom of a channel's presses.
    fn freedom(&self) -> f64 {
        self.presses.len() as f64 + self.repeats.freedom - self.effects.ncols() as f64
    }

    /// The covariance at one ρ.
    pub fn restricted(&self, ratio: f64) -> Result<Restricted, NotPositiveDefinite> {
        Restricted::new(self.prior.with_noise(&self.covariance, self.presses, ratio), &self.effects)
    }

    /// The most probable ρ of every channel among some powers of ten; `None` where the presses do not tell offset and polynomials apart.
    pub fn best_decades(&self, decades: Decades) -> Option<Vec<ChannelFit>> {
        let ratios = decades.map(|decade| 10f64.powi(decade));
        self.best_of(ratios)
    }

    /// The same to a quarter of a power of ten, around fits that were found.
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

    /// The fit of every channel at one ρ.
    fn with_ratio(&self, ratio: f64) -> Option<Vec<ChannelFit>> {
        let restricted = self.restricted(ratio).ok()?;
        let (white, _) = restricted.residuals(self.presses.means.clone());
        let (sources, _) = restricted.residuals(self.sources.clone());
        let fits = (0..self.presses.centre.len())
            .map(|c| self.channel(&restricted, ratio, c, &white.column(c), &sources))
            .collect::<Vec<_>>();
        fits.iter().all(|fit| fit.evidence.is_finite()).then_some(fits)
    }

    /// The fit of channel `c` at one ρ, from M·L⁻¹·y of its presses and M·L⁻¹·u of the sources.
    pub fn channel(
        &self,
        restricted: &Restricted,
        ratio: f64,
        c: usize,
        white: &ArrayView1<f64>,
        sources: &Array2<f64>,
    ) -> ChannelFit {
        let freedom = self.freedom();
        let square = white.dot(white) + self.repeats.squares[c] / ratio;
        let determinant =
            restricted.log_determinant + self.repeats.freedom * ratio.ln() + self.repeats.log_determinant;
        if sources.ncols() == 0 {
            let signal = square / freedom;
            let evidence = -0.5 * (freedom * signal.ln() + determinant);
            return ChannelFit { ratio, signal, evidence, sources: Vec::new() };
        }
        let products = sources.t().dot(white);
        let squares: Array1<f64> = sources.map_axis(Dimension(0), |column| column.dot(&column));
        let amplitudes: Vec<f64> = AMPLITUDES.map(|decade| 10f64.powi(decade)).collect();
        let mut tried = Vec::with_capacity(squares.len() * amplitudes.len());
        for (place, (product, length)) in products.iter().zip(&squares).enumerate() {
            for tau in &amplitudes {
                let variance = tau / (1.0 + tau * length);
                let signal = (square - variance * product * product).max(f64::MIN_POSITIVE) / freedom;
                let evidence = -0.5 * (freedom * signal.ln() + determinant + (tau * length).ln_1p());
                tried.push((
                    evidence,
                    signal,
                    SourceFit { place, weight: 0.0, amplitude: variance * product, variance },
                ));
            }
        }
        average(ratio, &mut tried)
    }
}

/// The average over sources of given evidence and signal.
fn average(ratio: f64, tried: &mut [(f64, f64, SourceFit)]) -> ChannelFit {
    let best = tried.iter().fold(f64::NEG_INFINITY, |best, (evidence, ..)| best.max(*evidence));
    tried.iter_mut().for_each(|(evidence, _, source)| source.weight = (*evidence - best).exp());
    let count = tried.len() as f64;
    let all: f64 = tried.iter().map(|(.., source)| source.weight).sum();
    let kept = || tried.iter().filter(|(.., source)| source.weight >= LEAST_SHARE);
    let total: f64 = kept().map(|(.., source)| source.weight).sum();
    ChannelFit {
        ratio,
        signal: kept().map(|(_, signal, source)| source.weight * signal).sum::<f64>() / total,
        evidence: best + (all / count).ln(),
        sources: kept().map(|(.., source)| SourceFit { weight: source.weight / total, ..*source }).collect(),
    }
}
