//! Load profiles: how force is spread over a surface, from one reading.
//!
//! A load p(a) ≥ 0 is read as y_i = ∫ f_i(a)·p(a) da + noise, where f_i is the influence function of sensor i. BoundedList readings
//! do not tell a whole function, so p is sought among the non-negative ones that are as smooth as the reading allows:
//!
//! 1. p is a force in each of n cells ([`Cells`]); A holds each sensor's mean influence over each cell, in units of its noise.
//! 2. For a smoothness λ, x minimises ½·‖A·x − y‖² + ½·λ·xᵀP·x + μ·Σx over x ≥ 0, where xᵀP·x sums the squares of second
//!    differences (the bending energy on a plane), with no load beyond the edges, and μ = n/F makes the force of a cell
//!    exponentially distributed with mean F/n, of all non-negative distributions the least committed: load that hardly any
//!    sensor sees, as next to a support, is not invented.
//! 3. Smoothness is weighed by its evidence, the probability of the reading under it, in the Gaussian approximation on the
//!    cells that are not zero; profile and covariance are the mixture over all λ.
//! 4. Total force, centre of pressure and patches are functions of the mixture, their intervals by its covariance.
//!
//! The method is penalised non-negative least squares in Bayesian dress: MacKay, *Bayesian Interpolation*, Neural
//! Computation 4 (1992), for the evidence; Jaynes, *Prior Probabilities*, IEEE Trans. SSC 4 (1968), for the exponential prior.

mod cells;
mod load_sensors;
mod non_negative;
mod patch_limit;
mod patches;
mod profile;
mod resolution;
mod smoothness;

pub use cells::Cells;
pub use load_sensors::{LoadChannel, LoadSensors, LoadSensorsError};
pub use patch_limit::{PatchLimit, patch_limits};
pub use patches::{PATCH_SHARE, Patch};
pub use profile::{CentreOfPressure, LoadProfile, Profiler};
pub use resolution::Resolution;

#[cfg(test)]
mod tests;
