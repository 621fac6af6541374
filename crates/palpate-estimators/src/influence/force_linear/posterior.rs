//! Posterior of offsets and influence functions, linear functionals of the process.
//!
//! With k the covariance with the presses, h the effects of offset and polynomials, and the symbols of
//! [`super::evidence`], the mean is hᵀ·β + (L⁻¹·k)ᵀ·w and the variance k₀ − |L⁻¹·k|² + |R⁻ᵀ·(h − Hᵀ·A⁻¹·k)|²
//! over s² (universal kriging; Rasmussen and Williams, eq. 2.41 and 2.42). A source adds its amplitude times
//! its projected functional; differences between sources add variance.

use super::drift::END;
use super::evidence::{ChannelFit, Evidence, RestrictedCovariance, SourceFit, WhiteSources};
use super::noise_prior::NoiseDensity;
use super::prior::Prior;
use crate::influence::calibration::CalibrationRows;
use crate::influence::measured::MeasuredError;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, Axis as Dimension, s};
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::watch::Watch;

#[derive(Clone, Debug)]
pub(super) struct Functions {
    pub offset: f64,
    pub noise_variance: f64,
    /// f at each position.
    pub values: Vec<f64>,
    pub offset_variance: f64,
    pub variances: Vec<f64>,
    /// Covariances of f with the offset.
    pub covariances: Vec<f64>,
}

impl Functions {
    /// Mean and covariance of a mixture, with probabilities that sum to 1.
    pub fn averaged(mixture: &[(f64, Self)]) -> Self {
        let places = mixture.first().map_or(0, |(_, functions)| functions.values.len());
        let mean_of = |value: &dyn Fn(&Self) -> f64| {
            mixture.iter().map(|(weight, own)| weight * value(own)).sum::<f64>()
        };
        let offset = mean_of(&|own| own.offset);
        let values: Vec<f64> = (0..places).map(|k| mean_of(&|own| own.values[k])).collect();
        let variance = |k: usize| mean_of(&|own| own.variances[k] + (own.values[k] - values[k]).powi(2));
        let covariance = |k: usize| {
            mean_of(&|own| own.covariances[k] + (own.values[k] - values[k]) * (own.offset - offset))
        };
        Self {
            offset,
            noise_variance: mean_of(&|own| own.noise_variance),
            offset_variance: mean_of(&|own| own.offset_variance + (own.offset - offset).powi(2)),
            variances: (0..places).map(variance).collect(),
            covariances: (0..places).map(covariance).collect(),
            values,
        }
    }
}

/// Hyperparameters that the posterior of some channels is conditioned on.
pub(super) struct Conditions<'a> {
    pub prior: &'a Prior,
    /// ρ.
    pub ratio: f64,
    /// Channels, with s² where it is not averaged.
    pub channels: Vec<(usize, Option<f64>)>,
    /// Noise of every channel; empty where s² is given.
    pub densities: &'a [NoiseDensity],
}

impl<'a> Conditions<'a> {
    /// Those of `channels` with fits of equal ρ.
    pub fn of_fits(prior: &'a Prior, fits: &[ChannelFit], channels: &[usize]) -> Self {
        let ratio = channels.first().map_or(1.0, |c| fits[*c].ratio);
        let channels = channels.iter().map(|c| (*c, Some(fits[*c].signal))).collect();
        Self { prior, ratio, channels, densities: &[] }
    }
}

/// Groups channels of equal ρ, which share one factorization.
pub(super) fn of_equal_ratio(fits: &[ChannelFit]) -> Vec<Vec<usize>> {
    let mut channels: Vec<usize> = (0..fits.len()).collect();
    channels.sort_by(|a, b| fits[*a].ratio.total_cmp(&fits[*b].ratio));
    channels.chunk_by(|a, b| fits[*a].ratio == fits[*b].ratio).map(<[usize]>::to_vec).collect()
}

/// Offset at a time, if any, plus response times influence at a position.
struct Functional<'a> {
    time: Option<f64>,
    response: f64,
    place_m: &'a [f64],
}

const BLOCK: usize = 256;

impl<'a> Functional<'a> {
    fn offset_at(time: f64) -> Self {
        Self { time: Some(time), response: 0.0, place_m: &[] }
    }

    fn influence(place_m: &'a Vec<f64>) -> Self {
        Self { time: None, response: 1.0, place_m }
    }

    fn readings(prior: &Prior, presses: &'a CalibrationRows) -> Vec<Self> {
        let responses = prior.responses(presses).into_iter();
        let times_and_places = presses.time.iter().zip(&presses.positions_m);
        let readings = responses.zip(times_and_places);
        readings.map(|(response, (time, place_m))| Self { time: Some(*time), response, place_m }).collect()
    }
}

struct Functionals<'a> {
    asked: &'a [Functional<'a>],
    /// h, q × functionals.
    effects: Array2<f64>,
    /// k, n × functionals.
    covariance: Array2<f64>,
    /// k₀.
    variance: Vec<f64>,
}

impl<'a> Functionals<'a> {
    fn new(prior: &Prior, presses: &CalibrationRows, ratio: f64, asked: &'a [Functional<'a>]) -> Self {
        let mut effects = Array2::zeros((1 + prior.polynomials(), asked.len()));
        let mut covariance = Array2::zeros((presses.len(), asked.len()));
        let mut variance = vec![0.0; asked.len()];
        let responses = prior.responses(presses);
        for (k, Functional { time, response, place_m }) in asked.iter().enumerate() {
            let mut column = covariance.column_mut(k);
            if let Some(time) = time {
                effects[[0, k]] = 1.0;
                let drift = presses.time.iter().map(|other| ratio * prior.drift_between(*time, *other));
                column += &drift.collect::<Array1<f64>>();
                variance[k] += ratio * prior.drift_between(*time, *time);
            }
            if *response != 0.0 {
                let h = Array1::from(prior.polynomials_at(place_m));
                effects.slice_mut(s![1.., k]).assign(&(*response * h));
                column.scaled_add(*response, &prior.influence_covariance(presses, &responses, place_m));
                variance[k] += response * response * prior.influence_variance();
            }
        }
        Self { asked, effects, covariance, variance }
    }

    fn of_sources(&self, prior: &Prior, sensors_m: &[Vec<f64>]) -> Array2<f64> {
        let mut of_sources = Array2::zeros((self.asked.len(), sensors_m.len()));
        for (mut row, Functional { response, place_m, .. }) in of_sources.outer_iter_mut().zip(self.asked) {
            if *response != 0.0 && !sensors_m.is_empty() {
                row.assign(&(*response * prior.sources_at(place_m, sensors_m)));
            }
        }
        of_sources
    }
}

/// Moments, with the covariance to the batch's first functional.
#[derive(Clone, Copy, Debug)]
struct Moments {
    mean: f64,
    variance: f64,
    with_first: f64,
}

/// Offsets and influences of unit response.
pub(super) fn functions(
    conditions: &Conditions,
    presses: &CalibrationRows,
    sensors_m: &[Vec<f64>],
    places_m: &[Vec<f64>],
    watch: Watch,
) -> Result<Vec<Functions>, MeasuredError> {
    let posterior = Posterior::new(conditions, presses, sensors_m)?;
    let empty = |channel: &ChannelPosterior| Functions {
        offset: presses.centre[channel.c],
        noise_variance: channel.signal * conditions.ratio,
        values: Vec::with_capacity(places_m.len()),
        offset_variance: 0.0,
        variances: Vec::with_capacity(places_m.len()),
        covariances: Vec::with_capacity(places_m.len()),
    };
    let mut functions: Vec<Functions> = posterior.channels.iter().map(empty).collect();
    for block in places_m.chunks(BLOCK) {
        watch.round()?;
        let influences = block.iter().map(Functional::influence);
        let asked: Vec<Functional> = std::iter::once(Functional::offset_at(END)).chain(influences).collect();
        for (moments, out) in posterior.moments(&asked).into_iter().zip(&mut functions) {
            let (offset, influences) = (moments[0], &moments[1..]);
            if out.values.is_empty() {
                out.offset += offset.mean;
                out.offset_variance = offset.variance;
            }
            out.values.extend(influences.iter().map(|moments| moments.mean));
            out.variances.extend(influences.iter().map(|moments| moments.variance));
            out.covariances.extend(influences.iter().map(|moments| moments.with_first));
        }
    }
    Ok(functions)
}

/// Means and variances of the readings of `others`, without noise.
pub(super) fn readings(
    conditions: &Conditions,
    presses: &CalibrationRows,
    sensors_m: &[Vec<f64>],
    others: &CalibrationRows,
) -> Result<Vec<Vec<(f64, f64)>>, MeasuredError> {
    let posterior = Posterior::new(conditions, presses, sensors_m)?;
    let moments = posterior.moments(&Functional::readings(conditions.prior, others));
    let of_channel = |(channel, moments): (&ChannelPosterior, Vec<Moments>)| {
        let centre = presses.centre[channel.c];
        moments.iter().map(|moments| (centre + moments.mean, moments.variance)).collect()
    };
    Ok(posterior.channels.iter().zip(moments).map(of_channel).collect())
}

pub(super) fn offsets(
    prior: &Prior,
    presses: &CalibrationRows,
    fits: &[ChannelFit],
    sensors_m: &[Vec<f64>],
    times: &[f64],
) -> Result<Vec<Vec<(f64, f64)>>, MeasuredError> {
    let asked: Vec<Functional> = times.iter().map(|time| Functional::offset_at(*time)).collect();
    let mut all = vec![Vec::new(); fits.len()];
    for channels in of_equal_ratio(fits) {
        let conditions = Conditions::of_fits(prior, fits, &channels);
        let posterior = Posterior::new(&conditions, presses, sensors_m)?;
        for block in asked.chunks(BLOCK) {
            for (c, moments) in channels.iter().zip(posterior.moments(block)) {
                let mean_and_variance = |found: &Moments| (presses.centre[*c] + found.mean, found.variance);
                all[*c].extend(moments.iter().map(mean_and_variance));
            }
        }
    }
    Ok(all)
}

pub(super) struct Posterior<'a> {
    prior: &'a Prior,
    presses: &'a CalibrationRows,
    pub solution: GeneralizedLeastSquares,
    pub channels: Vec<ChannelPosterior>,
}

impl<'a> Posterior<'a> {
    pub fn new(
        conditions: &Conditions<'a>,
        presses: &'a CalibrationRows,
        sensors_m: &[Vec<f64>],
    ) -> Result<Self, NotPositiveDefinite> {
        let Conditions { prior, ratio, ref channels, densities } = *conditions;
        let evidence = Evidence::new(presses, prior, sensors_m).with_noise(densities);
        let solution = GeneralizedLeastSquares::new(&evidence, ratio)?;
        let columns = evidence.sources.clone();
        let coarse = Sources::of_columns(&evidence, &solution, sensors_m.to_vec(), columns);
        let channel = |(c, signal): &(usize, Option<f64>)| {
            let sources = coarse.closer(&evidence, &solution, *c);
            ChannelPosterior { c: *c, signal: signal.unwrap_or(sources.signal), sources }
        };
        let channels = channels.iter().map(channel).collect();
        Ok(Self { prior, presses, solution, channels })
    }

    fn moments(&self, asked: &[Functional]) -> Vec<Vec<Moments>> {
        let Self { prior, presses, solution, channels } = self;
        let asked = Functionals::new(prior, presses, solution.ratio, asked);
        let explained = solution.restricted.cholesky.solve_lower_matrix(asked.covariance.clone());
        let unexplained = solution.restricted.unexplained_effects(&asked.effects, &explained);
        let process = ProcessVariances::new(&asked, [&explained, &unexplained]);
        let own: Vec<usize> = channels.iter().map(|posterior| posterior.c).collect();
        let means = asked.effects.t().dot(&solution.coefficients.select(Dimension(1), &own))
            + explained.t().dot(&solution.white.select(Dimension(1), &own));
        let of_channel = |(posterior, means): (&ChannelPosterior, ArrayView1<f64>)| {
            posterior.moments(prior, &asked, &means, &explained.view(), &process)
        };
        channels.iter().zip(means.columns()).map(of_channel).collect()
    }
}

/// Posterior variances without sources, over s².
struct ProcessVariances {
    variance: Vec<f64>,
    with_first: Vec<f64>,
}

impl ProcessVariances {
    /// Sums from L⁻¹·k and R⁻ᵀ·(h − Hᵀ·A⁻¹·k).
    fn new(asked: &Functionals, [explained, unexplained]: [&Array2<f64>; 2]) -> Self {
        let mut process =
            Self { variance: asked.variance.clone(), with_first: vec![0.0; asked.variance.len()] };
        for (sign, rows) in [(-1.0, explained), (1.0, unexplained)] {
            for row in rows.outer_iter() {
                let first = sign * row.first().copied().unwrap_or(0.0);
                let sums = process.variance.iter_mut().zip(&mut process.with_first);
                for ((variance, with_first), value) in sums.zip(&row) {
                    *variance += sign * value * value;
                    *with_first += first * value;
                }
            }
        }
        process
    }
}

pub(super) struct GeneralizedLeastSquares {
    pub ratio: f64,
    pub restricted: RestrictedCovariance,
    /// M·L⁻¹·y and the coefficients of H, by channels.
    pub white: Array2<f64>,
    coefficients: Array2<f64>,
}

impl GeneralizedLeastSquares {
    fn new(evidence: &Evidence, ratio: f64) -> Result<Self, NotPositiveDefinite> {
        let restricted = evidence.restricted(ratio)?;
        let (white, coefficients) = restricted.residuals(evidence.presses.means.clone());
        Ok(Self { ratio, restricted, white, coefficients })
    }
}

#[derive(Clone)]
pub(super) struct Sources {
    sensors_m: Vec<Vec<f64>>,
    pub white: WhiteSources,
    /// Coefficients of H for L⁻¹·u.
    coefficients: Array2<f64>,
    pub fits: Vec<SourceFit>,
    /// s², averaged over the sources.
    signal: f64,
}

impl Sources {
    fn new(evidence: &Evidence, solution: &GeneralizedLeastSquares, sensors_m: Vec<Vec<f64>>) -> Self {
        let columns = evidence.prior.sources(evidence.presses, &sensors_m);
        Self::of_columns(evidence, solution, sensors_m, columns)
    }

    /// Sources with the readings `columns`.
    fn of_columns(
        evidence: &Evidence,
        solution: &GeneralizedLeastSquares,
        sensors_m: Vec<Vec<f64>>,
        columns: Array2<f64>,
    ) -> Self {
        let (white, coefficients) = solution.restricted.residuals(columns);
        let white = WhiteSources::new(white, &evidence.amplitudes(solution.ratio));
        Self { sensors_m, white, coefficients, fits: Vec::new(), signal: 1.0 }
    }

    fn fitted(self, evidence: &Evidence, solution: &GeneralizedLeastSquares, c: usize) -> Self {
        let white = solution.white.slice(s![.., c..=c]);
        let products = self.white.products(&white);
        let sources = (&self.white, &products.column(0));
        let fit = evidence.channel(&solution.restricted, solution.ratio, c, &white.column(0), sources);
        Self { fits: fit.sources, signal: fit.signal, ..self }
    }

    /// Refines positions until the presses hardly resolve neighbours.
    fn closer(&self, evidence: &Evidence, solution: &GeneralizedLeastSquares, c: usize) -> Self {
        const ROUNDS: usize = 4;
        const ENOUGH: usize = 12;
        const NEXT: [usize; 2] = [80, 14];
        let mut found = self.clone().fitted(evidence, solution, c);
        for _ in 0..ROUNDS {
            let dimensions = found.sensors_m.first().map_or(0, Vec::len);
            let spans: Vec<(f64, f64, usize)> = (0..dimensions).map(|k| found.probable(k)).collect();
            if spans.iter().all(|(.., values)| *values >= ENOUGH) {
                break;
            }
            let axis = |(low_m, high_m, _): (f64, f64, usize)| {
                let count = NEXT[dimensions - 1];
                (0..count).map(move |i| low_m + (high_m - low_m) * (i as f64 + 0.5) / count as f64)
            };
            let places_m = match spans[..] {
                [x] => axis(x).map(|x_m| vec![x_m]).collect(),
                [x, y] => axis(x).flat_map(|x_m| axis(y).map(move |y_m| vec![x_m, y_m])).collect(),
                _ => break,
            };
            found = Self::new(evidence, solution, places_m).fitted(evidence, solution, c);
        }
        found
    }

    /// Span of probable coordinates, with a step at either end, and number of values.
    fn probable(&self, k: usize) -> (f64, f64, usize) {
        let distinct = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.dedup();
            values
        };
        let all = distinct(self.sensors_m.iter().map(|place_m| place_m[k]).collect());
        let probable = distinct(self.fits.iter().map(|fit| self.sensors_m[fit.place][k]).collect());
        let step_m = all.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        match (probable.first(), probable.last()) {
            (Some(low_m), Some(high_m)) => (low_m - step_m, high_m + step_m, probable.len()),
            _ => (0.0, 0.0, usize::MAX),
        }
    }
}

pub(super) struct ChannelPosterior {
    pub c: usize,
    /// s².
    pub signal: f64,
    pub sources: Sources,
}

impl ChannelPosterior {
    /// `base` are the means without sources.
    fn moments(
        &self,
        prior: &Prior,
        asked: &Functionals,
        base: &ArrayView1<f64>,
        explained: &ArrayView2<f64>,
        process: &ProcessVariances,
    ) -> Vec<Moments> {
        let used: Vec<usize> = {
            let mut places: Vec<usize> = self.sources.fits.iter().map(|source| source.place).collect();
            places.dedup();
            places
        };
        // Source functionals minus their prediction from the presses.
        let vs = self.sources.white.columns.select(Dimension(1), &used);
        let coefficients = self.sources.coefficients.select(Dimension(1), &used);
        let sensors_m: Vec<Vec<f64>> =
            used.iter().map(|place| self.sources.sensors_m[*place].clone()).collect();
        let rest = asked.of_sources(prior, &sensors_m)
            - (asked.effects.t().dot(&coefficients) + explained.t().dot(&vs));
        let column = |place: usize| used.binary_search(&place).unwrap_or(0);
        let sources: Vec<_> = self.sources.fits.iter().map(|source| (column(source.place), source)).collect();
        // Mean over the sources of their addition to functional k.
        let shift_of = |k: usize| sources.iter().map(|(j, f)| f.weight * rest[[k, *j]] * f.amplitude).sum();
        let first_shift: f64 = shift_of(0);
        let moments = |k: usize| {
            let shift: f64 = shift_of(k);
            let mut variance = self.signal * process.variance[k];
            let mut covariance = self.signal * process.with_first[k];
            for (j, f) in &sources {
                let (r, first) = (rest[[k, *j]], rest[[0, *j]]);
                variance += f.weight * (self.signal * f.variance * r * r + (r * f.amplitude - shift).powi(2));
                covariance += f.weight
                    * (self.signal * f.variance * r * first
                        + (r * f.amplitude - shift) * (first * f.amplitude - first_shift));
            }
            Moments { mean: base[k] + shift, variance: variance.max(0.0), with_first: covariance }
        };
        (0..asked.variance.len()).map(moments).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixture_has_the_variances_within_and_between_its_functions() {
        let functions = |offset: f64, value: f64| Functions {
            offset,
            noise_variance: 1.0,
            values: vec![value],
            offset_variance: 0.1,
            variances: vec![0.2],
            covariances: vec![-0.05],
        };
        let mixture = [(0.25, functions(1.0, 4.0)), (0.75, functions(3.0, 2.0))];
        let Functions { offset, noise_variance, values, offset_variance, variances, covariances } =
            Functions::averaged(&mixture);
        assert_eq!((offset, noise_variance, values[0]), (2.5, 1.0, 2.5));
        // Variance between two values that are 2 apart: ¼·¾·2².
        assert!((offset_variance - 0.85).abs() < 1e-12 && (variances[0] - 0.95).abs() < 1e-12);
        assert!((covariances[0] + 0.8).abs() < 1e-12);
    }
}
