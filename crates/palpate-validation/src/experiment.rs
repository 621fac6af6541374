//! An experiment and its size.

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
    /// The number of repetitions of this size.
    pub fn pick<T>(self, full: T, quick: T) -> T {
        match self {
            Self::Full => full,
            Self::Quick => quick,
        }
    }
}

/// Receives the name of a finished case, the number of finished cases and of all.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// Experiment with fixed seeds.
#[derive(Clone, Copy)]
pub struct Experiment {
    /// Name, which is that of its files too.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Method, in two sentences.
    pub method: &'static str,
    /// Smallest seed; the others follow it.
    pub seed: u64,
    /// Runs the experiment.
    pub run: fn(Size, Progress) -> Result<Vec<Table>>,
}
