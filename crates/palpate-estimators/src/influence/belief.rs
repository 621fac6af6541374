//! What is known of a contact's force before a reading.

use serde::{Deserialize, Serialize};

/// What is known of the force of a contact.
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

    /// Numbers that a reading must tell: 1, the position, or 2, with the force.
    pub(super) fn unknowns(self) -> usize {
        if matches!(self, Self::Known(_)) { 1 } else { 2 }
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
