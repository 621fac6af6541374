//! Likelihood of a reading, for filters over time.

use crate::force_prior::ForceRange;
use crate::interval_check::IntervalCheck;
use crate::untouched_drift::UntouchedDrift;
use crate::untouched_scatter::UntouchedScatter;
use palpate_core::Estimate;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::surface::Extent;
use std::f64::consts::SQRT_2;

/// Variance from calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrationVariance {
    /// Position covariance xx, xy, yy; on a line xx.
    pub position_m2: [f64; 3],
    /// Variance of an unknown force.
    pub force_n2: f64,
}

/// Scatter and drift of untouched rows, and coverage of intervals, by a locator's recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LocatorChecks {
    scatter: Option<UntouchedScatter>,
    drift: Option<UntouchedDrift>,
    intervals: Option<IntervalCheck>,
}

impl LocatorChecks {
    /// Where a tracked walk dominates the scatter, the noise of two readings replaces it; walks of single
    /// channels are too uncertain to subtract.
    pub fn without_walk(
        scatter: Option<UntouchedScatter>,
        drift: Option<UntouchedDrift>,
        noise_sd: &[Option<f64>],
    ) -> Self {
        const MOST: f64 = 0.5;
        let walks = drift.as_ref().map(UntouchedDrift::walk_variances).unwrap_or_default();
        let scatter = scatter.map(|mut scatter| {
            let in_noise = |variances: &mut dyn Iterator<Item = f64>| -> f64 {
                variances
                    .zip(noise_sd)
                    .map(|(variance, noise)| noise.map_or(0.0, |sd| variance / (sd * sd)))
                    .sum()
            };
            let by_walk = in_noise(&mut walks.iter().copied());
            if by_walk > MOST * in_noise(&mut scatter.sd.iter().map(|sd| sd * sd)) {
                scatter.sd = noise_sd.iter().map(|sd| SQRT_2 * sd.unwrap_or(0.0)).collect();
            }
            scatter
        });
        Self { scatter, drift, intervals: None }
    }

    /// Replaces the interval check.
    #[must_use]
    pub fn with_intervals(self, intervals: Option<IntervalCheck>) -> Self {
        Self { intervals, ..self }
    }
}

/// Fitted method with a likelihood of contacts.
pub trait Likelihood: Send + Sync {
    /// Fits of contacts.
    fn geometry(&self) -> Geometry<'_>;

    /// Whitens a reading into `whitened`.
    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>);

    /// Fits the surface without contacts at u = `mode_n` (see [`LineLikelihood`]).
    fn fit_untouched(&self, whitened: &[f64], mode_n: f64) -> ContactFit<1>;

    /// Returns Σ (W·f)²/σ² of a contact in balance.
    fn signal(&self, contact: Contact) -> f64;

    /// Returns the variance of each contact from calibration.
    fn calibration_variance(&self, contacts: &[Contact]) -> [CalibrationVariance; 2];

    /// Linearizes the whitened reading in balance.
    fn linearised(&self, contacts: &[Contact]) -> Linearisation;

    /// Estimates contacts from one reading.
    fn single_estimate(&self, reading: &[f64]) -> Estimate;

    /// Checks of the locator; `None` without any.
    fn checks(&self) -> Option<&LocatorChecks> {
        None
    }

    /// True within the residue of touches.
    fn is_residue(&self, reading: &[f64]) -> bool {
        self.checks()
            .and_then(|checks| checks.scatter.as_ref())
            .is_some_and(|scatter| scatter.contains(reading))
    }

    /// Interval check.
    fn interval_check(&self) -> Option<&IntervalCheck> {
        self.checks()?.intervals.as_ref()
    }

    /// Drift of untouched rows.
    fn untouched_drift(&self) -> Option<&UntouchedDrift> {
        self.checks()?.drift.as_ref()
    }

    /// Extent of the surface.
    fn extent(&self) -> Extent;

    /// Ranges of tracked positions along and across, in metres.
    fn position_ranges_m(&self) -> [(f64, f64); 2] {
        let extent = self.extent();
        [(0.0, extent.length_m()), (0.0, extent.width_m().unwrap_or(0.0))]
    }

    /// Known force of contacts.
    fn known_force_n(&self) -> Option<f64>;

    /// Range of unknown forces.
    fn force_range(&self) -> Option<ForceRange>;

    /// Limit of simultaneous contacts.
    fn most_contacts(&self) -> usize;
}

/// Linearized whitened reading of contacts in balance.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearisation {
    /// Σ W·f of each channel.
    pub reading: Vec<f64>,
    /// Derivatives by x, y and W of each contact; 0 for fixed ones.
    pub derivatives: Vec<Vec<f64>>,
    /// Variance of each channel from calibration.
    pub variance: Vec<f64>,
}

/// Fits by the geometry of contacts.
#[derive(Clone, Copy)]
pub enum Geometry<'a> {
    /// One coordinate.
    Line(&'a dyn LineLikelihood),
    /// Two coordinates.
    Plane(&'a dyn PlaneLikelihood),
}

/// Likelihood of contacts on a line.
///
/// A vibrating surface is bent by u = m·ω²·q of its first mode, of shape φ, in place of Σ W·φ(x). It reads Σ
/// W·f(x) + (u − Σ W·φ(x))·g, with g per newton of u and higher modes in balance.
pub trait LineLikelihood {
    /// Fits u, position and force; in balance without `mode_n`.
    fn fit_one(&self, whitened: &[f64], contact: Contact, mode_n: Option<f64>) -> ContactFit<3>;

    /// Fits u, positions and forces of two contacts.
    fn fit_two(&self, whitened: &[f64], contacts: [Contact; 2], mode_n: Option<f64>) -> ContactFit<5>;

    /// Returns the first mode φ and its slope.
    fn first_mode(&self, x_m: f64) -> [f64; 2];
}

/// Likelihood of a contact on a plane.
pub trait PlaneLikelihood {
    /// Fits x, y and force.
    fn fit_on_plane(&self, whitened: &[f64], contact: Contact) -> ContactFit<3>;
}

/// χ² of K unknowns, about χ² − 2·gᵀδ + δᵀ·A·δ (Gauss–Newton); −χ²/2 is the log-likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactFit<const K: usize> {
    /// χ².
    pub misfit: f64,
    /// g.
    pub score: [f64; K],
    /// Fisher information A.
    pub information: [[f64; K]; K],
}

impl<const K: usize> ContactFit<K> {
    /// Fit to no data.
    pub const NOTHING: Self = Self { misfit: 0.0, score: [0.0; K], information: [[0.0; K]; K] };

    /// Adds a weighted residual and its negative derivatives, to the upper triangle.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "as the formula has its indices")]
    pub fn add(&mut self, residual: f64, derivatives: &[f64; K], weight: f64) {
        self.misfit += weight * residual * residual;
        for i in 0..K {
            let weighed = weight * derivatives[i];
            self.score[i] += weighed * residual;
            for j in i..K {
                self.information[i][j] += weighed * derivatives[j];
            }
        }
    }

    /// Copies the upper triangle to the lower.
    #[must_use]
    pub fn mirrored(mut self) -> Self {
        for i in 0..K {
            for j in 0..i {
                self.information[i][j] = self.information[j][i];
            }
        }
        self
    }
}
