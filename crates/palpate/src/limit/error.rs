//! Why there is no limit.

use crate::sensing::SensorKind;

/// Why a bench has no limit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// The surface has no model.
    #[error("a measured surface has no model, and without influence functions there is no limit to compute")]
    NoModel,
    /// A live sensor has neither noise nor resolution: the noise is singular, and the limit would be 0.
    #[error(
        "sensor {number} ({kind}) has noise {noise_sd} and resolution {resolution}; one of them must be greater than 0, or \
         nothing limits what it tells"
    )]
    SingularNoise {
        /// Which sensor, from 1.
        number: usize,
        /// What it measures.
        kind: SensorKind,
        /// Standard deviation of its noise, in its SI unit.
        noise_sd: f64,
        /// Its quantisation step, in its SI unit.
        resolution: f64,
    },
    /// Every channel is dead.
    #[error("all {count} sensors are dead; at least 1 must be alive")]
    AllDead {
        /// How many sensors there are.
        count: usize,
    },
    /// The contact force is not a positive, finite number.
    #[error("the contact force is {force_n} N; it must be greater than 0 and finite")]
    Force {
        /// The force, in newtons.
        force_n: f64,
    },
    /// The force is nowhere given.
    #[error("the limit depends on the contact force, and none is given")]
    NoForce,
    /// Too few or too many positions.
    #[error("the limit is asked for at {count} positions; there must be at least 1 and at most {most}")]
    Positions {
        /// How many there would be.
        count: f64,
        /// The most.
        most: usize,
    },
}
