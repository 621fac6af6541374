//! Why there is no limit.

use crate::sensing::NoiseError;

/// Why a bench has no limit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// The surface has no model.
    #[error("a measured surface has no model, and without influence functions there is no limit to compute")]
    NoModel,
    /// The noise is singular, and the limit would be 0; or no sensor is alive.
    #[error(transparent)]
    Noise(#[from] NoiseError),
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
