//! Grids and zones of a surface.

use serde::Serialize;

use super::LimitError;
use crate::contact::Position;
use crate::surface::Extent;
use crate::units::format_length_mm;

const HALVINGS: u32 = 12;

/// Smallest share that is not reported.
const FILLED: f64 = 0.9;

/// An interval of a line, or a rectangle of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Zone {
    /// Left or lower left end.
    pub from: Position,
    /// Right or upper right end.
    pub to: Position,
    /// Share with the condition; 1 on a line.
    pub filled: f64,
}

impl Zone {
    pub(super) fn bounding(positions: impl IntoIterator<Item = Position>) -> Option<Self> {
        positions.into_iter().fold(None, |zone: Option<Self>, position| {
            let Self { from, to, .. } = zone.unwrap_or(Self::point(position));
            Some(Self {
                from: Position { x_m: from.x_m.min(position.x_m), y_m: from.y_m.min(position.y_m) },
                to: Position { x_m: to.x_m.max(position.x_m), y_m: to.y_m.max(position.y_m) },
                filled: 1.0,
            })
        })
    }

    pub(super) const fn point(position: Position) -> Self {
        Self { from: position, to: position, filled: 1.0 }
    }

    /// True for a position in the zone.
    pub fn contains(&self, position: Position) -> bool {
        let Self { from, to, .. } = self;
        (from.x_m..=to.x_m).contains(&position.x_m) && (from.y_m..=to.y_m).contains(&position.y_m)
    }
}

impl std::fmt::Display for Zone {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { from, to, filled } = self;
        if *filled < FILLED {
            write!(f, "{:.0} % of ", 100.0 * filled)?;
        }
        let range = |from_m: f64, to_m: f64| {
            let [from, to] = [from_m, to_m].map(|value_m| format_length_mm(tenths_mm(value_m)));
            if from == to { to } else { format!("{}–{to}", from.trim_end_matches(" mm")) }
        };
        if from.y_m == 0.0 && to.y_m == 0.0 {
            f.write_str(&range(from.x_m, to.x_m))
        } else {
            let along = range(from.x_m, to.x_m);
            write!(f, "{} × {}", along.trim_end_matches(" mm"), range(from.y_m, to.y_m))
        }
    }
}

fn tenths_mm(value_m: f64) -> f64 {
    (value_m * 1e4).round() / 1e4
}

/// Zones where `holds` is true, with their grid positions: intervals of a line with bisected ends, or
/// connected sets of neighbours, extended by half a pitch.
pub(super) fn zones(
    extent: Extent,
    grid: &Grid,
    holds: impl Fn(Position) -> bool,
) -> Vec<(Zone, Vec<Position>)> {
    let flags: Vec<bool> = grid.positions.iter().map(|&position| holds(position)).collect();
    if let Some(width_m) = extent.width_m() {
        return patches(extent.length_m(), width_m, grid, flags);
    }
    let mut found = Vec::new();
    let mut start = 0;
    for run in flags.chunk_by(|a, b| a == b) {
        let end = start + run.len();
        if run[0] {
            let inside = &grid.positions[start..end];
            let before = start.checked_sub(1).map(|i| grid.positions[i].x_m);
            let after = grid.positions.get(end).map(|position| position.x_m);
            let from_m = before.map_or(0.0, |out_m| edge(inside[0].x_m, out_m, &holds));
            let to_m =
                after.map_or(extent.length_m(), |out_m| edge(inside[run.len() - 1].x_m, out_m, &holds));
            let zone = Zone { from: Position::along(from_m), to: Position::along(to_m), filled: 1.0 };
            found.push((zone, inside.to_vec()));
        }
        start = end;
    }
    found
}

fn patches(length_m: f64, width_m: f64, grid: &Grid, mut flags: Vec<bool>) -> Vec<(Zone, Vec<Position>)> {
    let rows = grid.positions.len() / grid.columns;
    let (along_m, across_m) = (length_m / (grid.columns + 1) as f64, width_m / (rows + 1) as f64);
    let mut found = Vec::new();
    while let Some(first) = flags.iter().position(|flag| *flag) {
        flags[first] = false;
        let (mut patch, mut next) = (vec![first], 0);
        while let Some(&here) = patch.get(next) {
            for near in grid.neighbours(here) {
                if std::mem::take(&mut flags[near]) {
                    patch.push(near);
                }
            }
            next += 1;
        }
        let inside: Vec<Position> = patch.iter().map(|i| grid.positions[*i]).collect();
        let Some(around) = Zone::bounding(inside.iter().copied()) else { continue };
        // From the outermost positions a zone extends to the edge.
        let lower = |at_m: f64, pitch_m: f64| if at_m < 1.5 * pitch_m { 0.0 } else { at_m - 0.5 * pitch_m };
        let upper = |at_m: f64, pitch_m: f64, size_m: f64| {
            if at_m > size_m - 1.5 * pitch_m { size_m } else { at_m + 0.5 * pitch_m }
        };
        let from = Position { x_m: lower(around.from.x_m, along_m), y_m: lower(around.from.y_m, across_m) };
        let to = Position {
            x_m: upper(around.to.x_m, along_m, length_m),
            y_m: upper(around.to.y_m, across_m, width_m),
        };
        let side = |from_m: f64, to_m: f64, pitch_m: f64| ((to_m - from_m) / pitch_m).round() + 1.0;
        let all =
            side(around.from.x_m, around.to.x_m, along_m) * side(around.from.y_m, around.to.y_m, across_m);
        found.push((Zone { from, to, filled: inside.len() as f64 / all }, inside));
    }
    found
}

fn edge(mut inside_m: f64, mut outside_m: f64, holds: &impl Fn(Position) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle_m = inside_m.midpoint(outside_m);
        if holds(Position::along(middle_m)) { inside_m = middle_m } else { outside_m = middle_m }
    }
    inside_m
}

/// One per millimetre of the paper's beam.
const ALONG_A_LINE: usize = 399;
const ON_A_PLANE: f64 = 600.0;
const MOST: usize = 100_000;

/// Evenly spaced positions in rows along x, without the edges.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    pub positions: Vec<Position>,
    pub columns: usize,
}

impl Grid {
    pub fn over_surface(extent: Extent) -> Self {
        let Some(width_m) = extent.width_m() else { return Self::even(extent, ALONG_A_LINE, 1) };
        let side = |ratio: f64| (ON_A_PLANE * ratio).sqrt().clamp(5.0, ON_A_PLANE / 5.0).round() as usize;
        Self::even(extent, side(extent.length_m() / width_m), side(width_m / extent.length_m()))
    }

    pub fn with_spacing(extent: Extent, every_m: f64) -> Result<Self, LimitError> {
        let inside = |size_m: f64| (size_m / every_m - 1e-6).floor();
        let (columns, rows) = (inside(extent.length_m()), extent.width_m().map_or(1.0, inside));
        let count = columns * rows;
        if !(columns >= 1.0 && rows >= 1.0 && count <= MOST as f64) {
            return Err(LimitError::Positions { count: count.max(0.0), most: MOST });
        }
        let y_m = |row: usize| extent.if_plane(row as f64 * every_m).unwrap_or(0.0);
        Ok(Self::new(columns as usize, rows as usize, |column| column as f64 * every_m, y_m))
    }

    fn even(extent: Extent, columns: usize, rows: usize) -> Self {
        let share = |i: usize, count: usize| i as f64 / (count + 1) as f64;
        let y_m = |row: usize| extent.width_m().map_or(0.0, |width_m| share(row, rows) * width_m);
        Self::new(columns, rows, |column| share(column, columns) * extent.length_m(), y_m)
    }

    fn new(columns: usize, rows: usize, x_m: impl Fn(usize) -> f64, y_m: impl Fn(usize) -> f64) -> Self {
        let x_m: Vec<f64> = (1..=columns).map(x_m).collect();
        let row = |y_m: f64| x_m.iter().map(move |&x_m| Position { x_m, y_m });
        Self { positions: (1..=rows).map(y_m).flat_map(row).collect(), columns }
    }

    /// Adds positions between the ends of a line's grid.
    pub fn including(mut self, others: &[Position]) -> Self {
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

    pub fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        let rows = self.positions.len() / self.columns;
        let (row, column) = (i / self.columns, i % self.columns);
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        around(row, rows)
            .flat_map(move |r| around(column, self.columns).map(move |c| r * self.columns + c))
            .filter(move |&j| j != i)
    }

    pub fn pitch_m(&self) -> f64 {
        match self.positions.as_slice() {
            [first, second, ..] if self.columns > 1 => second.x_m - first.x_m,
            [first, ..] => first.x_m,
            [] => 0.0,
        }
    }
}
