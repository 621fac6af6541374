//! Intervals of contacts beyond the outermost calibrated positions.
//!
//! An interval that reaches there extends to the edge of the surface; for an unknown force (force–position
//! trade-off) the interval of the force then contains all forces. On a plane the 99 % interval decides. On a
//! line intervals are by the likelihood ratio ([`crate::trade_off`]), as the posterior excludes contacts near
//! the end by its prior. For a known force either end of the grid may explain a contact beyond it: an
//! interval that reaches such an end is the whole surface.

use super::locator::{ForceLinearContents, ForceLinearLocator};
use crate::confidence_region::{CALIBRATED, ConfidenceRegion, Contacts, Force};
use crate::influence::grid::Axis;
use crate::status::OTHER_PLACE;
use palpate_core::{ContactEstimate, Estimate};
use palpate_numerics::{NORMAL_95, NORMAL_99, extend_to, hull, normal_interval_95};
use std::cell::RefCell;

impl ForceLinearLocator {
    /// Extends intervals that reach beyond the outermost calibrated positions.
    pub(super) fn tell_beyond_presses(&self, relative: &[f64], estimate: &mut Estimate) {
        let [along, across] = self.axes();
        if across.count > 1 {
            self.open_edges(estimate);
        } else if along.count > 1 {
            self.tell_near_ends(along, relative, estimate);
        }
    }

    fn open_edges(&self, estimate: &mut Estimate) {
        let ContactEstimate { position, uncertainty: Some(uncertainty), .. } = &mut estimate.contact else {
            return;
        };
        let extent = self.stored.prior.extent;
        let sizes_m = [extent.length_m(), extent.width_m().unwrap_or(0.0)];
        let intervals_m = [(position.x_m, &mut uncertainty.x_95_m), (position.y_m, &mut uncertainty.y_95_m)];
        let mut is_beyond = false;
        for (k, (at_m, interval_m)) in intervals_m.into_iter().enumerate() {
            let (first_m, last_m) = self.outermost_m(k);
            let (low_m, high_m) = of_99(at_m, *interval_m);
            let (is_before, is_behind) = (low_m <= first_m, high_m >= last_m);
            // An extrapolated estimate errs to both sides: the interval includes the whole margin.
            if is_before {
                *interval_m = hull(*interval_m, (0.0, first_m));
            }
            if is_behind {
                *interval_m = hull(*interval_m, (last_m, sizes_m[k]));
            }
            is_beyond |= is_before || is_behind;
        }
        if is_beyond && self.stored.known_force_n.is_none() {
            uncertainty.force_95_n = Some((0.0, self.hardest_n()));
        }
    }

    fn tell_near_ends(&self, axis: Axis, relative: &[f64], estimate: &mut Estimate) {
        let modes = estimate.modes.as_slice().iter().map(|mode| mode.contact);
        let contacts: Vec<ContactEstimate> = std::iter::once(estimate.contact).chain(modes).collect();
        let outermost_m = self.outermost_m(0);
        if !contacts.iter().any(|contact| is_near(outermost_m, contact)) {
            return;
        }
        let minima_m: Vec<f64> = contacts.iter().map(|contact| contact.position.x_m - axis.start).collect();
        let Some(found) = self.confidence_region(axis, relative, &minima_m) else { return };
        let (x_95_m, force_95_n) = self.on_surface(axis, &found);
        let ContactEstimate { position, force_n, uncertainty: Some(uncertainty) } = &mut estimate.contact
        else {
            return;
        };
        uncertainty.x_95_m = extend_to(hull(x_95_m, uncertainty.x_95_m), position.x_m);
        if let (Some(force_95_n), Some(force_n)) = (force_95_n, *force_n) {
            let (least_n, most_n) = normal_interval_95(force_n, uncertainty.covariance[5].sqrt());
            uncertainty.force_95_n = Some(hull(force_95_n, (least_n.max(0.0), most_n)));
        }
    }

    fn confidence_region(&self, axis: Axis, relative: &[f64], minima_m: &[f64]) -> Option<ConfidenceRegion> {
        let likelihood = RefCell::new(self.likelihood(relative));
        let channels = |along_m: f64, response_n: f64, channels: &mut Vec<[f64; 2]>| {
            likelihood.borrow_mut().whiten([along_m / axis.step, 0.0, response_n], channels)
        };
        let contacts = Contacts {
            length_m: length_m(axis),
            force: self.known_response_n().map_or(Force::AtMost(self.force_prior.ends_n().1), Force::Known),
            widening: CALIBRATED,
            reference_force_n: self.stored.mean_force_n,
            // With few presses the likelihood is divided already.
            extrapolates: self.stored.channels_as_one == 1.0,
            channels: &channels,
        };
        contacts.confidence_region(minima_m)
    }

    /// Coordinate k of the outermost positions; the grid's ends in files without them.
    fn outermost_m(&self, k: usize) -> (f64, f64) {
        let axis = self.axes()[k];
        let of_grid = || (axis.start, axis.start + length_m(axis));
        self.stored.outermost_m.get(k).copied().unwrap_or_else(of_grid)
    }

    fn hardest_n(&self) -> f64 {
        self.stored.prior.force_of_response(self.force_prior.ends_n().1, 0.0).0
    }

    fn on_surface(&self, axis: Axis, found: &ConfidenceRegion) -> ((f64, f64), Option<(f64, f64)>) {
        let ForceLinearContents { prior, .. } = &self.stored;
        let (_, hardest_n) = self.force_prior.ends_n();
        /// Fraction of the surface's length.
        const ROUNDING: f64 = 1e-9;
        let whole_m = (0.0, prior.extent.length_m());
        let rounding_m = ROUNDING * whole_m.1;
        let (first_m, last_m) = self.outermost_m(0);
        // Improbable segments are ignored, as other modes are.
        let probable = || found.stretches.iter().filter(|stretch| stretch.probability >= OTHER_PLACE);
        let (low_m, high_m) = probable().map(|stretch| stretch.x_95_m).reduce(hull).unwrap_or(found.x_95_m);
        let behind_m = whole_m.1 - (axis.start + length_m(axis));
        let is_beyond_grid =
            (low_m <= 0.0 && axis.start > rounding_m) || (high_m >= length_m(axis) && behind_m > rounding_m);
        let (low_m, high_m) = (axis.start + low_m, axis.start + high_m);
        let (is_before, is_behind) = (low_m <= first_m, high_m >= last_m);
        let low_m = if is_before { whole_m.0 } else { low_m };
        let high_m = if is_behind { whole_m.1 } else { high_m };
        if found.force_95_n.is_none() {
            return (if is_beyond_grid { whole_m } else { (low_m, high_m) }, None);
        }
        let force_95_n = probable().map(|stretch| stretch.force_95_n).reduce(hull);
        let (least_n, most_n) = force_95_n.filter(|_| !is_before && !is_behind).unwrap_or((0.0, hardest_n));
        let force_n = |response_n: f64| prior.force_of_response(response_n, 0.0).0;
        ((low_m, high_m), Some((force_n(least_n), force_n(most_n))))
    }
}

fn of_99(at_m: f64, (low_m, high_m): (f64, f64)) -> (f64, f64) {
    const TIMES: f64 = NORMAL_99 / NORMAL_95;
    (at_m - TIMES * (at_m - low_m), at_m + TIMES * (high_m - at_m))
}

fn length_m(axis: Axis) -> f64 {
    axis.step * (axis.count - 1) as f64
}

fn is_near((first_m, last_m): (f64, f64), contact: &ContactEstimate) -> bool {
    /// Standard deviations.
    const NEAR: f64 = 5.0;
    let reach_m = NEAR * contact.uncertainty.map_or(f64::INFINITY, |u| u.covariance[0].sqrt());
    let x_m = contact.position.x_m;
    x_m - first_m <= reach_m || last_m - x_m <= reach_m
}
