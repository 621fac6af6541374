//! Cells of a grid, and which of them a reading speaks for.

/// Nodes of a grid in cells of the same size, each around its middle node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::influence) struct Cells {
    /// Nodes along and across.
    nodes: [usize; 2],
    /// Nodes of a cell along either; odd.
    stride: [usize; 2],
}

/// A cell as a reading sees it from its middle.
#[derive(Clone, Copy, Debug)]
pub(in crate::influence) struct Look {
    /// About the least squared residual, in variances.
    pub misfit: f64,
    /// The same with what else the middle costs.
    pub cost: f64,
    /// The latent number there.
    pub latent: f64,
}

/// Span of a cell, or of a part of it, along and across, in nodes.
pub(super) type Span = [(f64, f64); 2];

impl Cells {
    /// Of a grid of so many nodes, `stride` of them to a cell along every axis that varies.
    pub fn new(nodes: [usize; 2], stride: usize) -> Self {
        Self { nodes, stride: nodes.map(|nodes| if nodes > 1 { stride } else { 1 }) }
    }

    /// Cells along and across.
    fn counts(self) -> [usize; 2] {
        [0, 1].map(|k| self.nodes[k].div_ceil(self.stride[k]))
    }

    /// Number of cells.
    pub fn len(self) -> usize {
        self.counts().iter().product()
    }

    fn at(self, cell: usize) -> [usize; 2] {
        let across = self.counts()[1];
        [cell / across, cell % across]
    }

    /// The node in the middle of a cell, along and across.
    pub fn middle(self, cell: usize) -> [usize; 2] {
        let at = self.at(cell);
        [0, 1].map(|k| (at[k] * self.stride[k] + self.stride[k] / 2).min(self.nodes[k] - 1))
    }

    pub(super) fn span(self, cell: usize) -> Span {
        let at = self.at(cell);
        [0, 1].map(|k| {
            let [from, to] = [at[k], at[k] + 1].map(|cells| (cells * self.stride[k]) as f64 - 0.5);
            (from.max(0.0), to.min((self.nodes[k] - 1) as f64))
        })
    }

    /// The cells that are no dearer than those around them, the cheapest first.
    pub(super) fn valleys(self, looks: &[Look], most: usize) -> Vec<usize> {
        let counts = self.counts();
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let is_valley = |cell: &usize| {
            let [i, j] = self.at(*cell);
            let cost = looks[*cell].cost;
            let mut others = around(i, counts[0])
                .flat_map(|i| around(j, counts[1]).map(move |j| i * counts[1] + j))
                .filter(|other| other != cell);
            cost.is_finite()
                && others.all(|other| {
                    if other < *cell { looks[other].cost > cost } else { looks[other].cost >= cost }
                })
        };
        let mut valleys: Vec<usize> = (0..looks.len()).filter(is_valley).collect();
        valleys.sort_by(|a, b| looks[*a].cost.total_cmp(&looks[*b].cost));
        valleys.truncate(most);
        valleys
    }
}
