//! Experiments.

use crate::experiment::Experiment;
use crate::{
    beam_ends, comparisons, designs, drift_and_creep, false_alarms, influence_sources, load_patches,
    load_profiles, measured_edges, mechanics, moving_contacts, moving_without_model, one_weight, outliers,
    plate_edges, plate_limit, real_benches, statuses, strips, studies, weighed,
};
use anyhow::{Context, Result};

/// All experiments.
pub const EXPERIMENTS: &[Experiment] = &[
    real_benches::EXPERIMENT,
    one_weight::EXPERIMENT,
    load_profiles::EXPERIMENT,
    load_patches::EXPERIMENT,
    statuses::EXPERIMENT,
    false_alarms::EXPERIMENT,
    influence_sources::EXPERIMENT,
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
    outliers::EXPERIMENT,
    weighed::EXPERIMENT,
    moving_contacts::EXPERIMENT,
    moving_without_model::EXPERIMENT,
    drift_and_creep::EXPERIMENT,
    studies::PRESS_SPACING,
    studies::SENSING_POSITIONS,
    studies::SENSOR_KINDS,
    designs::SENSOR_LAYOUTS,
    designs::NETWORK_POSITIONS,
    comparisons::ELLIOTT,
    comparisons::DEAD_AREAS,
    mechanics::SUPPORTED_BEAMS,
    mechanics::DIGIT_LIMIT,
    mechanics::PLATE_MESH,
];

/// Experiments of these names; all without a name.
///
/// # Errors
/// Unknown name.
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
