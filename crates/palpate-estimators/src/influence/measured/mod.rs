//! Measured surface: readings learnt as a function of position and nuisance coordinate.
//!
//! reading = f(position, nuisance) + noise, with f a Gaussian process and *nuisance* a coordinate unknown in
//! use, such as force. The prior is uniform within the calibration and half a gap beyond, and smaller up to a
//! gap:
//!
//! p(position | reading) ∝ ∫ N(reading; f̄, C + v·S) d nuisance,
//!
//! with the mean f̄, relative variance v and signal covariance S of the process. The noise covariance C is
//! that of repeats or of the process, scaled by held-out errors. N has no determinant, which would draw
//! estimates to the presses, where v is least. The estimate is the posterior mean.

mod config;
mod curve;
mod fitting;
mod line;
mod locator;
mod missing_channel;
mod presses;
mod scan;
mod table;

pub use config::{MeasuredError, MeasuredInfluence, Scale};
pub(crate) use fitting::{most_nodes, most_nuisance_nodes};
pub use locator::{MeasuredLocator, NuisanceRole};
pub use table::Table;

#[cfg(test)]
mod tests;
