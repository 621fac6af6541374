//! What is believed of a surface with no, one or two contacts.

use super::bank::Bank;
use super::gaussian::Gaussian;
use super::step::{Step, V, W, X, contact, contacts};
use crate::contact::{Contact, Position};
use crate::method::{ContactFit, Likelihood};

/// A bank of a surface with as many contacts.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "one contact is the rule, and a box would cost it an allocation a reading"
)]
pub(super) enum Belief {
    Nothing(Bank<2, 1>),
    One(Bank<6, 3>),
    Two(Box<Bank<10, 9>>),
}

/// A belief as one Gaussian.
#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "one contact is the rule, and a box would cost it an allocation a reading"
)]
pub(super) enum Mixed {
    Nothing(Gaussian<2>),
    One(Gaussian<6>),
    Two(Gaussian<10>),
}

/// A reading, and what the surface says about it.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub likelihood: &'a dyn Likelihood,
    pub whitened: &'a [f64],
    /// Whether the surface swings.
    pub swings: bool,
}

/// One contact of a belief: mean and variances of position, speed and force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    pub mean: [f64; 3],
    pub variance: [f64; 3],
}

impl Belief {
    /// A surface at rest that nothing touches.
    pub fn nothing() -> Self {
        Self::Nothing(Bank::of(Gaussian::default()))
    }

    /// Becomes the mixture with another belief that nothing touches, whose share is `share`.
    pub fn absorb(&mut self, other: &Self, share: f64) {
        if let (Self::Nothing(own), Self::Nothing(other)) = (self, other) {
            let parts = [(1.0 - share, own.mixed()), (share, other.mixed())];
            *own = Bank::of(Gaussian::mixed(parts.into_iter()));
        }
    }

    pub fn contacts(&self) -> usize {
        match self {
            Self::Nothing(_) => 0,
            Self::One(_) => 1,
            Self::Two(_) => 2,
        }
    }

    /// After a step and before its reading.
    pub fn predicted(&self, step: &Step, likelihood: &dyn Likelihood) -> Self {
        match self {
            Self::Nothing(bank) => Self::Nothing(bank.predicted(step, likelihood)),
            Self::One(bank) => Self::One(bank.predicted(step, likelihood)),
            Self::Two(bank) => Self::Two(Box::new(bank.predicted(step, likelihood))),
        }
    }

    /// After a reading, and the logarithm of how probable it was; `None` where that is too little for numbers.
    pub fn updated(&self, seen: Seen) -> Option<(Self, f64)> {
        let length_m = seen.likelihood.length_m();
        Some(match self {
            Self::Nothing(bank) => {
                let (bank, evidence) = bank.updated(|about| seen.fit_nothing(about), None, length_m)?;
                (Self::Nothing(bank), evidence)
            }
            Self::One(bank) => {
                let (bank, evidence) = bank.updated(|about| seen.fit_one(about), None, length_m)?;
                (Self::One(bank), evidence)
            }
            Self::Two(bank) => {
                let (bank, evidence) = bank.updated(|about| seen.fit_two(about), None, length_m)?;
                (Self::Two(Box::new(bank)), evidence)
            }
        })
    }

    /// What is left when contact `k` lets go; the surface swings on.
    pub fn without(&self, k: usize) -> Option<Self> {
        match self {
            Self::Nothing(_) => None,
            Self::One(bank) => Some(Self::Nothing(bank.without(k))),
            Self::Two(bank) => Some(Self::One(bank.without(k))),
        }
    }

    pub fn mixed(&self) -> Mixed {
        match self {
            Self::Nothing(bank) => Mixed::Nothing(bank.mixed()),
            Self::One(bank) => Mixed::One(bank.mixed()),
            Self::Two(bank) => Mixed::Two(bank.mixed()),
        }
    }

    /// What it was before a step, given what it was `later` after it, if that has as many contacts.
    pub fn smoothed(&self, step: &Step, likelihood: &dyn Likelihood, later: &Self) -> Option<Self> {
        match (self, later) {
            (Self::Nothing(bank), Self::Nothing(later)) => {
                Some(Self::Nothing(bank.smoothed(step, likelihood, later)))
            }
            (Self::One(bank), Self::One(later)) => Some(Self::One(bank.smoothed(step, likelihood, later))),
            (Self::Two(bank), Self::Two(later)) => {
                Some(Self::Two(Box::new(bank.smoothed(step, likelihood, later))))
            }
            _ => None,
        }
    }
}

impl Mixed {
    /// The moments of each contact.
    pub fn contacts(&self) -> Vec<Moments> {
        match self {
            Self::Nothing(belief) => moments(belief),
            Self::One(belief) => moments(belief),
            Self::Two(belief) => moments(belief),
        }
    }
}

impl Moments {
    /// The contact at the mean.
    pub fn contact(&self) -> Contact {
        Contact { position: Position::along(self.mean[0]), force_n: self.mean[2] }
    }

    /// Whether two are of one contact: closer than their own doubt in place, speed and force.
    pub fn is_one_with(&self, other: &Self) -> bool {
        const CLOSE: f64 = 2.0;
        (0..3).all(|i| {
            let doubt = self.variance[i] + other.variance[i];
            (self.mean[i] - other.mean[i]).powi(2) <= CLOSE * CLOSE * doubt
        })
    }
}

impl Seen<'_> {
    fn fit_nothing(&self, about: &[f64; 1]) -> ContactFit<1> {
        self.likelihood.fit_nothing(self.whitened, about[0])
    }

    pub fn fit_one(&self, about: &[f64; 3]) -> ContactFit<3> {
        let [mode_n, x_m, force_n] = *about;
        self.likelihood.fit_one(self.whitened, at(x_m, force_n), self.swings.then_some(mode_n))
    }

    pub fn fit_two(&self, about: &[f64; 5]) -> ContactFit<5> {
        let [mode_n, x_m, force_n, other_m, other_n] = *about;
        let contacts = [at(x_m, force_n), at(other_m, other_n)];
        self.likelihood.fit_two(self.whitened, contacts, self.swings.then_some(mode_n))
    }
}

fn at(x_m: f64, force_n: f64) -> Contact {
    Contact { position: Position::along(x_m), force_n }
}

fn moments<const N: usize>(belief: &Gaussian<N>) -> Vec<Moments> {
    let of = |k: usize| {
        let entries = [X, V, W].map(|i| contact(k) + i);
        Moments {
            mean: entries.map(|i| belief.mean[i]),
            variance: entries.map(|i| belief.covariance[i][i].max(0.0)),
        }
    };
    (0..contacts(N)).map(of).collect()
}
