//! `networks.csv`: a row per fit of a study, written as it is finished; a study resumes from the networks in it.
//!
//! Columns are the arm, the seed, epochs, status and aggregate error of a network's training, the errors of the fit in % of the surface's length,
//! the effective length, and the weights of a network. What a fit of another estimator has not is an empty cell.
//!
//! Weights stand in the order in which `palpate_core::Network` has them: layer by layer from the input side, node by node of the layer; of
//! each node the weights of the nodes before it, in their order, and then, where there are biases, its bias. Inputs are the channels in the
//! layout's order.

use super::results::percent;
use super::{PreparedStudy, Study, Trained};
use palpate_estimators::network::{TrainingOutcome, TrainingStatus};
use palpate_estimators::recording::csv_row;

/// Writes and reads the rows of one study.
#[derive(Clone, Debug)]
pub struct NetworksCsv<'a> {
    study: &'a PreparedStudy,
}

/// Networks that a `networks.csv` holds.
#[derive(Clone, Debug, Default)]
pub struct Checkpoint {
    /// The networks of this study that the file holds.
    pub done: Vec<Trained>,
    /// The rows of all fits, those of other estimators too.
    pub rows: Vec<FitRow>,
    /// Whether the last line was cut off, as a crash leaves it; it was passed over.
    pub cut_off: bool,
}

/// The row of a fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FitRow {
    /// The arm, by its number from 0.
    pub arm: usize,
    /// The seed of the fit.
    pub seed: u64,
    /// The row as it is in the file, with its end.
    pub text: String,
}

/// Error of resuming a study from a `networks.csv`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// Another study, another file of it, or another palpate.
    #[error("line 1 belongs to another run: it is `{found}`; this study writes `{wanted}`")]
    Heading {
        /// The file's first line.
        found: String,
        /// The line that this study writes.
        wanted: String,
    },
    /// A row that this study does not write.
    #[error("line {line}: {what}")]
    Row {
        /// The line, from 1.
        line: usize,
        /// The problem.
        what: &'static str,
    },
}

const OUTCOME_COLUMNS: [&str; 5] = ["arm", "seed", "epochs", "status", "aggregate_error"];

impl<'a> NetworksCsv<'a> {
    /// The table of a study.
    pub fn new(study: &'a PreparedStudy) -> Self {
        Self { study }
    }

    /// The comment and the header that the file begins with. The comment names what rows may stand in one file.
    pub fn heading(&self) -> String {
        let Study { name, digest, precision, .. } = &self.study.study;
        let precision = format!("{precision:?}").to_lowercase();
        let version = env!("CARGO_PKG_VERSION");
        let mut columns: Vec<String> = OUTCOME_COLUMNS.map(str::to_owned).into();
        columns.extend(self.metrics(None).into_iter().map(|(name, _)| name));
        columns.push("weights".to_owned());
        format!("# palpate {version}, study {name}, sha256 {digest}, {precision}\n{}", csv_row(columns))
    }

    /// The row of a fit.
    pub fn row(&self, trained: &Trained) -> String {
        let outcome = trained.fit.locator.training_outcome();
        let told = |told: fn(&TrainingOutcome) -> String| outcome.as_ref().map_or_else(String::new, told);
        let weights: Vec<String> = trained.fit.locator.weights().iter().map(f64::to_string).collect();
        let mut cells = vec![
            self.study.study.arms[trained.arm].name.clone(),
            trained.fit.seed.to_string(),
            told(|outcome| outcome.epochs.to_string()),
            told(|outcome| outcome.status.to_string()),
            told(|outcome| outcome.aggregate_error.to_string()),
        ];
        cells.extend(self.metrics(Some(trained)).into_iter().map(|(_, value)| format!("{value:.6}")));
        cells.push(weights.join(" "));
        csv_row(cells)
    }

    /// The names of the metrics, with their values for a fit.
    fn metrics(&self, trained: Option<&Trained>) -> Vec<(String, f64)> {
        let judging = self.study.judging();
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

    /// The fits that an earlier run of this very study left.
    ///
    /// # Errors
    /// [`CheckpointError`] when the file belongs to another run or holds a row that this study does not write.
    pub fn resume(&self, text: &str) -> Result<Checkpoint, CheckpointError> {
        let wanted = self.heading();
        let Some(rows) = text.strip_prefix(&wanted) else {
            let found = text.lines().next().unwrap_or_default().chars().take(200).collect();
            let wanted = wanted.lines().next().unwrap_or_default().to_owned();
            return Err(CheckpointError::Heading { found, wanted });
        };
        let mut checkpoint =
            Checkpoint { cut_off: !rows.is_empty() && !rows.ends_with('\n'), ..Checkpoint::default() };
        let whole = rows.rfind('\n').map_or("", |end| &rows[..end]);
        for (i, row) in whole.lines().enumerate() {
            let (row, trained) =
                self.read_row(row).map_err(|what| CheckpointError::Row { line: i + 3, what })?;
            checkpoint.rows.push(row);
            checkpoint.done.extend(trained);
        }
        Ok(checkpoint)
    }

    /// A row with its network; `None` of a fit of another estimator, which has no weights to go on from.
    fn read_row(&self, row: &str) -> Result<(FitRow, Option<Trained>), &'static str> {
        let cells: Vec<&str> = row.split(',').collect();
        let [name, seed, epochs, status, error, .., weights] = cells[..] else {
            return Err("a row has too few cells");
        };
        let arm = self.study.study.arms.iter().position(|arm| arm.name == name);
        let arm = arm.ok_or("the study has no arm of this name")?;
        let seed = seed.parse().map_err(|_| "the seed is not a whole number")?;
        let fit_row = FitRow { arm, seed, text: format!("{row}\n") };
        if !self.study.is_kept(arm) {
            return Ok((fit_row, None));
        }
        let outcome = TrainingOutcome {
            status: status_from(status).ok_or("the status is none that training can have")?,
            epochs: epochs.parse().map_err(|_| "the epochs are not a whole number")?,
            aggregate_error: error.parse().map_err(|_| "the aggregate error is not a number")?,
        };
        let weights = weights.split(' ').map(str::parse).collect::<Result<Vec<f64>, _>>();
        let weights = weights.map_err(|_| "a weight is not a number")?;
        let trained = self.study.restore(arm, seed, weights, outcome);
        trained.map(|trained| (fit_row, Some(trained))).ok_or("the number of weights is not the network's")
    }
}

fn status_from(name: &str) -> Option<TrainingStatus> {
    let all = [TrainingStatus::Converged, TrainingStatus::Capped, TrainingStatus::Diverged];
    all.into_iter().find(|status| status.to_string() == name)
}
