//! Knowledge of the contact force of a locator with a model.

use serde::{Deserialize, Serialize};

/// Prior of a contact's force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ForceBelief {
    /// Known force, in newtons.
    Known(f64),
    /// Unknown positive force.
    Unknown,
    /// Normal prior.
    Normal {
        /// Mean, in newtons.
        mean_n: f64,
        /// Standard deviation, in newtons.
        sd_n: f64,
    },
}

impl ForceBelief {
    /// Mean in N and precision in N⁻², infinite for a known force.
    pub(crate) fn mean_and_precision(self) -> (f64, f64) {
        match self {
            Self::Known(force_n) => (force_n, f64::INFINITY),
            Self::Unknown => (0.0, 0.0),
            Self::Normal { mean_n, sd_n } => (mean_n, sd_n.powi(-2)),
        }
    }

    pub(crate) fn known_n(self) -> Option<f64> {
        if let Self::Known(force_n) = self { Some(force_n) } else { None }
    }

    /// Force of the calibration's variances in the coarse search; offsets remain uncertain at smaller forces.
    pub(crate) fn weights_force_n(self, reference_n: f64) -> f64 {
        self.known_n().map_or(reference_n, |force_n| force_n.max(reference_n))
    }

    pub(crate) fn is_usable(self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match self {
            Self::Known(force_n) => positive(force_n),
            Self::Unknown => true,
            Self::Normal { mean_n, sd_n } => positive(mean_n) && positive(sd_n),
        }
    }
}
