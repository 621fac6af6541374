//! A grid of places.

use crate::fit::LocatorFault;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use std::ops::RangeInclusive;

/// Least nodes along a line: what few presses leave open rises and falls between two of them, which cubics over a node or two a press miss.
const LEAST_ALONG_LINE: usize = 60;
/// Least nodes of any other axis, those of a cubic.
const LEAST_NODES: usize = 4;

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
    /// Nodes at either end where contacts are less likely, the nearer the end the less.
    #[serde(default)]
    pub margins: [f64; 2],
}

impl Axis {
    /// A coordinate that does not vary.
    pub const NONE: Self = Self { start: 0.0, step: 1.0, count: 1, margins: [0.0; 2] };

    /// Nodes over the span of `values`, and half their largest gap beyond at either end; about two nodes for every distinct value, and at
    /// least `per_length` a `length`, but no more than `most`.
    pub fn over(values: Vec<f64>, length: f64, most: usize) -> Self {
        Self::beyond(values, 0.5, (f64::NEG_INFINITY, f64::INFINITY), length, LEAST_NODES..=most)
    }

    /// The same of positions along a side of so many metres: beyond half the largest gap, contacts are less likely up to the whole gap, but
    /// nowhere beyond the side's ends. The side is number `k` of the extent's.
    pub fn of_positions(
        positions_m: Vec<f64>,
        (extent, k): (Extent, usize),
        length_m: f64,
        most: usize,
    ) -> Self {
        let (sides_m, least) = match extent.width_m() {
            None => ([extent.length_m(), 0.0], LEAST_ALONG_LINE),
            Some(width_m) => ([extent.length_m(), width_m], LEAST_NODES),
        };
        Self::beyond(positions_m, 1.0, (0.0, sides_m[k]), length_m, least..=most)
    }

    /// Nodes up to so many gaps beyond the values.
    fn beyond(
        mut values: Vec<f64>,
        gaps: f64,
        bounds: (f64, f64),
        length: f64,
        nodes: RangeInclusive<usize>,
    ) -> Self {
        /// Nodes a length scale: linear and cubic interpolation between them is then better than the noise.
        const PER_LENGTH: f64 = 8.0;
        values.sort_by(f64::total_cmp);
        values.dedup();
        let (Some(first), Some(last)) = (values.first(), values.last()) else { return Self::NONE };
        let gap = values.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let within = |value: f64| value.clamp(bounds.0, bounds.1);
        let ends = |gaps: f64| (within(first - gaps * gap), within(last + gaps * gap));
        let ((from, to), usual) = (ends(gaps), ends(0.5));
        // One value alone, or none that differ by more than rounding.
        if (to - from).is_nan() || to - from <= 1e-9 * (from.abs() + to.abs()) {
            return Self { start: *first, ..Self::NONE };
        }
        let by_values = 2 * values.len() - 1;
        let (least, most) = nodes.into_inner();
        let by_length = ((to - from) / length * PER_LENGTH).min(most as f64) as usize + 2;
        let count = by_values.max(by_length).clamp(least, most);
        let step = (to - from) / (count - 1) as f64;
        Self { start: from, step, count, margins: [(usual.0 - from) / step, (to - usual.1) / step] }
    }

    /// The same span with `factor` times the nodes, but no more than `most`; unchanged where that is no more.
    pub(super) fn finer(self, factor: f64, most: usize) -> Self {
        let wanted = (self.count as f64 * factor).ceil().min(most as f64) as usize;
        if self.count < 2 || wanted <= self.count {
            return self;
        }
        let span = self.step * (self.count - 1) as f64;
        let step = span / (wanted - 1) as f64;
        let margins = self.margins.map(|margin| margin * self.step / step);
        Self { step, count: wanted, margins, ..self }
    }

    /// The coordinate at `place`, in nodes from the first.
    pub fn value(&self, place: f64) -> f64 {
        self.start + self.step * place
    }
}

/// True of a place, in nodes, in a margin.
pub(super) fn is_margin(axes: [Axis; 2], place: [f64; 2]) -> bool {
    (0..2).any(|k| axes[k].margin_cost(place[k]) > 0.0)
}

/// Greatest of a distance from a place to its two neighbours along, and across; `distance` is asked for the neighbour's number. Place (x, y) of a grid is
/// number x·count_y + y.
pub(super) fn greatest_distances(
    [x, y]: [Axis; 2],
    place: usize,
    mut distance: impl FnMut(usize) -> f64,
) -> [f64; 2] {
    let (i, j) = (place / y.count, place % y.count);
    let along = [(i > 0).then(|| place - y.count), (i + 1 < x.count).then(|| place + y.count)];
    let across = [(j > 0).then(|| place - 1), (j + 1 < y.count).then(|| place + 1)];
    [along, across].map(|others| others.into_iter().flatten().map(&mut distance).fold(0.0, f64::max))
}

impl Axis {
    /// −2·ln of how much less likely a contact at `place`, in nodes, is than one in the middle: in a margin it falls exponentially, to a tenth at
    /// the end.
    pub(super) fn margin_cost(&self, place: f64) -> f64 {
        const FALL: f64 = 2.0 * std::f64::consts::LN_10;
        let within =
            |margin: f64, from_end: f64| if from_end < margin { 1.0 - from_end / margin } else { 0.0 };
        FALL * (within(self.margins[0], place) + within(self.margins[1], (self.count - 1) as f64 - place))
    }
}

/// Checks what a file may have got wrong of axes.
pub(super) fn check_axes(axes: &[Axis]) -> Result<(), LocatorFault> {
    let counts = axes.iter().map(|axis| axis.count as f64);
    LocatorFault::check_numbers("axis count", counts, |count| count >= 1.0, "at least 1")?;
    LocatorFault::check_numbers("axis start", axes.iter().map(|axis| axis.start), |_| true, "finite")?;
    let steps = axes.iter().map(|axis| axis.step);
    LocatorFault::check_numbers("axis step", steps, |step| step > 0.0, "finite and greater than 0")?;
    let margins = axes.iter().flat_map(|axis| axis.margins);
    LocatorFault::check_numbers("axis margin", margins, |margin| margin >= 0.0, "finite and at least 0")
}

/// The position in the middle of a grid.
pub(super) fn middle([x, y]: [Axis; 2]) -> Position {
    let middle = |axis: Axis| axis.value(0.5 * (axis.count - 1) as f64);
    Position { x_m: middle(x), y_m: middle(y) }
}
