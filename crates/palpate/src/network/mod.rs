//! The founding paper's estimator: a feed-forward network trained by back-propagation.

mod config;
mod fitting;
mod lanes;
mod locator;
mod outcome;
mod patterns;
mod scalar;
mod topology;
mod train;

pub use config::{BackPropagation, InputScale, NetworkConfig, OutputCoding, PresentationOrder};
pub use fitting::{NetworkFitError, NetworkFitting};
pub use lanes::{InstructionSet, Precision};
pub use locator::{ChannelScaling, NetworkLocator};
pub use outcome::{TrainedNetwork, TrainingOutcome, TrainingStatus};
pub use palpate_core::Activation;
pub use patterns::Patterns;
pub use topology::Topology;
pub use train::{SeedQueue, TrainingTask, train_many, train_one};
