//! Beliefs with up to two contacts.

use super::bank::{
    ACROSS, ALONG, Bank, FORCE, LineDynamics, ObservedEntries, PLANE_NUMBERS, PlaneDynamics, Step, V, W, X,
    contact, contacts, observed_on_line, observed_on_plane,
};
use super::gaussian::Gaussian;
use crate::likelihood::{ContactFit, Geometry, Likelihood, LineLikelihood, PlaneLikelihood};
use palpate_mechanics::contact::{Contact, Position};

#[derive(Clone, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "one contact is the rule, and a box would cost it an allocation a reading"
)]
pub(super) enum Belief {
    Nothing(Bank<2, 1>),
    One(Bank<6, 3>),
    Two(Box<Bank<10, 9>>),
    OnPlane(Box<Bank<PLANE_NUMBERS, 3>>),
}

#[derive(Clone, Copy)]
pub(super) struct Observation<'a> {
    pub likelihood: &'a dyn Likelihood,
    pub whitened: &'a [f64],
    /// True for vibration.
    pub swings: bool,
}

/// Position, speed, force, then position and speed across, 0 on a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    pub mean: [f64; 5],
    pub variance: [f64; 5],
    /// Along and across, in m².
    pub covariance_m2: f64,
}

impl Belief {
    pub fn no_contact() -> Self {
        Self::Nothing(Bank::uniform(Gaussian::default()))
    }

    /// Mixes beliefs without contact; `share` is the other's probability.
    pub fn absorb(&mut self, other: &Self, share: f64) {
        if let (Self::Nothing(own), Self::Nothing(other)) = (self, other) {
            let parts = [(1.0 - share, own.mixed()), (share, other.mixed())];
            *own = Bank::uniform(Gaussian::mixed(parts.into_iter()));
        }
    }

    pub fn contacts(&self) -> usize {
        match self {
            Self::Nothing(_) => 0,
            Self::One(_) | Self::OnPlane(_) => 1,
            Self::Two(_) => 2,
        }
    }

    pub fn predicted(&self, step: &Step, geometry: Geometry) -> Self {
        match (self, LineDynamics::new(step, geometry)) {
            (Self::Nothing(bank), Some(line)) => Self::Nothing(bank.predicted(&line)),
            (Self::One(bank), Some(line)) => Self::One(bank.predicted(&line)),
            (Self::Two(bank), Some(line)) => Self::Two(Box::new(bank.predicted(&line))),
            (Self::OnPlane(bank), _) => Self::OnPlane(Box::new(bank.predicted(&PlaneDynamics(step)))),
            // An untouched plane in balance stays unchanged.
            (belief, None) => belief.clone(),
        }
    }

    /// With the log probability; `None` on underflow.
    pub fn updated(&self, observation: Observation) -> Option<(Self, f64)> {
        match (self, observation.likelihood.geometry()) {
            (Self::Nothing(bank), _) => {
                let expand =
                    |about: &[f64; 1]| observation.likelihood.fit_untouched(observation.whitened, about[0]);
                let updated = bank.updated(&observation.entries_on_line(), expand, None);
                updated.map(|(bank, evidence)| (Self::Nothing(bank), evidence))
            }
            (Self::One(bank), Geometry::Line(line)) => {
                let updated = bank.updated(
                    &observation.entries_on_line(),
                    |about| observation.fit_one(line, about),
                    None,
                );
                updated.map(|(bank, evidence)| (Self::One(bank), evidence))
            }
            (Self::Two(bank), Geometry::Line(line)) => {
                let updated = bank.updated(
                    &observation.entries_on_line(),
                    |about| observation.fit_two(line, about),
                    None,
                );
                updated.map(|(bank, evidence)| (Self::Two(Box::new(bank)), evidence))
            }
            (Self::OnPlane(bank), Geometry::Plane(plane)) => {
                let expand = |about: &[f64; 3]| observation.fit_on_plane(plane, about);
                let updated = bank.updated(&observation.entries_on_plane(), expand, None);
                updated.map(|(bank, evidence)| (Self::OnPlane(Box::new(bank)), evidence))
            }
            // A line's belief does not fit a plane, or vice versa.
            (Self::One(_) | Self::Two(_), Geometry::Plane(_)) | (Self::OnPlane(_), Geometry::Line(_)) => None,
        }
    }

    /// The vibration continues.
    pub fn without_contact(&self, k: usize) -> Option<Self> {
        match self {
            Self::Nothing(_) => None,
            Self::One(bank) => Some(Self::Nothing(bank.without_contact(k))),
            Self::Two(bank) => Some(Self::One(bank.without_contact(k))),
            Self::OnPlane(_) => Some(Self::no_contact()),
        }
    }

    /// Mixed over motions.
    pub fn moments(&self) -> Vec<Moments> {
        match self {
            Self::Nothing(_) => Vec::new(),
            Self::One(bank) => line_moments(&bank.mixed()),
            Self::Two(bank) => line_moments(&bank.mixed()),
            Self::OnPlane(bank) => vec![plane_moments(&bank.mixed())],
        }
    }

    /// `None` for another number of contacts.
    pub fn smoothed(&self, step: &Step, geometry: Geometry, later: &Self) -> Option<Self> {
        match (self, later, LineDynamics::new(step, geometry)) {
            (Self::Nothing(bank), Self::Nothing(later), Some(line)) => {
                Some(Self::Nothing(bank.smoothed(&line, later)))
            }
            (Self::One(bank), Self::One(later), Some(line)) => Some(Self::One(bank.smoothed(&line, later))),
            (Self::Two(bank), Self::Two(later), Some(line)) => {
                Some(Self::Two(Box::new(bank.smoothed(&line, later))))
            }
            (Self::OnPlane(bank), Self::OnPlane(later), _) => {
                Some(Self::OnPlane(Box::new(bank.smoothed(&PlaneDynamics(step), later))))
            }
            _ => None,
        }
    }
}

impl Moments {
    pub fn contact(&self) -> Contact {
        let [x_m, _, force_n, y_m, _] = self.mean;
        Contact { position: Position { x_m, y_m }, force_n }
    }

    /// Within two standard deviations in position, speed and force.
    pub fn is_same_contact(&self, other: &Self) -> bool {
        const CLOSE: f64 = 2.0;
        (0..self.mean.len()).all(|i| {
            let doubt = self.variance[i] + other.variance[i];
            (self.mean[i] - other.mean[i]).powi(2) <= CLOSE * CLOSE * doubt
        })
    }
}

impl Observation<'_> {
    /// Infinite for a known force.
    fn greatest_force_n(&self) -> f64 {
        self.likelihood.force_range().map_or(f64::INFINITY, |range| range.ends_n().1)
    }

    pub fn entries_on_line<const K: usize>(&self) -> ObservedEntries<K> {
        observed_on_line(self.likelihood.position_ranges_m()[0], self.greatest_force_n())
    }

    pub fn entries_on_plane(&self) -> ObservedEntries<3> {
        observed_on_plane(self.likelihood.position_ranges_m(), self.greatest_force_n())
    }

    pub fn fit_one(&self, line: &dyn LineLikelihood, about: &[f64; 3]) -> ContactFit<3> {
        let [mode_n, x_m, force_n] = *about;
        line.fit_one(self.whitened, contact_at(x_m, force_n), self.swings.then_some(mode_n))
    }

    pub fn fit_two(&self, line: &dyn LineLikelihood, about: &[f64; 5]) -> ContactFit<5> {
        let [mode_n, x_m, force_n, other_m, other_n] = *about;
        let contacts = [contact_at(x_m, force_n), contact_at(other_m, other_n)];
        line.fit_two(self.whitened, contacts, self.swings.then_some(mode_n))
    }

    pub fn fit_on_plane(&self, plane: &dyn PlaneLikelihood, about: &[f64; 3]) -> ContactFit<3> {
        let [x_m, y_m, force_n] = *about;
        plane.fit_on_plane(self.whitened, Contact { position: Position { x_m, y_m }, force_n })
    }
}

fn contact_at(x_m: f64, force_n: f64) -> Contact {
    Contact { position: Position::along(x_m), force_n }
}

fn line_moments<const N: usize>(belief: &Gaussian<N>) -> Vec<Moments> {
    let of = |k: usize| {
        let entry = |moment: usize| [X, V, W].get(moment).map(|i| contact(k) + i);
        let variance = |i: usize| belief.covariance[i][i].max(0.0);
        Moments {
            mean: std::array::from_fn(|moment| entry(moment).map_or(0.0, |i| belief.mean[i])),
            variance: std::array::from_fn(|moment| entry(moment).map_or(0.0, variance)),
            covariance_m2: 0.0,
        }
    };
    (0..contacts(N)).map(of).collect()
}

fn plane_moments(belief: &Gaussian<PLANE_NUMBERS>) -> Moments {
    let entries = [ALONG, ALONG + 1, FORCE, ACROSS, ACROSS + 1];
    Moments {
        mean: entries.map(|i| belief.mean[i]),
        variance: entries.map(|i| belief.covariance[i][i].max(0.0)),
        covariance_m2: belief.covariance[ALONG][ACROSS],
    }
}
