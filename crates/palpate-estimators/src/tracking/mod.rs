//! Tracking of moving contacts: Bayesian filter and smoother.
//!
//! Weighted hypotheses of up to two contacts are banks of Gaussians in the joint state of surface and
//! contacts, one per combination of motions (interacting multiple models: H. Blom and Y. Bar-Shalom, IEEE
//! Trans. Autom. Control 33, 1988). Readings update and weight them (iterated extended Kalman filter). Births
//! are at modes of a reading's likelihood (Gaussian sum: D. Alspach and H. Sorenson, same Trans. 17, 1972).
//!
//! A vibrating surface adds its first mode's force and rate. A plane has one contact, in balance.
//!
//! The smoother is that of H. Rauch, F. Tung and C. Striebel (AIAA Journal 3, 1965), for each motion.

mod bank;
mod belief;
mod birth;
mod gaussian;
mod slow;
mod tracker;

pub use slow::{Creep, Drift};
pub use tracker::{SmoothTracker, Tracker};

use crate::force_prior::force_interval_95_n;
use crate::interval_check::EstimateWidening;
use crate::likelihood::{CalibrationVariance, Likelihood};
use belief::Moments;
use palpate_core::{ContactEstimate, Estimate, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::{NORMAL_95, bisect, clamped_interval, normal_cdf, normal_interval_95};

/// Configuration of a tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerConfig {
    /// Acceleration standard deviations of slow to fast motions, in m/s².
    pub accelerations_m_per_s2: [f64; 3],
    /// Acceleration correlation time, in seconds.
    pub acceleration_s: f64,
    /// Mean duration of a motion, in seconds.
    pub motion_s: f64,
    /// Standard deviation of a new contact's speed.
    pub speed_sd_m_per_s: f64,
    /// Relative force drift in a second.
    pub force_drift: f64,
    /// Rate of births, and of ends, in 1/s.
    pub changes_per_s: f64,
    /// Rate of jumps to another place, in 1/s.
    pub jumps_per_s: f64,
    /// First mode; `None` in balance.
    pub swing: Option<Swing>,
    /// Channel drift; `None` tracks it only if untouched calibration rows drift.
    pub drift: Option<Drift>,
    /// Surface creep.
    pub creep: Option<Creep>,
}

/// First mode of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Natural frequency in hertz, positive.
    pub frequency_hz: f64,
    /// Damping ratio, at least 0, below 1.
    pub damping_ratio: f64,
}

impl Default for TrackerConfig {
    /// For hands, robots and wheels, up to some m/s.
    fn default() -> Self {
        Self {
            accelerations_m_per_s2: [0.03, 0.6, 6.0],
            acceleration_s: 0.3,
            motion_s: 1.0,
            speed_sd_m_per_s: 0.5,
            force_drift: 0.1,
            changes_per_s: 1.0,
            jumps_per_s: 1e-3,
            swing: None,
            drift: None,
            creep: None,
        }
    }
}

/// Probability of a hypothesis that gives the result alone.
const SURE: f64 = 0.98;

/// State at one reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Time in seconds.
    pub time_s: f64,
    /// Probabilities of no, one and two contacts.
    pub numbers: [f64; 3],
    /// Contacts in persistent order.
    pub contacts: Vec<TrackedContact>,
    /// Single estimate.
    pub single: Estimate,
}

/// Tracked contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedContact {
    /// Position in metres.
    pub x_m: f64,
    /// Speed in m/s.
    pub speed_m_per_s: f64,
    /// Force in newtons.
    pub force_n: f64,
    /// Standard deviations, with calibration uncertainty of position and force.
    pub sd: [f64; 3],
    /// 95 % interval of position.
    pub x_95_m: (f64, f64),
    /// 95 % interval of a log-normal force, by force–position trade-off; `None` if normal.
    pub force_95_n: Option<(f64, f64)>,
    /// Motion across a plane.
    pub transverse: Option<TransverseMotion>,
}

/// Motion across a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverseMotion {
    /// Position in metres.
    pub y_m: f64,
    /// Speed in m/s.
    pub speed_m_per_s: f64,
    /// Standard deviations, with calibration uncertainty of the position.
    pub sd: [f64; 2],
    /// 95 % interval of y.
    pub y_95_m: (f64, f64),
    /// Covariance of x and y, in m².
    pub covariance_m2: f64,
}

/// Invalid reading.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Times do not increase.
    #[error("the reading is of {time_s} s; it must be later than the previous one, of {before_s} s")]
    Time {
        /// Time in seconds.
        time_s: f64,
        /// Previous time.
        before_s: f64,
    },
}

impl Track {
    /// Probability of contact.
    pub fn touching(&self) -> f64 {
        (self.numbers[1] + self.numbers[2]).clamp(0.0, 1.0)
    }
}

impl TrackedContact {
    /// The contact as an estimate, without covariance of position and force.
    pub fn estimate(&self) -> ContactEstimate {
        let [sd_m, _, sd_n] = self.sd;
        let (y_m, y_95_m, xy, yy) = self.transverse.map_or((0.0, (0.0, 0.0), 0.0, 0.0), |across| {
            (across.y_m, across.y_95_m, across.covariance_m2, across.sd[0].powi(2))
        });
        let covariance = [sd_m * sd_m, xy, 0.0, yy, 0.0, sd_n * sd_n];
        ContactEstimate {
            position: Position { x_m: self.x_m, y_m },
            force_n: Some(self.force_n),
            uncertainty: Some(Uncertainty {
                covariance,
                x_95_m: self.x_95_m,
                y_95_m,
                force_95_n: self.force_95_n,
            }),
        }
    }

    /// 95 % interval of the force in newtons.
    pub fn force_interval_95_n(&self) -> (f64, f64) {
        self.force_95_n.unwrap_or_else(|| force_interval_95_n(self.force_n, self.sd[2]))
    }

    /// Beliefs with equal numbers of contacts, the most probable first.
    fn from_mixture(beliefs: &[(f64, Vec<Moments>)], likelihood: &dyn Likelihood) -> Vec<Self> {
        let Some((weight, best)) = beliefs.first() else { return Vec::new() };
        let sum: f64 = beliefs.iter().map(|(weight, _)| weight).sum();
        let (true, [first]) = (*weight < SURE * sum, best.as_slice()) else {
            return Self::from_belief(best, likelihood);
        };
        let extent @ Extent::Line { .. } = likelihood.extent() else {
            return Self::from_belief(&[mixture_moments(first, beliefs, sum)], likelihood);
        };
        let mut all = Self::from_belief(best, likelihood);
        if let [one] = all.as_mut_slice() {
            let floor_m2 = one.sd[0].powi(2) - first.variance[0];
            let parts = beliefs.iter().map(|(weight, contacts)| {
                (weight / sum, contacts[0].mean[0], (contacts[0].variance[0] + floor_m2).sqrt())
            });
            one.x_95_m = interval(&parts.collect::<Vec<_>>(), extent.length_m());
        }
        all
    }

    fn from_belief(belief: &[Moments], likelihood: &dyn Likelihood) -> Vec<Self> {
        let contacts: Vec<_> = belief.iter().map(Moments::contact).collect();
        let left = likelihood.calibration_variance(&contacts);
        let extent = likelihood.extent();
        let greatest_n = likelihood.force_range().map_or(f64::INFINITY, |range| range.ends_n().1);
        let tracked = |(moments, left): (&Moments, CalibrationVariance)| {
            let [xx, xy, yy] = left.position_m2;
            let [x_m, speed_m_per_s, force_n, y_m, speed_across] = moments.mean;
            let [along, speed, force, across, across_speed] = moments.variance;
            let sd = [(along + xx).sqrt(), speed.sqrt(), (force + left.force_n2).sqrt()];
            let across = |width_m: f64| {
                let sd = [(across + yy).sqrt(), across_speed.sqrt()];
                TransverseMotion {
                    y_m,
                    speed_m_per_s: speed_across,
                    sd,
                    y_95_m: clamped_interval(normal_interval_95(y_m, sd[0]), width_m),
                    covariance_m2: moments.covariance_m2 + xy,
                }
            };
            let x_95_m = clamped_interval(normal_interval_95(x_m, sd[0]), extent.length_m());
            let force_95_n = force_interval_n(force_n, sd[2], left.force_n2 > force, greatest_n);
            Self {
                x_m,
                speed_m_per_s,
                force_n,
                sd,
                x_95_m,
                force_95_n,
                transverse: extent.width_m().map(across),
            }
        };
        belief.iter().zip(left).map(tracked).collect()
    }
}

impl TrackedContact {
    /// As the locator's interval check.
    fn widen_by_check(tracked: &mut [Self], likelihood: &dyn Likelihood) {
        let Some(check) = likelihood.interval_check() else { return };
        let EstimateWidening { position, force } = check.widening();
        let greatest_n = likelihood.force_range().map_or(f64::INFINITY, |range| range.ends_n().1);
        for one in tracked {
            let [sd_m, _, sd_n] = one.sd;
            let (yy, xy) = one.transverse.map_or((0.0, 0.0), |across| {
                let more = position.factor * position.factor - 1.0;
                (position.added_variance(across.sd[0].powi(2)), more * across.covariance_m2)
            });
            // A known force has no error.
            let force_n2 = if sd_n > 0.0 { force.added_variance(sd_n * sd_n) } else { 0.0 };
            one.widen(
                [position.added_variance(sd_m * sd_m), xy, yy, force_n2],
                likelihood.extent(),
                greatest_n,
            );
        }
    }

    /// Adds variances of position and force.
    fn widen(&mut self, [xx, xy, yy, force]: [f64; 4], extent: Extent, greatest_n: f64) {
        let wider = |at_m: f64, (low_m, high_m): (f64, f64), variance: f64, side_m: f64| {
            let half = |own_m: f64| (own_m * own_m + NORMAL_95 * NORMAL_95 * variance).sqrt();
            clamped_interval((at_m - half(at_m - low_m), at_m + half(high_m - at_m)), side_m)
        };
        // At most the standard deviation of a uniform distribution.
        let at_most = |variance: f64, side: f64| variance.sqrt().min(side / 12f64.sqrt());
        self.x_95_m = wider(self.x_m, self.x_95_m, xx, extent.length_m());
        self.sd[0] = at_most(self.sd[0].powi(2) + xx, extent.length_m());
        self.sd[2] = at_most(self.sd[2].powi(2) + force, greatest_n);
        self.force_95_n = force_interval_n(self.force_n, self.sd[2], self.force_95_n.is_some(), greatest_n);
        if let (Some(across), Some(width_m)) = (&mut self.transverse, extent.width_m()) {
            across.y_95_m = wider(across.y_m, across.y_95_m, yy, width_m);
            across.sd[0] = at_most(across.sd[0].powi(2) + yy, width_m);
            across.covariance_m2 += xy;
        }
    }
}

/// Log-normal or clipped force; `None` if normal.
fn force_interval_n(force_n: f64, sd_n: f64, trades_off: bool, greatest_n: f64) -> Option<(f64, f64)> {
    let most_n = greatest_n.max(force_n);
    if trades_off && force_n > 0.0 {
        let (low, high) = normal_interval_95(0.0, sd_n / force_n);
        return Some((force_n * low.exp(), (force_n * high.exp()).min(most_n)));
    }
    let (low_n, high_n) = force_interval_95_n(force_n, sd_n);
    (high_n > most_n).then_some((low_n, most_n))
}

/// Covariance of all hypotheses about the most probable contact.
fn mixture_moments(best: &Moments, beliefs: &[(f64, Vec<Moments>)], sum: f64) -> Moments {
    let mut spread = Moments { variance: [0.0; 5], covariance_m2: 0.0, ..*best };
    for (weight, one) in beliefs.iter().filter_map(|(weight, contacts)| Some((weight, contacts.first()?))) {
        let (share, off) = (weight / sum, |i: usize| one.mean[i] - best.mean[i]);
        for (i, variance) in spread.variance.iter_mut().enumerate() {
            *variance += share * (one.variance[i] + off(i).powi(2));
        }
        spread.covariance_m2 += share * (one.covariance_m2 + off(0) * off(3));
    }
    spread
}

/// Mixture of normal distributions: share, mean, standard deviation.
fn interval(parts: &[(f64, f64, f64)], length_m: f64) -> (f64, f64) {
    let below = |x_m: f64| -> f64 {
        parts.iter().map(|(share, mean, sd)| share * normal_cdf((x_m - mean) / sd)).sum()
    };
    let quantile = |share: f64| bisect((0.0, length_m), 24, |x_m| below(x_m) < share);
    (quantile(0.025), quantile(0.975))
}

#[cfg(test)]
mod tests;
