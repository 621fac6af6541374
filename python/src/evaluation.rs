//! Evaluations: true contacts and estimates of a locator.

use std::sync::Arc;

use palpate::estimators::estimator::Status;
use palpate::estimators::evaluation::{
    self, CoveredCoordinates, ErrorSummary, EvaluatedContact, LocatedForce, Portion, limit_ratio,
    percentage_error,
};
use palpate::estimators::setup;
use palpate::mechanics::contact::Position;
use palpate::mechanics::surface::Extent;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::refused;
use crate::quantities::length_m;
use crate::values::Fields;

/// Errors of a locator on a recording, or of an estimator at positions held out, contact by contact.
///
/// `Locator.evaluate`, `cross_validate` and `compare` make evaluations.
#[pyclass(frozen, module = "palpate")]
pub struct Evaluation {
    inner: evaluation::Evaluation,
    setup: Arc<setup::Setup>,
    about: EvaluationOrigin,
}

/// Figures by name, in metres.
pub const FIGURES: [(&str, Figure); 5] = [
    ("mean", |errors| errors.average_m),
    ("median", |errors| errors.median_m),
    ("p95", |errors| errors.p95_m),
    ("rmse", |errors| errors.rmse_m),
    ("max", |errors| errors.largest_m),
];

pub type Figure = fn(&ErrorSummary) -> f64;

#[derive(Clone)]
pub struct EvaluationOrigin {
    pub kind: String,
    pub source: String,
    /// Use of the recording.
    pub how: String,
}

impl Evaluation {
    pub fn new(inner: evaluation::Evaluation, setup: Arc<setup::Setup>, about: EvaluationOrigin) -> Self {
        Self { inner, setup, about }
    }

    fn fields<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let located = || self.inner.located.iter();
        let fields = Fields::new(py);
        let truths: Vec<Position> = located().map(|located| located.truth).collect();
        fields.positions(&truths, self.inner.extent)?;
        fields.column("force", located().map(|located| located.force_n))?;
        fields.column("estimated_x", located().map(|located| Some(located.estimate.x_m)))?;
        match self.inner.extent {
            Extent::Line { .. } => fields.set("estimated_y", py.None())?,
            Extent::Plane { .. } => {
                fields.column("estimated_y", located().map(|located| Some(located.estimate.y_m)))?;
            }
        }
        fields.column("error", located().map(|located| Some(located.error_m())))?;
        fields.column("covered", located().map(|located| located.covered.map(CoveredCoordinates::share)))?;
        fields.column("interval_score", located().map(|located| located.interval_score_m))?;
        let force = |located: &EvaluatedContact| located.force.map(|force| force.estimate_n);
        fields.column("estimated_force", located().map(force))?;
        Ok(fields.into_dict())
    }

    fn field<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.fields(py)?.get_item(name)?.filter(|value| !value.is_none()))
    }
}

#[pymethods]
impl Evaluation {
    /// Kind of the estimator.
    #[getter]
    fn kind(&self) -> &str {
        &self.about.kind
    }

    /// Name of the recording.
    #[getter]
    fn source(&self) -> &str {
        &self.about.source
    }

    /// How its contacts were located, in words.
    #[getter]
    fn how(&self) -> &str {
        &self.about.how
    }

    /// Length of the surface in metres, to which percentage errors refer.
    #[getter]
    fn length(&self) -> f64 {
        self.inner.extent.length_m()
    }

    /// True positions along the surface, in metres: of the shape (contacts).
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "x")
    }

    /// True positions across a plane, in metres: of the shape (contacts); None on a line.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "y")
    }

    /// Forces in newtons, NaN for forces that were not measured: of the shape (contacts).
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "force")
    }

    /// Estimated positions along the surface, in metres: of the shape (contacts).
    #[getter]
    fn estimated_x<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "estimated_x")
    }

    /// Estimated positions across a plane, in metres: of the shape (contacts); None on a line.
    #[getter]
    fn estimated_y<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "estimated_y")
    }

    /// Distances between the two, in metres: of the shape (contacts).
    #[getter]
    fn error<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "error")
    }

    /// Share of the coordinates (x; on a plane x and y) within the locator's 95 % intervals, NaN where it has none: of the shape (contacts).
    #[getter]
    fn covered<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "covered")
    }

    /// Share of the true coordinates within their 95 % intervals, on a plane the mean of the shares of x and y; None without intervals.
    #[getter]
    fn coverage(&self) -> Option<f64> {
        self.inner.coverage_percent().map(|percent| percent / 100.0)
    }

    /// Mean interval score of the 95 % intervals, in metres (Gneiting and Raftery 2007, eq. 43); small where narrow intervals contain their contacts.
    #[getter]
    fn interval_score(&self) -> Option<f64> {
        self.inner.interval_score_m()
    }

    /// Share of the contacts for each status of their estimates; None where statuses were not kept.
    ///
    /// Returns
    /// -------
    /// dict of float
    #[getter]
    fn statuses<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(percents) = self.inner.status_percents() else { return Ok(None) };
        let fields = Fields::new(py);
        percents.iter().try_for_each(|(status, percent)| fields.set(status.name(), percent / 100.0))?;
        Ok(Some(fields.into_dict()))
    }

    /// Forces that the locator estimated, in newtons, NaN where it estimated none: of the shape (contacts).
    #[getter]
    fn estimated_force<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.field(py, "estimated_force")
    }

    /// Summary of the errors of estimated forces; None where the locator estimates none, or the contacts' are not known.
    ///
    /// Returns
    /// -------
    /// dict
    ///     "count"; "mean", "median", "p95" and "max" of the absolute errors in newtons; "coverage", the share of the 95 % intervals that
    ///     contain the force.
    fn force_summary<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(forces) = self.inner.force_summary() else { return Ok(None) };
        let fields = Fields::new(py);
        fields.set("count", forces.count)?;
        fields.set("mean", forces.average_n)?;
        fields.set("median", forces.median_n)?;
        fields.set("p95", forces.p95_n)?;
        fields.set("max", forces.largest_n)?;
        fields.set("coverage", forces.coverage_percent / 100.0)?;
        Ok(Some(fields.into_dict()))
    }

    /// Mean error over that of an estimator at the limit, where the bench has one; None elsewhere.
    ///
    /// Counted are contacts at least 1/80 of the length from both ends, on a plane also of the width from both sides, where the limit is small.
    fn limit_ratio(&self, py: Python<'_>) -> Option<f64> {
        py.detach(|| limit_ratio(&self.setup, &self.inner))
    }

    /// Summary of the errors.
    ///
    /// Parameters
    /// ----------
    /// portion : tuple, optional
    ///     Start and end of the portion of the surface to be judged, along its length, in metres or with units; by default all of it.
    /// percent : bool
    ///     In % of the length instead of metres: the founding paper's percentage error.
    ///
    /// Returns
    /// -------
    /// dict
    ///     "count", "mean", "median", "p95", "rmse", "max".
    ///
    /// Raises
    /// ------
    /// PalpateError
    ///     For a portion without a contact.
    #[pyo3(signature = (portion=None, *, percent=false))]
    fn summary<'py>(
        &self,
        py: Python<'py>,
        portion: Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
        percent: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let portion = portion.map(|(from, to)| {
            let portion = Portion { from_m: length_m(&from, "portion")?, to_m: length_m(&to, "portion")? };
            if portion.from_m < portion.to_m {
                return Ok(portion);
            }
            let Portion { from_m, to_m } = portion;
            Err(refused(format!(
                "`portion` goes from {from_m} m to {to_m} m; it must end beyond where it begins"
            )))
        });
        let portion = portion.transpose()?;
        let summary = self.inner.summary(portion).ok_or_else(|| {
            let place = portion.map_or_else(
                || "the whole surface".to_owned(),
                |portion| format!("{}–{} mm", portion.from_m * 1e3, portion.to_m * 1e3),
            );
            refused(format!(
                "{place} has no contact in {}; name a portion that was pressed",
                self.about.source
            ))
        })?;
        let unit = |error_m| if percent { percentage_error(error_m, self.length()) } else { error_m };
        let fields = Fields::new(py);
        fields.set("count", summary.count)?;
        FIGURES.iter().try_for_each(|(name, of)| fields.set(name, unit(of(&summary))))?;
        Ok(fields.into_dict())
    }

    /// Share of the contacts with an error within a tolerance; with contacts evenly over the surface the effective length, or area.
    ///
    /// Parameters
    /// ----------
    /// tolerance : float or str
    ///     In metres or with a unit; 2 mm by default.
    #[pyo3(signature = (tolerance=None))]
    fn effective_length(&self, tolerance: Option<Bound<'_, PyAny>>) -> PyResult<f64> {
        let tolerance_m = tolerance.map_or(Ok(2e-3), |tolerance| length_m(&tolerance, "tolerance"))?;
        if tolerance_m <= 0.0 {
            return Err(refused(format!("`tolerance` is {tolerance_m} m; it must be greater than 0")));
        }
        Ok(self.inner.effective_percent(tolerance_m) / 100.0)
    }

    /// Errors of each distinct position, by x and then y.
    ///
    /// Returns
    /// -------
    /// ErrorsByPosition
    fn by_position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let by_position = self.inner.by_position();
        let positions: Vec<Position> = by_position.iter().map(|(position, _)| *position).collect();
        let summaries: Vec<Option<ErrorSummary>> =
            by_position.iter().map(|(_, answers)| answers.summary(None)).collect();
        let fields = Fields::new(py);
        fields.positions(&positions, self.inner.extent)?;
        fields.column("count", summaries.iter().map(|errors| Some(errors.as_ref()?.count as f64)))?;
        for (name, of) in FIGURES {
            fields.column(name, summaries.iter().map(|errors| errors.as_ref().map(of)))?;
        }
        let coverage =
            |answers: &evaluation::Evaluation| answers.coverage_percent().map(|percent| percent / 100.0);
        fields.column("coverage", by_position.iter().map(|(_, answers)| coverage(answers)))?;
        let class = py.import("palpate._evaluation")?.getattr("ErrorsByPosition")?;
        class.call((), Some(&fields.into_dict()))
    }

    /// The contacts as a structured array, a field for each column, in SI units.
    ///
    /// Returns
    /// -------
    /// ndarray
    ///     Of the shape (contacts), with the fields "x", "force", "estimated_x", "error", "covered", "interval_score", "estimated_force", and on a plane "y" and
    ///     "estimated_y".
    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("palpate._results")?.call_method1("structured", (self.fields(py)?,))
    }

    /// The contacts as a data frame, in mm and N, with units in the names of its columns.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    fn to_frame<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._evaluation")?.call_method1("to_frame", (slf,))
    }

    /// Write the contacts as CSV, with units in the names of the columns.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    fn to_csv<'py>(slf: &Bound<'py, Self>, path: Bound<'py, PyAny>) -> PyResult<()> {
        slf.py().import("palpate._evaluation")?.call_method1("to_csv", (slf, path)).map(|_| ())
    }

    fn __len__(&self) -> usize {
        self.inner.located.len()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.get();
            self.inner == other.inner && self.setup == other.setup && self.about.kind == other.about.kind
        })
    }

    fn __repr__(&self) -> String {
        let EvaluationOrigin { kind, source, how } = &self.about;
        let errors = self.inner.summary(None).map_or_else(String::new, |errors| {
            format!(
                ": mean error {} mm, median {} mm, largest {} mm",
                figure(errors.average_m * 1e3),
                figure(errors.median_m * 1e3),
                figure(errors.largest_m * 1e3)
            )
        });
        format!("<Evaluation: {kind}, {} contacts of {source}, {how}{errors}>", self.inner.located.len())
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("palpate._evaluation")?.call_method1("html", (slf,))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = slf.py();
        let own = slf.get();
        let setup = serde_json::to_vec(&*own.setup).map_err(refused)?;
        let EvaluationOrigin { kind, source, how } = own.about.clone();
        let located: Vec<PackedContact> = own.inner.located.iter().map(packed).collect();
        let rebuild = py.import("palpate._palpate")?.getattr("Evaluation")?.getattr("_unpickle")?;
        let setup = pyo3::types::PyBytes::new(py, &setup);
        Ok((rebuild, (setup, (kind, source, how), located).into_pyobject(py)?.into_any()))
    }

    #[staticmethod]
    fn _unpickle(
        setup: &[u8],
        about: (String, String, String),
        located: Vec<PackedContact>,
    ) -> PyResult<Self> {
        let setup: setup::Setup = serde_json::from_slice(setup).map_err(refused)?;
        let (kind, source, how) = about;
        let located = located.into_iter().map(unpacked).collect();
        let inner = evaluation::Evaluation { extent: setup.surface().extent(), located };
        Ok(Self { inner, setup: Arc::new(setup), about: EvaluationOrigin { kind, source, how } })
    }
}

fn figure(value: f64) -> String {
    let four: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    four.to_string()
}

/// Truth, force, estimate, coverage, interval score, index in `Status::ALL`, and estimated force
/// with coverage.
type PackedContact = (
    (f64, f64),
    Option<f64>,
    (f64, f64),
    Option<(bool, Option<bool>)>,
    Option<f64>,
    Option<usize>,
    Option<(f64, bool)>,
);

fn packed(located: &EvaluatedContact) -> PackedContact {
    let EvaluatedContact { truth, force_n, estimate, covered, interval_score_m, status, force } = *located;
    let status = status.and_then(|status| Status::ALL.iter().position(|of| *of == status));
    let covered = covered.map(|covered| (covered.x, covered.y));
    let force = force.map(|force| (force.estimate_n, force.covered));
    ((truth.x_m, truth.y_m), force_n, (estimate.x_m, estimate.y_m), covered, interval_score_m, status, force)
}

fn unpacked(
    (truth, force_n, estimate, covered, interval_score_m, status, force): PackedContact,
) -> EvaluatedContact {
    let position = |(x_m, y_m)| Position { x_m, y_m };
    let force = force.map(|(estimate_n, covered)| LocatedForce { estimate_n, covered });
    EvaluatedContact {
        truth: position(truth),
        force_n,
        estimate: position(estimate),
        covered: covered.map(|(x, y)| CoveredCoordinates { x, y }),
        interval_score_m,
        status: status.and_then(|number| Status::ALL.get(number).copied()),
        force,
    }
}
