//! Banks of Gaussians, one per combination of motions.
//!
//! The state on a line is (u, u̇), then (x, v, v̇, W) per contact. u = m·ω²·q is the force of the first mode
//! with shape φ: ü + 2ζω·u̇ + ω²·u = ω²·Σ W·φ(x). In balance, u = 0 without variance.

use super::TrackerConfig;
use super::gaussian::{Gaussian, Transition};
use crate::likelihood::{ContactFit, Geometry, LineLikelihood};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::surface::modal::Oscillator;
use palpate_numerics::normal_between;
use palpate_numerics::small::Matrix;
use std::f64::consts::PI;

/// M members with N states over a time step.
pub(super) trait Dynamics<const N: usize, const M: usize> {
    fn transition_probability(&self, from: usize, to: usize) -> f64;

    fn transition(&self, belief: &Gaussian<N>, member: usize) -> Transition<N>;
}

/// Observed state entries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ObservedEntries<const K: usize> {
    pub entries: [usize; K],
    /// Ranges of positions and pressing forces.
    pub bounds: [(f64, f64); K],
    pub is_place: [bool; K],
}

/// M = 3^C Gaussians for the motions of C contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bank<const N: usize, const M: usize> {
    pub shares: [f64; M],
    pub members: [Gaussian<N>; M],
}

impl<const N: usize, const M: usize> Bank<N, M> {
    pub fn uniform(belief: Gaussian<N>) -> Self {
        Self { shares: [1.0 / M as f64; M], members: [belief; M] }
    }

    pub fn mixed(&self) -> Gaussian<N> {
        Gaussian::mixed(self.shares.iter().copied().zip(self.members))
    }

    pub fn predicted(&self, dynamics: &impl Dynamics<N, M>) -> Self {
        let mut shares = [0.0; M];
        let members = std::array::from_fn(|to| {
            let joint: [f64; M] =
                std::array::from_fn(|from| dynamics.transition_probability(from, to) * self.shares[from]);
            shares[to] = joint.iter().sum();
            let parts = joint.iter().map(|joint| joint / shares[to]).zip(self.members);
            let belief = Gaussian::mixed(parts);
            belief.predicted(&dynamics.transition(&belief, to))
        });
        Self { shares, members }
    }

    /// Updates by a reading, expanded about `start` or the mean, and again about the updated mean if it moved
    /// far; returns the log probability.
    pub fn updated<const K: usize>(
        &self,
        observed: &ObservedEntries<K>,
        expand: impl Fn(&[f64; K]) -> ContactFit<K>,
        start: Option<[f64; K]>,
    ) -> Option<(Self, f64)> {
        const MOST_ROUNDS: usize = 3;
        let mut about = start.unwrap_or_else(|| self.observed_mean(observed));
        let mut round = 1;
        loop {
            let fit = expand(&about);
            let (after, evidence) = self.updated_about(observed, &fit, &about)?;
            let next = after.observed_mean(observed);
            let places = (0..K).filter(|k| observed.is_place[*k]);
            let moved = places.map(|k| fit.information[k][k] * (next[k] - about[k]).powi(2));
            if moved.sum::<f64>() < 0.1 || round == MOST_ROUNDS {
                return Some((after.clamp_members(observed), evidence));
            }
            (about, round) = (next, round + 1);
        }
    }

    /// Given `later` after a step, later readings have the likelihood L_j = N_j(x | all)/N_j(x | so far),
    /// with N_j of motion j by the Rauch–Tung–Striebel recursion on the mixture from which j began. L_j
    /// updates each member as a reading, so that variances never increase.
    pub fn smoothed(&self, dynamics: &impl Dynamics<N, M>, later: &Self) -> Self {
        let mut weights = [[0.0; M]; M];
        let mut before = [[Gaussian::default(); M]; M];
        for to in 0..M {
            let joint: [f64; M] =
                std::array::from_fn(|from| dynamics.transition_probability(from, to) * self.shares[from]);
            let sum: f64 = joint.iter().sum();
            let began = Gaussian::mixed(joint.iter().map(|joint| joint / sum).zip(self.members));
            let whole = began.smoothed(&dynamics.transition(&began, to), &later.members[to]);
            let (fit, about) = whole.information_beyond(&began);
            let results: [(Gaussian<N>, f64); M] =
                self.members.map(|member| member.updated(&fit, &about, &std::array::from_fn(|i| i)));
            let (_, shares) = reweighted(&joint, &results);
            let all: f64 = shares.iter().sum();
            for from in 0..M {
                let share = if all > 0.0 { shares[from] / all } else { joint[from] / sum };
                weights[from][to] = later.shares[to] * share;
                before[from][to] = results[from].0;
            }
        }
        let shares = weights.map(|row| row.iter().sum::<f64>());
        let members = std::array::from_fn(|from| {
            let share = shares[from];
            if share > 0.0 {
                let parts = weights[from].iter().map(|weight| weight / share);
                Gaussian::mixed(parts.zip(before[from]))
            } else {
                self.members[from]
            }
        });
        Self { shares, members }
    }

    pub fn without_contact<const N2: usize, const M2: usize>(&self, k: usize) -> Bank<N2, M2> {
        let below = MOTIONS.pow(k as u32);
        let stay = |i: usize| if i < contact(k) { i } else { i + OF_CONTACT };
        let mut shares = [0.0; M2];
        let members = std::array::from_fn(|to| {
            let of = |motion: usize| to % below + below * (motion + MOTIONS * (to / below));
            shares[to] = (0..MOTIONS).map(|motion| self.shares[of(motion)]).sum();
            let share = shares[to];
            let parts = (0..MOTIONS).map(|motion| {
                let member = &self.members[of(motion)];
                let part = Gaussian {
                    mean: std::array::from_fn(|i| member.mean[stay(i)]),
                    covariance: std::array::from_fn(|i| {
                        std::array::from_fn(|j| member.covariance[stay(i)][stay(j)])
                    }),
                };
                (self.shares[of(motion)] / share.max(f64::MIN_POSITIVE), part)
            });
            Gaussian::mixed(parts)
        });
        Bank { shares, members }
    }

    pub fn with_contact<const N2: usize, const M2: usize>(
        &self,
        joined: impl Fn(&Gaussian<N>) -> Gaussian<N2>,
    ) -> Bank<N2, M2> {
        Bank {
            shares: std::array::from_fn(|to| self.shares[to % M] / MOTIONS as f64),
            members: std::array::from_fn(|to| joined(&self.members[to % M])),
        }
    }

    fn observed_mean<const K: usize>(&self, observed: &ObservedEntries<K>) -> [f64; K] {
        let mut mean = [0.0; K];
        for (share, member) in self.shares.iter().zip(&self.members) {
            mean.iter_mut()
                .zip(observed.entries)
                .for_each(|(mean, entry)| *mean += share * member.mean[entry]);
        }
        std::array::from_fn(|k| observed.clamp(k, mean[k]))
    }

    /// `None` on underflow.
    fn updated_about<const K: usize>(
        &self,
        observed: &ObservedEntries<K>,
        fit: &ContactFit<K>,
        about: &[f64; K],
    ) -> Option<(Self, f64)> {
        let results: [(Gaussian<N>, f64); M] = self.members.map(|member| {
            let (after, evidence) = member.updated(fit, about, &observed.entries);
            // The evidence of a normal distribution truncated at bounds is that of the whole one, times its
            // share within the bounds after the reading over that before.
            let shares = observed.log_share_of_forces(&after) - observed.log_share_of_forces(&member);
            (after, evidence + shares)
        });
        let (best, weights) = reweighted(&self.shares, &results);
        let sum: f64 = weights.iter().sum();
        let after =
            Self { shares: weights.map(|weight| weight / sum), members: results.map(|(member, _)| member) };
        (best.is_finite() && sum > 0.0).then(|| (after, best + sum.ln()))
    }

    fn clamp_members<const K: usize>(mut self, observed: &ObservedEntries<K>) -> Self {
        for member in &mut self.members {
            for (k, entry) in observed.entries.into_iter().enumerate() {
                member.mean[entry] = observed.clamp(k, member.mean[entry]);
            }
        }
        self
    }
}

/// Greatest evidence and reweighted shares.
fn reweighted<const N: usize, const M: usize>(
    shares: &[f64; M],
    results: &[(Gaussian<N>, f64); M],
) -> (f64, [f64; M]) {
    let best = results.iter().map(|(_, evidence)| *evidence).fold(f64::NEG_INFINITY, f64::max);
    (best, std::array::from_fn(|i| shares[i] * (results[i].1 - best).exp()))
}

impl<const K: usize> ObservedEntries<K> {
    /// ln of the probability within force bounds.
    fn log_share_of_forces<const N: usize>(&self, belief: &Gaussian<N>) -> f64 {
        let of_entry = |(k, entry): (usize, usize)| {
            let (least, most) = self.bounds[k];
            let variance = belief.covariance[entry][entry];
            if self.is_place[k] || least == f64::NEG_INFINITY || variance <= 0.0 {
                return 0.0;
            }
            let (mean, sd) = (belief.mean[entry], variance.sqrt());
            normal_between((least - mean) / sd, (most - mean) / sd).ln_share
        };
        self.entries.into_iter().enumerate().map(of_entry).sum()
    }

    fn clamp(&self, k: usize, value: f64) -> f64 {
        let (least, most) = self.bounds[k];
        value.max(least).min(most)
    }
}

/// First mode's force and rate.
pub(super) const U: usize = 0;
pub(super) const U_RATE: usize = 1;
/// Entries within a contact.
pub(super) const X: usize = 0;
pub(super) const V: usize = 1;
pub(super) const A: usize = 2;
pub(super) const W: usize = 3;
const OF_MOTION: usize = 3;
pub(super) const OF_CONTACT: usize = 4;

const MOTIONS: usize = 3;

pub(super) const fn contact(k: usize) -> usize {
    2 + OF_CONTACT * k
}

pub(super) const fn contacts(numbers: usize) -> usize {
    (numbers - 2) / OF_CONTACT
}

/// u, then position and force of each contact.
pub(super) fn observed_on_line<const K: usize>(range_m: (f64, f64), greatest_n: f64) -> ObservedEntries<K> {
    ObservedEntries {
        entries: std::array::from_fn(|k| match k {
            0 => U,
            k if k % 2 == 1 => contact(k / 2) + X,
            k => contact(k / 2 - 1) + W,
        }),
        bounds: std::array::from_fn(|k| match k {
            0 => (f64::NEG_INFINITY, f64::INFINITY),
            k if k % 2 == 1 => range_m,
            _ => (0.0, greatest_n),
        }),
        is_place: std::array::from_fn(|k| k % 2 == 1),
    }
}

/// Digit `k` to the base 3.
const fn motion_of(member: usize, k: usize) -> usize {
    member / MOTIONS.pow(k as u32) % MOTIONS
}

/// Time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    duration_s: f64,
    motions: [Motion; MOTIONS],
    /// Probability that a motion lasts.
    lasts: f64,
    /// Relative variance of an unknown force.
    drift: f64,
    swing: Option<FreeSwing>,
}

/// Vibration of (u, u̇), and variance of u̇ over the squared force.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FreeSwing {
    free: [[f64; 2]; 2],
    noise: f64,
}

impl Step {
    pub fn new(config: &TrackerConfig, duration_s: f64, forces_known: bool) -> Self {
        let motion = |sd: f64| Motion::new(duration_s, config.acceleration_s, sd);
        Self {
            duration_s,
            motions: config.accelerations_m_per_s2.map(motion),
            lasts: (-duration_s / config.motion_s).exp(),
            drift: if forces_known { 0.0 } else { config.force_drift.powi(2) * duration_s },
            swing: config.swing.map(|swing| {
                let omega = 2.0 * PI * swing.frequency_hz;
                FreeSwing {
                    free: Oscillator::new(omega, swing.damping_ratio, duration_s).free(),
                    // White noise that sustains a damped oscillator at the standard deviation EXCITATION.
                    noise: 4.0 * swing.damping_ratio * omega.powi(3) * EXCITATION * EXCITATION * duration_s,
                }
            }),
        }
    }

    pub fn transition_probability(&self, contacts: usize, from: usize, to: usize) -> f64 {
        let passes = |k: usize| {
            let stays = motion_of(from, k) == motion_of(to, k);
            if stays { self.lasts } else { (1.0 - self.lasts) / (MOTIONS - 1) as f64 }
        };
        (0..contacts).map(passes).product()
    }

    pub fn motion(&self, number: usize) -> &Motion {
        &self.motions[number]
    }

    pub fn drift_n2(&self, force_n: f64) -> f64 {
        self.drift * force_n.powi(2)
    }
}

#[derive(Clone, Copy)]
pub(super) struct LineDynamics<'a> {
    step: &'a Step,
    likelihood: &'a dyn LineLikelihood,
}

impl<'a> LineDynamics<'a> {
    /// `None` on a plane.
    pub fn new(step: &'a Step, geometry: Geometry<'a>) -> Option<Self> {
        match geometry {
            Geometry::Line(likelihood) => Some(Self { step, likelihood }),
            Geometry::Plane(_) => None,
        }
    }
}

impl<const N: usize, const M: usize> Dynamics<N, M> for LineDynamics<'_> {
    fn transition_probability(&self, from: usize, to: usize) -> f64 {
        self.step.transition_probability(contacts(N), from, to)
    }

    fn transition(&self, belief: &Gaussian<N>, member: usize) -> Transition<N> {
        let mut transition = Transition::identity(belief);
        for k in 0..contacts(N) {
            let at = contact(k);
            self.step.motion(motion_of(member, k)).move_along(at, belief, &mut transition);
            transition.noise[at + W][at + W] = self.step.drift_n2(belief.mean[at + W]);
        }
        if let Some(swing) = &self.step.swing {
            self.swing(swing, belief, &mut transition);
        }
        transition
    }
}

impl LineDynamics<'_> {
    /// (u − p, u̇) vibrates freely, with balance p at half of the step.
    fn swing<const N: usize>(&self, swing: &FreeSwing, belief: &Gaussian<N>, transition: &mut Transition<N>) {
        let half_s = 0.5 * self.step.duration_s;
        let ([[uu, us], [su, ss]], mean) = (swing.free, &belief.mean);
        let follows = [(U, 1.0 - uu), (U_RATE, -su)];
        let (mut balance_n, mut force_n) = (0.0, 0.0);
        for k in 0..contacts(N) {
            let at = contact(k);
            let halfway_m = mean[at + X] + half_s * (mean[at + V] + 0.5 * half_s * mean[at + A]);
            let ([shape, slope], own_n) = (self.likelihood.first_mode(halfway_m), mean[at + W]);
            balance_n += own_n * shape;
            force_n += own_n;
            for (row, share) in follows {
                let along = share * own_n * slope;
                transition.forward[row][at + X] = along;
                transition.forward[row][at + V] = along * half_s;
                transition.forward[row][at + A] = 0.5 * along * half_s * half_s;
                transition.forward[row][at + W] = share * shape;
            }
        }
        let (away_n, rate) = (mean[U] - balance_n, mean[U_RATE]);
        transition.mean[U] = balance_n + uu * away_n + us * rate;
        transition.mean[U_RATE] = su * away_n + ss * rate;
        transition.forward[U][U] = uu;
        transition.forward[U][U_RATE] = us;
        transition.forward[U_RATE][U] = su;
        transition.forward[U_RATE][U_RATE] = ss;
        transition.noise[U_RATE][U_RATE] = swing.noise * force_n * force_n;
    }
}

/// Sustained first-mode force over the contacts' force: real presses fluctuate.
const EXCITATION: f64 = 1e-4;

/// F and Q of position, speed and acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    forward: Matrix<3>,
    noise: Matrix<3>,
}

impl Motion {
    /// Writes the entries from `at`.
    pub fn move_along<const N: usize>(
        &self,
        at: usize,
        belief: &Gaussian<N>,
        transition: &mut Transition<N>,
    ) {
        for i in 0..OF_MOTION {
            for j in 0..OF_MOTION {
                transition.forward[at + i][at + j] = self.forward[i][j];
                transition.noise[at + i][at + j] = self.noise[i][j];
            }
            transition.mean[at + i] = (0..OF_MOTION).map(|j| self.forward[i][j] * belief.mean[at + j]).sum();
        }
    }

    /// Singer model of acceleration (R. Singer, IEEE Trans. Aerosp. Electron. Syst. 6, 1970).
    fn new(duration_s: f64, lasts_s: f64, sd: f64) -> Self {
        let (t, u) = (duration_s, duration_s / lasts_s);
        let e = (-u).exp();
        let forward =
            [[1.0, t, lasts_s * lasts_s * (u - 1.0 + e)], [0.0, 1.0, lasts_s * (1.0 - e)], [0.0, 0.0, e]];
        let mut noise = [[0.0; 3]; 3];
        let mut set = |i: usize, j: usize, value: f64| {
            noise[i][j] = value * sd * sd * lasts_s.powi(4 - i as i32 - j as i32);
            noise[j][i] = noise[i][j];
        };
        if u < 0.05 {
            // Series of the closed form, which would lose digits.
            set(X, X, u.powi(5) / 10.0);
            set(X, V, u.powi(4) / 4.0);
            set(X, A, u.powi(3) / 3.0);
            set(V, V, 2.0 * u.powi(3) / 3.0);
            set(V, A, u * u);
            set(A, A, 2.0 * u);
        } else {
            let ee = e * e;
            set(X, X, 1.0 - ee + 2.0 * u + 2.0 * u.powi(3) / 3.0 - 2.0 * u * u - 4.0 * u * e);
            set(X, V, ee + 1.0 - 2.0 * e + 2.0 * u * e - 2.0 * u + u * u);
            set(X, A, 1.0 - ee - 2.0 * u * e);
            set(V, V, 4.0 * e - 3.0 - ee + 2.0 * u);
            set(V, A, ee + 1.0 - 2.0 * e);
            set(A, A, 1.0 - ee);
        }
        Self { forward, noise }
    }
}

/// (x, v_x, v̇_x, y, v_y, v̇_y, W), with independent motions, in balance.
pub(super) const PLANE_NUMBERS: usize = 7;
/// First entries along and across, and force.
pub(super) const ALONG: usize = 0;
pub(super) const ACROSS: usize = 3;
pub(super) const FORCE: usize = 6;

pub(super) fn observed_on_plane([along_m, across_m]: [(f64, f64); 2], greatest_n: f64) -> ObservedEntries<3> {
    ObservedEntries {
        entries: [ALONG, ACROSS, FORCE],
        bounds: [along_m, across_m, (0.0, greatest_n)],
        is_place: [true, true, false],
    }
}

#[derive(Clone, Copy)]
pub(super) struct PlaneDynamics<'a>(pub &'a Step);

impl Dynamics<PLANE_NUMBERS, MOTIONS> for PlaneDynamics<'_> {
    fn transition_probability(&self, from: usize, to: usize) -> f64 {
        self.0.transition_probability(1, from, to)
    }

    fn transition(&self, belief: &Gaussian<PLANE_NUMBERS>, member: usize) -> Transition<PLANE_NUMBERS> {
        let mut transition = Transition::identity(belief);
        let motion = self.0.motion(motion_of(member, 0));
        motion.move_along(ALONG, belief, &mut transition);
        motion.move_along(ACROSS, belief, &mut transition);
        transition.noise[FORCE][FORCE] = self.0.drift_n2(belief.mean[FORCE]);
        transition
    }
}

/// In metres; width 0 on a line.
pub(super) fn sides_m(extent: Extent) -> [f64; 2] {
    [extent.length_m(), extent.width_m().unwrap_or(0.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_of_two_halves_is_the_whole_motion() {
        let belief = Gaussian {
            mean: [0.2, 0.5, 1.0],
            covariance: [[4e-6, 1e-6, 1e-5], [1e-6, 1e-2, 1e-3], [1e-5, 1e-3, 4.0]],
        };
        // On both sides of the switch from the closed form to the series.
        for duration_s in [0.2, 9e-3] {
            let moved = |belief: &Gaussian<3>, share: f64| {
                let Motion { forward, noise } = Motion::new(share * duration_s, 0.1, 2.0);
                let mean = std::array::from_fn(|i| (0..3).map(|j| forward[i][j] * belief.mean[j]).sum());
                belief.predicted(&Transition { mean, forward, noise })
            };
            let halves = moved(&moved(&belief, 0.5), 0.5);
            let whole = moved(&belief, 1.0);
            let noise = Motion::new(duration_s, 0.1, 2.0).noise;
            for (i, noise) in noise.iter().enumerate() {
                let rounded = 1e-9 + if duration_s < 0.1 { 0.05 } else { 0.0 };
                assert!((halves.mean[i] - whole.mean[i]).abs() < 1e-12);
                let off = (halves.covariance[i][i] - whole.covariance[i][i]).abs();
                assert!(off <= rounded * noise[i] + 1e-12 * whole.covariance[i][i], "{i}: {off}");
            }
        }
    }
}
