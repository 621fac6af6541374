//! Learnt readings, tabulated over position and nuisance coordinate, and how well the places of the table explain a reading.
//!
//! Along the nuisance coordinate the mean is taken as straight between two nodes, so the integral over it is that of a normal density
//! along a straight line through the space of readings: a density across it times a share along it.

use crate::influence::grid::{Axis, neighbours, weights_around};
use crate::influence::noise::Whitening;
use palpate_numerics::normal_between;
use std::f64::consts::PI;

/// Whitened mean readings and their relative variance at the nodes of a grid.
///
/// Index of a node: (x·count_y + y)·count_nuisance + nuisance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Along the surface, in metres.
    pub x: Axis,
    /// Across it, in metres; a single node on a one-dimensional surface.
    pub y: Axis,
    /// The nuisance coordinate on its scale; a single node where there is none.
    pub nuisance: Axis,
    /// W·f̄, channel by channel, node by node.
    pub means: Vec<f64>,
    /// v: the process's variance over its signal's, 0 to 1, node by node.
    pub variances: Vec<f64>,
    /// For each place (x, y), half the longest whitened distance from one of its nodes to the line of a neighbouring
    /// place: about how far the line of anywhere in the place's cell can lie from the place's own.
    pub reaches: Vec<f64>,
    /// Into how many parts each cell is cut along each axis when a reading is located within it.
    pub parts: usize,
}

/// A finely cut cell has about this whitened length, so that sums over it are integrals.
const FINE: f64 = 1.2;
/// The finest cut.
const MOST_PARTS: usize = 12;

impl Table {
    /// From means and variances at the nodes.
    pub(super) fn new(
        [x, y, nuisance]: [Axis; 3],
        means: Vec<f64>,
        variances: Vec<f64>,
        channels: usize,
    ) -> Self {
        let mut table = Self { x, y, nuisance, means, variances, reaches: Vec::new(), parts: 1 };
        let unit = Whitening::unit(channels);
        table.reaches = (0..table.places()).map(|place| table.reach(place, &unit)).collect();
        table.parts = ((table.cell_length() / FINE).ceil().min(MOST_PARTS as f64) as usize).max(1);
        table
    }

    /// The whitened length of a typical cell.
    fn cell_length(&self) -> f64 {
        2.0 * self.reaches.iter().sum::<f64>() / self.reaches.len().max(1) as f64
    }

    /// By how much noise of unit deviation is too small for the finest cut; 1 where it is not.
    pub(super) fn too_coarse(&self) -> f64 {
        (self.cell_length() / (FINE * MOST_PARTS as f64)).max(1.0)
    }

    /// The same for noise of `factor` times the deviation.
    pub(super) fn widened(mut self, factor: f64) -> Self {
        self.means.iter_mut().chain(&mut self.reaches).for_each(|value| *value /= factor);
        self
    }

    /// Places (x, y).
    pub fn places(&self) -> usize {
        self.x.count * self.y.count
    }

    /// The middle of every block of 3 places, or of 3×3.
    pub(super) fn blocks(&self) -> impl Iterator<Item = usize> + use<> {
        let across = self.y.count;
        let middles = |count: usize| (0..count).step_by(3).map(move |start| (start + 1).min(count - 1));
        middles(self.x.count).flat_map(move |x| middles(across).map(move |y| x * across + y))
    }

    /// The places of the block around `middle`.
    pub(super) fn block(&self, middle: usize) -> impl Iterator<Item = usize> + use<> {
        let across = self.y.count;
        let range = |at: usize, count: usize| at / 3 * 3..(at / 3 * 3 + 3).min(count);
        let (columns, rows) = (range(middle / across, self.x.count), range(middle % across, across));
        columns.flat_map(move |x| rows.clone().map(move |y| x * across + y))
    }

    /// The nodes of one place.
    pub(super) fn line(&self, place: usize) -> Line<'_> {
        let nodes = self.nuisance.count;
        let width = nodes * self.channels();
        Line {
            means: &self.means[place * width..(place + 1) * width],
            variances: &self.variances[place * nodes..(place + 1) * nodes],
        }
    }

    /// Channels of a reading.
    pub(super) fn channels(&self) -> usize {
        self.means.len() / self.variances.len().max(1)
    }

    /// The line at (x, y) between places, in nodes from the first, by cubic interpolation through four places each way.
    pub(super) fn line_between<'a>(&self, x: f64, y: f64, buffer: &'a mut LineBuffer) -> Line<'a> {
        buffer.means.clear();
        buffer.means.resize(self.nuisance.count * self.channels(), 0.0);
        buffer.variances.clear();
        buffer.variances.resize(self.nuisance.count, 0.0);
        for (place, weight) in weights_around([self.x, self.y], (x, y)) {
            let line = self.line(place);
            let add = |sums: &mut [f64], values: &[f64]| {
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
            };
            add(&mut buffer.means, line.means);
            add(&mut buffer.variances, line.variances);
        }
        buffer.variances.iter_mut().for_each(|v| *v = v.max(0.0));
        Line { means: &buffer.means, variances: &buffer.variances }
    }

    fn reach(&self, place: usize, unit: &Whitening) -> f64 {
        let here = self.line(place);
        let to_line = |mean: &[f64], other| self.line(other).residual(mean, unit);
        let distances = here
            .means
            .chunks_exact(unit.channels().max(1))
            .flat_map(|mean| neighbours([self.x, self.y], place).map(move |other| to_line(mean, other)));
        0.5 * distances.fold(0.0, f64::max).sqrt()
    }
}

/// Room for an interpolated line.
#[derive(Clone, Debug, Default)]
pub(super) struct LineBuffer {
    means: Vec<f64>,
    variances: Vec<f64>,
}

/// Nodes of one place along the nuisance coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Whitened means, node by node.
    pub means: &'a [f64],
    /// v at each node.
    pub variances: &'a [f64],
}

/// Probability of a place: the likelihood integrated over the nuisance coordinate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marginal {
    /// ∫ exp(−(residual − reference)/2), over the nuisance coordinate in nodes.
    pub weight: f64,
    /// The same with the nuisance coordinate, in nodes, as a factor; and with its square.
    pub nuisance: f64,
    pub nuisance_square: f64,
}

/// A stretch between two nodes, as seen from a reading.
///
/// With a = z − μ₀ and d = μ₁ − μ₀, both divided by the standard deviations: |a − s·d|² for s from 0 to 1.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// |a|², a·d, |d|².
    aa: f64,
    ad: f64,
    dd: f64,
}

impl<'a> Line<'a> {
    /// The least squared residual of the whitened reading, over the variance of noise and process.
    pub fn residual(self, reading: &[f64], noise: &Whitening) -> f64 {
        let residuals = self.stretches(reading, noise).map(|stretch| stretch.residual_at(stretch.foot()));
        residuals.fold(f64::INFINITY, f64::min)
    }

    /// The integral over the nuisance coordinate, relative to the likelihood of the residual `reference`.
    pub fn marginal(self, reading: &[f64], noise: &Whitening, reference: f64) -> Marginal {
        let mut sum = Marginal::default();
        for (i, stretch) in self.stretches(reading, noise).enumerate() {
            let Share { weight, middle, spread } = stretch.integral(reference);
            let nuisance = i as f64 + middle;
            sum.weight += weight;
            sum.nuisance += weight * nuisance;
            sum.nuisance_square += weight * (nuisance * nuisance + spread);
        }
        sum
    }

    /// From each node to the next; one of no length where there is a single node.
    fn stretches(self, reading: &'a [f64], noise: &'a Whitening) -> impl Iterator<Item = Stretch> + 'a {
        let (channels, nodes) = (noise.channels(), self.variances.len());
        let node = move |i: usize| &self.means[i * channels..(i + 1) * channels];
        (0..nodes.saturating_sub(1).max(1)).map(move |i| {
            let next = (i + 1).min(nodes - 1);
            let share = 0.5 * (self.variances[i] + self.variances[next]);
            let mut stretch = Stretch { aa: 0.0, ad: 0.0, dd: 0.0 };
            for (((z, from), to), signal) in reading.iter().zip(node(i)).zip(node(next)).zip(&noise.signal) {
                let variance = 1.0 + share * signal;
                let (a, d) = (z - from, to - from);
                stretch.aa += a * a / variance;
                stretch.ad += a * d / variance;
                stretch.dd += d * d / variance;
            }
            if noise.gain > 0.0 { stretch.with_gain(reading, node(i), share, noise) } else { stretch }
        })
    }
}

/// Contribution of a stretch to the integral.
#[derive(Clone, Copy, Debug)]
struct Share {
    weight: f64,
    /// Mean and variance of s there.
    middle: f64,
    spread: f64,
}

/// Beyond this many halved squares below the reference a stretch has no weight.
const NEGLIGIBLE: f64 = 60.0;
/// A stretch shorter than this has the same likelihood all along.
const SHORT: f64 = 1e-4;

impl Stretch {
    /// With a gain that scatters by γ about 1: the covariance grows by γ²·μ·μᵀ, so with V the variances,
    /// |a|² becomes |a|² − γ²·(μᵀ·V⁻¹·a)²/(1 + γ²·μᵀ·V⁻¹·μ) (Sherman and Morrison). For a stretch of no length only.
    fn with_gain(mut self, reading: &[f64], mean: &[f64], share: f64, noise: &Whitening) -> Self {
        let (mut mm, mut ma) = (0.0, 0.0);
        for ((z, mean), signal) in reading.iter().zip(mean).zip(&noise.signal) {
            let scaled = mean / (1.0 + share * signal);
            mm += mean * scaled;
            ma += (z - mean) * scaled;
        }
        let gain2 = noise.gain * noise.gain;
        let growth = 1.0 + gain2 * mm;
        self.aa = (self.aa - gain2 * ma * ma / growth).max(0.0);
        self
    }

    /// The s of the least residual.
    fn foot(self) -> f64 {
        if self.dd > 0.0 { (self.ad / self.dd).clamp(0.0, 1.0) } else { 0.0 }
    }

    fn residual_at(self, s: f64) -> f64 {
        (self.aa - 2.0 * s * self.ad + s * s * self.dd).max(0.0)
    }

    /// ∫₀¹ exp(−(residual(s) − reference)/2) ds.
    fn integral(self, reference: f64) -> Share {
        let foot = self.foot();
        let least = self.residual_at(foot);
        if least - reference > NEGLIGIBLE {
            return Share { weight: 0.0, middle: foot, spread: 0.0 };
        }
        let scale = |residual: f64| (-0.5 * (residual - reference)).exp();
        let length = self.dd.sqrt();
        if length < SHORT {
            return Share { weight: scale(least), middle: 0.5, spread: 1.0 / 12.0 };
        }
        // Across: the residual that no s takes away. Along: a normal density of mean s₀ and deviation 1/length.
        let middle = self.ad / self.dd;
        let across = (self.aa - self.ad * middle).max(0.0);
        let (from, to) = (-middle * length, (1.0 - middle) * length);
        let part = normal_between(from, to);
        Share {
            weight: (2.0 * PI).sqrt() / length * part.share * scale(across),
            middle: (middle + part.mean / length).clamp(0.0, 1.0),
            spread: part.variance / (length * length),
        }
    }
}
