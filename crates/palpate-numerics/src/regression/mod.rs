//! Regression by Gaussian processes: smooth functions of a few coordinates from noisy samples, with their uncertainty.
//!
//! f_j(x) = h(x)·β_j + g_j(x) for output j = 1…m. Here h is the [`Trend`]'s basis, β_j ~ N(0, s_j²·b²·I) with b² so
//! large that it hardly matters, and g_j is a Gaussian process of covariance s_j²·c(x, x′), c a [`Kernel`]. The outputs
//! share c, and each has its own signal variance s_j². A row is y_j = f_j(x) + noise.
//!
//! Rows at equal coordinates are collapsed to their weighted mean before any factorisation. This is exact: the
//! posterior and the evidence are those of all rows, including the scatter of the repeats, so repeats determine the noise.
//!
//! ```
//! use ndarray::Array2;
//! use palpate_numerics::regression::{Regression, Samples};
//! use palpate_numerics::watch::Watch;
//!
//! let x = Array2::from_shape_fn((12, 1), |(i, _)| 0.5 * i as f64);
//! let y = x.mapv(f64::sin);
//! let samples = Samples { coordinates: x.view(), outputs: y.view(), noise_variance: None };
//! let process = Regression::default().fit(samples, Watch::NONE)?;
//! let (mean, variance) = process.predict(&[1.25]);
//! assert!((mean[0] - 1.25f64.sin()).abs() < 1e-3 && variance[0] < 1e-4);
//! # Ok::<(), palpate_numerics::regression::RegressionError>(())
//! ```
//!
//! Rasmussen and Williams, *Gaussian Processes for Machine Learning* (2006), chapters 2, 4 and 5.

mod blocks;
mod covariance;
mod evidence;
mod groups;
mod kernel;
mod lbfgs;
mod posterior;
mod reduced;
mod search;

pub use groups::Samples;
pub use kernel::{Hyperparameters, Kernel, Trend};
pub use posterior::{GaussianProcess, MOST_EXACT, PosteriorFault, PredictionScratch};
pub use reduced::INDUCING;
pub use search::Regression;

use crate::NotPositiveDefinite;
use crate::watch::Cancelled;

/// Error of samples that no Gaussian process can be fitted to.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RegressionError {
    /// Too few rows, coordinates or outputs.
    #[error(
        "there are {rows} rows of {coordinates} coordinates and {outputs} outputs; at least 1 of each is needed"
    )]
    Empty {
        /// Rows.
        rows: usize,
        /// Coordinates of a row.
        coordinates: usize,
        /// Outputs of a row.
        outputs: usize,
    },
    /// Lists of different lengths.
    #[error("there are {found} {what}; {needed} are needed")]
    Count {
        /// Content of the list.
        what: &'static str,
        /// Length that the other lists require.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// An infinite value, or NaN.
    #[error("{what} {column} of row {row} is {value}; it must be finite")]
    NotFinite {
        /// Coordinate or output.
        what: &'static str,
        /// Index of the row, from 1.
        row: usize,
        /// Index of the coordinate or output, from 1.
        column: usize,
        /// The value.
        value: f64,
    },
    /// A variance that is negative or not finite.
    #[error("the noise variance of row {row} is {value}; it must be finite and at least 0")]
    NoiseVariance {
        /// Index of the row, from 1.
        row: usize,
        /// The value.
        value: f64,
    },
    /// A hyperparameter out of range.
    #[error("{what} {number} is {value}; it must be finite and greater than 0")]
    Hyperparameter {
        /// Length scale or noise ratio.
        what: &'static str,
        /// Index of the hyperparameter, from 1.
        number: usize,
        /// The value.
        value: f64,
    },
    /// The covariance matrix of the rows has no factor.
    #[error("the rows' covariance cannot be factored: {0}")]
    Singular(#[from] NotPositiveDefinite),
    /// The search for hyperparameters was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

#[cfg(test)]
mod tests;
