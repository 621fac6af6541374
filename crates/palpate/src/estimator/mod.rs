//! Where methods meet: whoever evaluates, studies, reports or listens treats every estimator alike.

mod config;

pub use config::EstimatorConfig;
