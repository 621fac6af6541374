//! Errors over a plane, gathered by cells.

use super::{HeatMap, HeatPanel};
use palpate_estimators::arrangement::cells;
use palpate_estimators::evaluation::{Evaluation, Located, percentile};
use palpate_estimators::setup::Bench;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;

/// Cells a side beyond which a map is no clearer.
const MOST_SIDE: usize = 60;
/// With this many cells a position or more, most cells would be empty.
const SPARSE: usize = 4;
/// Equal cells over a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ErrorGrid {
    length_m: f64,
    width_m: f64,
    columns: usize,
    rows: usize,
}

impl ErrorGrid {
    /// Of the positions of some evaluations: a cell a position where they lie on a grid, else cells of a few positions.
    pub fn of<'a>(evaluations: impl Iterator<Item = &'a Evaluation>, length_m: f64, width_m: f64) -> Self {
        let mut places: Vec<[f64; 2]> = evaluations
            .flat_map(|evaluation| &evaluation.located)
            .map(|located| [located.truth.x_m, located.truth.y_m])
            .collect();
        places.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        places.dedup();
        let distinct = |k: usize, size_m: f64| {
            let mut values: Vec<f64> = places.iter().map(|place| place[k]).collect();
            values.sort_by(f64::total_cmp);
            values.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * size_m);
            values.len().max(1)
        };
        let (columns, rows) = (distinct(0, length_m), distinct(1, width_m));
        let is_grid = columns.saturating_mul(rows) < SPARSE * places.len();
        if is_grid && columns <= MOST_SIDE && rows <= MOST_SIDE {
            return Self { length_m, width_m, columns, rows };
        }
        let half = 0.5 * places.len() as f64;
        let side = |ratio: f64| ((half * ratio).sqrt().round() as usize).clamp(2, MOST_SIDE);
        Self { length_m, width_m, columns: side(length_m / width_m), rows: side(width_m / length_m) }
    }

    /// Length and width of a cell, in metres.
    pub fn cell_m(&self) -> [f64; 2] {
        [self.length_m / self.columns as f64, self.width_m / self.rows as f64]
    }

    /// A map of errors, and of the limit where there is one; its scale is that of the errors.
    pub fn map(&self, bench: &Bench, title: &str, mut panels: Vec<HeatPanel>) -> HeatMap {
        let errors = panels.iter().flat_map(|panel| panel.values.iter().copied());
        let most = errors.filter(|error| error.is_finite()).fold(0.0, f64::max);
        panels.extend(limit_panel(bench, self));
        HeatMap {
            title: title.to_owned(),
            length_mm: self.length_m * 1e3,
            width_mm: self.width_m * 1e3,
            columns: self.columns,
            rows: self.rows,
            panels,
            sensors_mm: sensors_mm(bench),
            label: "error, mm".to_owned(),
            most,
            width_px: 860,
        }
    }

    /// The median error in mm of the contacts of each cell; NaN where there is none.
    pub fn medians_mm(&self, located: &[Located]) -> Vec<f64> {
        let mut errors: Vec<Vec<f64>> = vec![Vec::new(); self.columns * self.rows];
        let cell = |at_m: f64, size_m: f64, count: usize| {
            ((at_m / size_m * count as f64).max(0.0) as usize).min(count - 1)
        };
        for located in located {
            let Position { x_m, y_m } = located.truth;
            let (column, row) = (cell(x_m, self.length_m, self.columns), cell(y_m, self.width_m, self.rows));
            errors[row * self.columns + column].push(located.error_m() * 1e3);
        }
        let median = |mut errors: Vec<f64>| {
            errors.sort_by(f64::total_cmp);
            percentile(&errors, 50.0).unwrap_or(f64::NAN)
        };
        errors.into_iter().map(median).collect()
    }

    /// The middles of the cells.
    fn middles(&self, bench: &Bench) -> Vec<Position> {
        cells(bench.surface.extent(), self.columns, self.rows)
    }
}

/// Where the sensors are, in mm; raw channels are nowhere.
pub(super) fn sensors_mm(bench: &Bench) -> Vec<(f64, f64)> {
    let placed = bench
        .layout
        .sensors
        .iter()
        .filter(|sensor| sensor.kind != palpate_mechanics::sensing::SensorKind::Raw);
    placed.map(|sensor| (sensor.position.x_m * 1e3, sensor.position.y_m * 1e3)).collect()
}

/// What to say of the limit's panel in a caption.
pub(super) const LIMIT_IN_WORDS: &str = " The limit is the mean error of the best unbiased estimator for noisy readings and a known \
    force (Cramér–Rao bound); the median of its errors is 0.85 to 0.94 times their mean, the less the longer their ellipse is.";

/// The mean error that physics allows for a known force; `None` where the bench has no limit.
fn limit_panel(bench: &Bench, grid: &ErrorGrid) -> Option<HeatPanel> {
    let limit = bench.cramer_rao_bound().ok()?;
    let force_n = bench.force_n?;
    let value = |position: Position| {
        let bound = limit.at(Contact { position, force_n }, Force::Known);
        bound.map_or(f64::NAN, |bound| bound.mean_error_m() * 1e3)
    };
    let values = grid.middles(bench).into_iter().map(value).collect();
    Some(HeatPanel { name: "the limit".to_owned(), values })
}
