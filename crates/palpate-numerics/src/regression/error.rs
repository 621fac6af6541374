//! Why a regression cannot be made.

use crate::NotPositiveDefinite;
use crate::watch::Cancelled;

/// Samples that no Gaussian process can be fitted to.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RegressionError {
    /// Nothing to learn from.
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
        /// What the list holds.
        what: &'static str,
        /// Length that the rest asks for.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// An infinity, or not a number.
    #[error("{what} {column} of row {row} is {value}; it must be finite")]
    NotFinite {
        /// Coordinate or output.
        what: &'static str,
        /// Which row, from 1.
        row: usize,
        /// Which coordinate or output, from 1.
        column: usize,
        /// The value.
        value: f64,
    },
    /// A variance that is none.
    #[error("the noise variance of row {row} is {value}; it must be finite and at least 0")]
    NoiseVariance {
        /// Which row, from 1.
        row: usize,
        /// The value.
        value: f64,
    },
    /// A hyperparameter that is out of its range.
    #[error("{what} {number} is {value}; it must be finite and greater than 0")]
    Hyperparameter {
        /// Length scale or noise ratio.
        what: &'static str,
        /// Which one, from 1.
        number: usize,
        /// The value.
        value: f64,
    },
    /// The covariance matrix of the rows does not factor.
    #[error("the rows' covariance cannot be factored: {0}")]
    Singular(#[from] NotPositiveDefinite),
    /// The search for hyperparameters was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}
