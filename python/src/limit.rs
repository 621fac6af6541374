//! Cramér–Rao bound of a bench.

use palpate::estimators::detectable_force::{DetectableForce, TouchSummary};
use palpate::estimators::influence::Influence;
use palpate::estimators::setup;
use palpate::estimators::status::FalseAlarmRate;
use palpate::mechanics::contact::{OffSurface, Position};
use palpate::mechanics::limit::{
    Bound as Least, CramerRaoBound, Force, LimitCurve, LimitError, LimitSummary, LimitWarning,
    limit_warnings, positions_with_spacing,
};
use palpate::mechanics::surface::Extent;
use palpate::mechanics::units::format_count;
use palpate::numerics::watch::Watch;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};

use crate::errors::{of_work, refused};
use crate::quantities::{self, force_n, length_m, share};
use crate::subject::Subject;
use crate::training::positions;
use crate::values::{Fields, place};
use crate::work;

/// Fields of `palpate.Limit`.
#[pyfunction]
#[pyo3(signature = (bench, *, force, unknown_force, at, every, false_alarm_rate, memory_limit, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn limit<'py>(
    py: Python<'py>,
    bench: &Bound<'py, PyAny>,
    force: Option<Bound<'py, PyAny>>,
    unknown_force: bool,
    at: Option<Bound<'py, PyAny>>,
    every: Option<Bound<'py, PyAny>>,
    false_alarm_rate: Option<Bound<'py, PyAny>>,
    memory_limit: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let subject = Subject::of(bench, "bench")?;
    let setup = match &subject {
        Subject::Locator(locator) => locator.learnt_setup().map_err(refused)?,
        other => other.setup().clone(),
    };
    let extent = setup.surface().extent();
    let at = match (at, every) {
        (Some(_), Some(_)) => return Err(refused("`at` and `every` exclude each other; give one of them")),
        (Some(at), None) => {
            let at = positions(&at)?;
            OffSurface::check("position", &at, extent).map_err(refused)?;
            if at.is_empty() {
                return Err(refused("`at` has 0 positions; it must have at least 1"));
            }
            Some(at)
        }
        (None, Some(every)) => {
            Some(positions_with_spacing(extent, length_m(&every, "every")?).map_err(refused)?)
        }
        (None, None) => None,
    };
    let rate = match false_alarm_rate {
        Some(_) if matches!(&subject, Subject::Locator(locator) if locator.force_linear().is_some()) => {
            return Err(refused(
                "a locator of a measured surface has its own false-alarm rate; omit `false_alarm_rate`",
            ));
        }
        Some(rate) => FalseAlarmRate::new(share(&rate, "false_alarm_rate")?).map_err(refused)?,
        None => subject.false_alarm_rate(),
    };
    let force_n = force.map(|force| force_n(&force, "force")).transpose()?.or(setup.force_n());
    let force_n =
        force_n.ok_or_else(|| refused(format!("{}: give `force`, as in \"3 N\"", LimitError::NoForce)))?;
    let force = if unknown_force || setup.force_n().is_none() { Force::Unknown } else { Force::Known };
    let asked = LimitRequest { force_n, force, at, rate };
    if let (Some(limit), Some(surface)) = (memory_limit, setup.surface().model()) {
        let listed = asked.at.as_ref().map_or(0, Vec::len);
        let cost = CramerRaoBound::cost(surface, setup.layout(), listed);
        let what = format!("the limit of {} sensors", format_count(setup.layout().len() as u64));
        let checked = quantities::memory_limit(limit)?.check(&what, cost.memory_bytes);
        checked.map_err(|error| {
            refused(format!("{error}: raise the limit, or take fewer sensors or `elements`"))
        })?;
    }
    let told = work::run_with(py, progress, None, |watch| match &subject {
        Subject::Locator(locator) if let Some(linear) = locator.force_linear() => {
            let touch = locator.add_scatter(linear.lightest_touch());
            asked.compute(&linear.cramer_rao_bound(extent), &touch, watch)
        }
        _ => {
            let limit = setup.cramer_rao_bound_watched(watch)?;
            let touch = Influence { false_alarm_rate: asked.rate, ..Influence::default() };
            let touch = touch.lightest_touch(&limit);
            let touch = match &subject {
                Subject::Locator(locator) => locator.add_scatter(touch),
                _ => touch,
            };
            asked.compute(&limit, &touch, watch)
        }
    })?;
    let told = told.map_err(|error| complaint(&error))?;
    told.fields(py, &asked, &setup)
}

fn complaint(error: &LimitError) -> PyErr {
    let help = match error {
        LimitError::NoModel => {
            "fit `Influence` to a recording with forces and ask its locator, or give a surface with a model, such as a `Beam`"
        }
        LimitError::Noise(error) => error.help(),
        LimitError::Surface(error) => error.help(),
        other => return of_work(other),
    };
    refused(format!("{error}: {help}"))
}

const TOGETHER: usize = 500;

struct LimitRequest {
    force_n: f64,
    force: Force,
    /// The whole surface for `None`.
    at: Option<Vec<Position>>,
    rate: FalseAlarmRate,
}

struct LimitResult {
    alive: usize,
    known: LimitCurve,
    unknown: LimitCurve,
    warnings: Vec<LimitWarning>,
    rate: FalseAlarmRate,
    touch_n: Vec<[Option<f64>; 2]>,
    touches: [Option<TouchSummary>; 2],
}

impl LimitRequest {
    fn compute(
        &self,
        limit: &CramerRaoBound,
        touch: &DetectableForce,
        watch: Watch,
    ) -> Result<LimitResult, LimitError> {
        limit.prepare(self.at.as_deref().unwrap_or_default(), watch)?;
        let curve = |force| match &self.at {
            Some(at) => {
                let mut curve = LimitCurve::at_positions(limit, self.force_n, force, &[])?;
                for positions in at.chunks(TOGETHER) {
                    watch.counted("limit", "positions", curve.points.len(), at.len())?;
                    curve
                        .points
                        .extend(LimitCurve::at_positions(limit, self.force_n, force, positions)?.points);
                }
                Ok(curve)
            }
            None => LimitCurve::over_surface(limit, self.force_n, force),
        };
        let (known, unknown) = (curve(Force::Known)?, curve(Force::Unknown)?);
        let positions: Vec<Position> = known.points.iter().map(|point| point.position).collect();
        let mut touch_n = Vec::with_capacity(positions.len());
        for at in positions.chunks(TOGETHER) {
            watch.counted("lightest touch", "positions", touch_n.len(), positions.len())?;
            touch_n.extend(at.iter().map(|at| touch.forces_at(*at)));
        }
        Ok(LimitResult {
            alive: limit.enabled_count(),
            known,
            unknown,
            warnings: limit_warnings(limit, self.force_n, self.force, watch)?,
            rate: touch.rate(),
            touch_n,
            touches: touch.summaries(&positions),
        })
    }
}

impl LimitResult {
    fn fields<'py>(
        &self,
        py: Python<'py>,
        asked: &LimitRequest,
        setup: &setup::Setup,
    ) -> PyResult<Bound<'py, PyDict>> {
        let extent = setup.surface().extent();
        let fields = Fields::new(py);
        let positions: Vec<Position> = self.known.points.iter().map(|point| point.position).collect();
        fields.set("force", asked.force_n)?;
        fields.set("force_known", asked.force == Force::Known)?;
        fields.set("sensors_alive", self.alive)?;
        fields.set("false_alarm_rate", self.rate.share())?;
        fields.positions(&positions, extent)?;
        for (name, curve) in [("known", &self.known), ("unknown", &self.unknown)] {
            let bounds = curve.points.iter().map(|point| point.bound);
            let sds = bounds.clone().map(|bound| bound.map(|bound| bound.sd_position_m));
            fields.column(&format!("{name}_force"), sds)?;
            fields.matrices(&format!("{name}_force_covariance"), bounds.map(covariance))?;
        }
        let of_force = |bound: Option<Least>| bound.and_then(|bound| bound.sd_force_n);
        fields.column("force_sd", self.unknown.points.iter().map(|point| of_force(point.bound)))?;
        let touch = self.touch_n.iter().map(|forces_n| forces_n.map(|force_n| force_n.unwrap_or(f64::NAN)));
        fields.columns("lightest_touch", touch)?;
        let of_curve =
            |curve: &LimitCurve| curve.summary().map(|summary| of_summary(&summary, curve, extent));
        let summary =
            json!({ "known_force": of_curve(&self.known), "unknown_force": of_curve(&self.unknown) });
        fields.json("summary", &summary)?;
        let touches = self.touches.iter().map(|touch| touch.as_ref().map(|touch| of_touch(touch, extent)));
        fields.json("lightest_touch_summary", &Value::from_iter(touches))?;
        let warnings = self.warnings.iter().map(|warning| of_warning(warning, extent));
        fields.json("warnings", &Value::from_iter(warnings))?;
        Ok(fields.into_dict())
    }
}

/// Least covariance of x and y in m²: xx, xy, yx, yy.
fn covariance(bound: Option<Least>) -> [f64; 4] {
    bound.map_or([f64::NAN; 4], |Least { sd_x_m, sd_y_m, covariance_xy_m2, .. }| {
        [sd_x_m * sd_x_m, covariance_xy_m2, covariance_xy_m2, sd_y_m * sd_y_m]
    })
}

fn of_summary(summary: &LimitSummary, curve: &LimitCurve, extent: Extent) -> Value {
    json!({
        "mean": summary.mean_m,
        "median": summary.median_m,
        "mean_error": summary.mean_error_m,
        "least": summary.best.1,
        "least_at": place(summary.best.0, extent),
        "largest": summary.worst.1,
        "largest_at": place(summary.worst.0, extent),
        "positions_without": summary.unidentifiable,
        "share_without": summary.unidentifiable as f64 / curve.points.len() as f64,
    })
}

fn of_touch(touch: &TouchSummary, extent: Extent) -> Value {
    json!({
        "found": touch.found,
        "median": touch.median_n,
        "largest": touch.worst.1,
        "largest_at": place(touch.worst.0, extent),
        "positions_without": touch.undetected,
    })
}

fn of_warning(warning: &LimitWarning, extent: Extent) -> Value {
    let ((value, bound), zone) = (warning.value_and_bound(), warning.zone());
    let twins = match warning {
        LimitWarning::Mirror { twins, .. } => {
            Some(json!({ "from": place(twins.from, extent), "to": place(twins.to, extent) }))
        }
        LimitWarning::Blind { .. } | LimitWarning::Faint { .. } => None,
    };
    json!({
        "kind": warning.kind(),
        "from": place(zone.from, extent),
        "to": place(zone.to, extent),
        "twins": twins,
        "value": value,
        "bound": bound,
        "message": warning.to_string(),
        "help": warning.help(),
    })
}
