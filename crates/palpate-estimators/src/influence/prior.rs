//! Prior of a sensor's influence function, before any press.
//!
//! A Gaussian process. Its mean is the mechanics' influence function where the fit starts from mechanics, else 0. Its
//! covariance is that of a wrong gain, of a sensor that sits beside its place, and of a remainder (see [`Remainders`]).

use crate::arrangement::cells;
use ndarray::{Array1, Array2};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Sensor, SensorKind};
use palpate_mechanics::surface::{Extent, InfluenceFunction, Surface};
use palpate_numerics::watch::{Cancelled, Watch};
use std::sync::Arc;

/// Standard deviations of what an influence function may deviate by, shared by sensors of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hyperparameters {
    /// Deviation of the gain, relative; 0 where the mean is 0.
    pub gain: f64,
    /// Deviation of the sensor's position, in metres; 0 where the mean is 0.
    pub shift_m: f64,
    /// Deviation of the remainder where it is largest, relative to full scale.
    pub remainder: f64,
    /// Deviation of the reading's offset, relative to the full-scale reading at the mean force.
    pub offset: f64,
    /// Deviation of a reading's noise, relative to the full-scale reading at the mean force; unless repeats tell it.
    pub noise: f64,
}

impl Hyperparameters {
    /// No deviation and no noise.
    pub const NONE: Self = Self { gain: 0.0, shift_m: 0.0, remainder: 0.0, offset: 0.0, noise: 0.0 };
}

/// Source of a prior's mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mean {
    /// The mechanics.
    Model,
    /// None: it is 0.
    Zero,
}

/// The prior of one sensor's influence function.
#[derive(Clone)]
pub(super) struct Prior<'a> {
    mean: Mean,
    /// The largest influence, against which remainders are measured.
    pub full_scale: f64,
    function: Arc<dyn InfluenceFunction + 'a>,
    /// Functions of a sensor that can sit beside its place, along the surface and, on a plane, across it.
    beside: [Option<Beside<'a>>; 2],
}

/// The functions of sensors a little before and behind a sensor, and how far apart they are, in metres.
type Beside<'a> = ([Arc<dyn InfluenceFunction + 'a>; 2], f64);

/// Terms of the mechanics for one sensor and one contact position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    /// The influence.
    pub model: f64,
    /// Derivatives by the sensor's position along and across, per metre.
    pub shift: [f64; 2],
}

impl<'a> Prior<'a> {
    /// The prior of `sensor` under `surface`.
    ///
    /// # Errors
    /// [`Cancelled`] where `watch` stops the solutions.
    pub fn new(
        surface: &'a dyn Surface,
        sensor: &Sensor,
        mean: Mean,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let Sensor { kind, position, .. } = *sensor;
        let extent = surface.extent();
        // A reaction sensor is part of its support, and does not sit beside it.
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

    /// The parts at a contact position.
    pub fn parts(&self, contact: Position) -> Parts {
        let shift = |beside: &Option<Beside>| {
            beside.as_ref().map_or(0.0, |([before, behind], apart_m)| {
                (behind.at(contact) - before.at(contact)) / apart_m
            })
        };
        Parts { model: self.function.at(contact), shift: [shift(&self.beside[0]), shift(&self.beside[1])] }
    }

    /// The mean of the influence.
    pub fn mean(&self, at: Parts) -> f64 {
        if self.mean == Mean::Model { at.model } else { 0.0 }
    }

    /// Covariance of the influence at a pair of contact positions, whose remainders' covariance is `remainder`.
    pub fn covariance(&self, hyper: &Hyperparameters, a: Parts, b: Parts, remainder: f64) -> f64 {
        let scale = self.full_scale * hyper.remainder;
        let moved = a.shift[0] * b.shift[0] + a.shift[1] * b.shift[1];
        let explained = hyper.gain.powi(2) * a.model * b.model + hyper.shift_m.powi(2) * moved;
        explained + scale * scale * remainder
    }
}

/// Covariances of the remainders of all sensors of one kind, 1 where they are largest.
///
/// A remainder is a random mixture of the influence functions that sensors of the same kind would have elsewhere on
/// the surface, ∫ I(s, a) dB(s) with B Brownian, on a plane a Brownian sheet: it bends as the surface bends, is held where
/// the supports hold it, and is as smooth as an influence function is. Its posterior mean is a smoothing spline in the sense
/// of Kimeldorf and Wahba (J. Math. Anal. Appl. 33, 1971).
pub(super) struct Remainders {
    /// Between presses.
    pub presses: Array2<f64>,
    /// Between places (rows) and presses (columns).
    pub places: Array2<f64>,
    /// Variance of each place.
    pub own: Array1<f64>,
}

/// Sensors whose influence functions are mixed on a line.
const MIXED: usize = 40;
/// The same on a plane, about; more of them along its longer side.
const MIXED_ON_A_PLANE: f64 = 144.0;
/// Sensors that are solved for between two looks whether to go on, as many as plates have sooner together.
const SOLVED_TOGETHER: usize = 24;
/// Positions at which they are asked between two looks.
const ROWS_EACH: usize = 64;
/// Stretches between the places at which the largest remainder is looked for: along a line, and along each side of a plane.
const STRETCHES: usize = 64;
const STRETCHES_OF_A_SIDE: usize = 12;

impl Remainders {
    /// Covariances of sensors of `kind`, for presses and places on the surface.
    ///
    /// # Errors
    /// [`Cancelled`] where `watch` stops the solutions of the sensors that are mixed.
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

/// The sensors that are mixed.
struct Mixture<'a> {
    functions: Vec<Arc<dyn InfluenceFunction + 'a>>,
    scale: f64,
    /// Reactions of single supports, mixed into reactions.
    taken: Vec<Arc<dyn InfluenceFunction + 'a>>,
}

impl<'a> Mixture<'a> {
    fn new(surface: &'a dyn Surface, kind: SensorKind, watch: Watch) -> Result<Self, Cancelled> {
        // Supports carry no row of sensors to mix: a reaction is a mixture of what all supports take up, and what bends of it,
        // as deflections do.
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

    /// A row a position: what each of the mixed sensors would read there.
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

/// Columns and rows of the sensors that are mixed.
pub(super) fn mixed_sensors(extent: Extent) -> (usize, usize) {
    let side = |ratio: f64| (MIXED_ON_A_PLANE * ratio).sqrt().round().clamp(4.0, MIXED as f64) as usize;
    match extent.width_m() {
        None => (MIXED, 1),
        Some(width_m) => (side(extent.length_m() / width_m), side(width_m / extent.length_m())),
    }
}

/// Places all over a surface, its boundary included.
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
