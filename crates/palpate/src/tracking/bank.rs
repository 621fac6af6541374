//! One contact under several motions, which mix.

use super::config::TrackerConfig;
use super::gaussian::{Gaussian, Motion, V, W, X};
use crate::contact::{Contact, Position};
use crate::method::{ContactFit, Likelihood};

/// Motions of a contact.
pub(super) const MOTIONS: usize = 3;

/// A Gaussian for each motion, with its share of the probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bank {
    pub shares: [f64; MOTIONS],
    pub members: [Gaussian; MOTIONS],
}

/// A time step, as the motions see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub motions: [Motion; MOTIONS],
    /// The probability that a motion lasts through the step; the others share the rest.
    pub lasts: f64,
}

impl Step {
    /// A step of a contact with a force; `drifts` where the force is not known.
    pub fn new(config: &TrackerConfig, duration_s: f64, force_n: f64, drifts: bool) -> Self {
        let drift = if drifts { (config.force_drift * force_n).powi(2) * duration_s } else { 0.0 };
        let motion = |sd: f64| Motion::new(duration_s, config.acceleration_s, sd, drift);
        Self {
            motions: config.accelerations_m_per_s2.map(motion),
            lasts: (-duration_s / config.motion_s).exp(),
        }
    }

    /// The probability that motion `from` becomes motion `to`.
    pub fn passes(&self, from: usize, to: usize) -> f64 {
        if from == to { self.lasts } else { (1.0 - self.lasts) / (MOTIONS - 1) as f64 }
    }
}

impl Bank {
    /// The same for every motion.
    pub fn of(belief: Gaussian) -> Self {
        Self { shares: [1.0 / MOTIONS as f64; MOTIONS], members: [belief; MOTIONS] }
    }

    /// All of it as one Gaussian.
    pub fn mixed(&self) -> Gaussian {
        Gaussian::mixed(self.shares.iter().copied().zip(self.members))
    }

    /// After a step and before its reading.
    pub fn predicted(&self, step: &Step) -> Self {
        let mut shares = [0.0; MOTIONS];
        let members = std::array::from_fn(|to| {
            let share = |from: usize| step.passes(from, to) * self.shares[from];
            shares[to] = (0..MOTIONS).map(share).sum();
            let parts = (0..MOTIONS).map(|from| (share(from) / shares[to], self.members[from]));
            Gaussian::mixed(parts).predicted(&step.motions[to])
        });
        Self { shares, members }
    }

    /// After a reading; and the logarithm of how probable it was. The misfit is expanded about the mean, and once more about
    /// where that leads if it leads farther than the reading itself can tell.
    ///
    /// `inertia_s2` is 1/ω² of the surface's first natural frequency. The surface lags behind its static shape by that
    /// shape's acceleration over ω²: by f′·v̇ as if the contact were elsewhere, and by f″·v².
    pub fn updated(
        &self,
        likelihood: &dyn Likelihood,
        whitened: &[f64],
        inertia_s2: f64,
    ) -> Option<(Self, ContactFit, f64)> {
        const MOST_ROUNDS: usize = 3;
        let length_m = likelihood.length_m();
        let seen = |belief: &Gaussian| {
            let [x_m, force_n] = belief.seen(inertia_s2);
            [x_m.clamp(0.0, length_m), force_n.max(0.0)]
        };
        let before = self.mixed();
        let inertia_m2 = inertia_s2 * before.mean[V].powi(2);
        let mut about = seen(&before);
        let mut round = 1;
        loop {
            let contact = Contact { position: Position::along(about[0]), force_n: about[1] };
            let fit = likelihood.fit_at(whitened, contact, inertia_m2);
            let (after, evidence) = self.updated_about(&fit, about, inertia_s2)?;
            let next = seen(&after.mixed());
            let moved = fit.information[0] * (next[0] - about[0]).powi(2);
            if moved < 0.1 || round == MOST_ROUNDS {
                return Some((after.held_to(length_m), fit, evidence));
            }
            (about, round) = (next, round + 1);
        }
    }

    /// `None` where the reading is too improbable for numbers.
    fn updated_about(&self, fit: &ContactFit, about: [f64; 2], inertia_s2: f64) -> Option<(Self, f64)> {
        let results: [(Gaussian, f64); MOTIONS] =
            self.members.map(|member| member.updated(fit, about, inertia_s2));
        let best = results.iter().map(|(_, evidence)| *evidence).fold(f64::NEG_INFINITY, f64::max);
        if !best.is_finite() {
            return None;
        }
        let weights: [f64; MOTIONS] = std::array::from_fn(|i| self.shares[i] * (results[i].1 - best).exp());
        let sum: f64 = weights.iter().sum();
        let after =
            Self { shares: weights.map(|weight| weight / sum), members: results.map(|(member, _)| member) };
        (sum > 0.0).then(|| (after, best + sum.ln()))
    }

    /// With positions on the surface and forces that press.
    fn held_to(mut self, length_m: f64) -> Self {
        for member in &mut self.members {
            member.mean[X] = member.mean[X].clamp(0.0, length_m);
            member.mean[W] = member.mean[W].max(0.0);
        }
        self
    }
}
