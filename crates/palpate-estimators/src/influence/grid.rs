//! A grid of places, and the posterior of a contact over its cells.

use super::moments::Moments;
use crate::fit::LocatorFault;
use crate::status::OTHER_PLACE;
use palpate_core::{BoundedList, ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::{bisect, normal_interval_95};

/// Evenly spaced nodes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// The first node.
    pub start: f64,
    /// From one node to the next; greater than 0.
    pub step: f64,
    /// Nodes; at least 1.
    pub count: usize,
}

impl Axis {
    /// A coordinate that does not vary.
    pub const NONE: Self = Self { start: 0.0, step: 1.0, count: 1 };

    /// Nodes over the span of `values`, and half their largest gap beyond at either end but not beyond `bounds`; about
    /// two nodes for every distinct value, and at least `per_length` a `length`, but no more than `most`.
    pub fn over(mut values: Vec<f64>, bounds: (f64, f64), length: f64, most: usize) -> Self {
        /// Nodes a length scale: linear and cubic interpolation between them is then better than the noise.
        const PER_LENGTH: f64 = 8.0;
        values.sort_by(f64::total_cmp);
        values.dedup();
        let (Some(first), Some(last)) = (values.first(), values.last()) else { return Self::NONE };
        let gap = values.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let (from, to) = ((first - 0.5 * gap).max(bounds.0), (last + 0.5 * gap).min(bounds.1));
        // One value alone, or none that differ by more than rounding.
        if (to - from).is_nan() || to - from <= 1e-9 * (from.abs() + to.abs()) {
            return Self { start: *first, ..Self::NONE };
        }
        let by_values = 2 * values.len() - 1;
        let by_length = ((to - from) / length * PER_LENGTH).min(most as f64) as usize + 2;
        let count = by_values.max(by_length).min(most).max(4);
        Self { start: from, step: (to - from) / (count - 1) as f64, count }
    }

    /// The same span with `factor` times the nodes, but no more than `most`; unchanged where that is no more.
    pub(super) fn finer(self, factor: f64, most: usize) -> Self {
        let wanted = (self.count as f64 * factor).ceil().min(most as f64) as usize;
        if self.count < 2 || wanted <= self.count {
            return self;
        }
        let span = self.step * (self.count - 1) as f64;
        Self { step: span / (wanted - 1) as f64, count: wanted, ..self }
    }

    /// The coordinate at `place`, in nodes from the first.
    pub fn value(&self, place: f64) -> f64 {
        self.start + self.step * place
    }
}

/// Checks what a file may have got wrong of axes.
pub(super) fn check_axes(axes: &[Axis]) -> Result<(), LocatorFault> {
    let counts = axes.iter().map(|axis| axis.count as f64);
    LocatorFault::check_numbers("axis count", counts, |count| count >= 1.0, "at least 1")?;
    LocatorFault::check_numbers("axis start", axes.iter().map(|axis| axis.start), |_| true, "finite")?;
    let steps = axes.iter().map(|axis| axis.step);
    LocatorFault::check_numbers("axis step", steps, |step| step > 0.0, "finite and greater than 0")
}

/// The places next to one, diagonally too. Place (x, y) of a grid is number x·count_y + y.
pub(super) fn neighbours([x, y]: [Axis; 2], place: usize) -> impl Iterator<Item = usize> + use<> {
    let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    let (columns, rows) = (around(place / y.count, x.count), around(place % y.count, y.count));
    columns.flat_map(move |i| rows.clone().map(move |j| i * y.count + j)).filter(move |other| *other != place)
}

/// The places around (x, y), in nodes, with the weight of each in cubic interpolation through four places each way.
pub(super) fn weights_around(
    [x_axis, y_axis]: [Axis; 2],
    (x, y): (f64, f64),
) -> impl Iterator<Item = (usize, f64)> + use<> {
    let (first_x, weights_x) = cubic(x, x_axis.count);
    let (first_y, weights_y) = cubic(y, y_axis.count);
    let used = |weights: [f64; 4]| (0..4).map(move |i| (i, weights[i])).filter(|(_, weight)| *weight != 0.0);
    used(weights_x).flat_map(move |(i, wx)| {
        used(weights_y).map(move |(j, wy)| ((first_x + i) * y_axis.count + first_y + j, wx * wy))
    })
}

/// Lagrange's weights of four nodes around `place`, or of fewer where there are no four, and the first of them.
pub(super) fn cubic(place: f64, count: usize) -> (usize, [f64; 4]) {
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

/// The position in the middle of a grid.
pub(super) fn middle([x, y]: [Axis; 2]) -> Position {
    let middle = |axis: Axis| axis.value(0.5 * (axis.count - 1) as f64);
    Position { x_m: middle(x), y_m: middle(y) }
}

/// The middles of the parts of a place's cell, in nodes, where each axis of it is cut into `parts`; what would lie beyond the
/// grid's edge is left out.
pub(super) fn parts_of(
    [x, y]: [Axis; 2],
    parts: usize,
    place: usize,
) -> impl Iterator<Item = (f64, f64)> + use<> {
    let along = Cut { node: place / y.count, count: x.count, parts };
    let across = Cut { node: place % y.count, count: y.count, parts };
    along.middles().flat_map(move |x| across.middles().map(move |y| (x, y)))
}

/// A cell's extent along one axis in equal parts.
#[derive(Clone, Copy, Debug)]
struct Cut {
    node: usize,
    /// Nodes of the axis.
    count: usize,
    parts: usize,
}

impl Cut {
    /// Middle of each part, in nodes; of those within the axis.
    fn middles(self) -> impl Iterator<Item = f64> + use<> {
        let parts = if self.count == 1 { 1 } else { self.parts };
        let middles = (0..parts).map(move |k| self.node as f64 + (k as f64 + 0.5) / parts as f64 - 0.5);
        middles.filter(move |place| (0.0..=(self.count - 1) as f64).contains(place))
    }
}

/// Residuals further than this above the least have no probability worth adding up: e⁻¹⁰.
pub(super) const CUT: f64 = 20.0;
/// A cell belongs to a mode when its density is at least this share of the greatest.
const VALLEY: f64 = 0.01;

/// Source of the force of an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ToldForce {
    /// The reading tells it.
    Estimated,
    /// It is known, in newtons.
    Known(f64),
    /// Nobody knows it.
    Untold,
}

/// A part of a cell as a reading sees it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PartOfCell {
    /// Its posterior density, relative to that of all other parts; 0 where it does not matter.
    pub weight: f64,
    /// Mean of the force there, in newtons, and its variance.
    pub force_n: f64,
    pub force_variance_n2: f64,
    /// The least squared residual there.
    pub residual: f64,
}

/// Parts of a cell next to each other along one axis, of even width.
#[derive(Clone, Copy, Debug)]
struct Slice {
    middle_m: f64,
    /// Half its width, in metres.
    half_m: f64,
    weight: f64,
}

/// A cell that has some probability.
#[derive(Clone, Copy, Debug)]
struct Cell {
    place: usize,
    moments: Moments,
    /// The greatest weight among its parts.
    peak: f64,
}

/// The posterior of one reading over the cells of a grid.
#[derive(Debug)]
pub(super) struct GridPosterior {
    axes: [Axis; 2],
    force: ToldForce,
    cells: Vec<Cell>,
    /// Slices of the cells along x, and along y.
    columns: Vec<Slice>,
    rows: Vec<Slice>,
    /// The least residual of any part.
    pub residual: f64,
}

impl GridPosterior {
    /// Over a grid.
    pub fn new(axes: [Axis; 2], force: ToldForce) -> Self {
        Self {
            axes,
            force,
            cells: Vec::new(),
            columns: Vec::new(),
            rows: Vec::new(),
            residual: f64::INFINITY,
        }
    }

    /// Adds the cell of a place, cut into so many parts along each axis that varies; `part` is asked for the part at (x, y), in nodes,
    /// column by column.
    pub fn add_cell(&mut self, place: usize, parts: usize, mut part: impl FnMut(f64, f64) -> PartOfCell) {
        let parts = self.axes.map(|axis| if axis.count > 1 { parts } else { 1 });
        let [x_axis, y_axis] = self.axes;
        let across = Cut { node: place % y_axis.count, count: y_axis.count, parts: parts[1] };
        let along = Cut { node: place / y_axis.count, count: x_axis.count, parts: parts[0] };
        let area = 1.0 / (parts[0] * parts[1]) as f64;
        let half = |axis: Axis, parts: usize| 0.5 * axis.step / parts as f64;
        let mut cell = Cell { place, moments: Moments::default(), peak: 0.0 };
        let first_row = self.rows.len();
        self.rows.extend(across.middles().map(|y| Slice {
            middle_m: y_axis.value(y),
            half_m: half(y_axis, parts[1]),
            weight: 0.0,
        }));
        for x in along.middles() {
            let x_m = x_axis.value(x);
            let mut slice = Slice { middle_m: x_m, half_m: half(x_axis, parts[0]), weight: 0.0 };
            for (y, row) in across.middles().zip(first_row..) {
                let PartOfCell { weight, force_n, force_variance_n2, residual } = part(x, y);
                if weight > 0.0 {
                    self.residual = self.residual.min(residual);
                    cell.peak = cell.peak.max(weight);
                    let weight = weight * area;
                    cell.moments.add(weight, [x_m, self.rows[row].middle_m, force_n]);
                    cell.moments.add_force_variance(weight, force_variance_n2);
                    slice.weight += weight;
                    self.rows[row].weight += weight;
                }
            }
            if slice.weight > 0.0 {
                self.columns.push(slice);
            }
        }
        if cell.moments.weight > 0.0 {
            self.cells.push(cell);
        }
    }

    /// The posterior's mean and covariance; the most probable mode alone where there are several; `outside_model`
    /// above the residual limit.
    pub fn estimate(mut self, residual_limit: f64) -> Estimate {
        let total = Moments::total(self.cells.iter().map(|cell| cell.moments));
        if !(total.weight > 0.0 && total.weight.is_finite()) {
            return Estimate::of_position(middle(self.axes), Status::OutsideModel);
        }
        let (x_95_m, y_95_m) = self.intervals(total.weight);
        let mut contact = self.contact(total);
        let covariance = contact.uncertainty.unwrap_or_default().covariance;
        contact.uncertainty = Some(Uncertainty { covariance, x_95_m, y_95_m });
        if self.residual.is_nan() || self.residual > residual_limit {
            return Estimate::of_contact(contact, Status::OutsideModel);
        }
        let modes = self.modes();
        let Some((first, others)) = modes.split_first().filter(|(_, others)| !others.is_empty()) else {
            return Estimate::of_contact(contact, Status::Located);
        };
        // The most probable place, with the uncertainty of all.
        let most_probable = ContactEstimate { uncertainty: contact.uncertainty, ..self.contact(*first) };
        let mut estimate = Estimate::of_contact(most_probable, Status::Ambiguous);
        estimate.modes = BoundedList::none(Mode::default());
        for moments in others {
            let probability = moments.weight / total.weight;
            let mode = Mode { contact: self.contact(*moments), probability };
            if !estimate.modes.push(mode) {
                break;
            }
        }
        estimate
    }

    /// The contact that some of the probability describes, its intervals those of a normal distribution.
    fn contact(&self, moments: Moments) -> ContactEstimate {
        let ([x_m, y_m, force_n], covariance) = moments.mean_and_covariance();
        let (force_n, covariance) = match self.force {
            ToldForce::Estimated => (Some(force_n), covariance),
            other => {
                let force_n = if let ToldForce::Known(force_n) = other { Some(force_n) } else { None };
                (force_n, [covariance[0], covariance[1], 0.0, covariance[3], 0.0, 0.0])
            }
        };
        let uncertainty = Uncertainty {
            covariance,
            x_95_m: normal_interval_95(x_m, covariance[0].sqrt()),
            y_95_m: normal_interval_95(y_m, covariance[3].sqrt()),
        };
        ContactEstimate { position: Position { x_m, y_m }, force_n, uncertainty: Some(uncertainty) }
    }

    /// Connected groups of cells that are dense enough, most probable first; only those that are noticeable.
    fn modes(&self) -> Vec<Moments> {
        let peak = self.cells.iter().map(|cell| cell.peak).fold(0.0, f64::max);
        let mut left: Vec<Cell> = self.cells.iter().filter(|c| c.peak >= VALLEY * peak).copied().collect();
        let across = self.axes[1].count;
        let apart =
            |a: usize, b: usize| (a / across).abs_diff(b / across).max((a % across).abs_diff(b % across));
        let mut modes = Vec::new();
        while let Some(seed) = left.pop() {
            let mut group = vec![seed];
            let mut grown = 0;
            while grown < group.len() {
                let at = group[grown].place;
                let (near, far) = left.into_iter().partition(|cell| apart(cell.place, at) <= 1);
                left = far;
                group.extend::<Vec<Cell>>(near);
                grown += 1;
            }
            modes.push(Moments::total(group.iter().map(|cell| cell.moments)));
        }
        modes.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let total: f64 = self.cells.iter().map(|cell| cell.moments.weight).sum();
        modes.retain(|mode| mode.weight >= OTHER_PLACE * total);
        modes
    }

    /// The 95 % intervals along x and y.
    fn intervals(&mut self, total: f64) -> ((f64, f64), (f64, f64)) {
        let x = interval(&mut self.columns, total);
        if self.axes[1].count == 1 {
            return (x, (0.0, 0.0));
        }
        (x, interval(&mut self.rows, total))
    }
}

/// Places below which 2.5 % and 97.5 % of the weight of slices lie, which is spread evenly over each.
fn interval(slices: &mut [Slice], total: f64) -> (f64, f64) {
    slices.sort_unstable_by(|a, b| a.middle_m.total_cmp(&b.middle_m));
    let Some(half_m) = slices.first().map(|slice| slice.half_m) else { return (0.0, 0.0) };
    if slices.iter().any(|slice| slice.half_m != half_m) {
        return [0.025, 0.975].map(|share| quantile_of_any(slices, share * total)).into();
    }
    let find = |share: f64| {
        let (mut below, wanted) = (0.0, share * total);
        for group in slices.chunk_by(|a, b| b.middle_m - a.middle_m < 0.5 * half_m) {
            let weight: f64 = group.iter().map(|slice| slice.weight).sum();
            if below + weight >= wanted && weight > 0.0 {
                return group[0].middle_m - half_m + 2.0 * half_m * (wanted - below) / weight;
            }
            below += weight;
        }
        slices.last().map_or(0.0, |slice| slice.middle_m + half_m)
    };
    (find(0.025), find(0.975))
}

/// The place below which so much of the weight of slices lies that may overlap.
fn quantile_of_any(slices: &[Slice], wanted: f64) -> f64 {
    let ends = |end: f64| slices.iter().map(move |slice| slice.middle_m + end * slice.half_m);
    let range = (ends(-1.0).fold(f64::INFINITY, f64::min), ends(1.0).fold(f64::NEG_INFINITY, f64::max));
    let below = |place_m: f64| {
        let part = |slice: &Slice| (0.5 + 0.5 * (place_m - slice.middle_m) / slice.half_m).clamp(0.0, 1.0);
        slices.iter().map(|slice| slice.weight * part(slice)).sum::<f64>()
    };
    bisect(range, 30, |place_m| below(place_m) < wanted)
}
