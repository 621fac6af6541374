//! Splits into training and judged recordings.

use crate::offset_course::OffsetCourse;
use crate::recording::{Fold, Recording, TooFewPositions};

/// Training and judged recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// Recording to fit.
    pub training: Recording,
    /// Recording to judge by.
    pub held_out: Recording,
    /// Offsets of the judged rows, to be replaced by learnt ones.
    pub offsets: Option<OffsetCourse>,
    /// Origin.
    pub origin: SplitOrigin,
}

/// Origin of a split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitOrigin {
    /// Fold, with intervals widened by the others.
    Fold,
    /// Calibration, with the method's intervals.
    Calibration,
}

impl Split {
    /// Returns a split per fold.
    ///
    /// # Errors
    /// [`TooFewPositions`] as for [`Recording::folds`].
    pub fn by_folds(recording: &Recording, folds: usize) -> Result<Vec<Self>, TooFewPositions> {
        let folds = recording.folds(folds)?;
        let split = |fold: &Fold| Self {
            training: recording.subset(&fold.training),
            held_out: recording.subset(&fold.held_out),
            offsets: None,
            origin: SplitOrigin::Fold,
        };
        Ok(folds.iter().map(split).collect())
    }
}
