//! Offsets over a recording, for tares.

use crate::recording::Recording;

/// Offsets by row, estimated from another recording.
#[derive(Clone, Debug, PartialEq)]
pub struct OffsetCourse {
    /// Offset of each used channel by row.
    pub at_rows: Vec<Option<Vec<f64>>>,
    /// Mean offset over the other recording.
    pub means: Vec<Option<f64>>,
}

impl OffsetCourse {
    /// Returns rows with the offsets `learnt`, or else the means.
    pub fn tared(&self, recording: &Recording, learnt: Option<&[f64]>) -> Recording {
        let mut tared = recording.clone();
        for (i, row) in tared.rows.iter_mut().enumerate() {
            for (c, value) in row.reading.iter_mut().enumerate() {
                let own = self.at_rows.get(c).and_then(|offsets| offsets.as_ref()?.get(i));
                let learnt = learnt.and_then(|learnt| learnt.get(c).copied());
                if let (Some(own), Some(mean)) = (own, self.means.get(c).copied().flatten()) {
                    *value += learnt.unwrap_or(mean) - own;
                }
            }
        }
        tared
    }

    /// Range of each channel's offsets.
    pub fn spans(&self) -> Vec<f64> {
        let span = |offsets: &Option<Vec<f64>>| {
            let offsets = offsets.iter().flatten();
            let (low, high) = offsets.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), offset| {
                (low.min(*offset), high.max(*offset))
            });
            (high - low).max(0.0)
        };
        self.at_rows.iter().map(span).collect()
    }
}
