//! True and estimated contact of a reading.

use super::intervals::{CoveredCoordinates, interval_score_m};
use crate::estimate_record::ContactRecord;
use crate::recording::Row;
use palpate_core::{Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// True and estimated contact of one reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluatedContact {
    /// True position.
    pub truth: Position,
    /// True force, where known.
    pub force_n: Option<f64>,
    /// Estimated position.
    pub estimate: Position,
    /// Coordinates in their 95 % intervals; `None` without intervals.
    pub covered: Option<CoveredCoordinates>,
    /// Interval score: see [`Evaluation::interval_score_m`](super::Evaluation::interval_score_m).
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

impl EvaluatedContact {
    pub(super) fn new(row: &Row, estimate: &Estimate, extent: Extent) -> Self {
        Self::of_contact(row.position, row.force_n, estimate, extent)
    }

    pub(super) fn of_contact(
        truth: Position,
        force_n: Option<f64>,
        estimate: &Estimate,
        extent: Extent,
    ) -> Self {
        let contact = &estimate.contact;
        let force = || {
            let [low_n, high_n] = ContactRecord::new(contact, extent).force_interval_95_n()?;
            Some(LocatedForce { estimate_n: contact.force_n?, covered: (low_n..=high_n).contains(&force_n?) })
        };
        Self {
            truth,
            force_n,
            estimate: contact.position,
            covered: CoveredCoordinates::new(contact, truth, extent),
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
