//! Experiments in sets: arms, each fitted from many seeds and judged at the same contact positions.
//!
//! There are two ways to fit an arm. Networks on perfect sensors, as the founding paper has them, share one recording: what a seed
//! changes is the network's random start, and many are trained at once, in lanes. Of every other arm each seed makes a recording of
//! its own, with fresh noise, to which the estimator is fitted and by which it is judged.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

pub mod dead_areas;
pub mod elliott;
mod layouts;
mod limits;
mod networks_csv;
pub mod paper;
mod prepare;
mod results;
mod run;
mod seed_by_seed;

pub use networks_csv::{Checkpoint, CheckpointError, NetworksCsv};
pub use palpate_rig::{Arm, AskedLayout, Judging, Study};
pub use prepare::{PreparedStudy, StudyRunError};
pub use results::{
    ArmResults, LimitResults, PortionResults, RunFacts, SensorPlace, SetUp, StudyResults, TrainingSpanResults,
};
pub use run::{ArmOutcome, OnTrained, RunOptions, Trained, TrainedSeed};

#[cfg(test)]
mod tests;
