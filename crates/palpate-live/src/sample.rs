//! Samples: readings with estimates.

use crate::frame::Channel;
use palpate_core::Estimate;
use palpate_estimators::estimate_record::EstimateRecord;
use palpate_mechanics::surface::Extent;
use serde::Serialize;
use std::time::Duration;

/// Reading with its estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Number in the session, from 0.
    pub number: u64,
    /// Increasing Unix time in ns, by the board's clock if available.
    pub unix_ns: u64,
    /// Instant of the last byte.
    pub arrived: Duration,
    /// Received reading in SI units or raw.
    pub reading: Vec<f64>,
    /// Located reading: tared and filtered.
    pub tared: Vec<f64>,
    /// Estimate.
    pub estimate: Estimate,
}

/// Sample for JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SampleRecord {
    /// Number in the session, from 0.
    pub number: u64,
    /// Unix time in seconds.
    pub time_s: f64,
    /// Received reading in the units of the channels.
    pub reading: Vec<f64>,
    /// Estimate.
    #[serde(flatten)]
    pub estimate: EstimateRecord,
    /// Covariance from [`covariance_mm2`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance_mm2: Option<[f64; 3]>,
}

impl SampleRecord {
    /// Record of a sample.
    pub fn new(sample: &Sample, channels: &[Channel], extent: Extent) -> Self {
        let values = sample.reading.iter().zip(channels);
        Self {
            number: sample.number,
            time_s: sample.unix_ns as f64 * 1e-9,
            reading: values.map(|(value, channel)| value / channel.unit.factor()).collect(),
            estimate: EstimateRecord::new(&sample.estimate, extent),
            covariance_mm2: covariance_mm2(&sample.estimate, extent),
        }
    }
}

/// xx, xy, yy of a position on a plane in mm², if finite.
pub fn covariance_mm2(estimate: &Estimate, extent: Extent) -> Option<[f64; 3]> {
    let uncertainty = estimate.contact.uncertainty.filter(|_| extent.width_m().is_some())?;
    let [xx, xy, _, yy, ..] = uncertainty.covariance;
    // An undetermined position has an infinite covariance, and JSON has no infinity.
    Some([xx, xy, yy].map(|entry_m2| entry_m2 * 1e6)).filter(|entries| entries.iter().all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_core::{ContactEstimate, Position, Status, Uncertainty};

    #[test]
    fn a_plane_has_a_covariance_in_mm2_and_a_line_has_none() {
        let covariance = [4e-6, 1e-6, 0.5, 9e-6, 0.25, 0.01];
        let uncertainty = Uncertainty { covariance, ..Uncertainty::default() };
        let contact = ContactEstimate {
            position: Position { x_m: 0.1, y_m: 0.05 },
            uncertainty: Some(uncertainty),
            ..ContactEstimate::default()
        };
        let estimate = Estimate::of_contact(contact, Status::Located);
        let (line, plane) = (Extent::line(0.2).unwrap(), Extent::plane(0.2, 0.1).unwrap());
        let [xx, xy, yy] = covariance_mm2(&estimate, plane).unwrap();
        assert!((xx - 4.0).abs() < 1e-9 && (xy - 1.0).abs() < 1e-9 && (yy - 9.0).abs() < 1e-9);
        assert_eq!(covariance_mm2(&estimate, line), None);
        let mut unknown = estimate;
        unknown.contact.uncertainty = Some(Uncertainty { covariance: [f64::INFINITY; 6], ..uncertainty });
        assert_eq!(covariance_mm2(&unknown, plane), None);
    }
}
