//! Patches: connected parts of a surface that carry load.

use ndarray::Array2;
use serde::Serialize;

use super::Cells;
use super::profile::{CentreOfPressure, centre_of, sd_of_sum};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, UniformLoad};
use palpate_numerics::{normal_interval_95, normal_quantile};

/// A patch is where the load is above this share of its highest density.
pub const PATCH_SHARE: f64 = 0.1;
/// A patch that noise alone makes with more than this probability is none of its own.
const CHANCE: f64 = 1e-3;
/// Cells between a patch and another that it may be part of.
const REACH_CELLS: usize = 2;

/// A connected part of the surface that carries load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Patch {
    /// Its left end, or lower left corner: where the load rises above the share of its highest density.
    pub from: Position,
    /// Its right end, or upper right corner.
    pub to: Position,
    /// Where its force acts as a whole.
    pub centre: CentreOfPressure,
    /// Its force in newtons, its flanks below the share included.
    pub force_n: f64,
    /// Standard deviation of the force.
    pub force_sd_n: f64,
}

impl Patch {
    /// The ends of the force's 95 % interval, in newtons.
    pub fn force_95_n(&self) -> (f64, f64) {
        let (low, high) = normal_interval_95(self.force_n, self.force_sd_n);
        (low.max(0.0), high)
    }

    /// An even load of its force and sizes around its centre, as far as the surface reaches: what its limit is of.
    pub fn as_load(&self, extent: Extent) -> UniformLoad {
        let Position { x_m, y_m } = self.centre.position;
        let side = |centre: f64, (from, to): (f64, f64), size: f64| {
            let half = (0.5 * (to - from)).min(centre).min(size - centre).max(0.0);
            (centre - half, centre + half)
        };
        let (left, right) = side(x_m, (self.from.x_m, self.to.x_m), extent.length_m);
        let (low, high) = side(y_m, (self.from.y_m, self.to.y_m), extent.width_m.unwrap_or(0.0));
        let corner = |x_m, y_m| Position { x_m, y_m };
        UniformLoad { from: corner(left, low), to: corner(right, high), force_n: self.force_n }
    }
}

/// A patch in the making: cells above the share, and all cells with its flanks.
struct Part {
    core: Vec<usize>,
    all: Vec<usize>,
}

/// The patches of a profile, along x.
///
/// Connected cells above the share of the highest are patches; each takes the cells downhill from it as its flanks, up to the
/// valley to the next. A patch whose force does not stand out of its own uncertainty becomes a part of the one beside it, or,
/// where there is none, is none.
pub(super) fn find_patches(cells: &Cells, forces_n: &[f64], covariance: &Array2<f64>) -> Vec<Patch> {
    let mut parts = grow(cells, forces_n, cores(cells, forces_n));
    let least_ratio = normal_quantile(1.0 - CHANCE);
    let stands_out = |part: &Part| {
        let (force, sd) = force_of(&part.all, forces_n, covariance);
        force > least_ratio * sd
    };
    while let Some(weak) = weakest(&parts, |part| !stands_out(part), forces_n) {
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

/// Connected cells above the share of the highest.
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

/// Gives each part the cells that lie downhill from it, the highest first.
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

/// The part with the least force among those that are meant.
fn weakest(parts: &[Part], meant: impl Fn(&Part) -> bool, forces_n: &[f64]) -> Option<usize> {
    let force = |part: &Part| part.all.iter().map(|cell| forces_n[*cell]).sum::<f64>();
    let those = parts.iter().enumerate().filter(|(_, part)| meant(part));
    those.min_by(|(_, a), (_, b)| force(a).total_cmp(&force(b))).map(|(number, _)| number)
}

/// Whether no more than a few cells lie between two sets of cells.
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
    let corners = || part.core.iter().map(|cell| cells.corners(*cell));
    let least = |coordinate: fn(Position) -> f64| {
        corners().map(|(from, _)| coordinate(from)).fold(f64::INFINITY, f64::min)
    };
    let most = |coordinate: fn(Position) -> f64| {
        corners().map(|(_, to)| coordinate(to)).fold(f64::NEG_INFINITY, f64::max)
    };
    Some(Patch {
        from: Position { x_m: least(|p| p.x_m), y_m: least(|p| p.y_m) },
        to: Position { x_m: most(|p| p.x_m), y_m: most(|p| p.y_m) },
        centre,
        force_n,
        force_sd_n,
    })
}
