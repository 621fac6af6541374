use crate::statistics::{Sample, Share};
use crate::table::{Column, Figure, Goal};
use palpate::estimators::evaluation::CoveredCoordinates;
use palpate::estimators::interval_check::IntervalCheck;
use palpate::prelude::{Estimate, Evaluation, Status};

#[derive(Clone, Debug, Default)]
pub struct Tally {
    errors_mm: Sample,
    position_covered: Share,
    force_covered: Share,
    statuses: [Share; STATUSES.len()],
    untouched: Share,
    light: Share,
    /// Reported coverage at held-out places, in %: by the method, and widened.
    reported: [Sample; 2],
}

const STATUSES: [Status; 3] = [Status::OutsideModel, Status::Ambiguous, Status::NoContact];

/// Distances in mm, shares in %.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    pub median_error_mm: Option<Figure>,
    pub mean_error_mm: Option<Figure>,
    /// Held-out presses in the method's regions, from the check of `fit`.
    pub reported_before: Option<Figure>,
    /// Held-out presses in the widened regions.
    pub reported_after: Option<Figure>,
    /// 95 % regions that contain the position.
    pub position_coverage: Option<Figure>,
    /// 95 % intervals that contain the force.
    pub force_coverage: Option<Figure>,
    pub outside_model: Option<Figure>,
    pub ambiguous: Option<Figure>,
    /// Touches with `no_contact`.
    pub missed: Option<Figure>,
    pub untouched_no_contact: Option<Figure>,
    /// Touches of five times the smallest detectable force without `no_contact`.
    pub light_detected: Option<Figure>,
}

impl Figures {
    pub fn columns() -> Vec<Column> {
        vec![
            Column::mm("median error", Goal::Smaller),
            Column::mm("mean error", Goal::Smaller),
            Column::percent("position covered", Goal::COVERAGE),
            Column::percent("force covered", Goal::COVERAGE),
            Column::percent("outside model", Goal::Smaller),
            Column::percent("ambiguous", Goal::None),
            Column::percent("missed", Goal::Smaller),
        ]
    }

    pub fn cells(&self) -> Vec<Option<Figure>> {
        vec![
            self.median_error_mm,
            self.mean_error_mm,
            self.position_coverage,
            self.force_coverage,
            self.outside_model,
            self.ambiguous,
            self.missed,
        ]
    }
}

impl Tally {
    pub fn add_interval_check(&mut self, calibration: u64, check: Option<&IntervalCheck>) {
        let Some(check) = check else { return };
        let percents = [check.position.before_percent, check.position.after_percent];
        self.reported.iter_mut().zip(percents).for_each(|(sample, percent)| sample.add(calibration, percent));
    }

    pub fn add_touches(&mut self, calibration: u64, evaluation: &Evaluation) {
        for located in &evaluation.located {
            self.errors_mm.add(calibration, 1e3 * located.error_m());
            for is_covered in located.covered.into_iter().flat_map(CoveredCoordinates::coordinates) {
                self.position_covered.add(calibration, is_covered);
            }
            if let Some(force) = located.force {
                self.force_covered.add(calibration, force.covered);
            }
            if let Some(status) = located.status {
                let shares = self.statuses.iter_mut().zip(STATUSES);
                shares.for_each(|(share, of)| share.add(calibration, status == of));
            }
        }
    }

    pub fn add_untouched(&mut self, calibration: u64, estimate: &Estimate) {
        self.untouched.add(calibration, estimate.status == Status::NoContact);
    }

    /// Of five times the smallest detectable force.
    pub fn add_light_touch(&mut self, calibration: u64, estimate: &Estimate) {
        self.light.add(calibration, estimate.status != Status::NoContact);
    }

    #[cfg(test)]
    pub fn touches(&self) -> usize {
        self.errors_mm.len()
    }

    pub fn figures(&self) -> Figures {
        let [outside_model, ambiguous, missed] = self.statuses.each_ref().map(Share::percent);
        let [reported_before, reported_after] = self.reported.each_ref().map(Sample::mean);
        Figures {
            median_error_mm: self.errors_mm.median(),
            mean_error_mm: self.errors_mm.mean(),
            reported_before,
            reported_after,
            position_coverage: self.position_covered.percent(),
            force_coverage: self.force_covered.percent(),
            outside_model,
            ambiguous,
            missed,
            untouched_no_contact: self.untouched.percent(),
            light_detected: self.light.percent(),
        }
    }
}
