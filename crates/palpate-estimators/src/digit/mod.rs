//! The flexible digit's own estimator, after Ma and his colleagues: where a bending finger is touched, how hard, and what
//! shape it has.
//!
//! Strain gauges read the bending moment. Gauges between the clamp and the contact respond to it; gauges beyond it read 0. So the
//! likelihood of a reading has one smooth piece for every stretch between neighbouring gauges. Each piece is searched by
//! itself: a few starts, then Gauss–Newton steps on the exact elastica that never leave the stretch. Together the pieces
//! form a posterior of position and force, with a prior that is flat over the digit's length and the logarithm of
//! the force. A stretch has one Gaussian, cut off at its gauges. Where only one gauge responds to a contact of unknown
//! force, it determines only the product of force and lever arm: the piece is a curve of contacts that explain the reading equally well.

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
use palpate_numerics::{bisect, clamped_interval, holding, normal_cdf, normal_interval_95};

/// The flexible digit's estimator: maximum likelihood over position and force. It needs the digit, its gauges and their
/// noise, and does not learn from a recording.
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
    /// Theory of bending by which the gauges read.
    pub theory: DigitTheory,
    /// False-alarm rate: share of untouched readings that may be detected as a contact.
    pub false_alarm_rate: FalseAlarmRate,
}

impl DigitEstimator {
    /// An estimator with this theory of bending, and default settings otherwise.
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

/// A bench that the digit's estimator does not suit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DigitFitError {
    /// Another kind of surface.
    #[error("the digit estimator needs `kind = \"digit\"` in [surface]; the surface is another one")]
    NotADigit,
    /// A sensor other than a strain gauge.
    #[error("the digit estimator needs strain gauges; the layout has a {kind} sensor")]
    NotAGauge {
        /// Quantity that the sensor measures.
        kind: SensorKind,
    },
    /// A gauge without noise.
    #[error(
        "gauge {gauge} has neither noise nor resolution; the digit estimator weights gauges by their noise: give `noise` in [sensors]"
    )]
    NoNoise {
        /// Number of the gauge, from 1.
        gauge: usize,
    },
    /// Too few gauges for the unknowns.
    #[error(
        "the digit estimator needs at least {needed} living gauges ({}); the layout has {found}",
        if *needed == 1 { "the force is known" } else { "the force is unknown" }
    )]
    TooFewGauges {
        /// Unknowns: 1 for the position, and 1 for a force that is unknown.
        needed: usize,
        /// Gauges that are not dead.
        found: usize,
    },
    /// A known force that bends the digit beyond the range of its model.
    #[error(
        "the force is {force_n} N; a contact at the tip bears at most {most_n} N, a load F·l²/(E·I) of {}",
        Digit::MOST_LOAD
    )]
    TooMuchForce {
        /// The force, in newtons.
        force_n: f64,
        /// The largest, in newtons.
        most_n: f64,
    },
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
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
            !(sensor.channel.dead || sd > 0.0 && sd.is_finite())
        };
        if let Some(i) = locator.layout.sensors().iter().position(noiseless) {
            return Err(DigitFitError::NoNoise { gauge: i + 1 });
        }
        let (needed, found) = (unknowns(1, force_n), locator.living().count());
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

/// Widest interval, as a share of the length, that counts as a place where only one gauge responds to the contact.
const WIDE: f64 = 0.01;

/// A digit's estimator that locates; see [`DigitEstimator`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DigitLocator {
    /// The finger.
    pub digit: Digit,
    /// Gauges.
    pub layout: Layout,
    /// The contact's force in newtons, where it is known.
    pub force_n: Option<f64>,
    /// Theory of bending by which the gauges read.
    pub theory: DigitTheory,
    /// False-alarm rate: share of untouched readings that may be detected as a contact.
    #[serde(default)]
    pub false_alarm_rate: FalseAlarmRate,
    /// Offset of each channel, in its SI unit; empty where the recording has no untouched row.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offsets: Vec<f64>,
}

impl DigitLocator {
    /// The shape of the finger at an estimated contact, at `steps` + 1 points from clamp to tip; an estimate without a force leaves it
    /// straight.
    ///
    /// The uncertainty of the shape is that of the contact, propagated by the shapes one standard deviation to either side along the
    /// columns of the covariance's Cholesky factor.
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

    /// Disables a dead gauge from now on; false, without a change, when too few would remain.
    pub fn leave_out(&mut self, gauge: usize) -> bool {
        let needed = unknowns(1, self.force_n);
        let Some(sensor) = self.layout.sensors().get(gauge) else { return false };
        let was_dead = sensor.channel.dead;
        self.layout.set_dead(gauge, true);
        let enough = self.living().count() >= needed;
        if !enough {
            self.layout.set_dead(gauge, was_dead);
        }
        enough
    }

    /// Gauges that are not dead.
    fn living(&self) -> impl Iterator<Item = &Sensor> {
        self.layout.sensors().iter().filter(|sensor| !sensor.channel.dead)
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

/// The shorter of two intervals.
fn shorter(one: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    if other.1 - other.0 < one.1 - one.0 { other } else { one }
}

/// Whether two pieces are two places, not the two sides of a gauge.
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
        let none_saturated = gauges.len() == self.living().count();
        let rule =
            StatusRule::new(gauges.len(), unknowns(1, self.force_n), LINE_PLACES, self.false_alarm_rate);
        let is_no_contact = |misfit: f64| none_saturated && rule.is_no_contact(size, misfit);
        // |r|² of a contact is at least 0, so that most readings of noise need no search.
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
        let noise = self.living().map(|sensor| sensor.channel.reading_sd());
        LocatorFault::check_numbers("gauge noise", noise, |sd| sd > 0.0, "a number greater than 0")?;
        LocatorFault::check_numbers("force", self.force_n, |x| x > 0.0, "a number greater than 0")?;
        let (needed, found) = (unknowns(1, self.force_n), self.living().count());
        if found < needed {
            return Err(LocatorFault::Count { what: "living gauges", needed, found });
        }
        Ok(())
    }
}

/// Pieces with |r|² above the least by more than this have no weight: e⁻³⁰.
const MOST_EXCESS: f64 = 60.0;
/// Points of a curve of contacts that explain a reading equally well.
const CURVE_POINTS: usize = 96;

/// The posterior of position and force. The prior is flat over the position and over the logarithm of the force: a contact anywhere, and of any order
/// of magnitude.
struct Posterior {
    /// Most probable first.
    pieces: Vec<Piece>,
}

/// The posterior on one stretch.
#[derive(Clone, Debug)]
struct Piece {
    /// The most likely contact; for a curve, its median.
    best: Guess,
    /// |r|² of the best contact.
    chi_squared: f64,
    /// Covariance of position and force: xx, xf, ff.
    covariance: [f64; 3],
    /// Share of the posterior probability.
    probability: f64,
    log_weight: f64,
    marginal: Marginal,
}

/// Marginal distribution of the position over a stretch.
#[derive(Clone, Debug)]
enum Marginal {
    /// A normal distribution, cut off at the ends of the stretch.
    Normal { centre_m: f64, sd_m: f64, from_m: f64, to_m: f64 },
    /// The whole probability at the best position, as the piece is cut off far out in its tail.
    Point,
    /// Along a curve: equal steps from one position to another, and the share of the probability up to the end of each.
    Curve { from_m: f64, to_m: f64, shares: Vec<f64> },
}

impl Posterior {
    /// The posterior of a reading; without pieces where no contact explains any part of it.
    fn new(likelihood: &Likelihood) -> Self {
        let mut pieces: Vec<Piece> = Vec::new();
        let mut least = f64::INFINITY;
        // From the tip on, as gauges that must read 0 rule out stretches nearer to the clamp.
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

    /// Drops pieces with a best contact that does not explain the reading, unless that is so of all; true when at least one explains it.
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

    /// The 95 % interval of the position, which contains the estimate.
    ///
    /// Beside the clamp and the tip equal tails would exclude contacts there. Of the interval with equal tails and those without a lower or an upper
    /// tail, it is the shortest.
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
        holding(shortest, estimate_m)
    }

    /// The position below which the contact lies with probability `share`, by bisection.
    fn quantile_m(&self, share: f64, length_m: f64) -> f64 {
        let below =
            |at_m: f64| self.pieces.iter().map(|piece| piece.probability * piece.below(at_m)).sum::<f64>();
        bisect((0.0, length_m), 30, |at_m| below(at_m) < share)
    }
}

impl Piece {
    /// Whether only one gauge responded to the contact, so that a curve of contacts explains the reading equally well.
    fn is_curve(&self) -> bool {
        matches!(self.marginal, Marginal::Curve { .. })
    }

    /// The probability that the contact lies below `at_m`, given this stretch.
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

/// Φ(high) − Φ(low), with its digits also far out in the upper tail.
fn normal_mass(low: f64, high: f64) -> f64 {
    if low > 0.0 { normal_cdf(-low) - normal_cdf(-high) } else { normal_cdf(high) - normal_cdf(low) }
}

/// The piece around the most likely contact on a stretch. |r|² is a parabola about the end of the next Gauss–Newton step, which may lie beyond the
/// stretch. By Laplace's method the weight of the piece is the volume under its Gaussian within the stretch.
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

/// The piece of a stretch where only one gauge responds, for an unknown force: at every position some force explains the moment. The weight of a
/// position is the uncertainty of the logarithm of its force.
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
    let (mean_m, mean_n) = (mean(&|point| point.guess.position_m), mean(&|point| point.guess.force_n));
    let off_m = |point: &CurvePoint| point.guess.position_m - mean_m;
    let off_n = |point: &CurvePoint| point.guess.force_n - mean_n;
    let step_m = (stretch.to_m - stretch.from_m) / CURVE_POINTS as f64;
    Some(Piece {
        best: median.guess,
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

/// A contact of a curve, which represents its step along the stretch.
struct CurvePoint {
    guess: Guess,
    chi_squared: f64,
    /// Variance of the force, given this position.
    force_variance: f64,
    log_weight: f64,
}

/// The best force at each position, from clamp to tip. The search begins at the far end, where the force is small, and each force
/// begins the search for the next.
fn curve_points(likelihood: &Likelihood, stretch: Stretch) -> Vec<CurvePoint> {
    let step_m = (stretch.to_m - stretch.from_m) / CURVE_POINTS as f64;
    let mut force_n = likelihood.linear_force_n(stretch.to_m, stretch);
    let mut point = |i: usize| {
        let position_m = stretch.from_m + (i as f64 + 0.5) * step_m;
        let start_n = force_n.max(0.0).min(likelihood.most_force_n(position_m));
        let start = Guess { position_m, force_n: start_n };
        let (guess, fit) = refine(likelihood, stretch, start, |(_, fit)| force_step(fit));
        force_n = guess.force_n;
        let force_variance = 1.0 / fit.information[1][1];
        let volume = (TAU * force_variance).sqrt() / guess.force_n * step_m;
        let log_weight = -0.5 * fit.misfit + volume.ln();
        CurvePoint { guess, chi_squared: fit.misfit, force_variance, log_weight }
    };
    let mut points: Vec<CurvePoint> = (0..CURVE_POINTS).rev().map(&mut point).collect();
    points.reverse();
    points
}

/// A gauge that reads within its range.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gauge {
    at_m: f64,
    /// Standard deviation of its noise and quantisation: √(σ² + step²/12).
    sd: f64,
    /// Reading, a strain.
    strain: f64,
}

/// Contacts to which the same gauges respond: the first `seeing` of them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    seeing: usize,
    from_m: f64,
    to_m: f64,
}

/// The gauges of a reading from clamp to tip, without dead and saturated ones.
fn gauges(layout: &Layout, reading: &[f64], strains: &[f64]) -> Vec<Gauge> {
    // Converters saturate at their reading, the sum of offset and strain.
    let inside = |((sensor, read), _): &((&Sensor, &f64), f64)| {
        !sensor.channel.dead && sensor.channel.range.is_none_or(|(low, high)| low < **read && **read < high)
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

/// The stretches on which at least one gauge responds to a contact, from clamp to tip.
fn stretches(gauges: &[Gauge], length_m: f64) -> Vec<Stretch> {
    let end = |i: usize| gauges.get(i).map_or(length_m, |gauge| gauge.at_m);
    let stretch = |i: usize| Stretch { seeing: i + 1, from_m: gauges[i].at_m, to_m: end(i + 1) };
    // Gauges at one place have no stretch between them.
    (0..gauges.len()).map(stretch).filter(|it| it.to_m - it.from_m > 1e-9 * length_m).collect()
}

/// Likelihood of a reading of a digit.
#[derive(Clone, Copy)]
struct Likelihood<'a> {
    digit: &'a Digit,
    theory: DigitTheory,
    gauges: &'a [Gauge],
    /// The force in newtons, where it is known.
    force_n: Option<f64>,
}

/// A contact in the search: position along the digit in metres, and force in newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Guess {
    position_m: f64,
    force_n: f64,
}

impl Likelihood<'_> {
    /// The largest force that is searched at a position.
    fn most_force_n(&self, position_m: f64) -> f64 {
        Digit::MOST_LOAD * self.digit.bending_stiffness() / (position_m * position_m)
    }

    /// |r|² of the gauges beyond a stretch, which a contact on it does not strain: a lower bound of |r|² there.
    fn least_chi_squared(&self, stretch: Stretch) -> f64 {
        self.gauges[stretch.seeing..].iter().map(|gauge| (gauge.strain / gauge.sd).powi(2)).sum()
    }

    /// The fit of position and force at a guess on a stretch; the misfit is |r|², and the score and information Jᵀ·r and JᵀJ of the
    /// whitened residual r and the model's Jacobian J.
    fn fit_at(&self, guess: Guess, stretch: Stretch) -> ContactFit<2> {
        let Guess { position_m, force_n } = guess;
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

    /// The factors of JᵀJ, the inverse covariance of position and force, or of the position alone where the force is known.
    /// `None` where the reading does not determine them.
    fn factors(&self, fit: &ContactFit<2>) -> Option<Ldl<2>> {
        Ldl::of_free(&fit.information, [true, self.force_n.is_none()])
    }

    /// The force by which the linear theory explains the reading best at a position: the start of a search.
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

/// The step of the force alone.
fn force_step(fit: &ContactFit<2>) -> [f64; 2] {
    let [_, [_, ff]] = fit.information;
    [0.0, if ff > 0.0 { fit.score[1] / ff } else { 0.0 }]
}

/// A guess and its fit.
type Tried = (Guess, ContactFit<2>);

/// Starting positions of the search, as shares of the stretch.
const START_SHARES: [f64; 3] = [0.1, 0.4, 0.8];
/// Factors of the linear theory's force at a start: a finger that bends far has shorter lever arms.
const START_FORCES: [f64; 6] = [1.0, 1.4, 2.0, 3.0, 5.0, 8.0];
/// Most steps; five to ten from a start reach the last digits.
const MOST_STEPS: usize = 60;
/// A step of this share of its parameter is the last one.
const LAST_STEP: f64 = 1e-10;
/// Most halvings of a step; a smaller one no longer reduces |r|².
const MOST_HALVINGS: usize = 30;

/// The best contact on a stretch: the lowest of the minima reached from the best force at each start.
fn search(likelihood: &Likelihood, stretch: Stretch) -> Tried {
    let reached = START_SHARES.map(|share| {
        let position_m = stretch.from_m + share * (stretch.to_m - stretch.from_m);
        let start = start(likelihood, stretch, position_m);
        refine(likelihood, stretch, start, |best| gauss_newton_step(likelihood, stretch, best))
    });
    let [first, rest @ ..] = reached;
    rest.into_iter().fold(first, |best, next| if next.1.misfit < best.1.misfit { next } else { best })
}

/// The best of a few forces at a position.
fn start(likelihood: &Likelihood, stretch: Stretch, position_m: f64) -> Guess {
    let linear_n = likelihood.linear_force_n(position_m, stretch);
    let guess = |factor: f64| clamped(likelihood, Guess { position_m, force_n: factor * linear_n }, stretch);
    let chi_squared = |guess: Guess| likelihood.fit_at(guess, stretch).misfit;
    let better = |best: Guess, next: Guess| if chi_squared(next) < chi_squared(best) { next } else { best };
    START_FORCES.iter().map(|factor| guess(*factor)).fold(guess(1.0), better)
}

/// Goes from a guess by some kind of steps to the nearest minimum of |r|² on the stretch.
fn refine(
    likelihood: &Likelihood,
    stretch: Stretch,
    start: Guess,
    step: impl Fn(&Tried) -> [f64; 2],
) -> Tried {
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

/// The Gauss–Newton step (JᵀJ)⁻¹·Jᵀr, up to the end of the stretch; at an end that it would leave, the step of the force alone.
fn gauss_newton_step(likelihood: &Likelihood, stretch: Stretch, (guess, fit): &Tried) -> [f64; 2] {
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

/// The longest of the step, its half, its quarter and so on that makes |r|² smaller.
fn descend(
    likelihood: &Likelihood,
    stretch: Stretch,
    (guess, fit): &Tried,
    [along_m, harder_n]: [f64; 2],
) -> Option<Tried> {
    let mut share = 1.0;
    for _ in 0..MOST_HALVINGS {
        let (position_m, force_n) = (guess.position_m + share * along_m, guess.force_n + share * harder_n);
        let next = clamped(likelihood, Guess { position_m, force_n }, stretch);
        let there = likelihood.fit_at(next, stretch);
        if there.misfit < fit.misfit {
            return Some((next, there));
        }
        share *= 0.5;
    }
    None
}

/// The guess, clamped to the stretch and to forces that push and that the model covers.
fn clamped(likelihood: &Likelihood, guess: Guess, stretch: Stretch) -> Guess {
    let position_m = guess.position_m.max(stretch.from_m).min(stretch.to_m);
    let force_n = likelihood.force_n.unwrap_or_else(|| {
        let most_n = likelihood.most_force_n(position_m);
        guess.force_n.max(1e-9 * most_n).min(most_n)
    });
    Guess { position_m, force_n }
}

/// The centre line of a finger, from clamp to tip.
#[derive(Clone, Debug, PartialEq)]
pub struct DigitShape {
    /// Points, equal steps of the finger's length apart; never empty.
    pub points: Vec<ShapePoint>,
}

/// A point of a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapePoint {
    /// Arc length from the clamp, in metres.
    pub at_m: f64,
    /// Coordinate along the straight finger, in metres.
    pub x_m: f64,
    /// Coordinate across it, positive upward, in metres.
    pub y_m: f64,
    /// Root mean square distance of the true point from this one, in metres; 0 where the contact's uncertainty is not known.
    pub sd_m: f64,
}

impl DigitShape {
    /// The tip.
    pub fn tip(&self) -> Option<&ShapePoint> {
        self.points.last()
    }

    /// The largest distance of a point from the same point of the finger's exact shape under `truth`, in metres.
    pub fn distance_m(&self, digit: &Digit, truth: Contact) -> f64 {
        let exact = digit.shape(truth);
        let distance = |point: &ShapePoint| {
            let [x_m, y_m] = exact.point(point.at_m);
            (point.x_m - x_m).hypot(point.y_m - y_m)
        };
        self.points.iter().map(distance).fold(0.0, f64::max)
    }
}

/// The columns of the Cholesky factor of the contact's covariance, each as (position, force).
fn deviations(contact: &ContactEstimate) -> [[f64; 2]; 2] {
    let Some(uncertainty) = contact.uncertainty else { return [[0.0; 2]; 2] };
    let [xx, _, xf, _, _, ff] = uncertainty.covariance;
    if xx <= 0.0 {
        return [[0.0; 2], [0.0, ff.max(0.0).sqrt()]];
    }
    [[xx.sqrt(), xf / xx.sqrt()], [0.0, (ff - xf * xf / xx).max(0.0).sqrt()]]
}

/// A locator by the linear theory, and the exact readings for it.
pub struct LinearTheory<'a> {
    locator: DigitLocator,
    sensors: CleanSensors<'a>,
}

impl<'a> LinearTheory<'a> {
    /// A locator for the bench of a digit; `None` where the linear theory does not suit its sensors.
    pub fn new(setup: &Setup, digit: &'a Digit) -> Option<Self> {
        let unknown = setup.clone().unknown_force();
        // The estimator does not learn from a recording, but every fit takes one.
        let recording = Recording::new(setup.layout(), "", Vec::new());
        let task = FitTask::new(&unknown, &recording);
        let locator = DigitEstimator::of_theory(DigitTheory::Linear).fit_method(task).ok()?;
        Some(Self { locator, sensors: CleanSensors::new(digit, setup.layout()) })
    }

    /// Errors of position, in metres, and of force, in newtons, for a contact that is read without noise; NaN for a force without an estimate.
    pub fn errors(&self, contact: Contact) -> [f64; 2] {
        let found = self.locator.locate(&self.sensors.reading(contact)).contact;
        let off_n = found.force_n.map_or(f64::NAN, |force_n| (force_n - contact.force_n).abs());
        [found.position.distance_m(contact.position), off_n]
    }
}

#[cfg(test)]
mod tests;
