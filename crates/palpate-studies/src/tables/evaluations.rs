//! Rows of `evaluations.csv`, one per fit of another estimator than a network.
//!
//! Columns: arm, seed, and one value per reading of `estimates_m` (located positions, m), `held` (1 if the 95
//! % interval contains the contact, else 0; - without an interval) and `interval_scores_m` (m, or -). Floats
//! read back to the last bit.

use super::super::run::{ArmFit, PreparedStudy, TrainedSeed};
use super::{RowProblem, fit_of, read_cell};
use palpate_estimators::evaluation::{CoveredCoordinates, EvaluatedContact, Evaluation};
use palpate_estimators::recording::csv_row;
use palpate_mechanics::contact::Position;

const COLUMNS: [&str; 5] = ["arm", "seed", ESTIMATES, HELD, SCORES];
const ESTIMATES: &str = "estimates_m";
const HELD: &str = "held";
const SCORES: &str = "interval_scores_m";
const NOT_TOLD: &str = "-";

pub fn header() -> String {
    csv_row(COLUMNS)
}

pub fn row(study: &PreparedStudy, ArmFit { arm, fit }: &ArmFit) -> String {
    let located = &fit.evaluation.located;
    let estimates: Vec<String> = located.iter().map(|at| at.estimate.x_m.to_string()).collect();
    let held: String = located.iter().map(|at| character(at.covered.map(|covered| covered.x))).collect();
    let score = |at: &EvaluatedContact| {
        at.interval_score_m.map_or_else(|| NOT_TOLD.to_owned(), |score| score.to_string())
    };
    let scores: Vec<String> = located.iter().map(score).collect();
    let cells = [
        study.study.arms[*arm].name.clone(),
        fit.seed.to_string(),
        estimates.join(" "),
        held,
        scores.join(" "),
    ];
    csv_row(cells)
}

fn character(held: Option<bool>) -> char {
    match held {
        Some(true) => '1',
        Some(false) => '0',
        None => '-',
    }
}

pub fn read(study: &PreparedStudy, row: &str) -> Result<ArmFit, RowProblem> {
    let cells: Vec<&str> = row.split(',').collect();
    let [arm_name, seed, estimates, held, scores] = cells[..] else {
        return Err(RowProblem::Cells { found: cells.len(), wanted: COLUMNS.len() });
    };
    let (arm, seed) = fit_of(study, arm_name, seed)?;
    if study.keeps_weights(arm) {
        return Err(RowProblem::Network { arm: arm_name.to_owned() });
    }
    let contacts = study.contacts(arm);
    let estimates_m = numbers(ESTIMATES, estimates, contacts.len())?;
    let held = held.chars().map(parse_coverage).collect::<Result<Vec<_>, _>>()?;
    check_count(HELD, held.len(), contacts.len())?;
    let scores_m = numbers(SCORES, scores, contacts.len())?;
    let mut located = Vec::with_capacity(contacts.len());
    for (i, contact) in contacts.iter().enumerate() {
        located.push(EvaluatedContact {
            truth: contact.position,
            force_n: Some(contact.force_n),
            estimate: Position::along(estimates_m[i].ok_or_else(|| not_finite(ESTIMATES, NOT_TOLD))?),
            covered: held[i].map(|x| CoveredCoordinates { x, y: None }),
            interval_score_m: scores_m[i],
            status: None,
            force: None,
        });
    }
    let extent = study.study.arms[arm].rig.setup.surface().extent();
    let evaluation = Evaluation { extent, located };
    Ok(ArmFit { arm, fit: TrainedSeed { seed, training: None, weights: Vec::new(), evaluation } })
}

fn numbers(column: &'static str, cell: &str, readings: usize) -> Result<Vec<Option<f64>>, RowProblem> {
    let number = |value: &str| -> Result<Option<f64>, RowProblem> {
        if value == NOT_TOLD {
            return Ok(None);
        }
        let number: f64 = read_cell(column, value, FINITE)?;
        if number.is_finite() { Ok(Some(number)) } else { Err(not_finite(column, value)) }
    };
    let numbers = cell.split(' ').map(number).collect::<Result<Vec<_>, _>>()?;
    check_count(column, numbers.len(), readings)?;
    Ok(numbers)
}

const FINITE: &str = "a finite number";

fn not_finite(column: &'static str, value: &str) -> RowProblem {
    RowProblem::Cell { column, found: super::shortened(value), wanted: FINITE }
}

fn parse_coverage(character: char) -> Result<Option<bool>, RowProblem> {
    match character {
        '1' => Ok(Some(true)),
        '0' => Ok(Some(false)),
        '-' => Ok(None),
        other => Err(RowProblem::Cell { column: HELD, found: other.to_string(), wanted: "1, 0 or -" }),
    }
}

fn check_count(column: &'static str, found: usize, wanted: usize) -> Result<(), RowProblem> {
    if found == wanted { Ok(()) } else { Err(RowProblem::Readings { column, found, wanted }) }
}
