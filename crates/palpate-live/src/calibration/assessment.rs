use palpate_design::positions::{PositionDesign, next_press};
use palpate_estimators::evaluation::{Evaluation, cross_validate};
use palpate_estimators::fit::FitTask;
use palpate_estimators::recording::Recording;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_rig::Rig;

const FOLDS: usize = 5;

/// Errors of cross-validation, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Folds.
    pub folds: usize,
    /// Median error.
    pub median_m: f64,
    /// Mean error.
    pub mean_m: f64,
}

/// Expected gain of more presses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// Reduction of the expected error by unlimited presses, in %.
    pub percent: f64,
    /// Threshold of a worthwhile gain, in %.
    pub stop_percent: f64,
}

impl Gain {
    /// True if the gain is below the threshold.
    pub fn is_enough(&self) -> bool {
        self.percent < self.stop_percent
    }
}

/// Assessment of a calibration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Assessment {
    /// Held-out errors; `None` with too few positions or a failed fit.
    pub held_out: Option<HeldOut>,
    /// Held-out error of each press in metres; empty if unknown.
    pub errors_m: Vec<Option<f64>>,
    /// Gain of more presses; `None` if unknown.
    pub gain: Option<Gain>,
    /// Reasons for missing results.
    pub remarks: Vec<String>,
}

impl Assessment {
    /// Assesses a recording of a rig, with a fit for every fold.
    ///
    /// # Errors
    /// [`Cancelled`].
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
            let is_its_own = |located: &&palpate_estimators::evaluation::EvaluatedContact| {
                located.truth == row.position && Some(located.error_m()) == *error_m
            };
            assert!(evaluation.located.iter().any(|located| is_its_own(&located)), "{row:?} {error_m:?}");
        }
    }
}
