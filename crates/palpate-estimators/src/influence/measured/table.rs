//! The learnt readings, tabulated over position and nuisance coordinate.

use super::line::Line;
use super::{Axis, Whitening};

/// Whitened mean readings and their relative variance at the nodes of a grid.
///
/// Index of a node: (x·count_y + y)·count_hidden + hidden.
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
        let (first_x, weights_x) = cubic(x, self.x.count);
        let (first_y, weights_y) = cubic(y, self.y.count);
        for (i, wx) in weights_x.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            for (j, wy) in weights_y.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                let line = self.line((first_x + i) * self.y.count + first_y + j);
                let weight = wx * wy;
                let add = |sums: &mut [f64], values: &[f64]| {
                    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
                };
                add(&mut buffer.means, line.means);
                add(&mut buffer.variances, line.variances);
            }
        }
        buffer.variances.iter_mut().for_each(|v| *v = v.max(0.0));
        Line { means: &buffer.means, variances: &buffer.variances }
    }

    /// The places next to one, diagonally too.
    fn neighbours(&self, place: usize) -> impl Iterator<Item = usize> {
        let (x, y) = (place / self.y.count, place % self.y.count);
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let (columns, rows, across) = (around(x, self.x.count), around(y, self.y.count), self.y.count);
        columns
            .flat_map(move |i| rows.clone().map(move |j| i * across + j))
            .filter(move |other| *other != place)
    }

    fn reach(&self, place: usize, unit: &Whitening) -> f64 {
        let here = self.line(place);
        let to_line = |mean: &[f64], other| self.line(other).residual(mean, unit);
        let distances = here
            .means
            .chunks_exact(unit.channels().max(1))
            .flat_map(|mean| self.neighbours(place).map(move |other| to_line(mean, other)));
        0.5 * distances.fold(0.0, f64::max).sqrt()
    }
}

/// Room for an interpolated line.
#[derive(Clone, Debug, Default)]
pub(super) struct LineBuffer {
    means: Vec<f64>,
    variances: Vec<f64>,
}

/// Lagrange's weights of four nodes around `place`, or of fewer where there are no four, and the first of them.
fn cubic(place: f64, count: usize) -> (usize, [f64; 4]) {
    let used = count.min(4);
    let first = ((place.floor() - 1.0).max(0.0) as usize).min(count - used);
    let at = place - first as f64;
    let mut weights = [0.0; 4];
    for (i, weight) in weights[..used].iter_mut().enumerate() {
        let others = (0..used).filter(|j| *j != i);
        *weight = others.map(|j| (at - j as f64) / (i as f64 - j as f64)).product();
    }
    (first, weights)
}
