//! Means of influence functions from cumulative sums.

use super::cells::Cells;
use super::{LoadChannel, LoadSensors};
use ndarray::Array2;

/// Interpolation nodes per axis.
const STENCIL: usize = 4;

/// Cumulative integrals of influence over noise at grid nodes, with cubic interpolation; four values give a
/// rectangle.
pub(super) struct CumulativeInfluence {
    channels: usize,
    /// In metres; 1 across on a line.
    sides_m: [f64; 2],
    nodes: [usize; 2],
    /// In 1/N times length or area, by y, x, channel.
    sums: Vec<f64>,
}

/// Mean influence over noise in a rectangle, in 1/N.
pub(super) struct EvenMean {
    pub value: Vec<f64>,
    /// Per metre, by lower and upper ends along x and y.
    pub slopes: [[Vec<f64>; 2]; 2],
}

impl CumulativeInfluence {
    pub fn new(sensors: &LoadSensors, cells: &Cells) -> Self {
        let alive: Vec<&LoadChannel> = sensors.enabled().collect();
        let channels = alive.len();
        let [along, across] = cells.points_a_side();
        let parts = [cells.columns * along, cells.rows * across];
        let nodes = parts.map(|parts| parts + 1);
        let sides_m = [cells.extent.length_m(), cells.extent.width_m().unwrap_or(1.0)];
        let measure = sides_m[0] * sides_m[1] / (parts[0] * parts[1]) as f64;
        let mut sums = vec![0.0; nodes[0] * nodes[1] * channels];
        for cell in 0..cells.len() {
            let (column, row) = (cell % cells.columns, cell / cells.columns);
            for (i, point) in cells.points(cell).into_iter().enumerate() {
                let [x, y] = [column * along + i % along + 1, row * across + i / along + 1];
                for (c, channel) in alive.iter().enumerate() {
                    sums[(y * nodes[0] + x) * channels + c] =
                        measure * channel.influence.at(point) / channel.noise_sd;
                }
            }
        }
        for (axis, step) in [(0, channels), (1, nodes[0] * channels)] {
            for at in 0..nodes[0] * nodes[1] {
                let place = [at % nodes[0], at / nodes[0]][axis];
                for c in (0..channels).filter(|_| place > 0) {
                    sums[at * channels + c] += sums[at * channels + c - step];
                }
            }
        }
        Self { channels, sides_m, nodes, sums }
    }

    /// Channels × cells, in 1/N.
    pub fn over_cells(&self, cells: &Cells) -> Array2<f64> {
        let [along, across] = cells.points_a_side();
        let sum =
            |x: usize, y: usize, channel: usize| self.sums[(y * self.nodes[0] + x) * self.channels + channel];
        let measure = self.side_m(0) * self.side_m(1) / cells.len() as f64;
        Array2::from_shape_fn((self.channels, cells.len()), |(channel, cell)| {
            let (left, low) = (along * (cell % cells.columns), across * (cell / cells.columns));
            let (right, high) = (left + along, low + across);
            let upper = sum(right, high, channel) - sum(left, high, channel);
            let lower = sum(right, low, channel) - sum(left, low, channel);
            (upper - lower) / measure
        })
    }

    /// Node distance in metres.
    pub fn part_m(&self, axis: usize) -> f64 {
        self.sides_m[axis] / (self.nodes[axis] - 1) as f64
    }

    /// In metres; 1 across on a line.
    pub fn side_m(&self, axis: usize) -> f64 {
        self.sides_m[axis]
    }

    /// Upper ends must exceed lower ones.
    pub fn mean(&self, ends_m: [[f64; 2]; 2]) -> EvenMean {
        let [x, y] = [0, 1].map(|axis| ends_m[axis].map(|at_m| self.stencil(axis, at_m)));
        let zeros = || vec![0.0; self.channels];
        let mut value = zeros();
        let mut slopes = [[zeros(), zeros()], [zeros(), zeros()]];
        for (x_end, x) in x.iter().enumerate() {
            for (y_end, y) in y.iter().enumerate() {
                let sign = if x_end == y_end { 1.0 } else { -1.0 };
                for (i, (wx, dx)) in x.terms() {
                    for (j, (wy, dy)) in y.terms() {
                        let node = &self.sums[(j * self.nodes[0] + i) * self.channels..][..self.channels];
                        add(&mut value, sign * wx * wy, node);
                        add(&mut slopes[0][x_end], sign * dx * wy, node);
                        add(&mut slopes[1][y_end], sign * wx * dy, node);
                    }
                }
            }
        }
        let lengths_m = ends_m.map(|[from_m, to_m]| to_m - from_m);
        let area = lengths_m[0] * lengths_m[1];
        value.iter_mut().for_each(|value| *value /= area);
        for (slopes, length_m) in slopes.iter_mut().zip(lengths_m) {
            // A longer interval adds the influence at its end, and dilutes the rest.
            for (slopes, sign) in slopes.iter_mut().zip([1.0, -1.0]) {
                slopes
                    .iter_mut()
                    .zip(&value)
                    .for_each(|(slope, mean)| *slope = *slope / area + sign * mean / length_m);
            }
        }
        EvenMean { value, slopes }
    }

    /// Lagrange polynomials.
    fn stencil(&self, axis: usize, at_m: f64) -> Stencil {
        let nodes = self.nodes[axis];
        let count = STENCIL.min(nodes);
        let at = (at_m / self.part_m(axis)).clamp(0.0, (nodes - 1) as f64);
        let first = (at.floor() as usize).saturating_sub(1).min(nodes - count);
        let off = |k: usize| at - (first + k) as f64;
        let mut terms = [(0.0, 0.0); STENCIL];
        for (i, (weight, slope)) in terms.iter_mut().take(count).enumerate() {
            let others = || (0..count).filter(|k| *k != i);
            let scale: f64 = others().map(|k| i as f64 - k as f64).product();
            *weight = others().map(off).product::<f64>() / scale;
            let without = |left_out: usize| others().filter(|k| *k != left_out).map(off).product::<f64>();
            *slope = others().map(without).sum::<f64>() / scale / self.part_m(axis);
        }
        Stencil { first, count, terms }
    }
}

/// Weights of adjacent nodes, with derivatives per metre.
struct Stencil {
    first: usize,
    count: usize,
    terms: [(f64, f64); STENCIL],
}

impl Stencil {
    /// The first node has sums of 0.
    fn terms(&self) -> impl Iterator<Item = (usize, (f64, f64))> {
        (self.first..).zip(self.terms.into_iter().take(self.count)).filter(|(node, _)| *node > 0)
    }
}

fn add(sum: &mut [f64], weight: f64, values: &[f64]) {
    if weight == 0.0 {
        return;
    }
    sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Foam, beam, foam_layout, layout};
    use super::*;
    use palpate_mechanics::contact::Position;
    use palpate_mechanics::sensing::Layout;
    use palpate_mechanics::surface::{Surface, UniformLoad};

    fn check(surface: &dyn Surface, layout: &Layout, ends_m: [[f64; 2]; 2], tolerance: f64) {
        let sensors = LoadSensors::new(surface, layout).unwrap();
        let table = CumulativeInfluence::new(&sensors, &Cells::new(sensors.extent));
        let on_plane = sensors.extent.width_m().is_some();
        let told = table.mean(if on_plane { ends_m } else { [ends_m[0], [0.0, 1.0]] });
        let summed = |[[left, right], [low, high]]: [[f64; 2]; 2]| -> Vec<f64> {
            let corner = |x_m, y_m| Position { x_m, y_m: if on_plane { y_m } else { 0.0 } };
            let load = UniformLoad::new(corner(left, low), corner(right, high), 1.0);
            sensors.enabled().map(|channel| load.mean(&*channel.influence) / channel.noise_sd).collect()
        };
        let size = summed(ends_m).iter().fold(0.0, |size: f64, value| size.max(value.abs()));
        for (told, summed) in told.value.iter().zip(summed(ends_m)) {
            assert!((told - summed).abs() < tolerance * size, "{told} {summed}");
        }
        for axis in 0..sensors.extent.dimensions() {
            for end in 0..2 {
                let moved = |by_m: f64| {
                    let mut ends_m = ends_m;
                    ends_m[axis][end] += by_m;
                    summed(ends_m)
                };
                let step_m = 0.05 * (ends_m[axis][1] - ends_m[axis][0]);
                for ((slope, more), less) in
                    told.slopes[axis][end].iter().zip(moved(step_m)).zip(moved(-step_m))
                {
                    let found = (more - less) / (2.0 * step_m);
                    assert!((slope - found).abs() * step_m < 10.0 * tolerance * size, "{slope} {found}");
                }
            }
        }
    }

    #[test]
    fn means_are_those_of_loads_summed_point_by_point() {
        let (beam, layout) = (beam(), layout(false));
        for ends_m in [[0.0, 0.01], [0.0033, 0.0047], [0.1, 0.31], [0.377, 0.4]] {
            check(&beam, &layout, [ends_m, [0.0, 1.0]], 1e-4);
        }
        check(&Foam, &foam_layout(), [[0.03, 0.11], [0.0, 0.04]], 2e-3);
        check(&Foam, &foam_layout(), [[0.187, 0.2], [0.061, 0.077]], 2e-3);
    }
}
