//! Moving contacts: a Bayesian filter over position, speed and force, and a smoother over the whole recording.
//!
//! The hidden state is how many contacts touch, where, how fast and how hard each does, and how the surface swings. The belief
//! is a few weighted hypotheses: no contact, one or two, which came at some time and have moved since. A
//! hypothesis is a bank of Gaussians in the joint state of surface and contacts, one for each choice of a few motions from
//! steady to brisk, which mix as motions change (interacting multiple models: H. Blom and Y. Bar-Shalom, IEEE Trans. Autom.
//! Control 33, 1988). A reading updates them by its likelihood, expanded about their predicted places (an iterated
//! extended Kalman filter), and weights them by how well they explain it. Hypotheses are born at every place that explains the
//! reading by itself, so a mirror image or a wide valley becomes several of them (a Gaussian sum: D. Alspach and H. Sorenson, same
//! Trans. 17, 1972). A second contact is born beside the one that is tracked. Each contact of a hypothesis may let go,
//! which makes another hypothesis. Hypotheses that readings contradict lose weight and are dropped.
//!
//! A surface that swings adds two numbers to the state, the force of its first mode and its rate of change. The contacts
//! drive them; they affect only the readings, and outlast the contacts.
//!
//! A grid of positions and speeds that resolves a track would have some 10⁵ cells. Within a valley of the
//! likelihood a Gaussian is a good approximation, as soon as a contact has lasted for some readings.
//!
//! On a plane there is one contact. Its motions along and across are alike and independent, and the surface
//! is modelled in balance; the rest is as on a line.
//!
//! The smoother updates a hypothesis backwards in time with the later readings, by the recursion of H. Rauch, F. Tung and C. Striebel (AIAA Journal
//! 3, 1965) for each motion.

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

/// Configuration of a tracker: how contacts come, move and go, and how the surface swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerConfig {
    /// Motions from steady to brisk: standard deviation of the acceleration, in m/s².
    pub accelerations_m_per_s2: [f64; 3],
    /// Correlation time of the acceleration, in seconds: its correlation falls by e in that time.
    pub acceleration_s: f64,
    /// Mean time that a contact keeps to one of the motions, in seconds.
    pub motion_s: f64,
    /// Standard deviation of the speed of a contact that has just come, in m/s.
    pub speed_sd_m_per_s: f64,
    /// Drift of an unknown force in a second, as a share of it.
    pub force_drift: f64,
    /// Rate, a second, at which a contact comes on an untouched surface, and at which one goes.
    pub changes_per_s: f64,
    /// Rate, a second, at which a contact goes and is at once somewhere else.
    pub jumps_per_s: f64,
    /// First mode of the surface, where it is known; else the surface is assumed to be in balance.
    pub swing: Option<Swing>,
    /// Drift of the channels; `None` tracks a drift only if the untouched rows of the calibration show one.
    pub drift: Option<Drift>,
    /// Creep of the surface; `None` without creep.
    pub creep: Option<Creep>,
}

/// The first mode of a surface that swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Natural frequency, in hertz; greater than 0.
    pub frequency_hz: f64,
    /// The share of its critical damping, at least 0 and below 1.
    pub damping_ratio: f64,
}

impl Default for TrackerConfig {
    /// For hands, robots and wheels up to some metres a second.
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

/// Least share of the probability from which on one hypothesis gives the result alone.
const SURE: f64 = 0.98;

/// State of all contacts at one reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Time of the reading, in seconds.
    pub time_s: f64,
    /// The probabilities of no contact, one contact and two.
    pub numbers: [f64; 3],
    /// The contacts, as many as is most probable. Each keeps its place in the list while it is tracked.
    pub contacts: Vec<Tracked>,
    /// Estimate from this reading only.
    pub single: Estimate,
}

/// A contact that is tracked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracked {
    /// Position along the surface, in metres.
    pub x_m: f64,
    /// Speed along the surface, in m/s.
    pub speed_m_per_s: f64,
    /// Force, in newtons.
    pub force_n: f64,
    /// Standard deviations of the three; those of position and force include the calibration's uncertainty.
    pub sd: [f64; 3],
    /// The 95 % interval of the position, in metres.
    pub x_95_m: (f64, f64),
    /// The 95 % interval of the force in newtons, where the calibration's variance of the force exceeds that of the readings. Beside an end force
    /// and place trade off, so that the logarithm of the force is normal. `None` where the force itself is normal.
    pub force_95_n: Option<(f64, f64)>,
    /// Position and speed across a plane; `None` on a line.
    pub across: Option<Across>,
}

/// Position and speed of a tracked contact across a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Across {
    /// Position, in metres.
    pub y_m: f64,
    /// Speed across, in m/s.
    pub speed_m_per_s: f64,
    /// Standard deviations of the two; the position's includes the calibration's uncertainty.
    pub sd: [f64; 2],
    /// The 95 % interval of y, in metres.
    pub y_95_m: (f64, f64),
    /// Covariance of x and y, in m².
    pub covariance_m2: f64,
}

/// A reading that cannot be tracked.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// The time is not later than that of the reading before.
    #[error("the reading is of {time_s} s; it must be later than the previous one, of {before_s} s")]
    Time {
        /// Time, in seconds.
        time_s: f64,
        /// Time of the reading before, in seconds.
        before_s: f64,
    },
}

impl Track {
    /// The probability of at least one contact.
    pub fn touching(&self) -> f64 {
        (self.numbers[1] + self.numbers[2]).clamp(0.0, 1.0)
    }
}

impl Tracked {
    /// The contact as the estimate of a single reading, with a covariance of 0 between position and force.
    pub fn estimate(&self) -> ContactEstimate {
        let [sd_m, _, sd_n] = self.sd;
        let (y_m, y_95_m, xy, yy) = self.across.map_or((0.0, (0.0, 0.0), 0.0, 0.0), |across| {
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

    /// The 95 % interval of the force, in newtons: [`force_95_n`](Self::force_95_n), or that of a normal distribution.
    pub fn force_interval_95_n(&self) -> (f64, f64) {
        self.force_95_n.unwrap_or_else(|| force_interval_95_n(self.force_n, self.sd[2]))
    }

    /// The contacts of beliefs with as many of them, each with its weight, the most probable first.
    fn from_mixture(beliefs: &[(f64, Vec<Moments>)], likelihood: &dyn Likelihood) -> Vec<Self> {
        let Some((weight, best)) = beliefs.first() else { return Vec::new() };
        let sum: f64 = beliefs.iter().map(|(weight, _)| weight).sum();
        let (true, [first]) = (*weight < SURE * sum, best.as_slice()) else {
            return Self::from_belief(best, likelihood);
        };
        let extent @ Extent::Line { .. } = likelihood.extent() else {
            return Self::from_belief(&[spread(first, beliefs, sum)], likelihood);
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

    /// The contacts of one belief.
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
                Across {
                    y_m,
                    speed_m_per_s: speed_across,
                    sd,
                    y_95_m: clamped_interval(normal_interval_95(y_m, sd[0]), width_m),
                    covariance_m2: moments.covariance_m2 + xy,
                }
            };
            let x_95_m = clamped_interval(normal_interval_95(x_m, sd[0]), extent.length_m());
            let force_95_n = force_interval_n(force_n, sd[2], left.force_n2 > force, greatest_n);
            Self { x_m, speed_m_per_s, force_n, sd, x_95_m, force_95_n, across: extent.width_m().map(across) }
        };
        belief.iter().zip(left).map(tracked).collect()
    }
}

impl Tracked {
    /// Widens contacts as the check of the locator's intervals does.
    fn widen_by_check(tracked: &mut [Self], likelihood: &dyn Likelihood) {
        let Some(check) = likelihood.interval_check() else { return };
        let EstimateWidening { position, force } = check.widening();
        let greatest_n = likelihood.force_range().map_or(f64::INFINITY, |range| range.ends_n().1);
        for one in tracked {
            let [sd_m, _, sd_n] = one.sd;
            let (yy, xy) = one.across.map_or((0.0, 0.0), |across| {
                let more = position.factor * position.factor - 1.0;
                (position.added_variance(across.sd[0].powi(2)), more * across.covariance_m2)
            });
            // A force that is known has no error.
            let force_n2 = if sd_n > 0.0 { force.added_variance(sd_n * sd_n) } else { 0.0 };
            one.widen(
                [position.added_variance(sd_m * sd_m), xy, yy, force_n2],
                likelihood.extent(),
                greatest_n,
            );
        }
    }

    /// Adds variances of the place, xx, xy and yy, and of the force, on a surface of this extent, with contacts up to a greatest force.
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
        if let (Some(across), Some(width_m)) = (&mut self.across, extent.width_m()) {
            across.y_95_m = wider(across.y_m, across.y_95_m, yy, width_m);
            across.sd[0] = at_most(across.sd[0].powi(2) + yy, width_m);
            across.covariance_m2 += xy;
        }
    }
}

/// The 95 % interval of a force that trades off against the place, so that its logarithm is normal, or that ends at the greatest force; `None`
/// for a normal force.
fn force_interval_n(force_n: f64, sd_n: f64, trades_off: bool, greatest_n: f64) -> Option<(f64, f64)> {
    let most_n = greatest_n.max(force_n);
    if trades_off && force_n > 0.0 {
        let (low, high) = normal_interval_95(0.0, sd_n / force_n);
        return Some((force_n * low.exp(), (force_n * high.exp()).min(most_n)));
    }
    let (low_n, high_n) = force_interval_95_n(force_n, sd_n);
    (high_n > most_n).then_some((low_n, most_n))
}

/// The most probable contact of a plane, with the covariance about it of all hypotheses.
fn spread(best: &Moments, beliefs: &[(f64, Vec<Moments>)], sum: f64) -> Moments {
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

/// The 95 % interval of a mixture of normal distributions: share, mean and standard deviation of each.
fn interval(parts: &[(f64, f64, f64)], length_m: f64) -> (f64, f64) {
    let below = |x_m: f64| -> f64 {
        parts.iter().map(|(share, mean, sd)| share * normal_cdf((x_m - mean) / sd)).sum()
    };
    let quantile = |share: f64| bisect((0.0, length_m), 24, |x_m| below(x_m) < share);
    (quantile(0.025), quantile(0.975))
}

#[cfg(test)]
mod tests;
