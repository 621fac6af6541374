use super::plan::{PlaceGrid, Weights};
use super::press::Press;
use palpate_estimators::estimator::Locator;
use palpate_estimators::evaluation::{CoveredCoordinates, EvaluatedContact, Evaluation};
use palpate_estimators::fit::ReadingError;
use palpate_estimators::recording::{Recording, Row};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_rig::Rig;
use std::path::{Path, PathBuf};

/// Fresh places of a check.
pub const CHECK_PLACES: usize = 5;

/// Presses between the calibrated places, with the weights or `depths_m` in turn; empty for one place.
pub fn check_presses(rig: &Rig, rows: &[Row], weights: Weights, depths_m: &[f64]) -> Vec<Press> {
    let extent = rig.setup.surface().extent();
    let calibrated: Vec<Position> = rows.iter().filter(|row| row.touches()).map(|row| row.position).collect();
    let first_n = weights.first_n(rig);
    // Presses to different depths have different forces.
    let by_depth = depths_m.iter().map(|depth_m| (first_n.filter(|_| depths_m.len() == 1), Some(*depth_m)));
    let by_weight = [first_n, weights.second_n.or(first_n)].map(|force_n| (force_n, None));
    let strengths: Vec<_> = if depths_m.is_empty() { by_weight.to_vec() } else { by_depth.collect() };
    let places = fresh_places(&calibrated, extent).into_iter().zip(strengths.into_iter().cycle());
    places.map(|(position, (force_n, depth_m))| Press { position, force_n, depth_m }).collect()
}

/// Place far from calibrated ones in each of [`CHECK_PLACES`] segments of the longer side.
fn fresh_places(calibrated: &[Position], extent: Extent) -> Vec<Position> {
    const CANDIDATES: usize = 40;
    /// Share of the largest distance that counts as far.
    const FAR: f64 = 0.9;
    let Some((low, high)) = bounds(calibrated) else { return Vec::new() };
    let ruler = PlaceGrid::from_positions(calibrated, extent);
    let is_along_x = high.x_m - low.x_m >= high.y_m - low.y_m;
    let place = |along: f64, across: f64| {
        let (x, y) = if is_along_x { (along, across) } else { (across, along) };
        let at =
            Position { x_m: low.x_m + x * (high.x_m - low.x_m), y_m: low.y_m + y * (high.y_m - low.y_m) };
        ruler.map_or(at, |ruler| ruler.nearest(at))
    };
    let cell = |i: usize| (i as f64 + 0.5) / CANDIDATES as f64;
    let mut chosen: Vec<Position> = Vec::new();
    for stretch in 0..CHECK_PLACES {
        let share = |within: f64| (stretch as f64 + within) / CHECK_PLACES as f64;
        let candidates: Vec<Position> = (0..CANDIDATES)
            .flat_map(|i| (0..CANDIDATES).map(move |j| (i, j)))
            .map(|(i, j)| place(share(cell(i)), cell(j)))
            .collect();
        let far_m = |at: &Position| nearest_m(*at, calibrated);
        let farthest_m = candidates.iter().map(far_m).fold(0.0, f64::max);
        let middle = place(share(0.5), 0.5);
        let apart_m =
            |at: &Position| if chosen.is_empty() { -at.distance_m(middle) } else { nearest_m(*at, &chosen) };
        let far = candidates.iter().filter(|at| farthest_m > 0.0 && far_m(at) >= FAR * farthest_m);
        if let Some(best) = far.max_by(|a, b| apart_m(a).total_cmp(&apart_m(b))) {
            chosen.push(*best);
        }
    }
    chosen
}

fn bounds(places: &[Position]) -> Option<(Position, Position)> {
    let extreme = |pick: fn(f64, f64) -> f64, start: f64| Position {
        x_m: places.iter().map(|at| at.x_m).fold(start, pick),
        y_m: places.iter().map(|at| at.y_m).fold(start, pick),
    };
    let (low, high) = (extreme(f64::min, f64::INFINITY), extreme(f64::max, f64::NEG_INFINITY));
    (high.x_m > low.x_m || high.y_m > low.y_m).then_some((low, high))
}

fn nearest_m(at: Position, places: &[Position]) -> f64 {
    places.iter().map(|place| at.distance_m(*place)).fold(f64::INFINITY, f64::min)
}

/// `presses-check.csv` beside the file of presses, or the first free number.
pub fn check_path(presses: &Path) -> PathBuf {
    let stem = presses.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let suffix =
        presses.extension().map_or_else(String::new, |suffix| format!(".{}", suffix.to_string_lossy()));
    let named = |number: usize| {
        let number = if number == 1 { String::new() } else { format!("-{number}") };
        presses.with_file_name(format!("{stem}-check{number}{suffix}"))
    };
    let mut number = 1;
    while named(number).exists() {
        number += 1;
    }
    named(number)
}

/// Checked place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckedPlace {
    /// Requested place.
    pub position: Position,
    /// Estimate.
    pub estimate: Position,
    /// Distance between both, in metres.
    pub error_m: f64,
    /// True if the 95 % intervals of all coordinates contain the place; `None` without intervals.
    pub covered: Option<bool>,
}

/// Outcome of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// Places in press order.
    pub places: Vec<CheckedPlace>,
    /// Median error, in metres.
    pub median_m: f64,
    /// Mean error, in metres.
    pub mean_m: f64,
    /// Places within the 95 % intervals of all coordinates; `None` without intervals.
    pub covered: Option<usize>,
}

impl Check {
    /// Locates the presses, tared with the untouched rows; `None` without a press.
    ///
    /// # Errors
    /// [`ReadingError`] for other channels.
    pub fn new(locator: &Locator, recording: &Recording) -> Result<Option<Self>, ReadingError> {
        let evaluation = Evaluation::new(locator, &tared(locator, recording))?;
        let Some(summary) = evaluation.summary(None) else { return Ok(None) };
        let checked = |located: &EvaluatedContact| CheckedPlace {
            position: located.truth,
            estimate: located.estimate,
            error_m: located.error_m(),
            covered: located.covered.map(CoveredCoordinates::all),
        };
        let places: Vec<CheckedPlace> = evaluation.located.iter().map(checked).collect();
        let covered = places.iter().map(|place| place.covered).collect::<Option<Vec<bool>>>();
        Ok(Some(Self {
            places,
            median_m: summary.median_m,
            mean_m: summary.average_m,
            covered: covered.map(|covered| covered.into_iter().filter(|covered| *covered).count()),
        }))
    }
}

fn tared(locator: &Locator, recording: &Recording) -> Recording {
    let mut tared = recording.clone();
    let Some(learnt) = &locator.untouched else { return tared };
    let rows = &recording.rows;
    for (at, row) in tared.rows.iter_mut().enumerate() {
        let untouched = |row: &&Row| !row.touches();
        let around: Vec<&Row> = rows[..at]
            .iter()
            .rev()
            .find(untouched)
            .into_iter()
            .chain(rows[at..].iter().find(untouched))
            .collect();
        for (channel, value) in row.reading.iter_mut().enumerate() {
            let offset = around.iter().map(|row| row.reading[channel]).sum::<f64>() / around.len() as f64;
            if let Some(learnt) = learnt.get(channel).filter(|_| !around.is_empty()) {
                *value += learnt - offset;
            }
        }
    }
    tared
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_estimators::fit::{Fit, FitTask};

    fn rig() -> Rig {
        Rig::from_toml(include_str!("../../../../examples/noisy-beam.toml")).unwrap()
    }

    #[test]
    fn fresh_places_lie_between_the_calibrated_ones_all_over_the_surface() {
        let extent = Extent::line(0.3).unwrap();
        let calibrated: Vec<Position> =
            (0..11).map(|i| Position::along(0.014 + 0.027 * f64::from(i))).collect();
        let fresh = fresh_places(&calibrated, extent);
        assert_eq!(fresh.len(), CHECK_PLACES);
        for (i, at) in fresh.iter().enumerate() {
            assert!(nearest_m(*at, &calibrated) > 0.4 * 0.027, "{fresh:?}");
            let (others, mm) = ([&fresh[..i], &fresh[i + 1..]].concat(), at.x_m * 1e3);
            assert!(nearest_m(*at, &others) > 0.02 && (mm - mm.round()).abs() < 1e-9, "{fresh:?}");
        }
        assert!(fresh[0].x_m < 0.1 && fresh[4].x_m > 0.2, "{fresh:?}");
    }

    #[test]
    fn fresh_places_of_a_plane_lie_in_the_middle_of_its_grid() {
        let extent = Extent::plane(0.2, 0.1).unwrap();
        let grid = palpate_estimators::arrangement::cells(extent, 6, 3);
        let fresh = fresh_places(&grid, extent);
        assert_eq!(fresh.len(), CHECK_PLACES);
        let half_diagonal_m = 0.5 * (0.2_f64 / 6.0).hypot(0.1 / 3.0);
        assert!(fresh.iter().all(|at| nearest_m(*at, &grid) > 0.8 * half_diagonal_m), "{fresh:?}");
        assert_eq!(fresh_places(&grid[..1], extent), []);
        assert_eq!(fresh_places(&[], extent), []);
    }

    #[test]
    fn files_of_checks_stand_beside_the_presses_and_none_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let presses = folder.path().join("presses.csv");
        let name = || check_path(&presses).file_name().unwrap().to_string_lossy().into_owned();
        assert_eq!(name(), "presses-check.csv");
        std::fs::write(folder.path().join(name()), "").unwrap();
        assert_eq!(name(), "presses-check-2.csv");
    }

    #[test]
    fn a_check_measures_error_and_coverage() {
        let rig = rig();
        let task = rig.simulate(0).unwrap();
        let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &task)).unwrap();
        let presses = check_presses(&rig, &task.rows, Weights::default(), &[]);
        let positions: Vec<Position> = presses.iter().map(|press| press.position).collect();
        let mut recording = palpate_estimators::simulate::simulate_at(&rig.setup, &positions, 1, 5).unwrap();
        let check = Check::new(&locator, &recording).unwrap().unwrap();
        assert_eq!(check.places.len(), CHECK_PLACES);
        assert!(check.median_m < 1e-3 && check.covered >= Some(4), "{check:?}");
        recording.rows[2].position.x_m += 0.02;
        let missed = Check::new(&locator, &recording).unwrap().unwrap();
        assert!(missed.places[2].error_m > 0.019 && missed.places[2].covered == Some(false), "{missed:?}");
        recording.rows.clear();
        assert_eq!(Check::new(&locator, &recording).unwrap(), None);
    }
}
