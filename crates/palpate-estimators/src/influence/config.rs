//! The settings of the influence estimator, what is known of a contact's force, and why a fit fails.

use super::measured::MeasuredError;
use crate::fit::ChannelMismatch;
use crate::setup::Setup;
use crate::status::FalseAlarmRate;
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::watch::Cancelled;
use serde::{Deserialize, Serialize};

/// The influence estimator: learn what each sensor reads as a function of the contact, and invert it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Source of the influence functions.
    pub source: InfluenceSource,
    /// The most contacts that may touch at once; 1 to 3.
    pub contacts: usize,
    /// Standard deviation of the contact's force about the bench's, in newtons, where it is known only roughly.
    pub force_sd_n: Option<f64>,
    /// Structure of the readings of a surface without a model.
    pub structure: Structure,
    /// Share of untouched readings that may be taken for a contact.
    pub false_alarm_rate: FalseAlarmRate,
}

/// Structure of the readings of a surface without a model, besides that they depend on the position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Structure {
    /// Force-linear where forces were recorded and the presses do not speak against it; free otherwise.
    #[default]
    Auto,
    /// Offset + force × influence of the position.
    ForceLinear,
    /// Offset + force × influence of the position, in channels that saturate: readings of hard presses fall short of proportion to the force.
    ForceSaturating,
    /// Offset + a power of the force, the same at all positions, × influence of the position.
    ForceMonotone,
    /// Any function of the position and of the nuisance coordinate, or of the force.
    Free,
}

impl Structure {
    /// The structures that a rig can state.
    pub const STATED: [Self; 4] = [Self::ForceLinear, Self::ForceSaturating, Self::ForceMonotone, Self::Free];
}

/// Source of influence functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InfluenceSource {
    /// From the recording alone, by splines that the supports hold.
    Recording,
    /// From the mechanics alone; the recording gives the noise.
    Mechanics,
    /// From the mechanics, corrected by the recording: gains, offsets, sensors beside their place, and a remainder.
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
    /// Knowledge of the force, by the setup and the settings.
    pub(super) fn force_belief(&self, setup: &Setup) -> ForceBelief {
        match (setup.force_n(), self.force_sd_n) {
            (None, _) => ForceBelief::Unknown,
            (Some(force_n), None) => ForceBelief::Known(force_n),
            (Some(mean_n), Some(sd_n)) => ForceBelief::Normal { mean_n, sd_n },
        }
    }
}

/// Knowledge of a contact's force before a reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ForceBelief {
    /// It is this, in newtons.
    Known(f64),
    /// Nothing, but that it presses.
    Unknown,
    /// It is about `mean_n` newtons, with standard deviation `sd_n`.
    Normal {
        /// Mean, in newtons.
        mean_n: f64,
        /// Standard deviation, in newtons.
        sd_n: f64,
    },
}

impl ForceBelief {
    /// Mean and precision (one over variance, in N⁻²) of the belief, where the force is not known exactly.
    pub(super) fn mean_and_precision(self) -> (f64, f64) {
        match self {
            Self::Known(force_n) => (force_n, f64::INFINITY),
            Self::Unknown => (0.0, 0.0),
            Self::Normal { mean_n, sd_n } => (mean_n, sd_n.powi(-2)),
        }
    }

    /// The force in newtons, where it is known exactly.
    pub(super) fn known_n(self) -> Option<f64> {
        if let Self::Known(force_n) = self { Some(force_n) } else { None }
    }

    /// The force by which the calibration's variances weigh before a reading, with `reference_n` that of the calibration.
    /// Offsets are as uncertain as influences at that force, so a softer touch counts as one of it.
    pub(super) fn weights_force_n(self, reference_n: f64) -> f64 {
        self.known_n().map_or(reference_n, |force_n| force_n.max(reference_n))
    }

    /// Whether its numbers can be used.
    pub(super) fn is_usable(self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match self {
            Self::Known(force_n) => positive(force_n),
            Self::Unknown => true,
            Self::Normal { mean_n, sd_n } => positive(mean_n) && positive(sd_n),
        }
    }
}

/// Error of fitting influence functions to a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InfluenceFitError {
    /// The equations of the surface have no solution that is in balance.
    #[error("the equations of the surface could not be solved: {error}; {help}", error = .0, help = .0.help())]
    Surface(#[from] palpate_mechanics::surface::Unsolvable),
    /// An error of the surface without a model.
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    /// The surface has no model.
    #[error("the surface is `measured`: it has no mechanics that influence functions could start from")]
    NoModel,
    /// A setting that only influence functions of a surface with a model have.
    #[error("the surface is `measured`: {what} needs a surface with mechanics, such as a beam")]
    NotOnMeasured {
        /// The setting.
        what: &'static str,
    },
    /// A setting that only a surface without a model has.
    #[error("the surface has a model with readings linear in the force; {what} is for `measured` surfaces")]
    OnlyOnMeasured {
        /// The setting.
        what: &'static str,
    },
    /// A structure by the force, of a recording without it.
    #[error(
        "the structures \"force-linear\" and \"force-monotone\" need the force of every row and at least two different forces; rows of force 0 count"
    )]
    NoForces,
    /// A setting that a plane does not have.
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
        /// Number of sensors.
        sensors: usize,
    },
    /// Presses that contradict each other so exactly that they cannot be weighed.
    #[error("the presses of sensor {sensor} cannot be weighted: {problem}")]
    Singular {
        /// Which, from 1.
        sensor: usize,
        /// The factorisation's error.
        problem: NotPositiveDefinite,
    },
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}
