//! Inversion of readings over a grid of places on a surface without a model.
//!
//! [`ContactLikelihood`] models how a reading depends on the place and on one latent number: a nuisance coordinate, a
//! response to the force, or a gain. All structures share [`Cells`], [`minima`] and [`posterior`].

mod cells;
mod layers;
mod minima;
mod posterior;
mod quadrature;
mod tiles;

pub(super) use cells::{CellBlocks, CellFit, Cells, fit_cells};
pub(super) use layers::{Layers, Slopes, Stencil};
pub(super) use posterior::{ForceKnowledge, Inversion, Limits};
pub(super) use quadrature::FIVE_POINTS;

use super::grid::Axis;
use super::levenberg::{Equations, Unknowns};

/// Fit of a reading at a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceFit {
    /// Least χ².
    pub misfit: f64,
    /// −2·ln of the posterior density, less a constant.
    pub cost: f64,
    pub latent: f64,
    pub latent_variance: f64,
}

/// Likelihood of a reading; positions are in nodes.
pub(super) trait ContactLikelihood {
    fn axes(&self) -> [Axis; 2];

    fn cells(&self) -> Cells;

    /// Approximate lower bounds of the costs of all cells.
    fn scan(&self, fits: &mut Vec<CellFit>);

    /// True where minima may be missing from these bounds.
    fn bounds_are_loose(&self) -> bool;

    /// Greatest change of the reading, in standard deviations, to the next node.
    fn lengths(&self, node: [usize; 2], latent: f64) -> [f64; 2];

    /// Range of the latent number; `None` where it is fixed.
    fn range(&self) -> Option<(f64, f64)>;

    /// Sets the variances of later normal equations to those at `near`.
    fn weigh(&mut self, near: Unknowns);

    fn equations(&mut self, at: Unknowns) -> Equations;

    /// [Distributed-contact](crate::spread) score; 0 where readings are not additive.
    fn spread(&mut self, at: Unknowns) -> f64;

    /// Fits a place, integrated over the latent number near `latent`.
    fn fit_place(&mut self, place: [f64; 2], latent: f64) -> PlaceFit;

    /// Mean and variance of the force for those of the latent number.
    fn force(&self, latent: f64, variance: f64) -> (f64, f64);
}
