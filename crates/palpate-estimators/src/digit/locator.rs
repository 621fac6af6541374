//! Contacts of a flexible digit from its strain gauges.

use serde::{Deserialize, Serialize};

use super::fitting::DigitTheory;
use super::gauges::gauges;
use super::likelihood::Likelihood;
use super::posterior::{Piece, Posterior};
use super::shape::DigitShape;
use crate::fit::{Locate, LocatorFault};
use crate::setup::Setup;
use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{Digit, Surface};
use palpate_numerics::{chi_squared_bound, held_interval, normal_interval_95};

/// A reading that noise gives as rarely as this has another cause.
const RARE: f64 = 1e-3;
/// Explanations whose probabilities sum to less than this are not spoken of.
const NEGLIGIBLE: f64 = 0.05;
/// Where one gauge sees a contact alone, an interval wider than this share of the length is no place.
const WIDE: f64 = 0.01;

/// A digit's estimator that locates; see [`DigitEstimator`](super::DigitEstimator).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DigitLocator {
    /// The finger.
    pub digit: Digit,
    /// Its gauges.
    pub layout: Layout,
    /// The contact's force in newtons, where it is known.
    pub force_n: Option<f64>,
    /// What the gauges read.
    pub theory: DigitTheory,
}

impl DigitLocator {
    /// The shape of the finger at an estimated contact, at `steps` + 1 points from clamp to tip.
    pub fn shape(&self, contact: &ContactEstimate, steps: usize) -> DigitShape {
        DigitShape::new(&self.digit, contact, steps)
    }

    /// Leaves a dead gauge out from now on; false, with nothing changed, when too few would be left.
    pub fn leave_out(&mut self, gauge: usize) -> bool {
        let needed = 1 + usize::from(self.force_n.is_none());
        let Some(sensor) = self.layout.sensors.get_mut(gauge) else { return false };
        let was_dead = std::mem::replace(&mut sensor.channel.dead, true);
        if self.living() < needed {
            self.layout.sensors[gauge].channel.dead = was_dead;
            return false;
        }
        true
    }

    /// Gauges that are not dead.
    pub(super) fn living(&self) -> usize {
        self.layout.sensors.iter().filter(|sensor| !sensor.channel.dead).count()
    }

    /// The first living gauge without noise and resolution.
    pub(super) fn gauge_without_noise(&self) -> Option<usize> {
        let clean = |sd: f64| !(sd > 0.0 && sd.is_finite());
        self.layout
            .sensors
            .iter()
            .position(|sensor| !sensor.channel.dead && clean(sensor.channel.reading_sd()))
    }

    fn estimate(&self, mut posterior: Posterior, freedom: usize) -> Estimate {
        let explained = posterior.keep_explanations(chi_squared_bound(RARE, freedom.max(1)));
        let Some(best) = posterior.pieces.first() else {
            return Estimate::of_position(Position::default(), Status::OutsideModel);
        };
        let length_m = self.digit.length_m;
        let quantile_m = |share: f64| posterior.quantile_m(share, length_m);
        let ends = (quantile_m(0.025), quantile_m(0.975));
        let mut estimate = Estimate::of_contact(contact(best, ends), Status::Located);
        if !explained {
            estimate.status = Status::OutsideModel;
            return estimate;
        }
        let others: Vec<&Piece> =
            posterior.pieces[1..].iter().filter(|piece| are_apart(best, piece)).collect();
        let elsewhere: f64 = others.iter().map(|piece| piece.probability).sum();
        if elsewhere > NEGLIGIBLE || (best.is_curve() && ends.1 - ends.0 > WIDE * length_m) {
            estimate.status = Status::Ambiguous;
            for other in others.into_iter().filter(|other| other.probability > 0.1 * NEGLIGIBLE) {
                let sd_m = other.covariance[0].sqrt();
                let ends = held_interval(normal_interval_95(other.best.position_m, sd_m), length_m);
                if !estimate
                    .modes
                    .push(Mode { contact: contact(other, ends), probability: other.probability })
                {
                    break;
                }
            }
        }
        estimate
    }
}

/// Whether two pieces are two places, not the two sides of a gauge.
fn are_apart(a: &Piece, b: &Piece) -> bool {
    let reach_m = 3.0 * (a.covariance[0].sqrt() + b.covariance[0].sqrt());
    (a.best.position_m - b.best.position_m).abs() > reach_m
}

fn contact(piece: &Piece, x_95_m: (f64, f64)) -> ContactEstimate {
    let [xx, xf, ff] = piece.covariance;
    let uncertainty = Uncertainty { covariance: [xx, 0.0, xf, 0.0, 0.0, ff], x_95_m, y_95_m: (0.0, 0.0) };
    ContactEstimate {
        position: Position::along(piece.best.position_m),
        force_n: Some(piece.best.force_n),
        uncertainty: Some(uncertainty),
    }
}

impl Locate for DigitLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let gauges = gauges(&self.layout, reading);
        let size: f64 = gauges.iter().map(|gauge| (gauge.strain / gauge.sd).powi(2)).sum();
        let none_saturated = gauges.len() == self.living();
        if none_saturated && size <= chi_squared_bound(RARE, gauges.len().max(1)) {
            return Estimate::of_position(Position::default(), Status::NoContact);
        }
        let likelihood =
            Likelihood { digit: &self.digit, theory: self.theory, gauges: &gauges, force_n: self.force_n };
        let unknowns = 1 + usize::from(self.force_n.is_none());
        self.estimate(Posterior::new(&likelihood), gauges.len().saturating_sub(unknowns))
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("gauges", setup.layout.len(), self.layout.len())?;
        let others = self.layout.kinds().into_iter().filter(|kind| *kind != SensorKind::Strain).count();
        LocatorFault::check_count("sensors that are no gauges", 0, others)?;
        let Digit { length_m, width_m, thickness_m, youngs_modulus_pa, .. } = self.digit;
        let sizes = [length_m, width_m, thickness_m, youngs_modulus_pa, self.digit.characteristic_force_n()];
        LocatorFault::check_numbers("digit", sizes, |x| x > 0.0, "a number greater than 0")?;
        let places = self.layout.sensors.iter().map(|sensor| sensor.position.x_m);
        let on_digit = |x: f64| self.digit.contains(Position::along(x));
        LocatorFault::check_numbers("gauge position", places, on_digit, "on the digit")?;
        let noise = self
            .layout
            .sensors
            .iter()
            .filter(|sensor| !sensor.channel.dead)
            .map(|sensor| sensor.channel.reading_sd());
        LocatorFault::check_numbers("gauge noise", noise, |sd| sd > 0.0, "a number greater than 0")?;
        LocatorFault::check_numbers("force", self.force_n, |x| x > 0.0, "a number greater than 0")?;
        let (needed, found) = (1 + usize::from(self.force_n.is_none()), self.living());
        if found < needed {
            return Err(LocatorFault::Count { what: "living gauges", needed, found });
        }
        Ok(())
    }
}
