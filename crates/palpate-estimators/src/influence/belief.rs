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

    /// The force in newtons, where it is known exactly.
    pub(super) fn known_n(self) -> Option<f64> {
        if let Self::Known(force_n) = self { Some(force_n) } else { None }
    }

    /// Numbers that a reading must tell: 1, the position, or 2, with the force.
    pub(super) fn unknowns(self) -> usize {
        if self.known_n().is_some() { 1 } else { 2 }
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
