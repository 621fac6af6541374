//! Experiments by name.

use crate::table::Table;
use crate::{
    beam_ends, load_patches, load_profiles, measured_edges, one_weight, plate_edges, plate_limit,
    real_benches, strips, weighed,
};
use anyhow::{Context, Result};
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

/// All experiments.
pub const EXPERIMENTS: &[Experiment] = &[
    real_benches::EXPERIMENT,
    one_weight::EXPERIMENT,
    load_profiles::EXPERIMENT,
    load_patches::EXPERIMENT,
    beam_ends::EXPERIMENT,
    plate_edges::EXPERIMENT,
    plate_limit::EXPERIMENT,
    measured_edges::BEAMS,
    measured_edges::PLATES,
    strips::STRIPS,
    strips::DRIFTING,
    strips::SCATTERED,
    strips::NOISE,
    strips::FEW,
    weighed::EXPERIMENT,
];

/// The experiments of these names; all of them without a name.
///
/// # Errors
/// A name that no experiment has.
pub fn by_names(names: &[String]) -> Result<Vec<Experiment>> {
    if names.is_empty() {
        return Ok(EXPERIMENTS.to_vec());
    }
    let by_name = |name: &String| {
        let found = EXPERIMENTS.iter().find(|experiment| experiment.name == name).copied();
        let known: Vec<&str> = EXPERIMENTS.iter().map(|experiment| experiment.name).collect();
        found.with_context(|| format!("there is no experiment `{name}`; there are {}", known.join(", ")))
    };
    names.iter().map(by_name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_unique_and_methods_are_at_most_two_sentences() {
        let names: BTreeSet<&str> = EXPERIMENTS.iter().map(|experiment| experiment.name).collect();
        assert_eq!(names.len(), EXPERIMENTS.len());
        for Experiment { name, method, .. } in EXPERIMENTS {
            let sentences = method.matches(". ").count() + usize::from(method.ends_with('.'));
            assert!((1..=2).contains(&sentences), "{name}: {sentences} sentences");
        }
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_known_ones() {
        let refused = by_names(&["bridge".to_owned()]).map(|_| ()).unwrap_err().to_string();
        assert!(
            refused.starts_with("there is no experiment `bridge`; there are real-benches, "),
            "{refused}"
        );
        assert_eq!(by_names(&[]).unwrap().len(), EXPERIMENTS.len());
    }
}
