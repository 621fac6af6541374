//! What is believed of a sensor's influence function before any press.
//!
//! A Gaussian process. Its mean is the mechanics' influence function where the fit starts from mechanics, else 0. Its
//! covariance is that of a wrong gain, of a sensor that sits beside its place, and of a remainder (see [`Remainders`]).

use crate::contact::Position;
use crate::mechanics::{InfluenceFunction, Surface};
use crate::sensing::{Sensor, SensorKind};
use ndarray::{Array1, Array2};
use std::sync::Arc;

/// Standard deviations of what an influence function may deviate by, shared by sensors of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spread {
    /// Of the gain, relative; 0 where the mean is 0.
    pub gain: f64,
    /// Of the sensor's position, in metres; 0 where the mean is 0.
    pub shift_m: f64,
    /// Of the remainder where it is largest, relative to full scale.
    pub remainder: f64,
    /// Of the reading's offset, relative to the full-scale reading at the mean force.
    pub offset: f64,
    /// Of a reading's noise, relative to the full-scale reading at the mean force; unless repeats tell it.
    pub noise: f64,
}

impl Spread {
    /// No deviation and no noise.
    pub const NONE: Self = Self { gain: 0.0, shift_m: 0.0, remainder: 0.0, offset: 0.0, noise: 0.0 };
}

/// Where the mean of a prior comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mean {
    /// The mechanics.
    Model,
    /// Nowhere: it is 0.
    Zero,
}

/// The prior of one sensor's influence function.
#[derive(Clone)]
pub(super) struct Prior<'a> {
    mean: Mean,
    /// The largest influence, against which remainders are measured.
    pub full_scale: f64,
    function: Arc<dyn InfluenceFunction + 'a>,
    /// The functions of sensors a little to the left and to the right, and how far apart they are, in metres; none for a
    /// sensor that cannot sit beside its place.
    beside: Option<([Arc<dyn InfluenceFunction + 'a>; 2], f64)>,
}

/// What mechanics says of one sensor and one contact position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    /// The influence.
    pub model: f64,
    /// Its derivative by the sensor's position, per metre.
    pub shift: f64,
}

impl<'a> Prior<'a> {
    /// The prior of `sensor` under `surface`.
    pub fn new(surface: &'a dyn Surface, sensor: &Sensor, mean: Mean) -> Self {
        let Sensor { kind, position, .. } = *sensor;
        let function = |x_m| surface.influence_function(kind, Position { x_m, ..position });
        let l = surface.length_m();
        // A reaction sensor is part of its support, and does not sit beside it.
        let beside = (kind != SensorKind::Reaction).then(|| {
            let (left, right) = ((position.x_m - 1e-4 * l).max(0.0), (position.x_m + 1e-4 * l).min(l));
            ([function(left), function(right)], right - left)
        });
        Self { mean, full_scale: surface.full_scale(kind), function: function(position.x_m), beside }
    }

    /// The parts at a contact position.
    pub fn parts(&self, x_m: f64) -> Parts {
        let contact = Position::along(x_m);
        let shift = self
            .beside
            .as_ref()
            .map_or(0.0, |([left, right], apart_m)| (right.at(contact) - left.at(contact)) / apart_m);
        Parts { model: self.function.at(contact), shift }
    }

    /// The mean of the influence.
    pub fn mean(&self, at: Parts) -> f64 {
        if self.mean == Mean::Model { at.model } else { 0.0 }
    }

    /// Covariance of the influence at a pair of contact positions, whose remainders' covariance is `remainder`.
    pub fn covariance(&self, spread: &Spread, a: Parts, b: Parts, remainder: f64) -> f64 {
        let scale = self.full_scale * spread.remainder;
        let explained = spread.gain.powi(2) * a.model * b.model + spread.shift_m.powi(2) * a.shift * b.shift;
        explained + scale * scale * remainder
    }
}

/// Covariances of the remainders of all sensors of one kind, 1 where they are largest.
///
/// A remainder is a random mixture of the influence functions that sensors of the same kind would have elsewhere on
/// the surface, ∫ I(s, a) dB(s) with B Brownian: it bends as the surface bends, is held where the supports hold it, and
/// is as smooth as an influence function is. Its posterior mean is a smoothing spline in the sense of Kimeldorf and
/// Wahba (J. Math. Anal. Appl. 33, 1971).
pub(super) struct Remainders {
    /// Between presses.
    pub presses: Array2<f64>,
    /// Between places (rows) and presses (columns).
    pub places: Array2<f64>,
    /// Of each place with itself.
    pub own: Array1<f64>,
}

/// Sensors whose influence functions are mixed.
const MIXED: usize = 40;
/// Stretches between the places at which the largest remainder is looked for.
const STRETCHES: usize = 64;

impl Remainders {
    /// Of sensors of `kind`, for presses and places along the surface, in metres.
    pub fn new(surface: &dyn Surface, kind: SensorKind, presses_m: &[f64], places_m: &[f64]) -> Self {
        let l = surface.length_m();
        let everywhere: Vec<f64> = (0..=STRETCHES).map(|i| l * i as f64 / STRETCHES as f64).collect();
        let sizes = mixture(surface, kind, &everywhere);
        let norm = sizes.outer_iter().map(|row| row.dot(&row)).fold(0.0, f64::max).sqrt();
        let presses = mixture(surface, kind, presses_m) / norm;
        let places = mixture(surface, kind, places_m) / norm;
        Self {
            own: places.outer_iter().map(|row| row.dot(&row)).collect(),
            places: places.dot(&presses.t()),
            presses: presses.dot(&presses.t()),
        }
    }
}

/// A row a position: what each of the mixed sensors would read there.
fn mixture(surface: &dyn Surface, kind: SensorKind, positions_m: &[f64]) -> Array2<f64> {
    let l = surface.length_m();
    // Supports carry no row of sensors to mix: a reaction is a mixture of what all supports take up, and what bends of it,
    // as deflections do.
    let supports = if kind == SensorKind::Reaction { surface.force_supports() } else { Vec::new() };
    let mixed = if kind == SensorKind::Reaction { SensorKind::Deflection } else { kind };
    let scale = surface.full_scale(mixed);
    let sensor = |column: usize| Position::along((column as f64 + 0.5) * l / MIXED as f64);
    let functions: Vec<_> = (0..MIXED).map(|c| surface.influence_function(mixed, sensor(c))).collect();
    let taken: Vec<_> = supports.iter().map(|at| surface.influence_function(kind, *at)).collect();
    Array2::from_shape_fn((positions_m.len(), MIXED + taken.len()), |(row, column)| {
        let contact = Position::along(positions_m[row]);
        match column.checked_sub(MIXED) {
            Some(support) => MIXED as f64 * taken[support].at(contact),
            None => functions[column].at(contact) / scale,
        }
    })
}
