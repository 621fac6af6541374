//! The centroid that array sensors use: the magnitude-weighted mean of the sensors' positions, calibrated by a linear map.

mod fitting;
mod locator;

pub use fitting::{Centroid, CentroidFitError};
pub use locator::{CentroidLocator, Weighing};

#[cfg(test)]
mod tests;
