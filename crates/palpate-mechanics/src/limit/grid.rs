//! Positions that cover a surface, and which of them are neighbours.

use super::LimitError;
use crate::contact::Position;
use crate::surface::Extent;

/// Positions on a line: 1/400 of the length apart, as everywhere in palpate (every millimetre of the paper's beam).
const ALONG_A_LINE: usize = 399;
/// Positions on a plane, about; more of them along its longer side.
const ON_A_PLANE: f64 = 600.0;
/// The most positions that a spacing may make.
const MOST: usize = 100_000;

/// Positions in rows along x, evenly between the edges of the surface and not on them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    pub positions: Vec<Position>,
    /// Positions in a row.
    pub columns: usize,
}

impl Grid {
    /// Fine enough to see what a limit does.
    pub fn over(extent: Extent) -> Self {
        let Some(width_m) = extent.width_m() else { return Self::new(extent, ALONG_A_LINE, 1) };
        let side = |ratio: f64| (ON_A_PLANE * ratio).sqrt().clamp(5.0, ON_A_PLANE / 5.0).round() as usize;
        Self::new(extent, side(extent.length_m() / width_m), side(width_m / extent.length_m()))
    }

    /// `every_m` apart, from `every_m` to as far as the surface reaches.
    pub fn every(extent: Extent, every_m: f64) -> Result<Self, LimitError> {
        let inside = |size_m: f64| (size_m / every_m - 1e-6).floor();
        let (columns, rows) = (inside(extent.length_m()), extent.width_m().map_or(1.0, inside));
        let count = columns * rows;
        if !(columns >= 1.0 && rows >= 1.0 && count <= MOST as f64) {
            return Err(LimitError::Positions { count: count.max(0.0), most: MOST });
        }
        let y_m = |row: usize| extent.width_m().map_or(0.0, |_| row as f64 * every_m);
        let row =
            |row| (1..=columns as usize).map(move |i| Position { x_m: i as f64 * every_m, y_m: y_m(row) });
        Ok(Self { positions: (1..=rows as usize).flat_map(row).collect(), columns: columns as usize })
    }

    fn new(extent: Extent, columns: usize, rows: usize) -> Self {
        let share = |i: usize, count: usize| i as f64 / (count + 1) as f64;
        let y_m = |row: usize| extent.width_m().map_or(0.0, |width_m| share(row, rows) * width_m);
        let x_m = |column: usize| share(column, columns) * extent.length_m();
        let row = |row| (1..=columns).map(move |column| Position { x_m: x_m(column), y_m: y_m(row) });
        Self { positions: (1..=rows).flat_map(row).collect(), columns }
    }

    /// On a line, with these positions among the others where they lie between its ends; on a plane as it is.
    pub fn with(mut self, others: &[Position]) -> Self {
        let rows = self.positions.len() / self.columns.max(1);
        let slack_m = 1e-6 * self.pitch_m();
        let new = |other: &Position| self.positions.iter().all(|at| (at.x_m - other.x_m).abs() > slack_m);
        let (Some(first), Some(last), true) = (self.positions.first(), self.positions.last(), rows == 1)
        else {
            return self;
        };
        let inside = first.x_m..last.x_m;
        let added: Vec<Position> =
            others.iter().copied().filter(|other| inside.contains(&other.x_m) && new(other)).collect();
        self.positions.extend(added);
        self.positions.sort_by(|a, b| a.x_m.total_cmp(&b.x_m));
        self.columns = self.positions.len();
        self
    }

    /// The positions next to position `i`, diagonals included.
    pub fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        let rows = self.positions.len() / self.columns;
        let (row, column) = (i / self.columns, i % self.columns);
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        around(row, rows)
            .flat_map(move |r| around(column, self.columns).map(move |c| r * self.columns + c))
            .filter(move |&j| j != i)
    }

    /// Distance of neighbours along x.
    pub fn pitch_m(&self) -> f64 {
        match self.positions.as_slice() {
            [first, second, ..] if self.columns > 1 => second.x_m - first.x_m,
            [first, ..] => first.x_m,
            [] => 0.0,
        }
    }
}
