//! From presses to a table of influence functions.

use super::belief::ForceBelief;
use super::config::{InfluenceConfig, InfluenceSource};
use super::hyperparameters::{MOST_PRESSES, most_evident};
use super::locator::{BeamLocator, BeamParts};
use super::measured::MeasuredError;
use super::posterior::{Posterior, SensorPresses};
use super::presses::Presses;
use super::prior::{Mean, Prior, Remainders, Spread};
use super::table::InfluenceTable;
use crate::mechanics::Surface;
use crate::method::FitTask;
use crate::numerics::NotPositiveDefinite;
use crate::sensing::{Layout, SensorKind};

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
}

/// Fits the influence functions of a surface with a model; `None` when `keep_going` says no.
pub(super) fn fit_modelled(
    config: InfluenceConfig,
    task: FitTask,
    keep_going: &mut dyn FnMut() -> bool,
) -> Result<Option<BeamLocator>, InfluenceFitError> {
    let surface = task.bench.surface.model().ok_or(InfluenceFitError::NoModel)?;
    let layout = &task.bench.layout;
    check_sensors(layout)?;
    let presses = Presses::of(task.recording)?;
    let needed = if config.from == InfluenceSource::Recording { 3 } else { 1 };
    let found = presses.distinct_positions();
    if found < needed {
        return Err(InfluenceFitError::TooFewPositions { needed, found });
    }
    let mut parts = BeamParts {
        table: empty_table(layout.len(), surface.length_m()),
        offsets: vec![0.0; layout.len()],
        noise_sd: vec![0.0; layout.len()],
    };
    for kind in SensorKind::ALL {
        let members: Vec<usize> = (0..layout.len()).filter(|s| layout.sensors[*s].kind == kind).collect();
        if members.is_empty() {
            continue;
        }
        if !keep_going() {
            return Ok(None);
        }
        fill_kind(&mut parts, &members, config.from, surface, layout, &presses)?;
    }
    let dead = layout.sensors.iter().map(|sensor| sensor.channel.dead).collect();
    let force = match (task.bench.force_n, config.force_sd_n) {
        (None, _) => ForceBelief::Unknown,
        (Some(force_n), None) => ForceBelief::Known(force_n),
        (Some(mean_n), Some(sd_n)) => ForceBelief::Normal { mean_n, sd_n },
    };
    Ok(Some(BeamLocator::new(parts, dead, force, presses.mean_force_n(), config.contacts)))
}

fn check_sensors(layout: &Layout) -> Result<(), InfluenceFitError> {
    if let Some(raw) = layout.sensors.iter().position(|sensor| sensor.kind == SensorKind::Raw) {
        return Err(InfluenceFitError::RawSensor { sensor: raw + 1 });
    }
    if layout.sensors.iter().all(|sensor| sensor.channel.dead) {
        return Err(InfluenceFitError::AllDead { sensors: layout.len() });
    }
    Ok(())
}

fn empty_table(sensors: usize, length_m: f64) -> InfluenceTable {
    let zeros = vec![0.0; sensors * InfluenceTable::NODES];
    InfluenceTable { sensors, length_m, values: zeros.clone(), slopes: zeros.clone(), variances: zeros }
}

/// Fits the sensors of one kind, which share their spread, and fills their columns of the table.
fn fill_kind(
    parts: &mut BeamParts,
    members: &[usize],
    from: InfluenceSource,
    surface: &dyn Surface,
    layout: &Layout,
    presses: &Presses,
) -> Result<(), InfluenceFitError> {
    let mean = if from == InfluenceSource::Recording { Mean::Zero } else { Mean::Model };
    let kind = layout.sensors[members[0]].kind;
    let places = Places::new(&parts.table);
    let presses_m: Vec<f64> = presses.presses.iter().map(|press| press.x_m).collect();
    let remainders = Remainders::new(surface, kind, &presses_m, &places.0);
    let with = |s: usize, kept: &[usize]| {
        let prior = Prior::new(surface, &layout.sensors[s], mean);
        SensorPresses::new(prior, presses, s, presses.noise_variance(layout, s), kept, &remainders.presses)
    };
    let living: Vec<usize> = members.iter().copied().filter(|s| !layout.sensors[*s].channel.dead).collect();
    let all: Vec<usize> = (0..presses_m.len()).collect();
    let thinned: Vec<usize> = all.iter().copied().step_by(all.len().div_ceil(MOST_PRESSES)).collect();
    let searched: Vec<SensorPresses> = living.iter().map(|s| with(*s, &thinned)).collect();
    let noise_is_told = living.iter().all(|s| presses.noise_variance(layout, *s).is_some());
    let mut spread = most_evident(&searched, mean, surface.length_m(), noise_is_told);
    if from == InfluenceSource::Mechanics {
        spread = Spread { noise: spread.noise, ..Spread::NONE };
    }
    for s in living {
        let sensor = with(s, &all);
        let posterior = sensor
            .posterior(spread)
            .map_err(|problem| InfluenceFitError::Singular { sensor: s + 1, problem })?;
        parts.offsets[s] = posterior.offset();
        parts.noise_sd[s] = sensor.noise_variance(&spread).sqrt();
        places.fill(&mut parts.table, s, &posterior, &sensor.prior, &remainders);
    }
    for s in members.iter().filter(|s| layout.sensors[**s].channel.dead) {
        parts.noise_sd[*s] = 1.0;
    }
    Ok(())
}

/// Where a posterior is looked at: for each node, a little to its left, itself, a little to its right, in metres.
struct Places(Vec<f64>);

impl Places {
    fn new(table: &InfluenceTable) -> Self {
        let h = 1e-5 * table.length_m;
        let around = |x_m: f64| [(x_m - h).max(0.0), x_m, (x_m + h).min(table.length_m)];
        Self((0..table.nodes()).flat_map(|node| around(table.node_m(node))).collect())
    }

    /// Fills the column of sensor `s`.
    fn fill(
        &self,
        table: &mut InfluenceTable,
        s: usize,
        posterior: &Posterior,
        prior: &Prior,
        remainders: &Remainders,
    ) {
        for node in 0..table.nodes() {
            let [left, here, right] = [3 * node, 3 * node + 1, 3 * node + 2];
            let parts = [left, here, right].map(|place| prior.parts(self.0[place]));
            let mean = |i: usize| posterior.mean(parts[i], &remainders.places.row(left + i));
            let at = node * table.sensors + s;
            table.values[at] = mean(1);
            table.slopes[at] = (mean(2) - mean(0)) / (self.0[right] - self.0[left]);
            table.variances[at] =
                posterior.variance(parts[1], &remainders.places.row(here), remainders.own[here]);
        }
    }
}
