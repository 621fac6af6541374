//! A reading with what it tells.

use crate::frame::Channel;
use palpate_core::Estimate;
use palpate_estimators::estimate_record::EstimateRecord;
use palpate_mechanics::surface::Extent;
use serde::Serialize;
use std::time::Duration;

/// A reading, its times, and the estimate that follows from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Which reading of the session, from 0.
    pub number: u64,
    /// Nanoseconds since 1970-01-01 00:00 UTC at which it was taken: by the board's clock, mapped to the host's, where the board tells the time.
    /// Never falls in a session.
    pub unix_ns: u64,
    /// Instant of its last byte by the host's monotonic clock.
    pub arrived: Duration,
    /// The reading as it came, in SI units or raw.
    pub reading: Vec<f64>,
    /// The reading that was located: tared and filtered.
    pub tared: Vec<f64>,
    /// The estimate.
    pub estimate: Estimate,
}

/// A sample as a record of JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SampleRecord {
    /// Which reading of the session, from 0.
    pub number: u64,
    /// Seconds since 1970-01-01 00:00 UTC.
    pub time_s: f64,
    /// The reading as it came, in the units of its channels.
    pub reading: Vec<f64>,
    /// The estimate.
    #[serde(flatten)]
    pub estimate: EstimateRecord,
    /// Covariance of the position on a plane, as of [`covariance_mm2`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance_mm2: Option<[f64; 3]>,
}

impl SampleRecord {
    /// The record of a sample of these channels.
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

/// Covariance of an estimated position on a plane, xx, xy and yy in mm², of the first contact; `None` on a line, and where it is not known.
pub fn covariance_mm2(estimate: &Estimate, extent: Extent) -> Option<[f64; 3]> {
    let uncertainty = estimate.contact.uncertainty.filter(|_| extent.width_m().is_some())?;
    let [xx, xy, _, yy, ..] = uncertainty.covariance;
    // JSON has no infinity, which stands for no knowledge at all.
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
