//! Closed-form contact position and force of a beam (Ellis and others 1994; Stone and Brett 1995).
//!
//! Influence functions are cubic between sensors, so least-squares estimates are roots of polynomials.

mod polynomial;

use serde::{Deserialize, Serialize};

use crate::confidence_region::{Contacts, Force, interval_on_line_95, is_near_end};
use crate::distributed_contact::{BoundedContact, distributed_contact_bound, distributed_contact_score};
use crate::fit::{ChannelMismatch, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::force_prior::DECADE;
use crate::model_offsets::{check_offsets, less_offsets, offsets_of};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::{
    FalseAlarmRate, LINE_PLACES, NO_CONTACT, OTHER_PLACE, StatusRule, chi_squared_bound, unknowns,
};
use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, Sensor, SensorKind};
use palpate_mechanics::surface::{Beam, Surface, SurfaceSpec};
use palpate_numerics::small::Ldl;
use palpate_numerics::watch::Cancelled;
use palpate_numerics::{NORMAL_95, clamped_interval, normal_interval_95};
use polynomial::Polynomial;

/// Closed-form estimator of a beam, without training.
///
/// - Scales under both supports alone: a = l·R_right/(R_left + R_right), W = R_left + R_right.
/// - Otherwise: noise-weighted least squares of position and unknown force.
///
/// First-order uncertainty from noise and quantisation. Without noise there is none, and a residual above a
/// tenth of the reading is outside the model.
///
/// ```
/// use palpate_estimators::{arrangement::Training, fit::Fit, setup::Setup, closed_form::ClosedForm};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(20), 0)?;
/// let estimate = ClosedForm::default().fit(&setup, &presses)?.locate(&presses.rows[9].reading)?;
/// assert!((estimate.contact.position.x_m - mm(190.0)).abs() < mm(2.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClosedForm {
    /// False-alarm rate.
    pub false_alarm_rate: FalseAlarmRate,
}

/// Setup that the closed form does not suit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClosedFormFitError {
    /// Surface without a model.
    #[error("the closed form needs a beam's dimensions and stiffness; a measured surface has no model")]
    NoModel,
    /// Surface other than a beam.
    #[error("the closed form needs a beam on two simple supports; the surface is another one")]
    NotABeam,
    /// Raw channel.
    #[error(
        "the closed form needs deflection, slope, strain or reaction sensors; the layout has a {kind} channel"
    )]
    NotModelled {
        /// Quantity of the channel.
        kind: SensorKind,
    },
    /// Too few sensitive sensors.
    #[error(
        "the closed form needs at least {needed} sensors that see a contact ({}); the layout has {found}",
        if *needed == 1 { "the force is known" } else { "the force is unknown" }
    )]
    TooFewSensors {
        /// Number of unknowns: position, and force where unknown.
        needed: usize,
        /// Number of sensitive sensors.
        found: usize,
    },
    /// Channel mismatch.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for ClosedForm {
    type Method = ClosedFormLocator;
    type Error = ClosedFormFitError;

    fn fit_method(
        &self,
        FitTask { setup, recording, .. }: FitTask,
    ) -> Result<ClosedFormLocator, ClosedFormFitError> {
        if setup.surface().model().is_none() {
            return Err(ClosedFormFitError::NoModel);
        }
        let SurfaceSpec::Beam(beam) = setup.surface() else { return Err(ClosedFormFitError::NotABeam) };
        if let Some(kind) = setup.layout().kinds().into_iter().find(|kind| *kind == SensorKind::Raw) {
            return Err(ClosedFormFitError::NotModelled { kind });
        }
        let (offsets, layout) = offsets_of(recording, setup.layout());
        let locator = ClosedFormLocator {
            beam: *beam,
            layout,
            offsets,
            force_n: setup.force_n(),
            greatest_force_n: if setup.force_n().is_none() {
                greatest_force_n(setup, recording)
            } else {
                None
            },
            false_alarm_rate: self.false_alarm_rate,
        };
        let (needed, found) = (unknowns(1, setup.force_n()), locator.sensitive_sensors().len());
        if found < needed { Err(ClosedFormFitError::TooFewSensors { needed, found }) } else { Ok(locator) }
    }
}

/// Fitted [`ClosedForm`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClosedFormLocator {
    /// Surface.
    pub beam: Beam,
    /// Sensors.
    pub layout: Layout,
    /// Known force.
    pub force_n: Option<f64>,
    /// Upper bound of an unknown force, where given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub greatest_force_n: Option<f64>,
    /// False-alarm rate.
    #[serde(default)]
    pub false_alarm_rate: FalseAlarmRate,
    /// Offsets in SI units; empty without untouched rows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offsets: Vec<f64>,
}

impl ClosedFormLocator {
    fn sensitive_sensors(&self) -> Vec<usize> {
        let sees = |sensor: &Sensor| {
            let quarters = [0.25, 0.5, 0.75].map(|share| Position::along(share * self.beam.length_m()));
            let influence = |contact: Position| self.beam.influence(sensor.kind, sensor.position, contact);
            !sensor.channel.disabled && quarters.into_iter().any(|contact| influence(contact) != 0.0)
        };
        (0..self.layout.len()).filter(|i| sees(&self.layout.sensors()[*i])).collect()
    }

    /// True where the layout gives all noise, which detection needs.
    pub fn has_known_noise(&self) -> bool {
        self.weights(&self.sensitive_sensors()).1 == Noise::Known
    }

    /// 1/σ where all noise is known, else 1/full scale.
    fn weights(&self, channels: &[usize]) -> (Vec<f64>, Noise) {
        let sensors = || channels.iter().map(|i| &self.layout.sensors()[*i]);
        let known: Vec<f64> = sensors().map(|s| 1.0 / s.channel.reading_sd()).collect();
        if known.iter().all(|weight| weight.is_finite()) {
            return (known, Noise::Known);
        }
        (sensors().map(|s| 1.0 / self.beam.full_scale(s.kind)).collect(), Noise::Unknown)
    }

    fn segments(&self, channels: &[usize], weights: &[f64]) -> Vec<Segment> {
        let length_m = self.beam.length_m();
        let mut ends: Vec<f64> = channels.iter().map(|i| self.layout.sensors()[*i].position.x_m).collect();
        ends.extend([0.0, length_m]);
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * length_m);
        let influence = |channel: usize, contact_m: f64| {
            let sensor = &self.layout.sensors()[channels[channel]];
            weights[channel] * self.beam.influence(sensor.kind, sensor.position, Position::along(contact_m))
        };
        ends.windows(2).map(|pair| Segment::new(pair[0], pair[1], channels.len(), influence)).collect()
    }

    fn scales(&self, channels: &[usize]) -> Option<(usize, usize)> {
        let &[first, second] = channels else { return None };
        let sensor = |i: usize| &self.layout.sensors()[i];
        let reactions = [first, second].iter().all(|i| sensor(*i).kind == SensorKind::Reaction);
        let (a, b) = (sensor(first).position.x_m, sensor(second).position.x_m);
        let apart = (a - b).abs() > 0.5 * self.beam.length_m();
        (reactions && apart).then_some(if a < b { (first, second) } else { (second, first) })
    }

    /// Unknown force: a = l·R_right/W and W = R_left + R_right, with ∂a/∂R_left = −a/W, ∂a/∂R_right = (l −
    /// a)/W, ∂W/∂R = 1. Known force: least squares of R_left = W·(1 − a/l) and R_right = W·a/l.
    fn balance(&self, (left, right): (usize, usize), reading: &[f64], noise: Noise) -> Estimate {
        let length_m = self.beam.length_m();
        let (left_n, right_n) = (reading[left], reading[right]);
        let [var_left, var_right] =
            [left, right].map(|i| self.layout.sensors()[i].channel.reading_sd().powi(2));
        let (position_m, force_n, covariance) = match self.force_n {
            None => {
                let force_n = left_n + right_n;
                let position_m = length_m * right_n / force_n;
                let slopes = [-position_m / force_n, (length_m - position_m) / force_n];
                let xx = slopes[0] * slopes[0] * var_left + slopes[1] * slopes[1] * var_right;
                let xf = slopes[0] * var_left + slopes[1] * var_right;
                (position_m, force_n, [xx, xf, var_left + var_right])
            }
            Some(force_n) => {
                let weight = |variance: f64| if variance > 0.0 { 1.0 / variance } else { 1.0 };
                let (left, right) = (weight(var_left), weight(var_right));
                let share = (right * right_n + left * (force_n - left_n)) / ((left + right) * force_n);
                let noise =
                    (right * right * var_right + left * left * var_left) / ((left + right) * force_n).powi(2);
                (length_m * share, force_n, [length_m.powi(2) * noise, 0.0, 0.0])
            }
        };
        let misfit_n = left_n + right_n - force_n;
        let tolerated = match noise {
            Noise::Known => chi_squared_bound(1) * (var_left + var_right),
            Noise::Unknown => (0.1 * force_n).powi(2),
        };
        let sd_m = covariance[0].sqrt();
        let is_too_hard = self.greatest_force_n.is_some_and(|most_n| force_n > most_n);
        let on_surface = self.beam.contains(Position::along(position_m));
        let near = |edge_m: f64| noise == Noise::Known && (position_m - edge_m).abs() <= 3.0 * sd_m;
        let (status, held_m) = if force_n <= 0.0 || is_too_hard || misfit_n.powi(2) > tolerated {
            (Status::OutsideModel, position_m)
        } else if on_surface || near(0.0) || near(length_m) {
            // Noise may shift the estimate of a contact at an edge beyond it.
            (Status::Located, position_m.clamp(0.0, length_m))
        } else {
            (Status::OutsideSurface, position_m)
        };
        let interval = |x_m: f64, sd_m: f64| match status {
            Status::Located => interval_on_line_95(x_m, sd_m, length_m),
            _ => normal_interval_95(x_m, sd_m),
        };
        let uncertainty =
            (noise == Noise::Known).then(|| Uncertainty::on_line(covariance, interval(position_m, sd_m)));
        let position = Position::along(held_m);
        Estimate::of_contact(ContactEstimate { position, force_n: Some(force_n), uncertainty }, status)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Noise {
    Known,
    Unknown,
}

impl Locate for ClosedFormLocator {
    type Check = NoCheck;

    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        self.has_known_noise().then_some(self.false_alarm_rate)
    }

    fn offsets(&self) -> Option<Vec<f64>> {
        (!self.offsets.is_empty()).then(|| self.offsets.clone())
    }

    fn locate(&self, reading: &[f64]) -> Estimate {
        let reading = &*less_offsets(reading, &self.offsets);
        let channels = self.sensitive_sensors();
        let (weights, noise) = self.weights(&channels);
        let whitened: Vec<f64> = channels.iter().zip(&weights).map(|(i, w)| w * reading[*i]).collect();
        let size: f64 = whitened.iter().map(|r| r * r).sum();
        let rule = match noise {
            Noise::Known => {
                StatusRule::new(channels.len(), unknowns(1, self.force_n), LINE_PLACES, self.false_alarm_rate)
            }
            Noise::Unknown => StatusRule::without_noise(size, 0.01),
        };
        let scales = self.scales(&channels);
        if let (false, Some(scales)) = (rule.is_within_noise(size), scales) {
            return self.balance(scales, reading, noise);
        }
        // χ² of a contact is at least 0, so most readings of noise need no search.
        if rule.is_no_contact(size, 0.0) {
            return NO_CONTACT;
        }
        let segments = self.segments(&channels, &weights);
        let posterior = Posterior {
            segments: &segments,
            reading: &whitened,
            force_n: self.force_n,
            greatest_force_n: self.greatest_force_n,
            noise,
        };
        let found = posterior.explanations();
        let least = found.iter().fold(f64::INFINITY, |least, explanation| least.min(explanation.chi_squared));
        if rule.is_no_contact(size, least) {
            return NO_CONTACT;
        }
        match scales {
            Some(scales) => self.balance(scales, reading, noise),
            None => posterior.estimate(found, &rule),
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("sensors", setup.layout().len(), self.layout.len())?;
        check_offsets(&self.offsets, self.layout.len())?;
        let places = self.layout.sensors().iter().map(|sensor| sensor.position.x_m);
        let on_beam = |x: f64| self.beam.contains(Position::along(x));
        LocatorFault::check_numbers("sensor position", places, on_beam, "on the beam")?;
        LocatorFault::check_numbers("force", self.force_n, |x| x > 0.0, "a number greater than 0")?;
        LocatorFault::check_numbers(
            "greatest force",
            self.greatest_force_n,
            |x| x > 0.0,
            "a number greater than 0",
        )?;
        let (needed, found) = (unknowns(1, self.force_n), self.sensitive_sensors().len());
        if found < needed {
            return Err(LocatorFault::Count { what: "sensors that see a contact", needed, found });
        }
        Ok(())
    }
}

/// χ² excess with a posterior share of e⁻¹².
const NEGLIGIBLE: f64 = 24.0;

fn greatest_force_n(setup: &Setup, recording: &Recording) -> Option<f64> {
    let hardest = recording.rows.iter().filter_map(|row| row.force_n).fold(0.0, f64::max);
    setup.greatest_force_n().or((hardest > 0.0).then_some(DECADE * hardest))
}

const ROUNDING: f64 = 1e-13;

struct Posterior<'a> {
    segments: &'a [Segment],
    reading: &'a [f64],
    force_n: Option<f64>,
    greatest_force_n: Option<f64>,
    noise: Noise,
}

#[derive(Clone, Copy, Debug)]
struct Explanation {
    from_m: f64,
    to_m: f64,
    position_m: f64,
    force_n: f64,
    chi_squared: f64,
    covariance: [f64; 3],
}

impl Posterior<'_> {
    fn estimate(&self, mut found: Vec<Explanation>, rule: &StatusRule) -> Estimate {
        found.sort_by(|a, b| self.log_weight(b).total_cmp(&self.log_weight(a)));
        let Some(best) = found.first() else {
            return Estimate::of_position(Position::default(), Status::OutsideModel);
        };
        if let Some(estimate) = self.trade_off(&found, rule) {
            return estimate;
        }
        let mut estimate = Estimate::of_contact(self.contact(best), Status::Located);
        if best.force_n <= 0.0 || !rule.is_explained(best.chi_squared) || self.is_distributed(&found) {
            estimate.status = Status::OutsideModel;
            return estimate;
        }
        let share = |e: &Explanation| (self.log_weight(e) - self.log_weight(best)).exp();
        let total: f64 = found.iter().map(share).sum();
        for other in &found[1..] {
            let mode = Mode { contact: self.contact(other), probability: share(other) / total };
            if mode.probability >= OTHER_PLACE {
                estimate.modes.push(mode);
            }
        }
        if !estimate.modes.as_slice().is_empty() || best.to_m - best.from_m > 0.01 * self.length_m() {
            estimate.status = Status::Ambiguous;
        }
        estimate
    }

    /// `None` without a trade-off, and for unknown noise.
    fn trade_off(&self, found: &[Explanation], rule: &StatusRule) -> Option<Estimate> {
        if self.noise == Noise::Unknown {
            return None;
        }
        let least = found.iter().fold(f64::INFINITY, |least, at| least.min(at.chi_squared));
        let competes = |at: &&Explanation| at.chi_squared <= least + NEGLIGIBLE;
        let is_near = |at: &Explanation| is_near_end(at.position_m, at.covariance[0].sqrt(), self.length_m());
        let force = self.force_n.map_or_else(|| Force::at_most(self.greatest_force_n), Force::Known);
        let is_too_hard = |at: &Explanation| matches!(force, Force::AtMost(most) if at.force_n > most);
        if !found.iter().filter(competes).any(|at| is_near(at) || is_too_hard(at)) {
            return None;
        }
        let channels = |x_m: f64, _: f64, channels: &mut Vec<[f64; 2]>| {
            channels.clear();
            channels.extend(self.reading.iter().zip(self.influence_at(x_m)).map(|(d, (f, _))| [*d, f]));
            0.0
        };
        let strongest = found.iter().map(|at| at.force_n).fold(0.0, f64::max);
        let contacts = Contacts {
            length_m: self.length_m(),
            force,
            widening: 1.0,
            reference_force_n: self.greatest_force_n.unwrap_or(strongest),
            extrapolates: false,
            channels: &channels,
        };
        let minima_m: Vec<f64> = found.iter().map(|at| at.position_m).collect();
        let region = contacts.confidence_region(&minima_m)?;
        let mut estimate = Estimate::of_position(Position::default(), Status::Located);
        region.write(&mut estimate);
        if found[0].to_m - found[0].from_m > 0.01 * self.length_m() {
            estimate.status = Status::Ambiguous;
        }
        let is_pull = estimate.contact.force_n.is_none_or(|force_n| force_n <= 0.0);
        if is_pull || !rule.is_explained(region.misfit) || self.is_distributed(found) {
            estimate.status = Status::OutsideModel;
        }
        Some(estimate)
    }

    fn is_distributed(&self, found: &[Explanation]) -> bool {
        let least = found.iter().fold(f64::INFINITY, |least, at| least.min(at.chi_squared));
        let competes = |at: &&Explanation| at.chi_squared <= least + NEGLIGIBLE;
        let bound = distributed_contact_bound(1);
        // The squared residual is at least its component along the test direction.
        let is_spread =
            |at: &Explanation| at.chi_squared > bound && self.distributed_contact_score(at) > bound;
        self.noise == Noise::Known && found.iter().filter(competes).all(is_spread)
    }

    fn distributed_contact_score(&self, Explanation { position_m, force_n, .. }: &Explanation) -> f64 {
        let reads = |[x_m, _, force_n]: [f64; 3]| -> Vec<f64> {
            self.influence_at(x_m).iter().map(|(f, _)| force_n * f).collect()
        };
        let force_ends = self.force_n.map_or((0.0, f64::INFINITY), |force_n| (force_n, force_n));
        let at = [*position_m, 0.0, *force_n];
        let about = BoundedContact { at, ends: [(0.0, self.length_m()), (0.0, 0.0), force_ends] };
        distributed_contact_score(about, self.reading.iter().copied(), reads)
    }

    fn influence_at(&self, x_m: f64) -> Vec<(f64, f64)> {
        let segment = self.segments.iter().find(|segment| x_m <= segment.to_m).or(self.segments.last());
        segment.map(|segment| segment.influence_at(x_m)).unwrap_or_default()
    }

    fn length_m(&self) -> f64 {
        self.segments.last().map_or(0.0, |segment| segment.to_m)
    }

    fn size(&self) -> f64 {
        self.reading.iter().map(|r| r * r).sum()
    }

    /// The squared residual is monotone between stationary points and segment ends.
    fn explanations(&self) -> Vec<Explanation> {
        let mut candidates: Vec<Explanation> = Vec::new();
        for segment in self.segments {
            let places = segment.candidates(self.reading, self.force_n);
            candidates.extend(places.into_iter().map(|position_m| self.explanation(segment, position_m)));
        }
        candidates.sort_by(|a, b| a.position_m.total_cmp(&b.position_m));
        let same = ROUNDING * self.size();
        let mut stretches: Vec<Explanation> = Vec::new();
        for next in candidates {
            match stretches.last_mut() {
                Some(last) if (last.chi_squared - next.chi_squared).abs() <= same => {
                    last.to_m = next.to_m;
                    // Middle of an interval of equally good positions.
                    last.position_m = 0.5 * (last.from_m + last.to_m);
                }
                _ => stretches.push(next),
            }
        }
        let chi =
            |i: Option<usize>| i.and_then(|i| stretches.get(i)).map_or(f64::INFINITY, |e| e.chi_squared);
        let lowest = |i: &usize| chi(Some(*i)) < chi(i.checked_sub(1)) && chi(Some(*i)) < chi(Some(i + 1));
        (0..stretches.len()).filter(lowest).map(|i| stretches[i]).collect()
    }

    fn explanation(&self, segment: &Segment, position_m: f64) -> Explanation {
        let influence = segment.influence_at(position_m);
        let (mut n, mut d) = (0.0, 0.0);
        for ((h, _), r) in influence.iter().zip(self.reading) {
            n += r * h;
            d += h * h;
        }
        let best = if d > 0.0 { (n / d).max(0.0) } else { 0.0 };
        let force_n = self.force_n.unwrap_or(best);
        let residual = influence.iter().zip(self.reading).map(|((h, _), r)| (r - force_n * h).powi(2));
        Explanation {
            from_m: position_m,
            to_m: position_m,
            position_m,
            force_n,
            chi_squared: residual.sum(),
            covariance: self.covariance(&influence, force_n),
        }
    }

    /// (JᵀJ)⁻¹ with J = (W·h̃′, h̃); l²/12 for an undetermined position.
    fn covariance(&self, influence: &[(f64, f64)], force_n: f64) -> [f64; 3] {
        let (mut xx, mut xf, mut ff) = (0.0, 0.0, 0.0);
        for (h, slope) in influence {
            xx += (force_n * slope).powi(2);
            xf += force_n * slope * h;
            ff += h * h;
        }
        let most = self.length_m().powi(2) / 12.0;
        if self.force_n.is_some() {
            return [most.min(1.0 / xx), 0.0, 0.0];
        }
        match Ldl::new(&[[ff, xf], [xf, xx]]) {
            Some(factors) => {
                let [_, [_, of_position]] = factors.inverse();
                let (variance, slope) = (most.min(of_position), -xf / ff);
                // cov(a, W) = slope·var a and var W = 1/ff + slope²·var a, for any var a.
                [variance, slope * variance, 1.0 / ff + slope * slope * variance]
            }
            None => [most, 0.0, if ff > 0.0 { 1.0 / ff } else { 0.0 }],
        }
    }

    /// Laplace's method; only exact explanations for unknown noise.
    fn log_weight(&self, explanation: &Explanation) -> f64 {
        match self.noise {
            Noise::Known => {
                let width = (explanation.to_m - explanation.from_m).powi(2) / 12.0;
                let [xx, xf, ff] = explanation.covariance;
                let volume = if self.force_n.is_some() { xx } else { (xx * ff - xf * xf).max(0.0) };
                -0.5 * explanation.chi_squared + 0.5 * volume.max(width * ff).max(f64::MIN_POSITIVE).ln()
            }
            Noise::Unknown => -0.5 * explanation.chi_squared / (1e-10 * self.size()),
        }
    }

    fn contact(&self, explanation: &Explanation) -> ContactEstimate {
        let Explanation { from_m, to_m, position_m, covariance: [xx, xf, ff], .. } = *explanation;
        let half_m = NORMAL_95 * xx.sqrt();
        let uncertainty = Uncertainty::on_line(
            [xx.max((to_m - from_m).powi(2) / 12.0), xf, ff],
            clamped_interval((from_m - half_m, to_m + half_m), self.length_m()),
        );
        ContactEstimate {
            position: Position::along(position_m),
            force_n: Some(explanation.force_n),
            uncertainty: (self.noise == Noise::Known).then_some(uncertainty),
        }
    }
}

/// Segment between neighbouring sensors or supports.
///
/// Symbols: r̃ reading and h̃(a) influence at position a, both whitened; W force; N = r̃ᵀh̃, D = h̃ᵀh̃. The
/// squared residual is
///
/// ```text
/// |r̃|² − N²/D            best force,  stationary where 2·N′·D − N·D′ = 0   (degree 8)
/// |r̃|² − 2·W·N + W²·D    known force, stationary where W·D′ − 2·N′ = 0     (degree 5)
/// ```
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    from_m: f64,
    to_m: f64,
    /// Polynomials of t = (a − from)/(to − from).
    influence: Vec<Polynomial>,
    /// h̃ over t or 1 − t where h̃ = 0 at that end, as N²/D would be 0/0.
    reduced: Vec<Polynomial>,
    mirrored: bool,
    start: f64,
}

const BESIDE: f64 = 1e-6;

impl Segment {
    fn new(from_m: f64, to_m: f64, channels: usize, influence: impl Fn(usize, f64) -> f64) -> Self {
        let at = |t: f64| from_m + t * (to_m - from_m);
        let cubic = |channel: usize| {
            Polynomial::cubic_through([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|t| influence(channel, at(t))))
        };
        let polynomials: Vec<Polynomial> = (0..channels).map(cubic).collect();
        let vanish = |t: f64| polynomials.iter().all(|p| p.value_at(t).abs() <= 1e-12 * p.size());
        let mirrored = vanish(1.0) && !vanish(0.0);
        let mut reduced = polynomials.clone();
        if mirrored {
            reduced = reduced.iter().map(Polynomial::mirrored).collect();
        }
        if mirrored || vanish(0.0) {
            reduced = reduced.iter().map(Polynomial::over_t).collect();
        }
        let start = if mirrored || vanish(0.0) { BESIDE } else { 0.0 };
        Self { from_m, to_m, influence: polynomials, reduced, mirrored, start }
    }

    fn candidates(&self, reading: &[f64], force_n: Option<f64>) -> Vec<f64> {
        let functions = if force_n.is_some() { &self.influence } else { &self.reduced };
        let (mut n, mut d) = (Polynomial::zero(), Polynomial::zero());
        for (h, r) in functions.iter().zip(reading) {
            n = n.plus(*r, h);
            d = d.plus(1.0, &h.times(h));
        }
        let stationary = match force_n {
            Some(force_n) => n.derivative().plus(-0.5 * force_n, &d.derivative()),
            None => n.derivative().times(&d).plus(-0.5, &n.times(&d.derivative())),
        };
        let mirrored = self.mirrored && force_n.is_none();
        let place = |t: f64| self.from_m + (self.to_m - self.from_m) * if mirrored { 1.0 - t } else { t };
        let start = if force_n.is_some() { 0.0 } else { self.start };
        let turns = stationary.sign_changes().into_iter().filter(|t| *t > start);
        [start, 1.0].into_iter().chain(turns).map(place).collect()
    }

    fn influence_at(&self, position_m: f64) -> Vec<(f64, f64)> {
        let length_m = self.to_m - self.from_m;
        let t = (position_m - self.from_m) / length_m;
        self.influence.iter().map(|h| (h.value_at(t), h.derivative().value_at(t) / length_m)).collect()
    }
}

#[cfg(test)]
mod tests;
