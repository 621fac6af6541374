use crate::sample::{Sample, covariance_mm2};
use palpate_estimators::estimate_record::EstimateRecord;
use palpate_mechanics::surface::Extent;
use serde::ser::{Serialize, SerializeMap, Serializer};

/// Topics in the order of the file.
pub const TOPICS: [(&str, &str, &str); 3] = [
    (READING, "palpate.Reading", READING_SCHEMA),
    (ESTIMATE, "palpate.Estimate", ESTIMATE_SCHEMA),
    (EVENT, "palpate.Event", EVENT_SCHEMA),
];
pub const READING: &str = "/reading";
pub const ESTIMATE: &str = "/estimate";
pub const EVENT: &str = "/event";

const READING_SCHEMA: &str = r#"{"title":"palpate.Reading","type":"object","properties":{
"number":{"type":"integer","description":"which reading of the session, from 0"},
"values":{"type":"object","additionalProperties":{"type":"number"},"description":"what the board sent, one number a channel, in the units of the metadata"}}}"#;
pub const ESTIMATE_SCHEMA: &str = r#"{"title":"palpate.Estimate","type":"object","properties":{
"number":{"type":"integer","description":"the reading that it is of"},
"x_mm":{"type":"number"},"y_mm":{"type":"number"},"force_n":{"type":"number"},
"x_95_mm":{"type":"array","items":{"type":"number"}},"y_95_mm":{"type":"array","items":{"type":"number"}},
"sd_mm":{"type":"number"},"sd_force_n":{"type":"number"},
"covariance_mm2":{"type":"array","items":{"type":"number"},"description":"of the position on a plane: xx, xy, yy"},
"force_95_n":{"type":"array","items":{"type":"number"}},"trade_off":{"type":"string"},
"status":{"type":"string"},
"modes":{"type":"array","items":{"type":"object"}},"further":{"type":"array","items":{"type":"object"}},
"located":{"type":"array","items":{"type":"number"},"description":"the tared reading that was located, in SI units or raw"}}}"#;
pub const EVENT_SCHEMA: &str = r#"{"title":"palpate.Event","type":"object","properties":{
"time_s":{"type":"number","description":"seconds since 1970-01-01 00:00 UTC"},
"event":{"type":"string"},"text":{"type":"string"},"name":{"type":"string"},"state":{"type":"string"},"why":{"type":"string"},
"seconds":{"type":"number"},"x_mm":{"type":"number"},"y_mm":{"type":"number"},"force_n":{"type":"number"}}}"#;

pub struct ReadingMessage<'a> {
    pub sample: &'a Sample,
    pub channels: &'a [(String, f64)],
}

#[derive(serde::Serialize)]
pub struct EstimateMessage<'a> {
    pub number: u64,
    #[serde(flatten)]
    pub estimate: EstimateRecord,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance_mm2: Option<[f64; 3]>,
    pub located: &'a [f64],
}

impl<'a> EstimateMessage<'a> {
    pub fn new(sample: &'a Sample, extent: Extent) -> Self {
        Self {
            number: sample.number,
            estimate: EstimateRecord::new(&sample.estimate, extent),
            covariance_mm2: covariance_mm2(&sample.estimate, extent),
            located: &sample.tared,
        }
    }
}

impl Serialize for ReadingMessage<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(2))?;
        map.serialize_entry("number", &self.sample.number)?;
        map.serialize_entry("values", &Values(self))?;
        map.end()
    }
}

struct Values<'a>(&'a ReadingMessage<'a>);

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let values = self.0.channels.iter().zip(&self.0.sample.reading);
        serializer.collect_map(values.map(|((name, factor), value)| (name, in_board_units(*value, *factor))))
    }
}

/// `number` of `value = number * factor` to the last bit: the quotient or a neighbouring floating-point number.
pub fn in_board_units(value: f64, factor: f64) -> f64 {
    let quotient = value / factor;
    let near = [quotient, quotient.next_down(), quotient.next_up()];
    near.into_iter().find(|number| number * factor == value).unwrap_or(quotient)
}

#[cfg(test)]
mod tests {
    use super::in_board_units;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn sent_readings_are_read_again_bit_for_bit() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        for factor in [1.0, 1e-3, 1e-6, 1e-9, std::f64::consts::PI / 180.0, 0.0254, 4.448_221_615_260_5] {
            for _ in 0..20_000 {
                let sent = rng.random_range(-1.0..1.0) * 10_f64.powi(rng.random_range(-20..20));
                let value = sent * factor;
                assert_eq!(in_board_units(value, factor) * factor, value, "{sent} {factor}");
            }
        }
    }
}
