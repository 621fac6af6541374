//! Offsets and influence functions at places, given presses and what is taken of the functions beforehand.
//!
//! Offset and influences are linear functionals of the process: with k their covariance with the presses, h their share of offset
//! and polynomials, and the symbols of [`super::evidence`], the mean is hᵀ·β + (L⁻¹·k)ᵀ·w and the variance
//! k₀ − |L⁻¹·k|² + |R⁻ᵀ·(h − Hᵀ·A⁻¹·k)|², in units of s² (universal kriging; Rasmussen and Williams, eq. 2.41 and 2.42). A source adds its
//! amplitude times what of its own functional the presses do not tell; the functions of several sources are averaged, and how far
//! they are apart is variance.

use super::evidence::{ChannelFit, Evidence, Restricted, SourceFit};
use super::presses::Presses;
use super::prior::Prior;
use crate::influence::measured::MeasuredError;
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, Axis as Dimension, s};
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::watch::Watch;

/// Mean of a channel's offset and of its influence at places, and what presses leave open of them.
#[derive(Clone, Debug)]
pub(super) struct Functions {
    pub offset: f64,
    /// f at each place.
    pub values: Vec<f64>,
    pub offset_variance: f64,
    /// Variance of f at each place.
    pub variances: Vec<f64>,
    /// Covariance of f at each place with the offset.
    pub covariances: Vec<f64>,
}

/// Channels that share the ratio of noise to signal, and so one factor.
pub(super) fn of_equal_ratio(fits: &[ChannelFit]) -> Vec<Vec<usize>> {
    let mut channels: Vec<usize> = (0..fits.len()).collect();
    channels.sort_by(|a, b| fits[*a].ratio.total_cmp(&fits[*b].ratio));
    channels.chunk_by(|a, b| fits[*a].ratio == fits[*b].ratio).map(<[usize]>::to_vec).collect()
}

/// Linear functionals of the process: the offset at the recording's end, then the influence at each place.
struct Functionals {
    /// h, q × (1 + places).
    effects: Array2<f64>,
    /// k, n × (1 + places).
    covariance: Array2<f64>,
    /// k₀.
    variance: Vec<f64>,
}

/// Share of the recording at whose end the offset is asked: what is located comes after it.
const END: f64 = 1.0;

impl Functionals {
    fn new(prior: &Prior, presses: &Presses, ratio: f64, places_m: &[Vec<f64>]) -> Self {
        let n = presses.len();
        let mut effects = Array2::zeros((1 + prior.polynomials(), 1 + places_m.len()));
        let mut covariance = Array2::zeros((n, 1 + places_m.len()));
        effects[[0, 0]] = 1.0;
        let drift = ratio * prior.drift;
        covariance
            .column_mut(0)
            .assign(&presses.time.iter().map(|time| drift * time.min(END)).collect::<Array1<f64>>());
        let mut variance = vec![drift * END];
        let responses = prior.responses(presses);
        for (k, place_m) in places_m.iter().enumerate() {
            let h = Array1::from(prior.polynomials_at(place_m));
            effects.slice_mut(s![1.., k + 1]).assign(&h);
            covariance.column_mut(k + 1).assign(&prior.influence_covariance(presses, &responses, place_m));
            variance.push(prior.influence_variance());
        }
        Self { effects, covariance, variance }
    }
}

/// Offsets and influences of some channels, which share a ratio, at places; sensors are looked for at `sensors_m` and closer to the
/// probable ones.
///
/// The influences are those of unit response, φ = F̄.
pub(super) fn functions(
    prior: &Prior,
    presses: &Presses,
    channels: &[(usize, &ChannelFit)],
    sensors_m: &[Vec<f64>],
    places_m: &[Vec<f64>],
    watch: Watch,
) -> Result<Vec<Functions>, MeasuredError> {
    /// Places that are asked at once.
    const BLOCK: usize = 256;
    let Some((_, first)) = channels.first() else { return Ok(Vec::new()) };
    let evidence = Evidence::new(presses, prior, sensors_m);
    let known = Known::new(&evidence, first.ratio)?;
    let coarse = Sources::new(&evidence, &known, sensors_m.to_vec());
    let told: Vec<Told> = channels
        .iter()
        .map(|(c, fit)| Told { c: *c, signal: fit.signal, sources: coarse.closer(&evidence, &known, *c) })
        .collect();
    let empty = |c: usize| Functions {
        offset: presses.centre[c],
        values: Vec::with_capacity(places_m.len()),
        offset_variance: 0.0,
        variances: Vec::with_capacity(places_m.len()),
        covariances: Vec::with_capacity(places_m.len()),
    };
    let mut functions: Vec<Functions> = channels.iter().map(|(c, _)| empty(*c)).collect();
    for block in places_m.chunks(BLOCK) {
        watch.round()?;
        let asked = Functionals::new(prior, presses, first.ratio, block);
        let explained = known.restricted.cholesky.solve_lower_matrix(asked.covariance.clone());
        let open = known.restricted.open_effects(&asked.effects, &explained);
        for (told, out) in told.iter().zip(&mut functions) {
            let base = asked.effects.t().dot(&known.coefficients.column(told.c))
                + explained.t().dot(&known.white.column(told.c));
            told.add_into(out, prior, &asked, block, &base.view(), [explained.view(), open.view()]);
        }
    }
    Ok(functions)
}

/// Presses at one ratio of noise to signal.
struct Known {
    ratio: f64,
    restricted: Restricted,
    /// M·L⁻¹·y of every channel, and its coefficients of H.
    white: Array2<f64>,
    coefficients: Array2<f64>,
}

impl Known {
    fn new(evidence: &Evidence, ratio: f64) -> Result<Self, NotPositiveDefinite> {
        let restricted = evidence.restricted(ratio)?;
        let (white, coefficients) = restricted.residuals(evidence.presses.means.clone());
        Ok(Self { ratio, restricted, white, coefficients })
    }
}

/// Sources at some places, as presses tell them of a channel.
#[derive(Clone)]
struct Sources {
    sensors_m: Vec<Vec<f64>>,
    /// M·L⁻¹·u of each source, and its coefficients of H.
    white: Array2<f64>,
    coefficients: Array2<f64>,
    fits: Vec<SourceFit>,
}

impl Sources {
    fn new(evidence: &Evidence, known: &Known, sensors_m: Vec<Vec<f64>>) -> Self {
        let columns = evidence.prior.sources(evidence.presses, &sensors_m);
        let (white, coefficients) = known.restricted.residuals(columns);
        Self { sensors_m, white, coefficients, fits: Vec::new() }
    }

    fn fitted(self, evidence: &Evidence, known: &Known, c: usize) -> Self {
        let fit = evidence.channel(&known.restricted, known.ratio, c, &known.white.column(c), &self.white);
        Self { fits: fit.sources, ..self }
    }

    /// Those of channel `c`, with places close enough together that the presses hardly tell neighbours apart.
    fn closer(&self, evidence: &Evidence, known: &Known, c: usize) -> Self {
        const ROUNDS: usize = 4;
        /// Values of a coordinate among the probable places that are enough.
        const ENOUGH: usize = 12;
        /// Values of a coordinate that are looked at next, on a line and on a plane.
        const NEXT: [usize; 2] = [80, 14];
        let mut found = self.clone().fitted(evidence, known, c);
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
            found = Self::new(evidence, known, places_m).fitted(evidence, known, c);
        }
        found
    }

    /// Span of coordinate k of the probable places, a step beyond at either end, and how many values it has there.
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

/// A channel of presses with the sources that these tell.
struct Told {
    c: usize,
    signal: f64,
    sources: Sources,
}

impl Told {
    /// Adds offset and influences at a block of places; `base` are the means without sources.
    fn add_into(
        &self,
        out: &mut Functions,
        prior: &Prior,
        asked: &Functionals,
        block: &[Vec<f64>],
        base: &ArrayView1<f64>,
        [explained, open]: [ArrayView2<f64>; 2],
    ) {
        let used: Vec<usize> = {
            let mut places: Vec<usize> = self.sources.fits.iter().map(|source| source.place).collect();
            places.dedup();
            places
        };
        // What of each source the presses do not tell, at the offset and each place.
        let vs = self.sources.white.select(Dimension(1), &used);
        let coefficients = self.sources.coefficients.select(Dimension(1), &used);
        let mut rest = -(asked.effects.t().dot(&coefficients) + explained.t().dot(&vs));
        let sensors_m: Vec<Vec<f64>> =
            used.iter().map(|place| self.sources.sensors_m[*place].clone()).collect();
        if !used.is_empty() {
            for (mut row, place_m) in rest.outer_iter_mut().skip(1).zip(block) {
                row += &prior.sources_at(place_m, &sensors_m);
            }
        }
        let column = |place: usize| used.binary_search(&place).unwrap_or(0);
        let sources: Vec<_> = self.sources.fits.iter().map(|source| (column(source.place), source)).collect();
        // Mean and second moment over the sources, of functional k, and with the offset.
        let offset_rest = rest.row(0).to_owned();
        let mean_of = |k: usize| {
            base[k] + sources.iter().map(|(j, f)| f.weight * rest[[k, *j]] * f.amplitude).sum::<f64>()
        };
        let offset_shift: f64 = sources.iter().map(|(j, f)| f.weight * offset_rest[*j] * f.amplitude).sum();
        for k in 0..asked.variance.len() {
            let mean = mean_of(k);
            let shift = mean - base[k];
            let told = explained.column(k);
            let within = asked.variance[k] - told.dot(&told) + open.column(k).dot(&open.column(k));
            let with_offset = -told.dot(&explained.column(0)) + open.column(k).dot(&open.column(0));
            let (mut variance, mut covariance) = (self.signal * within, self.signal * with_offset);
            for (j, f) in &sources {
                let (r, o) = (rest[[k, *j]], offset_rest[*j]);
                variance += f.weight * (self.signal * f.variance * r * r + (r * f.amplitude - shift).powi(2));
                covariance += f.weight
                    * (self.signal * f.variance * r * o
                        + (r * f.amplitude - shift) * (o * f.amplitude - offset_shift));
            }
            if k > 0 {
                out.values.push(mean);
                out.variances.push(variance.max(0.0));
                out.covariances.push(covariance);
            } else if out.values.is_empty() {
                out.offset += mean;
                out.offset_variance = variance.max(0.0);
            }
        }
    }
}
