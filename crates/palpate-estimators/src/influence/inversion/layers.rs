//! Tables of per-channel values at the nodes of a grid, with cubic interpolation.

use crate::influence::grid::Axis;
use crate::influence::lanes::{LANES, Lanes};
use palpate_numerics::simd::{Arithmetic, InstructionSet, Kernel, Simd, Vector};
use std::ops::Range;

/// Layers of values over a grid, by node, layer and group of eight channels; zeros pad the last group.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::influence) struct Layers {
    counts: [usize; 2],
    layers: usize,
    groups: usize,
    values: Vec<Lanes>,
}

/// Value and derivatives per node along and across, of eight channels.
pub(in crate::influence) type Slopes = [Lanes; 3];

impl Layers {
    pub fn new(
        axes: [Axis; 2],
        layers: usize,
        channels: usize,
        at: impl Fn(usize, usize, usize) -> f64,
    ) -> Self {
        let counts = axes.map(|axis| axis.count);
        let groups = channels.div_ceil(LANES);
        let places = counts[0] * counts[1];
        let mut values = vec![[0.0; LANES]; places * layers * groups];
        for (i, lanes) in values.iter_mut().enumerate() {
            let (place, layer, group) = (i / groups / layers, i / groups % layers, i % groups);
            let of_group = (LANES * group)..(LANES * (group + 1)).min(channels);
            lanes.iter_mut().zip(of_group).for_each(|(lane, channel)| *lane = at(place, layer, channel));
        }
        Self { counts, layers, groups, values }
    }

    pub fn groups(&self) -> usize {
        self.groups
    }

    pub fn groups_of(&self, place: usize, layers: Range<usize>) -> &[Lanes] {
        let first = place * self.layers;
        &self.values[(first + layers.start) * self.groups..(first + layers.end) * self.groups]
    }

    /// Interpolates layers at (x, y), in nodes, through four nodes per axis.
    pub fn interpolate(&self, at: [f64; 2], layers: Range<usize>, out: &mut Vec<Lanes>) {
        out.clear();
        out.resize(layers.len() * self.groups, [0.0; LANES]);
        self.interpolate_by(at, layers, out.as_chunks_mut().0, |[x, y], i, j| [x.weights[i] * y.weights[j]]);
    }

    pub fn interpolate_slopes(&self, at: [f64; 2], layers: Range<usize>, out: &mut Vec<Slopes>) {
        out.clear();
        out.resize(layers.len() * self.groups, [[0.0; LANES]; 3]);
        self.interpolate_by(at, layers, out, |[x, y], i, j| {
            [x.weights[i] * y.weights[j], x.slopes[i] * y.weights[j], x.weights[i] * y.slopes[j]]
        });
    }

    fn interpolate_by<const K: usize>(
        &self,
        [x, y]: [f64; 2],
        layers: Range<usize>,
        out: &mut [[Lanes; K]],
        weights: impl Fn(&[Stencil; 2], usize, usize) -> [f64; K],
    ) {
        let stencils = [Stencil::new(x, self.counts[0]), Stencil::new(y, self.counts[1])];
        InstructionSet::best().run(Interpolate { table: self, stencils, layers, weights, out });
    }
}

/// Lagrange weights of up to four nodes, and their derivatives per node.
#[derive(Clone, Copy, Debug)]
pub(in crate::influence) struct Stencil {
    pub first: usize,
    pub used: usize,
    pub weights: [f64; 4],
    pub slopes: [f64; 4],
}

impl Stencil {
    #[inline]
    pub fn new(place: f64, count: usize) -> Self {
        let used = count.min(4);
        let first = ((place - 1.0).max(0.0) as usize).min(count - used);
        let t = place - first as f64;
        let (weights, slopes) = match used {
            1 => ([1.0, 0.0, 0.0, 0.0], [0.0; 4]),
            2 => ([1.0 - t, t, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0]),
            3 => {
                let weights = [0.5 * (t - 1.0) * (t - 2.0), -t * (t - 2.0), 0.5 * t * (t - 1.0), 0.0];
                (weights, [t - 1.5, 2.0 - 2.0 * t, t - 0.5, 0.0])
            }
            _ => {
                const SIXTH: f64 = 1.0 / 6.0;
                let [a, b, c] = [t - 1.0, t - 2.0, t - 3.0];
                let weights = [-SIXTH * (a * b * c), 0.5 * t * b * c, -0.5 * t * a * c, SIXTH * (t * a * b)];
                let slopes = [
                    -SIXTH * (a * b + a * c + b * c),
                    0.5 * (t * b + t * c + b * c),
                    -0.5 * (t * a + t * c + a * c),
                    SIXTH * (t * a + t * b + a * b),
                ];
                (weights, slopes)
            }
        };
        Self { first, used, weights, slopes }
    }
}

struct Interpolate<'a, W, const K: usize> {
    table: &'a Layers,
    stencils: [Stencil; 2],
    layers: Range<usize>,
    weights: W,
    out: &'a mut [[Lanes; K]],
}

impl<W: Fn(&[Stencil; 2], usize, usize) -> [f64; K], const K: usize> Kernel for Interpolate<'_, W, K> {
    type Output = ();
    const FUSED: bool = true;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: Simd>(self) {
        let Self { table, stencils, layers, weights, out } = self;
        let [along, across] = &stencils;
        let mut nodes = [([0.0; K], 0); 16];
        for i in 0..along.used {
            for j in 0..across.used {
                let place = (along.first + i) * table.counts[1] + across.first + j;
                let first = (place * table.layers + layers.start) * table.groups;
                nodes[i * across.used + j] = (weights(&stencils, i, j), first);
            }
        }
        let nodes = &nodes[..along.used * across.used];
        for (o, out) in out.iter_mut().enumerate() {
            let mut sums = [S::F64::splat(0.0); K];
            for (weights, first) in nodes {
                let value = S::F64::load(&table.values[first + o]);
                for k in 0..K {
                    sums[k] = value.mul_add(S::F64::splat(weights[k]), sums[k]);
                }
            }
            *out = sums.map(S::F64::to_array);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubic_table(counts: [usize; 2]) -> Layers {
        let axis = |count| Axis { count, ..Axis::NONE };
        let of = |place: usize, layer: usize, channel: usize| {
            polynomial([(place / counts[1]) as f64, (place % counts[1]) as f64], counts)
                * (1 + layer + 2 * channel) as f64
        };
        Layers::new(counts.map(axis), 2, 9, of)
    }

    /// Highest degree per axis that the nodes determine, at most cubic.
    fn polynomial([x, y]: [f64; 2], counts: [usize; 2]) -> f64 {
        let power = |at: f64, count: usize| (0.3 * at + 0.1).powi(count.min(4) as i32 - 1);
        power(x, counts[0]) * power(y, counts[1])
    }

    #[test]
    fn polynomials_that_the_nodes_tell_are_met_between_them_with_their_slopes() {
        const STEP: f64 = 1e-6;
        for counts in [[7, 5], [6, 1], [3, 2], [2, 4], [1, 1]] {
            let table = cubic_table(counts);
            let ends = counts.map(|count| (count - 1) as f64);
            for (u, v) in [(0.0, 0.0), (0.13, 0.9), (0.5, 0.31), (1.0, 1.0), (0.77, 0.02)] {
                let at = [u * ends[0], v * ends[1]];
                let (mut values, mut slopes) = (Vec::new(), Vec::new());
                table.interpolate(at, 1..2, &mut values);
                table.interpolate_slopes(at, 1..2, &mut slopes);
                let factor = (2 + 2 * 8) as f64;
                let exact = |at| factor * polynomial(at, counts);
                assert!((values[1][0] - exact(at)).abs() < 1e-12, "{counts:?} {at:?}");
                assert_eq!((values[1][0], values[1][1]), (slopes[1][0][0], 0.0));
                for k in 0..2 {
                    let moved = |by: f64| std::array::from_fn(|i| at[i] + if i == k { by } else { 0.0 });
                    let slope = (exact(moved(STEP)) - exact(moved(-STEP))) / (2.0 * STEP);
                    assert!((slopes[1][k + 1][0] - slope).abs() < 1e-7, "{counts:?} {at:?} {k}");
                }
            }
        }
    }
}
