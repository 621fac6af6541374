//! Influence functions of a line with a model, and their inversion for one contact or several.

mod coarse;
mod gauss_newton;
mod likelihood;
mod locator;
mod multi_contact;
mod posterior;
mod search;
mod spread;
mod table;

pub use likelihood::BeamLikelihood;
pub use locator::BeamLocator;
pub use search::Scratch;
pub use table::{FittedInfluence, InfluenceTable};

use super::config::{Influence, InfluenceFitError};
use super::learning::{LearntInfluence, NODES_EACH, learn};
use crate::fit::FitTask;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, Sensor};
use palpate_numerics::mean;

pub(super) fn fit(config: Influence, task: FitTask) -> Result<BeamLocator, InfluenceFitError> {
    let layout = task.setup.layout();
    let mut table = InfluenceTable::empty(layout.len(), task.setup.surface().extent().length_m());
    let places = Places::new(&table, layout);
    let fill = &mut |s: usize, learnt: &LearntInfluence| {
        for node in 0..table.nodes() {
            if node.is_multiple_of(NODES_EACH) {
                task.watch.round()?;
            }
            let at = node * table.sensors + s;
            table.values[at] = learnt.mean(Places::of_node(node));
            table.slopes[at] = places.slope(node, learnt);
            table.variances[at] = learnt.variance(Places::of_node(node));
        }
        for (side, nodes) in cells_beside(&table, &layout.sensors()[s]).into_iter().enumerate() {
            let square = places.square_error(s, side, &table, learnt);
            for node in nodes {
                table.variances[node * table.sensors + s] += square;
            }
        }
        Ok(())
    };
    let channels = learn(config, task, &places.all, fill)?;
    Ok(BeamLocator::new(table, channels, config.force_belief(task.setup), config.contacts))
}

/// Nodes of the cells on both sides of the node next to a sensor, where a strain sensor's influence function
/// has a kink.
fn cells_beside(table: &InfluenceTable, sensor: &Sensor) -> [[usize; 2]; 2] {
    let node = table.nearest_node(sensor.position.x_m).clamp(1, table.nodes() - 2);
    [[node - 1, node], [node, node + 1]]
}

/// Places of learnt influence functions: beside each node and at it, then within the cells beside each sensor.
struct Places {
    all: Vec<Position>,
}

impl Places {
    /// Fractions of a cell.
    const WITHIN: [f64; 3] = [0.25, 0.5, 0.75];

    fn new(table: &InfluenceTable, layout: &Layout) -> Self {
        let beside_m = 1e-5 * table.length_m;
        let around = |node: usize| [-beside_m, 0.0, beside_m].map(|way_m| table.node_m(node) + way_m);
        let mut all_m: Vec<f64> = (0..table.nodes()).flat_map(around).collect();
        for [left, _] in layout.sensors().iter().flat_map(|sensor| cells_beside(table, sensor)) {
            all_m.extend(Self::WITHIN.map(|part| table.node_m(left) + part * table.spacing_m()));
        }
        let along = |x_m: f64| Position::along(x_m.clamp(0.0, table.length_m));
        Self { all: all_m.into_iter().map(along).collect() }
    }

    const fn of_node(node: usize) -> usize {
        3 * node + 1
    }

    fn slope(&self, node: usize, learnt: &LearntInfluence) -> f64 {
        let [left, right] = [Self::of_node(node) - 1, Self::of_node(node) + 1];
        (learnt.mean(right) - learnt.mean(left)) / (self.all[right].x_m - self.all[left].x_m)
    }

    /// Mean square of the interpolation errors in the cell on one side of a sensor.
    fn square_error(
        &self,
        sensor: usize,
        side: usize,
        table: &InfluenceTable,
        learnt: &LearntInfluence,
    ) -> f64 {
        let first = 3 * table.nodes() + Self::WITHIN.len() * (2 * sensor + side);
        mean((first..first + Self::WITHIN.len()).map(|place| {
            let (value, _) = table.value_and_slope(&table.cell(self.all[place].x_m), sensor);
            (learnt.mean(place) - value).powi(2)
        }))
    }
}

#[cfg(test)]
mod tests;
