//! Contacts that may have come with a reading.
//!
//! A new contact has a wide prior about the places that explain the reading by itself, with any usual speed, on a surface that
//! hardly swings. The reading then gives its probability and its posterior.
//!
//! The force of a contact has the [prior](crate::force_prior) of all estimators. About the force W that fits, a log-normal distribution ln W ~ N(μ, s²) has the density
//! e^(−q²/2)/(√(2π)·s·W) with q = (ln W − μ)/s: that of a normal distribution with the standard deviation s·W at its mean, times e^(−q²/2).

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

/// A valley of a reading's misfit that is wider than this share of the length is divided into parts no wider, since the force changes along it.
const WIDEST: f64 = 1.0 / 40.0;
/// The most parts of a valley.
const MOST_PARTS: f64 = 16.0;
/// Standard deviation of the first mode's force about its balance under a new contact, as a share of the contact's force.
const IMBALANCE: f64 = 0.02;

/// Birth model: the contacts that may have come with one reading; `L` is the likelihood of a line or of a plane.
pub(super) struct BirthModel<'a, L: ?Sized> {
    pub likelihood: &'a L,
    pub observation: Observation<'a>,
    pub config: &'a TrackerConfig,
    /// Prior of the force of a contact; `None` where it is known.
    pub force_prior: Option<&'a ForcePrior>,
    pub single: &'a Estimate,
}

/// Component of the birth model: a contact that has just come, before its reading.
#[derive(Clone, Copy)]
struct BirthComponent {
    contact: Contact,
    /// Covariance of the place in m²: xx, xy, yy; on a line xx alone.
    covariance_m2: [f64; 3],
    variance_n2: f64,
    /// Prior probability: its share of all places, times the density of its force over that of a normal distribution about it.
    prior: f64,
}

impl<L: ?Sized> BirthModel<'_, L> {
    /// The single contacts that explain the reading by itself, one in each valley of its misfit.
    fn modes(&self) -> impl Iterator<Item = &ContactEstimate> {
        let modes = self.single.modes.as_slice().iter().map(|mode| &mode.contact);
        let touched = self.single.status != Status::NoContact;
        std::iter::once(&self.single.contact).chain(modes).filter(move |_| touched)
    }

    /// A contact with this force, or the known one; `None` for a force that does not press.
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

    /// A contact with the variance of a uniform distribution over the surface, l²/12.
    fn uniform_component(&self, contact: &ContactEstimate) -> Option<BirthComponent> {
        let [xx, yy] = sides_m(self.observation.likelihood.extent()).map(|side_m| side_m.powi(2) / 12.0);
        self.component(contact.position, contact.force_n?, [xx, 0.0, yy], 1.0)
    }
}

/// The force that fits a place, from a fit of one near it; the force is the third unknown.
fn better_force_n(fit: &ContactFit<3>, near_n: f64) -> f64 {
    let information = fit.information[2][2];
    if information > 0.0 { (near_n + fit.score[2] / information).max(0.0) } else { near_n }
}

impl BirthModel<'_, dyn LineLikelihood + '_> {
    /// The contacts that may touch a surface without contacts; each with the log probability of the reading.
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

    /// A second contact beside that of a belief.
    pub fn second_contact(&self, bank: &Bank<6, 3>) -> Option<(f64, Belief)> {
        let (left, right) = self.pair()?;
        let x_m = bank.mixed().mean[contact(0) + X];
        let away = |component: &BirthComponent| (component.contact.position.x_m - x_m).abs();
        let (old, new) = if away(&left) < away(&right) { (left, right) } else { (right, left) };
        let born: Bank<10, 9> = bank.with_contact(|belief| self.augmented(belief, new));
        let (bank, evidence) = self.updated_pair(&born, old.contact, new.contact)?;
        Some((evidence, Belief::Two(Box::new(bank))))
    }

    /// One contact, updated by the reading; a single motion, as the reading does not determine how it moves on.
    fn one_contact(&self, component: BirthComponent) -> Option<(f64, Belief)> {
        let Contact { position, force_n } = component.contact;
        let born: Bank<6, 1> = Bank::uniform(self.augmented(&Gaussian::<2>::default(), component));
        let start = [self.balance_n(component.contact), position.x_m, force_n];
        let expand = |about: &[f64; 3]| self.observation.fit_one(self.likelihood, about);
        let (bank, evidence) = born.updated(&self.observation.entries_on_line(), expand, Some(start))?;
        Some((evidence + component.prior.ln(), Belief::One(Bank::uniform(bank.members[0]))))
    }

    /// Two contacts that come at once, updated by the reading.
    fn two_contacts(&self, first: BirthComponent, second: BirthComponent) -> Option<(f64, Belief)> {
        let one: Gaussian<6> = self.augmented(&Gaussian::<2>::default(), first);
        let born: Bank<10, 1> = Bank::uniform(self.augmented(&one, second));
        let (bank, evidence) = self.updated_pair(&born, first.contact, second.contact)?;
        Some((evidence, Belief::Two(Box::new(Bank::uniform(bank.members[0])))))
    }

    /// A bank of two contacts after the reading, with the misfit expanded first about their separate estimates.
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

    /// A belief with its state augmented by a contact. The first mode is nearly in balance under it: u grows by W·φ(x) and its unrest.
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

    /// The two contacts of the single reading's estimate, from left to right.
    fn pair(&self) -> Option<(BirthComponent, BirthComponent)> {
        let first = self.uniform_component(&self.single.contact)?;
        let second = self.uniform_component(self.single.further.as_slice().first()?)?;
        let in_order = first.contact.position.x_m <= second.contact.position.x_m;
        Some(if in_order { (first, second) } else { (second, first) })
    }

    /// The components of one mode.
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

/// A contact in each valley of the reading's misfit, with a uniform prior as on a line. A long valley is divided into
/// parts along its longer axis; across it the reading determines the place.
impl BirthModel<'_, dyn PlaneLikelihood + '_> {
    /// The contacts that may touch a surface without contacts; each with the log probability of the reading.
    pub fn first_contacts(&self) -> Vec<(f64, Belief)> {
        self.modes()
            .flat_map(|contact| self.mode_components(contact))
            .filter_map(|component| self.one_contact(component))
            .collect()
    }

    /// A contact, updated by the reading; a single motion, as the reading does not determine how it moves on.
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

    /// The components of one mode.
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
