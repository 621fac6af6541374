//! Rule of `no_contact`, `outside_model` and `ambiguous` for known noise.
//!
//! - `no_contact`: noise exceeds the squared length |d|² of the whitened reading more often than half the
//!   [`FalseAlarmRate`], and the best contact reduces |d|² by at most its cost: the extended Bayesian
//!   information criterion at 0.2 %, with Φ(−√cost) in proportion to the rate. The actual rate is 0.3 to 1.3
//!   times the set one (docs/validation/false-alarms.md), exact with the `NoiseBounds` of force-linear
//!   surfaces.
//! - `outside_model`: the best χ² exceeds its critical value at [`OUTSIDE_MODEL_RATE`], or the contact seems
//!   distributed at [`SPREAD_RATE`] (not for digits).
//! - `ambiguous`: another mode has at least the probability [`OTHER_PLACE`], or the 95 % interval covers
//!   [`PLACE_LEFT_OPEN`] of every side.
//!
//! A rate ten times lower raises both bounds by a tenth.

use crate::recording::Recording;
use crate::thinning::thinned;
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::{OutOfRange, bisect, chi_squared_critical_value, chi_squared_survival, normal_cdf};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Share of untouched readings detected as a contact.
///
/// ```
/// use palpate_estimators::status::FalseAlarmRate;
///
/// assert_eq!(FalseAlarmRate::default(), FalseAlarmRate::new(0.001)?);
/// assert_eq!(FalseAlarmRate::new(0.01)?.to_string(), "1 %");
/// let refused = FalseAlarmRate::new(0.5).unwrap_err().to_string();
/// assert_eq!(refused, "the false-alarm rate is 0.5; it must be at least 0.0001 % and at most 10 %");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct FalseAlarmRate(f64);

impl FalseAlarmRate {
    /// Range of rates; below it the tails of real noise are not normal.
    pub const RANGE: std::ops::RangeInclusive<f64> = 1e-6..=0.1;
    /// Range in words.
    pub const RANGE_IN_WORDS: &'static str = "at least 0.0001 % and at most 10 %";
    /// One in a thousand.
    pub const DEFAULT: Self = Self(1e-3);

    /// Returns a rate.
    ///
    /// # Errors
    /// [`OutOfRange`] outside [`FalseAlarmRate::RANGE`].
    pub fn new(share: f64) -> Result<Self, OutOfRange> {
        let number = [("the false-alarm rate", share)];
        OutOfRange::check(Self::RANGE_IN_WORDS, number, |share| Self::RANGE.contains(&share))?;
        Ok(Self(share))
    }

    /// Share of readings.
    pub const fn share(self) -> f64 {
        self.0
    }
}

impl Default for FalseAlarmRate {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl TryFrom<f64> for FalseAlarmRate {
    type Error = OutOfRange;

    fn try_from(share: f64) -> Result<Self, OutOfRange> {
        Self::new(share)
    }
}

impl From<FalseAlarmRate> for f64 {
    fn from(rate: FalseAlarmRate) -> Self {
        rate.0
    }
}

impl std::fmt::Display for FalseAlarmRate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // A percentage has no more digits than the share: 0.07 is 7 %, not 7.000000000000001 %.
        let percent = (self.0 * 1e14).round() / 1e12;
        write!(f, "{percent} %")
    }
}

/// Share of contacts that are `outside_model` by noise.
pub const OUTSIDE_MODEL_RATE: f64 = 1e-3;

/// Share of point contacts that seem distributed by noise.
pub const SPREAD_RATE: f64 = 2e-3;

/// Significance level of tests on recordings.
pub(crate) const SIGNIFICANCE: f64 = 0.05;

/// Least probability of another mode in an `ambiguous` estimate.
pub const OTHER_PLACE: f64 = 0.01;

/// Share of a side that an undetermined interval covers.
pub const PLACE_LEFT_OPEN: f64 = 0.95;

/// Critical value of χ² with at least 1 degree of freedom, as bounds of force and surface restrict every
/// contact.
pub(crate) fn chi_squared_bound(freedom: usize) -> f64 {
    static KNOWN: [OnceLock<f64>; 65] = [const { OnceLock::new() }; 65];
    let freedom = freedom.max(1);
    let bound = || chi_squared_critical_value(OUTSIDE_MODEL_RATE, freedom);
    KNOWN.get(freedom).map_or_else(bound, |known| *known.get_or_init(bound))
}

/// |d|² that noise exceeds at half a rate.
fn noise_bound(channels: usize, rate: FalseAlarmRate) -> f64 {
    static KNOWN: [OnceLock<f64>; 65] = [const { OnceLock::new() }; 65];
    let channels = channels.max(1);
    let bound = || chi_squared_critical_value(0.5 * rate.0, channels);
    match KNOWN.get(channels) {
        Some(known) if rate == FalseAlarmRate::DEFAULT => *known.get_or_init(bound),
        _ => bound(),
    }
}

/// Cost of a contact, scaled from 0.1 % to half a rate.
fn detection_cost(contact_cost: f64, rate: FalseAlarmRate) -> f64 {
    let tail = normal_cdf(-contact_cost.sqrt()) * 0.5 * rate.0 / FalseAlarmRate::DEFAULT.0;
    bisect((0.0, 20.0), 40, |u| normal_cdf(-u) > tail).powi(2)
}

/// Bounds of at least twice the recording's 99th percentile, as real noise has longer tails.
pub(crate) fn recording_bounds<const N: usize>(
    normal: [f64; N],
    recording: &Recording,
    left: impl Fn(&[f64]) -> [f64; N],
) -> [f64; N] {
    const TRIED: usize = 400;
    let rows = &recording.rows;
    let tried: Vec<[f64; N]> = thinned(rows.len(), TRIED).map(|i| left(&rows[i].reading)).collect();
    std::array::from_fn(|k| {
        let mut own: Vec<f64> = tried.iter().map(|left| left[k]).filter(|left| left.is_finite()).collect();
        own.sort_by(f64::total_cmp);
        let usual = own.get(own.len() * 99 / 100).copied().unwrap_or(0.0);
        normal[k].max(2.0 * usual)
    })
}

/// Places along a line that a contact may have in the information criterion of its detection.
pub const LINE_PLACES: usize = 33;

/// Extended Bayesian information criterion (Chen and Chen, Biometrika 95, 2008): unknowns·ln channels + 2·ln
/// places.
pub(crate) fn contact_cost(unknowns: usize, channels: usize, places: usize) -> f64 {
    unknowns as f64 * (channels as f64).ln() + 2.0 * (places as f64).ln()
}

pub(crate) fn unknowns(coordinates: usize, force_n: Option<f64>) -> usize {
    coordinates + usize::from(force_n.is_none())
}

/// Bounds on |d|² of the whitened reading and χ² of the best contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StatusRule {
    noise_bound: f64,
    detection_cost: f64,
    contact_cost: f64,
    chi_squared_bound: f64,
}

impl StatusRule {
    pub fn new(channels: usize, unknowns: usize, places: usize, rate: FalseAlarmRate) -> Self {
        let contact_cost = contact_cost(unknowns, channels, places);
        Self {
            noise_bound: noise_bound(channels, rate),
            detection_cost: detection_cost(contact_cost, rate),
            contact_cost,
            chi_squared_bound: chi_squared_bound(channels.saturating_sub(unknowns)),
        }
    }

    /// Only zeros are `no_contact`; χ² may be the share `chi_squared` of `square`.
    pub fn without_noise(square: f64, chi_squared: f64) -> Self {
        Self {
            noise_bound: 0.0,
            detection_cost: 0.0,
            contact_cost: 0.0,
            chi_squared_bound: chi_squared * square,
        }
    }

    /// True where noise explains |d|² = `square`.
    #[inline(always)]
    pub fn is_within_noise(&self, square: f64) -> bool {
        square <= self.noise_bound
    }

    /// True where noise explains |d|² = `square`, no worse than χ² = `chi_squared`.
    #[inline(always)]
    pub fn is_no_contact(&self, square: f64, chi_squared: f64) -> bool {
        square <= chi_squared + self.detection_cost && self.is_within_noise(square)
    }

    /// Reduction of `square`, less the one that detection needs.
    pub fn net_reduction(&self, square: f64, chi_squared: f64) -> f64 {
        square - chi_squared - self.detection_cost
    }

    /// True for an explained reading.
    #[inline(always)]
    pub fn is_explained(&self, chi_squared: f64) -> bool {
        chi_squared <= self.chi_squared_bound
    }

    pub fn detection(&self, channels: usize, unknowns: usize) -> Detection {
        Detection { channels, unknowns, square: self.noise_bound, taken: self.detection_cost }
    }

    /// Cost beside other contacts, at any false-alarm rate.
    pub fn contact_cost(&self) -> f64 {
        self.contact_cost
    }
}

/// Directions f/|f| of contacts: curve length ℓ on a line; half the boundary length ℓ and area A on a plane.
///
/// Noise exceeds u along one with probability Φ(−u) + e^(−u²/2)·(ℓ/2π + A·u/(2π)^(3/2)) (S. O. Rice 1944;
/// Adler and Taylor, *Random Fields and Geometry*, 2007, chapter 14).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Directions {
    pub length: f64,
    pub area: f64,
}

impl Directions {
    fn exceeded(self, u: f64) -> f64 {
        normal_cdf(-u) + (-0.5 * u * u).exp() * (self.length / TAU + self.area * u / TAU.powf(1.5))
    }

    /// Terms of [`Directions::exceeded`] as integrals, with χ² of the remaining channels.
    fn exceeded_within(self, u: f64, square: f64, channels: usize) -> f64 {
        const STEPS: usize = 64;
        let most = square.sqrt();
        if u >= most {
            return 0.0;
        }
        let below = |value: f64, freedom: usize| 1.0 - chi_squared_survival(value.max(0.0), freedom);
        let density = |z: f64| {
            let (bell, left) = ((-0.5 * z * z).exp(), square - z * z);
            let along = below(left, channels.saturating_sub(1)) / TAU.sqrt();
            let across = self.area * (z * z - 1.0) * below(left, channels.saturating_sub(3)) / TAU.powf(1.5);
            bell * (along + across)
        };
        let integral = simpson((u, most), STEPS, density);
        integral + self.length / TAU * (-0.5 * u * u).exp() * below(square - u * u, channels)
    }
}

/// Bounds on |d|² and its reduction, exceeded equally often, and one of them at the false-alarm rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoiseBounds {
    pub square: f64,
    pub taken: f64,
}

impl NoiseBounds {
    pub fn new(channels: usize, directions: Directions, rate: FalseAlarmRate) -> Self {
        let of_tail = |tail: f64| {
            let u = bisect((0.0, 20.0), 50, |u| directions.exceeded(u) > tail);
            (u, chi_squared_critical_value(tail, channels.max(1)))
        };
        let is_rarer = |tail: f64| {
            let (u, square) = of_tail(tail);
            tail + directions.exceeded_within(u, square, channels) < rate.0
        };
        let (u, square) = of_tail(bisect((0.5 * rate.0, rate.0), 20, is_rarer));
        Self { square, taken: u * u }
    }
}

/// Detection bounds for channels of unit noise.
///
/// Symbols: d whitened reading, n channels, k unknowns, s signal-to-noise ratio, B bound on |d|², C bound on
/// its reduction.
///
/// Nearby contacts span k dimensions, so the best one reduces |d|² = u + w by u = (s + z)² + v, with
/// independent z normal, v χ² of k − 1 and w χ² of n − k degrees of freedom. To first order a contact is
/// missed for u ≤ C and u + w ≤ B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Detection {
    /// n.
    pub channels: usize,
    /// k.
    pub unknowns: usize,
    /// B.
    pub square: f64,
    /// C.
    pub taken: f64,
}

impl Detection {
    pub fn probability(&self, signal: f64) -> f64 {
        const STEPS: usize = 80;
        const FAR: f64 = 7.0;
        let Self { channels, unknowns, square, taken } = *self;
        let tangents = unknowns.min(channels).saturating_sub(1);
        let rest = channels.saturating_sub(unknowns);
        let below = |left: f64| if left < 0.0 { 0.0 } else { 1.0 - chi_squared_survival(left, rest) };
        let normal = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
        // Probability of a miss for a component x = s + z along the contact, integrated over the length y of
        // the component along the tangents.
        let missed = |x: f64| {
            let room = (taken - x * x).max(0.0);
            match tangents {
                0 => below(square - x * x),
                _ => {
                    let density = |y: f64| {
                        let power = if tangents == 1 { 2.0 } else { y * TAU.sqrt() };
                        power * normal(y) * below(square - x * x - y * y)
                    };
                    simpson((0.0, room.sqrt().min(FAR)), STEPS, density)
                }
            }
        };
        let (from, to) = ((-taken.sqrt()).max(signal - FAR), taken.sqrt().min(signal + FAR));
        if from >= to {
            return 1.0;
        }
        1.0 - simpson((from, to), STEPS, |x| normal(x - signal) * missed(x))
    }

    pub fn signal(&self, probability: f64) -> f64 {
        let most = self.taken.sqrt() + self.square.sqrt() + 10.0;
        bisect((0.0, most), 40, |signal| self.probability(signal) < probability)
    }
}

fn simpson((from, to): (f64, f64), steps: usize, of: impl Fn(f64) -> f64) -> f64 {
    let step = (to - from) / steps as f64;
    let weight = |i: usize| if i == 0 || i == steps { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    (0..=steps).map(|i| weight(i) * of(from + i as f64 * step)).sum::<f64>() * step / 3.0
}

pub(crate) const NO_CONTACT: Estimate = Estimate::of_position(Position::along(0.0), Status::NoContact);

/// Makes an undetermined estimate `ambiguous`.
pub(crate) fn mark_undetermined(estimate: Estimate, extent: Extent) -> Estimate {
    let is_left_open = estimate.contact.uncertainty.is_some_and(|uncertainty| {
        let is_open = |(low, high): (f64, f64), side_m: f64| {
            high.min(side_m) - low.max(0.0) >= PLACE_LEFT_OPEN * side_m
        };
        is_open(uncertainty.x_95_m, extent.length_m())
            && extent.width_m().is_none_or(|width_m| is_open(uncertainty.y_95_m, width_m))
    });
    match estimate.status {
        Status::Located if is_left_open => Estimate { status: Status::Ambiguous, ..estimate },
        _ => estimate,
    }
}

/// Without a noise model: located, or outside the surface.
pub(crate) fn on_surface(contact: ContactEstimate, extent: Extent) -> Estimate {
    let status = if extent.contains(contact.position) { Status::Located } else { Status::OutsideSurface };
    Estimate::of_contact(contact, status)
}

#[cfg(test)]
mod tests;
