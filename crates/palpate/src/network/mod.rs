//! The founding paper's estimator: a feed-forward network trained by back-propagation.

mod config;

pub use config::{BackPropagation, InputScale, NetworkConfig, OutputCoding, PresentationOrder};
pub use palpate_core::Activation;
