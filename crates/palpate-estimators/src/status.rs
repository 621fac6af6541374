//! The rule by which an estimate is `no_contact`, `outside_model` or `ambiguous`. All estimators with a known noise of their channels share it.
//!
//! - `no_contact`: a reading passes two conditions. Noise alone exceeds |d|², the squared length of the whitened reading d (less offsets,
//!   over the noise), more often than half the [`FalseAlarmRate`]. The best contact reduces |d|² by no more than the cost of a contact.
//!   Noise alone fails the first condition at half the rate. The cost of a contact is that of the extended Bayesian information criterion
//!   at a rate of 0.2 %. The probability Φ(−√cost) that noise exceeds the cost along one contact's reading is proportional to the rate; this
//!   gives the cost at other rates. A cost is not a quantile: noise fails the second condition at a rate that depends on the numbers of
//!   channels and places. It is 0.3 to 1 times the set rate on the benches of docs/validation/tables/at-the-limit.md. Force-linear surfaces without a model
//!   have `NoiseBounds` instead, which noise fails at the rate itself.
//! - `outside_model`: a contact of the model exceeds the χ² of the best contact less often than [`OUTSIDE_MODEL_RATE`], or the contact
//!   seems distributed. A point contact seems distributed less often than [`SPREAD_RATE`]. The residual of a distributed contact lies along
//!   the second derivative of the influences (estimators of a finger do without this test).
//! - `ambiguous`: another place has a share of at least [`OTHER_PLACE`] of the posterior probability, or the position is undetermined: the
//!   95 % interval covers at least the share [`PLACE_LEFT_OPEN`] of every side of the surface, as for a contact that may be anywhere.
//!
//! An engineer can accept one to three false alarms in a thousand readings. A channel that is read a hundred times a second then gives one
//! every few seconds, and a tracker averages it away. A rate ten times lower moves both bounds by a tenth of their size, and misses
//! contacts that are stronger by that much.

use crate::recording::Recording;
use crate::thinning::thinned;
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::{OutOfRange, bisect, chi_squared_critical_value, chi_squared_survival, normal_cdf};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Share of the readings of an untouched surface that may be mistaken for a contact: 0.0001 % to 10 %.
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
    /// The range of rates, as shares. Below it the tails of real noise are not normal; above it every other reading is an alarm.
    pub const RANGE: std::ops::RangeInclusive<f64> = 1e-6..=0.1;
    /// The range in words.
    pub const RANGE_IN_WORDS: &'static str = "at least 0.0001 % and at most 10 %";
    /// One in a thousand.
    pub const DEFAULT: Self = Self(1e-3);

    /// A rate, as a share of the readings.
    ///
    /// # Errors
    /// [`OutOfRange`] for a rate that is not in [`FalseAlarmRate::RANGE`].
    pub fn new(share: f64) -> Result<Self, OutOfRange> {
        let number = [("the false-alarm rate", share)];
        OutOfRange::check(Self::RANGE_IN_WORDS, number, |share| Self::RANGE.contains(&share))?;
        Ok(Self(share))
    }

    /// The share of the readings.
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

/// Share of the readings of contacts that are `outside_model` by noise alone.
pub const OUTSIDE_MODEL_RATE: f64 = 1e-3;

/// Share of the readings of point contacts that are `outside_model` as those of a distributed contact: two contacts close by, or a patch.
pub const SPREAD_RATE: f64 = 2e-3;

/// Significance level of the tests whether noise explains a recording: untouched rows that are contacts, their drift, presses that are
/// `outside_model`. This is the usual level of statistics: one recording in twenty fails by noise alone.
pub(crate) const SIGNIFICANCE: f64 = 0.05;

/// The least share of the posterior probability for another place to make an estimate `ambiguous`. Among `located` readings, fewer than one
/// in a hundred comes from another place than the estimated one.
pub const OTHER_PLACE: f64 = 0.01;

/// Share of a side of the surface that the 95 % interval covers for a contact that may be anywhere along it.
pub const PLACE_LEFT_OPEN: f64 = 0.95;

/// χ² that noise exceeds at [`OUTSIDE_MODEL_RATE`], with `freedom` channels more than unknowns; for 0, the χ² of 1. Contacts press and lie
/// on the surface, so with as many channels as unknowns a contact need not explain the reading. The residual of the best contact is then
/// the noise along the direction in which an end of the surface, or the force 0, limits it.
pub(crate) fn misfit_bound(freedom: usize) -> f64 {
    /// Computed bounds: estimators that weight their channels anew for each reading need one every time.
    static KNOWN: [OnceLock<f64>; 65] = [const { OnceLock::new() }; 65];
    let freedom = freedom.max(1);
    let bound = || chi_squared_critical_value(OUTSIDE_MODEL_RATE, freedom);
    KNOWN.get(freedom).map_or_else(bound, |known| *known.get_or_init(bound))
}

/// |d|² that noise of so many channels exceeds at half a rate.
fn noise_bound(channels: usize, rate: FalseAlarmRate) -> f64 {
    /// Computed bounds at the default rate: some estimators need one for each reading.
    static KNOWN: [OnceLock<f64>; 65] = [const { OnceLock::new() }; 65];
    let channels = channels.max(1);
    let bound = || chi_squared_critical_value(0.5 * rate.0, channels);
    match KNOWN.get(channels) {
        Some(known) if rate == FalseAlarmRate::DEFAULT => *known.get_or_init(bound),
        _ => bound(),
    }
}

/// The cost of a contact at half a rate, from the cost at 0.1 %. The probability that noise exceeds it along the reading of a contact is
/// proportional to the rate.
fn detection_cost(contact_cost: f64, rate: FalseAlarmRate) -> f64 {
    let tail = normal_cdf(-contact_cost.sqrt()) * 0.5 * rate.0 / FalseAlarmRate::DEFAULT.0;
    bisect((0.0, 20.0), 40, |u| normal_cdf(-u) > tail).powi(2)
}

/// Bounds of χ², of the score of a distributed contact or the like, for a surface that is known by its recording alone. Beyond them no
/// contact explains a reading. Each is the bound for `normal` noise, and at least twice the value that one in a hundred of the recording's
/// own readings exceeds, as real noise has longer tails.
pub(crate) fn learnt_bounds<const N: usize>(
    normal: [f64; N],
    recording: &Recording,
    left: impl Fn(&[f64]) -> [f64; N],
) -> [f64; N] {
    /// The most readings that are used.
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

/// Places along a line that readings distinguish.
pub(crate) const LINE_PLACES: usize = 33;

/// Cost in χ² of a contact with so many unknowns, read by so many channels, that could have been at so many places, by the extended
/// Bayesian information criterion (Chen and Chen, Biometrika 95, 2008): unknowns·ln channels + 2·ln places.
pub(crate) fn contact_cost(unknowns: usize, channels: usize, places: usize) -> f64 {
    unknowns as f64 * (channels as f64).ln() + 2.0 * (places as f64).ln()
}

/// Number of unknowns of a contact: the coordinates of its position, and its force where that is not known.
pub(crate) fn unknowns(coordinates: usize, force_n: Option<f64>) -> usize {
    coordinates + usize::from(force_n.is_none())
}

/// The bounds of `no_contact` and `outside_model`, for readings of given channels.
///
/// Symbols: |d|² squared length of the whitened reading, χ² chi-squared of the best contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StatusRule {
    /// Largest |d|² of noise alone.
    noise_bound: f64,
    /// Least |d|² − χ² of a contact.
    detection_cost: f64,
    /// Cost of a contact beside others.
    contact_cost: f64,
    /// Largest χ² of a contact.
    misfit_bound: f64,
}

impl StatusRule {
    /// The rule for `channels` with known noise, and a contact with so many unknowns that could be at so many places.
    pub fn new(channels: usize, unknowns: usize, places: usize, rate: FalseAlarmRate) -> Self {
        let contact_cost = contact_cost(unknowns, channels, places);
        Self {
            noise_bound: noise_bound(channels, rate),
            detection_cost: detection_cost(contact_cost, rate),
            contact_cost,
            misfit_bound: misfit_bound(channels.saturating_sub(unknowns)),
        }
    }

    /// The rule for a reading of channels with unknown noise: only zeros are `no_contact`, and the best contact may leave the share
    /// `misfit` of the reading's `square`.
    pub fn without_noise(square: f64, misfit: f64) -> Self {
        Self { noise_bound: 0.0, detection_cost: 0.0, contact_cost: 0.0, misfit_bound: misfit * square }
    }

    /// Whether noise alone gives readings of length `square` = |d|².
    #[inline(always)]
    pub fn is_within_noise(&self, square: f64) -> bool {
        square <= self.noise_bound
    }

    /// Whether noise alone explains a reading of length `square` = |d|², and no worse than a contact with the χ² `misfit`.
    #[inline(always)]
    pub fn is_no_contact(&self, square: f64, misfit: f64) -> bool {
        square <= misfit + self.detection_cost && self.is_within_noise(square)
    }

    /// Reduction of `square` = |d|² by a contact with the χ² `misfit`, less the smallest reduction for which a reading within the noise
    /// counts as a contact.
    pub fn taken_beyond_cost(&self, square: f64, misfit: f64) -> f64 {
        square - misfit - self.detection_cost
    }

    /// Whether a contact with the χ² `misfit` explains the reading; otherwise it is `outside_model`.
    #[inline(always)]
    pub fn is_explained(&self, misfit: f64) -> bool {
        misfit <= self.misfit_bound
    }

    /// Bounds from which the rule detects a contact with so many unknowns in readings of so many channels.
    pub fn detection(&self, channels: usize, unknowns: usize) -> Detection {
        Detection { channels, unknowns, square: self.noise_bound, taken: self.detection_cost }
    }

    /// Cost in χ² of a contact beside others, which does not depend on the false-alarm rate.
    pub fn contact_cost(&self) -> f64 {
        self.contact_cost
    }
}

/// Extent of the directions f/|f| that readings of contacts have: the length ℓ of their curve over a line and no area; half the length
/// of their boundary and their area A over a plane.
///
/// Noise d of unit variance has a component greater than u along one of them with the probability
/// Φ(−u) + e^(−u²/2)·(ℓ/2π + A·u/(2π)^(3/2)) (S. O. Rice 1944; Adler and Taylor, *Random Fields and Geometry*, 2007, chapter 14).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Directions {
    pub length: f64,
    pub area: f64,
}

impl Directions {
    /// Probability that noise has a component greater than `u` along a direction.
    fn exceeded(self, u: f64) -> f64 {
        normal_cdf(-u) + (-0.5 * u * u).exp() * (self.length / TAU + self.area * u / TAU.powf(1.5))
    }

    /// Probability that noise of so many channels has a component greater than `u` along a direction while |d|² is at most `square`. Each
    /// term of [`Directions::exceeded`] is the integral of a density of the component. The remainder of |d|² is χ² of the channels that the
    /// term does not use.
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

/// Bounds of noise: on |d|², and on its reduction by the best contact. Noise exceeds each of them equally often, and at least one of them
/// at the false-alarm rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoiseBounds {
    /// Largest |d|² of noise alone.
    pub square: f64,
    /// Largest reduction of |d|² by a contact.
    pub taken: f64,
}

impl NoiseBounds {
    /// The bounds for so many channels, by the directions of their contacts.
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

/// Bounds from which a contact is detected: a rule of `no_contact` for channels of unit noise.
///
/// Symbols: d whitened reading, n channels, k unknowns of a contact (its coordinates and its unknown force), s length of the contact's own
/// whitened reading (its signal-to-noise ratio), B the bound on |d|² and C the bound on its reduction by the best contact.
///
/// Near the contact, the readings of all others span k dimensions, along its own reading and along its tangents. So the best of them
/// reduces |d|² = u + w by u = (s + z)² + v, with z normal, v χ² of k − 1 and w χ² of n − k degrees of freedom, all independent. The
/// contact is missed where u ≤ C and u + w ≤ B. This is valid to first order: contacts with distant readings, and the curvature of the
/// readings between, are neglected.
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
    /// Probability that a contact of signal-to-noise ratio `signal` is detected.
    pub fn probability(&self, signal: f64) -> f64 {
        const STEPS: usize = 80;
        /// Standard deviations beyond which the probability of a normal variable is negligible.
        const FAR: f64 = 7.0;
        let Self { channels, unknowns, square, taken } = *self;
        let tangents = unknowns.min(channels).saturating_sub(1);
        let rest = channels.saturating_sub(unknowns);
        let below = |left: f64| if left < 0.0 { 0.0 } else { 1.0 - chi_squared_survival(left, rest) };
        let normal = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
        // Probability of a miss for a component x = s + z along the contact, integrated over the length y of the component along the tangents.
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

    /// Signal-to-noise ratio of a contact that is detected with a probability.
    pub fn signal(&self, probability: f64) -> f64 {
        let most = self.taken.sqrt() + self.square.sqrt() + 10.0;
        bisect((0.0, most), 40, |signal| self.probability(signal) < probability)
    }
}

/// Integral by Simpson's rule, of an even number of steps.
fn simpson((from, to): (f64, f64), steps: usize, of: impl Fn(f64) -> f64) -> f64 {
    let step = (to - from) / steps as f64;
    let weight = |i: usize| if i == 0 || i == steps { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    (0..=steps).map(|i| weight(i) * of(from + i as f64 * step)).sum::<f64>() * step / 3.0
}

/// The estimate of a reading that contains only noise.
pub(crate) const NO_CONTACT: Estimate = Estimate::of_position(Position::along(0.0), Status::NoContact);

/// The estimate with the status `ambiguous` instead of `located` where the position is undetermined.
pub(crate) fn unless_left_open(estimate: Estimate, extent: Extent) -> Estimate {
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

/// The estimate of a method without a noise model: located, or outside the surface.
pub(crate) fn on_surface(contact: ContactEstimate, extent: Extent) -> Estimate {
    let status = if extent.contains(contact.position) { Status::Located } else { Status::OutsideSurface };
    Estimate::of_contact(contact, status)
}

#[cfg(test)]
mod tests;
