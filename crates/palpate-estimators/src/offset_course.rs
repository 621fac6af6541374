//! Offsets of the channels in the course of a recording, by which its readings are tared.

use crate::recording::Recording;

/// Offsets of the channels at the rows of a recording, estimated from the presses of another recording.
#[derive(Clone, Debug, PartialEq)]
pub struct OffsetCourse {
    /// Offset of each channel at each row; `None` for a channel that is not in use.
    pub at_rows: Vec<Option<Vec<f64>>>,
    /// Mean offset of each channel over the recording from which the offsets are estimated.
    pub means: Vec<Option<f64>>,
}

impl OffsetCourse {
    /// The rows with the offsets `learnt` in place of their own, or with the means where no offset was learnt.
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

    /// Greatest change of each channel over the rows, in its unit.
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
