//! Maximum-likelihood position, force and shape of a flexible digit with strain gauges, after Ma and others.
//!
//! Gauges beyond the contact read 0, so the likelihood has one smooth piece per segment between gauges, with
//! separate Gauss–Newton searches on the exact elastica. The posterior, with a prior flat in position and log
//! force, has one truncated Gaussian per segment. With one responding gauge and an unknown force only force
//! times lever arm is identifiable: a curve of contacts.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

use crate::fit::{ChannelMismatch, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::likelihood::ContactFit;
use crate::model_offsets::{check_offsets, less_offsets, offsets_of};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::simulate::CleanSensors;
use crate::status::{FalseAlarmRate, LINE_PLACES, NO_CONTACT, OTHER_PLACE, StatusRule, unknowns};
use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{Layout, Sensor, SensorKind};
use palpate_mechanics::surface::{Digit, Elastica, Surface, SurfaceSpec};
use palpate_numerics::small::Ldl;
use palpate_numerics::watch::Cancelled;
use palpate_numerics::{bisect, clamped_interval, extend_to, normal_cdf, normal_interval_95};

/// Maximum-likelihood estimator of a flexible digit, without training.
///
/// ```
/// use palpate_estimators::{arrangement::Training, digit::DigitEstimator, fit::Fit, setup::Setup};
/// use palpate_mechanics::sensing::SensorKind::Strain;
/// use palpate_mechanics::surface::Digit;
/// use palpate_mechanics::units::{gpa, microstrain, mm, newtons};
///
/// let digit = Digit::new(mm(120.0), mm(10.0), mm(0.5), gpa(200.0))?;
/// let gauges = Strain.at_x([4.0, 20.0, 40.0, 60.0, 80.0].map(mm)).noise(microstrain(1.0));
/// let setup = Setup::new(digit).sensors(gauges)?;
/// let presses = setup.simulate(&Training::even(12).with_force(newtons(4.0)), 0)?;
/// let locator = DigitEstimator::default().fit(&setup, &presses)?;
/// let estimate = locator.locate(&presses.rows[9].reading)?;
/// assert!((estimate.contact.position.x_m - mm(95.0)).abs() < mm(0.1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DigitEstimator {
    /// Theory of bending.
    pub theory: DigitTheory,
    /// False-alarm rate.
    pub false_alarm_rate: FalseAlarmRate,
}

impl DigitEstimator {
    /// Returns an estimator with this theory.
    pub const fn of_theory(theory: DigitTheory) -> Self {
        Self { theory, false_alarm_rate: FalseAlarmRate::DEFAULT }
    }
}

/// Theory of bending.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DigitTheory {
    /// The elastica, for bending of any size.
    #[default]
    Exact,
    /// Small deflections: strain is force times lever. For comparison, and for small forces.
    Linear,
}

/// Setup that the digit estimator does not suit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DigitFitError {
    /// Surface other than a digit.
    #[error("the digit estimator needs `kind = \"digit\"` in [surface]; the surface is another one")]
    NotADigit,
    /// Sensor other than a strain gauge.
    #[error("the digit estimator needs strain gauges; the layout has a {kind} sensor")]
    NotAGauge {
        /// Quantity of the sensor.
        kind: SensorKind,
    },
    /// Gauge without noise.
    #[error(
        "gauge {gauge} has neither noise nor resolution; the digit estimator weights gauges by their noise: give `noise` in [sensors]"
    )]
    NoNoise {
        /// Number of the gauge, from 1.
        gauge: usize,
    },
    /// Fewer gauges than unknowns.
    #[error(
        "the digit estimator needs at least {needed} living gauges ({}); the layout has {found}",
        if *needed == 1 { "the force is known" } else { "the force is unknown" }
    )]
    TooFewGauges {
        /// Number of unknowns: position, and force where unknown.
        needed: usize,
        /// Number of enabled gauges.
        found: usize,
    },
    /// Known force beyond the range of the model.
    #[error(
        "the force is {force_n} N; a contact at the tip bears at most {most_n} N, a load F·l²/(E·I) of {}",
        Digit::MOST_LOAD
    )]
    TooMuchForce {
        /// Force.
        force_n: f64,
        /// Upper limit.
        most_n: f64,
    },
    /// Channel mismatch.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for DigitEstimator {
    type Method = DigitLocator;
    type Error = DigitFitError;

    fn fit_method(&self, FitTask { setup, recording, .. }: FitTask) -> Result<DigitLocator, DigitFitError> {
        let SurfaceSpec::Digit(digit) = setup.surface() else { return Err(DigitFitError::NotADigit) };
        if let Some(kind) = setup.layout().kinds().into_iter().find(|kind| *kind != SensorKind::Strain) {
            return Err(DigitFitError::NotAGauge { kind });
        }
        let force_n = setup.force_n();
        let (offsets, layout) = offsets_of(recording, setup.layout());
        let locator = DigitLocator {
            digit: *digit,
            layout,
            offsets,
            force_n,
            theory: self.theory,
            false_alarm_rate: self.false_alarm_rate,
        };
        let noiseless = |sensor: &Sensor| {
            let sd = sensor.channel.reading_sd();
            !(sensor.channel.disabled || sd > 0.0 && sd.is_finite())
        };
        if let Some(i) = locator.layout.sensors().iter().position(noiseless) {
            return Err(DigitFitError::NoNoise { gauge: i + 1 });
        }
        let (needed, found) = (unknowns(1, force_n), locator.enabled_sensors().count());
        if found < needed {
            return Err(DigitFitError::TooFewGauges { needed, found });
        }
        let most_n = Digit::MOST_LOAD * digit.characteristic_force_n();
        match force_n {
            Some(force_n) if force_n > most_n => Err(DigitFitError::TooMuchForce { force_n, most_n }),
            _ => Ok(locator),
        }
    }
}

/// Interval of a curve, relative to the length, of an ambiguous estimate.
const WIDE: f64 = 0.01;

/// Fitted [`DigitEstimator`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DigitLocator {
    /// Digit.
    pub digit: Digit,
    /// Gauges.
    pub layout: Layout,
    /// Known force.
    pub force_n: Option<f64>,
    /// Theory of bending.
    pub theory: DigitTheory,
    /// False-alarm rate.
    #[serde(default)]
    pub false_alarm_rate: FalseAlarmRate,
    /// Offsets in SI units; empty without untouched rows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offsets: Vec<f64>,
}

impl DigitLocator {
    /// Returns the shape at `steps` + 1 points from clamp to tip; straight without a force.
    ///
    /// Uncertainty is propagated by shapes one standard deviation along the columns of the covariance's
    /// Cholesky factor.
    pub fn shape(&self, contact: &ContactEstimate, steps: usize) -> DigitShape {
        let digit = &self.digit;
        let force_n = contact.force_n.unwrap_or(0.0);
        let at = |off_m: f64, off_n: f64| {
            let position_m = (contact.position.x_m + off_m).max(0.0).min(digit.length_m());
            digit
                .shape(Contact { position: Position::along(position_m), force_n: (force_n + off_n).max(0.0) })
        };
        let shape = at(0.0, 0.0);
        let beside: Vec<[Elastica; 2]> = deviations(contact).map(|[x, f]| [at(x, f), at(-x, -f)]).to_vec();
        let steps = steps.max(1);
        let point = |i: usize| {
            let at_m = digit.length_m() * i as f64 / steps as f64;
            let [x_m, y_m] = shape.point(at_m);
            let off = |[a, b]: &[Elastica; 2]| {
                let ([ax, ay], [bx, by]) = (a.point(at_m), b.point(at_m));
                0.5 * (ax - bx).hypot(ay - by)
            };
            let sd_m = beside.iter().map(off).fold(0.0, f64::hypot);
            ShapePoint { at_m, x_m, y_m, sd_m }
        };
        DigitShape { points: (0..=steps).map(point).collect() }
    }

    /// Disables a gauge; false, without a change, where too few would remain.
    pub fn leave_out(&mut self, gauge: usize) -> bool {
        let needed = unknowns(1, self.force_n);
        let Some(sensor) = self.layout.sensors().get(gauge) else { return false };
        let was_dead = sensor.channel.disabled;
        self.layout.set_disabled(gauge, true);
        let enough = self.enabled_sensors().count() >= needed;
        if !enough {
            self.layout.set_disabled(gauge, was_dead);
        }
        enough
    }

    fn enabled_sensors(&self) -> impl Iterator<Item = &Sensor> {
        self.layout.sensors().iter().filter(|sensor| !sensor.channel.disabled)
    }

    fn estimate(&self, mut posterior: Posterior, rule: &StatusRule) -> Estimate {
        let explained = posterior.keep_explanations(rule);
        let Some(best) = posterior.pieces.first() else {
            return Estimate::of_position(Position::default(), Status::OutsideModel);
        };
        let length_m = self.digit.length_m();
        let ends = posterior.interval_95_m(best.best.position_m, length_m);
        let mut estimate = Estimate::of_contact(contact(best, ends), Status::Located);
        if !explained {
            estimate.status = Status::OutsideModel;
            return estimate;
        }
        let others = posterior.pieces[1..].iter().filter(|piece| are_apart(best, piece));
        for other in others.filter(|other| other.probability >= OTHER_PLACE) {
            let sd_m = other.covariance[0].sqrt();
            let ends = clamped_interval(normal_interval_95(other.best.position_m, sd_m), length_m);
            estimate.modes.push(Mode { contact: contact(other, ends), probability: other.probability });
        }
        if !estimate.modes.as_slice().is_empty() || (best.is_curve() && ends.1 - ends.0 > WIDE * length_m) {
            estimate.status = Status::Ambiguous;
        }
        estimate
    }
}

fn shorter(one: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    if other.1 - other.0 < one.1 - one.0 { other } else { one }
}

fn are_apart(a: &Piece, b: &Piece) -> bool {
    let reach_m = 3.0 * (a.covariance[0].sqrt() + b.covariance[0].sqrt());
    (a.best.position_m - b.best.position_m).abs() > reach_m
}

fn contact(piece: &Piece, x_95_m: (f64, f64)) -> ContactEstimate {
    ContactEstimate {
        position: Position::along(piece.best.position_m),
        force_n: Some(piece.best.force_n),
        uncertainty: Some(Uncertainty::on_line(piece.covariance, x_95_m)),
    }
}

impl Locate for DigitLocator {
    type Check = NoCheck;

    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        Some(self.false_alarm_rate)
    }

    fn offsets(&self) -> Option<Vec<f64>> {
        (!self.offsets.is_empty()).then(|| self.offsets.clone())
    }

    fn locate(&self, reading: &[f64]) -> Estimate {
        let gauges = gauges(&self.layout, reading, &less_offsets(reading, &self.offsets));
        let size: f64 = gauges.iter().map(|gauge| (gauge.strain / gauge.sd).powi(2)).sum();
        let none_saturated = gauges.len() == self.enabled_sensors().count();
        let rule =
            StatusRule::new(gauges.len(), unknowns(1, self.force_n), LINE_PLACES, self.false_alarm_rate);
        let is_no_contact = |misfit: f64| none_saturated && rule.is_no_contact(size, misfit);
        // |r|² of a contact is at least 0, so most readings of noise need no search.
        if is_no_contact(0.0) {
            return NO_CONTACT;
        }
        let likelihood =
            Likelihood { digit: &self.digit, theory: self.theory, gauges: &gauges, force_n: self.force_n };
        let posterior = Posterior::new(&likelihood);
        let least = posterior.pieces.iter().fold(f64::INFINITY, |least, piece| least.min(piece.chi_squared));
        if is_no_contact(least) {
            return NO_CONTACT;
        }
        self.estimate(posterior, &rule)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("gauges", setup.layout().len(), self.layout.len())?;
        check_offsets(&self.offsets, self.layout.len())?;
        let others = self.layout.kinds().into_iter().filter(|kind| *kind != SensorKind::Strain).count();
        LocatorFault::check_count("sensors other than gauges", 0, others)?;
        let places = self.layout.sensors().iter().map(|sensor| sensor.position.x_m);
        let on_digit = |x: f64| self.digit.contains(Position::along(x));
        LocatorFault::check_numbers("gauge position", places, on_digit, "on the digit")?;
        let noise = self.enabled_sensors().map(|sensor| sensor.channel.reading_sd());
        LocatorFault::check_numbers("gauge noise", noise, |sd| sd > 0.0, "a number greater than 0")?;
        LocatorFault::check_numbers("force", self.force_n, |x| x > 0.0, "a number greater than 0")?;
        let (needed, found) = (unknowns(1, self.force_n), self.enabled_sensors().count());
        if found < needed {
            return Err(LocatorFault::Count { what: "living gauges", needed, found });
        }
        Ok(())
    }
}

/// Excess of |r|² with a weight of e⁻³⁰.
const MOST_EXCESS: f64 = 60.0;
const CURVE_POINTS: usize = 96;

struct Posterior {
    pieces: Vec<Piece>,
}

#[derive(Clone, Debug)]
struct Piece {
    /// For a curve, the median.
    best: PointContact,
    chi_squared: f64,
    covariance: [f64; 3],
    probability: f64,
    log_weight: f64,
    marginal: Marginal,
}

#[derive(Clone, Debug)]
enum Marginal {
    Normal {
        centre_m: f64,
        sd_m: f64,
        from_m: f64,
        to_m: f64,
    },
    /// The truncation leaves only the far tail.
    Point,
    Curve {
        from_m: f64,
        to_m: f64,
        shares: Vec<f64>,
    },
}

impl Posterior {
    fn new(likelihood: &Likelihood) -> Self {
        let mut pieces: Vec<Piece> = Vec::new();
        let mut least = f64::INFINITY;
        // From tip to clamp: gauges with a required reading of 0 exclude segments nearer to the clamp.
        for stretch in stretches(likelihood.gauges, likelihood.digit.length_m()).into_iter().rev() {
            if likelihood.least_chi_squared(stretch) > least + MOST_EXCESS {
                continue;
            }
            let alone = stretch.seeing == 1 && likelihood.force_n.is_none();
            let piece = if alone { curve(likelihood, stretch) } else { normal(likelihood, stretch) };
            if let Some(piece) = piece {
                least = least.min(piece.chi_squared);
                pieces.push(piece);
            }
        }
        pieces.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
        let mut posterior = Self { pieces };
        posterior.normalise();
        posterior
    }

    /// Drops pieces that do not explain the reading, unless none does.
    fn keep_explanations(&mut self, rule: &StatusRule) -> bool {
        let explains = |piece: &Piece| rule.is_explained(piece.chi_squared);
        let any = self.pieces.iter().any(explains);
        if any {
            self.pieces.retain(explains);
            self.normalise();
        }
        any
    }

    fn normalise(&mut self) {
        let most = self.pieces.iter().map(|piece| piece.log_weight).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = self.pieces.iter().map(|piece| (piece.log_weight - most).exp()).sum();
        for piece in &mut self.pieces {
            piece.probability = (piece.log_weight - most).exp() / total;
        }
    }

    /// Shortest of equal-tailed and one-sided intervals, to include contacts beside clamp and tip.
    fn interval_95_m(&self, estimate_m: f64, length_m: f64) -> (f64, f64) {
        let quantile_m = |share: f64| self.quantile_m(share, length_m);
        let (low_m, high_m) = (quantile_m(0.025), quantile_m(0.975));
        let width_m = high_m - low_m;
        let mut shortest = (low_m, high_m);
        if low_m < width_m {
            shortest = shorter(shortest, (0.0, quantile_m(0.95)));
        }
        if length_m - high_m < width_m {
            shortest = shorter(shortest, (quantile_m(0.05), length_m));
        }
        extend_to(shortest, estimate_m)
    }

    fn quantile_m(&self, share: f64, length_m: f64) -> f64 {
        let below =
            |at_m: f64| self.pieces.iter().map(|piece| piece.probability * piece.below(at_m)).sum::<f64>();
        bisect((0.0, length_m), 30, |at_m| below(at_m) < share)
    }
}

impl Piece {
    fn is_curve(&self) -> bool {
        matches!(self.marginal, Marginal::Curve { .. })
    }

    fn below(&self, at_m: f64) -> f64 {
        match &self.marginal {
            Marginal::Normal { centre_m, sd_m, from_m, to_m } => {
                let mass = |to_m: f64| normal_mass((from_m - centre_m) / sd_m, (to_m - centre_m) / sd_m);
                if at_m <= *from_m { 0.0 } else { mass(at_m.min(*to_m)) / mass(*to_m) }
            }
            Marginal::Point => f64::from(at_m >= self.best.position_m),
            Marginal::Curve { from_m, to_m, shares } => {
                let steps = shares.len() as f64 * (at_m - from_m) / (to_m - from_m);
                if steps <= 0.0 {
                    return 0.0;
                }
                let step = (steps as usize).min(shares.len() - 1);
                let before = if step == 0 { 0.0 } else { shares[step - 1] };
                before + (steps - step as f64).min(1.0) * (shares[step] - before)
            }
        }
    }
}

/// Accurate in the upper tail too.
fn normal_mass(low: f64, high: f64) -> f64 {
    if low > 0.0 { normal_cdf(-low) - normal_cdf(-high) } else { normal_cdf(high) - normal_cdf(low) }
}

/// Laplace's method with the Gaussian truncated to the segment.
fn normal(likelihood: &Likelihood, stretch: Stretch) -> Option<Piece> {
    let (best, fit) = search(likelihood, stretch);
    let factors = likelihood.factors(&fit)?;
    let [along_m, _] = factors.solve(fit.score);
    let [[xx, xf], [_, ff]] = factors.inverse();
    let (centre_m, sd_m) = (best.position_m + along_m, xx.sqrt());
    let mass = normal_mass((stretch.from_m - centre_m) / sd_m, (stretch.to_m - centre_m) / sd_m);
    let volume = match likelihood.force_n {
        Some(_) => (TAU * xx).sqrt(),
        None => TAU / factors.determinant().sqrt() / best.force_n,
    };
    let gained = factors.quadratic(fit.score);
    let (log_weight, marginal) = if mass > 0.0 {
        let marginal = Marginal::Normal { centre_m, sd_m, from_m: stretch.from_m, to_m: stretch.to_m };
        (-0.5 * (fit.misfit - gained) + (volume * mass).ln(), marginal)
    } else {
        (-0.5 * fit.misfit + volume.ln(), Marginal::Point)
    };
    log_weight.is_finite().then_some(Piece {
        best,
        chi_squared: fit.misfit,
        covariance: [xx, xf, ff],
        probability: 0.0,
        log_weight,
        marginal,
    })
}

/// Curve of one responding gauge, weighted by the standard deviation of the log force.
fn curve(likelihood: &Likelihood, stretch: Stretch) -> Option<Piece> {
    let points = curve_points(likelihood, stretch);
    let most = points.iter().map(|point| point.log_weight).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = points.iter().map(|point| (point.log_weight - most).exp()).sum();
    if !total.is_finite() {
        return None;
    }
    let weight = |point: &CurvePoint| (point.log_weight - most).exp() / total;
    let shares: Vec<f64> = points
        .iter()
        .scan(0.0, |up_to, point| {
            *up_to += weight(point);
            Some(*up_to)
        })
        .collect();
    let median = &points[shares.iter().position(|share| *share >= 0.5)?];
    let mean =
        |of: &dyn Fn(&CurvePoint) -> f64| points.iter().map(|point| weight(point) * of(point)).sum::<f64>();
    let (mean_m, mean_n) = (mean(&|point| point.point.position_m), mean(&|point| point.point.force_n));
    let off_m = |point: &CurvePoint| point.point.position_m - mean_m;
    let off_n = |point: &CurvePoint| point.point.force_n - mean_n;
    let step_m = (stretch.to_m - stretch.from_m) / CURVE_POINTS as f64;
    Some(Piece {
        best: median.point,
        chi_squared: median.chi_squared,
        covariance: [
            mean(&|point| off_m(point).powi(2)) + step_m * step_m / 12.0,
            mean(&|point| off_m(point) * off_n(point)),
            mean(&|point| off_n(point).powi(2) + point.force_variance),
        ],
        probability: 0.0,
        log_weight: most + total.ln(),
        marginal: Marginal::Curve { from_m: stretch.from_m, to_m: stretch.to_m, shares },
    })
}

struct CurvePoint {
    point: PointContact,
    chi_squared: f64,
    force_variance: f64,
    log_weight: f64,
}

/// From the far end, where the force is small.
fn curve_points(likelihood: &Likelihood, stretch: Stretch) -> Vec<CurvePoint> {
    let step_m = (stretch.to_m - stretch.from_m) / CURVE_POINTS as f64;
    let mut force_n = likelihood.linear_force_n(stretch.to_m, stretch);
    let mut point = |i: usize| {
        let position_m = stretch.from_m + (i as f64 + 0.5) * step_m;
        let start_n = force_n.max(0.0).min(likelihood.most_force_n(position_m));
        let start = PointContact { position_m, force_n: start_n };
        let (guess, fit) = refine(likelihood, stretch, start, |(_, fit)| force_step(fit));
        force_n = guess.force_n;
        let force_variance = 1.0 / fit.information[1][1];
        let volume = (TAU * force_variance).sqrt() / guess.force_n * step_m;
        let log_weight = -0.5 * fit.misfit + volume.ln();
        CurvePoint { point: guess, chi_squared: fit.misfit, force_variance, log_weight }
    };
    let mut points: Vec<CurvePoint> = (0..CURVE_POINTS).rev().map(&mut point).collect();
    points.reverse();
    points
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Gauge {
    at_m: f64,
    sd: f64,
    strain: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    seeing: usize,
    from_m: f64,
    to_m: f64,
}

fn gauges(layout: &Layout, reading: &[f64], strains: &[f64]) -> Vec<Gauge> {
    // Converters saturate by the sum of offset and strain.
    let inside = |((sensor, read), _): &((&Sensor, &f64), f64)| {
        !sensor.channel.disabled
            && sensor.channel.range.is_none_or(|(low, high)| low < **read && **read < high)
    };
    let gauge = |((sensor, _), strain): ((&Sensor, &f64), f64)| Gauge {
        at_m: sensor.position.x_m,
        sd: sensor.channel.reading_sd(),
        strain,
    };
    let mut gauges: Vec<Gauge> =
        layout.sensors().iter().zip(reading).zip(strains.iter().copied()).filter(inside).map(gauge).collect();
    gauges.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
    gauges
}

fn stretches(gauges: &[Gauge], length_m: f64) -> Vec<Stretch> {
    let end = |i: usize| gauges.get(i).map_or(length_m, |gauge| gauge.at_m);
    let stretch = |i: usize| Stretch { seeing: i + 1, from_m: gauges[i].at_m, to_m: end(i + 1) };
    // Gauges at one position have no segment between them.
    (0..gauges.len()).map(stretch).filter(|it| it.to_m - it.from_m > 1e-9 * length_m).collect()
}

#[derive(Clone, Copy)]
struct Likelihood<'a> {
    digit: &'a Digit,
    theory: DigitTheory,
    gauges: &'a [Gauge],
    force_n: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct PointContact {
    position_m: f64,
    force_n: f64,
}

impl Likelihood<'_> {
    fn most_force_n(&self, position_m: f64) -> f64 {
        Digit::MOST_LOAD * self.digit.bending_stiffness() / (position_m * position_m)
    }

    /// Lower bound of |r|²: the part of the gauges beyond.
    fn least_chi_squared(&self, stretch: Stretch) -> f64 {
        self.gauges[stretch.seeing..].iter().map(|gauge| (gauge.strain / gauge.sd).powi(2)).sum()
    }

    /// |r|², Jᵀr and JᵀJ of the whitened residual r.
    fn fit_at(&self, guess: PointContact, stretch: Stretch) -> ContactFit<2> {
        let PointContact { position_m, force_n } = guess;
        let bent = match self.theory {
            DigitTheory::Exact => {
                Some(self.digit.shape(Contact { position: Position::along(position_m), force_n }))
            }
            DigitTheory::Linear => None,
        };
        let stiffness = self.digit.bending_stiffness();
        let mut fit = ContactFit { misfit: self.least_chi_squared(stretch), ..ContactFit::NOTHING };
        for gauge in &self.gauges[..stretch.seeing] {
            let (curvature, [by_position, by_force]) = match &bent {
                Some(shape) => (shape.curvature(gauge.at_m), shape.curvature_gradient(gauge.at_m)),
                None => {
                    let lever_m = position_m - gauge.at_m;
                    (force_n * lever_m / stiffness, [force_n / stiffness, lever_m / stiffness])
                }
            };
            let scale = self.digit.strain_per_curvature_m() / gauge.sd;
            let residual = gauge.strain / gauge.sd - scale * curvature;
            fit.add(residual, &[scale * by_position, scale * by_force], 1.0);
        }
        if self.force_n.is_some() {
            fit.score[1] = 0.0;
            fit.information = [[fit.information[0][0], 0.0], [0.0, 0.0]];
        }
        fit.mirrored()
    }

    /// `None` for an undetermined contact.
    fn factors(&self, fit: &ContactFit<2>) -> Option<Ldl<2>> {
        Ldl::of_free(&fit.information, [true, self.force_n.is_none()])
    }

    /// Best force of the linear theory.
    fn linear_force_n(&self, position_m: f64, stretch: Stretch) -> f64 {
        let scale = self.digit.strain_per_curvature_m() / self.digit.bending_stiffness();
        let (mut n, mut d) = (0.0, 0.0);
        for gauge in &self.gauges[..stretch.seeing] {
            let by_force = scale * (position_m - gauge.at_m) / gauge.sd;
            n += by_force * gauge.strain / gauge.sd;
            d += by_force * by_force;
        }
        if d > 0.0 { n / d } else { 0.0 }
    }
}

fn force_step(fit: &ContactFit<2>) -> [f64; 2] {
    let [_, [_, ff]] = fit.information;
    [0.0, if ff > 0.0 { fit.score[1] / ff } else { 0.0 }]
}

type Candidate = (PointContact, ContactFit<2>);

const START_SHARES: [f64; 3] = [0.1, 0.4, 0.8];
/// Strong bending shortens the lever arms.
const START_FORCES: [f64; 6] = [1.0, 1.4, 2.0, 3.0, 5.0, 8.0];
const MOST_STEPS: usize = 60;
const LAST_STEP: f64 = 1e-10;
const MOST_HALVINGS: usize = 30;

fn search(likelihood: &Likelihood, stretch: Stretch) -> Candidate {
    let reached = START_SHARES.map(|share| {
        let position_m = stretch.from_m + share * (stretch.to_m - stretch.from_m);
        let start = start(likelihood, stretch, position_m);
        refine(likelihood, stretch, start, |best| gauss_newton_step(likelihood, stretch, best))
    });
    let [first, rest @ ..] = reached;
    rest.into_iter().fold(first, |best, next| if next.1.misfit < best.1.misfit { next } else { best })
}

fn start(likelihood: &Likelihood, stretch: Stretch, position_m: f64) -> PointContact {
    let linear_n = likelihood.linear_force_n(position_m, stretch);
    let guess =
        |factor: f64| clamped(likelihood, PointContact { position_m, force_n: factor * linear_n }, stretch);
    let chi_squared = |guess: PointContact| likelihood.fit_at(guess, stretch).misfit;
    let better = |best: PointContact, next: PointContact| {
        if chi_squared(next) < chi_squared(best) { next } else { best }
    };
    START_FORCES.iter().map(|factor| guess(*factor)).fold(guess(1.0), better)
}

fn refine(
    likelihood: &Likelihood,
    stretch: Stretch,
    start: PointContact,
    step: impl Fn(&Candidate) -> [f64; 2],
) -> Candidate {
    let mut best = (start, likelihood.fit_at(start, stretch));
    for _ in 0..MOST_STEPS {
        let Some(next) = descend(likelihood, stretch, &best, step(&best)) else { break };
        let moved = (next.0.position_m - best.0.position_m).abs() / stretch.to_m
            + (next.0.force_n - best.0.force_n).abs() / next.0.force_n.max(f64::MIN_POSITIVE);
        best = next;
        if moved < LAST_STEP {
            break;
        }
    }
    best
}

/// (JᵀJ)⁻¹·Jᵀr up to the end of the segment; at an end, a step of the force alone.
fn gauss_newton_step(likelihood: &Likelihood, stretch: Stretch, (guess, fit): &Candidate) -> [f64; 2] {
    let Some(factors) = likelihood.factors(fit) else { return force_step(fit) };
    let [along_m, harder_n] = factors.solve(fit.score);
    let room_m =
        if along_m > 0.0 { stretch.to_m - guess.position_m } else { stretch.from_m - guess.position_m };
    if room_m.abs() <= 1e-12 * stretch.to_m {
        return force_step(fit);
    }
    let share = (room_m / along_m).min(1.0);
    if along_m == 0.0 { [0.0, harder_n] } else { [share * along_m, share * harder_n] }
}

fn descend(
    likelihood: &Likelihood,
    stretch: Stretch,
    (guess, fit): &Candidate,
    [along_m, harder_n]: [f64; 2],
) -> Option<Candidate> {
    let mut share = 1.0;
    for _ in 0..MOST_HALVINGS {
        let (position_m, force_n) = (guess.position_m + share * along_m, guess.force_n + share * harder_n);
        let next = clamped(likelihood, PointContact { position_m, force_n }, stretch);
        let there = likelihood.fit_at(next, stretch);
        if there.misfit < fit.misfit {
            return Some((next, there));
        }
        share *= 0.5;
    }
    None
}

fn clamped(likelihood: &Likelihood, guess: PointContact, stretch: Stretch) -> PointContact {
    let position_m = guess.position_m.max(stretch.from_m).min(stretch.to_m);
    let force_n = likelihood.force_n.unwrap_or_else(|| {
        let most_n = likelihood.most_force_n(position_m);
        guess.force_n.max(1e-9 * most_n).min(most_n)
    });
    PointContact { position_m, force_n }
}

/// Centre line from clamp to tip.
#[derive(Clone, Debug, PartialEq)]
pub struct DigitShape {
    /// Points at equal steps of arc length.
    pub points: Vec<ShapePoint>,
}

/// Point of a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePoint {
    /// Arc length from the clamp.
    pub at_m: f64,
    /// Coordinate along the straight digit.
    pub x_m: f64,
    /// Coordinate across it, positive upward.
    pub y_m: f64,
    /// Root mean square position error; 0 where unknown.
    pub sd_m: f64,
}

impl DigitShape {
    /// Tip.
    pub fn tip(&self) -> Option<&ShapePoint> {
        self.points.last()
    }

    /// Returns the largest distance from the shape under `truth`.
    pub fn distance_m(&self, digit: &Digit, truth: Contact) -> f64 {
        let exact = digit.shape(truth);
        let distance = |point: &ShapePoint| {
            let [x_m, y_m] = exact.point(point.at_m);
            (point.x_m - x_m).hypot(point.y_m - y_m)
        };
        self.points.iter().map(distance).fold(0.0, f64::max)
    }
}

fn deviations(contact: &ContactEstimate) -> [[f64; 2]; 2] {
    let Some(uncertainty) = contact.uncertainty else { return [[0.0; 2]; 2] };
    let [xx, _, xf, _, _, ff] = uncertainty.covariance;
    if xx <= 0.0 {
        return [[0.0; 2], [0.0, ff.max(0.0).sqrt()]];
    }
    [[xx.sqrt(), xf / xx.sqrt()], [0.0, (ff - xf * xf / xx).max(0.0).sqrt()]]
}

/// Locator by the linear theory, for exact readings.
pub struct LinearTheory<'a> {
    locator: DigitLocator,
    sensors: CleanSensors<'a>,
}

impl<'a> LinearTheory<'a> {
    /// Returns a locator; `None` for unsuitable sensors.
    pub fn new(setup: &Setup, digit: &'a Digit) -> Option<Self> {
        let unknown = setup.clone().unknown_force();
        // The estimator needs no training, but every fit takes a recording.
        let recording = Recording::new(setup.layout(), "", Vec::new());
        let task = FitTask::new(&unknown, &recording);
        let locator = DigitEstimator::of_theory(DigitTheory::Linear).fit_method(task).ok()?;
        Some(Self { locator, sensors: CleanSensors::new(digit, setup.layout()) })
    }

    /// Returns the noise-free errors of position (m) and force (N); NaN without a force.
    pub fn errors(&self, contact: Contact) -> [f64; 2] {
        let found = self.locator.locate(&self.sensors.reading(contact)).contact;
        let off_n = found.force_n.map_or(f64::NAN, |force_n| (force_n - contact.force_n).abs());
        [found.position.distance_m(contact.position), off_n]
    }
}

#[cfg(test)]
mod tests;
