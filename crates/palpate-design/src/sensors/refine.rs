//! Sensor positions between the candidate sites.

use super::SensorProblem;
use super::candidates::{PlacedSensor, exclusion, is_sensitive, mirrored};
use super::design::Symmetry;
use super::objective::{Block, ForceBelief, State};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};

/// Halvings of the step from the site spacing: on a line, on a plane (with a solution per step).
const HALVINGS: usize = 9;
const HALVINGS_ON_A_PLANE: usize = 3;
const MOST_ROUNDS: usize = 20;

/// Compass search: moves each sensor a step if that improves the score, and halves the step if none moves
/// (Kolda, Lewis and Torczon, *SIAM Review* 45, 2003).
///
/// Sensors of one kind keep the spacing of the sites.
pub(super) fn refine(
    problem: &SensorProblem,
    selection: &[usize],
    watch: Watch,
) -> Result<Vec<PlacedSensor>, Cancelled> {
    let pool = &problem.pool;
    let members = |unit: &usize| -> Vec<PlacedSensor> {
        pool.units[*unit].members().map(|candidate| pool.sensors[candidate]).collect()
    };
    let Some(mut step_m) = pool.design.sites.distance_m(pool.extent.length_m()) else {
        return Ok(selection.iter().flat_map(members).collect());
    };
    let mut groups: Vec<Group> = selection.iter().map(|unit| Group::new(problem, members(unit))).collect();
    let halvings = match pool.extent {
        Extent::Line { .. } => HALVINGS,
        Extent::Plane { .. } => HALVINGS_ON_A_PLANE,
    };
    for halving in 0..halvings {
        for _ in 0..MOST_ROUNDS {
            watch.stage("refining", halving as f64 / halvings as f64)?;
            let mut moved = false;
            for group in pool.fixed.len()..groups.len() {
                moved |= improve(problem, &mut groups, group, step_m);
            }
            if !moved {
                break;
            }
        }
        step_m *= 0.5;
    }
    Ok(groups.into_iter().flat_map(|group| group.sensors).collect())
}

/// Mirrored sensors with their rows; on a plate a row needs a solution.
struct Group {
    sensors: Vec<PlacedSensor>,
    rows: Vec<Vec<Block>>,
}

impl Group {
    fn new(problem: &SensorProblem, sensors: Vec<PlacedSensor>) -> Self {
        Self { rows: problem.rows(&sensors), sensors }
    }

    fn score(&self, problem: &SensorProblem, others: &State) -> f64 {
        match self.rows.as_slice() {
            [one] => problem.objective.score_with(others, one),
            [one, twin] => problem.objective.score_with(&problem.objective.updated(others, one), twin),
            _ => f64::INFINITY,
        }
    }
}

fn improve(problem: &SensorProblem, groups: &mut [Group], index: usize, step_m: f64) -> bool {
    let pool = &problem.pool;
    if pool.design.offers[groups[index].sensors[0].offer].kind == SensorKind::Reaction {
        return false;
    }
    let left = || groups.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, group)| group);
    let others: Vec<PlacedSensor> = left().flat_map(|group| group.sensors.iter().copied()).collect();
    let rows: Vec<&[Block]> = left().flat_map(|group| group.rows.iter().map(Vec::as_slice)).collect();
    let state = problem.objective.state(&rows, ForceBelief::Vague);
    let mut least = groups[index].score(problem, &state);
    let mut moved = false;
    let directions = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
    for [x, y] in directions.into_iter().take(2 * pool.extent.dimensions()) {
        let sensors = shifted(problem, &groups[index].sensors, [x * step_m, y * step_m]);
        if !is_allowed(problem, &sensors, &others) {
            continue;
        }
        let group = Group::new(problem, sensors);
        let score = group.score(problem, &state);
        if score < least {
            (least, moved) = (score, true);
            groups[index] = group;
        }
    }
    moved
}

/// Moves a group. A single sensor in the middle of a symmetric layout keeps its x.
fn shifted(problem: &SensorProblem, group: &[PlacedSensor], [x_m, y_m]: [f64; 2]) -> Vec<PlacedSensor> {
    let extent = problem.pool.extent;
    let is_mirrored = problem.pool.design.symmetry == Symmetry::Wanted;
    let x_m = if is_mirrored && group.len() == 1 { 0.0 } else { x_m };
    let Position { x_m: at_m, y_m: beside_m } = group[0].position;
    let position = Position {
        x_m: (at_m + x_m).clamp(0.0, extent.length_m()),
        y_m: (beside_m + y_m).clamp(0.0, extent.width_m().unwrap_or(0.0)),
    };
    let twin = |sensor: &PlacedSensor| PlacedSensor { position: mirrored(position, extent), ..*sensor };
    std::iter::once(PlacedSensor { position, ..group[0] }).chain(group[1..].iter().map(twin)).collect()
}

fn is_allowed(problem: &SensorProblem, group: &[PlacedSensor], others: &[PlacedSensor]) -> bool {
    let pool = &problem.pool;
    // Sites keep sensors of one kind apart; this distance replaces them, so that sensors do not meet in one place.
    let apart_m = pool.design.sites.distance_m(pool.extent.length_m()).unwrap_or(0.0);
    let slack_m = 1e-9 * pool.extent.length_m();
    let together = |a: &PlacedSensor, b: &PlacedSensor| {
        let crowded = a.offer == b.offer && a.position.distance_m(b.position) < apart_m - slack_m;
        !crowded && exclusion(a, b, &pool.design, pool.extent).is_none()
    };
    let kind = |sensor: &PlacedSensor| pool.design.offers[sensor.offer].kind;
    group.iter().enumerate().all(|(i, sensor)| {
        !pool.design.keeps_out(sensor.position, pool.extent)
            && is_sensitive(problem.sensitivity.surface, kind(sensor), sensor.position)
            && others.iter().chain(&group[..i]).all(|other| together(sensor, other))
    })
}
