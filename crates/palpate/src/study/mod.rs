//! Experiments in sets: arms, each fitted from many seeds and judged at the same contact positions.

pub mod dead_areas;
mod file;
mod networks_csv;
pub mod paper;
mod results;
mod run;

pub use file::{StudyError, StudyProblem};
pub use networks_csv::{Checkpoint, CheckpointError, NetworksCsv};
pub use results::{ArmResults, PortionResults, RunFacts, StudyResults};
pub use run::{ArmOutcome, Observer, PrepareError, PreparedStudy, RunOptions, Trained, TrainedSeed};

use crate::contact::Position;
use crate::evaluation::Portion;
use crate::network::Precision;
use crate::rig::Rig;

/// A set of experiments: every arm is a rig, fitted once a seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// Seeds 0 to this less 1, unless the caller wants another number; at least 1.
    pub seeds: u64,
    /// The arithmetic of training.
    pub precision: Precision,
    /// Where and how its locators are judged.
    pub judging: Judging,
    /// Its arms, at least 1, with names of their own.
    pub arms: Vec<Arm>,
    /// SHA-256 of the study file, in hexadecimal.
    pub digest: String,
}

/// One row of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Its name, unique in the study.
    pub name: String,
    /// What is fitted.
    pub rig: Rig,
}

/// Where and how a study's locators are judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judging {
    /// Contact positions, evenly spaced.
    pub positions: Vec<Position>,
    /// An error up to this, in metres, is good enough for the effective length.
    pub tolerance_m: f64,
    /// Portions of the surface that are also judged by themselves.
    pub portions: Vec<Portion>,
}
