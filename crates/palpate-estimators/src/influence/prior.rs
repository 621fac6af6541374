//! Gaussian-process prior of a sensor's influence function: the mechanics or 0, with a gain error, a shift of
//! the sensor and a remainder ([`Remainders`]).

use crate::arrangement::cells;
use ndarray::{Array1, Array2};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Sensor, SensorKind};
use palpate_mechanics::surface::{Extent, InfluenceFunction, Surface};
use palpate_numerics::watch::{Cancelled, Watch};
use std::sync::Arc;

/// Standard deviations common to sensors of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hyperparameters {
    /// Relative; 0 where the mean is 0.
    pub gain: f64,
    pub shift_m: f64,
    /// Where it is largest, relative to full scale.
    pub remainder: f64,
    /// Relative to the full-scale reading at the mean force.
    pub offset: f64,
    /// Relative to the full-scale reading at the mean force; unused where repeats determine it.
    pub noise: f64,
}

impl Hyperparameters {
    pub const NONE: Self = Self { gain: 0.0, shift_m: 0.0, remainder: 0.0, offset: 0.0, noise: 0.0 };
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mean {
    Model,
    Zero,
}

#[derive(Clone)]
pub(super) struct Prior<'a> {
    mean: Mean,
    /// Largest influence, the unit of remainders.
    pub full_scale: f64,
    function: Arc<dyn InfluenceFunction + 'a>,
    /// Shifted along and across; `None` for a fixed sensor.
    beside: [Option<Beside<'a>>; 2],
}

/// Functions shifted backward and forward, and their distance in metres.
type Beside<'a> = ([Arc<dyn InfluenceFunction + 'a>; 2], f64);

#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    pub model: f64,
    /// Derivatives by the sensor's position, per metre.
    pub shift: [f64; 2],
}

impl<'a> Prior<'a> {
    pub fn new(
        surface: &'a dyn Surface,
        sensor: &Sensor,
        mean: Mean,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let Sensor { kind, position, .. } = *sensor;
        let extent = surface.extent();
        // A reaction sensor is part of its support and cannot be shifted.
        let moves = kind != SensorKind::Reaction;
        let around = |at_m: f64, size_m: f64| {
            moves.then(|| ((at_m - 1e-4 * size_m).max(0.0), (at_m + 1e-4 * size_m).min(size_m)))
        };
        let along = around(position.x_m, extent.length_m());
        let across = extent.width_m().and_then(|width_m| around(position.y_m, width_m));
        let mut places = vec![position];
        places.extend(along.iter().flat_map(|(a, b)| [*a, *b]).map(|x_m| Position { x_m, ..position }));
        places.extend(across.iter().flat_map(|(a, b)| [*a, *b]).map(|y_m| Position { y_m, ..position }));
        let mut functions = surface.influence_functions_watched(kind, &places, watch)?.into_iter();
        let function = functions.next().unwrap_or_else(|| surface.influence_function(kind, position));
        let mut beside = |ends: Option<(f64, f64)>| {
            let (before, behind) = ends?;
            Some(([functions.next()?, functions.next()?], behind - before))
        };
        let beside = [beside(along), beside(across)];
        Ok(Self { mean, full_scale: surface.full_scale(kind), function, beside })
    }

    pub fn parts(&self, contact: Position) -> Parts {
        let shift = |beside: &Option<Beside>| {
            beside.as_ref().map_or(0.0, |([before, behind], apart_m)| {
                (behind.at(contact) - before.at(contact)) / apart_m
            })
        };
        Parts { model: self.function.at(contact), shift: [shift(&self.beside[0]), shift(&self.beside[1])] }
    }

    pub fn mean(&self, at: Parts) -> f64 {
        if self.mean == Mean::Model { at.model } else { 0.0 }
    }

    /// Prior covariance; `remainder` is that of the remainders.
    pub fn covariance(&self, hyper: &Hyperparameters, a: Parts, b: Parts, remainder: f64) -> f64 {
        let scale = self.full_scale * hyper.remainder;
        let moved = a.shift[0] * b.shift[0] + a.shift[1] * b.shift[1];
        let explained = hyper.gain.powi(2) * a.model * b.model + hyper.shift_m.powi(2) * moved;
        explained + scale * scale * remainder
    }
}

/// Covariances of the remainders of sensors of one kind, 1 where they are largest.
///
/// A remainder is a random mixture of the influence functions of sensors elsewhere on the surface,
/// ∫ I(s, a) dB(s) with B Brownian motion, on a plane a Brownian sheet. The posterior mean is a smoothing
/// spline (Kimeldorf and Wahba, J. Math. Anal. Appl. 33, 1971).
pub(super) struct Remainders {
    pub presses: Array2<f64>,
    /// Places × calibration rows.
    pub places: Array2<f64>,
    /// Variance at each place.
    pub own: Array1<f64>,
}

/// Mixed sensors on a line.
const MIXED: usize = 40;
/// Approximate number of mixed sensors on a plane.
const MIXED_ON_A_PLANE: f64 = 144.0;
/// Sensors solved per check of the watch.
const SOLVED_TOGETHER: usize = 24;
/// Positions per check of the watch.
const ROWS_EACH: usize = 64;
const STRETCHES: usize = 64;
const STRETCHES_OF_A_SIDE: usize = 12;

impl Remainders {
    pub fn new(
        surface: &dyn Surface,
        kind: SensorKind,
        presses: &[Position],
        places: &[Position],
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let mixture = Mixture::new(surface, kind, watch)?;
        let sizes = mixture.rows(&everywhere(surface.extent()), watch)?;
        let norm = sizes.outer_iter().map(|row| row.dot(&row)).fold(0.0, f64::max).sqrt();
        let presses = mixture.rows(presses, watch)? / norm;
        let places = mixture.rows(places, watch)? / norm;
        watch.round()?;
        Ok(Self {
            own: places.outer_iter().map(|row| row.dot(&row)).collect(),
            places: places.dot(&presses.t()),
            presses: presses.dot(&presses.t()),
        })
    }
}

struct Mixture<'a> {
    functions: Vec<Arc<dyn InfluenceFunction + 'a>>,
    scale: f64,
    /// Reactions of single supports, mixed into reactions.
    taken: Vec<Arc<dyn InfluenceFunction + 'a>>,
}

impl<'a> Mixture<'a> {
    fn new(surface: &'a dyn Surface, kind: SensorKind, watch: Watch) -> Result<Self, Cancelled> {
        // Reactions have no sensors elsewhere: they are mixtures of the reactions of all supports and of
        // deflections.
        let reacts = kind == SensorKind::Reaction;
        let supports = if reacts { surface.force_supports() } else { Vec::new() };
        let mixed = if reacts { SensorKind::Deflection } else { kind };
        let extent = surface.extent();
        let (columns, rows) = mixed_sensors(extent);
        let mut functions = Vec::new();
        for places in cells(extent, columns, rows).chunks(SOLVED_TOGETHER) {
            functions.extend(surface.influence_functions_watched(mixed, places, watch)?);
        }
        Ok(Self {
            functions,
            scale: surface.full_scale(mixed),
            taken: supports.iter().map(|at| surface.influence_function(kind, *at)).collect(),
        })
    }

    fn rows(&self, positions: &[Position], watch: Watch) -> Result<Array2<f64>, Cancelled> {
        let count = self.functions.len();
        let mut rows = Array2::zeros((positions.len(), count + self.taken.len()));
        for (i, (mut row, at)) in rows.outer_iter_mut().zip(positions).enumerate() {
            if i.is_multiple_of(ROWS_EACH) {
                watch.round()?;
            }
            for (column, value) in row.iter_mut().enumerate() {
                *value = match column.checked_sub(count) {
                    Some(support) => count as f64 * self.taken[support].at(*at),
                    None => self.functions[column].at(*at) / self.scale,
                };
            }
        }
        Ok(rows)
    }
}

pub(super) fn mixed_sensors(extent: Extent) -> (usize, usize) {
    let side = |ratio: f64| (MIXED_ON_A_PLANE * ratio).sqrt().round().clamp(4.0, MIXED as f64) as usize;
    match extent.width_m() {
        None => (MIXED, 1),
        Some(width_m) => (side(extent.length_m() / width_m), side(width_m / extent.length_m())),
    }
}

fn everywhere(extent: Extent) -> Vec<Position> {
    let share = |i: usize, stretches: usize| i as f64 / stretches as f64;
    match extent.width_m() {
        None => (0..=STRETCHES).map(|i| Position::along(extent.length_m() * share(i, STRETCHES))).collect(),
        Some(width_m) => (0..(STRETCHES_OF_A_SIDE + 1).pow(2))
            .map(|i| {
                let (row, column) = (i / (STRETCHES_OF_A_SIDE + 1), i % (STRETCHES_OF_A_SIDE + 1));
                Position {
                    x_m: extent.length_m() * share(column, STRETCHES_OF_A_SIDE),
                    y_m: width_m * share(row, STRETCHES_OF_A_SIDE),
                }
            })
            .collect(),
    }
}
