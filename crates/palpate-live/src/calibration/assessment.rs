//! How good a calibration is, and what more presses would gain.

use palpate_design::positions::{PositionDesign, next_press};
use palpate_estimators::evaluation::cross_validate;
use palpate_estimators::fit::FitTask;
use palpate_estimators::recording::Recording;
use palpate_numerics::watch::Watch;
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

/// Assessment of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// Presses of the recording.
    pub presses: usize,
    /// Errors at positions held out; `None` where they are too few, or a fold cannot be fitted.
    pub held_out: Option<HeldOut>,
    /// By how much endlessly many presses would lower the expected error, in %; `None` where that is not known.
    pub gain_percent: Option<f64>,
    /// Whether that is too little to go on.
    pub is_enough: bool,
    /// Reasons why something is not known.
    pub remarks: Vec<String>,
}

impl Assessment {
    /// The assessment of a recording of a rig, which fits its estimator anew for every fold.
    pub fn new(rig: &Rig, recording: &Recording, seed: u64, watch: Watch) -> Self {
        let touched = recording.touched();
        let mut own = Self {
            presses: touched.rows.len(),
            held_out: None,
            gain_percent: None,
            is_enough: false,
            remarks: Vec::new(),
        };
        if touched.distinct_positions().len() >= FOLDS {
            let task = FitTask::new(&rig.setup, recording).seed(seed).watch(watch);
            match cross_validate(&rig.estimator, task, FOLDS) {
                Ok(evaluation) => {
                    own.held_out = evaluation.summary(None).map(|summary| HeldOut {
                        folds: FOLDS,
                        median_m: summary.median_m,
                        mean_m: summary.average_m,
                    });
                }
                Err(error) => own.remarks.push(format!("no error at positions held out: {error}")),
            }
        }
        let design = rig.training.as_ref().map_or_else(PositionDesign::default, PositionDesign::for_training);
        match next_press(&rig.setup, &touched, &design, watch) {
            Ok(advice) => {
                own.gain_percent = Some(advice.remaining_gain_percent());
                own.is_enough = advice.is_enough();
            }
            Err(error) => own.remarks.push(format!("no advice on more presses: {error}")),
        }
        own
    }
}
