//! The locator of a force-linear surface: the posterior of a reading over a grid of places, the force integrated in closed form.
//!
//! With d the reading less the offsets and f the influences at a place, both in channels of unit noise in which what the presses leave
//! open is independent, channel k errs by S_k(F) = 1 + λ_k·(ω + 2F·β + F²·v): noise, and the variance ω of the offset, v of
//! the influence and their covariance β, in units of the signal's λ_k. For a force F that is as likely as any other between 0 and the
//! hardest looked for,
//!
//! p(a | d) ∝ ∫ Π S_k^(−½)·exp(−(d_k − F·f_k)²/(2·S_k)) dF,
//!
//! S taken at the force of the least misfit. The determinant belongs there: between presses, where v is large, everything would
//! explain a reading otherwise.

use super::learning::{Functions, OpenVariance};
use crate::fit::{Locate, LocatorFault};
use crate::influence::grid::{
    Axis, CUT, GridPosterior, PartOfCell, ToldForce, check_axes, neighbours, parts_of, weights_around,
};
use crate::influence::noise::Whitening;
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::{Directions, FalseAlarmRate, NoiseBounds, learnt_misfit_bound, unknowns};
use palpate_core::{Estimate, Status};
use palpate_numerics::normal_between;
use palpate_numerics::regression::Kernel;
use serde::{Deserialize, Serialize};

/// Learnt functions of the channels in use, over the grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tables {
    /// Offset of each channel, in its unit.
    offsets: Vec<f64>,
    /// Standard deviation of the noise of each, in its unit.
    noise_sd: Vec<f64>,
    /// Channels of unit noise; its signal is λ.
    whitening: Whitening,
    /// f of the whitened channels at each place, per newton; place (x, y) is number x·count_y + y.
    values: Vec<f64>,
    /// v at each place.
    variances: Vec<f64>,
    /// β at each place.
    covariances: Vec<f64>,
    /// ω.
    offset_variance: f64,
}

impl From<Functions> for Tables {
    fn from(functions: Functions) -> Self {
        let Functions { offsets, noise_sd, whitening, values, open } = functions;
        let mut white = vec![0.0; values.len()];
        for (value, white) in values.outer_iter().zip(white.chunks_exact_mut(offsets.len().max(1))) {
            whitening.apply(&value.to_vec(), white);
        }
        let OpenVariance { offset: offset_variance, influences: variances, covariances } = open;
        Self { offsets, noise_sd, whitening, values: white, variances, covariances, offset_variance }
    }
}

/// The part of a locator that its file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stored {
    pub x: Axis,
    pub y: Axis,
    /// Channels of a reading, and those of them that are in use, from 0.
    pub channels: usize,
    pub live: Vec<usize>,
    pub functions: Tables,
    /// The contact's force in newtons, where it is known.
    pub known_force_n: Option<f64>,
    /// The hardest contact that is looked for, in newtons.
    pub hardest_n: f64,
    /// The squared residual, in variances, from which on no contact explains a reading.
    pub residual_limit: f64,
    pub kernel: Kernel,
    /// Length scale of the influence functions along each coordinate, in metres.
    pub lengths_m: Vec<f64>,
    /// How far the presses were found from linear: the relative change of an influence with the force.
    pub nonlinearity: f64,
    /// Number of presses that were learnt from.
    pub presses: usize,
    /// Degrees of freedom that tell each channel's noise.
    pub noise_freedom: f64,
    /// Share of untouched readings that may be taken for a contact.
    #[serde(default)]
    pub false_alarm_rate: FalseAlarmRate,
}

/// Offsets and influence functions of a surface without a model, ready to be inverted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct ForceLinearLocator {
    stored: Stored,
    /// For each place half the longest way to a neighbour's line, per newton and over the noise.
    reaches: Vec<f64>,
    /// Into how many parts each cell is cut along each axis when a reading is located within it.
    parts: usize,
    /// The largest square of a whitened reading of noise alone.
    noise_bound: f64,
    /// The most that a contact takes off the square of noise alone.
    detection_bound: f64,
}

/// A finely cut cell has about this whitened length, so that sums over it are integrals.
const FINE: f64 = 1.0;
/// The finest cut along a line, and along each axis of a plane.
const MOST_PARTS: usize = 24;
const MOST_PARTS_OF_PLANE: usize = 8;

impl Stored {
    pub fn into_locator(self) -> ForceLinearLocator {
        let mut locator = ForceLinearLocator {
            stored: self,
            reaches: Vec::new(),
            parts: 1,
            noise_bound: 0.0,
            detection_bound: 0.0,
        };
        locator.cut_cells();
        locator.bound_noise();
        locator
    }

    /// Checks what a file may have got wrong.
    fn check(&self) -> Result<(), LocatorFault> {
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        check_axes(&[self.x, self.y])?;
        let places = self.x.count.saturating_mul(self.y.count);
        let Tables { offsets, noise_sd, whitening, values, variances, covariances, offset_variance } =
            &self.functions;
        let live = self.live.len();
        let is_channel = |c: &&usize| **c >= self.channels;
        if let Some(c) = self.live.iter().find(is_channel) {
            return Err(LocatorFault::Count { what: "channels", needed: *c + 1, found: self.channels });
        }
        LocatorFault::check_count("offsets", live, offsets.len())?;
        LocatorFault::check_count("noises", live, noise_sd.len())?;
        LocatorFault::check_count("whitened channels", live, whitening.channels())?;
        LocatorFault::check_count("whitening weights", live * live, whitening.matrix.len())?;
        LocatorFault::check_count("influence values", places.saturating_mul(live), values.len())?;
        LocatorFault::check_count("influence variances", places, variances.len())?;
        LocatorFault::check_count("influence covariances", places, covariances.len())?;
        numbers("offset", offsets, |_| true, "a finite number")?;
        numbers("whitening weight", &whitening.matrix, |_| true, "finite")?;
        numbers("influence value", values, |_| true, "a finite number")?;
        numbers("influence covariance", covariances, |_| true, "a finite number")?;
        for (what, list) in
            [("noise", noise_sd), ("signal variance", &whitening.signal), ("influence variance", variances)]
        {
            numbers(what, list, |v| v >= 0.0, "finite and at least 0")?;
        }
        numbers("offset variance", &[*offset_variance], |v| v >= 0.0, "at least 0")?;
        let force = [self.hardest_n, self.known_force_n.unwrap_or(1.0)];
        numbers("force", &force, |force| force > 0.0, "greater than 0")?;
        numbers(
            "degrees of freedom of the noise",
            &[self.noise_freedom],
            |freedom| freedom > 0.0,
            "greater than 0",
        )?;
        numbers("residual limit", &[self.residual_limit], |limit| limit > 0.0, "greater than 0")
    }
}

impl TryFrom<Stored> for ForceLinearLocator {
    type Error = LocatorFault;

    fn try_from(stored: Stored) -> Result<Self, LocatorFault> {
        stored.check()?;
        Ok(stored.into_locator())
    }
}

impl From<ForceLinearLocator> for Stored {
    fn from(locator: ForceLinearLocator) -> Self {
        locator.stored
    }
}

/// What the table says of a place.
#[derive(Clone, Copy, Debug)]
struct Place<'a> {
    /// f of the whitened channels.
    values: &'a [f64],
    /// v and β.
    variance: f64,
    covariance: f64,
}

/// A place as a reading sees it.
#[derive(Clone, Copy, Debug)]
struct Explained {
    /// χ² at the force of the least misfit.
    misfit: f64,
    /// −2·ln of the posterior density, less a constant.
    cost: f64,
    force_n: f64,
    force_variance_n2: f64,
}

impl ForceLinearLocator {
    /// The same, whose noise is taken for a contact at another rate.
    pub(crate) fn with_false_alarm_rate(mut self, rate: FalseAlarmRate) -> Self {
        self.stored.false_alarm_rate = rate;
        self.bound_noise();
        self
    }

    /// The kernel of the influence functions, and their length scale along each coordinate in metres.
    pub fn correlation(&self) -> (Kernel, &[f64]) {
        (self.stored.kernel, &self.stored.lengths_m)
    }

    /// How far the presses were found from linear: the relative change of an influence with the force; 0 where they agree.
    pub fn nonlinearity(&self) -> f64 {
        self.stored.nonlinearity
    }

    /// Share of untouched readings that may be taken for a contact.
    pub fn false_alarm_rate(&self) -> FalseAlarmRate {
        self.stored.false_alarm_rate
    }

    /// Number of presses that were learnt from.
    pub fn presses(&self) -> usize {
        self.stored.presses
    }

    /// Number of each channel in use, from 0, with its offset and noise, in its unit.
    pub fn channels(&self) -> impl Iterator<Item = (usize, f64, f64)> {
        let Tables { offsets, noise_sd, .. } = &self.stored.functions;
        self.stored.live.iter().zip(offsets).zip(noise_sd).map(|((c, offset), noise)| (*c, *offset, *noise))
    }

    fn axes(&self) -> [Axis; 2] {
        [self.stored.x, self.stored.y]
    }

    fn unknowns(&self) -> usize {
        unknowns(if self.stored.y.count > 1 { 2 } else { 1 }, self.stored.known_force_n)
    }

    fn place(&self, place: usize) -> Place<'_> {
        let Tables { values, variances, covariances, .. } = &self.stored.functions;
        let live = self.stored.live.len();
        Place {
            values: &values[place * live..(place + 1) * live],
            variance: variances[place],
            covariance: covariances[place],
        }
    }

    /// Finds the reaches of the places, and how finely cells must be cut.
    fn cut_cells(&mut self) {
        let [x, y] = self.axes();
        let reach = |place: usize| {
            let ways = neighbours([x, y], place).map(|other| self.way_between(place, other));
            0.5 * ways.fold(0.0, f64::max)
        };
        self.reaches = (0..x.count * y.count).map(reach).collect();
        let typical = 2.0 * self.reaches.iter().sum::<f64>() / self.reaches.len().max(1) as f64;
        let force_n = self.stored.known_force_n.unwrap_or(0.5 * self.stored.hardest_n);
        let most = if y.count > 1 { MOST_PARTS_OF_PLANE } else { MOST_PARTS };
        self.parts = ((typical * force_n / FINE).ceil().min(most as f64) as usize).max(1);
    }

    /// How far, per newton and over the noise, the influences of one place are from those of another; from any multiple of them
    /// where the force is not known.
    fn way_between(&self, place: usize, other: usize) -> f64 {
        let pairs = || self.place(place).values.iter().zip(self.place(other).values);
        let (fg, gg): (f64, f64) = pairs().fold((0.0, 0.0), |(fg, gg), (f, g)| (fg + f * g, gg + g * g));
        let scale = if self.stored.known_force_n.is_none() && gg > 0.0 { fg / gg } else { 1.0 };
        pairs().map(|(f, g)| (f - scale * g).powi(2)).sum::<f64>().sqrt()
    }

    /// Whether noise alone explains a whitened reading: neither its length nor what the best contact takes off its square is more than
    /// noise reaches at the false-alarm rate.
    fn is_no_contact(&self, whitened: &[f64]) -> bool {
        let Tables { whitening, offset_variance, .. } = &self.stored.functions;
        let variance = |signal: &f64| 1.0 + offset_variance * signal;
        let square: f64 =
            whitened.iter().zip(&whitening.signal).map(|(d, signal)| d * d / variance(signal)).sum();
        if square > self.noise_bound {
            return false;
        }
        let taken = |place: usize| {
            let channels = whitened.iter().zip(self.place(place).values).zip(&whitening.signal);
            let (fd, ff) = channels.fold((0.0, 0.0), |(fd, ff), ((d, f), signal)| {
                let scaled = f / variance(signal);
                (fd + scaled * d, ff + scaled * f)
            });
            if fd > 0.0 { fd * fd / ff } else { 0.0 }
        };
        (0..self.reaches.len()).all(|place| taken(place) <= self.detection_bound)
    }

    /// Bounds of noise: of a reading's square, and of what the best contact takes off it.
    fn bound_noise(&mut self) {
        let freedom = self.stored.noise_freedom;
        // Noise that was learnt from few readings is larger than it seems: a χ² over an estimated variance is an F, whose tail is about
        // that of χ² at ν·(e^(b/ν) − 1) (Wallace, Ann. Math. Statist. 30, 1959, for t²).
        let learnt = |bound: f64, freedom: f64| freedom * ((bound / freedom).exp() - 1.0);
        let live = self.stored.live.len();
        let bounds = NoiseBounds::new(live, self.directions(), self.stored.false_alarm_rate);
        self.noise_bound = learnt(bounds.square, freedom * live as f64);
        self.detection_bound = learnt(bounds.taken, freedom);
    }

    /// Extent of the directions that readings of contacts have.
    fn directions(&self) -> Directions {
        let [x, y] = self.axes();
        let direction = |i: usize, j: usize| {
            let values = self.place(i * y.count + j).values;
            let length = values.iter().map(|f| f * f).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            values.iter().map(|f| f / length).collect::<Vec<f64>>()
        };
        let step = |from: &[f64], to: &[f64]| from.iter().zip(to).map(|(a, b)| b - a).collect::<Vec<f64>>();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let way = |a: (usize, usize), b: (usize, usize)| {
            let step = step(&direction(a.0, a.1), &direction(b.0, b.1));
            product(&step, &step).sqrt()
        };
        let along = |j: usize| (1..x.count).map(move |i| way((i - 1, j), (i, j))).sum::<f64>();
        let across = |i: usize| (1..y.count).map(move |j| way((i, j - 1), (i, j))).sum::<f64>();
        if y.count == 1 {
            return Directions { length: along(0), area: 0.0 };
        }
        let boundary = along(0) + along(y.count - 1) + across(0) + across(x.count - 1);
        let mut area = 0.0;
        for (i, j) in (1..x.count).flat_map(|i| (1..y.count).map(move |j| (i, j))) {
            let here = direction(i, j);
            let (a, b) = (step(&direction(i - 1, j), &here), step(&direction(i, j - 1), &here));
            area += (product(&a, &a) * product(&b, &b) - product(&a, &b).powi(2)).max(0.0).sqrt();
        }
        Directions { length: 0.5 * boundary, area }
    }

    /// Sets the bound of the residual from the recording's own readings.
    pub(super) fn limit_residuals(&mut self, recording: &Recording) {
        let freedom = self.stored.live.len().saturating_sub(self.unknowns());
        let readings = recording.rows.iter().map(|row| row.reading.as_slice());
        self.stored.residual_limit = learnt_misfit_bound(freedom, readings, |reading| {
            self.posterior(&self.whitened(reading)).residual
        });
    }

    /// The reading less the offsets, in channels of unit noise.
    fn whitened(&self, reading: &[f64]) -> Vec<f64> {
        let Tables { offsets, whitening, .. } = &self.stored.functions;
        let less: Vec<f64> =
            self.stored.live.iter().zip(offsets).map(|(c, offset)| reading[*c] - offset).collect();
        let mut whitened = vec![0.0; less.len()];
        whitening.apply(&less, &mut whitened);
        whitened
    }

    /// How a place explains a whitened reading.
    fn explain(&self, whitened: &[f64], place: Place) -> Explained {
        /// Steps from the weights of one force to those of the next; two leave less than a thousandth.
        const STEPS: usize = 3;
        let Tables { whitening, offset_variance, .. } = &self.stored.functions;
        let open = |force_n: f64| {
            (offset_variance + force_n * (2.0 * place.covariance + force_n * place.variance)).max(0.0)
        };
        let channels = || whitened.iter().zip(place.values).zip(&whitening.signal);
        // Least squares of the force by the weights of the last one: Σ f·d/S and Σ f²/S.
        let sums = |force_n: f64| {
            let open = open(force_n);
            channels().fold((0.0, 0.0), |(fd, ff), ((d, f), signal)| {
                let scaled = f / (1.0 + open * signal);
                (fd + scaled * d, ff + scaled * f)
            })
        };
        let hardest_n = self.stored.hardest_n;
        let held = |(fd, ff): (f64, f64)| if ff > 0.0 { (fd / ff).clamp(0.0, hardest_n) } else { 0.0 };
        let known = self.stored.known_force_n;
        let force_n = known.unwrap_or_else(|| (0..STEPS).fold(0.0, |force_n, _| held(sums(force_n))));
        let (mut misfit, mut log_determinant) = (0.0, 0.0);
        let open = open(force_n);
        for ((d, f), signal) in channels() {
            let variance = 1.0 + open * signal;
            misfit += (d - force_n * f).powi(2) / variance;
            log_determinant += variance.ln();
        }
        let cost = misfit + log_determinant;
        if known.is_some() {
            return Explained { misfit, cost, force_n, force_variance_n2: 0.0 };
        }
        // The force's own density: normal about that of the least squares, cut off at 0 and at the hardest.
        let (fd, ff) = sums(force_n);
        if ff <= 0.0 {
            return Explained { misfit, cost: f64::INFINITY, force_n, force_variance_n2: 0.0 };
        }
        let (free_n, sd_n) = (fd / ff, ff.sqrt().recip());
        let part = normal_between((0.0 - free_n) / sd_n, (hardest_n - free_n) / sd_n);
        // The misfit was taken at the force within the bounds; the integral is relative to the free one.
        let free_misfit = misfit - (force_n - free_n).powi(2) * ff;
        let cost = free_misfit + log_determinant - 2.0 * (part.share * sd_n).ln();
        Explained {
            misfit,
            cost,
            force_n: free_n + sd_n * part.mean,
            force_variance_n2: part.variance * sd_n * sd_n,
        }
    }

    /// The posterior of a whitened reading.
    fn posterior(&self, whitened: &[f64]) -> GridPosterior {
        let axes = self.axes();
        let told = self.stored.known_force_n.map_or(ToldForce::Estimated, ToldForce::Known);
        let mut posterior = GridPosterior::new(axes, self.parts, told);
        let places = axes[0].count * axes[1].count;
        let explained: Vec<Explained> =
            (0..places).map(|place| self.explain(whitened, self.place(place))).collect();
        let best = (0..places).min_by(|a, b| explained[*a].cost.total_cmp(&explained[*b].cost));
        let Some(best) = best else { return posterior };
        let mut buffer = Vec::new();
        let mut least = explained[best].cost;
        for (x, y) in parts_of(axes, self.parts, best) {
            least = least.min(self.explain(whitened, self.between(x, y, &mut buffer)).cost);
        }
        for (place, found) in explained.iter().enumerate() {
            let closest = (found.misfit.sqrt() - self.reaches[place] * found.force_n).max(0.0);
            if closest * closest + (found.cost - found.misfit) <= least + CUT {
                posterior.add_cell(place, |x, y| {
                    let part = self.explain(whitened, self.between(x, y, &mut buffer));
                    PartOfCell {
                        weight: (-0.5 * (part.cost - least)).exp(),
                        force_n: part.force_n,
                        force_variance_n2: part.force_variance_n2,
                        residual: part.misfit,
                    }
                });
            }
        }
        posterior
    }

    /// The influences at (x, y), in nodes, by cubic interpolation through four places each way.
    fn between<'b>(&self, x: f64, y: f64, buffer: &'b mut Vec<f64>) -> Place<'b> {
        buffer.clear();
        buffer.resize(self.stored.live.len(), 0.0);
        let (mut variance, mut covariance) = (0.0, 0.0);
        for (place, weight) in weights_around(self.axes(), (x, y)) {
            let place = self.place(place);
            buffer.iter_mut().zip(place.values).for_each(|(sum, value)| *sum += weight * value);
            variance += weight * place.variance;
            covariance += weight * place.covariance;
        }
        Place { values: buffer, variance: variance.max(0.0), covariance }
    }
}

impl Locate for ForceLinearLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let whitened = self.whitened(reading);
        let estimate = self.posterior(&whitened).estimate(self.stored.residual_limit);
        if self.is_no_contact(&whitened) {
            // The most probable place of a contact that would be too light to be told from noise.
            return Estimate::of_contact(estimate.contact, Status::NoContact);
        }
        estimate
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("channels", setup.layout().len(), self.stored.channels)
    }
}
