//! Networks by Levenberg–Marquardt with Bayesian regularisation: the evidence sets the weight decay, and an ensemble with the curvature
//! around each member says how sure the answer is.

mod evidence;
mod fitting;
mod inputs;
mod locator;
mod perceptron;
mod training;

pub use fitting::{LevenbergMarquardt, LevenbergMarquardtFitError};
pub use inputs::NetworkInputs;
pub use locator::{LevenbergMarquardtLocator, Member, OutputScale};

#[cfg(test)]
mod tests;
