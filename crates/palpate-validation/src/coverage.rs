use crate::statistics::{Sample, Share};
use crate::table::{Column, Figure, Goal};
use palpate::estimators::estimate_record::ContactRecord;
use palpate::prelude::{Contact, Estimate, Extent, Status};

/// Estimates of contacts at one place; all but the detection is of the detected ones.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    detected: Share,
    x: Share,
    y: Share,
    force: Share,
    outside_model: Share,
    error_mm: Sample,
    width_mm: Sample,
    width_n: Sample,
    greatest_n: f64,
}

impl Coverage {
    pub fn add(&mut self, calibration: u64, estimate: &Estimate, truth: Contact, extent: Extent) {
        let is_detected = estimate.status != Status::NoContact;
        self.detected.add(calibration, is_detected);
        if !is_detected {
            return;
        }
        let found = &estimate.contact;
        self.outside_model.add(calibration, estimate.status == Status::OutsideModel);
        self.error_mm.add(calibration, 1e3 * found.position.distance_m(truth.position));
        let contains = |(low, high): (f64, f64), value: f64| low <= value && value <= high;
        if let Some(uncertainty) = found.uncertainty {
            self.x.add(calibration, contains(uncertainty.x_95_m, truth.position.x_m));
            self.y.add(calibration, contains(uncertainty.y_95_m, truth.position.y_m));
            self.width_mm.add(calibration, 1e3 * (uncertainty.x_95_m.1 - uncertainty.x_95_m.0));
        } else {
            self.x.add(calibration, false);
            self.y.add(calibration, false);
        }
        let interval_n = ContactRecord::new(found, extent).force_interval_95_n().map(Into::into);
        let interval_n = interval_n.or(found.force_n.map(|force_n| (force_n, force_n)));
        self.force.add(calibration, interval_n.is_some_and(|interval| contains(interval, truth.force_n)));
        if let Some((low, high)) = interval_n {
            self.width_n.add(calibration, high - low);
        }
        self.greatest_n = self.greatest_n.max(found.force_n.unwrap_or(0.0));
    }

    pub fn line_columns() -> Vec<Column> {
        vec![
            Column::percent("detected", Goal::Larger),
            Column::percent("place covered", Goal::COVERAGE),
            Column::percent("force covered", Goal::COVERAGE),
            Column::mm("mean width", Goal::None),
            Column::mm("mean error", Goal::Smaller),
            Column::new("greatest force", "N", Goal::None),
            Column::percent("outside model", Goal::Smaller),
        ]
    }

    pub fn line_figures(&self) -> Vec<Option<Figure>> {
        vec![
            self.detected.percent(),
            self.x.percent(),
            self.force.percent(),
            self.width_mm.mean(),
            self.error_mm.mean(),
            self.greatest(),
            self.outside_model.percent(),
        ]
    }

    /// Columns for contacts by distance from the edge x = 0.
    pub fn plane_columns() -> Vec<Column> {
        vec![
            Column::percent("detected", Goal::Larger),
            Column::percent("across covered", Goal::COVERAGE),
            Column::percent("along covered", Goal::COVERAGE),
            Column::percent("force covered", Goal::COVERAGE),
            Column::mm("mean width across", Goal::None),
            Column::new("mean width of the force's", "N", Goal::None),
            Column::mm("mean error", Goal::Smaller),
            Column::new("greatest force", "N", Goal::None),
            Column::percent("outside model", Goal::Smaller),
        ]
    }

    pub fn plane_figures(&self) -> Vec<Option<Figure>> {
        vec![
            self.detected.percent(),
            self.x.percent(),
            self.y.percent(),
            self.force.percent(),
            self.width_mm.mean(),
            self.width_n.mean(),
            self.error_mm.mean(),
            self.greatest(),
            self.outside_model.percent(),
        ]
    }

    /// Greatest estimated force, without a standard error.
    fn greatest(&self) -> Option<Figure> {
        let is_detected = !self.error_mm.is_empty();
        is_detected.then_some(Figure::exact(self.greatest_n))
    }
}
