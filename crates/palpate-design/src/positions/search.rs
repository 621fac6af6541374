//! Pattern search of positions by simulated calibrations.

use super::design::PositionError;
use palpate_estimators::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::{Extent, Surface};

/// Least relative gain of a move.
const LEAST_GAIN: f64 = 1e-3;
/// Final step, as a share of the length.
const FINEST_STEP: f64 = 1e-3;
/// Least distance from the edges, as a share of the length.
const EDGE: f64 = 1e-3;

/// Score, smaller is better. The second argument is the completed share of the search.
pub(super) type Score<'a> = dyn Fn(&[Position], f64) -> Result<f64, PositionError> + Sync + 'a;

pub(super) fn evaluate(
    score: &Score,
    arrangements: &[Vec<Position>],
    share: f64,
) -> Result<Vec<f64>, PositionError> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut scores = Vec::with_capacity(arrangements.len());
    for batch in arrangements.chunks(threads) {
        let found: Vec<_> = std::thread::scope(|scope| {
            let started: Vec<_> =
                batch.iter().map(|positions| scope.spawn(move || score(positions, share))).collect();
            started.into_iter().map(|thread| thread.join()).collect()
        });
        for one in found {
            // A panic of a thread continues in this thread.
            scores.push(one.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?);
        }
    }
    Ok(scores)
}

/// Pattern search that moves one position or a mirrored pair (Hooke and Jeeves 1961).
pub(super) struct PatternSearch {
    pub extent: Extent,
    pub mirrored: bool,
    pub most_trials: usize,
}

impl PatternSearch {
    pub fn run(
        &self,
        score: &Score,
        start: Vec<Position>,
        start_score: f64,
    ) -> Result<Vec<Position>, PositionError> {
        let (mut best, mut best_score) = (start, start_score);
        let groups = self.groups(&best);
        let length_m = self.extent.length_m();
        let per_side = match self.extent {
            Extent::Line { .. } => best.len() as f64,
            Extent::Plane { .. } => (best.len() as f64).sqrt(),
        };
        let mut step_m = 0.25 * length_m / per_side;
        let mut trials = 0;
        while step_m >= FINEST_STEP * length_m {
            let mut improved = false;
            for group in &groups {
                let moved = self.moves(&best, group, step_m);
                if trials + moved.len() > self.most_trials {
                    return Ok(best);
                }
                trials += moved.len();
                let share = trials as f64 / self.most_trials as f64;
                let scores = evaluate(score, &moved, share)?;
                let least = (0..moved.len()).min_by(|a, b| scores[*a].total_cmp(&scores[*b]));
                if let Some(least) = least.filter(|least| scores[*least] < best_score * (1.0 - LEAST_GAIN)) {
                    best.clone_from(&moved[least]);
                    best_score = scores[least];
                    improved = true;
                }
            }
            if !improved {
                step_m *= 0.5;
            }
        }
        Ok(best)
    }

    /// Groups positions that move together: mirrored pairs if all are mirrored.
    fn groups(&self, positions: &[Position]) -> Vec<(usize, Option<usize>)> {
        let last = positions.len() - 1;
        let slack_m = 1e-9 * self.extent.length_m();
        let mirrors = |(i, at): (usize, &Position)| {
            (positions[last - i].x_m - (self.extent.length_m() - at.x_m)).abs() < slack_m
        };
        if self.mirrored && positions.iter().enumerate().all(mirrors) {
            // A position in the middle stays there.
            (0..positions.len() / 2).map(|i| (i, Some(last - i))).collect()
        } else {
            (0..positions.len()).map(|i| (i, None)).collect()
        }
    }

    /// Moves one group in each direction, not off the surface or past another position.
    fn moves(
        &self,
        positions: &[Position],
        group: &(usize, Option<usize>),
        step_m: f64,
    ) -> Vec<Vec<Position>> {
        let steps = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        let moved = steps.into_iter().take(2 * self.extent.dimensions()).map(|(x, y)| {
            let mut moved = positions.to_vec();
            moved[group.0].x_m += x * step_m;
            moved[group.0].y_m += y * step_m;
            if let Some(twin) = group.1 {
                moved[twin].x_m -= x * step_m;
            }
            moved
        });
        moved.filter(|moved| self.is_sound(moved)).collect()
    }

    fn is_sound(&self, positions: &[Position]) -> bool {
        let extent = self.extent;
        let within = |(at_m, side_m): (f64, f64)| (EDGE * side_m..=(1.0 - EDGE) * side_m).contains(&at_m);
        let inside = |at: &Position| extent.coordinates_m(*at).zip(extent.sides_m()).all(within);
        let in_order = |pair: &[Position]| pair[0].x_m + EDGE * extent.length_m() <= pair[1].x_m;
        let has_order = matches!(extent, Extent::Line { .. });
        positions.iter().all(inside) && (!has_order || positions.windows(2).all(in_order))
    }
}

/// Returns true if a mirrored contact gives the reverse readings, up to signs.
pub(super) fn is_mirror_symmetric(surface: &dyn Surface, layout: &Layout, force_n: f64) -> bool {
    const ASKED: usize = 7;
    let length_m = surface.extent().length_m();
    let sensors = CleanSensors::new(surface, layout);
    let reading = |x_m: f64| sensors.reading(Contact { position: Position::along(x_m), force_n });
    (1..=ASKED).all(|i| {
        let x_m = length_m * i as f64 / (2 * ASKED + 1) as f64;
        let (here, there) = (reading(x_m), reading(length_m - x_m));
        let scale = here.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        here.iter().zip(there.iter().rev()).all(|(a, b)| (a.abs() - b.abs()).abs() <= 1e-9 * scale)
    }) && layout
        .sensors()
        .iter()
        .zip(layout.sensors().iter().rev())
        .all(|(a, b)| a.channel == b.channel && a.kind == b.kind)
}
