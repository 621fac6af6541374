//! A surface and its contacts under several motions, which mix.

use super::gaussian::Gaussian;
use super::step::{MOTIONS, OF_CONTACT, Step, U, W, X, contact, contacts, motion_of};
use crate::method::{ContactFit, Likelihood};

/// A Gaussian for each choice of motions, with its share of the probability: N numbers of a state, M = 3^C choices for its
/// C contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bank<const N: usize, const M: usize> {
    pub shares: [f64; M],
    pub members: [Gaussian<N>; M],
}

impl<const N: usize, const M: usize> Bank<N, M> {
    /// The same for every motion.
    pub fn of(belief: Gaussian<N>) -> Self {
        Self { shares: [1.0 / M as f64; M], members: [belief; M] }
    }

    /// All of it as one Gaussian.
    pub fn mixed(&self) -> Gaussian<N> {
        Gaussian::mixed(self.shares.iter().copied().zip(self.members))
    }

    /// After a step and before its reading.
    pub fn predicted(&self, step: &Step, likelihood: &dyn Likelihood) -> Self {
        let mut shares = [0.0; M];
        let members = std::array::from_fn(|to| {
            let joint: [f64; M] =
                std::array::from_fn(|from| step.passes(contacts(N), from, to) * self.shares[from]);
            shares[to] = joint.iter().sum();
            let parts = joint.iter().map(|joint| joint / shares[to]).zip(self.members);
            let belief = Gaussian::mixed(parts);
            let motions = |k: usize| step.motion(motion_of(to, k));
            belief.predicted(&step.change(&belief, motions, likelihood))
        });
        Self { shares, members }
    }

    /// After a reading; and the logarithm of how probable it was. The misfit is expanded about `start`, or else the mean,
    /// and again about where that leads if it leads farther than the reading itself can tell.
    ///
    /// The unknowns are u, then place and force of each contact: K = 1 + 2·C.
    pub fn updated<const K: usize>(
        &self,
        expand: impl Fn(&[f64; K]) -> ContactFit<K>,
        start: Option<[f64; K]>,
        length_m: f64,
    ) -> Option<(Self, f64)> {
        const MOST_ROUNDS: usize = 3;
        let mut about = start.unwrap_or_else(|| held(self.seen(), length_m));
        let mut round = 1;
        loop {
            let fit = expand(&about);
            let (after, evidence) = self.updated_about(&fit, &about)?;
            let next = held(after.seen(), length_m);
            let moved = (1..K).step_by(2).map(|k| fit.information[k][k] * (next[k] - about[k]).powi(2));
            if moved.sum::<f64>() < 0.1 || round == MOST_ROUNDS {
                return Some((after.held_to(length_m), evidence));
            }
            (about, round) = (next, round + 1);
        }
    }

    /// What it was before a step, given that it was `later` after it and its reading.
    ///
    /// What came later says of the state before, whatever motion it was under, L_j = N_j(x | all)/N_j(x | so far), where
    /// N_j, of motion j in the step, is from Rauch, Tung and Striebel's recursion on the mixture that motion j began with. Each
    /// member is moved and weighed by L_j as by a reading, so that a variance never grows.
    pub fn smoothed(&self, step: &Step, likelihood: &dyn Likelihood, later: &Self) -> Self {
        let mut weights = [[0.0; M]; M];
        let mut before = [[Gaussian::default(); M]; M];
        for to in 0..M {
            let joint: [f64; M] =
                std::array::from_fn(|from| step.passes(contacts(N), from, to) * self.shares[from]);
            let sum: f64 = joint.iter().sum();
            let began = Gaussian::mixed(joint.iter().map(|joint| joint / sum).zip(self.members));
            let motions = |k: usize| step.motion(motion_of(to, k));
            let whole = began.smoothed(&step.change(&began, motions, likelihood), &later.members[to]);
            let (fit, about) = whole.less(&began);
            let results: [(Gaussian<N>, f64); M] =
                self.members.map(|member| member.updated(&fit, &about, &std::array::from_fn(|i| i)));
            let best = results.iter().map(|(_, evidence)| *evidence).fold(f64::NEG_INFINITY, f64::max);
            let shares: [f64; M] = std::array::from_fn(|from| joint[from] * (results[from].1 - best).exp());
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

    /// Without contact `k`: the bank of those that stay.
    pub fn without<const N2: usize, const M2: usize>(&self, k: usize) -> Bank<N2, M2> {
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

    /// With one contact more, the last; the surface then swings as `joined` makes of it.
    pub fn with<const N2: usize, const M2: usize>(
        &self,
        joined: impl Fn(&Gaussian<N>) -> Gaussian<N2>,
    ) -> Bank<N2, M2> {
        Bank {
            shares: std::array::from_fn(|to| self.shares[to % M] / MOTIONS as f64),
            members: std::array::from_fn(|to| joined(&self.members[to % M])),
        }
    }

    fn seen<const K: usize>(&self) -> [f64; K] {
        let mut seen = [0.0; K];
        for (share, member) in self.shares.iter().zip(&self.members) {
            seen.iter_mut().zip(entries::<K>()).for_each(|(seen, entry)| *seen += share * member.mean[entry]);
        }
        seen
    }

    /// `None` where the reading is too improbable for numbers.
    fn updated_about<const K: usize>(&self, fit: &ContactFit<K>, about: &[f64; K]) -> Option<(Self, f64)> {
        let entries = entries::<K>();
        let results: [(Gaussian<N>, f64); M] =
            self.members.map(|member| member.updated(fit, about, &entries));
        let best = results.iter().map(|(_, evidence)| *evidence).fold(f64::NEG_INFINITY, f64::max);
        if !best.is_finite() {
            return None;
        }
        let weights: [f64; M] = std::array::from_fn(|i| self.shares[i] * (results[i].1 - best).exp());
        let sum: f64 = weights.iter().sum();
        let after =
            Self { shares: weights.map(|weight| weight / sum), members: results.map(|(member, _)| member) };
        (sum > 0.0).then(|| (after, best + sum.ln()))
    }

    /// With positions on the surface and forces that press.
    fn held_to(mut self, length_m: f64) -> Self {
        for member in &mut self.members {
            for at in (0..contacts(N)).map(contact) {
                member.mean[at + X] = member.mean[at + X].clamp(0.0, length_m);
                member.mean[at + W] = member.mean[at + W].max(0.0);
            }
        }
        self
    }
}

/// Unknowns with places on the surface and forces that press.
fn held<const K: usize>(mut unknowns: [f64; K], length_m: f64) -> [f64; K] {
    for (k, unknown) in unknowns.iter_mut().enumerate().skip(1) {
        *unknown = if k % 2 == 1 { unknown.clamp(0.0, length_m) } else { unknown.max(0.0) };
    }
    unknowns
}

/// Which entries of a state the unknowns of a fit are.
fn entries<const K: usize>() -> [usize; K] {
    std::array::from_fn(|k| match k {
        0 => U,
        k if k % 2 == 1 => contact(k / 2) + X,
        k => contact(k / 2 - 1) + W,
    })
}
