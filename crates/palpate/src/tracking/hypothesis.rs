//! Contacts that may be: how they are born of a reading, and how two that are one are told.

use super::bank::Bank;
use super::config::TrackerConfig;
use super::gaussian::{A, Gaussian, STATES, V, W, X};
use crate::contact::{Contact, Position};
use crate::method::{ContactFit, Likelihood};
use palpate_core::{ContactEstimate, Estimate, Status};
use std::f64::consts::PI;

/// A contact that may be there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hypothesis {
    /// Tells it from every other one.
    pub id: u64,
    /// ln of its probability.
    pub weight: f64,
    pub bank: Bank,
    /// Of the last reading.
    pub fit: ContactFit,
}

/// A valley of a reading's misfit that is wider than this share of the length is born in parts no wider, since its force
/// changes along it.
const WIDEST: f64 = 1.0 / 40.0;
/// The most parts of a valley.
const MOST_PARTS: f64 = 16.0;
/// A force that is not known lies anywhere between 0 and this many times the one that explains a reading.
const FORCES: f64 = 10.0;

/// The contacts that a reading by itself can have come from, each with ln of how probable the reading is with a contact
/// there whose place and force were not known before.
pub(super) fn births(
    likelihood: &dyn Likelihood,
    config: &TrackerConfig,
    whitened: &[f64],
    alone: &Estimate,
) -> Vec<(f64, Gaussian, ContactFit)> {
    if alone.status == Status::NoContact {
        return Vec::new();
    }
    let modes = alone.modes.as_slice().iter().map(|mode| &mode.contact);
    std::iter::once(&alone.contact)
        .chain(modes)
        .flat_map(|contact| parts(likelihood, config, whitened, contact))
        .collect()
}

/// The parts of one valley.
fn parts(
    likelihood: &dyn Likelihood,
    config: &TrackerConfig,
    whitened: &[f64],
    contact: &ContactEstimate,
) -> Vec<(f64, Gaussian, ContactFit)> {
    let (Some(force_n), Some(uncertainty)) = (contact.force_n, contact.uncertainty) else {
        return Vec::new();
    };
    let (low, high) = uncertainty.x_95_m;
    let count = ((high - low) / (WIDEST * likelihood.length_m())).ceil().clamp(1.0, MOST_PARTS);
    if count == 1.0 {
        return vec![part(likelihood, config, whitened, (contact.position.x_m, force_n), None)];
    }
    let width_m = (high - low) / count;
    let place = |i: usize| (low + (i as f64 + 0.5) * width_m, force_n);
    (0..count as usize).map(|i| part(likelihood, config, whitened, place(i), Some(width_m))).collect()
}

/// A contact about a place, with the force that fits there; of a given width, or as wide as the reading leaves it.
fn part(
    likelihood: &dyn Likelihood,
    config: &TrackerConfig,
    whitened: &[f64],
    (x_m, force_n): (f64, f64),
    width_m: Option<f64>,
) -> (f64, Gaussian, ContactFit) {
    let known = likelihood.known_force_n();
    let at = |force_n| likelihood.fit_at(whitened, Contact { position: Position::along(x_m), force_n }, 0.0);
    let mut fit = at(force_n);
    let mut force_n = force_n;
    if known.is_none() && fit.information[2] > 0.0 {
        force_n = (force_n + fit.pull[1] / fit.information[2]).max(0.0);
        fit = at(force_n);
    }
    let [xx, xw, ww] = fit.information;
    let length_m = likelihood.length_m();
    // Along the valley the force goes by this many newtons a metre, and across it stays within 1/ww.
    let (tilt, across) = if known.is_some() { (0.0, 0.0) } else { (-xw / ww, 1.0 / ww) };
    let along = xx + tilt * xw;
    let variance_m2 = match width_m {
        Some(width_m) => (0.5 * width_m).powi(2),
        None => (1.0 / along).min(length_m * length_m / 12.0),
    };
    let mut covariance = [[0.0; STATES]; STATES];
    covariance[X][X] = variance_m2;
    covariance[V][V] = config.speed_sd_m_per_s.powi(2);
    covariance[A][A] = config.accelerations_m_per_s2[1].powi(2);
    covariance[W][W] = tilt * tilt * variance_m2 + across;
    (covariance[X][W], covariance[W][X]) = (tilt * variance_m2, tilt * variance_m2);
    let room_m = width_m.unwrap_or((2.0 * PI * variance_m2).sqrt()) / length_m;
    let room_n = if known.is_some() {
        1.0
    } else {
        (2.0 * PI * across).sqrt() / (FORCES * force_n.max(f64::MIN_POSITIVE))
    };
    let evidence = -0.5 * fit.misfit + (room_m * room_n).min(1.0).ln();
    (evidence, Gaussian { mean: [x_m, 0.0, 0.0, force_n], covariance }, fit)
}

/// Whether two beliefs are of one contact: closer than their own doubt in place, speed and force.
pub(super) fn are_one(a: &Gaussian, b: &Gaussian) -> bool {
    const CLOSE: f64 = 2.0;
    (0..STATES).all(|i| {
        let doubt = a.covariance[i][i] + b.covariance[i][i];
        (a.mean[i] - b.mean[i]).powi(2) <= CLOSE * CLOSE * doubt
    })
}
