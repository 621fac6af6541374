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
/// A row is one of the presses of its position and, where it says its depth, of that depth: presses that were left out are asked for again, wherever
/// they stood. The depth of a row is its nuisance coordinate ([`Journal`](super::Journal)).
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
        for depth_m in &depths {
            let press = Press { position, force_n, depth_m: *depth_m };
            let done = before.iter().filter(|row| row.touches() && is_of(row, &press)).count();
            plan.extend(std::iter::repeat_n(press, training.repeats.saturating_sub(done)));
        }
    }
    Ok(plan)
}

/// True for a row of this place and depth, but for the rounding of its file.
fn is_of(row: &Row, press: &Press) -> bool {
    const ROUNDING_M: f64 = 1e-9;
    let is_deep = match (row.nuisances.first(), press.depth_m) {
        (Some(row_m), Some(press_m)) => (row_m - press_m).abs() < ROUNDING_M,
        _ => true,
    };
    is_deep && row.position.distance_m(press.position) < ROUNDING_M
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mechanics::contact::Position;

    fn rig() -> Rig {
        Rig::from_toml(include_str!("../../../../examples/fsi-like.toml")).unwrap()
    }

    fn pressed(press: &Press) -> Row {
        Row {
            position: press.position,
            force_n: Some(1.0),
            nuisances: press.depth_m.into_iter().collect(),
            time_s: None,
            reading: vec![0.5, 0.5],
        }
    }

    #[test]
    fn every_position_is_pressed_to_every_depth_as_often_as_the_rig_says() {
        let presses = plan(&rig(), None, &[1e-3, 2e-3], &[]).unwrap();
        assert_eq!(presses.len(), 9 * 2 * 3);
        let depths: Vec<Option<f64>> = presses[..6].iter().map(|press| press.depth_m).collect();
        assert_eq!(depths, [[Some(1e-3); 3], [Some(2e-3); 3]].concat());
        assert!(presses[..6].iter().all(|press| press.position == presses[0].position));
        assert!(presses.iter().all(|press| press.force_n.is_none()), "forces of several depths differ");
    }

    #[test]
    fn by_hand_or_to_one_depth_the_force_is_that_of_the_rig() {
        for depths_m in [&[][..], &[2e-3]] {
            let presses = plan(&rig(), None, depths_m, &[]).unwrap();
            assert!(presses.iter().all(|press| press.force_n == Some(1.0)));
            assert_eq!(presses[0].depth_m, depths_m.first().copied());
        }
        assert_eq!(plan(&rig(), Some(2.0), &[], &[]).unwrap()[0].force_n, Some(2.0));
    }

    #[test]
    fn presses_of_before_are_not_asked_for_again() {
        let all = plan(&rig(), None, &[1e-3, 2e-3], &[]).unwrap();
        let mut before: Vec<Row> = all[..7].iter().map(pressed).collect();
        // The file has rounded a position, and untouched rows are no presses.
        before[2].position.x_m += 1e-13;
        before.push(Row { force_n: Some(0.0), position: Position::default(), ..before[0].clone() });
        assert_eq!(plan(&rig(), None, &[1e-3, 2e-3], &before).unwrap(), all[7..]);
    }

    #[test]
    fn presses_that_were_left_out_are_asked_for_again_wherever_they_stood() {
        let all = plan(&rig(), None, &[1e-3, 2e-3], &[]).unwrap();
        // Left out: the second press of the first depth, the last of the second depth, and all of the third place.
        let left_out = |i: usize| [1, 5].contains(&i) || (12..18).contains(&i);
        let before: Vec<Row> =
            all[..24].iter().enumerate().filter(|(i, _)| !left_out(*i)).map(|(_, p)| pressed(p)).collect();
        let expected = [&all[1..2], &all[5..6], &all[12..18], &all[24..]].concat();
        assert_eq!(plan(&rig(), None, &[1e-3, 2e-3], &before).unwrap(), expected);
        // One place pressed more often than the rig asks for takes nothing from another.
        let often: Vec<Row> = std::iter::repeat_n(pressed(&all[0]), 9).collect();
        assert_eq!(plan(&rig(), None, &[1e-3, 2e-3], &often).unwrap(), all[3..]);
    }

    #[test]
    fn a_hand_s_presses_that_were_left_out_are_asked_for_again() {
        let all = plan(&rig(), None, &[], &[]).unwrap();
        let before = [pressed(&all[0]), pressed(&all[4])];
        let expected = [&all[..2], &all[3..5], &all[6..]].concat();
        assert_eq!(plan(&rig(), None, &[], &before).unwrap(), expected);
    }
}
