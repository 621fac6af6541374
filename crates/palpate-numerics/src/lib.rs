//! Linear algebra, statistics and distribution functions that several modules need.
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod cholesky;
mod distributions;
mod eigen;
mod elliptic;
mod out_of_range;
mod random_order;
pub mod regression;
pub mod simd;
pub mod small;
mod sparse_cholesky;
mod statistics;
pub mod watch;

pub use cholesky::{Cholesky, NotPositiveDefinite};
pub use distributions::{
    ELLIPSE_95, NORMAL_95, bisect, chi_squared_bound, held_interval, normal_distribution, normal_interval_95,
    normal_quantile,
};
pub use eigen::symmetric_eigen;
pub use elliptic::{Jacobi, carlson_rd, carlson_rf};
pub use out_of_range::OutOfRange;
pub use random_order::random_order;
pub use sparse_cholesky::{SparseCholesky, SparseCholeskyError, SparseSymmetric};
pub use statistics::{mean, mean_and_variance, median, percentile, root_mean_square, standard_error};
