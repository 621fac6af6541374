//! Training positions as JSON.

use super::Outcome;
use palpate_design::positions::{Placed, Placement};
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::Force;

/// What is printed as JSON.
#[derive(serde::Serialize)]
pub struct Findings {
    palpate: &'static str,
    rig: String,
    seed: u64,
    estimator: &'static str,
    force: Force,
    count: usize,
    repeats: usize,
    tolerance_mm: f64,
    contacts: usize,
    designs: Vec<Design>,
}

#[derive(serde::Serialize)]
struct Design {
    method: Placement,
    positions: Vec<Place>,
    mean_error_mm: f64,
    standard_error_mm: f64,
    median_error_mm: f64,
    within_tolerance_percent: f64,
    calibrations: usize,
}

#[derive(serde::Serialize)]
pub(super) struct Place {
    x_mm: f64,
    y_mm: f64,
}

pub fn findings(outcome: &Outcome) -> Findings {
    let (problem, asked) = (outcome.problem, outcome.problem.design());
    Findings {
        palpate: env!("CARGO_PKG_VERSION"),
        rig: outcome.rig.display().to_string(),
        seed: asked.seed,
        estimator: outcome.estimator,
        force: problem.force(),
        count: asked.count,
        repeats: asked.repeats,
        tolerance_mm: asked.tolerance_m * 1e3,
        contacts: problem.contacts().len(),
        designs: outcome.placed.iter().map(found).collect(),
    }
}

fn found(placed: &Placed) -> Design {
    let told = &placed.verification;
    Design {
        method: placed.placement,
        positions: placed.positions.iter().map(place).collect(),
        mean_error_mm: told.mean_error_m * 1e3,
        standard_error_mm: told.standard_error_m * 1e3,
        median_error_mm: told.median_error_m * 1e3,
        within_tolerance_percent: told.within_tolerance_percent,
        calibrations: told.calibrations,
    }
}

pub(super) fn place(position: &Position) -> Place {
    Place { x_mm: position.x_m * 1e3, y_mm: position.y_m * 1e3 }
}
