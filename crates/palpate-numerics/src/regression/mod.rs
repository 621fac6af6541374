//! Regression by Gaussian processes: smooth functions of a few coordinates from noisy samples, with their uncertainty.
//!
//! f_j(x) = h(x)·β_j + g_j(x) for output j = 1…m, where h is the [`Trend`]'s basis, β_j ~ N(0, s_j²·b²·I) with b² so
//! large that it hardly matters, and g_j is a Gaussian process of covariance s_j²·c(x, x′), c a [`Kernel`]. The outputs
//! share c and each has a signal variance s_j² of its own. A row is y_j = f_j(x) + noise.
//!
//! Rows at the same coordinates are collapsed to their weighted mean before anything is factored. That is exact: the
//! posterior and the evidence are those of all rows, the scatter of the repeats included, so repeats teach the noise.
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
