//! JSON records of estimates, in millimetres and newtons.

use crate::force_prior::force_interval_95_n;
use palpate_core::{ContactEstimate, Estimate, Mode};
use palpate_mechanics::surface::Extent;
use serde::Serialize;

const TRADE_OFF: &str = "force and position";

/// JSON record of an estimate.
///
/// ```
/// use palpate_core::{Estimate, Position, Status};
/// use palpate_estimators::estimate_record::EstimateRecord;
/// use palpate_mechanics::surface::Extent;
///
/// let estimate = Estimate::of_position(Position::along(0.125), Status::Located);
/// let record = EstimateRecord::new(&estimate, Extent::line(0.4)?);
/// assert_eq!(serde_json::to_string(&record)?, r#"{"x_mm":125.0,"status":"located"}"#);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EstimateRecord {
    /// Only or strongest contact.
    #[serde(flatten)]
    pub contact: ContactRecord,
    /// Name of the status.
    pub status: &'static str,
    /// Further modes of the posterior, most probable first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub modes: Vec<ModeRecord>,
    /// Further contacts, strongest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<ContactRecord>,
}

/// JSON record of a contact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactRecord {
    /// Position along the surface.
    pub x_mm: f64,
    /// Position across a plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_mm: Option<f64>,
    /// Force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
    /// 95 % interval along the surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_95_mm: Option<[f64; 2]>,
    /// 95 % interval across a plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_95_mm: Option<[f64; 2]>,
    /// Standard deviation of the position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sd_mm: Option<f64>,
    /// 95 % interval of a force that trades off with the position.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_95_n: Option<[f64; 2]>,
    /// Quantities that trade off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trade_off: Option<&'static str>,
    /// Standard deviation of the force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sd_force_n: Option<f64>,
}

/// JSON record of a mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeRecord {
    /// Contact of the mode.
    #[serde(flatten)]
    pub contact: ContactRecord,
    /// Posterior probability.
    pub probability: f64,
}

impl EstimateRecord {
    /// Returns the record of an estimate.
    pub fn new(estimate: &Estimate, extent: Extent) -> Self {
        let mode = |mode: &Mode| ModeRecord {
            contact: ContactRecord::new(&mode.contact, extent),
            probability: mode.probability,
        };
        let further = estimate.further.as_slice().iter();
        Self {
            contact: ContactRecord::new(&estimate.contact, extent),
            status: estimate.status.name(),
            modes: estimate.modes.as_slice().iter().map(mode).collect(),
            further: further.map(|contact| ContactRecord::new(contact, extent)).collect(),
        }
    }
}

impl ContactRecord {
    /// Returns the record of a contact.
    pub fn new(contact: &ContactEstimate, extent: Extent) -> Self {
        let uncertainty = contact.uncertainty.as_ref();
        let mm = |(low, high): (f64, f64)| [low * 1e3, high * 1e3];
        // JSON has no infinity: an undetermined quantity is omitted.
        let sd = |variance: f64| Some(variance.sqrt()).filter(|sd| *sd > 0.0 && sd.is_finite());
        let force_95_n = uncertainty.and_then(|u| u.force_95_n).map(|(low_n, high_n)| [low_n, high_n]);
        Self {
            x_mm: contact.position.x_m * 1e3,
            y_mm: extent.if_plane(contact.position.y_m * 1e3),
            force_n: contact.force_n,
            x_95_mm: uncertainty.map(|u| mm(u.x_95_m)),
            y_95_mm: uncertainty.and_then(|u| extent.if_plane(mm(u.y_95_m))),
            sd_mm: uncertainty.and_then(|u| sd(u.covariance[0] + u.covariance[3])).map(|sd_m| sd_m * 1e3),
            force_95_n,
            trade_off: force_95_n.map(|_| TRADE_OFF),
            sd_force_n: uncertainty.and_then(|u| sd(u.covariance[5])),
        }
    }

    /// 95 % interval of an estimated, determined force.
    pub fn force_interval_95_n(&self) -> Option<[f64; 2]> {
        let normal =
            || self.force_n.zip(self.sd_force_n).map(|(at_n, sd_n)| force_interval_95_n(at_n, sd_n).into());
        self.force_95_n.or_else(normal)
    }
}
