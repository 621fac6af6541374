//! Experiment and size.

use crate::table::Table;
use anyhow::Result;
use serde::{Deserialize, Serialize};

/// Number of repetitions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// Repetitions of the tables in docs/validation.
    Full,
    /// Few repetitions: minutes for all experiments.
    Quick,
}

impl Size {
    /// Repetitions of this size.
    pub fn pick<T>(self, full: T, quick: T) -> T {
        match self {
            Self::Full => full,
            Self::Quick => quick,
        }
    }
}

/// Receives the name of a finished case, the numbers of finished and of all cases.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Experiment with fixed seeds.
#[derive(Clone, Copy)]
pub struct Experiment {
    /// Name, also of the files.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Method, in two sentences.
    pub method: &'static str,
    /// Smallest seed; others follow it.
    pub seed: u64,
    /// Runs the experiment.
    pub run: fn(Size, Progress) -> Result<Vec<Table>>,
}
