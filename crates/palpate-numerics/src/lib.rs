//! Numerical methods.
//!
//! ```
//! use palpate_numerics::{chi_squared_critical_value, chi_squared_survival, median, normal_interval_95};
//!
//! assert_eq!(median(vec![3.0, 1.0, 2.0, 10.0]), Some(2.5));
//! assert!((normal_interval_95(0.2, 0.001).1 - 0.20196).abs() < 1e-6);
//! assert!((chi_squared_critical_value(0.05, 8) - 15.507).abs() < 1e-3); // exceeded with a probability of 5 %
//! assert!((chi_squared_survival(15.507, 8) - 0.05).abs() < 1e-4);
//! ```
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod cholesky;
mod distributions;
mod eigen;
mod elliptic;
mod gram_schmidt;
mod out_of_range;
mod random_order;
pub mod regression;
mod shared_error;
pub mod simd;
pub mod small;
mod sparse_cholesky;
mod statistics;
pub mod watch;

pub use cholesky::{Cholesky, NotPositiveDefinite};
pub use distributions::{
    ELLIPSE_95, NORMAL_95, NORMAL_99, NormalPart, binomial_tail, bisect, chi_squared_critical_value,
    chi_squared_survival, clamped_interval, extend_to, hull, normal_between, normal_cdf, normal_interval_95,
    normal_quantile, student_critical_value, student_ln_density, student_survival,
};
pub use eigen::symmetric_eigen;
pub use elliptic::{Jacobi, carlson_rd, carlson_rf};
pub use gram_schmidt::push_rest;
pub use out_of_range::OutOfRange;
pub use random_order::random_order;
pub use shared_error::{SharedError, with_shared_error};
pub use sparse_cholesky::{SparseCholesky, SparseCholeskyError, SparseSymmetric};
pub use statistics::{
    FEWEST_FOR_95, conformal_95, conformal_95_of_groups, mean, mean_and_variance, median, percentile,
    root_mean_square, standard_error,
};
