//! Errors of a locator.

mod calibration;
mod mapped_positions;

pub use crate::split::{Split, SplitOrigin};
pub use calibration::{Calibration, CalibrationTrial, simulate_use_all_over_watched};
pub use mapped_positions::{MappedPositions, SurfaceMap};
pub use palpate_numerics::{median, percentile};

use crate::batch::{BatchError, BatchOptions};
use crate::estimate_record::ContactRecord;
use crate::fit::{Fit, FitTask, Fitted, HeldOut, HoldOutError, HoldOutTask, Locate, ReadingError};
use crate::interval_check::{HeldOutEstimate, widen_by_other_folds};
use crate::load_profile::Cells;
use crate::recording::{Recording, Row, TooFewPositions};
use crate::setup::Setup;
use crate::simulate::SimulateError;
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_numerics::small::Ldl;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{ELLIPSE_95, mean, root_mean_square};
use std::sync::{Mutex, PoisonError};

/// True and estimated contact of one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluatedContact {
    /// True position.
    pub truth: Position,
    /// True force, where known.
    pub force_n: Option<f64>,
    /// Estimated position.
    pub estimate: Position,
    /// True for a contact in the 95 % region.
    pub covered: Option<bool>,
    /// Interval score: see [`Evaluation::interval_score_m`].
    pub interval_score_m: Option<f64>,
    /// Status of the estimate, where kept.
    pub status: Option<Status>,
    /// Estimated force, where the true one is known.
    pub force: Option<LocatedForce>,
}

/// Estimated force of one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocatedForce {
    /// Estimate.
    pub estimate_n: f64,
    /// True for a force in the 95 % interval.
    pub covered: bool,
}

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

impl EvaluatedContact {
    fn new(row: &Row, estimate: &Estimate, extent: Extent) -> Self {
        Self::of_contact(row.position, row.force_n, estimate, extent)
    }

    fn of_contact(truth: Position, force_n: Option<f64>, estimate: &Estimate, extent: Extent) -> Self {
        let contact = &estimate.contact;
        let force = || {
            let [low_n, high_n] = ContactRecord::new(contact, extent).force_interval_95_n()?;
            Some(LocatedForce { estimate_n: contact.force_n?, covered: (low_n..=high_n).contains(&force_n?) })
        };
        Self {
            truth,
            force_n,
            estimate: contact.position,
            covered: covered(contact, truth, extent),
            interval_score_m: interval_score_m(contact, truth, extent),
            status: Some(estimate.status),
            force: force(),
        }
    }

    /// Position error.
    pub fn error_m(&self) -> f64 {
        self.truth.distance_m(self.estimate)
    }
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

/// True for `truth` in the 95 % interval or ellipse (e − t)ᵀ·C⁻¹·(e − t) ≤ [`ELLIPSE_95`].
pub(crate) fn covered(contact: &ContactEstimate, truth: Position, extent: Extent) -> Option<bool> {
    let uncertainty = contact.uncertainty?;
    if let Extent::Line { .. } = extent {
        let (low, high) = uncertainty.x_95_m;
        return Some((low..=high).contains(&truth.x_m));
    }
    let [xx, xy, _, yy, ..] = uncertainty.covariance;
    let (dx, dy) = (contact.position.x_m - truth.x_m, contact.position.y_m - truth.y_m);
    let factors = Ldl::new(&[[xx, xy], [xy, yy]]);
    Some(factors.is_some_and(|factors| factors.quadratic([dx, dy]) <= ELLIPSE_95))
}

fn interval_score_m(contact: &ContactEstimate, truth: Position, extent: Extent) -> Option<f64> {
    let uncertainty = contact.uncertainty?;
    let x = score_of_interval(uncertainty.x_95_m, truth.x_m);
    Some(match extent {
        Extent::Line { .. } => x,
        Extent::Plane { .. } => 0.5 * (x + score_of_interval(uncertainty.y_95_m, truth.y_m)),
    })
}

/// u − l + 2/α·(l − x)⁺ + 2/α·(x − u)⁺ for α = 0.05.
fn score_of_interval((low, high): (f64, f64), truth: f64) -> f64 {
    const ALPHA: f64 = 0.05;
    high - low + 2.0 / ALPHA * ((low - truth).max(0.0) + (truth - high).max(0.0))
}

impl Evaluation {
    /// Locates every contact of a recording.
    ///
    /// # Errors
    /// [`ReadingError`].
    pub fn new<M: Locate>(locator: &Fitted<M>, recording: &Recording) -> Result<Self, ReadingError> {
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
        locator: &Fitted<M>,
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
            let judged = rows[first..].iter().zip(estimates);
            let judged = judged.map(|(row, estimate)| EvaluatedContact::new(row, estimate, extent));
            located.lock().unwrap_or_else(PoisonError::into_inner).extend(judged);
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

    /// Coverage of the 95 % regions.
    pub fn coverage_percent(&self) -> Option<f64> {
        let told: Vec<bool> = self.located.iter().filter_map(|located| located.covered).collect();
        let held = told.iter().filter(|covered| **covered).count();
        (!told.is_empty()).then(|| 100.0 * held as f64 / told.len() as f64)
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
        let told: Vec<f64> = self.located.iter().filter_map(|located| located.interval_score_m).collect();
        if !told.is_empty() && told.len() == self.located.len() {
            return Some(mean(told));
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

/// Ill-conditioned share of the length and width at each end.
const ENDS: f64 = 1.0 / 80.0;
/// Relative to the length; larger bounds are not attained.
const LARGE_LIMIT: f64 = 1.0 / 200.0;
/// Two coordinates share the information.
const LARGE_LIMIT_ON_A_PLANE: f64 = 1.0 / 20.0;

/// Returns the mean error over the mean Cramér–Rao bound, without contacts within 1/80 of an end or side, and
/// without bounds above 1/200 of the length (plane: 1/20).
pub fn limit_ratio(setup: &Setup, evaluation: &Evaluation) -> Option<f64> {
    let limit = setup.cramer_rao_bound().ok()?;
    let extent = setup.surface().extent();
    let within =
        |at_m: f64, size_m: f64| (ENDS * size_m - 1e-9..=(1.0 - ENDS) * size_m + 1e-9).contains(&at_m);
    let is_inner = |at: Position| {
        within(at.x_m, extent.length_m()) && extent.width_m().is_none_or(|width_m| within(at.y_m, width_m))
    };
    let large = match extent {
        Extent::Line { .. } => LARGE_LIMIT,
        Extent::Plane { .. } => LARGE_LIMIT_ON_A_PLANE,
    };
    let (mut error_m, mut bound_m) = (0.0, 0.0);
    for located in &evaluation.located {
        let Some(force_n) = located.force_n.or(setup.force_n()) else { continue };
        let bound = limit.bound_at(Contact { position: located.truth, force_n }, setup.force());
        let Some(bound) = bound.filter(|bound| bound.sd_position_m <= large * extent.length_m()) else {
            continue;
        };
        if is_inner(located.truth) {
            error_m += located.error_m();
            bound_m += bound.mean_error_m();
        }
    }
    (bound_m > 0.0).then(|| error_m / bound_m)
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

/// Evaluation over splits, with computing times.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedEvaluation {
    /// Estimates.
    pub evaluation: Evaluation,
    /// Mean time of a fit.
    pub fit_seconds: f64,
    /// Mean time of an estimate.
    pub locate_ns: f64,
}

/// Fits and evaluates an estimator on each split, with a `clock` in seconds.
///
/// # Errors
/// [`EvaluationError`].
pub fn evaluate_splits<E: Fit>(
    setup: &Setup,
    estimator: &E,
    splits: &[Split],
    seed: u64,
    clock: &dyn Fn() -> f64,
    watch: Watch,
) -> Result<TimedEvaluation, EvaluationError<E::Error>> {
    let fit = |_, task: FitTask| Ok((estimator.fit_without_interval_check(task)?, 0.0));
    evaluate_held_out(&HoldOutTask { setup, splits, seed, clock, watch, memo: None }, fit)
}

pub(crate) fn evaluate_held_out<M: Locate, E: std::error::Error>(
    task: &HoldOutTask,
    fit: impl Fn(usize, FitTask) -> Result<(Fitted<M>, f64), E>,
) -> Result<TimedEvaluation, EvaluationError<E>> {
    let HoldOutTask { setup, splits, .. } = *task;
    let extent = setup.surface().extent();
    let held_out = task.run(fit).map_err(|error| match error {
        HoldOutError::Fit(error) => EvaluationError::Fit(error),
        HoldOutError::Reading(error) => error.into(),
    })?;
    let HeldOut { mut estimates, fitting_s, locating_s } = held_out;
    if splits.iter().all(|split| split.origin == SplitOrigin::Fold) {
        widen_by_other_folds(&mut estimates, extent);
    }
    let located = estimates.iter().map(|HeldOutEstimate { truth, force_n, estimate, .. }| {
        EvaluatedContact::of_contact(*truth, *force_n, estimate, extent)
    });
    let evaluation = Evaluation { extent, located: located.collect() };
    let readings = evaluation.located.len().max(1) as f64;
    Ok(TimedEvaluation {
        evaluation,
        fit_seconds: fitting_s / splits.len().max(1) as f64,
        locate_ns: locating_s / readings * 1e9,
    })
}

/// Error of an evaluation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError<E: std::error::Error + 'static> {
    /// Failed simulation.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Too few positions for the folds.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Failed fit.
    #[error(transparent)]
    Fit(E),
    /// Invalid reading.
    #[error(transparent)]
    Reading(#[from] ReadingError),
}

impl<E: From<Cancelled> + std::error::Error + 'static> From<Cancelled> for EvaluationError<E> {
    fn from(cancelled: Cancelled) -> Self {
        Self::Fit(cancelled.into())
    }
}

/// Returns held-out estimates by position (see [`Recording::folds`](crate::recording::Recording::folds)),
/// with any choice of estimator in each fold.
///
/// ```
/// use palpate_estimators::{arrangement::Training, evaluation::cross_validate, fit::FitTask, influence::Influence, setup::Setup};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(10).repeated(5), 0)?;
/// let held_out = cross_validate(&Influence::default(), FitTask::new(&setup, &presses), 5)?;
/// assert!(held_out.summary(None).expect("50 presses").median_m < mm(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`EvaluationError`].
pub fn cross_validate<E: Fit>(
    estimator: &E,
    task: FitTask,
    folds: usize,
) -> Result<Evaluation, EvaluationError<E::Error>> {
    let splits = Split::by_folds(task.recording, folds)?;
    Ok(evaluate_splits(task.setup, estimator, &splits, task.seed, &|| 0.0, task.watch)?.evaluation)
}

#[cfg(test)]
mod tests;
