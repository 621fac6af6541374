//! One contact on a plane.
//!
//! Its state is (x, v_x, v̇_x, y, v_y, v̇_y, W): motions along and across have the same law and do not know of each other, so a
//! bank has the three motions of one contact. The plane is in balance at every reading.

use super::bank::{Bank, Dynamics, SeenNumbers};
use super::belief::{Belief, Moments};
use super::birth::{Births, FORCES, MOST_PARTS, WIDEST, better_force_n};
use super::gaussian::{Change, Gaussian};
use super::step::{MOTIONS, Step, motion_of};
use crate::likelihood::{ContactFit, PlaneLikelihood};
use palpate_core::ContactEstimate;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_numerics::NORMAL_95;
use palpate_numerics::small::{principal_direction, principal_variances};

/// Numbers of a state.
pub(super) const NUMBERS: usize = 7;
/// Where position, speed and acceleration along begin, those across, and the force.
const ALONG: usize = 0;
const ACROSS: usize = 3;
const FORCE: usize = 6;

/// What a reading sees of a state: x, y and W.
pub(super) fn seen(extent: Extent) -> SeenNumbers<3> {
    let [length_m, width_m] = sides_m(extent);
    SeenNumbers {
        entries: [ALONG, ACROSS, FORCE],
        bounds: [(0.0, length_m), (0.0, width_m), (0.0, f64::INFINITY)],
        is_place: [true, true, false],
    }
}

/// How well a contact at the unknowns x, y and W explains a whitened reading.
pub(super) fn fit(
    plane: &dyn PlaneLikelihood,
    whitened: &[f64],
    &[x_m, y_m, force_n]: &[f64; 3],
) -> ContactFit<3> {
    plane.fit_on_plane(whitened, Contact { position: Position { x_m, y_m }, force_n })
}

/// The contact of a state.
pub(super) fn moments(belief: &Gaussian<NUMBERS>) -> Moments {
    let entries = [ALONG, ALONG + 1, FORCE, ACROSS, ACROSS + 1];
    Moments {
        mean: entries.map(|i| belief.mean[i]),
        variance: entries.map(|i| belief.covariance[i][i].max(0.0)),
        covariance_m2: belief.covariance[ALONG][ACROSS],
    }
}

/// A step of the contact.
#[derive(Clone, Copy)]
pub(super) struct OnPlane<'a>(pub &'a Step);

impl Dynamics<NUMBERS, MOTIONS> for OnPlane<'_> {
    fn passes(&self, from: usize, to: usize) -> f64 {
        self.0.passes(1, from, to)
    }

    fn change(&self, belief: &Gaussian<NUMBERS>, member: usize) -> Change<NUMBERS> {
        let mut change = Change::nothing(belief);
        let motion = self.0.motion(motion_of(member, 0));
        motion.move_along(ALONG, belief, &mut change);
        motion.move_along(ACROSS, belief, &mut change);
        change.noise[FORCE][FORCE] = self.0.drift_n2(belief.mean[FORCE]);
        change
    }
}

/// A contact that has just come, before its reading.
#[derive(Clone, Copy)]
struct Newcomer {
    contact: Contact,
    /// Covariance of the place in m²: xx, xy, yy.
    covariance_m2: [f64; 3],
    /// The share of all places that it stands for.
    room: f64,
}

/// A contact in each valley of the reading's misfit, held possible as on a line ([`super::birth`]). A long valley is born in
/// parts along its longer axis; across it the reading tells where.
impl Births<'_, dyn PlaneLikelihood + '_> {
    /// The contacts that touch a surface on which there was nothing; each with the logarithm of how probable the reading is.
    pub fn where_nothing_touched(&self) -> Vec<(f64, Belief)> {
        self.valleys()
            .flat_map(|contact| self.parts(contact))
            .filter_map(|newcomer| self.one(&newcomer))
            .collect()
    }

    /// A contact with the reading; what it does next is not known from that, so its motions are as one.
    fn one(&self, newcomer: &Newcomer) -> Option<(f64, Belief)> {
        let Contact { position: Position { x_m, y_m }, force_n } = newcomer.contact;
        if force_n <= 0.0 {
            return None;
        }
        let mut belief = Gaussian::<NUMBERS>::default();
        let [xx, xy, yy] = newcomer.covariance_m2;
        for (at, place_m, variance_m2) in [(ALONG, x_m, xx), (ACROSS, y_m, yy)] {
            belief.mean[at] = place_m;
            belief.covariance[at][at] = variance_m2;
            belief.covariance[at + 1][at + 1] = self.config.speed_sd_m_per_s.powi(2);
            belief.covariance[at + 2][at + 2] = self.config.accelerations_m_per_s2[1].powi(2);
        }
        (belief.covariance[ALONG][ACROSS], belief.covariance[ACROSS][ALONG]) = (xy, xy);
        belief.mean[FORCE] = force_n;
        if self.seen.likelihood.known_force_n().is_none() {
            belief.covariance[FORCE][FORCE] = (FORCES * force_n).powi(2) / 12.0;
        }
        let born: Bank<NUMBERS, 1> = Bank::of(belief);
        let expand = |about: &[f64; 3]| fit(self.likelihood, self.seen.whitened, about);
        let numbers = seen(self.seen.likelihood.extent());
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
        let anywhere = sides_m.map(|side_m| side_m.powi(2) / 12.0);
        if count == 1.0 {
            let (position, known_n) = (contact.position, self.seen.likelihood.known_force_n());
            let contact = Contact { position, force_n: known_n.unwrap_or(force_n) };
            return vec![Newcomer { contact, covariance_m2: [anywhere[0], 0.0, anywhere[1]], room: 1.0 }];
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
            let contact = Contact { position, force_n: self.best_force_n(position, force_n) };
            Newcomer { contact, covariance_m2, room: width_m / longest_m }
        };
        (0..count as usize).map(part).collect()
    }

    /// The force that fits a place, from one that fits near it; the known one where it is known.
    fn best_force_n(&self, position: Position, near_n: f64) -> f64 {
        if let Some(known_n) = self.seen.likelihood.known_force_n() {
            return known_n;
        }
        let near = Contact { position, force_n: near_n };
        better_force_n(&self.likelihood.fit_on_plane(self.seen.whitened, near), near_n)
    }
}

/// Length and width, in metres; a line has no width.
fn sides_m(extent: Extent) -> [f64; 2] {
    [extent.length_m, extent.width_m.unwrap_or(0.0)]
}

#[cfg(test)]
mod tests;
