//! What a tracker answers.

use super::belief::Moments;
use crate::method::Likelihood;
use crate::numerics::{NORMAL_95, normal_distribution};
use palpate_core::Estimate;

/// Below this share of the probability, one hypothesis does not speak for all.
const SURE: f64 = 0.98;

/// What is known at one reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// When the reading was taken, in seconds.
    pub time_s: f64,
    /// The probabilities that nothing touches, that one contact does, and that two do.
    pub numbers: [f64; 3],
    /// The contacts, as many as is most probable. Each keeps its place in the list while it is followed.
    pub contacts: Vec<Tracked>,
    /// What the reading says by itself.
    pub alone: Estimate,
}

/// A contact that is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracked {
    /// Where it is, in metres.
    pub x_m: f64,
    /// How fast it moves, in m/s.
    pub speed_m_per_s: f64,
    /// How hard it presses, in newtons.
    pub force_n: f64,
    /// Standard deviations of the three, the position's with what calibration leaves.
    pub sd: [f64; 3],
    /// The 95 % interval of the position, in metres.
    pub x_95_m: (f64, f64),
}

/// A reading that cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Time does not go on.
    #[error("the reading is of {time_s} s; it must be later than the one before, of {before_s} s")]
    Time {
        /// Its time, in seconds.
        time_s: f64,
        /// The time of the one before.
        before_s: f64,
    },
}

impl Track {
    /// The probability that something touches.
    pub fn touching(&self) -> f64 {
        (self.numbers[1] + self.numbers[2]).clamp(0.0, 1.0)
    }
}

impl Tracked {
    /// The contacts of beliefs with as many of them, each with its weight, the most probable first.
    pub(super) fn all(beliefs: &[(f64, Vec<Moments>)], likelihood: &dyn Likelihood) -> Vec<Self> {
        let Some((weight, best)) = beliefs.first() else { return Vec::new() };
        let mut all = Self::of(best, likelihood);
        let sum: f64 = beliefs.iter().map(|(weight, _)| weight).sum();
        if let ([one], true) = (all.as_mut_slice(), *weight < SURE * sum) {
            let floor_m2 = one.sd[0].powi(2) - best[0].variance[0];
            let parts = beliefs.iter().map(|(weight, contacts)| {
                (weight / sum, contacts[0].mean[0], (contacts[0].variance[0] + floor_m2).sqrt())
            });
            one.x_95_m = interval(&parts.collect::<Vec<_>>(), likelihood.length_m());
        }
        all
    }

    /// The contacts of one belief.
    pub(super) fn of(belief: &[Moments], likelihood: &dyn Likelihood) -> Vec<Self> {
        let contacts: Vec<_> = belief.iter().map(Moments::contact).collect();
        let floors_m2 = likelihood.calibration_m2(&contacts);
        let length_m = likelihood.length_m();
        let tracked = |(moments, floor_m2): (&Moments, f64)| {
            let [x_m, speed_m_per_s, force_n] = moments.mean;
            let [along, speed, force] = moments.variance;
            let sd = [(along + floor_m2).sqrt(), speed.sqrt(), force.sqrt()];
            let half_m = NORMAL_95 * sd[0];
            let x_95_m = ((x_m - half_m).max(0.0), (x_m + half_m).min(length_m));
            Self { x_m, speed_m_per_s, force_n, sd, x_95_m }
        };
        belief.iter().zip(floors_m2).map(tracked).collect()
    }
}

/// The 95 % interval of a mixture of normal distributions: share, mean and standard deviation of each.
fn interval(parts: &[(f64, f64, f64)], length_m: f64) -> (f64, f64) {
    let below = |x_m: f64| -> f64 {
        parts.iter().map(|(share, mean, sd)| share * normal_distribution((x_m - mean) / sd)).sum()
    };
    let quantile = |share: f64| {
        let (mut low, mut high) = (0.0, length_m);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            if below(middle) < share { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    (quantile(0.025), quantile(0.975))
}
