//! Confidence intervals near the ends of a line, where an unknown force and the place trade off.
//!
//! - The force is bounded, by the bench or by a multiple of the calibration's.
//! - The 95 % region contains every contact with a cost (χ² plus the log determinant of the channels'
//!   covariance) at most q above the least. q is 3.84 away from the ends and 2.71 at an end, for 95 %
//!   coverage at every place (Feldman and Cousins, Physical Review D 57, 1998). Intervals are projections of
//!   the region.
//! - With extrapolated variances ([`Contacts::extrapolates`]) the log determinant counts up to that of the
//!   best contact, and of more channels than unknowns the worst one does not count.
//! - Where a segment of the region reaches an end, the estimate is the posterior median of its places: it has
//!   the least mean error. The prior is flat in the place and in the size of the signal.
//!
//! Symbols: d reading and f influence per newton, both over the noise; W force; μ distance from the readings
//! at the end, in standard deviations.

use std::sync::OnceLock;

use palpate_core::{ContactEstimate, Estimate, Mode, Position, Status, Uncertainty};
use palpate_numerics::{bisect, hull, normal_cdf, normal_interval_95};

use crate::status::OTHER_PLACE;

/// Distance from both ends for a normal distribution, in standard deviations.
const CLEAR_OF_ENDS: f64 = 12.0;

/// True of a place that needs an interval by [`Contacts`].
#[inline(always)]
pub(crate) fn is_near_end(x_m: f64, sd_m: f64, length_m: f64) -> bool {
    !(CLEAR_OF_ENDS * sd_m < x_m && CLEAR_OF_ENDS * sd_m < length_m - x_m)
}

/// Factor of q for learnt influences and noise: their errors are common to all channels and forces.
///
/// Without it, the worst row of `confidence_region/coverage.rs` has 90.7 % coverage.
pub(crate) const CALIBRATED: f64 = 1.1;

/// q of places behind a barrier of χ²: −2·ln 0.01, the likelihood ratio of other modes.
///
/// At most 0.12 % of the readings prefer the wrong side by q: with δ standard deviations between both, χ²
/// differs by 2·δ·z − δ², z ~ N(0, 1), which exceeds q most often at δ = √q.
pub(crate) const BEYOND_A_BARRIER: f64 = 9.21;

/// Prior of the force, in newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Force {
    Known(f64),
    AtMost(f64),
    Unknown,
}

impl Force {
    pub fn at_most(greatest_force_n: Option<f64>) -> Self {
        greatest_force_n.map_or(Self::Unknown, Self::AtMost)
    }
}

/// Writes d and f of every channel at a place and force, over its standard deviation; returns the log
/// determinant of the variances.
pub(crate) type Channels<'a> = dyn Fn(f64, f64, &mut Vec<[f64; 2]>) -> f64 + 'a;

/// Likelihood of contacts for one reading.
pub(crate) struct Contacts<'a> {
    pub length_m: f64,
    pub force: Force,
    /// 1 for known influences and noise, else [`CALIBRATED`].
    pub widening: f64,
    pub reference_force_n: f64,
    /// True for extrapolated influences near the ends; one channel may then have any error.
    pub extrapolates: bool,
    pub channels: &'a Channels<'a>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ConfidenceRegion {
    pub misfit: f64,
    pub x_95_m: (f64, f64),
    /// `None` for a known force.
    pub force_95_n: Option<(f64, f64)>,
    /// Most probable first; at least one.
    pub stretches: Vec<Stretch>,
}

/// Contiguous places of the confidence region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    pub x_95_m: (f64, f64),
    pub force_95_n: (f64, f64),
    pub x_m: f64,
    pub force_n: f64,
    /// Mean squares about the estimate: m², m·N, N².
    pub covariance: [f64; 3],
    pub probability: f64,
}

impl ConfidenceRegion {
    pub fn write(&self, estimate: &mut Estimate) {
        let Some((best, others)) = self.stretches.split_first() else { return };
        estimate.contact = best.contact_within(self.x_95_m, self.force_95_n);
        estimate.status = Status::Located;
        for other in others.iter().filter(|other| other.probability >= OTHER_PLACE) {
            let force_95_n = self.force_95_n.and(Some(other.force_95_n));
            let contact = other.contact_within(other.x_95_m, force_95_n);
            estimate.modes.push(Mode { contact, probability: other.probability });
            estimate.status = Status::Ambiguous;
        }
    }
}

impl Stretch {
    fn contact_within(&self, x_95_m: (f64, f64), force_95_n: Option<(f64, f64)>) -> ContactEstimate {
        let uncertainty = Uncertainty { force_95_n, ..Uncertainty::on_line(self.covariance, x_95_m) };
        ContactEstimate {
            position: Position::along(self.x_m),
            force_n: Some(self.force_n),
            uncertainty: Some(uncertainty),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Best {
    x_m: f64,
    force_n: f64,
    /// 1/variance of the force.
    precision: f64,
    misfit: f64,
    /// Log determinant.
    spread: f64,
    /// q.
    bound: f64,
    /// True where the bound of the force is active.
    is_held: bool,
}

impl Best {
    fn cost(&self) -> f64 {
        self.misfit + self.spread
    }
}

#[derive(Clone, Copy, Debug)]
struct Region {
    least: f64,
    /// Limit of the log determinant.
    most_spread: f64,
    /// Least q.
    floor: f64,
}

impl Region {
    /// Margin below q; negative where a place is excluded.
    fn left(&self, at: &Best) -> f64 {
        at.bound.max(self.floor) - (at.misfit + at.spread.min(self.most_spread) - self.least)
    }

    fn contains(&self, at: &Best) -> bool {
        self.left(at) >= 0.0
    }
}

impl Contacts<'_> {
    const CELLS: usize = 64;
    const HALVINGS: i32 = 8;
    const EDGE_HALVINGS: usize = 24;
    const WITHIN: usize = 24;

    /// Returns the confidence region, given local minima of χ²; `None` without a finite χ².
    pub fn confidence_region(&self, minima_m: &[f64]) -> Option<ConfidenceRegion> {
        let mut buffer = Vec::new();
        let ends = self.end_readings(&mut buffer);
        let mut profile_at = |x_m: f64| self.best(x_m, &ends, &mut buffer);
        let profile = self.profile_places(minima_m, &mut profile_at);
        let misfit = profile.iter().map(|at| at.misfit).fold(f64::INFINITY, f64::min);
        if !misfit.is_finite() {
            return None;
        }
        let in_numbers = profile.iter().filter(|at| !at.cost().is_nan());
        let best = in_numbers.min_by(|a, b| a.cost().total_cmp(&b.cost()))?;
        let most_spread = if self.extrapolates { best.spread } else { f64::INFINITY };
        let region = Region { least: best.cost(), most_spread, floor: 0.0 };
        let mut stretches = Vec::new();
        let mut from = 0;
        let around_best = self.around_best(&profile, &region);
        while from < profile.len() {
            let floor = if around_best.contains(&from) { 0.0 } else { self.widening * BEYOND_A_BARRIER };
            let region = Region { floor, ..region };
            let run_len = profile[from..].iter().take_while(|at| region.contains(at)).count();
            if run_len > 0 {
                let beside = [from.checked_sub(1), Some(from + run_len)];
                let beside = beside.map(|i| i.and_then(|i| profile.get(i).copied()));
                let run = &profile[from..from + run_len];
                stretches.push(self.stretch(run, beside, &region, &mut profile_at));
            }
            from += run_len.max(1);
        }
        let all: f64 = stretches.iter().map(|stretch| stretch.probability).sum();
        stretches.iter_mut().for_each(|stretch| stretch.probability /= all);
        stretches.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let around = |of: fn(&Stretch) -> (f64, f64)| stretches.iter().map(of).reduce(hull);
        let is_known = matches!(self.force, Force::Known(_));
        let x_95_m = around(|s| s.x_95_m)?;
        let force_95_n = if is_known { None } else { around(|s| s.force_95_n) };
        Some(ConfidenceRegion { misfit, x_95_m, force_95_n, stretches })
    }

    /// In rising order, with the places where the bound of the force becomes active.
    fn profile_places(&self, minima_m: &[f64], profile_at: &mut impl FnMut(f64) -> Best) -> Vec<Best> {
        let h_m = self.length_m / Self::CELLS as f64;
        let halved = (1..=Self::HALVINGS).map(|k| h_m * 0.5f64.powi(k));
        let mut places: Vec<f64> = (0..=Self::CELLS).map(|i| i as f64 * h_m).collect();
        places.extend(halved.clone());
        places.extend(halved.map(|x_m| self.length_m - x_m));
        places.extend(minima_m.iter().map(|x_m| x_m.clamp(0.0, self.length_m)));
        places.sort_by(f64::total_cmp);
        let mut profile: Vec<Best> = places.into_iter().map(&mut *profile_at).collect();
        let at_bound: Vec<Best> = profile
            .windows(2)
            .filter(|pair| pair[0].is_held != pair[1].is_held)
            .map(|pair| {
                edge(&pair[0], &pair[1], Self::EDGE_HALVINGS, profile_at, |at| at.is_held == pair[0].is_held)
            })
            .collect();
        profile.extend(at_bound);
        profile.sort_by(|a, b| a.x_m.total_cmp(&b.x_m));
        profile
    }

    /// Places around the best, up to barriers.
    fn around_best(&self, profile: &[Best], region: &Region) -> std::ops::Range<usize> {
        let barrier = Region { floor: self.widening * BEYOND_A_BARRIER, ..*region };
        let is_barrier = |at: &Best| !barrier.contains(at);
        let best = profile.iter().position(|at| at.cost() == region.least).unwrap_or(0);
        let from = profile[..best].iter().rposition(is_barrier).map_or(0, |i| i + 1);
        let to = profile[best..].iter().position(is_barrier).map_or(profile.len(), |i| best + i);
        from..to
    }

    fn stretch(
        &self,
        run: &[Best],
        [before, after]: [Option<Best>; 2],
        region: &Region,
        profile_at: &mut impl FnMut(f64) -> Best,
    ) -> Stretch {
        let mut end = |inside: &Best, outside: Option<Best>| match outside {
            None => *inside,
            Some(outside) => {
                edge(inside, &outside, Self::EDGE_HALVINGS, profile_at, |at| region.contains(at))
            }
        };
        let (first, last) = (end(&run[0], before), end(&run[run.len() - 1], after));
        // The bound of the force counts as the end of the line.
        let reaches = |edge: &Best, outside: Option<Best>| outside.is_none_or(|o| o.is_held) || edge.is_held;
        let way_m = last.x_m - first.x_m;
        let step = |i: usize| first.x_m + way_m * (i as f64 + 0.5) / Self::WITHIN as f64;
        let mut within: Vec<Best> = (0..Self::WITHIN).map(|i| profile_at(step(i))).collect();
        let moments = WeightedMoments::new(&within, region.least);
        let lowest = run.iter().copied().min_by(|a, b| a.cost().total_cmp(&b.cost())).unwrap_or(first);
        let at = if moments.weight > 0.0 && (reaches(&first, before) || reaches(&last, after)) {
            profile_at(first.x_m + way_m * moments.median())
        } else {
            lowest
        };
        let covariance = moments.covariance(&at, &within);
        within.extend([first, last, lowest, at]);
        Stretch {
            x_95_m: (first.x_m, last.x_m),
            force_95_n: self.forces(&within, region),
            x_m: at.x_m,
            force_n: at.force_n,
            covariance,
            probability: moments.weight * way_m.max(f64::MIN_POSITIVE),
        }
    }

    fn forces(&self, within: &[Best], region: &Region) -> (f64, f64) {
        let most = if let Force::AtMost(most) = self.force { most } else { f64::INFINITY };
        let mut forces = (f64::INFINITY, 0.0f64);
        for at in within {
            let left = region.left(at).max(0.0);
            // At the end itself the force has no effect.
            let half = if at.precision > 0.0 { (left / at.precision).sqrt() } else { 0.0 };
            forces = (forces.0.min(at.force_n - half), forces.1.max(at.force_n + half));
        }
        (forces.0.max(0.0), forces.1.min(most))
    }

    /// f at both ends for a known force; else just beside them, normalized.
    fn end_readings(&self, buffer: &mut Vec<[f64; 2]>) -> [Vec<f64>; 2] {
        const BESIDE: f64 = 1e-5;
        let is_known = matches!(self.force, Force::Known(_));
        let ends = if is_known { [0.0, 1.0] } else { [BESIDE, 1.0 - BESIDE] };
        ends.map(|share| {
            (self.channels)(share * self.length_m, self.reference_force_n, buffer);
            let norm = buffer.iter().map(|[_, f]| f * f).sum::<f64>().sqrt();
            let inverse = if is_known { 1.0 } else { norm.max(f64::MIN_POSITIVE).recip() };
            buffer.iter().map(|[_, f]| f * inverse).collect()
        })
    }

    fn best(&self, x_m: f64, ends: &[Vec<f64>; 2], buffer: &mut Vec<[f64; 2]>) -> Best {
        let (force_n, is_held, spread) = self.best_force(x_m, buffer);
        // |d|² − W·(2·d·f − W·|f|²) would cancel in a good fit.
        let squares = || buffer.iter().map(|[d, f]| (d - force_n * f).powi(2));
        let unknowns = if let Force::Known(_) = self.force { 1 } else { 2 };
        // With no more channels than unknowns, the remaining channels would explain any contact.
        let leaves_out = self.extrapolates && buffer.len() > unknowns;
        let open = if leaves_out { squares().fold(0.0, f64::max) } else { 0.0 };
        let misfit = squares().sum::<f64>() - open;
        let ff: f64 = buffer.iter().map(|[_, f]| f * f).sum();
        let across = ends.iter().map(|end| {
            let pairs = || end.iter().zip(buffer.iter());
            let square: f64 = match self.force {
                Force::Known(_) => pairs().map(|(e, [_, f])| (f - e).powi(2)).sum(),
                _ => ff - pairs().map(|(e, [_, f])| e * f).sum::<f64>().powi(2),
            };
            force_n * square.max(0.0).sqrt()
        });
        let bound = self.widening * likelihood_bound(across.fold(f64::INFINITY, f64::min));
        let precision = if let Force::Known(_) = self.force { f64::INFINITY } else { ff };
        Best { x_m, force_n, precision, misfit, spread, bound, is_held }
    }

    /// Leaves d and f in the buffer; the flag marks an active bound.
    fn best_force(&self, x_m: f64, buffer: &mut Vec<[f64; 2]>) -> (f64, bool, f64) {
        const WEIGHED: usize = 3;
        if let Force::Known(force_n) = self.force {
            let spread = (self.channels)(x_m, force_n, buffer);
            return (force_n, false, spread);
        }
        let (mut force_n, mut is_held, mut spread) = (self.reference_force_n, false, 0.0);
        for _ in 0..WEIGHED {
            spread = (self.channels)(x_m, force_n, buffer);
            let df: f64 = buffer.iter().map(|[d, f]| d * f).sum();
            let ff: f64 = buffer.iter().map(|[_, f]| f * f).sum();
            let best_n = if ff > 0.0 { (df / ff).max(0.0) } else { 0.0 };
            let mut next_n = best_n;
            if let Force::AtMost(most) = self.force {
                (next_n, is_held) = (best_n.min(most), best_n > most || ff <= 0.0);
            }
            let is_settled = (next_n - force_n).abs() <= 1e-3 * force_n;
            force_n = next_n;
            if is_settled {
                break;
            }
        }
        (force_n, is_held, spread)
    }
}

/// Bisects for the last place with `holds`.
fn edge(
    inside: &Best,
    outside: &Best,
    halvings: usize,
    profile_at: &mut impl FnMut(f64) -> Best,
    contains: impl Fn(&Best) -> bool,
) -> Best {
    let (mut good, mut bad_m) = (*inside, outside.x_m);
    for _ in 0..halvings {
        let middle = profile_at(0.5 * (good.x_m + bad_m));
        if contains(&middle) {
            good = middle;
        } else {
            bad_m = middle.x_m;
        }
    }
    good
}

struct WeightedMoments {
    densities: Vec<f64>,
    /// Mean density.
    weight: f64,
    sum: f64,
}

impl WeightedMoments {
    fn new(within: &[Best], least: f64) -> Self {
        let densities: Vec<f64> = within.iter().map(|at| (-0.5 * (at.cost() - least)).exp()).collect();
        let sum: f64 = densities.iter().sum();
        Self { weight: sum / within.len() as f64, densities, sum }
    }

    /// Median relative to the segment.
    fn median(&self) -> f64 {
        let mut before = 0.0;
        for (i, density) in self.densities.iter().enumerate() {
            if before + density >= 0.5 * self.sum {
                return (i as f64 + (0.5 * self.sum - before) / density) / self.densities.len() as f64;
            }
            before += density;
        }
        0.5
    }

    fn covariance(&self, about: &Best, within: &[Best]) -> [f64; 3] {
        let variance = if about.precision > 0.0 { about.precision.recip() } else { 0.0 };
        if self.sum <= 0.0 {
            return [0.0, 0.0, variance];
        }
        let mut mean = [0.0; 3];
        for (at, density) in within.iter().zip(&self.densities) {
            let (x, force, share) = (at.x_m - about.x_m, at.force_n - about.force_n, density / self.sum);
            mean = [mean[0] + share * x * x, mean[1] + share * x * force, mean[2] + share * force * force];
        }
        [mean[0], mean[1], mean[2] + variance]
    }
}

/// Returns the 95 % interval of a place by a normal distribution about `x_m`, which may lie beyond the ends.
pub(crate) fn interval_on_line_95(x_m: f64, sd_m: f64, length_m: f64) -> (f64, f64) {
    if !is_near_end(x_m, sd_m, length_m) || sd_m.is_nan() || sd_m <= 0.0 {
        return normal_interval_95(x_m, sd_m);
    }
    let held_m = x_m.clamp(0.0, length_m);
    let misfit = |at_m: f64| ((at_m - x_m) / sd_m).powi(2);
    let contains =
        |at_m: f64| misfit(at_m) - misfit(held_m) <= likelihood_bound(at_m.min(length_m - at_m) / sd_m);
    let edge = |end_m: f64| {
        let way_m = end_m - held_m;
        held_m + way_m * bisect((0.0, 1.0), 50, |share| contains(held_m + share * way_m))
    };
    let to = |end_m: f64| if contains(end_m) { end_m } else { edge(end_m) };
    (to(0.0), to(length_m))
}

/// Returns q: the critical value of χ² − χ²_min at distance μ from the boundary, for 95 % coverage.
///
/// With z ~ N(μ, 1) and a best fit at 0 or more, χ² − χ²_min is (z − μ)² for z ≥ 0 and μ² − 2·μ·z below: at
/// most q for z − μ from −(q + μ²)/(2μ), or −√q where that is above −μ, to √q.
pub(crate) fn likelihood_bound(distance: f64) -> f64 {
    const STEP: f64 = 0.02;
    const STEPS: usize = 100;
    static BOUNDS: OnceLock<Vec<f64>> = OnceLock::new();
    let bounds = BOUNDS.get_or_init(|| {
        let covered = |mu: f64, q: f64| {
            let below = if q.sqrt() < mu {
                q.sqrt()
            } else if mu > 0.0 {
                (q + mu * mu) / (2.0 * mu)
            } else {
                f64::INFINITY
            };
            normal_cdf(q.sqrt()) - normal_cdf(-below)
        };
        let bound = |i: usize| bisect((1.0, 6.0), 60, |q| covered(i as f64 * STEP, q) < 0.95);
        (0..=STEPS).map(bound).collect()
    });
    let place = (distance / STEP).clamp(0.0, STEPS as f64);
    let node = (place as usize).min(STEPS - 1);
    bounds[node] + (place - node as f64) * (bounds[node + 1] - bounds[node])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_that_of_feldman_and_cousins() {
        // One-sided 95 % at the boundary, two-sided away from it.
        assert!((likelihood_bound(0.0) - 2.7055).abs() < 1e-3);
        assert!((likelihood_bound(5.0) - 3.8415).abs() < 1e-3);
        assert!((likelihood_bound(f64::INFINITY) - 3.8415).abs() < 1e-3);
    }

    #[test]
    fn intervals_beside_an_end_hold_the_place_on_the_line() {
        for x_m in [-0.06, -0.01, 0.0, 0.01, 0.05, 0.5, 0.99, 1.02] {
            let (low, high) = interval_on_line_95(x_m, 0.02, 1.0);
            let held_m = f64::clamp(x_m, 0.0, 1.0);
            assert!(0.0 <= low && low <= held_m && held_m <= high && high <= 1.0, "{x_m}: {low} to {high}");
        }
        let (low, high) = interval_on_line_95(0.2, 0.02, 1.0);
        assert!((low - 0.1608).abs() < 1e-5 && (high - 0.2392).abs() < 1e-5, "{low} to {high}");
    }

    #[test]
    fn a_reading_of_nothing_but_the_product_leaves_the_place_open() {
        // Every sensor reads the product of place and force.
        let channels = |x_m: f64, _: f64, out: &mut Vec<[f64; 2]>| {
            out.clear();
            out.extend([1.0, 2.0].map(|gain| [gain * 1e3 * 0.1 * 3.0, gain * 1e3 * x_m]));
            0.0
        };
        let contacts = Contacts {
            length_m: 1.0,
            force: Force::AtMost(30.0),
            widening: 1.0,
            reference_force_n: 3.0,
            extrapolates: false,
            channels: &channels,
        };
        let found = contacts.confidence_region(&[0.3]).unwrap();
        let [stretch] = found.stretches[..] else { panic!("{found:?}") };
        assert!((found.x_95_m.0 - 0.01).abs() < 1e-4 && found.x_95_m.1 == 1.0, "{found:?}");
        let (least_n, most_n) = found.force_95_n.unwrap();
        assert!((least_n - 0.3).abs() < 0.01 && most_n == 30.0, "{found:?}");
        assert!((stretch.x_m * stretch.force_n - 0.3).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn one_channel_may_be_anything_beyond_the_presses_where_the_others_tell_the_place() {
        // Sensors that read powers of the place, at a known force of 1 N at 0.5 m.
        let confidence_region = |channels: i32, wrong: f64| {
            let channels = move |x_m: f64, _: f64, out: &mut Vec<[f64; 2]>| {
                out.clear();
                let reads = |k: i32, x_m: f64| 1e3 * f64::from(k + 1) * x_m.powi(k + 1);
                let wrong = |k: i32| if k == 0 { wrong } else { 0.0 };
                out.extend((0..channels).map(|k| [reads(k, 0.5) + wrong(k), reads(k, x_m)]));
                0.0
            };
            let contacts = Contacts {
                length_m: 1.0,
                force: Force::Known(1.0),
                widening: 1.0,
                reference_force_n: 1.0,
                extrapolates: true,
                channels: &channels,
            };
            contacts.confidence_region(&[0.5]).unwrap().x_95_m
        };
        for (channels, wrong) in [(3, 0.0), (3, 50.0), (2, 0.0), (1, 0.0)] {
            let (low_m, high_m) = confidence_region(channels, wrong);
            assert!(low_m <= 0.5 && 0.5 <= high_m && high_m - low_m < 0.1, "{channels}: {low_m} to {high_m}");
        }
    }
}

#[cfg(test)]
mod coverage;
