//! Regression by Gaussian processes: smooth functions of a few coordinates from noisy samples, with their uncertainty.
//!
//! f_j(x) = h(x)·β_j + g_j(x) for output j = 1…m, where h is the [`Trend`]'s basis, β_j ~ N(0, s_j²·b²·I) with b² so
//! large that it hardly matters, and g_j is a Gaussian process of covariance s_j²·c(x, x′), c a [`Kernel`]. The outputs
//! share c and each has a signal variance s_j² of its own. A row is y_j = f_j(x) + noise.
//!
//! Rows at the same coordinates are collapsed to their weighted mean before anything is factored. That is exact: the
//! posterior and the evidence are those of all rows, the scatter of the repeats included, so repeats teach the noise.
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

mod covariance;
mod error;
mod evidence;
mod groups;
mod hyperparameters;
mod kernel;
mod lbfgs;
mod posterior;
mod posterior_data;
mod search;

pub use error::RegressionError;
pub use groups::Samples;
pub use hyperparameters::Hyperparameters;
pub use kernel::{Kernel, Trend};
pub use posterior::{GaussianProcess, PredictionScratch};
pub use posterior_data::PosteriorFault;
pub use search::Regression;

#[cfg(test)]
mod tests;
