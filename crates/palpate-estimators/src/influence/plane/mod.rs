//! Influence functions of a plane with a model, and their inversion: bicubic patches over a grid, searched coarsely and
//! refined by Levenberg's steps.

mod answer;
mod coarse;
mod fitting;
mod likelihood;
mod locator;
mod modes;
mod patches;
mod refine;
mod search;
mod table;

pub use likelihood::PlateLikelihood;
pub use locator::{PlaneLocator, PlaneScratch};
pub use table::PlaneTable;

pub(super) use fitting::fit_plane;

#[cfg(test)]
mod tests;
