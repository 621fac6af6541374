use super::press::Press;
use palpate_estimators::arrangement::{Arrangement, ArrangementError};
use palpate_estimators::recording::{Row, is_same_force};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_rig::{Rig, RigSimulationError};

/// Error of a plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The rig has no training positions.
    #[error(transparent)]
    NoTraining(#[from] RigSimulationError),
    /// Invalid arrangement of positions.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
}

/// Forces of the presses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weights {
    /// Force in newtons, if not that of the rig.
    pub force_n: Option<f64>,
    /// Second force for every other place of a person.
    pub second_n: Option<f64>,
}

impl Weights {
    /// First force in newtons, stated or of the rig.
    pub fn first_n(self, rig: &Rig) -> Option<f64> {
        let of_training = rig.training.as_ref().and_then(|training| training.force_n);
        self.force_n.or(of_training).or(rig.setup.force_n())
    }

    fn second_n(self, rig: &Rig) -> Option<f64> {
        let first_n = self.first_n(rig)?;
        self.second_n.filter(|second_n| !is_same_force(first_n, *second_n))
    }
}

/// Presses that `before` lacks: training positions × repeats, and × `depths_m` for a machine. The depth of a
/// row is its nuisance coordinate.
///
/// Presses to several depths have no force. A person's second weight follows at every other place, on a ruler.
///
/// # Errors
/// [`PlanError`] of the positions.
pub fn plan(rig: &Rig, weights: Weights, depths_m: &[f64], before: &[Row]) -> Result<Vec<Press>, PlanError> {
    let training = rig.training()?;
    let ruler = match depths_m {
        [] => PlaceGrid::for_places(rig)?,
        _ => None,
    };
    let positions = training.positions(rig.setup.surface().extent())?;
    let positions: Vec<Position> =
        positions.into_iter().map(|at| ruler.map_or(at, |ruler| ruler.nearest(at))).collect();
    let first_n = weights.first_n(rig).filter(|_| depths_m.len() <= 1);
    let second_n = weights.second_n(rig).filter(|_| depths_m.is_empty());
    let depths: Vec<Option<f64>> = match depths_m {
        [] => vec![None],
        depths_m => depths_m.iter().copied().map(Some).collect(),
    };
    let at =
        |position, force_n| depths.iter().map(move |depth_m| Press { position, force_n, depth_m: *depth_m });
    let first = positions.iter().flat_map(|position| at(*position, first_n));
    let second = positions.iter().step_by(2).flat_map(|position| at(*position, second_n));
    let second = second.filter(|_| second_n.is_some());
    let is_done = |row: &Row, press: &Press| {
        let has_its_force = match (second_n, row.force_n, press.force_n) {
            (Some(_), Some(row_n), Some(press_n)) => is_same_force(row_n, press_n),
            _ => true,
        };
        row.touches() && has_its_force && is_of(row, press, ruler)
    };
    let left = |press: Press| {
        let done = before.iter().filter(|row| is_done(row, &press)).count();
        std::iter::repeat_n(press, training.repeats.saturating_sub(done))
    };
    Ok(first.chain(second).flat_map(left).collect())
}

#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceGrid {
    steps_per_m: f64,
    extent: Extent,
}

impl PlaceGrid {
    /// Ruler of a rig; `None` for listed places. The step is 1, 0.1, 0.01 or 0.001 mm: at most a fifth of the
    /// gap between places, and at most the gap to the edge, so places stay distinct and off the edge.
    pub fn for_places(rig: &Rig) -> Result<Option<Self>, PlanError> {
        let (training, extent) = (rig.training()?, rig.setup.surface().extent());
        if let Arrangement::Explicit(_) = training.arrangement {
            return Ok(None);
        }
        Ok(Self::from_positions(&training.positions(extent)?, extent))
    }

    /// Ruler of these places; `None` if they are too close.
    pub fn from_positions(positions: &[Position], extent: Extent) -> Option<Self> {
        /// Up to a micrometre, finer than any finger.
        const STEPS_PER_M: [f64; 4] = [1e3, 1e4, 1e5, 1e6];
        const LARGEST_SHARE: f64 = 0.2;
        let along: Vec<f64> = positions.iter().map(|at| at.x_m).collect();
        let across: Vec<f64> = positions.iter().map(|at| at.y_m).collect();
        let most_m = |coordinates: &[f64], side_m: f64| {
            let to_edge = coordinates.iter().flat_map(|at_m| [*at_m, side_m - at_m]);
            let to_edge_m = to_edge.filter(|gap_m| *gap_m > ROUNDING_M).fold(f64::INFINITY, f64::min);
            to_edge_m.min(LARGEST_SHARE * least_gap_m(coordinates))
        };
        let most_m = most_m(&along, extent.length_m())
            .min(extent.width_m().map_or(f64::INFINITY, |width_m| most_m(&across, width_m)));
        let step = STEPS_PER_M.into_iter().find(|steps| 1.0 / steps <= most_m * (1.0 + 1e-9));
        step.map(|steps_per_m| Self { steps_per_m, extent })
    }

    /// Nearest place on the ruler; the edge stays the edge.
    pub fn nearest(&self, position: Position) -> Position {
        let nearest =
            |at_m: f64, side_m: f64| ((at_m * self.steps_per_m).round() / self.steps_per_m).min(side_m);
        let width_m = self.extent.width_m().unwrap_or(0.0);
        Position { x_m: nearest(position.x_m, self.extent.length_m()), y_m: nearest(position.y_m, width_m) }
    }
}

fn least_gap_m(coordinates: &[f64]) -> f64 {
    let mut sorted = coordinates.to_vec();
    sorted.sort_by(f64::total_cmp);
    let gaps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    gaps.filter(|gap_m| *gap_m > ROUNDING_M).fold(f64::INFINITY, f64::min)
}

/// Rounding of positions in a file.
const ROUNDING_M: f64 = 1e-9;

fn is_of(row: &Row, press: &Press, ruler: Option<PlaceGrid>) -> bool {
    let is_deep = match (row.nuisances.first(), press.depth_m) {
        (Some(row_m), Some(press_m)) => (row_m - press_m).abs() < ROUNDING_M,
        _ => true,
    };
    let is_there = |at: Position| at.distance_m(press.position) < ROUNDING_M;
    is_deep && (is_there(row.position) || ruler.is_some_and(|ruler| is_there(ruler.nearest(row.position))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig() -> Rig {
        Rig::from_toml(include_str!("../../../../examples/fsi-like.toml")).unwrap()
    }

    fn press_row(press: &Press) -> Row {
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
        let presses = plan(&rig(), Weights::default(), &[1e-3, 2e-3], &[]).unwrap();
        assert_eq!(presses.len(), 9 * 2 * 3);
        let depths: Vec<Option<f64>> = presses[..6].iter().map(|press| press.depth_m).collect();
        assert_eq!(depths, [[Some(1e-3); 3], [Some(2e-3); 3]].concat());
        assert!(presses[..6].iter().all(|press| press.position == presses[0].position));
        assert!(presses.iter().all(|press| press.force_n.is_none()), "forces of several depths differ");
    }

    #[test]
    fn by_hand_or_to_one_depth_the_force_is_that_of_the_rig() {
        for depths_m in [&[][..], &[2e-3]] {
            let presses = plan(&rig(), Weights::default(), depths_m, &[]).unwrap();
            assert!(presses.iter().all(|press| press.force_n == Some(1.0)));
            assert_eq!(presses[0].depth_m, depths_m.first().copied());
        }
        assert_eq!(
            plan(&rig(), Weights { force_n: Some(2.0), second_n: None }, &[], &[]).unwrap()[0].force_n,
            Some(2.0)
        );
    }

    #[test]
    fn presses_of_before_are_not_asked_for_again() {
        let all = plan(&rig(), Weights::default(), &[1e-3, 2e-3], &[]).unwrap();
        let mut before: Vec<Row> = all[..7].iter().map(press_row).collect();
        // Rounded position, and untouched rows.
        before[2].position.x_m += 1e-13;
        before.push(Row { force_n: Some(0.0), position: Position::default(), ..before[0].clone() });
        assert_eq!(plan(&rig(), Weights::default(), &[1e-3, 2e-3], &before).unwrap(), all[7..]);
    }

    #[test]
    fn omitted_presses_are_requested_again_at_any_place() {
        let all = plan(&rig(), Weights::default(), &[1e-3, 2e-3], &[]).unwrap();
        // Missing: the second press of the first depth, the last of the second depth, and the third place.
        let left_out = |i: usize| [1, 5].contains(&i) || (12..18).contains(&i);
        let before: Vec<Row> =
            all[..24].iter().enumerate().filter(|(i, _)| !left_out(*i)).map(|(_, p)| press_row(p)).collect();
        let expected = [&all[1..2], &all[5..6], &all[12..18], &all[24..]].concat();
        assert_eq!(plan(&rig(), Weights::default(), &[1e-3, 2e-3], &before).unwrap(), expected);
        // Extra presses do not count for another place.
        let often: Vec<Row> = std::iter::repeat_n(press_row(&all[0]), 9).collect();
        assert_eq!(plan(&rig(), Weights::default(), &[1e-3, 2e-3], &often).unwrap(), all[3..]);
    }

    #[test]
    fn omitted_presses_by_hand_are_requested_again() {
        let all = plan(&rig(), Weights::default(), &[], &[]).unwrap();
        let before = [press_row(&all[0]), press_row(&all[4])];
        let expected = [&all[..2], &all[3..5], &all[6..]].concat();
        assert_eq!(plan(&rig(), Weights::default(), &[], &before).unwrap(), expected);
    }

    fn beam(length: &str, training: &str) -> Rig {
        let text = include_str!("../../../../examples/fsi-like.toml");
        let text = text.replace("\"100 mm\"", &format!("\"{length}\""));
        Rig::from_toml(&text.replace("arrangement = \"even\"\ncount = 9\nrepeats = 3", training)).unwrap()
    }

    fn places_mm(rig: &Rig) -> Vec<f64> {
        let presses = plan(rig, Weights::default(), &[], &[]).unwrap();
        presses.iter().map(|press| press.position.x_m * 1e3).collect()
    }

    #[test]
    fn asks_a_person_for_whole_millimetres() {
        for (length, count) in [("300 mm", 11), ("100 mm", 11), ("400 mm", 12), ("3 m", 7), ("70.3 mm", 7)] {
            let rig = beam(length, &format!("count = {count}"));
            let places = places_mm(&rig);
            assert!(places.iter().all(|mm| (mm - mm.round()).abs() < 1e-9), "{length}: {places:?}");
            let exact = rig.training().unwrap().positions(rig.setup.surface().extent()).unwrap();
            let spacing_mm = 1e3 * (exact[1].x_m - exact[0].x_m);
            let moved = places.iter().zip(&exact).map(|(mm, at)| (mm - 1e3 * at.x_m).abs() / spacing_mm);
            assert!(moved.fold(0.0, f64::max) <= 0.1, "{length}: {places:?}");
        }
    }

    #[test]
    fn rounds_narrow_places_to_parts_of_a_millimetre_and_keeps_them_apart() {
        for (length, training, steps) in [
            ("30 mm", "count = 11", 10.0),
            ("2 mm", "count = 6", 100.0),
            ("100 mm", "arrangement = \"chebyshev\"\ncount = 12", 10.0),
        ] {
            let places = places_mm(&beam(length, training));
            let on_steps = places.iter().all(|mm| (mm * steps - (mm * steps).round()).abs() < 1e-6);
            assert!(on_steps && places.windows(2).all(|pair| pair[1] > pair[0]), "{length}: {places:?}");
            assert!(places[0] > 0.0, "{length}: {places:?}");
        }
    }

    #[test]
    fn listed_places_and_those_of_a_machine_stay_as_they_are() {
        let listed = beam("100 mm", "positions = [\"13.6364 mm\", \"50.25 mm\"]");
        let places = places_mm(&listed);
        assert!((places[0] - 13.6364).abs() < 1e-9 && (places[1] - 50.25).abs() < 1e-9, "{places:?}");
        let by_machine = plan(&beam("100 mm", "count = 11"), Weights::default(), &[1e-3], &[]).unwrap();
        assert!((by_machine[1].position.x_m - 13.636_363e-3).abs() < 1e-6);
    }

    #[test]
    fn presses_of_before_the_rounding_count() {
        let rig = beam("100 mm", "count = 11");
        let exact = rig.training().unwrap().positions(rig.setup.surface().extent()).unwrap();
        let before: Vec<Row> = exact
            .iter()
            .map(|at| press_row(&Press { position: *at, force_n: None, depth_m: None }))
            .collect();
        assert_eq!(plan(&rig, Weights::default(), &[], &before).unwrap(), []);
    }

    #[test]
    fn a_second_weight_presses_every_other_place_after_the_first() {
        let weights = Weights { force_n: None, second_n: Some(2.5) };
        let presses = plan(&rig(), weights, &[], &[]).unwrap();
        assert_eq!(presses.len(), 9 * 3 + 5 * 3);
        assert!(presses[..27].iter().all(|press| press.force_n == Some(1.0)));
        assert!(presses[27..].iter().all(|press| press.force_n == Some(2.5)));
        assert_eq!(presses[30].position, presses[6].position);
        // Rows with one weight do not count for the other.
        let before: Vec<Row> =
            presses[..28].iter().map(|press| Row { force_n: press.force_n, ..press_row(press) }).collect();
        assert_eq!(plan(&rig(), weights, &[], &before).unwrap(), presses[28..]);
        let twice = Weights { force_n: None, second_n: Some(1.0) };
        assert_eq!(plan(&rig(), twice, &[], &[]).unwrap().len(), 27);
    }
}
