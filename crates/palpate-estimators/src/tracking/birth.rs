//! Contacts that a reading can have come from.
//!
//! A contact that has just come is held possible anywhere near where the reading by itself shows one, with any force up to
//! many times the one that fits, at any usual speed, on a surface that it has not made swing much. The reading then says
//! how probable that was, and what is left of it.

use super::TrackerConfig;
use super::bank::{
    A, ACROSS, ALONG, Bank, FORCE, OF_CONTACT, PLANE_NUMBERS, U, U_RATE, V, W, X, contact, seen_on_line,
    seen_on_plane, sides_m,
};
use super::belief::{Belief, Seen};
use super::gaussian::Gaussian;
use crate::likelihood::{ContactFit, LineLikelihood, PlaneLikelihood};
use palpate_core::{ContactEstimate, Estimate, Status};
use palpate_mechanics::contact::{Contact, Position};
use palpate_numerics::NORMAL_95;
use palpate_numerics::small::{principal_direction, principal_variances};
use std::f64::consts::PI;

/// A valley of a reading's misfit that is wider than this share of the length is born in parts no wider, since its force
/// changes along it.
const WIDEST: f64 = 1.0 / 40.0;
/// The most parts of a valley.
const MOST_PARTS: f64 = 16.0;
/// A force that is not known lies anywhere between 0 and this many times the one that explains a reading.
const FORCES: f64 = 10.0;
/// The first mode's force is this share, as a standard deviation, off its balance under a contact that has just come.
const UNREST: f64 = 0.02;

/// Birth model: the contacts that can have come with one reading; `L` is the likelihood of a line or of a plane.
pub(super) struct Births<'a, L: ?Sized> {
    pub likelihood: &'a L,
    pub seen: Seen<'a>,
    pub config: &'a TrackerConfig,
    pub alone: &'a Estimate,
}

/// A contact that has just come, before its reading.
#[derive(Clone, Copy)]
struct Newcomer {
    contact: Contact,
    /// Covariance of the place in m²: xx, xy, yy; on a line xx alone.
    covariance_m2: [f64; 3],
    variance_n2: f64,
    /// The share of all places that it stands for.
    room: f64,
}

impl<L: ?Sized> Births<'_, L> {
    /// The single contacts that the reading by itself shows, one in each valley of its misfit.
    fn valleys(&self) -> impl Iterator<Item = &ContactEstimate> {
        let modes = self.alone.modes.as_slice().iter().map(|mode| &mode.contact);
        let touched = self.alone.status != Status::NoContact;
        std::iter::once(&self.alone.contact).chain(modes).filter(move |_| touched)
    }

    /// A contact with this force, or the known one; `None` where that does not press.
    fn newcomer(
        &self,
        position: Position,
        force_n: f64,
        covariance_m2: [f64; 3],
        room: f64,
    ) -> Option<Newcomer> {
        let known_n = self.seen.likelihood.known_force_n();
        let force_n = known_n.unwrap_or(force_n);
        let variance_n2 = if known_n.is_some() { 0.0 } else { (FORCES * force_n).powi(2) / 12.0 };
        let contact = Contact { position, force_n };
        (force_n > 0.0).then_some(Newcomer { contact, covariance_m2, variance_n2, room })
    }

    /// A contact that may turn out to be anywhere on the surface.
    fn anywhere(&self, contact: &ContactEstimate) -> Option<Newcomer> {
        let [xx, yy] = sides_m(self.seen.likelihood.extent()).map(|side_m| side_m.powi(2) / 12.0);
        self.newcomer(contact.position, contact.force_n?, [xx, 0.0, yy], 1.0)
    }
}

/// The force that fits a place, from a fit of one near it; its number is the third.
fn better_force_n(fit: &ContactFit<3>, near_n: f64) -> f64 {
    let information = fit.information[2][2];
    if information > 0.0 { (near_n + fit.score[2] / information).max(0.0) } else { near_n }
}

impl Births<'_, dyn LineLikelihood + '_> {
    /// The contacts that touch a surface on which there was nothing; each with the logarithm of how probable the reading is.
    pub fn where_nothing_touched(&self) -> Vec<(f64, Belief)> {
        if self.alone.status == Status::NoContact {
            return Vec::new();
        }
        if let Some((first, second)) = self.pair() {
            return self.two_at_once(first, second).into_iter().collect();
        }
        self.valleys()
            .flat_map(|contact| self.parts(contact))
            .filter_map(|newcomer| self.one(newcomer))
            .collect()
    }

    /// A second contact beside that of a belief.
    pub fn beside(&self, bank: &Bank<6, 3>) -> Option<(f64, Belief)> {
        let (left, right) = self.pair()?;
        let x_m = bank.mixed().mean[contact(0) + X];
        let away = |newcomer: &Newcomer| (newcomer.contact.position.x_m - x_m).abs();
        let (old, new) = if away(&left) < away(&right) { (left, right) } else { (right, left) };
        let born: Bank<10, 9> = bank.with(|belief| self.joined(belief, new));
        let (bank, evidence) = self.with_two(&born, old.contact, new.contact)?;
        Some((evidence, Belief::Two(Box::new(bank))))
    }

    /// One contact, with the reading; what it does next is not known from that, so its motions are as one.
    fn one(&self, newcomer: Newcomer) -> Option<(f64, Belief)> {
        let Contact { position, force_n } = newcomer.contact;
        let born: Bank<6, 1> = Bank::of(self.joined(&Gaussian::<2>::default(), newcomer));
        let start = [self.balance_n(newcomer.contact), position.x_m, force_n];
        let expand = |about: &[f64; 3]| self.seen.fit_one(self.likelihood, about);
        let (bank, evidence) = born.updated(&seen_on_line(self.length_m()), expand, Some(start))?;
        Some((evidence + newcomer.room.ln(), Belief::One(Bank::of(bank.members[0]))))
    }

    /// Two contacts that come at once, with the reading.
    fn two_at_once(&self, first: Newcomer, second: Newcomer) -> Option<(f64, Belief)> {
        let one: Gaussian<6> = self.joined(&Gaussian::<2>::default(), first);
        let born: Bank<10, 1> = Bank::of(self.joined(&one, second));
        let (bank, evidence) = self.with_two(&born, first.contact, second.contact)?;
        Some((evidence, Belief::Two(Box::new(Bank::of(bank.members[0])))))
    }

    /// A bank of two contacts with the reading, which is expanded first about where the two are by themselves.
    fn with_two<const M: usize>(
        &self,
        born: &Bank<10, M>,
        first: Contact,
        second: Contact,
    ) -> Option<(Bank<10, M>, f64)> {
        let mode_n = self.balance_n(first) + self.balance_n(second);
        let start = [mode_n, first.position.x_m, first.force_n, second.position.x_m, second.force_n];
        let expand = |about: &[f64; 5]| self.seen.fit_two(self.likelihood, about);
        born.updated(&seen_on_line(self.length_m()), expand, Some(start))
    }

    /// A belief with a newcomer, under which the first mode is nearly in balance: u grows by W·φ(x) and its unrest.
    fn joined<const N: usize, const N2: usize>(
        &self,
        belief: &Gaussian<N>,
        newcomer: Newcomer,
    ) -> Gaussian<N2> {
        let Newcomer { contact: Contact { position, force_n }, covariance_m2, variance_n2, .. } = newcomer;
        let variance_m2 = covariance_m2[0];
        let mut joined = Gaussian::<N2>::default();
        joined.mean[..N].copy_from_slice(&belief.mean);
        for (row, old) in joined.covariance.iter_mut().zip(&belief.covariance) {
            row[..N].copy_from_slice(old);
        }
        let newborn = [
            (X, position.x_m, variance_m2),
            (V, 0.0, self.config.speed_sd_m_per_s.powi(2)),
            (A, 0.0, self.config.accelerations_m_per_s2[1].powi(2)),
            (W, force_n, variance_n2),
        ];
        for (i, mean, variance) in newborn {
            joined.mean[N + i] = mean;
            joined.covariance[N + i][N + i] = variance;
        }
        debug_assert_eq!(N2, N + OF_CONTACT);
        if let Some(swing) = self.config.swing {
            let [shape, slope] = self.likelihood.first_mode(position.x_m);
            let unrest = (UNREST * force_n).powi(2);
            let omega = 2.0 * PI * swing.frequency_hz;
            joined.mean[U] += force_n * shape;
            let by = [(X, force_n * slope, variance_m2), (W, shape, variance_n2)];
            for (i, slope, variance) in by {
                joined.covariance[U][U] += slope * slope * variance;
                joined.covariance[U][N + i] += slope * variance;
                joined.covariance[N + i][U] += slope * variance;
            }
            joined.covariance[U][U] += unrest;
            joined.covariance[U_RATE][U_RATE] += omega * omega * unrest;
        }
        joined
    }

    fn length_m(&self) -> f64 {
        self.seen.likelihood.extent().length_m()
    }

    fn balance_n(&self, contact: Contact) -> f64 {
        contact.force_n * self.likelihood.first_mode(contact.position.x_m)[0]
    }

    /// The two contacts that the reading by itself shows, from left to right.
    fn pair(&self) -> Option<(Newcomer, Newcomer)> {
        let first = self.anywhere(&self.alone.contact)?;
        let second = self.anywhere(self.alone.further.as_slice().first()?)?;
        let in_order = first.contact.position.x_m <= second.contact.position.x_m;
        Some(if in_order { (first, second) } else { (second, first) })
    }

    /// The parts of one valley.
    fn parts(&self, contact: &ContactEstimate) -> Vec<Newcomer> {
        let (Some(force_n), Some(uncertainty)) = (contact.force_n, contact.uncertainty) else {
            return Vec::new();
        };
        let length_m = self.length_m();
        let (low, high) = uncertainty.x_95_m;
        let count = ((high - low) / (WIDEST * length_m)).ceil().clamp(1.0, MOST_PARTS);
        if count == 1.0 {
            return self.anywhere(contact).into_iter().collect();
        }
        let width_m = (high - low) / count;
        let part = |i: usize| {
            let x_m = low + (i as f64 + 0.5) * width_m;
            let near = Contact { position: Position::along(x_m), force_n };
            let fit = self.likelihood.fit_one(self.seen.whitened, near, None);
            let variance_m2 = [width_m.powi(2) / 12.0, 0.0, 0.0];
            self.newcomer(near.position, better_force_n(&fit, force_n), variance_m2, width_m / length_m)
        };
        (0..count as usize).filter_map(part).collect()
    }
}

/// A contact in each valley of the reading's misfit, held possible as on a line. A long valley is born in
/// parts along its longer axis; across it the reading tells where.
impl Births<'_, dyn PlaneLikelihood + '_> {
    /// The contacts that touch a surface on which there was nothing; each with the logarithm of how probable the reading is.
    pub fn where_nothing_touched(&self) -> Vec<(f64, Belief)> {
        self.valleys()
            .flat_map(|contact| self.parts(contact))
            .filter_map(|newcomer| self.one(newcomer))
            .collect()
    }

    /// A contact with the reading; what it does next is not known from that, so its motions are as one.
    fn one(&self, newcomer: Newcomer) -> Option<(f64, Belief)> {
        let Contact { position: Position { x_m, y_m }, force_n } = newcomer.contact;
        let mut belief = Gaussian::<PLANE_NUMBERS>::default();
        let [xx, xy, yy] = newcomer.covariance_m2;
        for (at, place_m, variance_m2) in [(ALONG, x_m, xx), (ACROSS, y_m, yy)] {
            belief.mean[at] = place_m;
            belief.covariance[at][at] = variance_m2;
            belief.covariance[at + 1][at + 1] = self.config.speed_sd_m_per_s.powi(2);
            belief.covariance[at + 2][at + 2] = self.config.accelerations_m_per_s2[1].powi(2);
        }
        (belief.covariance[ALONG][ACROSS], belief.covariance[ACROSS][ALONG]) = (xy, xy);
        belief.mean[FORCE] = force_n;
        belief.covariance[FORCE][FORCE] = newcomer.variance_n2;
        let born: Bank<PLANE_NUMBERS, 1> = Bank::of(belief);
        let expand = |about: &[f64; 3]| self.seen.fit_on_plane(self.likelihood, about);
        let numbers = seen_on_plane(self.seen.likelihood.extent());
        let (bank, evidence) = born.updated(&numbers, expand, Some([x_m, y_m, force_n]))?;
        Some((evidence + newcomer.room.ln(), Belief::OnPlane(Box::new(Bank::of(bank.members[0])))))
    }

    /// The parts of one valley.
    fn parts(&self, contact: &ContactEstimate) -> Vec<Newcomer> {
        let (Some(force_n), Some(uncertainty)) = (contact.force_n, contact.uncertainty) else {
            return Vec::new();
        };
        let [xx, xy, _, yy, ..] = uncertainty.covariance;
        let sides_m = sides_m(self.seen.likelihood.extent());
        let longest_m = sides_m[0].max(sides_m[1]);
        let [longest, _] = principal_variances([xx, xy, yy]);
        let reach_m = NORMAL_95 * longest.sqrt();
        let [cos, sin] = principal_direction([xx, xy, yy]);
        let count = (2.0 * reach_m / (WIDEST * longest_m)).ceil().clamp(1.0, MOST_PARTS);
        if count == 1.0 {
            return self.anywhere(contact).into_iter().collect();
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
            let fit = self.likelihood.fit_on_plane(self.seen.whitened, Contact { position, force_n });
            self.newcomer(position, better_force_n(&fit, force_n), covariance_m2, width_m / longest_m)
        };
        (0..count as usize).filter_map(part).collect()
    }
}
