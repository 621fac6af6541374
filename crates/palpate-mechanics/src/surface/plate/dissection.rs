//! Nested dissection (George, *Nested dissection of a regular finite element mesh*, 1973).

use std::collections::HashMap;

const LEAF_NODES: usize = 12;

#[derive(Clone, Copy)]
struct Block {
    columns: (usize, usize),
    rows: (usize, usize),
}

pub(super) fn nested_dissection(columns: usize, rows: usize) -> Vec<(usize, usize)> {
    let mut order = Vec::with_capacity(columns * rows);
    dissect(Block { columns: (0, columns), rows: (0, rows) }, &mut order);
    order
}

fn dissect(block: Block, order: &mut Vec<(usize, usize)>) {
    let Block { columns, rows } = block;
    let (wide, high) = (columns.1 - columns.0, rows.1 - rows.0);
    if wide * high <= LEAF_NODES {
        order
            .extend((rows.0..rows.1).flat_map(|row| (columns.0..columns.1).map(move |column| (column, row))));
    } else if wide >= high {
        let line = columns.0 + wide / 2;
        dissect(Block { columns: (columns.0, line), rows }, order);
        dissect(Block { columns: (line + 1, columns.1), rows }, order);
        order.extend((rows.0..rows.1).map(|row| (line, row)));
    } else {
        let line = rows.0 + high / 2;
        dissect(Block { columns, rows: (rows.0, line) }, order);
        dissect(Block { columns, rows: (line + 1, rows.1) }, order);
        order.extend((columns.0..columns.1).map(|column| (column, line)));
    }
}

/// Upper bound of node pairs in the factor; a float, as meshes may be too large.
pub(super) fn coupled_pairs(columns: usize, rows: usize) -> f64 {
    Couplings::default().count(BlockShape {
        wide: columns,
        high: rows,
        left: 0,
        right: 0,
        below: 0,
        above: 0,
    })
}

/// Size of a block, and 1 for each side with neighbours.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct BlockShape {
    wide: usize,
    high: usize,
    left: usize,
    right: usize,
    below: usize,
    above: usize,
}

impl BlockShape {
    fn surrounding_nodes(self) -> usize {
        let Self { wide, high, left, right, below, above } = self;
        (wide + left + right) * (high + below + above) - wide * high
    }
}

#[derive(Default)]
struct Couplings(HashMap<BlockShape, f64>);

impl Couplings {
    fn count(&mut self, block: BlockShape) -> f64 {
        if let Some(pairs) = self.0.get(&block) {
            return *pairs;
        }
        let BlockShape { wide, high, .. } = block;
        let pairs = if wide * high <= LEAF_NODES {
            eliminated(wide * high, block.surrounding_nodes())
        } else if wide >= high {
            let line = wide / 2;
            self.count(BlockShape { wide: line, right: 1, ..block })
                + self.count(BlockShape { wide: wide - line - 1, left: 1, ..block })
                + eliminated(high, block.surrounding_nodes())
        } else {
            let line = high / 2;
            self.count(BlockShape { high: line, above: 1, ..block })
                + self.count(BlockShape { high: high - line - 1, below: 1, ..block })
                + eliminated(wide, block.surrounding_nodes())
        };
        self.0.insert(block, pairs);
        pairs
    }
}

fn eliminated(nodes: usize, around: usize) -> f64 {
    let (nodes, around) = (nodes as f64, around as f64);
    nodes * (nodes + 1.0) / 2.0 + nodes * around
}
