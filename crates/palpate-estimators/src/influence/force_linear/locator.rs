//! The locator of a force-linear surface: the posterior of a reading over a grid of places, the force integrated in closed form.
//!
//! With d the reading less the offsets, at a place with influences f, channel c errs by S_c(F) = σ² + v + 2F·b + F²·u: noise,
//! variance v of the offset, u of the influence, and their covariance b. For a force F that is as likely as any other between 0 and
//! the hardest looked for,
//!
//! p(a | d) ∝ ∫ Π S_c^(−½)·exp(−(d_c − F·f_c)²/(2·S_c)) dF,
//!
//! S taken at the force of the least misfit. The determinant belongs there: between presses, where u is large, everything would
//! explain a reading otherwise.

use super::super::grid::{Axis, CUT, GridPosterior, PartOfCell, ToldForce, cubic, middle, parts_of};
use super::learning::LearntChannel;
use crate::fit::{Locate, LocatorFault};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::{LINE_PLACES, contact_cost, learnt_misfit_bound, misfit_bound};
use palpate_core::{Estimate, Status};
use palpate_numerics::normal_between;
use palpate_numerics::regression::Kernel;
use serde::{Deserialize, Serialize};

/// One channel over the grid, in its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Channel {
    /// Influence at each place, per newton; place (x, y) is number x·count_y + y.
    values: Vec<f64>,
    /// Variance of each value.
    variances: Vec<f64>,
    /// Covariance of each value with the offset.
    covariances: Vec<f64>,
    offset: f64,
    offset_variance: f64,
    /// Standard deviation of the noise; 0 for a channel that never changes, which is left out.
    noise_sd: f64,
}

impl Channel {
    /// A channel that says nothing.
    pub fn silent(places: usize) -> Self {
        let nothing = vec![0.0; places];
        let (values, variances, covariances) = (nothing.clone(), nothing.clone(), nothing);
        Self { values, variances, covariances, offset: 0.0, offset_variance: 0.0, noise_sd: 0.0 }
    }
}

impl From<LearntChannel> for Channel {
    fn from(learnt: LearntChannel) -> Self {
        let LearntChannel { values, variances, covariances, offset, offset_variance, noise_sd } = learnt;
        Self { values, variances, covariances, offset, offset_variance, noise_sd }
    }
}

/// The part of a locator that its file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stored {
    pub x: Axis,
    pub y: Axis,
    pub channels: Vec<Channel>,
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
}

/// Offsets and influence functions of a surface without a model, ready to be inverted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct ForceLinearLocator {
    stored: Stored,
    /// Of the channels in use, from 0.
    live: Vec<usize>,
    /// Influences, their variances and their covariances with the offset, all over the noise, place by place and channel by channel.
    places: Vec<[f64; 3]>,
    /// Variance of each offset over that of the noise.
    offset_variances: Vec<f64>,
    /// For each place half the longest way to a neighbour's line, per newton and over the noise.
    reaches: Vec<f64>,
    /// Into how many parts each cell is cut along each axis when a reading is located within it.
    parts: usize,
}

/// A finely cut cell has about this whitened length, so that sums over it are integrals.
const FINE: f64 = 1.0;
/// The finest cut along a line, and along each axis of a plane.
const MOST_PARTS: usize = 24;
const MOST_PARTS_OF_PLANE: usize = 8;

impl Stored {
    pub fn into_locator(self) -> ForceLinearLocator {
        let live: Vec<usize> =
            (0..self.channels.len()).filter(|c| self.channels[*c].noise_sd > 0.0).collect();
        let over_noise = |c: usize, value: f64, power: i32| value / self.channels[c].noise_sd.powi(power);
        let places = (0..self.x.count * self.y.count).flat_map(|place| {
            live.iter().map(move |c| (place, *c)).map(|(place, c)| {
                let Channel { values, variances, covariances, .. } = &self.channels[c];
                [
                    over_noise(c, values[place], 1),
                    over_noise(c, variances[place], 2),
                    over_noise(c, covariances[place], 2),
                ]
            })
        });
        let mut locator = ForceLinearLocator {
            places: places.collect(),
            offset_variances: live
                .iter()
                .map(|c| over_noise(*c, self.channels[*c].offset_variance, 2))
                .collect(),
            live,
            stored: self,
            reaches: Vec::new(),
            parts: 1,
        };
        locator.cut_cells();
        locator
    }

    /// Checks what a file may have got wrong.
    fn check(&self) -> Result<(), LocatorFault> {
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        let axes = [self.x, self.y];
        numbers("axis count", &axes.map(|axis| axis.count as f64), |count| count >= 1.0, "at least 1")?;
        numbers("axis start", &axes.map(|axis| axis.start), |_| true, "finite")?;
        numbers("axis step", &axes.map(|axis| axis.step), |step| step > 0.0, "finite and greater than 0")?;
        let places = self.x.count.saturating_mul(self.y.count);
        for channel in &self.channels {
            LocatorFault::check_count("influence values", places, channel.values.len())?;
            LocatorFault::check_count("influence variances", places, channel.variances.len())?;
            LocatorFault::check_count("influence covariances", places, channel.covariances.len())?;
            numbers("influence value", &channel.values, |_| true, "a finite number")?;
            numbers("influence variance", &channel.variances, |v| v >= 0.0, "at least 0")?;
            numbers("influence covariance", &channel.covariances, |_| true, "a finite number")?;
            numbers("offset", &[channel.offset], |_| true, "a finite number")?;
            let spreads = [channel.offset_variance, channel.noise_sd];
            numbers("offset variance or noise", &spreads, |v| v >= 0.0, "at least 0")?;
        }
        let force = [self.hardest_n, self.known_force_n.unwrap_or(1.0)];
        numbers("force", &force, |force| force > 0.0, "greater than 0")?;
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
    /// The kernel of the influence functions, and their length scale along each coordinate in metres.
    pub fn correlation(&self) -> (Kernel, &[f64]) {
        (self.stored.kernel, &self.stored.lengths_m)
    }

    /// Number of presses that were learnt from.
    pub fn presses(&self) -> usize {
        self.stored.presses
    }

    /// Noise of each channel, in its unit; 0 for one that never changes.
    pub fn noise_sd(&self) -> impl Iterator<Item = f64> {
        self.stored.channels.iter().map(|channel| channel.noise_sd)
    }

    fn axes(&self) -> [Axis; 2] {
        [self.stored.x, self.stored.y]
    }

    fn unknowns(&self) -> usize {
        let positions = if self.stored.y.count > 1 { 2 } else { 1 };
        positions + usize::from(self.stored.known_force_n.is_none())
    }

    fn place(&self, place: usize) -> &[[f64; 3]] {
        &self.places[place * self.live.len()..(place + 1) * self.live.len()]
    }

    /// Finds the reaches of the places, and how finely cells must be cut.
    fn cut_cells(&mut self) {
        let [x, y] = self.axes();
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let reach = |place: usize| {
            let neighbours = around(place / y.count, x.count)
                .flat_map(|i| around(place % y.count, y.count).map(move |j| i * y.count + j));
            let ways = neighbours.map(|other| self.way_between(place, other));
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
        let pairs = || self.place(place).iter().zip(self.place(other)).map(|([f, ..], [g, ..])| (f, g));
        let (fg, gg): (f64, f64) = pairs().fold((0.0, 0.0), |(fg, gg), (f, g)| (fg + f * g, gg + g * g));
        let scale = if self.stored.known_force_n.is_none() && gg > 0.0 { fg / gg } else { 1.0 };
        pairs().map(|(f, g)| (f - scale * g).powi(2)).sum::<f64>().sqrt()
    }

    /// Sets the bound of the residual from the recording's own readings.
    pub(super) fn limit_residuals(&mut self, recording: &Recording) {
        let freedom = self.live.len().saturating_sub(self.unknowns());
        let readings = recording.rows.iter().map(|row| row.reading.as_slice());
        self.stored.residual_limit =
            learnt_misfit_bound(freedom, readings, |reading| self.least_misfit(&self.whitened(reading)));
    }

    fn least_misfit(&self, whitened: &[f64]) -> f64 {
        self.posterior(whitened).residual
    }

    /// The reading less the offsets, over the noise, of the channels in use.
    fn whitened(&self, reading: &[f64]) -> Vec<f64> {
        let channel = |c: &usize| {
            let Channel { offset, noise_sd, .. } = self.stored.channels[*c];
            (reading[*c] - offset) / noise_sd
        };
        self.live.iter().map(channel).collect()
    }

    /// How a place explains a whitened reading.
    fn explain(&self, whitened: &[f64], place: &[[f64; 3]]) -> Explained {
        /// Steps from the weights of one force to those of the next; two leave less than a thousandth.
        const STEPS: usize = 3;
        let variance = |force_n: f64, [_, u, b]: &[f64; 3], v: f64| {
            (1.0 + v + force_n * (2.0 * b + force_n * u)).max(1.0)
        };
        let channels = || whitened.iter().zip(place).zip(&self.offset_variances);
        // Least squares of the force by the weights of the last one: Σ f·d/S and Σ f²/S.
        let sums = |force_n: f64| {
            channels().fold((0.0, 0.0), |(fd, ff), ((d, place), v)| {
                let scaled = place[0] / variance(force_n, place, *v);
                (fd + scaled * d, ff + scaled * place[0])
            })
        };
        let hardest_n = self.stored.hardest_n;
        let held = |(fd, ff): (f64, f64)| if ff > 0.0 { (fd / ff).clamp(0.0, hardest_n) } else { 0.0 };
        let known = self.stored.known_force_n;
        let force_n = known.unwrap_or_else(|| (0..STEPS).fold(0.0, |force_n, _| held(sums(force_n))));
        let (mut misfit, mut log_determinant) = (0.0, 0.0);
        for ((d, place), v) in channels() {
            let variance = variance(force_n, place, *v);
            misfit += (d - force_n * place[0]).powi(2) / variance;
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
    fn between<'b>(&self, x: f64, y: f64, buffer: &'b mut Vec<[f64; 3]>) -> &'b [[f64; 3]] {
        let [x_axis, y_axis] = self.axes();
        buffer.clear();
        buffer.resize(self.live.len(), [0.0; 3]);
        let (first_x, weights_x) = cubic(x, x_axis.count);
        let (first_y, weights_y) = cubic(y, y_axis.count);
        for (i, wx) in weights_x.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            for (j, wy) in weights_y.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                let place = self.place((first_x + i) * y_axis.count + first_y + j);
                for (sum, value) in buffer.iter_mut().zip(place) {
                    sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += wx * wy * value);
                }
            }
        }
        buffer
    }
}

impl Locate for ForceLinearLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let whitened = self.whitened(reading);
        let posterior = self.posterior(&whitened);
        let square: f64 = whitened.iter().zip(&self.offset_variances).map(|(d, v)| d * d / (1.0 + v)).sum();
        let places = if self.stored.y.count > 1 { LINE_PLACES * LINE_PLACES } else { LINE_PLACES };
        let cost = contact_cost(self.unknowns(), self.live.len().max(1), places);
        if square <= misfit_bound(self.live.len()) && square <= posterior.residual + cost {
            return Estimate::of_position(middle(self.axes()), Status::NoContact);
        }
        posterior.estimate(self.stored.residual_limit)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("channels", setup.layout.len(), self.stored.channels.len())
    }
}
