//! Linear algebra and distribution functions that several modules need.
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod cholesky;
mod distributions;
mod eigen;
mod elliptic;
mod random_order;
pub mod regression;
mod sparse_cholesky;
pub mod watch;

pub use cholesky::{Cholesky, NotPositiveDefinite};
pub use distributions::{NORMAL_95, chi_squared_bound, normal_distribution, normal_quantile};
pub use eigen::symmetric_eigen;
pub use elliptic::{Jacobi, carlson_rd, carlson_rf};
pub use random_order::random_order;
pub use sparse_cholesky::{EliminationOrder, SparseCholesky, SparseCholeskyError, SparseSymmetric};
