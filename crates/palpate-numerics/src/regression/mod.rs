//! Gaussian process regression (Rasmussen and Williams, *Gaussian Processes for Machine Learning*, 2006,
//! chapters 2, 4 and 5).
//!
//! f_j(x) = h(x)·β_j + g_j(x), j = 1…m, with [`Trend`] h, β_j ~ N(0, s_j²·b²·I), and g_j of covariance
//! s_j²·c(x, x′), c a [`Kernel`]. A row is y_j = f_j(x) + noise. Repeated rows are collapsed exactly.
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

/// Error of a fit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RegressionError {
    /// Too few rows, coordinates or outputs.
    #[error(
        "there are {rows} rows of {coordinates} coordinates and {outputs} outputs; at least 1 of each is needed"
    )]
    Empty {
        /// Rows.
        rows: usize,
        /// Coordinates.
        coordinates: usize,
        /// Outputs.
        outputs: usize,
    },
    /// A list has the wrong length.
    #[error("there are {found} {what}; {needed} are needed")]
    Count {
        /// Name of the list.
        what: &'static str,
        /// Required length.
        needed: usize,
        /// Length.
        found: usize,
    },
    /// A value is not finite.
    #[error("{what} {column} of row {row} is {value}; it must be finite")]
    NotFinite {
        /// Coordinate or output.
        what: &'static str,
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// Value.
        value: f64,
    },
    /// A variance is negative or not finite.
    #[error("the noise variance of row {row} is {value}; it must be finite and at least 0")]
    NoiseVariance {
        /// Row, from 1.
        row: usize,
        /// Value.
        value: f64,
    },
    /// A hyperparameter is out of range.
    #[error("{what} {number} is {value}; it must be finite and greater than 0")]
    Hyperparameter {
        /// Length scale or noise ratio.
        what: &'static str,
        /// Index, from 1.
        number: usize,
        /// Value.
        value: f64,
    },
    /// The covariance is not positive definite.
    #[error("the rows' covariance cannot be factored: {0}")]
    Singular(#[from] NotPositiveDefinite),
    /// The watch cancelled the work.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

#[cfg(test)]
mod tests;
