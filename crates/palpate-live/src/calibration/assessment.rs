//! Assessment of a calibration: its error at held-out positions, and the gain of more presses.

use palpate_design::positions::{PositionDesign, next_press};
use palpate_estimators::evaluation::{Evaluation, cross_validate};
use palpate_estimators::fit::FitTask;
use palpate_estimators::recording::Recording;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_rig::Rig;

/// Folds of the cross-validation.
const FOLDS: usize = 5;

/// Errors at held-out positions of the fit, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Folds of the cross-validation.
    pub folds: usize,
    /// Median error.
    pub median_m: f64,
    /// Mean error.
    pub mean_m: f64,
}

/// Expected gain of more presses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// Reduction of the expected error by an unlimited number of presses, in %.
    pub percent: f64,
    /// Gain in % below which more presses are not worthwhile.
    pub stop_percent: f64,
}

impl Gain {
    /// True if more presses are not worthwhile.
    pub fn is_enough(&self) -> bool {
        self.percent < self.stop_percent
    }
}

/// Assessment of a calibration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Assessment {
    /// Errors at held-out positions; `None` if there are too few positions, or a fold cannot be fitted.
    pub held_out: Option<HeldOut>,
    /// Error of each press at its held-out position, in metres, in the order of the recording; empty if the errors are unknown.
    pub errors_m: Vec<Option<f64>>,
    /// Gain of more presses; `None` if it is unknown.
    pub gain: Option<Gain>,
    /// Reasons why a result is missing.
    pub remarks: Vec<String>,
}

impl Assessment {
    /// The assessment of a recording of a rig, with a new fit of the estimator for every fold.
    ///
    /// # Errors
    /// [`Cancelled`] if the watch stopped it.
    pub fn new(rig: &Rig, recording: &Recording, seed: u64, watch: Watch) -> Result<Self, Cancelled> {
        let mut own = Self::default();
        if recording.distinct_positions().len() >= FOLDS {
            let task = FitTask::new(&rig.setup, recording).seed(seed).watch(watch);
            match cross_validate(&rig.estimator, task, FOLDS) {
                Ok(evaluation) => {
                    own.errors_m = errors_by_press(recording, &evaluation);
                    own.held_out = evaluation.summary(None).map(|summary| HeldOut {
                        folds: FOLDS,
                        median_m: summary.median_m,
                        mean_m: summary.average_m,
                    });
                }
                Err(error) if Cancelled::caused(&error) => return Err(Cancelled),
                Err(error) => own.remarks.push(format!("no error at held-out positions: {error}")),
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

/// Errors of a cross-validation in the order of the presses. The results of the evaluation are in the order of its folds.
fn errors_by_press(recording: &Recording, evaluation: &Evaluation) -> Vec<Option<f64>> {
    let presses = recording.rows.iter().scan(0, |presses, row| {
        let press = row.touches().then_some(*presses);
        *presses += usize::from(row.touches());
        Some(press)
    });
    let press_of_row: Vec<Option<usize>> = presses.collect();
    let mut errors_m = vec![None; press_of_row.iter().flatten().count()];
    let held_out = recording.folds(FOLDS).unwrap_or_default().into_iter().flat_map(|fold| fold.held_out);
    let judged = held_out.filter_map(|row| press_of_row[row]);
    for (press, located) in judged.zip(&evaluation.located) {
        errors_m[press] = Some(located.error_m());
    }
    errors_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_belong_to_their_presses() {
        let rig = Rig::from_toml(include_str!("../../../../examples/noisy-beam.toml")).unwrap();
        let mut recording = rig.simulate(0).unwrap();
        recording.rows.truncate(60);
        let task = FitTask::new(&rig.setup, &recording);
        let evaluation = cross_validate(&rig.estimator, task, FOLDS).unwrap();
        let errors_m = errors_by_press(&recording, &evaluation);
        assert_eq!(errors_m.len(), 60);
        for (row, error_m) in recording.rows.iter().zip(&errors_m) {
            let is_its_own = |located: &&palpate_estimators::evaluation::Located| {
                located.truth == row.position && Some(located.error_m()) == *error_m
            };
            assert!(evaluation.located.iter().any(|located| is_its_own(&located)), "{row:?} {error_m:?}");
        }
    }
}
