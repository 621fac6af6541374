//! Influence functions of a plane with a model, and their inversion.

mod coarse;
mod confidence_region;
mod edges;
mod likelihood;
mod locator;
mod posterior;
mod search;
mod table;

pub use likelihood::PlateLikelihood;
pub use locator::{PlaneLocator, PlaneScratch};
pub use table::PlaneTable;

use super::config::{Influence, InfluenceFitError};
use super::learning::{LearntInfluence, NODES_EACH, learn};
use crate::fit::FitTask;
use palpate_mechanics::contact::Position;

pub(super) fn fit(config: Influence, task: FitTask) -> Result<PlaneLocator, InfluenceFitError> {
    if config.contacts > 1 {
        return Err(InfluenceFitError::NotOnPlane { what: "locating several contacts" });
    }
    let mut table = PlaneTable::empty(task.setup.layout().len(), task.setup.surface().extent());
    let places: Vec<Position> = (0..table.nodes()).map(|node| table.node(node)).collect();
    let fill = &mut |s: usize, learnt: &LearntInfluence| {
        for node in 0..table.nodes() {
            if node.is_multiple_of(NODES_EACH) {
                task.watch.round()?;
            }
            table.values[node * table.sensors + s] = learnt.mean(node);
            table.variances[node * table.sensors + s] = learnt.variance(node);
        }
        Ok(())
    };
    let channels = learn(config, task, &places, fill)?;
    Ok(PlaneLocator::new(table, channels, config.force_belief(task.setup)))
}

#[cfg(test)]
mod coverage;
#[cfg(test)]
mod tests;
