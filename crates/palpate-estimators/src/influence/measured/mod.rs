//! A surface without a model: what the sensors read is learnt as a function of where, and how, it is touched.
//!
//! The forward way: reading = f(position, nuisance) + noise, with f a Gaussian process, and *nuisance* whatever else shapes
//! the reading, is known while calibrating and unknown afterwards: the force, or how deep the surface is indented. A
//! reading is located by its posterior over position and nuisance coordinate, every value of both within the presses
//! that were made (and half a gap beyond) held as likely as any other before the reading is seen, and positions up to a whole gap
//! beyond as less likely:
//!
//! p(position | reading) ∝ ∫ N(reading; f̄, C + v·S) d nuisance,
//!
//! f̄ and v the process's mean and relative variance, S its signal's covariance, C that of the noise, and N the normal
//! density without its determinant: v is least at the presses, so its determinant would pull every estimate towards
//! them, as if contacts between presses were less probable. The position is the posterior's mean, which has the
//! least mean square error.
//!
//! C is that of repeats, or what the process calls noise where there are none, widened by what positions that were held
//! out of the recording show it to miss.

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
