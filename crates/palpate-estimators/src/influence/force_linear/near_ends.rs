//! Intervals of contacts near the ends of a line, where hardly a press or none tells the influences.
//!
//! Beyond the outermost presses the influences are extrapolated, and how surely depends on sensors that may be there, of which presses tell nothing.
//!
//! - Where the force is not known, it and the place trade off there: intervals are by the likelihood ratio ([`crate::trade_off`]), as what is expected of
//!   contacts beforehand would exclude those beside the end. One that reaches beyond the outermost press reaches the end of the surface, and holds
//!   every force: nothing there is excluded.
//! - Where it is known, an interval that reaches farther beyond the outermost press than half of the largest gap between presses holds everything from
//!   there to the end.

use super::locator::{ForceLinearLocator, Stored};
use crate::influence::grid::Axis;
use crate::status::OTHER_PLACE;
use crate::trade_off::{CALIBRATED, Contacts, Force, NotExcluded};
use palpate_core::{ContactEstimate, Estimate};
use palpate_numerics::normal_interval_95;
use std::cell::RefCell;

impl ForceLinearLocator {
    /// Writes the intervals of a relative reading over those of the posterior where that is near an end of a line.
    pub(super) fn tell_near_ends(&self, relative: &[f64], estimate: &mut Estimate) {
        let [axis, across] = self.axes();
        if across.count > 1 || axis.count < 2 {
            return;
        }
        if self.stored.known_force_n.is_some() {
            self.open_ends(axis, estimate);
            return;
        }
        let modes = estimate.modes.as_slice().iter().map(|mode| mode.contact);
        let contacts: Vec<ContactEstimate> = std::iter::once(estimate.contact).chain(modes).collect();
        let outermost_m = self.outermost_m(axis);
        if !contacts.iter().any(|contact| is_near(outermost_m, contact)) {
            return;
        }
        let minima_m: Vec<f64> = contacts.iter().map(|contact| contact.position.x_m - axis.start).collect();
        let Some(found) = self.not_excluded(axis, relative, &minima_m) else { return };
        let (x_95_m, force_95_n) = self.on_surface(axis, &found);
        let x_m = estimate.contact.position.x_m;
        if let (Some(uncertainty), Some(force_n)) =
            (&mut estimate.contact.uncertainty, estimate.contact.force_n)
        {
            let (least_n, most_n) = normal_interval_95(force_n, uncertainty.covariance[5].sqrt());
            uncertainty.x_95_m = around(around(x_95_m, uncertainty.x_95_m), (x_m, x_m));
            uncertainty.force_95_n = Some(around(force_95_n, (least_n.max(0.0), most_n)));
        }
    }

    /// Lets the interval of a contact of known force hold a whole margin of the grid that it reaches, to the end of the surface.
    fn open_ends(&self, axis: Axis, estimate: &mut Estimate) {
        let Some(uncertainty) = &mut estimate.contact.uncertainty else { return };
        let [before_m, behind_m] = axis.margins.map(|margin| margin * axis.step);
        let usual_m = (axis.start + before_m, axis.start + length_m(axis) - behind_m);
        let (low_m, high_m) = uncertainty.x_95_m;
        if low_m < usual_m.0 {
            uncertainty.x_95_m = around(uncertainty.x_95_m, (0.0, usual_m.0));
        }
        if high_m > usual_m.1 {
            uncertainty.x_95_m = around(uncertainty.x_95_m, (usual_m.1, self.stored.prior.extent.length_m()));
        }
    }

    /// The contacts over the grid that a reading does not exclude, places from the first node on and φ for the force.
    fn not_excluded(&self, axis: Axis, relative: &[f64], minima_m: &[f64]) -> Option<NotExcluded> {
        let seen = RefCell::new(self.seen(relative));
        let channels = |along_m: f64, response_n: f64, channels: &mut Vec<[f64; 2]>| {
            seen.borrow_mut().whiten([along_m / axis.step, 0.0, response_n], channels)
        };
        let contacts = Contacts {
            length_m: length_m(axis),
            force: Force::AtMost(self.stored.hardest_n),
            widening: CALIBRATED,
            reference_force_n: self.stored.mean_force_n,
            // The likelihood of few presses is widened already.
            extrapolates: self.stored.channels_as_one == 1.0,
            channels: &channels,
        };
        contacts.not_excluded(minima_m)
    }

    /// Positions of the outermost presses; the ends of the grid in files that do not say them.
    fn outermost_m(&self, axis: Axis) -> (f64, f64) {
        self.stored.outermost_m.unwrap_or((axis.start, axis.start + length_m(axis)))
    }

    /// The intervals of place and force on the surface.
    fn on_surface(&self, axis: Axis, found: &NotExcluded) -> ((f64, f64), (f64, f64)) {
        let Stored { hardest_n, prior, .. } = &self.stored;
        let (first_m, last_m) = self.outermost_m(axis);
        // A stretch that is hardly probable is told by nothing else either.
        let probable = || found.stretches.iter().filter(|stretch| stretch.probability >= OTHER_PLACE);
        let x_95_m = probable().map(|stretch| stretch.x_95_m).reduce(around).unwrap_or(found.x_95_m);
        let (low_m, high_m) = (axis.start + x_95_m.0, axis.start + x_95_m.1);
        let (is_before, is_behind) = (low_m <= first_m, high_m >= last_m);
        let low_m = if is_before { 0.0 } else { low_m };
        let high_m = if is_behind { prior.extent.length_m() } else { high_m };
        let told = probable().map(|stretch| stretch.force_95_n).reduce(around);
        let (least_n, most_n) = told.filter(|_| !is_before && !is_behind).unwrap_or((0.0, *hardest_n));
        let force_n = |response_n: f64| prior.force_of_response(response_n, 0.0).0;
        ((low_m, high_m), (force_n(least_n), force_n(most_n)))
    }
}

/// The interval around two.
fn around(one: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    (one.0.min(other.0), one.1.max(other.1))
}

/// Length of a grid along a line.
fn length_m(axis: Axis) -> f64 {
    axis.step * (axis.count - 1) as f64
}

/// True for a contact that may be beyond the outermost presses.
fn is_near((first_m, last_m): (f64, f64), contact: &ContactEstimate) -> bool {
    /// Standard deviations.
    const NEAR: f64 = 5.0;
    let reach_m = NEAR * contact.uncertainty.map_or(f64::INFINITY, |u| u.covariance[0].sqrt());
    let x_m = contact.position.x_m;
    x_m - first_m <= reach_m || last_m - x_m <= reach_m
}
