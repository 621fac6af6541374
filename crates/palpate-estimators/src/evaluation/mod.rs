//! Errors of a locator.

mod calibration;
mod contact;
mod cross_validation;
mod intervals;
mod limit_ratio;
mod mapped_positions;

pub use crate::split::{Split, SplitOrigin};
pub use calibration::{Calibration, CalibrationTrial, simulate_use_all_over_watched};
pub use contact::{EvaluatedContact, LocatedForce};
pub(crate) use cross_validation::evaluate_held_out;
pub use cross_validation::{EvaluationError, TimedEvaluation, cross_validate, evaluate_splits};
pub use intervals::CoveredCoordinates;
pub use limit_ratio::limit_ratio;
pub use mapped_positions::{MappedPositions, SurfaceMap};
pub use palpate_numerics::{median, percentile};

use crate::batch::{BatchError, BatchOptions};
use crate::fit::{Locate, MethodLocator, ReadingError};
use crate::load_profile::Cells;
use crate::recording::{Recording, Row};
use intervals::score_of_interval;
use palpate_core::{Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::Watch;
use palpate_numerics::{mean, root_mean_square};
use std::sync::{Mutex, PoisonError};

/// Summary of force errors.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ForceSummary {
    /// Number of forces.
    pub count: usize,
    /// Mean absolute error.
    pub average_n: f64,
    /// Median absolute error.
    pub median_n: f64,
    /// 95th percentile of absolute errors.
    pub p95_n: f64,
    /// Largest absolute error.
    pub largest_n: f64,
    /// Coverage of the 95 % intervals.
    pub coverage_percent: f64,
}

/// Estimates of a locator for a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Surface; percentage errors refer to its length.
    pub extent: Extent,
    /// Estimates in the order of the recording.
    pub located: Vec<EvaluatedContact>,
}

/// Closed portion of the length.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Portion {
    /// Start.
    pub from_m: f64,
    /// End.
    pub to_m: f64,
}

impl Portion {
    /// Name in tables: "20_380" for 20–380 mm.
    pub fn key(&self) -> String {
        format!("{}_{}", self.from_m * 1e3, self.to_m * 1e3)
    }

    /// True within 10⁻⁹ m of the portion.
    pub fn contains(&self, position: Position) -> bool {
        (self.from_m - 1e-9..=self.to_m + 1e-9).contains(&position.x_m)
    }
}

/// Summary of position errors.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ErrorSummary {
    /// Number of estimates.
    pub count: usize,
    /// Mean.
    pub average_m: f64,
    /// Median.
    pub median_m: f64,
    /// 95th percentile.
    pub p95_m: f64,
    /// Maximum.
    pub largest_m: f64,
    /// Root mean square.
    pub rmse_m: f64,
}

/// Returns e = |a − a′| / l · 100 (paper, eq. 2).
pub fn percentage_error(error_m: f64, length_m: f64) -> f64 {
    error_m / length_m * 100.0
}

impl Evaluation {
    /// Locates every contact of a recording.
    ///
    /// # Errors
    /// [`ReadingError`].
    pub fn new<M: Locate>(locator: &MethodLocator<M>, recording: &Recording) -> Result<Self, ReadingError> {
        let extent = locator.setup.surface().extent();
        let rows = recording.rows.iter().filter(|row| row.touches());
        let located = rows.map(|row| Ok(EvaluatedContact::new(row, &locator.locate(&row.reading)?, extent)));
        Ok(Self { extent, located: located.collect::<Result<_, _>>()? })
    }

    /// Locates a recording in batches, watched.
    ///
    /// # Errors
    /// [`BatchError`].
    pub fn new_watched<M>(
        locator: &MethodLocator<M>,
        recording: &Recording,
        watch: Watch,
    ) -> Result<Self, BatchError>
    where
        M: Locate + Sync,
        M::Check: Sync,
    {
        let extent = locator.setup.surface().extent();
        let rows: Vec<&Row> = recording.rows.iter().filter(|row| row.touches()).collect();
        let channels = locator.layout().len();
        if let Some(row) = rows.iter().position(|row| row.reading.len() != channels) {
            let error = ReadingError::Channels { needed: channels, found: rows[row].reading.len() };
            return Err(BatchError::Reading { row: row + 1, error });
        }
        let readings: Vec<f64> = rows.iter().flat_map(|row| row.reading.iter().copied()).collect();
        let located = Mutex::new(Vec::with_capacity(rows.len()));
        let take = |first: usize, estimates: &[Estimate]| {
            let contacts = rows[first..].iter().zip(estimates);
            let contacts = contacts.map(|(row, estimate)| EvaluatedContact::new(row, estimate, extent));
            located.lock().unwrap_or_else(PoisonError::into_inner).extend(contacts);
        };
        locator.locate_blocks(&readings, BatchOptions { watch, ..BatchOptions::default() }, &take)?;
        Ok(Self { extent, located: located.into_inner().unwrap_or_else(PoisonError::into_inner) })
    }

    /// Returns the errors in a portion, or everywhere.
    pub fn summary(&self, portion: Option<Portion>) -> Option<ErrorSummary> {
        let inside =
            |located: &&EvaluatedContact| portion.is_none_or(|portion| portion.contains(located.truth));
        let errors = sorted_errors_m(self.located.iter().filter(inside));
        Some(ErrorSummary {
            count: errors.len(),
            average_m: mean(errors.iter().copied()),
            median_m: percentile(&errors, 50.0)?,
            p95_m: percentile(&errors, 95.0)?,
            largest_m: *errors.last()?,
            rmse_m: root_mean_square(&errors),
        })
    }

    /// Returns the share of errors up to `tolerance_m`, the paper's effective length.
    pub fn effective_percent(&self, tolerance_m: f64) -> f64 {
        let good = self.located.iter().filter(|located| located.error_m() <= tolerance_m).count();
        100.0 * good as f64 / self.located.len() as f64
    }

    /// Share of the true coordinates within their 95 % intervals, in %. On planes it is the mean of the shares
    /// of x and y.
    pub fn coverage_percent(&self) -> Option<f64> {
        let covered = self.located.iter().filter_map(|located| located.covered);
        let coordinates: Vec<bool> = covered.flat_map(CoveredCoordinates::coordinates).collect();
        let count = coordinates.iter().filter(|is_covered| **is_covered).count();
        (!coordinates.is_empty()).then(|| 100.0 * count as f64 / coordinates.len() as f64)
    }

    /// Share of each status in %, in the order of [`Status::ALL`].
    pub fn status_percents(&self) -> Option<Vec<(Status, f64)>> {
        let statuses: Option<Vec<Status>> = self.located.iter().map(|located| located.status).collect();
        let statuses = statuses.filter(|statuses| !statuses.is_empty())?;
        let percent = |status: Status| {
            let count = statuses.iter().filter(|of| **of == status).count();
            (status, 100.0 * count as f64 / statuses.len() as f64)
        };
        Some(Status::ALL.into_iter().map(percent).collect())
    }

    /// Errors of estimated forces.
    pub fn force_summary(&self) -> Option<ForceSummary> {
        let forces: Vec<(f64, bool)> = self
            .located
            .iter()
            .filter_map(|located| {
                let force = located.force?;
                Some(((force.estimate_n - located.force_n?).abs(), force.covered))
            })
            .collect();
        let mut errors_n: Vec<f64> = forces.iter().map(|(error_n, _)| *error_n).collect();
        errors_n.sort_by(f64::total_cmp);
        let covered = forces.iter().filter(|(_, covered)| *covered).count();
        Some(ForceSummary {
            count: errors_n.len(),
            average_n: mean(errors_n.iter().copied()),
            median_n: percentile(&errors_n, 50.0)?,
            p95_n: percentile(&errors_n, 95.0)?,
            largest_n: *errors_n.last()?,
            coverage_percent: 100.0 * covered as f64 / forces.len() as f64,
        })
    }

    /// Mean 95 % interval score, least for the true quantiles (Gneiting and Raftery, J. Am. Stat. Assoc. 102,
    /// 2007, eq. 43).
    ///
    /// Without intervals: constant ones, ± the 95th percentile of errors.
    pub fn interval_score_m(&self) -> Option<f64> {
        let scores: Vec<f64> = self.located.iter().filter_map(|located| located.interval_score_m).collect();
        if !scores.is_empty() && scores.len() == self.located.len() {
            return Some(mean(scores));
        }
        let half_m = percentile(&sorted_errors_m(&self.located), 95.0)?;
        let scores =
            self.located.iter().map(|located| score_of_interval((-half_m, half_m), located.error_m()));
        Some(mean(scores))
    }

    /// Returns the median error by cell; NaN for an empty one.
    pub fn median_by_cell_m(&self, cells: &Cells) -> Vec<f64> {
        let median =
            |cell: Vec<&EvaluatedContact>| percentile(&sorted_errors_m(cell), 50.0).unwrap_or(f64::NAN);
        self.by_cell(cells).into_iter().map(median).collect()
    }

    /// Returns mean position and median error in each of `count` equal sections with contacts.
    pub fn median_by_stretch_m(&self, count: usize) -> Vec<(f64, f64)> {
        let extent = self.extent.along_x();
        let point = |stretch: Vec<&EvaluatedContact>| {
            let mean_m = stretch.iter().map(|located| located.truth.x_m).sum::<f64>() / stretch.len() as f64;
            Some((mean_m, percentile(&sorted_errors_m(stretch), 50.0)?))
        };
        let stretches = self.by_cell(&Cells { extent, columns: count, rows: 1 });
        stretches.into_iter().filter_map(point).collect()
    }

    fn by_cell(&self, cells: &Cells) -> Vec<Vec<&EvaluatedContact>> {
        let mut parts = vec![Vec::new(); cells.len()];
        for located in &self.located {
            parts[cells.cell_of(located.truth)].push(located);
        }
        parts
    }

    /// 1st to 100th percentile of errors.
    pub fn percentiles_m(&self) -> Vec<(u32, f64)> {
        let errors = sorted_errors_m(&self.located);
        (1..=100).filter_map(|percent| Some((percent, percentile(&errors, f64::from(percent))?))).collect()
    }

    /// Estimates by position.
    pub fn by_position(&self) -> Vec<(Position, Self)> {
        let mut sorted = self.located.clone();
        sorted.sort_by(|a, b| a.truth.cmp_by_x_then_y(&b.truth));
        let groups = sorted.chunk_by(|a, b| a.truth == b.truth);
        let part = |located: &[EvaluatedContact]| Self { extent: self.extent, located: located.to_vec() };
        groups.map(|group| (group[0].truth, part(group))).collect()
    }
}

fn sorted_errors_m<'a>(located: impl IntoIterator<Item = &'a EvaluatedContact>) -> Vec<f64> {
    let mut errors: Vec<f64> = located.into_iter().map(EvaluatedContact::error_m).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Median, 5th and 95th percentile over seeds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Quantiles {
    /// 50th percentile.
    pub median: f64,
    /// 5th percentile.
    pub p05: f64,
    /// 95th percentile.
    pub p95: f64,
}

impl Quantiles {
    /// Multiplies each quantile by `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self { median: self.median * factor, p05: self.p05 * factor, p95: self.p95 * factor }
    }

    /// Returns the quantiles of values in any order.
    pub fn from_values(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        Some(Self {
            median: percentile(&values, 50.0)?,
            p05: percentile(&values, 5.0)?,
            p95: percentile(&values, 95.0)?,
        })
    }
}

#[cfg(test)]
mod tests;
