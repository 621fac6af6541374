//! Dense linear algebra that several modules need.

mod cholesky;
mod eigen;

pub use cholesky::{Cholesky, NotPositiveDefinite};
pub use eigen::symmetric_eigen;
