//! Patches of a load.

use super::bounds::Bounds;
use super::cells::Cells;
use super::even_loads::{EvenLoads, LoadQuantity};
use crate::status::OUTSIDE_MODEL_RATE;
use ndarray::Array2;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, UniformLoad};
use palpate_numerics::{extend_to, hull, normal_interval_95, normal_quantile};
use serde::Serialize;

/// Density threshold over the highest density.
pub const PATCH_SHARE: f64 = 0.1;
/// Greatest gap within one patch.
const REACH_CELLS: usize = 2;

/// Centre of pressure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CentreOfPressure {
    /// Position.
    pub position: Position,
    /// Standard deviation along x.
    pub sd_x_m: f64,
    /// Standard deviation along y.
    pub sd_y_m: f64,
    /// 95 % interval along x.
    pub x_95_m: (f64, f64),
    /// 95 % interval along y.
    pub y_95_m: (f64, f64),
}

/// Connected loaded part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Patch {
    /// Left end or lower left corner, at the threshold.
    pub from: Position,
    /// Right end or upper right corner.
    pub to: Position,
    /// Centre of pressure.
    pub centre: CentreOfPressure,
    /// Force in newtons, with flanks.
    pub force_n: f64,
    /// Force standard deviation.
    pub force_sd_n: f64,
    /// 95 % interval of the force, possibly infinite.
    pub force_95_n: (f64, f64),
}

impl CentreOfPressure {
    fn new(position: Position, (sd_x_m, sd_y_m): (f64, f64)) -> Self {
        let (x_95_m, y_95_m) =
            (normal_interval_95(position.x_m, sd_x_m), normal_interval_95(position.y_m, sd_y_m));
        Self { position, sd_x_m, sd_y_m, x_95_m, y_95_m }
    }

    /// Adopts intervals; true if they contain the position.
    pub(super) fn adopt_position_intervals(
        &mut self,
        even: &EvenLoads,
        extent: Extent,
        aim: impl Fn(usize) -> LoadQuantity,
    ) -> bool {
        self.x_95_m = even.interval_95(aim(0));
        if extent.dimensions() > 1 {
            self.y_95_m = even.interval_95(aim(1));
        }
        self.contains(self.position)
    }

    pub(super) fn contains(&self, position: Position) -> bool {
        contains(self.x_95_m, position.x_m) && contains(self.y_95_m, position.y_m)
    }

    pub(super) fn widen(
        &mut self,
        even: &EvenLoads,
        extent: Extent,
        aims: impl Iterator<Item = impl Fn(usize) -> LoadQuantity>,
    ) {
        for aim in aims {
            self.x_95_m = hull(self.x_95_m, even.interval_95(aim(0)));
            if extent.dimensions() > 1 {
                self.y_95_m = hull(self.y_95_m, even.interval_95(aim(1)));
            }
        }
    }

    /// Adopts bounds over some cells.
    pub(super) fn take_bounds(&mut self, bounds: &Bounds, cells: &Cells, listed: &[usize]) {
        let along = |coordinate: fn(Position) -> f64| {
            let at: Vec<f64> = listed.iter().map(|cell| coordinate(cells.centre(*cell))).collect();
            bounds.of_mean(listed, &at)
        };
        self.x_95_m = extend_to(along(|p| p.x_m), self.position.x_m);
        if cells.extent.dimensions() > 1 {
            self.y_95_m = extend_to(along(|p| p.y_m), self.position.y_m);
        }
    }

    /// Extends the intervals to contain the position.
    pub(super) fn move_to(&mut self, position: Position) {
        self.position = position;
        self.x_95_m = extend_to(self.x_95_m, position.x_m);
        self.y_95_m = extend_to(self.y_95_m, position.y_m);
    }
}

impl Patch {
    /// With first-order standard deviations.
    pub(super) fn of_even_loads(even: &EvenLoads, number: usize, extent: Extent) -> Self {
        let load = even.middle_load(number);
        let sd = |aim| even.sd(aim).unwrap_or(f64::INFINITY);
        let sd_y_m = if extent.dimensions() > 1 { sd(LoadQuantity::Centre(number, 1)) } else { 0.0 };
        let force_n = load.force_n();
        Self {
            from: load.from(),
            to: load.to(),
            centre: CentreOfPressure::new(load.centre(), (sd(LoadQuantity::Centre(number, 0)), sd_y_m)),
            force_n,
            force_sd_n: sd(LoadQuantity::Force(number)),
            force_95_n: (force_n, force_n),
        }
    }

    /// Adopts intervals, and values that were outside.
    pub(super) fn adopt_intervals(&mut self, even: &EvenLoads, number: usize, extent: Extent) {
        self.force_95_n = even.interval_95(LoadQuantity::Force(number));
        let is_held =
            self.centre.adopt_position_intervals(even, extent, |axis| LoadQuantity::Centre(number, axis));
        if !(is_held && contains(self.force_95_n, self.force_n)) {
            let load = even.middle_load(number);
            (self.from, self.to, self.force_n) = (load.from(), load.to(), load.force_n());
            self.centre.move_to(load.centre());
            self.force_95_n = extend_to(self.force_95_n, self.force_n);
        }
    }

    /// Widens by several candidate loads.
    pub(super) fn widen(&mut self, even: &EvenLoads, numbers: &[usize], extent: Extent) {
        for number in numbers {
            self.force_95_n = hull(self.force_95_n, even.interval_95(LoadQuantity::Force(*number)));
        }
        self.centre.widen(
            even,
            extent,
            numbers.iter().map(|number| |axis| LoadQuantity::Centre(*number, axis)),
        );
        let sum_n = numbers.iter().map(|number| even.fitted_load(*number).force_n()).sum();
        if !numbers.is_empty() {
            self.force_95_n = extend_to(self.force_95_n, sum_n);
        }
    }

    /// In metres; 0 inside.
    pub(super) fn distance_m(&self, position: Position) -> f64 {
        let beyond = |at_m: f64, from_m: f64, to_m: f64| (from_m - at_m).max(at_m - to_m).max(0.0);
        let along = beyond(position.x_m, self.from.x_m, self.to.x_m);
        along.hypot(beyond(position.y_m, self.from.y_m, self.to.y_m))
    }

    /// Uniform load of the patch's force and size, within the surface.
    pub fn as_load(&self, extent: Extent) -> UniformLoad {
        let Position { x_m, y_m } = self.centre.position;
        let side = |centre: f64, (from, to): (f64, f64), size: f64| {
            let half = (0.5 * (to - from)).min(centre).min(size - centre).max(0.0);
            (centre - half, centre + half)
        };
        let (left, right) = side(x_m, (self.from.x_m, self.to.x_m), extent.length_m());
        let (low, high) = side(y_m, (self.from.y_m, self.to.y_m), extent.width_m().unwrap_or(0.0));
        let corner = |x_m, y_m| Position { x_m, y_m };
        UniformLoad::new(corner(left, low), corner(right, high), self.force_n)
    }
}

pub(super) fn contains((low, high): (f64, f64), value: f64) -> bool {
    (low..=high).contains(&value)
}

pub(super) fn nearest(patches: &[Patch], position: Position) -> Option<usize> {
    let distance_m = |number: &usize| patches[*number].distance_m(position);
    (0..patches.len()).min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)))
}

/// Weighted by force.
pub(super) fn mean_position(patches: &[Patch]) -> Position {
    let force_n: f64 = patches.iter().map(|patch| patch.force_n).sum();
    let along = |coordinate: fn(Position) -> f64| {
        patches.iter().map(|patch| patch.force_n * coordinate(patch.centre.position)).sum::<f64>() / force_n
    };
    Position { x_m: along(|p| p.x_m), y_m: along(|p| p.y_m) }
}

/// To first order; `None` without force.
pub(super) fn centre_of(
    cells: &Cells,
    listed: &[usize],
    forces_n: &[f64],
    covariance: &Array2<f64>,
) -> Option<CentreOfPressure> {
    let force: f64 = listed.iter().map(|cell| forces_n[*cell]).sum();
    if force <= 0.0 {
        return None;
    }
    let along = |coordinate: fn(Position) -> f64| {
        let at = |cell: &usize| coordinate(cells.centre(*cell));
        let mean = listed.iter().map(|cell| at(cell) * forces_n[*cell]).sum::<f64>() / force;
        let slopes: Vec<f64> = listed.iter().map(|cell| (at(cell) - mean) / force).collect();
        (mean, sd_of_sum(listed, &slopes, covariance))
    };
    let ((x_m, sd_x_m), (y_m, sd_y_m)) = (along(|p| p.x_m), along(|p| p.y_m));
    Some(CentreOfPressure::new(Position { x_m, y_m }, (sd_x_m, sd_y_m)))
}

/// Of Σ slope·force.
fn sd_of_sum(listed: &[usize], slopes: &[f64], covariance: &Array2<f64>) -> f64 {
    let row = |(i, a): (&usize, &f64)| {
        listed.iter().zip(slopes).map(|(j, b)| a * b * covariance[[*i, *j]]).sum::<f64>()
    };
    listed.iter().zip(slopes).map(row).sum::<f64>().max(0.0).sqrt()
}

/// Cells above the threshold, and all with flanks.
struct Part {
    core: Vec<usize>,
    all: Vec<usize>,
}

/// Connected cells above the threshold, with flanks down to the minimum between them, along x. An
/// insignificant patch is merged with the adjacent one, or dropped.
pub(super) fn find_patches(cells: &Cells, forces_n: &[f64], covariance: &Array2<f64>) -> Vec<Patch> {
    let mut parts = grow(cells, forces_n, cores(cells, forces_n));
    let least_ratio = normal_quantile(1.0 - OUTSIDE_MODEL_RATE);
    let stands_out = |part: &Part| {
        let (force, sd) = force_of(&part.all, forces_n, covariance);
        force > least_ratio * sd
    };
    let force = |part: &Part| force_of(&part.all, forces_n, covariance).0;
    let weakest = |parts: &[Part]| {
        let weak = (0..parts.len()).filter(|number| !stands_out(&parts[*number]));
        weak.min_by(|a, b| force(&parts[*a]).total_cmp(&force(&parts[*b])))
    };
    while let Some(weak) = weakest(&parts) {
        let part = parts.swap_remove(weak);
        if let Some(beside) = parts.iter_mut().find(|other| touches(cells, &part.all, &other.all)) {
            beside.all.extend(part.all);
        }
    }
    let mut patches: Vec<Patch> =
        parts.iter().filter_map(|part| patch(cells, part, forces_n, covariance)).collect();
    patches.sort_by(|a, b| a.centre.position.x_m.total_cmp(&b.centre.position.x_m));
    patches
}

fn cores(cells: &Cells, forces_n: &[f64]) -> Vec<Vec<usize>> {
    let highest = forces_n.iter().fold(0.0, |most: f64, force| most.max(*force));
    let mut open: Vec<bool> = forces_n.iter().map(|force| *force > PATCH_SHARE * highest).collect();
    let mut cores = Vec::new();
    for start in 0..cells.len() {
        let mut core = Vec::new();
        let mut edge = vec![start];
        while let Some(cell) = edge.pop() {
            if std::mem::replace(&mut open[cell], false) {
                core.push(cell);
                edge.extend(cells.neighbours(cell));
            }
        }
        if !core.is_empty() {
            cores.push(core);
        }
    }
    cores
}

/// Assigns downhill cells, the highest first.
fn grow(cells: &Cells, forces_n: &[f64], cores: Vec<Vec<usize>>) -> Vec<Part> {
    let mut owner = vec![None; cells.len()];
    for (number, core) in cores.iter().enumerate() {
        core.iter().for_each(|cell| owner[*cell] = Some(number));
    }
    let mut parts: Vec<Part> = cores.into_iter().map(|core| Part { all: core.clone(), core }).collect();
    let mut flanks: Vec<usize> =
        (0..cells.len()).filter(|cell| owner[*cell].is_none() && forces_n[*cell] > 0.0).collect();
    flanks.sort_by(|a, b| forces_n[*b].total_cmp(&forces_n[*a]));
    for cell in flanks {
        let uphill = cells.neighbours(cell).filter(|beside| owner[*beside].is_some());
        let uphill = uphill.max_by(|a, b| forces_n[*a].total_cmp(&forces_n[*b]));
        if let Some(number) = uphill.and_then(|beside| owner[beside]) {
            owner[cell] = Some(number);
            parts[number].all.push(cell);
        }
    }
    parts
}

/// At most [`REACH_CELLS`] cells between them.
fn touches(cells: &Cells, one: &[usize], other: &[usize]) -> bool {
    let place = |cell: usize| (cell % cells.columns, cell / cells.columns);
    one.iter().any(|a| {
        other.iter().any(|b| {
            let ((ax, ay), (bx, by)) = (place(*a), place(*b));
            ax.abs_diff(bx).max(ay.abs_diff(by)) <= REACH_CELLS + 1
        })
    })
}

fn force_of(listed: &[usize], forces_n: &[f64], covariance: &Array2<f64>) -> (f64, f64) {
    let force = listed.iter().map(|cell| forces_n[*cell]).sum();
    (force, sd_of_sum(listed, &vec![1.0; listed.len()], covariance))
}

fn patch(cells: &Cells, part: &Part, forces_n: &[f64], covariance: &Array2<f64>) -> Option<Patch> {
    let centre = centre_of(cells, &part.all, forces_n, covariance)?;
    let (force_n, force_sd_n) = force_of(&part.all, forces_n, covariance);
    let corners = part.core.iter().map(|cell| cells.corners(*cell));
    let (from, to) = corners.reduce(|(from, to), (low, high)| {
        let least = Position { x_m: from.x_m.min(low.x_m), y_m: from.y_m.min(low.y_m) };
        (least, Position { x_m: to.x_m.max(high.x_m), y_m: to.y_m.max(high.y_m) })
    })?;
    let (low_n, high_n) = normal_interval_95(force_n, force_sd_n);
    Some(Patch { from, to, centre, force_n, force_sd_n, force_95_n: (low_n.max(0.0), high_n) })
}
