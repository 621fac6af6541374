//! Evaluation of a locator: errors by position and by portion of the surface, and the effective length.

mod calibration;
mod mapped_positions;

pub use crate::split::{Split, SplitOrigin};
pub use calibration::{Calibrated, Calibration, simulate_use_all_over_watched};
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

/// True and estimated position of one reading's contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// True position of the contact.
    pub truth: Position,
    /// Force of the contact in newtons, where it is known.
    pub force_n: Option<f64>,
    /// Position that the locator gave.
    pub estimate: Position,
    /// Whether the locator's 95 % region contained the contact, where the locator has one.
    pub covered: Option<bool>,
    /// Score of the locator's 95 % intervals in metres, where it has them: see [`Evaluation::interval_score_m`].
    pub interval_score_m: Option<f64>,
    /// Status of the estimate; `None` where only its position was kept.
    pub status: Option<Status>,
    /// Force that the locator estimated, where it did and the contact's is known.
    pub force: Option<LocatedForce>,
}

/// Estimated force of one reading's contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocatedForce {
    /// Force that the locator gave, in newtons.
    pub estimate_n: f64,
    /// Whether the 95 % interval of the estimate contains the contact's force.
    pub covered: bool,
}

/// Summary of the errors of estimated forces.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ForceSummary {
    /// Number of forces.
    pub count: usize,
    /// Mean of the absolute errors, in newtons.
    pub average_n: f64,
    /// Median of the absolute errors, in newtons.
    pub median_n: f64,
    /// 95th percentile of the absolute errors, in newtons.
    pub p95_n: f64,
    /// Largest absolute error, in newtons.
    pub largest_n: f64,
    /// Share of the 95 % intervals that contain the force, in %.
    pub coverage_percent: f64,
}

impl Located {
    /// The contact of a row, with the estimate of its reading.
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

    /// The distance between true and estimated position, in metres.
    pub fn error_m(&self) -> f64 {
        self.truth.distance_m(self.estimate)
    }
}

/// A locator's estimates for a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The surface; percentage errors refer to its length.
    pub extent: Extent,
    /// The estimates, in the recording's order.
    pub located: Vec<Located>,
}

/// A part of the surface along its length, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Portion {
    /// Start, in metres.
    pub from_m: f64,
    /// End, in metres.
    pub to_m: f64,
}

impl Portion {
    /// Name in tables, in mm: "20_380" for 20–380 mm.
    pub fn key(&self) -> String {
        format!("{}_{}", self.from_m * 1e3, self.to_m * 1e3)
    }

    /// Whether a position lies in it, within a rounding error of 10⁻⁹ m.
    pub fn contains(&self, position: Position) -> bool {
        (self.from_m - 1e-9..=self.to_m + 1e-9).contains(&position.x_m)
    }
}

/// Summary of location errors.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ErrorSummary {
    /// Number of estimates.
    pub count: usize,
    /// Mean, in metres.
    pub average_m: f64,
    /// Median, in metres.
    pub median_m: f64,
    /// 95th percentile, in metres.
    pub p95_m: f64,
    /// Largest, in metres.
    pub largest_m: f64,
    /// Root of the mean square, in metres.
    pub rmse_m: f64,
}

/// Percentage error of the length l: e = |a − a′| / l · 100 (paper, eq. 2).
pub fn percentage_error(error_m: f64, length_m: f64) -> f64 {
    error_m / length_m * 100.0
}

/// Whether the 95 % region of an estimated contact contains `truth`: on a line the interval, on a plane the ellipse
/// (e − t)ᵀ·C⁻¹·(e − t) ≤ [`ELLIPSE_95`].
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

/// Interval score of a contact's 95 % intervals, averaged over its coordinates.
fn interval_score_m(contact: &ContactEstimate, truth: Position, extent: Extent) -> Option<f64> {
    let uncertainty = contact.uncertainty?;
    let x = score_of_interval(uncertainty.x_95_m, truth.x_m);
    Some(match extent {
        Extent::Line { .. } => x,
        Extent::Plane { .. } => 0.5 * (x + score_of_interval(uncertainty.y_95_m, truth.y_m)),
    })
}

/// Interval score u − l + 2/α·(l − x)⁺ + 2/α·(x − u)⁺ of the interval (l, u) that should contain x with the probability 1 − α = 0.95.
fn score_of_interval((low, high): (f64, f64), truth: f64) -> f64 {
    const ALPHA: f64 = 0.05;
    high - low + 2.0 / ALPHA * ((low - truth).max(0.0) + (truth - high).max(0.0))
}

impl Evaluation {
    /// Locates every reading of a recording with a contact.
    ///
    /// # Errors
    /// [`ReadingError`] when the recording's channels are not the locator's.
    pub fn new<M: Locate>(locator: &Fitted<M>, recording: &Recording) -> Result<Self, ReadingError> {
        let extent = locator.setup.surface().extent();
        let rows = recording.rows.iter().filter(|row| row.touches());
        let located = rows.map(|row| Ok(Located::new(row, &locator.locate(&row.reading)?, extent)));
        Ok(Self { extent, located: located.collect::<Result<_, _>>()? })
    }

    /// Locates a recording in batches, watched.
    ///
    /// # Errors
    /// [`BatchError`] when the recording's channels are not the locator's, or the watch stopped it.
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
        // One thread takes block after block.
        let take = |first: usize, estimates: &[Estimate]| {
            let judged = rows[first..].iter().zip(estimates);
            let judged = judged.map(|(row, estimate)| Located::new(row, estimate, extent));
            located.lock().unwrap_or_else(PoisonError::into_inner).extend(judged);
        };
        locator.locate_blocks(&readings, BatchOptions { watch, ..BatchOptions::default() }, &take)?;
        Ok(Self { extent, located: located.into_inner().unwrap_or_else(PoisonError::into_inner) })
    }

    /// The errors within a portion, or everywhere; `None` without a located contact.
    pub fn summary(&self, portion: Option<Portion>) -> Option<ErrorSummary> {
        let inside = |located: &&Located| portion.is_none_or(|portion| portion.contains(located.truth));
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

    /// Share of the contacts with an error of at most `tolerance_m`, in %. With contacts evenly along the surface it is
    /// the paper's effective length.
    pub fn effective_percent(&self, tolerance_m: f64) -> f64 {
        let good = self.located.iter().filter(|located| located.error_m() <= tolerance_m).count();
        100.0 * good as f64 / self.located.len() as f64
    }

    /// Share of the 95 % regions that contain their contact, in %; `None` for a locator without regions.
    pub fn coverage_percent(&self) -> Option<f64> {
        let told: Vec<bool> = self.located.iter().filter_map(|located| located.covered).collect();
        let held = told.iter().filter(|covered| **covered).count();
        (!told.is_empty()).then(|| 100.0 * held as f64 / told.len() as f64)
    }

    /// Share of the estimates with each status, in %, in the order of [`Status::ALL`]; `None` where statuses were not kept.
    pub fn status_percents(&self) -> Option<Vec<(Status, f64)>> {
        let statuses: Option<Vec<Status>> = self.located.iter().map(|located| located.status).collect();
        let statuses = statuses.filter(|statuses| !statuses.is_empty())?;
        let percent = |status: Status| {
            let count = statuses.iter().filter(|of| **of == status).count();
            (status, 100.0 * count as f64 / statuses.len() as f64)
        };
        Some(Status::ALL.into_iter().map(percent).collect())
    }

    /// Errors of the estimated forces; `None` where the locator estimates no force, or the contacts' forces are unknown.
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

    /// Mean interval score of the 95 % intervals, in metres: narrow intervals that contain the contact are good ones, and the score is least on
    /// average for the true quantiles (Gneiting and Raftery, J. Am. Stat. Assoc. 102, 2007, eq. 43).
    ///
    /// A locator without intervals is judged by the best intervals of one width everywhere about its estimates: the 95th percentile
    /// of its errors to either side. `None` without a located contact.
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

    /// The median error of the contacts in each cell, in metres; NaN for a cell without contacts.
    pub fn median_by_cell_m(&self, cells: &Cells) -> Vec<f64> {
        let median = |cell: Vec<&Located>| percentile(&sorted_errors_m(cell), 50.0).unwrap_or(f64::NAN);
        self.by_cell(cells).into_iter().map(median).collect()
    }

    /// The mean position and the median error of the contacts in each of `count` equal stretches along the surface, in metres; no entry
    /// for a stretch without contacts.
    pub fn median_by_stretch_m(&self, count: usize) -> Vec<(f64, f64)> {
        let extent = self.extent.along_x();
        let point = |stretch: Vec<&Located>| {
            let mean_m = stretch.iter().map(|located| located.truth.x_m).sum::<f64>() / stretch.len() as f64;
            Some((mean_m, percentile(&sorted_errors_m(stretch), 50.0)?))
        };
        let stretches = self.by_cell(&Cells { extent, columns: count, rows: 1 });
        stretches.into_iter().filter_map(point).collect()
    }

    fn by_cell(&self, cells: &Cells) -> Vec<Vec<&Located>> {
        let mut parts = vec![Vec::new(); cells.len()];
        for located in &self.located {
            parts[cells.cell_of(located.truth)].push(located);
        }
        parts
    }

    /// The 1st to the 100th percentile of the errors, in metres; empty without a located contact.
    pub fn percentiles_m(&self) -> Vec<(u32, f64)> {
        let errors = sorted_errors_m(&self.located);
        (1..=100).filter_map(|percent| Some((percent, percentile(&errors, f64::from(percent))?))).collect()
    }

    /// The estimates at each distinct position, by x and then y.
    pub fn by_position(&self) -> Vec<(Position, Self)> {
        let mut sorted = self.located.clone();
        sorted.sort_by(|a, b| a.truth.cmp_by_x_then_y(&b.truth));
        let groups = sorted.chunk_by(|a, b| a.truth == b.truth);
        let part = |located: &[Located]| Self { extent: self.extent, located: located.to_vec() };
        groups.map(|group| (group[0].truth, part(group))).collect()
    }
}

fn sorted_errors_m<'a>(located: impl IntoIterator<Item = &'a Located>) -> Vec<f64> {
    let mut errors: Vec<f64> = located.into_iter().map(Located::error_m).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Share of the length at either end, and of the width, where left and right cannot be distinguished at usual noise.
const ENDS: f64 = 1.0 / 80.0;
/// Largest limit that counts, as a share of the length: the limit is a bound for small errors, and no estimator reaches a larger one.
const LARGE_LIMIT: f64 = 1.0 / 200.0;
/// The largest limit that counts on a plane, where both directions share the readings.
const LARGE_LIMIT_ON_A_PLANE: f64 = 1.0 / 20.0;

/// Mean error over the limit's mean error, for the bench's noise; `None` where the limit does not exist. It counts contacts
/// at least 1/80 of the length from both ends, on a plane also of the width from both sides, where the limit is at most
/// 1/200 of the length, on a plane 1/20.
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

/// Median, 5th and 95th percentile of a figure over many seeds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Quantiles {
    /// Half of the seeds lie below.
    pub median: f64,
    /// One in twenty lies below.
    pub p05: f64,
    /// One in twenty lies above.
    pub p95: f64,
}

impl Quantiles {
    /// These quantiles in another unit: each is multiplied by `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self { median: self.median * factor, p05: self.p05 * factor, p95: self.p95 * factor }
    }

    /// The quantiles of some values, in any order; `None` without values.
    pub fn from_values(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        Some(Self {
            median: percentile(&values, 50.0)?,
            p05: percentile(&values, 5.0)?,
            p95: percentile(&values, 95.0)?,
        })
    }
}

/// An evaluation over some splits together, and the time it took.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedEvaluation {
    /// The estimates.
    pub evaluation: Evaluation,
    /// Mean time of a fit, by the caller's clock.
    pub fit_seconds: f64,
    /// Mean time of an estimate in nanoseconds, by the caller's clock.
    pub locate_ns: f64,
}

/// Fits an estimator to the training part of each split and locates the contacts of its judged part. `clock` returns seconds since any fixed moment.
///
/// # Errors
/// [`EvaluationError`] when the estimator does not suit the setup or a recording, or the watch stopped it.
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

/// Evaluates the locators that `fit` gives for splits; see [`HoldOutTask::run`].
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
        Located::of_contact(*truth, *force_n, estimate, extent)
    });
    let evaluation = Evaluation { extent, located: located.collect() };
    let readings = evaluation.located.len().max(1) as f64;
    Ok(TimedEvaluation {
        evaluation,
        fit_seconds: fitting_s / splits.len().max(1) as f64,
        locate_ns: locating_s / readings * 1e9,
    })
}

/// An estimator that cannot be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError<E: std::error::Error + 'static> {
    /// The setup cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Too few positions for the folds.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// The estimator does not fit.
    #[error(transparent)]
    Fit(E),
    /// A reading does not suit the locator.
    #[error(transparent)]
    Reading(#[from] ReadingError),
}

impl<E: From<Cancelled> + std::error::Error + 'static> From<Cancelled> for EvaluationError<E> {
    fn from(cancelled: Cancelled) -> Self {
        Self::Fit(cancelled.into())
    }
}

/// Fits an estimator to each fold's training rows and locates the held-out ones; returns the estimates of all folds together. Folds are by position,
/// see [`Recording::folds`](crate::recording::Recording::folds). An estimator that chooses among others chooses without the held-out rows.
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
/// [`EvaluationError`] when a fold cannot be fitted, or the watch stopped it.
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
