//! Offsets of the channels in the course of a recording, to which readings of another time are brought as by a tare.

use crate::recording::Recording;

/// Offsets of the channels of a surface at the rows of a recording that follow from the presses of another one.
#[derive(Clone, Debug, PartialEq)]
pub struct OffsetCourse {
    /// Offset of each channel at each row; `None` of a channel that is not in use.
    pub at_rows: Vec<Option<Vec<f64>>>,
    /// Mean of each over the recording that told them.
    pub means: Vec<Option<f64>>,
}

impl OffsetCourse {
    /// The rows with the offsets `learnt` in the place of their own; with the means where nothing was learnt.
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
