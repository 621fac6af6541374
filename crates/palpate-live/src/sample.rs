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
        }
    }
}
