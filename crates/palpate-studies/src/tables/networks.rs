//! Rows of `networks.csv`, one per fit.
//!
//! Columns: arm, seed; epochs, status and aggregate error of training; errors in % of the length; effective
//! length; weights. Cells without a meaning are empty.
//!
//! Weights are in the order of `palpate_core::Network`: by layer from the inputs, by node; each node has the
//! weights of the nodes before it, then its bias, if any. Inputs are in the order of the layout.

use super::super::results::percent;
use super::super::run::{ArmFit, PreparedStudy};
use super::{RowProblem, fit_of, read_cell};
use palpate_estimators::network::{TrainingOutcome, TrainingStatus};
use palpate_estimators::recording::csv_row;

const OUTCOME_COLUMNS: [&str; 5] = ["arm", "seed", "epochs", "status", "aggregate_error"];

pub fn header(study: &PreparedStudy) -> String {
    let mut columns: Vec<String> = OUTCOME_COLUMNS.map(str::to_owned).into();
    columns.extend(metrics(study, None).into_iter().map(|(name, _)| name));
    columns.push("weights".to_owned());
    csv_row(columns)
}

pub fn row(study: &PreparedStudy, trained: &ArmFit) -> String {
    let outcome = &trained.fit.training;
    let told = |told: fn(&TrainingOutcome) -> String| outcome.as_ref().map_or_else(String::new, told);
    let weights: Vec<String> = trained.fit.weights.iter().map(f64::to_string).collect();
    let mut cells = vec![
        study.study.arms[trained.arm].name.clone(),
        trained.fit.seed.to_string(),
        told(|outcome| outcome.epochs.to_string()),
        told(|outcome| outcome.status.to_string()),
        told(|outcome| outcome.aggregate_error.to_string()),
    ];
    cells.extend(metrics(study, Some(trained)).into_iter().map(|(_, value)| format!("{value:.6}")));
    cells.push(weights.join(" "));
    csv_row(cells)
}

fn metrics(study: &PreparedStudy, trained: Option<&ArmFit>) -> Vec<(String, f64)> {
    let judging = study.evaluation_settings();
    let value = |portion, pick| {
        trained.and_then(|trained| percent(&trained.fit.evaluation, portion, pick)).unwrap_or(f64::NAN)
    };
    let mut metrics = vec![
        ("error_percent".to_owned(), value(None, |s| s.average_m)),
        ("median_error_percent".to_owned(), value(None, |s| s.median_m)),
        ("p95_error_percent".to_owned(), value(None, |s| s.p95_m)),
        ("max_error_percent".to_owned(), value(None, |s| s.largest_m)),
    ];
    for portion in &judging.portions {
        let (key, within) = (portion.key(), Some(*portion));
        metrics.push((format!("error_percent_{key}"), value(within, |s| s.average_m)));
        metrics.push((format!("max_error_percent_{key}"), value(within, |s| s.largest_m)));
    }
    let effective = trained.map_or(f64::NAN, |t| t.fit.evaluation.effective_percent(judging.tolerance_m));
    metrics.push(("effective_length_percent".to_owned(), effective));
    metrics
}

pub fn cells<'r>(study: &PreparedStudy, row: &'r str) -> Result<((usize, u64), Vec<&'r str>), RowProblem> {
    let cells: Vec<&str> = row.split(',').collect();
    let wanted = OUTCOME_COLUMNS.len() + metrics(study, None).len() + 1;
    match cells[..] {
        [arm, seed, ..] if cells.len() == wanted => Ok((fit_of(study, arm, seed)?, cells)),
        _ => Err(RowProblem::Cells { found: cells.len(), wanted }),
    }
}

pub fn restore(
    study: &PreparedStudy,
    (arm, seed): (usize, u64),
    cells: &[&str],
) -> Result<ArmFit, RowProblem> {
    let [_, _, epochs, status, error, .., weights] = cells else {
        return Err(RowProblem::Cells { found: cells.len(), wanted: OUTCOME_COLUMNS.len() + 1 });
    };
    let outcome = TrainingOutcome {
        status: status_from(status)?,
        epochs: read_cell("epochs", epochs, "a whole number")?,
        aggregate_error: read_cell("aggregate_error", error, "a number")?,
    };
    let weights = weights.split(' ').map(|weight| read_cell("weights", weight, "a number"));
    let weights = weights.collect::<Result<Vec<f64>, _>>()?;
    let found = weights.len();
    study.restore(arm, seed, weights, outcome).ok_or(RowProblem::Weights { found })
}

fn status_from(name: &str) -> Result<TrainingStatus, RowProblem> {
    let all = [TrainingStatus::Converged, TrainingStatus::Capped, TrainingStatus::Diverged];
    let found = all.into_iter().find(|status| status.to_string() == name);
    found.ok_or_else(|| RowProblem::Cell {
        column: "status",
        found: super::shortened(name),
        wanted: "`converged`, `capped` or `diverged`",
    })
}
