//! What a reading says of position and force: one piece a stretch between neighbouring gauges.

use std::f64::consts::TAU;

use super::gauges::{Stretch, stretches};
use super::likelihood::{Guess, Likelihood};
use super::refine::{refine_force, search};
use palpate_numerics::{bisect, normal_distribution};

/// Pieces whose |r|² is larger than the least by this have no weight: e⁻³⁰.
const HOPELESS: f64 = 60.0;
/// Points of a curve of contacts that explain a reading alike.
const CURVE_POINTS: usize = 96;

/// The posterior of position and force. Before the reading it is flat over the position and over the logarithm of the force:
/// a contact anywhere, and of any order of magnitude.
pub(super) struct Posterior {
    /// Most probable first.
    pub pieces: Vec<Piece>,
}

/// The posterior on one stretch.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// The most likely contact; of a curve, its median.
    pub best: Guess,
    /// |r|² there.
    pub chi_squared: f64,
    /// Covariance of position and force: xx, xf, ff.
    pub covariance: [f64; 3],
    /// Its share of the posterior probability.
    pub probability: f64,
    log_weight: f64,
    spread: Spread,
}

/// How the position is distributed over a stretch.
#[derive(Clone, Debug)]
enum Spread {
    /// Normally, but cut off at the ends of the stretch.
    Normal { centre_m: f64, sd_m: f64, from_m: f64, to_m: f64 },
    /// At the best position, as the piece is cut off far out in its tail.
    Point,
    /// Along a curve: equal steps from one position to another, and the share of the probability up to the end of each.
    Curve { from_m: f64, to_m: f64, shares: Vec<f64> },
}

impl Posterior {
    /// The posterior of a reading; without pieces where no contact explains any of it.
    pub fn new(likelihood: &Likelihood) -> Self {
        let mut pieces: Vec<Piece> = Vec::new();
        let mut least = f64::INFINITY;
        // From the tip on, as gauges that must read nothing rule out stretches nearer to the clamp.
        for stretch in stretches(likelihood.gauges, likelihood.digit.length_m).into_iter().rev() {
            if likelihood.least_chi_squared(stretch) > least + HOPELESS {
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

    /// Drops pieces whose best contact leaves an |r|² of more than `most`, unless all do; says whether any is left that does not.
    pub fn keep_explanations(&mut self, most: f64) -> bool {
        let explains = |piece: &Piece| piece.chi_squared <= most;
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

    /// The position below which the contact lies with probability `share`, by bisection.
    pub fn quantile_m(&self, share: f64, length_m: f64) -> f64 {
        let below =
            |at_m: f64| self.pieces.iter().map(|piece| piece.probability * piece.below(at_m)).sum::<f64>();
        bisect((0.0, length_m), 30, |at_m| below(at_m) < share)
    }
}

impl Piece {
    /// Whether one gauge alone saw the contact, so that a curve of contacts explains the reading alike.
    pub fn is_curve(&self) -> bool {
        matches!(self.spread, Spread::Curve { .. })
    }

    /// The probability that the contact lies below `at_m`, given this stretch.
    fn below(&self, at_m: f64) -> f64 {
        match &self.spread {
            Spread::Normal { centre_m, sd_m, from_m, to_m } => {
                let mass = |to_m: f64| normal_mass((from_m - centre_m) / sd_m, (to_m - centre_m) / sd_m);
                if at_m <= *from_m { 0.0 } else { mass(at_m.min(*to_m)) / mass(*to_m) }
            }
            Spread::Point => f64::from(at_m >= self.best.position_m),
            Spread::Curve { from_m, to_m, shares } => {
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
    if low > 0.0 {
        normal_distribution(-low) - normal_distribution(-high)
    } else {
        normal_distribution(high) - normal_distribution(low)
    }
}

/// The piece around the most likely contact on a stretch: |r|² is a parabola about the end of the next Gauss–Newton step, which
/// may lie beyond the stretch. By Laplace's method its weight is the volume beneath, as far as it is on the stretch.
fn normal(likelihood: &Likelihood, stretch: Stretch) -> Option<Piece> {
    let known = likelihood.force_n.is_some();
    let (best, sums) = search(likelihood, stretch);
    let factors = sums.factors(known)?;
    let [along_m, _] = factors.solve(sums.score);
    let [[xx, xf], [_, ff]] = factors.inverse();
    let (centre_m, sd_m) = (best.position_m + along_m, xx.sqrt());
    let mass = normal_mass((stretch.from_m - centre_m) / sd_m, (stretch.to_m - centre_m) / sd_m);
    let volume = match likelihood.force_n {
        Some(_) => (TAU * xx).sqrt(),
        None => TAU / factors.determinant().sqrt() / best.force_n,
    };
    let gained = factors.quadratic(sums.score);
    let (log_weight, spread) = if mass > 0.0 {
        let spread = Spread::Normal { centre_m, sd_m, from_m: stretch.from_m, to_m: stretch.to_m };
        (-0.5 * (sums.chi_squared - gained) + (volume * mass).ln(), spread)
    } else {
        (-0.5 * sums.chi_squared + volume.ln(), Spread::Point)
    };
    log_weight.is_finite().then_some(Piece {
        best,
        chi_squared: sums.chi_squared,
        covariance: [xx, xf, ff],
        probability: 0.0,
        log_weight,
        spread,
    })
}

/// The piece of a stretch that one gauge alone sees, for an unknown force: at every position some force explains the moment.
/// A position weighs as much as the logarithm of its force is uncertain.
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
        spread: Spread::Curve { from_m: stretch.from_m, to_m: stretch.to_m, shares },
    })
}

/// A contact of a curve, which stands for its step of the way along the stretch.
struct CurvePoint {
    guess: Guess,
    chi_squared: f64,
    /// Of the force, at this position.
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
        let (guess, sums) = refine_force(likelihood, stretch, Guess { position_m, force_n: start_n });
        force_n = guess.force_n;
        let force_variance = 1.0 / sums.information[1][1];
        let volume = (TAU * force_variance).sqrt() / guess.force_n * step_m;
        let log_weight = -0.5 * sums.chi_squared + volume.ln();
        CurvePoint { guess, chi_squared: sums.chi_squared, force_variance, log_weight }
    };
    let mut points: Vec<CurvePoint> = (0..CURVE_POINTS).rev().map(&mut point).collect();
    points.reverse();
    points
}
