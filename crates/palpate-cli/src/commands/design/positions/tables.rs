//! Training positions as people read them.

use super::Outcome;
use crate::failure::Failure;
use crate::output;
use crate::table::table;
use palpate_design::positions::{Placed, Placement, best_placed};
use palpate_mechanics::units::{format_count, format_length_mm};

pub fn print(outcome: &Outcome) -> Result<(), Failure> {
    let (problem, design) = (outcome.problem, outcome.problem.design());
    output::say(format!(
        "{}: {} training positions, {} press{} each, for the `{}` estimator; {} contacts, force {}; {} calibrations verify\n",
        outcome.rig.display(),
        design.count,
        format_count(design.repeats as u64),
        if design.repeats == 1 { "" } else { "es" },
        outcome.estimator,
        problem.contacts().len(),
        problem.force().name(),
        design.verifications,
    ))?;
    output::say(errors(outcome))?;
    output::say("")?;
    for placed in &outcome.placed {
        let places = problem.extent().places_in_words(&placed.positions);
        output::say(format!("{}: {places}", placed.placement.name()))?;
    }
    match best_placed(&outcome.placed) {
        Some(best) => output::say(format!("\nBest: {}", gain(outcome, best))),
        None => Ok(()),
    }
}

fn errors(outcome: &Outcome) -> String {
    let tolerance = format!("within {}, %", format_length_mm(outcome.problem.design().tolerance_m));
    let heading = ["positions", "mean error, mm", "median, mm", &tolerance, "less than even, %"];
    let even_m = even(outcome).map(|even| even.verification.median_error_m);
    let rows = outcome.placed.iter().map(|placed| {
        let told = &placed.verification;
        let less = even_m.map(|even_m| 100.0 * (1.0 - told.median_error_m / even_m));
        vec![
            placed.placement.name().to_owned(),
            format!("{} ± {}", figure(told.mean_error_m * 1e3), figure(told.standard_error_m * 1e3)),
            figure(told.median_error_m * 1e3),
            format!("{:.1}", told.within_tolerance_percent),
            less.map_or_else(|| "–".to_owned(), |less| format!("{less:.1}")),
        ]
    });
    table(&heading, rows)
}

/// Three decimals, or as many as a small number needs for two digits that matter.
fn figure(value: f64) -> String {
    if value >= 0.01 || value == 0.0 { format!("{value:.3}") } else { format!("{value:.1e}") }
}

fn even<'a>(outcome: &'a Outcome) -> Option<&'a Placed> {
    outcome.placed.iter().find(|placed| placed.placement == Placement::Even)
}

fn gain(outcome: &Outcome, best: &Placed) -> String {
    let (name, best_m) = (best.placement.name(), best.verification.median_error_m);
    match even(outcome).map(|even| even.verification.median_error_m) {
        _ if best.placement == Placement::Even => {
            "even; no other is better by more than the noise of the calibrations".to_owned()
        }
        Some(even_m) => format!(
            "{name}, median error {} mm, {:.1} % below the even positions' {} mm",
            figure(best_m * 1e3),
            100.0 * (1.0 - best_m / even_m),
            figure(even_m * 1e3),
        ),
        None => format!("{name}, median error {} mm", figure(best_m * 1e3)),
    }
}
