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

pub(super) fn fit(config: Influence, task: FitTask) -> Result<BeamLocator, InfluenceFitError> {
    let mut table =
        InfluenceTable::empty(task.setup.layout().len(), task.setup.surface().extent().length_m());
    let around = around_nodes(&table);
    let fill = &mut |s: usize, learnt: &LearntInfluence| {
        for node in 0..table.nodes() {
            if node.is_multiple_of(NODES_EACH) {
                task.watch.round()?;
            }
            let [left, here, right] = [3 * node, 3 * node + 1, 3 * node + 2];
            let (rise, run_m) =
                (learnt.mean(right) - learnt.mean(left), around[right].x_m - around[left].x_m);
            let at = node * table.sensors + s;
            table.values[at] = learnt.mean(here);
            table.slopes[at] = rise / run_m;
            table.variances[at] = learnt.variance(here);
        }
        Ok(())
    };
    let channels = learn(config, task, &around, fill)?;
    Ok(BeamLocator::new(table, channels, config.force_belief(task.setup), config.contacts))
}

/// Places to the left of each node, at it, and to the right.
fn around_nodes(table: &InfluenceTable) -> Vec<Position> {
    let h = 1e-5 * table.length_m;
    let around = |x_m: f64| [(x_m - h).max(0.0), x_m, (x_m + h).min(table.length_m)];
    (0..table.nodes()).flat_map(|node| around(table.node_m(node))).map(Position::along).collect()
}

#[cfg(test)]
mod tests;
