//! Designs as JSON.

use super::Outcome;
use palpate_design::sensors::{Assessment, CountPoint, Designed, Method, Verification};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::{Sensor, SensorKind};

/// What is printed as JSON. A limit that is not there, because the readings do not tell some contact, is null.
#[derive(serde::Serialize)]
pub struct Findings {
    palpate: &'static str,
    rig: String,
    seed: u64,
    force_n: f64,
    force: Force,
    criterion: &'static str,
    tolerance_mm: f64,
    candidates: usize,
    contacts: usize,
    designs: Vec<Design>,
    counts: Vec<Count>,
}

/// Scores of limits are in mm, of the share beyond the tolerance in %, of D-optimality ½·ln det.
#[derive(serde::Serialize)]
struct Design {
    method: Method,
    positions: Vec<Place>,
    #[serde(flatten)]
    worth: Worth,
    /// Of simulated calibrations.
    simulated: Option<Simulated>,
}

#[derive(serde::Serialize)]
struct Worth {
    score: f64,
    mean_limit_mm: Option<f64>,
    worst_limit_mm: Option<f64>,
    mean_error_at_limit_mm: Option<f64>,
    within_tolerance_percent: f64,
    score_one_dead: Option<f64>,
    cost: f64,
    keeps_constraints: bool,
}

#[derive(serde::Serialize)]
struct Place {
    measure: SensorKind,
    x_mm: f64,
    y_mm: f64,
}

#[derive(serde::Serialize)]
struct Simulated {
    mean_error_mm: f64,
    standard_error_mm: f64,
    within_tolerance_percent: f64,
    calibrations: usize,
}

#[derive(serde::Serialize)]
struct Count {
    count: usize,
    even: Option<Worth>,
    designed: Worth,
}

pub fn findings(outcome: &Outcome) -> Findings {
    let (problem, design) = (outcome.problem, outcome.problem.design());
    let scale = design.criterion.score_scale();
    Findings {
        palpate: env!("CARGO_PKG_VERSION"),
        rig: outcome.rig.display().to_string(),
        seed: outcome.seed,
        force_n: problem.force_n(),
        force: problem.force(),
        criterion: design.criterion.name(),
        tolerance_mm: design.tolerance_m * 1e3,
        candidates: problem.candidates(),
        contacts: problem.contacts().len(),
        designs: outcome.designed.iter().map(|designed| one(designed, outcome, scale)).collect(),
        counts: outcome.counts.iter().map(|point| count(point, scale)).collect(),
    }
}

fn one(designed: &Designed, outcome: &Outcome, scale: f64) -> Design {
    Design {
        method: designed.method,
        positions: designed.layout.sensors().iter().map(place).collect(),
        worth: worth(&designed.assessment, scale),
        simulated: outcome.verification(designed.method).map(simulated),
    }
}

fn place(sensor: &Sensor) -> Place {
    Place { measure: sensor.kind, x_mm: sensor.position.x_m * 1e3, y_mm: sensor.position.y_m * 1e3 }
}

fn worth(worth: &Assessment, scale: f64) -> Worth {
    let mm = |length_m: Option<f64>| length_m.map(|length_m| length_m * 1e3);
    Worth {
        score: worth.score * scale,
        mean_limit_mm: mm(worth.mean_limit_m),
        worst_limit_mm: mm(worth.worst_limit_m),
        mean_error_at_limit_mm: mm(worth.mean_error_m),
        within_tolerance_percent: worth.within_tolerance_percent,
        score_one_dead: worth.score_one_dead.map(|score| score * scale),
        cost: worth.cost,
        keeps_constraints: worth.keeps_constraints,
    }
}

fn simulated(verification: &Verification) -> Simulated {
    Simulated {
        mean_error_mm: verification.mean_error_m * 1e3,
        standard_error_mm: verification.standard_error_m * 1e3,
        within_tolerance_percent: verification.within_tolerance_percent,
        calibrations: verification.calibrations,
    }
}

fn count(point: &CountPoint, scale: f64) -> Count {
    Count {
        count: point.count,
        even: point.even.as_ref().map(|even| worth(even, scale)),
        designed: worth(&point.designed, scale),
    }
}
