//! Axes of a grid of places.

use crate::fit::LocatorFault;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use std::ops::RangeInclusive;

/// With few calibration rows the posterior variance peaks between neighbouring places, which a coarser grid
/// misses.
const LEAST_ALONG_LINE: usize = 60;
/// Nodes of a cubic.
const LEAST_NODES: usize = 4;

/// Evenly spaced nodes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Coordinate of the first node.
    pub start: f64,
    /// Distance between neighbouring nodes, greater than 0.
    pub step: f64,
    /// Number of nodes, at least 1.
    pub count: usize,
    /// Width of the margins at both ends, in nodes; there the prior density falls.
    #[serde(default)]
    pub margins: [f64; 2],
}

impl Axis {
    /// Coordinate that does not vary.
    pub const NONE: Self = Self { start: 0.0, step: 1.0, count: 1, margins: [0.0; 2] };

    /// Places nodes over `values` and half their largest gap beyond: about two per distinct value, at least 8
    /// per `length`, at most `most`.
    pub fn over(values: Vec<f64>, length: f64, most: usize) -> Self {
        Self::beyond(values, 0.5, (f64::NEG_INFINITY, f64::INFINITY), length, LEAST_NODES..=most)
    }

    /// Places nodes over positions along side `k` and one largest gap beyond; the outer half of that gap is a
    /// margin.
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

    fn beyond(
        mut values: Vec<f64>,
        gaps: f64,
        bounds: (f64, f64),
        length: f64,
        nodes: RangeInclusive<usize>,
    ) -> Self {
        /// Interpolation errors are then below the noise.
        const PER_LENGTH: f64 = 8.0;
        values.sort_by(f64::total_cmp);
        values.dedup();
        let (Some(first), Some(last)) = (values.first(), values.last()) else { return Self::NONE };
        let gap = values.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let within = |value: f64| value.clamp(bounds.0, bounds.1);
        let ends = |gaps: f64| (within(first - gaps * gap), within(last + gaps * gap));
        let ((from, to), usual) = (ends(gaps), ends(0.5));
        // One value alone, or values that differ only by rounding.
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

    /// Refines the axis to `factor` times the nodes, at most `most`.
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

    /// Returns the coordinate at `place`, in nodes from the first.
    pub fn value(&self, place: f64) -> f64 {
        self.start + self.step * place
    }
}

pub(super) fn is_margin(axes: [Axis; 2], place: [f64; 2]) -> bool {
    (0..2).any(|k| axes[k].margin_cost(place[k]) > 0.0)
}

/// Place (x, y) has the index x·count_y + y.
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
    /// −2·ln of the relative prior density: in a margin it falls exponentially, to a tenth at the end.
    pub(super) fn margin_cost(&self, place: f64) -> f64 {
        const FALL: f64 = 2.0 * std::f64::consts::LN_10;
        let within =
            |margin: f64, from_end: f64| if from_end < margin { 1.0 - from_end / margin } else { 0.0 };
        FALL * (within(self.margins[0], place) + within(self.margins[1], (self.count - 1) as f64 - place))
    }
}

pub(super) fn check_axes(axes: &[Axis]) -> Result<(), LocatorFault> {
    let counts = axes.iter().map(|axis| axis.count as f64);
    LocatorFault::check_numbers("axis count", counts, |count| count >= 1.0, "at least 1")?;
    LocatorFault::check_numbers("axis start", axes.iter().map(|axis| axis.start), |_| true, "finite")?;
    let steps = axes.iter().map(|axis| axis.step);
    LocatorFault::check_numbers("axis step", steps, |step| step > 0.0, "finite and greater than 0")?;
    let margins = axes.iter().flat_map(|axis| axis.margins);
    LocatorFault::check_numbers("axis margin", margins, |margin| margin >= 0.0, "finite and at least 0")
}

pub(super) fn middle([x, y]: [Axis; 2]) -> Position {
    let middle = |axis: Axis| axis.value(0.5 * (axis.count - 1) as f64);
    Position { x_m: middle(x), y_m: middle(y) }
}
