//! Linear algebra and distribution functions that several modules need.

mod cholesky;
mod distributions;

pub use cholesky::{Cholesky, NotPositiveDefinite};
pub use distributions::{chi_squared_quantile, normal_distribution, normal_quantile};
