//! Sample-and-hold detection in a stream.

use super::sample_hold::{RepeatCause, RepeatCounts, is_same_reading};

/// Pairs between two tests.
const PAIRS_EACH: u64 = 32;

/// Detector of a source faster than its sensors.
///
/// ```
/// use palpate_estimators::recording::RepeatWatch;
///
/// let mut watch = RepeatWatch::new(2);
/// let values: Vec<[f64; 2]> = (0..100_u32).map(|i| [f64::from(i * 7919 % 97), f64::from(i * 104_729 % 89)]).collect();
/// let stream = values.iter().flat_map(|value| [value; 4]);
/// let repeats = stream.filter(|reading| watch.add(*reading, true)).count();
/// // The first test follows 32 pairs, with 8 readings and 24 repeats; all repeats after it are detected.
/// assert!(watch.is_sample_and_hold() && (270..=300).contains(&repeats), "{repeats}");
/// ```
#[derive(Clone, Debug)]
pub struct RepeatWatch {
    counts: RepeatCounts,
    last: Vec<f64>,
    tested: u64,
    is_sample_and_hold: bool,
}

impl RepeatWatch {
    /// Creates a detector.
    pub fn new(channels: usize) -> Self {
        Self { counts: RepeatCounts::new(channels), last: Vec::new(), tested: 0, is_sample_and_hold: false }
    }

    /// Adds the next reading; true for a repeat under sample and hold. Only readings at rest are tested,
    /// because a touch changes all channels together.
    pub fn add(&mut self, reading: &[f64], at_rest: bool) -> bool {
        if at_rest && !self.last.is_empty() && !self.is_sample_and_hold {
            self.counts.add(&self.last, reading);
            if self.counts.pairs() >= self.tested + PAIRS_EACH {
                self.tested = self.counts.pairs();
                self.is_sample_and_hold = self.counts.cause() == Some(RepeatCause::SampleAndHold);
            }
        } else if !at_rest {
            self.counts.end_stretch();
        }
        let repeats = is_same_reading(&self.last, reading);
        self.last.clear();
        self.last.extend_from_slice(reading);
        repeats && self.is_sample_and_hold
    }

    /// True if sample and hold was detected.
    pub fn is_sample_and_hold(&self) -> bool {
        self.is_sample_and_hold
    }
}
