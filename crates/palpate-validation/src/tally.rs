//! Estimates beside the truth, summed into figures.

use palpate::estimators::interval_check::IntervalCheck;
use palpate::prelude::{Estimate, Evaluation, Extent, Status};
use serde::Serialize;

/// Estimates of some readings.
#[derive(Clone, Debug)]
pub struct Tally {
    touches: Evaluation,
    untouched: Count,
    light: Count,
    /// Coverage of the position at held-out places that each fit reports, in %: by the method, and once widened.
    said: Vec<[f64; 2]>,
}

/// Number of cases, and of those that are so.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    of: usize,
    so: usize,
}

/// Figures of an estimator on a bench; shares in %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Touches that were located.
    pub touches: usize,
    /// Median distance from the true position, in mm.
    pub median_error_mm: Option<f64>,
    /// Mean distance, in mm.
    pub mean_error_mm: Option<f64>,
    /// Held-out presses within the method's regions of the position, from the check of `fit`; `None` without this check.
    pub said_before: Option<f64>,
    /// Held-out presses within the widened regions.
    pub said_after: Option<f64>,
    /// 95 % regions of the position that contain it.
    pub position_coverage: Option<f64>,
    /// 95 % intervals of the force that contain it.
    pub force_coverage: Option<f64>,
    /// Touches with the status `outside_model`.
    pub outside_model: Option<f64>,
    /// Touches with the status `ambiguous`.
    pub ambiguous: Option<f64>,
    /// Touches with the status `no_contact`.
    pub missed: Option<f64>,
    /// Untouched readings with the status `no_contact`.
    pub untouched_no_contact: Option<f64>,
    /// Touches of five times the smallest detectable force that have another status than `no_contact`.
    pub light_found: Option<f64>,
}

impl Count {
    fn add(&mut self, is_so: bool) {
        self.of += 1;
        self.so += usize::from(is_so);
    }

    fn percent(self) -> Option<f64> {
        (self.of > 0).then(|| 100.0 * self.so as f64 / self.of as f64)
    }
}

impl Tally {
    /// A tally without estimates, on a surface of this extent.
    pub fn new(extent: Extent) -> Self {
        let touches = Evaluation { extent, located: Vec::new() };
        Self { touches, untouched: Count::default(), light: Count::default(), said: Vec::new() }
    }

    /// Adds the check of a fit's intervals, where there is one.
    pub fn add_interval_check(&mut self, check: Option<&IntervalCheck>) {
        self.said.extend(check.map(|check| [check.position.before_percent, check.position.after_percent]));
    }

    /// Adds estimates of touches.
    pub fn add_touches(&mut self, evaluation: Evaluation) {
        self.touches.located.extend(evaluation.located);
    }

    /// Adds an untouched reading.
    pub fn add_untouched(&mut self, estimate: &Estimate) {
        self.untouched.add(estimate.status == Status::NoContact);
    }

    /// Adds a touch of five times the smallest detectable force.
    pub fn add_light_touch(&mut self, estimate: &Estimate) {
        self.light.add(estimate.status != Status::NoContact);
    }

    /// The figures of all that was added.
    pub fn figures(&self) -> Figures {
        let touches = &self.touches;
        let errors = touches.summary(None);
        let statuses = touches.status_percents();
        let percent =
            |status| statuses.as_ref()?.iter().find(|(of, _)| *of == status).map(|(_, share)| *share);
        let said = |i: usize| {
            let sum: f64 = self.said.iter().map(|percents| percents[i]).sum();
            (!self.said.is_empty()).then(|| sum / self.said.len() as f64)
        };
        Figures {
            touches: touches.located.len(),
            median_error_mm: errors.map(|errors| 1e3 * errors.median_m),
            mean_error_mm: errors.map(|errors| 1e3 * errors.average_m),
            said_before: said(0),
            said_after: said(1),
            position_coverage: touches.coverage_percent(),
            force_coverage: touches.force_summary().map(|forces| forces.coverage_percent),
            outside_model: percent(Status::OutsideModel),
            ambiguous: percent(Status::Ambiguous),
            missed: percent(Status::NoContact),
            untouched_no_contact: self.untouched.percent(),
            light_found: self.light.percent(),
        }
    }
}
