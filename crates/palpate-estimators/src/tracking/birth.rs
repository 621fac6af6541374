//! Birth model of contacts.
//!
//! A new contact has a wide prior about the modes of its first reading, at any usual speed, nearly in
//! balance.
//!
//! The [force prior](crate::force_prior) is log-normal, ln W ~ N(μ, s²): about the fitted force W, a normal
//! density with standard deviation s·W at its mean, times e^(−q²/2) with q = (ln W − μ)/s.

use super::TrackerConfig;
use super::bank::{
    A, ACROSS, ALONG, Bank, FORCE, OF_CONTACT, PLANE_NUMBERS, U, U_RATE, V, W, X, contact, sides_m,
};
use super::belief::{Belief, Observation};
use super::gaussian::Gaussian;
use crate::force_prior::{ForcePrior, PriorTerms};
use crate::likelihood::{ContactFit, LineLikelihood, PlaneLikelihood};
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::{Contact, Position};
use palpate_numerics::NORMAL_95;
use palpate_numerics::small::{principal_direction, principal_variances};
use std::f64::consts::PI;

/// Width of a component over the length: the force varies along a wide mode.
const WIDEST: f64 = 1.0 / 40.0;
/// Components of a mode.
const MOST_PARTS: f64 = 16.0;
/// Imbalance of the first mode over the force of a new contact.
const IMBALANCE: f64 = 0.02;

/// Births at one reading; `L` is the likelihood of a line or plane.
pub(super) struct BirthModel<'a, L: ?Sized> {
    pub likelihood: &'a L,
    pub observation: Observation<'a>,
    pub config: &'a TrackerConfig,
    /// `None` for a known force.
    pub force_prior: Option<&'a ForcePrior>,
    pub single: &'a Estimate,
}

/// Before its reading.
#[derive(Clone, Copy)]
struct BirthComponent {
    contact: Contact,
    /// xx, xy, yy in m².
    covariance_m2: [f64; 3],
    variance_n2: f64,
    /// Share of positions, times the force density over a normal one.
    prior: f64,
}

impl<L: ?Sized> BirthModel<'_, L> {
    /// Modes of the reading's likelihood.
    fn modes(&self) -> impl Iterator<Item = &ContactEstimate> {
        let modes = self.single.modes.as_slice().iter().map(|mode| &mode.contact);
        let touched = self.single.status != Status::NoContact;
        std::iter::once(&self.single.contact).chain(modes).filter(move |_| touched)
    }

    /// `None` for a force that does not press.
    fn component(
        &self,
        position: Position,
        force_n: f64,
        covariance_m2: [f64; 3],
        prior: f64,
    ) -> Option<BirthComponent> {
        let known_n = self.observation.likelihood.known_force_n();
        let force_n = known_n.unwrap_or(force_n);
        if force_n.is_nan() || force_n <= 0.0 {
            return None;
        }
        let [force_n, variance_n2, density] = match self.force_prior {
            Some(force_prior) if known_n.is_none() => {
                let force_n = force_n.min(force_prior.ends_n().1);
                let PriorTerms { cost, precision, .. } = force_prior.terms(force_n);
                [force_n, precision.recip(), (-0.5 * cost).exp()]
            }
            _ => [force_n, 0.0, 1.0],
        };
        let contact = Contact { position, force_n };
        Some(BirthComponent { contact, covariance_m2, variance_n2, prior: density * prior })
    }

    /// Variance l²/12 of a uniform distribution.
    fn uniform_component(&self, contact: &ContactEstimate) -> Option<BirthComponent> {
        let [xx, yy] = sides_m(self.observation.likelihood.extent()).map(|side_m| side_m.powi(2) / 12.0);
        self.component(contact.position, contact.force_n?, [xx, 0.0, yy], 1.0)
    }
}

/// Force that fits near a fit, as third unknown.
fn better_force_n(fit: &ContactFit<3>, near_n: f64) -> f64 {
    let information = fit.information[2][2];
    if information > 0.0 { (near_n + fit.score[2] / information).max(0.0) } else { near_n }
}

impl BirthModel<'_, dyn LineLikelihood + '_> {
    /// With log probabilities of the reading.
    pub fn first_contacts(&self) -> Vec<(f64, Belief)> {
        if self.single.status == Status::NoContact {
            return Vec::new();
        }
        if let Some((first, second)) = self.pair() {
            return self.two_contacts(first, second).into_iter().collect();
        }
        self.modes()
            .flat_map(|contact| self.mode_components(contact))
            .filter_map(|component| self.one_contact(component))
            .collect()
    }

    pub fn second_contact(&self, bank: &Bank<6, 3>) -> Option<(f64, Belief)> {
        let (left, right) = self.pair()?;
        let x_m = bank.mixed().mean[contact(0) + X];
        let away = |component: &BirthComponent| (component.contact.position.x_m - x_m).abs();
        let (old, new) = if away(&left) < away(&right) { (left, right) } else { (right, left) };
        let born: Bank<10, 9> = bank.with_contact(|belief| self.augmented(belief, new));
        let (bank, evidence) = self.updated_pair(&born, old.contact, new.contact)?;
        Some((evidence, Belief::Two(Box::new(bank))))
    }

    /// A single motion, because one reading does not determine it.
    fn one_contact(&self, component: BirthComponent) -> Option<(f64, Belief)> {
        let Contact { position, force_n } = component.contact;
        let born: Bank<6, 1> = Bank::uniform(self.augmented(&Gaussian::<2>::default(), component));
        let start = [self.balance_n(component.contact), position.x_m, force_n];
        let expand = |about: &[f64; 3]| self.observation.fit_one(self.likelihood, about);
        let (bank, evidence) = born.updated(&self.observation.entries_on_line(), expand, Some(start))?;
        Some((evidence + component.prior.ln(), Belief::One(Bank::uniform(bank.members[0]))))
    }

    fn two_contacts(&self, first: BirthComponent, second: BirthComponent) -> Option<(f64, Belief)> {
        let one: Gaussian<6> = self.augmented(&Gaussian::<2>::default(), first);
        let born: Bank<10, 1> = Bank::uniform(self.augmented(&one, second));
        let (bank, evidence) = self.updated_pair(&born, first.contact, second.contact)?;
        Some((evidence, Belief::Two(Box::new(Bank::uniform(bank.members[0])))))
    }

    /// Expanded first about separate estimates.
    fn updated_pair<const M: usize>(
        &self,
        born: &Bank<10, M>,
        first: Contact,
        second: Contact,
    ) -> Option<(Bank<10, M>, f64)> {
        let mode_n = self.balance_n(first) + self.balance_n(second);
        let start = [mode_n, first.position.x_m, first.force_n, second.position.x_m, second.force_n];
        let expand = |about: &[f64; 5]| self.observation.fit_two(self.likelihood, about);
        born.updated(&self.observation.entries_on_line(), expand, Some(start))
    }

    /// u increases by W·φ(x), with imbalance.
    fn augmented<const N: usize, const N2: usize>(
        &self,
        belief: &Gaussian<N>,
        component: BirthComponent,
    ) -> Gaussian<N2> {
        let BirthComponent { contact: Contact { position, force_n }, covariance_m2, variance_n2, .. } =
            component;
        let variance_m2 = covariance_m2[0];
        let mut joined = Gaussian::<N2>::default();
        joined.mean[..N].copy_from_slice(&belief.mean);
        for (row, old) in joined.covariance.iter_mut().zip(&belief.covariance) {
            row[..N].copy_from_slice(old);
        }
        let log_births = [
            (X, position.x_m, variance_m2),
            (V, 0.0, self.config.speed_sd_m_per_s.powi(2)),
            (A, 0.0, self.config.accelerations_m_per_s2[1].powi(2)),
            (W, force_n, variance_n2),
        ];
        for (i, mean, variance) in log_births {
            joined.mean[N + i] = mean;
            joined.covariance[N + i][N + i] = variance;
        }
        debug_assert_eq!(N2, N + OF_CONTACT);
        if let Some(swing) = self.config.swing {
            let [shape, slope] = self.likelihood.first_mode(position.x_m);
            let imbalance = (IMBALANCE * force_n).powi(2);
            let omega = 2.0 * PI * swing.frequency_hz;
            joined.mean[U] += force_n * shape;
            let by = [(X, force_n * slope, variance_m2), (W, shape, variance_n2)];
            for (i, slope, variance) in by {
                joined.covariance[U][U] += slope * slope * variance;
                joined.covariance[U][N + i] += slope * variance;
                joined.covariance[N + i][U] += slope * variance;
            }
            joined.covariance[U][U] += imbalance;
            joined.covariance[U_RATE][U_RATE] += omega * omega * imbalance;
        }
        joined
    }

    fn length_m(&self) -> f64 {
        self.observation.likelihood.extent().length_m()
    }

    fn balance_n(&self, contact: Contact) -> f64 {
        contact.force_n * self.likelihood.first_mode(contact.position.x_m)[0]
    }

    /// From left to right.
    fn pair(&self) -> Option<(BirthComponent, BirthComponent)> {
        let first = self.uniform_component(&self.single.contact)?;
        let second = self.uniform_component(self.single.further.as_slice().first()?)?;
        let in_order = first.contact.position.x_m <= second.contact.position.x_m;
        Some(if in_order { (first, second) } else { (second, first) })
    }

    fn mode_components(&self, contact: &ContactEstimate) -> Vec<BirthComponent> {
        let (Some(force_n), Some(uncertainty)) = (contact.force_n, contact.uncertainty) else {
            return Vec::new();
        };
        let length_m = self.length_m();
        let (low, high) = uncertainty.x_95_m;
        let count = ((high - low) / (WIDEST * length_m)).ceil().clamp(1.0, MOST_PARTS);
        if count == 1.0 {
            return self.uniform_component(contact).into_iter().collect();
        }
        let width_m = (high - low) / count;
        let part = |i: usize| {
            let x_m = low + (i as f64 + 0.5) * width_m;
            let near = Contact { position: Position::along(x_m), force_n };
            let fit = self.likelihood.fit_one(self.observation.whitened, near, None);
            let variance_m2 = [width_m.powi(2) / 12.0, 0.0, 0.0];
            self.component(near.position, better_force_n(&fit, force_n), variance_m2, width_m / length_m)
        };
        (0..count as usize).filter_map(part).collect()
    }
}

/// Wide modes are divided along their longer axis.
impl BirthModel<'_, dyn PlaneLikelihood + '_> {
    /// With log probabilities of the reading.
    pub fn first_contacts(&self) -> Vec<(f64, Belief)> {
        self.modes()
            .flat_map(|contact| self.mode_components(contact))
            .filter_map(|component| self.one_contact(component))
            .collect()
    }

    /// A single motion, because one reading does not determine it.
    fn one_contact(&self, component: BirthComponent) -> Option<(f64, Belief)> {
        let Contact { position: Position { x_m, y_m }, force_n } = component.contact;
        let mut belief = Gaussian::<PLANE_NUMBERS>::default();
        let [xx, xy, yy] = component.covariance_m2;
        for (at, place_m, variance_m2) in [(ALONG, x_m, xx), (ACROSS, y_m, yy)] {
            belief.mean[at] = place_m;
            belief.covariance[at][at] = variance_m2;
            belief.covariance[at + 1][at + 1] = self.config.speed_sd_m_per_s.powi(2);
            belief.covariance[at + 2][at + 2] = self.config.accelerations_m_per_s2[1].powi(2);
        }
        (belief.covariance[ALONG][ACROSS], belief.covariance[ACROSS][ALONG]) = (xy, xy);
        belief.mean[FORCE] = force_n;
        belief.covariance[FORCE][FORCE] = component.variance_n2;
        let born: Bank<PLANE_NUMBERS, 1> = Bank::uniform(belief);
        let expand = |about: &[f64; 3]| self.observation.fit_on_plane(self.likelihood, about);
        let observed = self.observation.entries_on_plane();
        let (bank, evidence) = born.updated(&observed, expand, Some([x_m, y_m, force_n]))?;
        Some((evidence + component.prior.ln(), Belief::OnPlane(Box::new(Bank::uniform(bank.members[0])))))
    }

    fn mode_components(&self, contact: &ContactEstimate) -> Vec<BirthComponent> {
        let (Some(force_n), Some(uncertainty)) = (contact.force_n, contact.uncertainty) else {
            return Vec::new();
        };
        let [xx, xy, _, yy, ..] = uncertainty.covariance;
        let sides_m = sides_m(self.observation.likelihood.extent());
        let longest_m = sides_m[0].max(sides_m[1]);
        let [longest, _] = principal_variances([xx, xy, yy]);
        let reach_m = NORMAL_95 * longest.sqrt();
        let [cos, sin] = principal_direction([xx, xy, yy]);
        let count = (2.0 * reach_m / (WIDEST * longest_m)).ceil().clamp(1.0, MOST_PARTS);
        if count == 1.0 {
            return self.uniform_component(contact).into_iter().collect();
        }
        let width_m = 2.0 * reach_m / count;
        let [along, across] = [width_m.powi(2) / 12.0, longest_m.powi(2) / 12.0];
        let covariance_m2 = [
            along * cos * cos + across * sin * sin,
            (along - across) * sin * cos,
            along * sin * sin + across * cos * cos,
        ];
        let part = |i: usize| {
            let off_m = (i as f64 + 0.5) * width_m - reach_m;
            let position = Position {
                x_m: (contact.position.x_m + off_m * cos).clamp(0.0, sides_m[0]),
                y_m: (contact.position.y_m + off_m * sin).clamp(0.0, sides_m[1]),
            };
            let fit = self.likelihood.fit_on_plane(self.observation.whitened, Contact { position, force_n });
            self.component(position, better_force_n(&fit, force_n), covariance_m2, width_m / longest_m)
        };
        (0..count as usize).filter_map(part).collect()
    }
}
