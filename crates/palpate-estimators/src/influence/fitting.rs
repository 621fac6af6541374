//! Why a fit fails; and from presses to a table of influence functions along a line.

use super::belief::ForceBelief;
use super::channels::Channels;
use super::config::Influence;
use super::learning::{Learnt, learn};
use super::locator::{BeamLocator, BeamParts};
use super::measured::MeasuredError;
use super::table::InfluenceTable;
use crate::fit::{ChannelMismatch, FitTask};
use crate::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::watch::Cancelled;

/// Why influence functions cannot be fitted to a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InfluenceFitError {
    /// What a surface without a model has to say.
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    /// The surface has no model.
    #[error("the surface is `measured`: it has no mechanics that influence functions could start from")]
    NoModel,
    /// What only influence functions of a surface with a model can do.
    #[error("the surface is `measured`: {what} needs a surface with mechanics, such as a beam")]
    NotOnMeasured {
        /// The setting.
        what: &'static str,
    },
    /// What is not done on a plane.
    #[error("the surface is a plane: {what} works on a line, such as a beam, only")]
    NotOnPlane {
        /// The setting.
        what: &'static str,
    },
    /// A sensor that no model explains.
    #[error("sensor {sensor} is a raw channel, which no mechanics explains")]
    RawSensor {
        /// Which, from 1.
        sensor: usize,
    },
    /// A press whose force is not known.
    #[error(
        "row {row} of the recording has no force greater than 0; influence functions are readings per newton: give [contact] force, or a force column"
    )]
    NoForce {
        /// Which row, from 1.
        row: usize,
    },
    /// Fewer distinct positions than there are numbers to find.
    #[error("the recording has {found} distinct positions; influence functions need at least {needed}")]
    TooFewPositions {
        /// Positions that are needed.
        needed: usize,
        /// Positions of the recording.
        found: usize,
    },
    /// Every sensor is dead.
    #[error("all {sensors} sensors are dead; at least 1 must live")]
    AllDead {
        /// How many there are.
        sensors: usize,
    },
    /// Presses that contradict each other so exactly that they cannot be weighed.
    #[error("the presses of sensor {sensor} cannot be weighed against each other: {problem}")]
    Singular {
        /// Which, from 1.
        sensor: usize,
        /// What failed.
        problem: NotPositiveDefinite,
    },
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Fits the influence functions of a one-dimensional surface with a model.
pub(super) fn fit_modelled(config: Influence, task: FitTask) -> Result<BeamLocator, InfluenceFitError> {
    let sensors = task.setup.layout.len();
    let mut table = empty_table(sensors, task.setup.surface.extent().length_m());
    let places = around_nodes(&table);
    let fill = &mut |s: usize, learnt: &Learnt| fill(&mut table, s, learnt, &places);
    let channels = learn(config.from, task, &places, fill)?;
    let Channels { offsets, noise_sd, reference_force_n } = channels;
    let parts = BeamParts { table, offsets, noise_sd };
    let force = force_belief(config, task.setup);
    Ok(BeamLocator::new(parts, dead(task.setup), force, reference_force_n, config.contacts))
}

/// What a bench and the settings say of the force.
pub(super) fn force_belief(config: Influence, setup: &Setup) -> ForceBelief {
    match (setup.force_n, config.force_sd_n) {
        (None, _) => ForceBelief::Unknown,
        (Some(force_n), None) => ForceBelief::Known(force_n),
        (Some(mean_n), Some(sd_n)) => ForceBelief::Normal { mean_n, sd_n },
    }
}

/// Which channels are dead.
pub(super) fn dead(setup: &Setup) -> Vec<bool> {
    setup.layout.sensors.iter().map(|sensor| sensor.channel.dead).collect()
}

fn empty_table(sensors: usize, length_m: f64) -> InfluenceTable {
    let zeros = vec![0.0; sensors * InfluenceTable::NODES];
    InfluenceTable { sensors, length_m, values: zeros.clone(), slopes: zeros.clone(), variances: zeros }
}

/// For each node a little to its left, itself, a little to its right.
fn around_nodes(table: &InfluenceTable) -> Vec<Position> {
    let h = 1e-5 * table.length_m;
    let around = |x_m: f64| [(x_m - h).max(0.0), x_m, (x_m + h).min(table.length_m)];
    (0..table.nodes()).flat_map(|node| around(table.node_m(node))).map(Position::along).collect()
}

/// Fills the column of sensor `s` from its influence around the nodes.
fn fill(table: &mut InfluenceTable, s: usize, learnt: &Learnt, around: &[Position]) {
    for node in 0..table.nodes() {
        let [left, here, right] = [3 * node, 3 * node + 1, 3 * node + 2];
        let at = node * table.sensors + s;
        table.values[at] = learnt.mean(here);
        table.slopes[at] = (learnt.mean(right) - learnt.mean(left)) / (around[right].x_m - around[left].x_m);
        table.variances[at] = learnt.variance(here);
    }
}
