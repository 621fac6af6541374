//! The presses of a calibration.

use super::guide::Press;
use palpate_estimators::arrangement::ArrangementError;
use palpate_estimators::recording::Row;
use palpate_rig::{Rig, RigSimulationError};

/// A rig that does not say where to press.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// It has no training positions.
    #[error(transparent)]
    NoTraining(#[from] RigSimulationError),
    /// They cannot be laid out.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
}

/// The presses of a rig's training positions that are not among the rows of before: each position as often as the rig repeats it, with each of
/// `depths_m` where a machine presses. The force is `force_n`, where it is given, else that of the rig; it is not known where depths differ.
///
/// # Errors
/// [`PlanError`] where the rig has no positions, or they cannot be laid out.
pub fn plan(
    rig: &Rig,
    force_n: Option<f64>,
    depths_m: &[f64],
    before: &[Row],
) -> Result<Vec<Press>, PlanError> {
    let training = rig.training()?;
    let force_n = force_n.or(training.force_n).or(rig.setup.force_n()).filter(|_| depths_m.len() <= 1);
    let depths: Vec<Option<f64>> = match depths_m {
        [] => vec![None],
        depths_m => depths_m.iter().copied().map(Some).collect(),
    };
    let mut plan = Vec::new();
    for position in training.positions(rig.setup.surface().extent())? {
        let done = before.iter().filter(|row| row.touches() && is_at(row, position)).count();
        let presses = depths
            .iter()
            .flat_map(|depth_m| std::iter::repeat_n(*depth_m, training.repeats))
            .map(|depth_m| Press { position, force_n, depth_m });
        plan.extend(presses.skip(done));
    }
    Ok(plan)
}

/// True for a row of this position, but for the rounding of its file.
fn is_at(row: &Row, position: palpate_mechanics::contact::Position) -> bool {
    const ROUNDING_M: f64 = 1e-9;
    row.position.distance_m(position) < ROUNDING_M
}
