//! Profile-likelihood intervals of x, y and an unknown force on a plane.
//!
//! As on a line ([`crate::trade_off`]), an interval contains every value with a profile cost (−2·ln of the
//! likelihood) at most q above the least; q falls from 3.84 to 2.71 towards the edges that bound the value.

use super::search::{Minimum, Search};
use crate::confidence_region::{CALIBRATED, likelihood_bound};
use crate::influence::levenberg::{Unknowns, descend};
use palpate_core::Uncertainty;
use palpate_numerics::chi_squared_critical_value;
use std::sync::OnceLock;

/// Signal beyond the cost of a contact, up to which intervals include all values.
///
/// Near the detection threshold, noise can imitate another contact. χ² of the three unknowns exceeds this
/// limit in 2 % of the readings.
fn faint() -> f64 {
    const RATE: f64 = 0.02;
    static KNOWN: OnceLock<f64> = OnceLock::new();
    *KNOWN.get_or_init(|| chi_squared_critical_value(RATE, 3))
}

const SMALL: f64 = 0.02;
/// Accuracy of an end, in standard deviations.
const CLOSE: f64 = 0.003;
/// Standard deviations beyond an end, above which the way is halved.
const STEEP: f64 = 3.0;
const ROUNDS: usize = 12;
const FORCE: usize = 2;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ConfidenceIntervals([(f64, f64); 3]);

impl ConfidenceIntervals {
    pub fn write(&self, uncertainty: &mut Uncertainty) {
        let Self([x_95_m, y_95_m, force_95_n]) = *self;
        *uncertainty = Uncertainty { x_95_m, y_95_m, force_95_n: Some(force_95_n), ..*uncertainty };
    }
}

/// Evaluated place with the best force.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceProfile {
    /// x, y and force.
    pub at: Unknowns,
    /// −2·ln of the likelihood, less a constant.
    pub cost: f64,
    /// First steps of the search for interval ends.
    pub steps: [f64; 3],
}

#[derive(Clone, Copy, Debug)]
struct Way {
    unknown: usize,
    /// −1 downwards, 1 upwards.
    side: f64,
    limit: f64,
}

#[derive(Clone, Copy, Debug)]
struct RegionPoint {
    at: Unknowns,
    /// √(cost − least) − √q; positive where excluded.
    beyond: [f64; 3],
}

impl Search {
    /// Returns intervals that contain `estimate`; `square` is |d|², `minima` are sorted.
    pub fn confidence_region(
        &self,
        (whitened, square): (&[f64], f64),
        minima: &[Minimum],
        profile: impl Iterator<Item = PlaceProfile>,
        estimate: Unknowns,
    ) -> ConfidenceIntervals {
        let limits = [self.size_m[0], self.size_m[1], self.greatest_force_n];
        if self.rule.net_reduction(square, minima[0].misfit) <= faint() {
            return ConfidenceIntervals(limits.map(|limit| (0.0, limit)));
        }
        let profile: Vec<PlaceProfile> =
            profile.chain(minima.iter().map(|minimum| self.profile_of(whitened, minimum))).collect();
        let least = profile.iter().map(|profile| profile.cost).fold(f64::INFINITY, f64::min);
        let reading = Reading { search: self, whitened, least };
        // q far from all edges.
        let most_above = CALIBRATED * likelihood_bound(f64::INFINITY);
        let likely: Vec<(RegionPoint, [f64; 3])> = profile
            .iter()
            .filter(|profile| profile.cost - least <= most_above)
            .map(|profile| (reading.point(profile.at, profile.cost), profile.steps))
            .collect();
        let end = |unknown: usize, side: f64| {
            let way = Way { unknown, side, limit: if side < 0.0 { 0.0 } else { limits[unknown] } };
            reading.end(way, &likely).unwrap_or(estimate[unknown])
        };
        ConfidenceIntervals(std::array::from_fn(|k| {
            (end(k, -1.0).min(estimate[k]), end(k, 1.0).max(estimate[k]).min(limits[k]))
        }))
    }

    fn profile_of(&self, whitened: &[f64], minimum: &Minimum) -> PlaceProfile {
        let [x_m, y_m, _] = minimum.at;
        let best = self.profiled(whitened, [x_m, y_m]);
        let [along_m, across_m] = self.coarse.cell_m.map(|cell_m| 0.125 * cell_m);
        PlaceProfile {
            at: [x_m, y_m, best.force_n],
            cost: best.misfit + self.spread([x_m, y_m]),
            steps: [along_m, across_m, best.sd_n()],
        }
    }
}

struct Reading<'a> {
    search: &'a Search,
    whitened: &'a [f64],
    least: f64,
}

impl Reading<'_> {
    fn point(&self, at: Unknowns, cost: f64) -> RegionPoint {
        let root = (cost - self.least).max(0.0).sqrt();
        let [along, across] = self.search.edges.distances(at);
        let distances = [along, across, along.min(across)];
        let beyond = distances.map(|distance| root - (CALIBRATED * likelihood_bound(distance)).sqrt());
        RegionPoint { at, beyond }
    }

    /// Contact with the other unknowns profiled.
    fn constrained(&self, unknown: usize, value: f64, from: &RegionPoint) -> RegionPoint {
        let Self { search, whitened, .. } = *self;
        let mut start = from.at;
        start[unknown] = value;
        let near = [start[0], start[1]];
        if unknown != FORCE {
            start[FORCE] = search.best_force(whitened, near);
        }
        let mut ends = [(0.0, search.size_m[0]), (0.0, search.size_m[1]), (0.0, search.greatest_force_n)];
        ends[unknown] = (value, value);
        let (mut at, _) = descend(start, ends, SMALL, |at| search.equations(whitened, at, Some(near)));
        let place = [at[0], at[1]];
        let best = search.profiled(whitened, place);
        if unknown != FORCE {
            at[FORCE] = best.force_n;
        }
        self.point(at, best.misfit_with(at[FORCE]) + search.spread(place))
    }

    /// Last included value; `None` where no likely contact is included.
    fn end(&self, way: Way, likely: &[(RegionPoint, [f64; 3])]) -> Option<f64> {
        let Way { unknown, side, limit } = way;
        let is_inside = |found: &RegionPoint| found.beyond[unknown] <= 0.0;
        let reach = |(found, steps): &(RegionPoint, [f64; 3])| {
            side * found.at[unknown] - found.beyond[unknown] * steps[unknown]
        };
        let farthest =
            likely.iter().filter(|(found, _)| is_inside(found)).max_by(|a, b| reach(a).total_cmp(&reach(b)));
        let (mut inside, mut step) = farthest.map(|(found, steps)| (*found, steps[unknown]))?;
        loop {
            let left = (limit - inside.at[unknown]).abs();
            if left <= 0.0 {
                return Some(limit);
            }
            let next = if step < left { inside.at[unknown] + side * step } else { limit };
            let found = self.constrained(unknown, next, &inside);
            if !is_inside(&found) {
                return Some(self.between(unknown, inside, found));
            }
            inside = found;
            step *= 2.0;
        }
    }

    /// Last included value, by the Illinois method (Dowell and Jarratt, BIT 11, 1971).
    fn between(&self, unknown: usize, mut inside: RegionPoint, mut outside: RegionPoint) -> f64 {
        let (mut stayed, mut weights) = (None, [1.0, 1.0]);
        for _ in 0..ROUNDS {
            let beyond = [&inside, &outside].map(|found| found.beyond[unknown]);
            if beyond[0] >= -CLOSE {
                break;
            }
            let [below, above] = [weights[0] * beyond[0], weights[1] * beyond[1]];
            let share = if beyond[1] > STEEP { 0.5 } else { below / (below - above) };
            let value = inside.at[unknown] + share * (outside.at[unknown] - inside.at[unknown]);
            let found = self.constrained(unknown, value, &inside);
            let moved = usize::from(found.beyond[unknown] > 0.0);
            *[&mut inside, &mut outside][moved] = found;
            weights[moved] = 1.0;
            if stayed == Some(1 - moved) {
                weights[1 - moved] *= 0.5;
            }
            stayed = Some(1 - moved);
        }
        inside.at[unknown]
    }
}
