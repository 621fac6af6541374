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
mod file;
mod layouts;
mod limits;
mod networks_csv;
pub mod paper;
mod prepare;
mod results;
mod run;
mod seed_by_seed;

pub use file::{StudyError, StudyProblem};
pub use networks_csv::{Checkpoint, CheckpointError, NetworksCsv};
pub use prepare::{PreparedStudy, StudyRunError};
pub use results::{
    ArmResults, LimitResults, PortionResults, RunFacts, SensorPlace, SetUp, StudyResults, TrainingSpanResults,
};
pub use run::{ArmOutcome, OnTrained, RunOptions, Trained, TrainedSeed};

#[cfg(test)]
mod tests;

use std::ops::Range;

use palpate_design::sensors::Method;
use palpate_estimators::evaluation::Portion;
use palpate_estimators::network::Precision;
use palpate_mechanics::contact::Position;
use palpate_rig::Rig;

/// A set of experiments: every arm is a rig, fitted once a seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Its name.
    pub name: String,
    /// Seeds 0 to this less 1, unless the caller wants another number; at least 1.
    pub seeds: u64,
    /// The arithmetic of training in lanes.
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
    /// What is fitted; where a layout is asked for, it takes the place of the rig's own when the study is prepared.
    pub rig: Rig,
    /// The layout that it asks for by method.
    pub layout: Option<AskedLayout>,
    /// The title of the figure that it shares with other arms in reports; `None` for a figure of its own.
    pub figure: Option<String>,
}

/// A layout asked for by method.
#[derive(Clone, Debug, PartialEq)]
pub struct AskedLayout {
    /// The method.
    pub method: Method,
    /// The bytes of the study file that ask for it.
    pub place: Range<usize>,
}

/// Where and how a study's locators are judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judging {
    /// Contact positions, evenly spaced.
    pub positions: Vec<Position>,
    /// Readings at each position, where sensors have noise; at least 1.
    pub readings: usize,
    /// An error up to this, in metres, is good enough for the effective length.
    pub tolerance_m: f64,
    /// Portions of the surface that are also judged by themselves.
    pub portions: Vec<Portion>,
    /// Whether errors between the outermost training positions, and beyond them, are also judged by themselves.
    pub training_span: bool,
}
