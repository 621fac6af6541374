//! Estimates beside the truth, summed into figures.

use palpate::estimators::estimate_record::ContactRecord;
use palpate::estimators::evaluation::Evaluation;
use palpate::numerics::{mean, percentile};
use palpate::prelude::{Estimate, Row, Status};
use serde::Serialize;

/// Sums over the estimates of some readings.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    errors_m: Vec<f64>,
    position_intervals: Count,
    force_intervals: Count,
    outside_model: Count,
    ambiguous: Count,
    missed: Count,
    untouched: Count,
    light: Count,
}

/// Number of cases, and of those that hold.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    of: usize,
    holds: usize,
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
    fn add(&mut self, holds: bool) {
        self.of += 1;
        self.holds += usize::from(holds);
    }

    fn percent(self) -> Option<f64> {
        (self.of > 0).then(|| 100.0 * self.holds as f64 / self.of as f64)
    }
}

impl Tally {
    /// Adds positions and their regions.
    pub fn add_positions(&mut self, evaluation: &Evaluation) {
        for located in &evaluation.located {
            self.errors_m.push(located.error_m());
            if let Some(covered) = located.covered {
                self.position_intervals.add(covered);
            }
        }
    }

    /// Adds status and force of a touch.
    pub fn add_touch(&mut self, row: &Row, estimate: &Estimate, extent: palpate::prelude::Extent) {
        self.outside_model.add(estimate.status == Status::OutsideModel);
        self.ambiguous.add(estimate.status == Status::Ambiguous);
        self.missed.add(estimate.status == Status::NoContact);
        let interval_n = ContactRecord::new(&estimate.contact, extent).force_interval_95_n();
        if let (Some([low_n, high_n]), Some(force_n)) = (interval_n, row.force_n) {
            self.force_intervals.add((low_n..=high_n).contains(&force_n));
        }
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
        let mut sorted_m = self.errors_m.clone();
        sorted_m.sort_by(f64::total_cmp);
        let mm = |length_m: f64| 1e3 * length_m;
        Figures {
            touches: sorted_m.len(),
            median_error_mm: percentile(&sorted_m, 50.0).map(mm),
            mean_error_mm: (!sorted_m.is_empty()).then(|| mm(mean(sorted_m.iter().copied()))),
            position_coverage: self.position_intervals.percent(),
            force_coverage: self.force_intervals.percent(),
            outside_model: self.outside_model.percent(),
            ambiguous: self.ambiguous.percent(),
            missed: self.missed.percent(),
            untouched_no_contact: self.untouched.percent(),
            light_found: self.light.percent(),
        }
    }
}
