//! Measured surface: readings learnt as a function of position and nuisance coordinate.
//!
//! The forward model is reading = f(position, nuisance) + noise, with f a Gaussian process. The nuisance
//! coordinate is recorded in the calibration and unknown in use, such as force or indentation depth. The
//! prior is uniform over the calibrated range and half a gap beyond; positions up to a whole gap beyond have
//! less weight. The posterior is
//!
//! p(position | reading) ∝ ∫ N(reading; f̄, C + v·S) d nuisance,
//!
//! with f̄ and v the process's mean and relative variance, S the signal covariance, C the noise covariance,
//! and N the normal density without its determinant. v is least at the presses: the determinant would draw
//! every estimate towards them. The estimate is the posterior mean.
//!
//! C follows from repeats, or from the process without repeats, scaled by the overdispersion at held-out
//! positions.

mod config;
mod curve;
mod fitting;
mod line;
mod locator;
mod presses;
mod scan;
mod table;

pub use config::{MeasuredError, MeasuredInfluence, Scale};
pub(crate) use fitting::{most_nodes, most_nuisance_nodes};
pub use locator::{MeasuredLocator, NuisanceRole};
pub use table::Table;

#[cfg(test)]
mod tests;
