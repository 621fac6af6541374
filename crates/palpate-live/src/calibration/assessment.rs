//! Assessment of a calibration: its error at positions held out, and the gain of more presses.

use palpate_design::positions::{PositionDesign, next_press};
use palpate_estimators::evaluation::cross_validate;
use palpate_estimators::fit::FitTask;
use palpate_estimators::recording::Recording;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_rig::Rig;

/// Folds of the cross-validation.
const FOLDS: usize = 5;

/// Errors at positions held out of the fit, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Folds of the cross-validation.
    pub folds: usize,
    /// Median error.
    pub median_m: f64,
    /// Mean error.
    pub mean_m: f64,
}

/// Gain of more presses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// By how much endlessly many presses would lower the expected error, in %.
    pub percent: f64,
    /// Gain in % below which more presses are not worth it.
    pub stop_percent: f64,
}

impl Gain {
    /// True where more presses are not worth it.
    pub fn is_enough(&self) -> bool {
        self.percent < self.stop_percent
    }
}

/// Assessment of a calibration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Assessment {
    /// Errors at positions held out; `None` where they are too few, or a fold cannot be fitted.
    pub held_out: Option<HeldOut>,
    /// Gain of more presses; `None` where it is not known.
    pub gain: Option<Gain>,
    /// Reasons why something is not known.
    pub remarks: Vec<String>,
}

impl Assessment {
    /// The assessment of a recording of a rig, which fits its estimator anew for every fold.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch stopped it.
    pub fn new(rig: &Rig, recording: &Recording, seed: u64, watch: Watch) -> Result<Self, Cancelled> {
        let mut own = Self::default();
        if recording.distinct_positions().len() >= FOLDS {
            let task = FitTask::new(&rig.setup, recording).seed(seed).watch(watch);
            match cross_validate(&rig.estimator, task, FOLDS) {
                Ok(evaluation) => {
                    own.held_out = evaluation.summary(None).map(|summary| HeldOut {
                        folds: FOLDS,
                        median_m: summary.median_m,
                        mean_m: summary.average_m,
                    });
                }
                Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
                Err(error) => own.remarks.push(format!("no error at positions held out: {error}")),
            }
        }
        let design = rig.training.as_ref().map_or_else(PositionDesign::default, PositionDesign::for_training);
        match next_press(&rig.setup, recording, &design, watch) {
            Ok(advice) => {
                let percent = advice.remaining_gain_percent();
                own.gain = Some(Gain { percent, stop_percent: advice.stop_percent });
            }
            Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
            Err(error) => own.remarks.push(format!("no advice on more presses: {error}")),
        }
        Ok(own)
    }
}
