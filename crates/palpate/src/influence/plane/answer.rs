//! From minima of the misfit to an estimate that owns up to what it does not know.

use super::modes::Mode;
use super::search::{Scratch, Search};
use crate::contact::Position;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};

/// Another place with at least this share of the probability is said.
const MODE_THAT_MATTERS: f64 = 0.01;
/// Half the width of a normal distribution's 95 % interval, in standard deviations.
const NORMAL_95: f64 = 1.959_963_984_540_054;
/// The 95th percentile of χ² with two degrees of freedom, −2·ln 0.05.
const ELLIPSE_95: f64 = 5.991_464_547_107_979;

/// The estimate of one contact.
pub(super) fn locate(search: &Search, reading: &[f64], scratch: &mut Scratch) -> Estimate {
    let square = search.whiten(reading, scratch);
    let (minima, count) = search.minima(square, scratch);
    let (minima, best) = (&minima[..count], minima[0]);
    let (modes, count) = search.modes(&scratch.whitened, minima, &scratch.profile);
    let modes = &modes[..count];
    if square <= best.misfit + search.charge && square <= search.worst_noise {
        return Estimate::of_position(position(&modes[0]), Status::NoContact);
    }
    let alone = |mode: &Mode| contact(search, mode, mode.covariance);
    let mut estimate = Estimate::of_contact(contact(search, &modes[0], region(modes)), Status::Located);
    for mode in modes[1..].iter().filter(|mode| mode.weight >= MODE_THAT_MATTERS) {
        estimate.modes.push(palpate_core::Mode { contact: alone(mode), probability: mode.weight });
        estimate.status = Status::Ambiguous;
    }
    if best.misfit > search.worst_misfit {
        estimate.status = Status::OutsideModel;
    }
    estimate
}

/// The covariance about the first mode whose 95 % ellipse holds 95 % of the probability: that of the mode where it is
/// alone; else the moments of all modes about it, grown until the ellipse reaches as many of them as that takes.
fn region(modes: &[Mode]) -> [f64; 6] {
    let first = &modes[0];
    if first.weight >= 1.0 - MODE_THAT_MATTERS {
        return first.covariance;
    }
    let away = |mode: &Mode| [0, 1, 2].map(|k| mode.mean[k] - first.mean[k]);
    let mut covariance = [0.0; 6];
    for mode in modes {
        let [x, y, f] = away(mode);
        let squares = [x * x, x * y, x * f, y * y, y * f, f * f];
        for ((sum, own), square) in covariance.iter_mut().zip(mode.covariance).zip(squares) {
            *sum += mode.weight * (own + square);
        }
    }
    let [xx, xy, _, yy, ..] = covariance;
    let determinant = xx * yy - xy * xy;
    let (mut held, mut growth) = (0.0, 1.0f64);
    for mode in modes {
        if held < 0.95 && determinant > 0.0 {
            let [x, y, _] = away(mode);
            let distance = (x * x * yy - 2.0 * x * y * xy + y * y * xx) / determinant;
            growth = growth.max(distance / ELLIPSE_95);
        }
        held += mode.weight;
    }
    covariance.map(|value| growth * value)
}

fn position(mode: &Mode) -> Position {
    Position { x_m: mode.mean[0], y_m: mode.mean[1] }
}

/// A contact with an uncertainty that is held to the surface.
fn contact(search: &Search, mode: &Mode, covariance: [f64; 6]) -> ContactEstimate {
    let interval = |k: usize, variance: f64| {
        let half_m = NORMAL_95 * variance.sqrt();
        ((mode.mean[k] - half_m).max(0.0), (mode.mean[k] + half_m).min(search.size_m[k]))
    };
    let uncertainty =
        Uncertainty { covariance, x_95_m: interval(0, covariance[0]), y_95_m: interval(1, covariance[3]) };
    ContactEstimate { position: position(mode), force_n: Some(mode.mean[2]), uncertainty: Some(uncertainty) }
}
