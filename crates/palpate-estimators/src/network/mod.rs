//! Feed-forward networks: the founding paper's, trained by back-propagation, and ensembles trained by Levenberg–Marquardt.

mod config;
mod fitting;
mod levenberg_marquardt;
mod locator;
mod logistic;
mod outcome;
mod patterns;
mod prepared;
mod topology;
mod train;

pub use config::{BackPropagation, InputScale, Network, OutputCoding, PresentationOrder};
pub use fitting::{NetworkFitError, NetworkFitting};
pub use levenberg_marquardt::{
    LevenbergMarquardt, LevenbergMarquardtFitError, LevenbergMarquardtLocator, Member, NetworkInputs,
    OutputScale,
};
pub use locator::{ChannelScaling, NetworkLocator, NetworkParts};
pub use outcome::{TrainedNetwork, TrainingOutcome, TrainingStatus};
pub use palpate_core::Activation;
pub use patterns::Patterns;
pub use prepared::PreparedNetwork;
pub use topology::Topology;
pub use train::{Precision, TrainingQueue, TrainingTask, train_many, train_one};
