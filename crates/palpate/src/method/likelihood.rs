//! How probable a reading is at a contact: what a filter over time asks of a locator.

use crate::contact::Contact;
use palpate_core::Estimate;

/// A fitted method that can say how well a contact explains a reading, on a one-dimensional surface.
pub trait Likelihood: Send + Sync {
    /// A reading as [`Likelihood::fit_at`] wants it, written over `whitened`; the misfit |d|² of no contact at all.
    fn whiten(&self, reading: &[f64], whitened: &mut Vec<f64>) -> f64;

    /// How a contact explains a reading that [`Likelihood::whiten`] prepared. With `inertia_m2` = v²/ω² the surface swings
    /// under a contact of speed v, ω its first natural angular frequency, and reads f − inertia_m2·f″ per newton instead of
    /// f: to first order it lags behind its static shape by that shape's own acceleration over ω².
    fn fit_at(&self, whitened: &[f64], contact: Contact, inertia_m2: f64) -> ContactFit;

    /// The contacts that explain a reading by itself: the best estimate, and its other modes.
    fn locate_alone(&self, reading: &[f64]) -> Estimate;

    /// Length of the surface, in metres.
    fn length_m(&self) -> f64;

    /// The force of every contact in newtons, where it is known exactly.
    fn known_force_n(&self) -> Option<f64>;
}

/// The misfit χ² of a contact and its second-order expansion about it, by Gauss and Newton: moved by δ in (position,
/// force), it is about χ² − 2·gᵀδ + δᵀ·A·δ. The log-likelihood is −χ²/2, up to what is the same for every contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactFit {
    /// χ².
    pub misfit: f64,
    /// g, per metre and per newton.
    pub pull: [f64; 2],
    /// A: the Fisher information of position, of both, and of force, in m⁻², m⁻¹N⁻¹ and N⁻².
    pub information: [f64; 3],
    /// Variance of the position, in m², that calibration leaves and no further reading takes away.
    pub calibration_m2: f64,
}
