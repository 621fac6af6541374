//! From presses to a table of influence functions over a plane.

use super::locator::PlaneLocator;
use super::table::PlaneTable;
use crate::fit::FitTask;
use crate::influence::Influence;
use crate::influence::fitting::{InfluenceFitError, dead, force_belief};
use crate::influence::learning::{Learnt, learn};
use palpate_mechanics::contact::Position;

/// Fits the influence functions of a plane with a model.
pub(in crate::influence) fn fit_plane(
    config: Influence,
    task: FitTask,
) -> Result<PlaneLocator, InfluenceFitError> {
    if config.contacts > 1 {
        return Err(InfluenceFitError::NotOnPlane { what: "telling several contacts apart" });
    }
    let mut table = PlaneTable::empty(task.setup.layout.len(), task.setup.surface.extent());
    let places: Vec<Position> = (0..table.nodes()).map(|node| table.node(node)).collect();
    let fill = &mut |s: usize, learnt: &Learnt| {
        for node in 0..table.nodes() {
            table.values[node * table.sensors + s] = learnt.mean(node);
            table.variances[node * table.sensors + s] = learnt.variance(node);
        }
    };
    let channels = learn(config.from, task, &places, fill)?;
    Ok(PlaneLocator::new(table, channels, dead(task.setup), force_belief(config, task.setup)))
}
