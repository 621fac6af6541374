//! From recordings to locators: recordings, estimators, tracking, load profiles, evaluation.

pub mod arrangement;
pub mod centroid;
pub mod closed_form;
pub mod digit;
pub mod estimator;
pub mod evaluation;
pub mod features;
#[cfg(test)]
mod fixtures;
pub mod gaussian_process;
pub mod influence;
pub mod load_profile;
pub mod method;
pub mod neighbours;
pub mod network;
pub mod recording;
pub mod setup;
pub mod simulate;
pub mod tracking;
