//! From recordings to locators: recordings, estimators, tracking, load profiles, evaluation.
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

pub mod arrangement;
pub mod centroid;
pub mod closed_form;
pub mod digit;
pub mod estimator;
pub mod evaluation;
pub mod features;
pub mod fit;
#[cfg(test)]
mod fixtures;
pub mod gaussian_process;
mod held_out;
pub mod influence;
pub mod likelihood;
pub mod load_profile;
pub mod neighbours;
pub mod network;
pub mod recording;
pub mod setup;
pub mod simulate;
pub mod status;
pub mod track_errors;
pub mod tracking;
