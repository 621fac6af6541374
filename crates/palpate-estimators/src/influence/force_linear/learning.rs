//! From presses of recorded force to the influence functions of a surface without a model.
//!
//! Channel c reads o_c + F·f_c(a) + e_c for the force F at the position a. The influence f_c is a Gaussian process whose
//! covariance is s_c²·(k(a, a′) + [`CONSTANT`])/F̄², F̄ being the root mean square force, k a correlation that all channels share
//! and the constant a mean that is next to unknown; the offset o_c is next to unknown too. The noise e_c has the variance
//! ρ_c·s_c². For each k and ρ one factorisation serves all channels, and s_c² follows in closed form; k's kernel and length
//! scales are those under which the presses of all channels together are the most probable, and ρ_c is the channel's own.
//!
//! Influence functions of one surface resemble each other, so what the presses leave open of them does too: between presses all
//! channels err together. Their covariance there is B·v(a), with v of the median ρ and B = (s_c·s_c′·R_cc′), R being the correlation
//! of the channels' whitened presses.
//!
//! How far readings are from linear in the force is asked of the presses too: a gain that changes smoothly with the force adds
//! δ²·k(a, a′)·exp(−(F − F′)²/(2·F̄²)) in the place of k, and the δ of the greatest evidence says how much.

use crate::influence::measured::MeasuredError;
use crate::influence::noise::{Noise, Whitening};
use crate::recording::Recording;
use crate::setup::Setup;
use ndarray::{Array1, Array2, ArrayViewMut1, Axis as Dimension};
use palpate_mechanics::surface::Extent;
use palpate_numerics::regression::Kernel;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{Cholesky, NotPositiveDefinite, bisect, mean, median, root_mean_square};
use std::cmp::Ordering;

/// Variance of an influence function's mean over that of its changes: far more, so that the presses tell it.
const CONSTANT: f64 = 25.0;
/// Variance of an offset over that of the changes of a reading at the root mean square force.
const OFFSET: f64 = 400.0;
/// ln ρ that are tried: 10⁻¹⁰ to 10.
const DECADES: std::ops::RangeInclusive<i32> = -10..=1;
/// Presses that the search for kernel and length scales looks at.
const MOST_SEARCHED: usize = 150;
/// Presses that are learnt from; the time grows with their cube, and so many tell all that there is.
const MOST_PRESSES: usize = 1000;
/// Distinct positions from which on every fifth can be held out.
const LEAST_TO_JUDGE: usize = 6;

/// Presses of recorded force, repeats averaged: rows of the same position and force are one.
#[derive(Clone, Debug)]
pub(super) struct Presses {
    /// Position of each, along and, on a plane, across, in metres.
    positions_m: Vec<Vec<f64>>,
    force_n: Vec<f64>,
    /// Number of rows that were averaged.
    count: Vec<f64>,
    /// Mean reading of each channel over the recording.
    centre: Vec<f64>,
    /// Mean reading less the centre, a row a press.
    means: Array2<f64>,
    /// Sum of squared deviations of repeats from their mean, a value a channel, and how many degrees of freedom it has.
    scatter: Vec<f64>,
    freedom: f64,
}

impl Presses {
    /// The presses of a recording, in rising order of position; `None` where the force of a row is not known.
    pub fn average(setup: &Setup, recording: &Recording) -> Option<Self> {
        let extent = setup.surface().extent();
        let mut rows = Vec::with_capacity(recording.rows.len());
        for row in &recording.rows {
            let force_n = row.force_n.or(setup.force_n()).filter(|force_n| force_n.is_finite())?;
            // Without a force it does not matter where nothing presses.
            let position_m: Vec<f64> = match force_n {
                0.0 => vec![0.0; extent.dimensions()],
                _ => extent.coordinates_m(row.position).collect(),
            };
            rows.push((position_m, force_n, &row.reading));
        }
        let order = |a: &(Vec<f64>, f64, &Vec<f64>), b: &(Vec<f64>, f64, &Vec<f64>)| {
            compare(&a.0, &b.0).then(a.1.total_cmp(&b.1))
        };
        rows.sort_by(order);
        let groups: Vec<_> = rows.chunk_by(|a, b| order(a, b).is_eq()).collect();
        let channels = recording.channels.len();
        let centre: Vec<f64> =
            (0..channels).map(|c| mean(rows.iter().map(|(.., reading)| reading[c]))).collect();
        let mut means = Array2::zeros((groups.len(), channels));
        let mut scatter = vec![0.0; channels];
        for (mut mean, group) in means.outer_iter_mut().zip(&groups) {
            let count = group.len() as f64;
            for (c, mean) in mean.iter_mut().enumerate() {
                *mean = group.iter().map(|(.., reading)| reading[c]).sum::<f64>() / count;
                scatter[c] += group.iter().map(|(.., reading)| (reading[c] - *mean).powi(2)).sum::<f64>();
                *mean -= centre[c];
            }
        }
        Some(Self {
            positions_m: groups.iter().map(|group| group[0].0.clone()).collect(),
            force_n: groups.iter().map(|group| group[0].1).collect(),
            count: groups.iter().map(|group| group.len() as f64).collect(),
            freedom: (rows.len() - groups.len()) as f64,
            centre,
            means,
            scatter,
        })
    }

    /// Number of presses.
    pub fn len(&self) -> usize {
        self.force_n.len()
    }

    /// Distinct forces, that of no contact among them.
    pub fn distinct_forces(&self) -> usize {
        let mut forces = self.force_n.clone();
        forces.sort_by(f64::total_cmp);
        forces.dedup();
        forces.len()
    }

    /// Distinct positions that were pressed, in rising order.
    pub fn positions_m(&self) -> Vec<&[f64]> {
        let pressed = self.positions_m.iter().zip(&self.force_n).filter(|(_, force_n)| **force_n != 0.0);
        let mut positions: Vec<&[f64]> = pressed.map(|(position_m, _)| position_m.as_slice()).collect();
        positions.dedup();
        positions
    }

    /// Degrees of freedom that tell the noise of a channel: rows less a value for every position and the offset; at least a few.
    pub fn noise_freedom(&self) -> f64 {
        const FEW: f64 = 8.0;
        let rows = self.count.iter().sum::<f64>();
        (rows - self.positions_m().len() as f64 - 1.0).max(FEW)
    }

    /// The greatest force, in newtons.
    pub fn greatest_force_n(&self) -> f64 {
        self.force_n.iter().fold(0.0, |most, force_n| most.max(force_n.abs()))
    }

    /// The channels that change by more than rounding, from 0.
    fn changing_channels(&self) -> Vec<usize> {
        let changes = |c: &usize| {
            let most = self.means.column(*c).iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            most > 1e-12 * self.centre[*c].abs() && most > 0.0
        };
        (0..self.centre.len()).filter(changes).collect()
    }

    /// The same of some channels alone.
    fn of_channels(&self, channels: &[usize]) -> Self {
        let of = |values: &[f64]| channels.iter().map(|c| values[*c]).collect();
        Self {
            centre: of(&self.centre),
            scatter: of(&self.scatter),
            means: self.means.select(Dimension(1), channels),
            ..self.clone()
        }
    }

    /// Those numbered `kept`.
    fn select(&self, kept: &[usize]) -> Self {
        let of = |values: &[f64]| kept.iter().map(|i| values[*i]).collect();
        Self {
            positions_m: kept.iter().map(|i| self.positions_m[*i].clone()).collect(),
            force_n: of(&self.force_n),
            count: of(&self.count),
            means: self.means.select(Dimension(0), kept),
            ..self.clone()
        }
    }

    /// Evenly picked, no more than `most`.
    fn thinned(&self, most: usize) -> Self {
        let step = (self.len() as f64 / most as f64).max(1.0);
        let kept: Vec<usize> =
            (0..).map(|i| (f64::from(i) * step) as usize).take_while(|i| *i < self.len()).collect();
        self.select(&kept)
    }
}

fn compare(a: &[f64], b: &[f64]) -> Ordering {
    a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

/// What all channels share: the correlation k, and how far readings are from linear in the force.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Correlation {
    pub kernel: Kernel,
    /// Length scale of each coordinate, in metres.
    pub lengths_m: Vec<f64>,
    /// δ: the relative change of an influence with the force.
    pub nonlinearity: f64,
}

impl Correlation {
    /// k between two positions.
    fn between(&self, a_m: &[f64], b_m: &[f64]) -> f64 {
        let coordinates = a_m.iter().zip(b_m).zip(&self.lengths_m);
        self.kernel.correlation(coordinates.map(|((a, b), length)| ((a - b) / length).powi(2)).sum())
    }

    /// Covariance of the presses, over s², but for the noise: n × n.
    fn of_presses(&self, presses: &Presses, mean_square_n2: f64) -> Array2<f64> {
        let n = presses.len();
        let mut covariance = Array2::zeros((n, n));
        for i in 0..n {
            for j in 0..=i {
                let correlation = self.between(&presses.positions_m[i], &presses.positions_m[j]);
                let (f, g) = (presses.force_n[i], presses.force_n[j]);
                let changed = self.nonlinearity.powi(2) * (-0.5 * (f - g).powi(2) / mean_square_n2).exp();
                let influence = correlation * (1.0 + changed) + CONSTANT;
                covariance[[i, j]] = f * g / mean_square_n2 * influence + OFFSET;
            }
        }
        covariance
    }
}

/// Noise and signal of one channel under some correlation.
#[derive(Clone, Copy, Debug)]
struct ChannelFit {
    /// ln ρ.
    log_ratio: f64,
    /// s².
    signal: f64,
    /// ln of the probability density of the channel's presses, less a constant.
    evidence: f64,
}

impl ChannelFit {
    fn noise_variance(&self) -> f64 {
        self.signal * self.log_ratio.exp()
    }
}

/// Presses of the channels in use, whose evidence is asked.
struct Evidence<'a> {
    presses: &'a Presses,
    mean_square_n2: f64,
}

impl Evidence<'_> {
    /// The best ρ of every channel under a correlation.
    fn channels(&self, correlation: &Correlation) -> Vec<ChannelFit> {
        let covariance = correlation.of_presses(self.presses, self.mean_square_n2);
        let tried: Vec<Vec<ChannelFit>> =
            DECADES.map(|decade| self.with_ratio(&covariance, f64::from(decade) * 10f64.ln())).collect();
        (0..self.presses.centre.len())
            .map(|c| peak(&tried.iter().map(|fits| fits[c]).collect::<Vec<_>>()))
            .collect()
    }

    /// The evidence of every channel at one ρ, its s² the most probable one.
    fn with_ratio(&self, covariance: &Array2<f64>, log_ratio: f64) -> Vec<ChannelFit> {
        let presses = self.presses;
        let rows = presses.len() as f64 + presses.freedom;
        let nothing = ChannelFit { log_ratio, signal: 1.0, evidence: f64::NEG_INFINITY };
        let Ok(cholesky) = Cholesky::factor(with_noise(covariance, presses, log_ratio)) else {
            return vec![nothing; presses.centre.len()];
        };
        let whitened = cholesky.solve_lower_matrix(presses.means.clone());
        let determinant = cholesky.log_determinant() + presses.freedom * log_ratio;
        let fits = whitened.columns().into_iter().zip(&presses.scatter);
        fits.map(|(whitened, scatter)| {
            let signal = (whitened.dot(&whitened) + scatter / log_ratio.exp()) / rows;
            ChannelFit { log_ratio, signal, evidence: -0.5 * (rows * signal.ln() + determinant) }
        })
        .collect()
    }

    /// The evidence of all channels together.
    fn total(&self, correlation: &Correlation) -> f64 {
        self.channels(correlation).iter().map(|fit| fit.evidence).sum()
    }
}

/// The greatest evidence of fits at evenly spaced ln ρ, by a parabola through the best and its neighbours.
fn peak(fits: &[ChannelFit]) -> ChannelFit {
    let best = (0..fits.len()).max_by(|a, b| fits[*a].evidence.total_cmp(&fits[*b].evidence)).unwrap_or(0);
    let (Some(before), Some(behind)) = (best.checked_sub(1).map(|i| fits[i]), fits.get(best + 1)) else {
        return fits[best];
    };
    let here = fits[best];
    let (rise, bend) =
        (behind.evidence - before.evidence, 2.0 * here.evidence - before.evidence - behind.evidence);
    if !(rise.is_finite() && bend > 0.0) {
        return here;
    }
    let shift = (0.5 * rise / bend).clamp(-0.5, 0.5);
    // Between two decades s² is taken as a power of ρ.
    let other = if shift > 0.0 { *behind } else { before };
    ChannelFit {
        log_ratio: here.log_ratio + shift * (behind.log_ratio - here.log_ratio),
        signal: here.signal * (other.signal / here.signal).powf(shift.abs()),
        evidence: here.evidence + 0.25 * rise * shift,
    }
}

/// Offsets and influence functions of all channels in use at some places, as the presses tell them.
#[derive(Clone, Debug)]
pub(super) struct Functions {
    pub offsets: Vec<f64>,
    /// Standard deviation of the noise of each channel.
    pub noise_sd: Vec<f64>,
    /// Channels of unit noise, in which what the presses leave open is independent.
    pub whitening: Whitening,
    /// f at each place, per newton, a row a place.
    pub values: Array2<f64>,
    /// What the presses leave open of the offsets and of f, over B.
    pub open: OpenVariance,
}

/// Variances that calibration leaves, over those of the signal.
#[derive(Clone, Debug)]
pub(super) struct OpenVariance {
    /// Of the offset.
    pub offset: f64,
    /// Of f at each place, per newton squared.
    pub influences: Vec<f64>,
    /// Covariance of f at each place with the offset, per newton.
    pub covariances: Vec<f64>,
}

/// What a recording tells of a surface.
pub(super) struct Learnt {
    presses: Presses,
    pub correlation: Correlation,
    /// The channels that change, from 0.
    pub live: Vec<usize>,
    /// Those of the channels in use.
    fits: Vec<ChannelFit>,
    whitening: Whitening,
    mean_square_n2: f64,
    /// By what factor the variance of the learnt functions is multiplied, so that positions held out are as far off as it says.
    pub widening: f64,
}

impl Learnt {
    /// Finds the correlation and every channel's noise, and judges them by positions held out.
    pub fn new(presses: &Presses, extent: Extent, watch: Watch) -> Result<Self, MeasuredError> {
        let live = presses.changing_channels();
        let presses = presses.of_channels(&live);
        let mean_square_n2 = root_mean_square(&presses.force_n).powi(2);
        let searched = presses.thinned(MOST_SEARCHED);
        let evidence = Evidence { presses: &searched, mean_square_n2 };
        let correlation = most_probable(&evidence, extent, watch)?;
        let fits = evidence.channels(&correlation);
        let whitening = whitening(&evidence, &correlation, &fits)?;
        let presses = presses.thinned(MOST_PRESSES);
        let mut learnt = Self { presses, correlation, live, fits, whitening, mean_square_n2, widening: 1.0 };
        learnt.widening = learnt.held_out_widening(watch)?;
        Ok(learnt)
    }

    /// Number of presses that were learnt from.
    pub fn presses(&self) -> usize {
        self.presses.len()
    }

    /// The functions at `places_m`.
    pub fn functions(&self, places_m: &[Vec<f64>], watch: Watch) -> Result<Functions, MeasuredError> {
        let posterior = Posterior::new(self, &self.presses)?;
        let mut values = Array2::zeros((places_m.len(), self.fits.len()));
        let (mut influences, mut covariances) = (Vec::new(), Vec::new());
        for (place, (place_m, mut value)) in places_m.iter().zip(values.outer_iter_mut()).enumerate() {
            if place % 64 == 0 {
                watch.round()?;
            }
            let [variance, covariance] = posterior.influence_into(place_m, &mut value);
            influences.push(self.widening * variance);
            covariances.push(self.widening * covariance);
        }
        Ok(Functions {
            offsets: self.presses.centre.iter().zip(&posterior.offsets).map(|(a, b)| a + b).collect(),
            noise_sd: self.fits.iter().map(|fit| fit.noise_variance().sqrt()).collect(),
            whitening: self.whitening.clone(),
            values,
            open: OpenVariance { offset: self.widening * posterior.offset_variance, influences, covariances },
        })
    }

    /// How much larger than said the squared errors are at every fifth position, held out of the same process; at least 1.
    fn held_out_widening(&self, watch: Watch) -> Result<f64, MeasuredError> {
        const FOLDS: usize = 5;
        const MOST: f64 = 25.0;
        let positions_m = self.presses.positions_m();
        if positions_m.len() < LEAST_TO_JUDGE {
            return Ok(1.0);
        }
        let fold_of = |i: usize| {
            let place =
                positions_m.partition_point(|other| compare(other, &self.presses.positions_m[i]).is_lt());
            (self.presses.force_n[i] != 0.0).then_some(place % FOLDS)
        };
        let channels = self.fits.len();
        let (mut value, mut white) = (Array1::zeros(channels), vec![0.0; channels]);
        // Squared whitened errors with what noise and process say of them.
        let mut errors: Vec<[f64; 3]> = Vec::new();
        for fold in 0..FOLDS {
            watch.round()?;
            let (held, kept): (Vec<usize>, Vec<usize>) =
                (0..self.presses.len()).partition(|i| fold_of(*i) == Some(fold));
            let kept = self.presses.select(&kept);
            let posterior = Posterior::new(self, &kept)?;
            for &i in &held {
                let force_n = self.presses.force_n[i];
                let [variance, covariance] =
                    posterior.influence_into(&self.presses.positions_m[i], &mut value.view_mut());
                let open =
                    (posterior.offset_variance + force_n * (2.0 * covariance + force_n * variance)).max(0.0);
                let error: Vec<f64> = (0..channels)
                    .map(|c| self.presses.means[[i, c]] - posterior.offsets[c] - force_n * value[c])
                    .collect();
                self.whitening.apply(&error, &mut white);
                let said = white.iter().zip(&self.whitening.signal);
                errors.extend(said.map(|(e, signal)| [e * e, 1.0 / self.presses.count[i], signal * open]));
            }
        }
        let too_small = |widening: f64| {
            let standardized =
                errors.iter().map(|[square, noise, process]| square / (noise + widening * process));
            standardized.sum::<f64>() > errors.len() as f64
        };
        Ok(bisect((1.0, MOST), 30, too_small))
    }
}

/// Whitening of noise and signal: the noise independent, the signal correlated as the channels' whitened presses are.
fn whitening(
    evidence: &Evidence,
    correlation: &Correlation,
    fits: &[ChannelFit],
) -> Result<Whitening, MeasuredError> {
    let presses = evidence.presses;
    let covariance = correlation.of_presses(presses, evidence.mean_square_n2);
    let mut white = Array2::zeros(presses.means.dim());
    for (c, fit) in fits.iter().enumerate() {
        let cholesky = Cholesky::factor(with_noise(&covariance, presses, fit.log_ratio))?;
        let mut column = cholesky.solve_lower(&presses.means.column(c).to_owned());
        let length = column.dot(&column).sqrt();
        column *= fit.signal.sqrt() / length;
        white.column_mut(c).assign(&column);
    }
    let noise = Array2::from_diag(&fits.iter().map(ChannelFit::noise_variance).collect::<Array1<f64>>());
    let noise = Noise { covariance: noise, gain: 0.0 };
    Ok(Whitening::from_covariances(noise, &white.t().dot(&white))?)
}

/// The covariance of presses over s², with the noise of each.
fn with_noise(covariance: &Array2<f64>, presses: &Presses, log_ratio: f64) -> Array2<f64> {
    let mut covariance = covariance.clone();
    for (i, count) in presses.count.iter().enumerate() {
        covariance[[i, i]] += log_ratio.exp() / count;
    }
    covariance
}

/// The posterior of all channels, given some presses.
struct Posterior<'a> {
    learnt: &'a Learnt,
    presses: &'a Presses,
    /// What each press weighs in each channel's functions, n × C.
    weights: Array2<f64>,
    /// Offset of each channel less its centre.
    offsets: Vec<f64>,
    /// Of the median ρ.
    cholesky: Cholesky,
    /// L⁻¹ times the covariance of the presses with the offset, and what it leaves of the offset's variance.
    explained_offset: Array1<f64>,
    offset_variance: f64,
}

impl<'a> Posterior<'a> {
    fn new(learnt: &'a Learnt, presses: &'a Presses) -> Result<Self, NotPositiveDefinite> {
        let covariance = learnt.correlation.of_presses(presses, learnt.mean_square_n2);
        let factor = |log_ratio: f64| Cholesky::factor(with_noise(&covariance, presses, log_ratio));
        let mut weights = Array2::zeros(presses.means.dim());
        for (c, fit) in learnt.fits.iter().enumerate() {
            let solved = factor(fit.log_ratio)?.solve(&presses.means.column(c).to_owned());
            weights.column_mut(c).assign(&solved);
        }
        let log_ratios = learnt.fits.iter().map(|fit| fit.log_ratio).collect();
        let cholesky = factor(median(log_ratios).unwrap_or_default())?;
        let explained_offset = cholesky.solve_lower(&Array1::from_elem(presses.len(), OFFSET));
        Ok(Self {
            offsets: weights.columns().into_iter().map(|weights| OFFSET * weights.sum()).collect(),
            offset_variance: (OFFSET - explained_offset.dot(&explained_offset)).max(0.0),
            learnt,
            presses,
            weights,
            cholesky,
            explained_offset,
        })
    }

    /// Writes f of every channel at a place; returns its variance over that of the signal, and its covariance with the offset.
    fn influence_into(&self, place_m: &[f64], values: &mut ArrayViewMut1<f64>) -> [f64; 2] {
        let Learnt { correlation, mean_square_n2, .. } = self.learnt;
        let presses = self.presses.positions_m.iter().zip(&self.presses.force_n);
        let covariance: Array1<f64> = presses
            .map(|(position_m, force_n)| {
                force_n / mean_square_n2 * (correlation.between(place_m, position_m) + CONSTANT)
            })
            .collect();
        values.assign(&covariance.dot(&self.weights));
        let explained = self.cholesky.solve_lower(&covariance);
        let before = (1.0 + CONSTANT) / mean_square_n2;
        [(before - explained.dot(&explained)).max(0.0), -explained.dot(&self.explained_offset)]
    }
}

/// Nonlinearities that are tried.
const NONLINEARITIES: [f64; 3] = [0.03, 0.1, 0.3];
/// A smoother kernel is believed from this much more evidence on: it claims to know more between the presses.
const LEAST_SMOOTHER: f64 = 10.0;
/// A nonlinearity is believed from this much more evidence on.
const LEAST_GAIN: f64 = 10.0;

/// The correlation under which the presses are the most probable: the smoother kernel on sufficient evidence, length scales by ever smaller
/// steps, the nonlinearity last.
fn most_probable(evidence: &Evidence, extent: Extent, watch: Watch) -> Result<Correlation, Cancelled> {
    let spans_m = [Some(extent.length_m()), extent.width_m()].into_iter().flatten();
    let start: Vec<f64> = spans_m.map(|span_m| 0.25 * span_m).collect();
    let rough = Correlation { kernel: Kernel::Matern32, lengths_m: start, nonlinearity: 0.0 };
    let (mut best, mut correlation) = climb_lengths(evidence, rough, extent, watch)?;
    let smooth = Correlation { kernel: Kernel::Matern52, ..correlation.clone() };
    let (smooth_best, smooth) = climb_lengths(evidence, smooth, extent, watch)?;
    if smooth_best > best + LEAST_SMOOTHER {
        (best, correlation) = (smooth_best, smooth);
    }
    best += LEAST_GAIN;
    for nonlinearity in NONLINEARITIES {
        watch.round()?;
        let candidate = Correlation { nonlinearity, ..correlation.clone() };
        let total = evidence.total(&candidate);
        if total > best {
            (best, correlation) = (total, candidate);
        }
    }
    Ok(correlation)
}

/// Steps along the logarithm of one length scale at a time while the evidence rises.
fn climb_lengths(
    evidence: &Evidence,
    mut correlation: Correlation,
    extent: Extent,
    watch: Watch,
) -> Result<(f64, Correlation), Cancelled> {
    let (shortest_m, longest_m) = (1e-3 * extent.length_m(), 10.0 * extent.length_m());
    let mut best = evidence.total(&correlation);
    for step in [2.0, std::f64::consts::SQRT_2, 1.2] {
        for k in 0..correlation.lengths_m.len() {
            for factor in [step, 1.0 / step] {
                loop {
                    watch.round()?;
                    let mut candidate = correlation.clone();
                    candidate.lengths_m[k] = (candidate.lengths_m[k] * factor).clamp(shortest_m, longest_m);
                    let total = evidence.total(&candidate);
                    if total <= best {
                        break;
                    }
                    (best, correlation) = (total, candidate);
                }
            }
        }
    }
    Ok((best, correlation))
}
