//! Contacts from the beam's equations.

use serde::{Deserialize, Serialize};

use super::balance::Balance;
use super::posterior::{Posterior, RARE};
use super::segment::Segment;
use crate::fit::{Locate, LocatorFault};
use crate::setup::Setup;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, Sensor, SensorKind};
use palpate_mechanics::surface::{Beam, Surface};
use palpate_numerics::{chi_squared_bound, normal_interval_95};

/// A closed form that locates; see [`ClosedForm`](super::ClosedForm).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClosedFormLocator {
    /// The surface.
    pub beam: Beam,
    /// Its sensors.
    pub layout: Layout,
    /// The contact's force in newtons, where it is known.
    pub force_n: Option<f64>,
}

impl ClosedFormLocator {
    /// Channels that are not dead and that see a contact somewhere.
    pub(super) fn seeing(&self) -> Vec<usize> {
        let sees = |sensor: &Sensor| {
            let quarters = [0.25, 0.5, 0.75].map(|share| Position::along(share * self.beam.length_m));
            let influence = |contact: Position| self.beam.influence(sensor.kind, sensor.position, contact);
            !sensor.channel.dead && quarters.into_iter().any(|contact| influence(contact) != 0.0)
        };
        (0..self.layout.len()).filter(|i| sees(&self.layout.sensors[*i])).collect()
    }

    /// What each channel's readings are multiplied by: 1/σ where every noise is known, else 1/full scale.
    fn weights(&self, channels: &[usize]) -> Weights {
        let sensors = || channels.iter().map(|i| &self.layout.sensors[*i]);
        let known: Vec<f64> = sensors().map(|s| 1.0 / s.channel.reading_sd()).collect();
        if known.iter().all(|weight| weight.is_finite()) {
            return Weights { weights: known, noise: Noise::Known };
        }
        let weights = sensors().map(|s| 1.0 / self.beam.full_scale(s.kind)).collect();
        Weights { weights, noise: Noise::Unknown }
    }

    /// The stretches between neighbouring sensors, supports included.
    fn segments(&self, channels: &[usize], weights: &[f64]) -> Vec<Segment> {
        let length_m = self.beam.length_m;
        let mut ends: Vec<f64> = channels.iter().map(|i| self.layout.sensors[*i].position.x_m).collect();
        ends.extend([0.0, length_m]);
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * length_m);
        let influence = |channel: usize, contact_m: f64| {
            let sensor = &self.layout.sensors[channels[channel]];
            weights[channel] * self.beam.influence(sensor.kind, sensor.position, Position::along(contact_m))
        };
        ends.windows(2).map(|pair| Segment::new(pair[0], pair[1], channels.len(), influence)).collect()
    }

    /// The channels under the left and the right support, where the layout sees a contact by these two alone.
    fn scales(&self, channels: &[usize]) -> Option<(usize, usize)> {
        let &[first, second] = channels else { return None };
        let sensor = |i: usize| &self.layout.sensors[i];
        let reactions = [first, second].iter().all(|i| sensor(*i).kind == SensorKind::Reaction);
        let (a, b) = (sensor(first).position.x_m, sensor(second).position.x_m);
        let apart = (a - b).abs() > 0.5 * self.beam.length_m;
        (reactions && apart).then_some(if a < b { (first, second) } else { (second, first) })
    }

    fn balance(&self, (left, right): (usize, usize), reading: &[f64], noise: Noise) -> Estimate {
        let length_m = self.beam.length_m;
        let variances = [left, right].map(|i| self.layout.sensors[i].channel.reading_sd().powi(2));
        let balance = Balance { length_m, left_n: reading[left], right_n: reading[right], variances };
        let balanced = match self.force_n {
            Some(force_n) => balance.known_force(force_n),
            None => balance.unknown_force(),
        };
        let misfit_n = balance.left_n + balance.right_n - balanced.force_n;
        let tolerated = match noise {
            Noise::Known => chi_squared_bound(RARE, 1) * variances.iter().sum::<f64>(),
            Noise::Unknown => (0.1 * balanced.force_n).powi(2),
        };
        let [xx, xf, ff] = balanced.covariance;
        let sd_m = xx.sqrt();
        let on_surface = self.beam.contains(Position::along(balanced.position_m));
        let near = |edge_m: f64| noise == Noise::Known && (balanced.position_m - edge_m).abs() <= 3.0 * sd_m;
        let (status, position_m) = if balanced.force_n <= 0.0 || misfit_n.powi(2) > tolerated {
            (Status::OutsideModel, balanced.position_m)
        } else if on_surface || near(0.0) || near(length_m) {
            // Noise may carry a contact at the very edge a little beyond it.
            (Status::Located, balanced.position_m.clamp(0.0, length_m))
        } else {
            (Status::OutsideSurface, balanced.position_m)
        };
        let uncertainty = (noise == Noise::Known).then_some(Uncertainty {
            covariance: [xx, 0.0, xf, 0.0, 0.0, ff],
            x_95_m: normal_interval_95(balanced.position_m, sd_m),
            y_95_m: (0.0, 0.0),
        });
        let position = Position::along(position_m);
        let contact = ContactEstimate { position, force_n: Some(balanced.force_n), uncertainty };
        Estimate::of_contact(contact, status)
    }
}

/// Whether the layout says how noisy its channels are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Noise {
    Known,
    Unknown,
}

struct Weights {
    weights: Vec<f64>,
    noise: Noise,
}

impl Locate for ClosedFormLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let channels = self.seeing();
        let Weights { weights, noise } = self.weights(&channels);
        let whitened: Vec<f64> = channels.iter().zip(&weights).map(|(i, w)| w * reading[*i]).collect();
        let size: f64 = whitened.iter().map(|r| r * r).sum();
        let silent = if noise == Noise::Known { chi_squared_bound(RARE, whitened.len()) } else { 0.0 };
        if size <= silent {
            return Estimate::of_position(Position::default(), Status::NoContact);
        }
        if let Some(scales) = self.scales(&channels) {
            return self.balance(scales, reading, noise);
        }
        let segments = self.segments(&channels, &weights);
        Posterior { segments: &segments, reading: &whitened, force_n: self.force_n, noise }.estimate()
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("sensors", setup.layout.len(), self.layout.len())?;
        let beam =
            [self.beam.length_m, self.beam.width_m, self.beam.thickness_m, self.beam.youngs_modulus_pa];
        LocatorFault::check_numbers("beam", beam, |x| x > 0.0, "a number greater than 0")?;
        let places = self.layout.sensors.iter().map(|sensor| sensor.position.x_m);
        let on_beam = |x: f64| self.beam.contains(Position::along(x));
        LocatorFault::check_numbers("sensor position", places, on_beam, "on the beam")?;
        LocatorFault::check_numbers("force", self.force_n, |x| x > 0.0, "a number greater than 0")?;
        let (needed, found) = (1 + usize::from(self.force_n.is_none()), self.seeing().len());
        if found < needed {
            return Err(LocatorFault::Count { what: "sensors that see a contact", needed, found });
        }
        Ok(())
    }
}
