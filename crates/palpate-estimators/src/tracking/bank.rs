//! A surface and its contacts under several motions, which mix.

use super::gaussian::{Change, Gaussian};
use super::step::{MOTIONS, OF_CONTACT, contact};
use crate::likelihood::ContactFit;

/// What a step of time does to the M members of a bank, states of N numbers.
pub(super) trait Dynamics<const N: usize, const M: usize> {
    /// The probability that member `from` becomes member `to`.
    fn passes(&self, from: usize, to: usize) -> f64;

    /// What the step does to a belief that moves as member `member` says.
    fn change(&self, belief: &Gaussian<N>, member: usize) -> Change<N>;
}

/// The K numbers of a state that a reading sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SeenNumbers<const K: usize> {
    /// Which entries of the state they are.
    pub entries: [usize; K],
    /// The least and the greatest that each can be: places lie on the surface, forces press.
    pub bounds: [(f64, f64); K],
    /// Which of them are places.
    pub is_place: [bool; K],
}

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
    pub fn predicted(&self, dynamics: &impl Dynamics<N, M>) -> Self {
        let mut shares = [0.0; M];
        let members = std::array::from_fn(|to| {
            let joint: [f64; M] = std::array::from_fn(|from| dynamics.passes(from, to) * self.shares[from]);
            shares[to] = joint.iter().sum();
            let parts = joint.iter().map(|joint| joint / shares[to]).zip(self.members);
            let belief = Gaussian::mixed(parts);
            belief.predicted(&dynamics.change(&belief, to))
        });
        Self { shares, members }
    }

    /// After a reading; and the logarithm of how probable it was. The misfit is expanded about `start`, or else the mean,
    /// and again about where that leads if it leads farther than the reading itself can tell.
    pub fn updated<const K: usize>(
        &self,
        numbers: &SeenNumbers<K>,
        expand: impl Fn(&[f64; K]) -> ContactFit<K>,
        start: Option<[f64; K]>,
    ) -> Option<(Self, f64)> {
        const MOST_ROUNDS: usize = 3;
        let mut about = start.unwrap_or_else(|| self.seen(numbers));
        let mut round = 1;
        loop {
            let fit = expand(&about);
            let (after, evidence) = self.updated_about(numbers, &fit, &about)?;
            let next = after.seen(numbers);
            let places = (0..K).filter(|k| numbers.is_place[*k]);
            let moved = places.map(|k| fit.information[k][k] * (next[k] - about[k]).powi(2));
            if moved.sum::<f64>() < 0.1 || round == MOST_ROUNDS {
                return Some((after.held(numbers), evidence));
            }
            (about, round) = (next, round + 1);
        }
    }

    /// What it was before a step, given that it was `later` after it and its reading.
    ///
    /// What came later says of the state before, whatever motion it was under, L_j = N_j(x | all)/N_j(x | so far), where
    /// N_j, of motion j in the step, is from Rauch, Tung and Striebel's recursion on the mixture that motion j began with. Each
    /// member is moved and weighed by L_j as by a reading, so that a variance never grows.
    pub fn smoothed(&self, dynamics: &impl Dynamics<N, M>, later: &Self) -> Self {
        let mut weights = [[0.0; M]; M];
        let mut before = [[Gaussian::default(); M]; M];
        for to in 0..M {
            let joint: [f64; M] = std::array::from_fn(|from| dynamics.passes(from, to) * self.shares[from]);
            let sum: f64 = joint.iter().sum();
            let began = Gaussian::mixed(joint.iter().map(|joint| joint / sum).zip(self.members));
            let whole = began.smoothed(&dynamics.change(&began, to), &later.members[to]);
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

    /// What is believed of the numbers that a reading sees, held to their bounds.
    fn seen<const K: usize>(&self, numbers: &SeenNumbers<K>) -> [f64; K] {
        let mut seen = [0.0; K];
        for (share, member) in self.shares.iter().zip(&self.members) {
            seen.iter_mut()
                .zip(numbers.entries)
                .for_each(|(seen, entry)| *seen += share * member.mean[entry]);
        }
        std::array::from_fn(|k| numbers.held(k, seen[k]))
    }

    /// `None` where the reading is too improbable for numbers.
    fn updated_about<const K: usize>(
        &self,
        numbers: &SeenNumbers<K>,
        fit: &ContactFit<K>,
        about: &[f64; K],
    ) -> Option<(Self, f64)> {
        let results: [(Gaussian<N>, f64); M] =
            self.members.map(|member| member.updated(fit, about, &numbers.entries));
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

    /// With all that a reading sees within its bounds.
    fn held<const K: usize>(mut self, numbers: &SeenNumbers<K>) -> Self {
        for member in &mut self.members {
            for (k, entry) in numbers.entries.into_iter().enumerate() {
                member.mean[entry] = numbers.held(k, member.mean[entry]);
            }
        }
        self
    }
}

impl<const K: usize> SeenNumbers<K> {
    fn held(&self, k: usize, value: f64) -> f64 {
        let (least, most) = self.bounds[k];
        value.max(least).min(most)
    }
}
