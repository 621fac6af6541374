//! States of a tracked baseline, and the counts that lead from one to the next.

use super::baseline::Baseline;
use super::{LET_GO, run_length};
use crate::Status;

/// Evidence for the baseline in use.
///
/// | from | to | transition |
/// |---|---|---|
/// | `Calibration` | `Confirmed` | `no_contact`: the offsets of the calibration fit |
/// | unsettled | `Unconfirmed` | `outside_model`: the reading is the baseline |
/// | settled | `Unconfirmed` | the surface was touched during the tare: the reading after the release |
/// | settled | `Confirmed` | the offsets of the calibration fit again: these |
/// | settled | `Confirmed` | a contact has begun and ended by the alternative: this |
/// | `Unconfirmed` | `Confirmed` | a contact has begun and ended by the baseline |
/// | any | `Confirmed` | a known untouched reading |
#[derive(Clone, Debug, PartialEq)]
pub(super) enum State<B> {
    /// Offsets of the calibration, before the first update.
    Calibration,
    /// Readings that may be those of a touch, and another baseline for readings outside the model.
    Unconfirmed { alternative: Option<Alternative<B>> },
    /// Untouched readings, and the baseline that they replaced.
    Confirmed { replaced: Option<Alternative<B>> },
}

impl<B> State<B> {
    pub const UNCONFIRMED: Self = Self::Unconfirmed { alternative: None };
    pub const CONFIRMED: Self = Self::Confirmed { replaced: None };

    pub fn alternative(&mut self) -> Option<&mut Alternative<B>> {
        match self {
            Self::Calibration => None,
            Self::Unconfirmed { alternative: other } | Self::Confirmed { replaced: other } => other.as_mut(),
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Alternative<B> {
    pub baseline: Baseline<B>,
    /// Run of readings that are `outside_model` by both baselines.
    outside_model: u32,
}

impl<B: AsRef<[f64]> + AsMut<[f64]> + Clone> Alternative<B> {
    pub fn new(baseline: Baseline<B>) -> Self {
        Self { baseline, outside_model: 0 }
    }

    /// Adds a reading that is outside the model by the baseline in use, with its status by this one.
    pub fn update(&mut self, reading: &[f64], status: Status, time_constant: u32) {
        self.outside_model = run_length(self.outside_model, status == Status::OutsideModel);
        if status == Status::NoContact {
            self.baseline.update(reading, time_constant);
        }
        self.baseline.count(status);
    }

    /// True where the last reading does not fit an unsettled baseline, or several do not fit a settled one.
    pub fn is_refuted(&self, settled: u32) -> bool {
        self.outside_model >= if self.baseline.weight < settled { 1 } else { LET_GO }
    }

    /// Ends the runs of readings outside the model by the baseline in use.
    pub fn interrupt(&mut self) {
        self.outside_model = 0;
        self.baseline.interrupt_untouched_run();
    }
}

/// Lengths of runs of readings outside the model of a settled baseline.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct OutsideRuns {
    /// Readings whose negative is a contact.
    pub negative_contact: u32,
    /// Readings that the offsets of the calibration fit.
    pub calibration_fits: u32,
}
