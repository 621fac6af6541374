//! Splits of recordings into a part to fit and a part to judge by.

use crate::offset_course::OffsetCourse;
use crate::recording::{Fold, Recording, TooFewPositions};

/// A recording to fit, and one to judge by, with contacts that the fit does not use.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// Recording to fit.
    pub training: Recording,
    /// Recording to judge by.
    pub judged: Recording,
    /// Offsets at the rows to judge by, to be brought to those that a locator learns; `None` to judge by the readings as they are.
    pub offsets: Option<OffsetCourse>,
    /// Origin.
    pub origin: SplitOrigin,
}

/// Origin of a split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitOrigin {
    /// A fold of a recording: intervals are widened as those of a locator that is fitted to all of it, by the factor of the other folds.
    Fold,
    /// A calibration of its own: intervals are those of the method.
    Calibration,
}

impl Split {
    /// A split for each fold of a recording, by position.
    ///
    /// # Errors
    /// [`TooFewPositions`] as for [`Recording::folds`].
    pub fn by_folds(recording: &Recording, folds: usize) -> Result<Vec<Self>, TooFewPositions> {
        let folds = recording.folds(folds)?;
        let split = |fold: &Fold| Self {
            training: recording.subset(&fold.training),
            judged: recording.subset(&fold.held_out),
            offsets: None,
            origin: SplitOrigin::Fold,
        };
        Ok(folds.iter().map(split).collect())
    }
}
