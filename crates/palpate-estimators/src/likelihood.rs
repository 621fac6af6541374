//! Likelihood of a reading given contacts, which a filter over time needs from a locator.

use crate::force_prior::ForceRange;
use crate::interval_check::IntervalCheck;
use crate::untouched_drift::UntouchedDrift;
use crate::untouched_scatter::UntouchedScatter;
use palpate_core::Estimate;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::surface::Extent;
use std::f64::consts::SQRT_2;

/// Variance of a contact that remains from calibration, and that further readings do not reduce.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CalibrationVariance {
    /// Covariance of the position, xx, xy and yy in m²; on a line xx alone.
    pub position_m2: [f64; 3],
    /// Variance of the force in N², where it is not known.
    pub force_n2: f64,
}

/// Scatter and drift of the untouched surface of a calibration.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct UntouchedSurface {
    pub scatter: Option<UntouchedScatter>,
    pub drift: Option<UntouchedDrift>,
}

impl UntouchedSurface {
    /// The untouched surface for a filter that itself tracks the drift. Where the random walk makes up most of the scatter, in units of the
    /// noise over all channels, the noise of two readings replaces the scatter. The walk of a single channel is too uncertain to be
    /// subtracted.
    pub fn beside_walk(
        scatter: Option<UntouchedScatter>,
        drift: Option<UntouchedDrift>,
        noise_sd: &[Option<f64>],
    ) -> Self {
        /// Share of the scatter that counts as most of it.
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
        Self { scatter, drift }
    }

    /// True for a reading within the scatter.
    pub fn contains(&self, reading: &[f64]) -> bool {
        self.scatter.as_ref().is_some_and(|scatter| scatter.contains(reading))
    }
}

/// A fitted method that gives the likelihood of contacts for a reading.
pub trait Likelihood: Send + Sync {
    /// The fits of contacts on this surface.
    fn geometry(&self) -> Geometry<'_>;

    /// Whitens a reading for the fits, and writes it over `whitened`.
    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>);

    /// Fit of the surface alone to a reading that [`Likelihood::whiten`] prepared, at u = `mode_n`; the unknown is u
    /// (see [`LineLikelihood`]), which a plane does not have.
    fn fit_nothing(&self, whitened: &[f64], mode_n: f64) -> ContactFit<1>;

    /// Signal-to-noise ratio of a contact in balance: the sum of (W·f)² over the noise's variance, of all channels.
    fn signal(&self, contact: Contact) -> f64;

    /// Variance of each contact that calibration leaves.
    fn calibration_variance(&self, contacts: &[Contact]) -> [CalibrationVariance; 2];

    /// Whitened reading of contacts in balance, with its derivatives and the variance that calibration leaves.
    fn linearised(&self, contacts: &[Contact]) -> Linearisation;

    /// Estimate from one reading alone, without those before it: the best contacts, and the other modes.
    fn single_estimate(&self, reading: &[f64]) -> Estimate;

    /// True for a reading within the residue that touches leave on an untouched surface.
    fn is_residue(&self, reading: &[f64]) -> bool;

    /// Check of the locator's 95 % intervals, which widens those of tracks.
    fn interval_check(&self) -> Option<&IntervalCheck>;

    /// Drift of the channels that the untouched rows of the calibration show.
    fn untouched_drift(&self) -> Option<&UntouchedDrift>;

    /// Extent of the surface.
    fn extent(&self) -> Extent;

    /// The force of every contact in newtons, where it is known exactly.
    fn known_force_n(&self) -> Option<f64>;

    /// Range of the forces of contacts where they are not known; `None` where they are.
    fn force_range(&self) -> Option<ForceRange>;

    /// The most contacts that may touch at once.
    fn most_contacts(&self) -> usize;
}

/// Whitened reading of contacts in balance, expanded about their places and forces.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearisation {
    /// Σ W·f of each channel.
    pub reading: Vec<f64>,
    /// Derivatives of that by x, y and W of each contact in turn; zeros by y on a line, and by a force that is known.
    pub derivatives: Vec<Vec<f64>>,
    /// Variance of each channel from calibration.
    pub variance: Vec<f64>,
}

/// Geometry of the contacts, on a line or on a plane, with the fits that go with that.
#[derive(Clone, Copy)]
pub enum Geometry<'a> {
    /// Contacts have one coordinate.
    Line(&'a dyn LineLikelihood),
    /// Contacts have two.
    Plane(&'a dyn PlaneLikelihood),
}

/// Likelihood of contacts on a line.
///
/// A vibrating surface is bent by the force u = m·ω²·q of its first mode. A surface in balance is bent by the contacts' share Σ W·φ(x)
/// instead, with φ the shape of the mode. So the vibrating surface reads Σ W·f(x) + (u − Σ W·φ(x))·g, with g the reading of the sensors per
/// newton of u. The faster modes are assumed to be in balance.
pub trait LineLikelihood {
    /// Fit of one contact; the unknowns are u, place and force. Without `mode_n` the surface is in balance.
    fn fit_one(&self, whitened: &[f64], contact: Contact, mode_n: Option<f64>) -> ContactFit<3>;

    /// Fit of two contacts; the unknowns are u, place and force of the first, place and force of the second.
    fn fit_two(&self, whitened: &[f64], contacts: [Contact; 2], mode_n: Option<f64>) -> ContactFit<5>;

    /// The first mode's shape φ at a place, and its slope per metre.
    fn first_mode(&self, x_m: f64) -> [f64; 2];
}

/// Likelihood of a contact on a plane in balance.
pub trait PlaneLikelihood {
    /// The unknowns are x, y and force.
    fn fit_on_plane(&self, whitened: &[f64], contact: Contact) -> ContactFit<3>;
}

/// The χ² of K unknowns and its second-order expansion about them, by Gauss and Newton: moved by δ it is about χ² − 2·gᵀδ + δᵀ·A·δ. The
/// log-likelihood is −χ²/2, up to a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactFit<const K: usize> {
    /// χ².
    pub misfit: f64,
    /// g, per unit of each unknown.
    pub score: [f64; K],
    /// A: the Fisher information of each pair of unknowns.
    pub information: [[f64; K]; K],
}

impl<const K: usize> ContactFit<K> {
    /// The fit to no data.
    pub const NOTHING: Self = Self { misfit: 0.0, score: [0.0; K], information: [[0.0; K]; K] };

    /// Adds a residual with its derivatives, the sign changed, and its weight; `information` only on and above its diagonal.
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

    /// Copies the upper triangle of the information to the lower one.
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
