//! Settings of the influence estimator, and errors of a fit.

pub use crate::force_prior::ForceBelief;

use super::measured::MeasuredError;
use crate::fit::ChannelMismatch;
use crate::setup::Setup;
use crate::status::FalseAlarmRate;
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::watch::Cancelled;
use serde::{Deserialize, Serialize};

/// Influence estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Source of the influence functions.
    pub source: InfluenceSource,
    /// Greatest number of simultaneous contacts, 1 to 3.
    pub contacts: usize,
    /// Prior standard deviation of the force about the bench's, in newtons.
    pub force_sd_n: Option<f64>,
    /// Structure of the readings of a surface without a model.
    pub structure: Structure,
    /// False-alarm rate of untouched readings.
    pub false_alarm_rate: FalseAlarmRate,
}

/// Dependence of readings on the force, on a surface without a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Structure {
    /// Force-linear where the evidence supports it; free otherwise.
    #[default]
    Auto,
    /// Offset + force × influence(position).
    ForceLinear,
    /// Force-linear, in channels that saturate: readings of hard presses fall short of proportion to the force.
    ForceSaturating,
    /// Offset + force^p × influence(position), with one exponent p.
    ForceMonotone,
    /// Any function of the position and of the nuisance coordinate or the force.
    Free,
}

impl Structure {
    /// Structures that a rig can state.
    pub const STATED: [Self; 4] = [Self::ForceLinear, Self::ForceSaturating, Self::ForceMonotone, Self::Free];
}

/// Source of influence functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InfluenceSource {
    /// The recording alone, by splines that satisfy the supports.
    Recording,
    /// The mechanics alone; the recording determines the noise.
    Mechanics,
    /// The mechanics, corrected by the recording: gains, offsets, shifted sensors and a remainder.
    Corrected,
}

impl Default for Influence {
    fn default() -> Self {
        Self {
            source: InfluenceSource::Corrected,
            contacts: 1,
            force_sd_n: None,
            structure: Structure::Auto,
            false_alarm_rate: FalseAlarmRate::DEFAULT,
        }
    }
}

impl Influence {
    pub(super) fn force_belief(&self, setup: &Setup) -> ForceBelief {
        match (setup.force_n(), self.force_sd_n) {
            (None, _) => ForceBelief::Unknown,
            (Some(force_n), None) => ForceBelief::Known(force_n),
            (Some(mean_n), Some(sd_n)) => ForceBelief::Normal { mean_n, sd_n },
        }
    }
}

/// Error of fitting influence functions to a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InfluenceFitError {
    /// The equations of the surface have no solution in equilibrium.
    #[error("the equations of the surface could not be solved: {error}; {help}", error = .0, help = .0.help())]
    Surface(#[from] palpate_mechanics::surface::Unsolvable),
    /// Error of a surface without a model.
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    /// The surface has no model.
    #[error("the surface is `measured`: it has no mechanics that influence functions could start from")]
    NoModel,
    /// A setting that requires a surface with a model.
    #[error("the surface is `measured`: {what} needs a surface with mechanics, such as a beam")]
    NotOnMeasured {
        /// The setting.
        what: &'static str,
    },
    /// A setting for surfaces without a model only.
    #[error("the surface has a model with readings linear in the force; {what} is for `measured` surfaces")]
    OnlyOnMeasured {
        /// The setting.
        what: &'static str,
    },
    /// A force structure for a recording without forces.
    #[error(
        "the structures \"force-linear\" and \"force-monotone\" need the force of every row and at least two different forces; rows of force 0 count"
    )]
    NoForces,
    /// A setting that requires a line.
    #[error("the surface is a plane: {what} works on a line, such as a beam, only")]
    NotOnPlane {
        /// The setting.
        what: &'static str,
    },
    /// A raw channel, which no model predicts.
    #[error("sensor {sensor} is a raw channel, which no mechanics explains")]
    RawSensor {
        /// Number of the sensor, from 1.
        sensor: usize,
    },
    /// A row without a positive force.
    #[error(
        "row {row} of the recording has no force greater than 0; influence functions are readings per newton: give [contact] force, or a force column"
    )]
    NoForce {
        /// Number of the row, from 1.
        row: usize,
    },
    /// Fewer distinct positions than parameters.
    #[error("the recording has {found} distinct positions; influence functions need at least {needed}")]
    TooFewPositions {
        /// Required positions.
        needed: usize,
        /// Positions of the recording.
        found: usize,
    },
    /// All sensors are disabled.
    #[error("all {sensors} sensors are dead; at least 1 must live")]
    AllDead {
        /// Number of sensors.
        sensors: usize,
    },
    /// A singular covariance of a sensor's calibration rows.
    #[error("the presses of sensor {sensor} cannot be weighted: {problem}")]
    Singular {
        /// Number of the sensor, from 1.
        sensor: usize,
        /// Error of the factorization.
        problem: NotPositiveDefinite,
    },
    /// The recording's channels differ from the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}
