//! CSV tables beside a report: the data of its figures.
//!
//! The first line is a comment with version, inputs and seed; column names contain units.

use crate::failure::Failure;
use crate::target::TargetFolder;
use palpate_estimators::evaluation::Evaluation;
use palpate_estimators::recording::{Provenance, csv_row};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use std::collections::BTreeMap;

pub const ERRORS_CSV: &str = "errors.csv";

pub struct CsvTable {
    text: String,
}

impl CsvTable {
    pub fn new(comment: &str, columns: impl IntoIterator<Item = impl AsRef<str>>) -> Self {
        let comment = comment.replace(['\r', '\n'], " ");
        Self { text: format!("# palpate {}, {comment}\n{}", env!("CARGO_PKG_VERSION"), csv_row(columns)) }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = impl AsRef<str>>) {
        self.text += &csv_row(cells);
    }

    pub fn write(&self, folder: &TargetFolder, name: &str) -> Result<(), Failure> {
        folder.write(name, self.text.as_bytes())
    }
}

/// Formats nine digits without trailing zeros; an empty cell for `None`.
pub fn cell(value: Option<f64>) -> String {
    let nine = |value: f64| -> f64 { format!("{value:.8e}").parse().unwrap_or(value) };
    value.filter(|value| value.is_finite()).map_or_else(String::new, |value| nine(value).to_string())
}

pub fn position_columns(extent: Extent) -> Vec<&'static str> {
    match extent {
        Extent::Line { .. } => vec!["position_mm"],
        Extent::Plane { .. } => vec!["x_mm", "y_mm"],
    }
}

pub fn position_cells(position: Position, extent: Extent) -> Vec<String> {
    extent.coordinates_m(position).map(|at_m| cell(Some(at_m * 1e3))).collect()
}

/// Columns of errors in millimetres and newtons, and of the coverage of 95 % regions and force
/// intervals.
pub const ERROR_COLUMNS: [&str; 9] = [
    "readings",
    "mean_error_mm",
    "median_error_mm",
    "p95_error_mm",
    "rms_error_mm",
    "max_error_mm",
    "covered_percent",
    "mean_force_error_n",
    "force_covered_percent",
];

pub fn error_cells(evaluation: &Evaluation) -> Vec<String> {
    let Some(errors) = evaluation.summary(None) else { return vec![String::new(); ERROR_COLUMNS.len()] };
    let figures_m = [errors.average_m, errors.median_m, errors.p95_m, errors.rmse_m, errors.largest_m];
    let mut cells = vec![errors.count.to_string()];
    cells.extend(figures_m.map(|error_m| cell(Some(error_m * 1e3))));
    cells.push(cell(evaluation.coverage_percent()));
    let forces = evaluation.force_summary();
    cells.push(cell(forces.map(|forces| forces.average_n)));
    cells.push(cell(forces.map(|forces| forces.coverage_percent)));
    cells
}

/// Share of the answers with each status in %; `None` if statuses were not kept.
pub fn status_percents(evaluation: &Evaluation) -> Option<BTreeMap<&'static str, f64>> {
    let percents = evaluation.status_percents()?;
    Some(percents.into_iter().map(|(status, percent)| (status.name(), percent)).collect())
}

#[derive(serde::Serialize)]
pub struct ForceErrors {
    count: usize,
    mean: f64,
    median: f64,
    p95: f64,
    max: f64,
    coverage_95: f64,
}

pub fn force_errors(evaluation: &Evaluation) -> Option<ForceErrors> {
    evaluation.force_summary().map(|forces| ForceErrors {
        count: forces.count,
        mean: forces.average_n,
        median: forces.median_n,
        p95: forces.p95_n,
        max: forces.largest_n,
        coverage_95: forces.coverage_percent,
    })
}

pub fn source_in_words(provenance: &Provenance) -> String {
    let digests = provenance.digests.iter().map(|digest| format!(" sha256 {digest}"));
    format!("{}{}", provenance.source, digests.collect::<String>())
}
