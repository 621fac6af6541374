//! Inversion of readings over a grid of places: where a contact on a surface without a model was, and how sure that is.
//!
//! [`Explain`] tells how a reading depends on the place and on one latent number: the nuisance coordinate, the response to the force, or a
//! gain. All else is the same for every structure, on a line and on a plane: [`Cells`] are looked at from their middles, valleys are followed
//! down to their [`minima`], and the [`posterior`] is summed around them.

mod cells;
mod layers;
mod minima;
mod posterior;
mod quadrature;
mod tiles;

pub(super) use cells::{CellBlocks, Cells, Look, look_at_cells};
pub(super) use layers::{Layers, Slopes, Stencil};
pub(super) use posterior::{Inversion, Limits, ToldForce};
pub(super) use quadrature::FIVE_POINTS;

use super::grid::Axis;
use super::levenberg::{Equations, Unknowns};

/// Place as a reading sees it, whatever the latent number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Explained {
    /// The least squared residual, in variances.
    pub misfit: f64,
    /// −2·ln of the posterior density of the place, less a constant.
    pub cost: f64,
    /// Mean and variance of the latent number there.
    pub latent: f64,
    pub latent_variance: f64,
}

/// A reading with what contacts explain of it; positions along and across are in nodes from the first.
pub(super) trait Explain {
    /// The grid's axes.
    fn axes(&self) -> [Axis; 2];

    /// Cells.
    fn cells(&self) -> Cells;

    /// Lower bounds of what the middles of the cells cost, about, cell by cell.
    fn scan(&self, looks: &mut Vec<Look>);

    /// True where these bounds may be so far below the costs that they do not show every minimum that matters.
    fn bounds_are_loose(&self) -> bool;

    /// Greatest way of the reading, over the noise, from a node to the next along and across, for this latent number.
    fn lengths(&self, node: [usize; 2], latent: f64) -> [f64; 2];

    /// The latent number's least and greatest value; `None` where there is nothing to look for.
    fn range(&self) -> Option<(f64, f64)>;

    /// Takes the variances that readings have near a contact for the equations that follow.
    fn weigh(&mut self, near: Unknowns);

    /// The normal equations of a contact, with the variances of the contact weighed last.
    fn equations(&mut self, at: Unknowns) -> Equations;

    /// Score of a [spread](crate::spread) about a contact; 0 where contacts side by side do not read the sum of what each reads.
    fn spread(&mut self, at: Unknowns) -> f64;

    /// A place, the latent number integrated out; that is about `latent`.
    fn explain(&mut self, place: [f64; 2], latent: f64) -> Explained;

    /// Mean and variance of the force, from those of the latent number.
    fn force(&self, latent: f64, variance: f64) -> (f64, f64);
}
