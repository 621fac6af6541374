//! Placement of sensors for expected contacts.

use std::error::Error;
use std::sync::Arc;

use palpate::design::sensors::{
    AssessedLayout, Assessment, CountPoint, Method, SensorDesign, SensorProblem, Verification, best_design,
    enough, to_verify,
};
use palpate::estimators::influence::Influence;
use palpate::estimators::{estimator, setup};
use palpate::mechanics::contact::Position;
use palpate::mechanics::limit::Force;
use palpate::mechanics::units::format_count;
use palpate::numerics::watch::Watch;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::Value;

use crate::bench::Setup;
use crate::errors::{of_work, refused};
use crate::estimator::Estimator;
use crate::quantities::{self, force_n};
use crate::sections;
use crate::subject::Subject;
use crate::values::Fields;
use crate::work;

const MOST_COUNT: usize = 200;

/// Fields of `palpate.SensorPlacement`.
#[pyfunction]
#[pyo3(signature = (bench, design, *, count, add, counts, method, force, unknown_force, verify, estimator, seed, memory_limit, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn place_sensors<'py>(
    py: Python<'py>,
    bench: &Bound<'py, PyAny>,
    design: Option<&str>,
    count: Option<usize>,
    add: Option<usize>,
    counts: Option<(usize, usize)>,
    method: Option<&str>,
    force: Option<Bound<'py, PyAny>>,
    unknown_force: bool,
    verify: usize,
    estimator: Option<&Estimator>,
    seed: u64,
    memory_limit: Option<&Bound<'py, PyAny>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let subject = Subject::of(bench, "bench")?;
    let own = subject.setup();
    let force_n = force.map(|force| force_n(&force, "force")).transpose()?.or(own.force_n());
    let setup = own.clone().with_force(force_n).map_err(refused)?;
    let mut design = match (design, &subject) {
        (Some(text), _) => sections::design(text, own)?,
        (None, Subject::Rig(rig)) => rig.design.clone(),
        (None, _) => None,
    }
    .map_or_else(|| SensorDesign::for_setup(own).map_err(refused), Ok)?;
    if unknown_force {
        design = design.unknown_force();
    }
    match (count, add) {
        (Some(_), Some(_)) => {
            return Err(refused("`count` and `add` exclude each other; give one of them"));
        }
        (Some(count), None) => design.count = count,
        (None, Some(count)) => design = design.adding(count, own.layout()).map_err(refused)?,
        (None, None) => {}
    }
    if let Some((from, to)) = counts
        && (from < 1 || to > MOST_COUNT || from > to)
    {
        return Err(refused(format!(
            "`counts` is {from} to {to}; it must be a range from 1 to {MOST_COUNT}, the smaller number first"
        )));
    }
    let method = method.map(named).transpose()?;
    let estimator = match (estimator, &subject) {
        (Some(estimator), _) => estimator.inner.clone(),
        (None, Subject::Rig(rig)) => rig.estimator.clone(),
        (None, _) => estimator::Estimator::Influence(Influence::default()),
    };
    if let Some(limit) = memory_limit {
        let cost = SensorProblem::estimated_cost(&setup, &design).map_err(refused)?;
        let what = format!("the design with {} candidate sensors", format_count(cost.candidates as u64));
        let checked = quantities::memory_limit(limit)?.check(&what, cost.memory_bytes);
        checked.map_err(|error| {
            refused(format!("{error}: raise the limit, or set `sites` or the contacts' `every` wider apart"))
        })?;
    }
    let asked = DesignRequest { setup, design, method, counts, verify, estimator, seed };
    let found = work::run_with(py, progress, None, |watch| asked.compute(watch))?;
    found.map_err(|error| of_work(&*error))?.fields(py, &asked)
}

fn named(name: &str) -> PyResult<Method> {
    serde_json::from_value(Value::from(name)).map_err(|_| {
        let known = [
            Method::Even,
            Method::GreedyExchange,
            Method::Genetic,
            Method::Refined,
            Method::DOptimal,
            Method::PrincipalComponents,
            Method::QrPivoting,
        ];
        let known = known.map(Method::name).join(", ");
        refused(format!("`method` is \"{name}\"; it must be one of {known}"))
    })
}

struct DesignRequest {
    setup: setup::Setup,
    design: SensorDesign,
    method: Option<Method>,
    counts: Option<(usize, usize)>,
    verify: usize,
    estimator: estimator::Estimator,
    seed: u64,
}

struct DesignResult {
    force_n: f64,
    force: Force,
    candidates: usize,
    contacts: Vec<Position>,
    weights: Vec<f64>,
    designed: Vec<AssessedLayout>,
    /// True for kept sensors, by layout.
    kept: Vec<Vec<bool>>,
    verified: Vec<(Method, Verification)>,
    counts: Vec<CountPoint>,
}

impl DesignRequest {
    fn compute(&self, watch: Watch) -> Result<DesignResult, Box<dyn Error + Send + Sync>> {
        let problem = SensorProblem::new(&self.setup, &self.design, watch)?;
        let designed = match self.method {
            Some(method) => vec![problem.by_method(method, self.seed, watch)?],
            None => problem.all(self.seed, watch)?,
        };
        let counts = match self.counts {
            Some((from, to)) => problem.counts(from..=to, self.seed, watch)?,
            None => Vec::new(),
        };
        let mut verified = Vec::new();
        if self.verify > 0 {
            for one in to_verify(&designed) {
                let told = problem.verify(&one.layout, &self.estimator, self.verify, self.seed, watch)?;
                verified.push((one.method, told));
            }
        }
        let is_kept = |one: &AssessedLayout| {
            one.layout.sensors().iter().map(|sensor| problem.is_kept(sensor)).collect::<Vec<bool>>()
        };
        Ok(DesignResult {
            force_n: problem.force_n(),
            force: problem.force(),
            candidates: problem.candidates(),
            contacts: problem.contacts().positions.clone(),
            weights: problem.contacts().weights.clone(),
            kept: designed.iter().map(is_kept).collect(),
            designed,
            verified,
            counts,
        })
    }
}

impl DesignResult {
    fn fields<'py>(&self, py: Python<'py>, asked: &DesignRequest) -> PyResult<Bound<'py, PyDict>> {
        let extent = asked.setup.surface().extent();
        let fields = Fields::new(py);
        fields.set("force", self.force_n)?;
        fields.set("force_known", self.force == Force::Known)?;
        fields.set("criterion", asked.design.criterion.name())?;
        fields.set("tolerance", asked.design.tolerance_m)?;
        fields.set("candidates", self.candidates)?;
        let contacts = Fields::new(py);
        contacts.positions(&self.contacts, extent)?;
        contacts.column("weights", self.weights.iter().copied().map(Some))?;
        fields.set("contacts", contacts.into_dict())?;
        fields.set("methods", self.designed.iter().map(|one| one.method.name()).collect::<Vec<_>>())?;
        let layouts = self.designed.iter().zip(&self.kept).map(|(one, kept)| {
            let sensors = one.layout.sensors();
            let layout = Fields::new(py);
            layout.set("method", one.method.name())?;
            layout
                .set("measures", sensors.iter().map(|sensor| sensor.kind.to_string()).collect::<Vec<_>>())?;
            let positions: Vec<Position> = sensors.iter().map(|sensor| sensor.position).collect();
            layout.positions(&positions, extent)?;
            layout.set("kept", kept.clone())?;
            let setup = asked.setup.clone().with_layout(one.layout.clone()).map_err(refused)?;
            layout.set("setup", Py::new(py, Setup(Arc::new(setup)))?)?;
            Ok(layout.into_dict())
        });
        fields.set("layouts", PyList::new(py, layouts.collect::<PyResult<Vec<_>>>()?)?)?;
        assessments(&fields, "", self.designed.iter().map(|one| Some(&one.assessment)))?;
        let keeps: Vec<bool> = self.designed.iter().map(|one| one.assessment.keeps_constraints).collect();
        fields.set("keeps_constraints", keeps)?;
        let told = |one: &AssessedLayout| self.verified.iter().find(|(method, _)| *method == one.method);
        let simulated = |figure: fn(&Verification) -> f64| {
            self.designed.iter().map(move |one| told(one).map(|(_, told)| figure(told))).collect::<Vec<_>>()
        };
        fields.column("simulated_error", simulated(|told| told.mean_error_m))?;
        fields.column("simulated_standard_error", simulated(|told| told.standard_error_m))?;
        fields
            .column("simulated_within_tolerance", simulated(|told| told.within_tolerance_percent / 100.0))?;
        let best = best_design(&self.designed).or(self.designed.first());
        fields.set("best_method", best.map(|best| best.method.name()))?;
        let counts = Fields::new(py);
        counts.set("count", self.counts.iter().map(|point| point.count).collect::<Vec<_>>())?;
        assessments(&counts, "even_", self.counts.iter().map(|point| point.even.as_ref()))?;
        assessments(&counts, "designed_", self.counts.iter().map(|point| Some(&point.designed)))?;
        fields.set("counts", (!self.counts.is_empty()).then(|| counts.into_dict()))?;
        fields.set("enough", enough(&self.counts))?;
        Ok(fields.into_dict())
    }
}

fn assessments<'a>(
    fields: &Fields<'_>,
    prefix: &str,
    of: impl Iterator<Item = Option<&'a Assessment>> + Clone,
) -> PyResult<()> {
    let column = |name: &str, figure: fn(&Assessment) -> Option<f64>| {
        fields.column(&format!("{prefix}{name}"), of.clone().map(|one| one.and_then(figure)))
    };
    column("score", |one| Some(one.score))?;
    column("mean_limit", |one| one.mean_limit_m)?;
    column("worst_limit", |one| one.worst_limit_m)?;
    column("mean_error_at_limit", |one| one.mean_error_m)?;
    column("within_tolerance", |one| Some(one.within_tolerance_percent / 100.0))?;
    column("score_one_dead", |one| one.score_one_dead)?;
    column("cost", |one| Some(one.cost))
}
