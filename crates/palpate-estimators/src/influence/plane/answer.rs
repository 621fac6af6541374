//! From minima of the misfit to an estimate that owns up to what it does not know.

use super::modes::{MODE_THAT_MATTERS, Mode};
use super::search::{Scratch, Search, Unknowns};
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::{held_interval, normal_interval_95};

/// The estimate of one contact.
///
/// The time of a plain reading is that of the scan, a product for every coarse cell and channel, and of some six of
/// Levenberg's steps, 16 corner numbers × 3 sums for every group of eight channels each. Where the probability is summed up
/// instead, it is that of the misfit at a thousand places or so.
pub(super) fn locate(search: &Search, reading: &[f64], scratch: &mut Scratch) -> Estimate {
    let square = search.whiten(reading, scratch);
    let (minima, count) = search.minima(square, scratch);
    let (minima, best) = (&minima[..count], minima[0]);
    if square <= best.misfit + search.charge && square <= search.worst_noise {
        return Estimate::of_position(position(best.at), Status::NoContact);
    }
    let surroundings = search.surroundings(minima, scratch);
    let modes = surroundings.modes();
    let alone = |mode: &Mode| contact(search, mode, mode.covariance);
    let mut estimate = Estimate::of_contact(contact(search, &modes[0], surroundings.region), Status::Located);
    for mode in modes[1..].iter().filter(|mode| mode.weight >= MODE_THAT_MATTERS) {
        estimate.modes.push(palpate_core::Mode { contact: alone(mode), probability: mode.weight });
        estimate.status = Status::Ambiguous;
    }
    if best.misfit > search.worst_misfit {
        estimate.status = Status::OutsideModel;
    }
    estimate
}

fn position([x_m, y_m, _]: Unknowns) -> Position {
    Position { x_m, y_m }
}

/// A contact with an uncertainty that is held to the surface.
fn contact(search: &Search, mode: &Mode, covariance: [f64; 6]) -> ContactEstimate {
    let interval = |k: usize, variance: f64| {
        held_interval(normal_interval_95(mode.mean[k], variance.sqrt()), search.size_m[k])
    };
    let uncertainty =
        Uncertainty { covariance, x_95_m: interval(0, covariance[0]), y_95_m: interval(1, covariance[3]) };
    ContactEstimate {
        position: position(mode.mean),
        force_n: Some(mode.mean[2]),
        uncertainty: Some(uncertainty),
    }
}
