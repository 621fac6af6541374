//! One coordinate of the table.

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
    pub fn at(&self, place: f64) -> f64 {
        self.start + self.step * place
    }
}
