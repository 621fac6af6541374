//! Greedy choice and exchange: the main search.
//!
//! Greedy choice adds one sensor at a time (Krause, Singh and Guestrin, *Journal of Machine Learning
//! Research* 9, 2008). Exchanges follow until none improves the score (Fedorov 1972). Several starts make a
//! local minimum unlikely.
//!
//! With many sites, a coarse sample is searched from all starts, a finer one from the best. Exchanges among
//! neighbours and among all units then alternate.

use super::candidates::Pool;
use super::design::{DesignError, Symmetry};
use super::objective::{Block, ForceBelief, Objective, State};
use palpate_numerics::random_order;
use palpate_numerics::watch::{Cancelled, Watch};

/// With more units, searches begin in samples: of this size for the best layout, coarse for every start.
const SAMPLE: usize = 2000;
const COARSE_SAMPLE: usize = 250;
/// Number of random starts.
const RANDOM_STARTS: u64 = 6;
/// Least relative gain of an exchange.
const LEAST_GAIN: f64 = 1e-10;
/// Least relative gain with many sites: 2 nm of a limit of 2 mm, far below any drilling tolerance.
const LEAST_GAIN_OF_MANY: f64 = 1e-6;
/// Units per block, with rows in the nearer caches.
const CHUNK: usize = 64;
const MOST_ROUNDS: usize = 100;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct SearchResult {
    pub selection: Vec<usize>,
    pub score: f64,
}

impl SearchResult {
    pub fn better_of(self, other: Self) -> Self {
        if other.score < self.score { other } else { self }
    }
}

#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    pub pool: &'a Pool,
    pub objective: &'a dyn Objective,
    pub watch: Watch<'a>,
}

struct Removal {
    removed: usize,
    others: Vec<usize>,
    state: State,
}

impl Search<'_> {
    pub fn scored(&self, selection: Vec<usize>) -> SearchResult {
        let state = self.state(&selection, ForceBelief::Vague);
        SearchResult { score: self.objective.score(&state), selection }
    }

    pub fn state(&self, selection: &[usize], belief: ForceBelief) -> State {
        let candidates = self.pool.candidates(selection);
        let rows: Vec<&[Block]> = candidates.iter().map(|candidate| self.objective.row(*candidate)).collect();
        self.objective.state(&rows, belief)
    }

    /// Best layout of several starts; `feasible` meets all constraints.
    pub fn greedy_exchange(&self, feasible: &[usize], seed: u64) -> Result<SearchResult, Cancelled> {
        if self.pool.units.len() <= SAMPLE {
            return self.best_of_starts(&self.pool.all(), feasible, seed);
        }
        let coarse = sample(self.pool, COARSE_SAMPLE, feasible);
        let found = self.best_of_starts(&coarse, feasible, seed)?;
        let fine = sample(self.pool, SAMPLE, &found.selection);
        let found = self.exchange(&fine, found.selection)?;
        self.exchange_among_many(found)
    }

    fn best_of_starts(
        &self,
        among: &[usize],
        feasible: &[usize],
        seed: u64,
    ) -> Result<SearchResult, Cancelled> {
        let starts = [self.greedy(among), even_start(self.pool, among), Some(feasible.to_vec())];
        let random = (0..RANDOM_STARTS).map(|k| random_start(self.pool, among, seed.wrapping_add(k)));
        let starts: Vec<Vec<usize>> = starts.into_iter().chain(random).flatten().collect();
        let mut best = self.scored(feasible.to_vec());
        for (done, start) in starts.iter().enumerate() {
            self.watch.stage("greedy choice and exchange", done as f64 / starts.len() as f64)?;
            let found = self.exchange(among, start.clone())?;
            best = found.better_of(best);
        }
        Ok(best)
    }

    /// Alternates exchanges with neighbours and with all units.
    fn exchange_among_many(&self, mut found: SearchResult) -> Result<SearchResult, Cancelled> {
        for _ in 0..MOST_ROUNDS {
            for _ in 0..MOST_ROUNDS {
                let before = found.score;
                found = self.exchange(&nearby(self.pool, &found.selection), found.selection)?;
                if found.score == before {
                    break;
                }
            }
            let bests = self.best_of_each_slot(&found)?;
            let mut improved = false;
            for (slot, unit) in bests {
                improved |= self.exchange_one(&[unit], &mut found, slot, LEAST_GAIN_OF_MANY);
            }
            if !improved {
                break;
            }
        }
        Ok(found)
    }

    /// Finds the best exchange of each slot, best first. One pass serves all slots: fetching rows takes as
    /// long as evaluation.
    fn best_of_each_slot(&self, found: &SearchResult) -> Result<Vec<(usize, usize)>, Cancelled> {
        let slots: Vec<usize> = (self.pool.fixed.len()..found.selection.len()).collect();
        let without: Vec<Removal> = slots.iter().map(|slot| self.remove_slot(found, *slot)).collect();
        let mut bests: Vec<Option<(usize, f64)>> = vec![None; slots.len()];
        for chunk in self.pool.all().chunks(CHUNK) {
            self.watch.round()?;
            for (best, without) in bests.iter_mut().zip(&without) {
                let better = self.best_to_fill(without, chunk);
                if better.is_some_and(|(_, score)| best.is_none_or(|(_, least)| score < least)) {
                    *best = better;
                }
            }
        }
        let mut bests: Vec<(usize, (usize, f64))> =
            slots.into_iter().zip(bests).filter_map(|(slot, best)| Some((slot, best?))).collect();
        bests.sort_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b));
        Ok(bests.into_iter().map(|(slot, (unit, _))| (slot, unit)).collect())
    }

    pub fn greedy(&self, among: &[usize]) -> Option<Vec<usize>> {
        let mut selection = self.pool.fixed.clone();
        while !self.pool.is_whole(&selection) {
            // At least two sensors are needed to determine a position and a force.
            let early = self.pool.size(&selection) < 3;
            let belief = if early { ForceBelief::Rough } else { ForceBelief::Vague };
            let state = self.state(&selection, belief);
            let joinable = self.pool.joinable(&selection, among, None);
            selection.push(self.best_of(&state, &joinable)?.0);
        }
        Some(selection)
    }

    pub fn exchange(&self, among: &[usize], selection: Vec<usize>) -> Result<SearchResult, Cancelled> {
        let mut found = self.scored(selection);
        let fixed = self.pool.fixed.len();
        let mut unchanged = 0;
        let slots = found.selection.len() - fixed;
        for step in 0..MOST_ROUNDS * slots {
            if unchanged == slots {
                break;
            }
            self.watch.round()?;
            let slot = fixed + step % slots;
            let improved = self.exchange_one(among, &mut found, slot, LEAST_GAIN);
            unchanged = if improved { 0 } else { unchanged + 1 };
        }
        Ok(found)
    }

    /// Exchanges a unit for the best of equal size, if the relative gain exceeds `least_gain`.
    fn exchange_one(&self, among: &[usize], found: &mut SearchResult, slot: usize, least_gain: f64) -> bool {
        let without = self.remove_slot(found, slot);
        let Some((unit, score)) = self.best_to_fill(&without, among) else { return false };
        let improves = unit != without.removed && score < found.score - least_gain * found.score.abs();
        if improves {
            found.selection[slot] = unit;
            found.score = score;
        }
        improves
    }

    fn remove_slot(&self, found: &SearchResult, slot: usize) -> Removal {
        let mut others = found.selection.clone();
        let leaving = others.remove(slot);
        Removal { removed: leaving, state: self.state(&others, ForceBelief::Vague), others }
    }

    fn best_to_fill(&self, without: &Removal, among: &[usize]) -> Option<(usize, f64)> {
        let size = self.pool.units[without.removed].size();
        self.best_of(&without.state, &self.pool.joinable(&without.others, among, Some(size)))
    }

    /// Unit with the best score when added, the first of equals.
    fn best_of(&self, state: &State, units: &[usize]) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        for unit in units {
            let score = self.score_with(state, *unit);
            if best.is_none_or(|(_, least)| score < least) {
                best = Some((*unit, score));
            }
        }
        best
    }

    pub fn score_with(&self, state: &State, unit: usize) -> f64 {
        let unit = self.pool.units[unit];
        match unit.twin {
            None => self.objective.score_with(state, self.objective.row(unit.first)),
            Some(twin) => {
                let with_first = self.objective.updated(state, self.objective.row(unit.first));
                self.objective.score_with(&with_first, self.objective.row(twin))
            }
        }
    }
}

/// Units within one step of the sample around a layout.
fn nearby(pool: &Pool, layout: &[usize]) -> Vec<usize> {
    let count = pool.units.len();
    let step = count.div_ceil(SAMPLE);
    let around = |unit: &usize| unit.saturating_sub(step)..(unit + step + 1).min(count);
    let mut nearby: Vec<usize> = layout.iter().flat_map(around).collect();
    nearby.sort_unstable();
    nearby.dedup();
    nearby
}

/// Samples about `size` units evenly, and a layout.
fn sample(pool: &Pool, size: usize, layout: &[usize]) -> Vec<usize> {
    let count = pool.units.len();
    let mut sample: Vec<usize> = (0..count).step_by(count.div_ceil(size)).collect();
    sample.extend(layout);
    sample.sort_unstable();
    sample.dedup();
    sample
}

/// Fills a layout from the left, the cheapest kinds first.
///
/// # Errors
/// The constraint that leaves too few sensors.
pub(super) fn feasible_layout(pool: &Pool) -> Result<Vec<usize>, DesignError> {
    let mut order = pool.all();
    let cost = |unit: &usize| pool.cost(&[*unit]) / pool.units[*unit].size() as f64;
    let place = |unit: &usize| pool.sensors[pool.units[*unit].first].position;
    order.sort_by(|a, b| cost(a).total_cmp(&cost(b)).then(place(a).cmp_by_x_then_y(&place(b))));
    let selection = joined(pool, &order);
    if pool.is_whole(&selection) { Ok(selection) } else { Err(infeasibility(pool, &order)) }
}

fn joined(pool: &Pool, order: &[usize]) -> Vec<usize> {
    let mut selection = pool.fixed.clone();
    for unit in order {
        if pool.is_whole(&selection) {
            break;
        }
        if pool.may_join(&selection, *unit) {
            selection.push(*unit);
        }
    }
    selection
}

/// Unmet constraint: the budget, if a layout exists without it.
fn infeasibility(pool: &Pool, order: &[usize]) -> DesignError {
    let count = pool.design.count;
    let mut most = pool.fixed.clone();
    for unit in order {
        let fits = pool.size(&most) + pool.units[*unit].size() <= count;
        if fits && most.iter().all(|other| pool.are_compatible(*other, *unit)) {
            most.push(*unit);
        }
    }
    let found = pool.size(&most);
    match pool.design.budget {
        Some(budget) if found == count => DesignError::Budget { budget, count, least: pool.cost(&most) },
        _ if pool.design.symmetry == Symmetry::Forbidden && pool.design.spacing_m == 0.0 => {
            DesignError::NoMirror { count, most: found }
        }
        _ => DesignError::Spacing { count, spacing_m: pool.design.spacing_m, most: found },
    }
}

fn even_start(pool: &Pool, among: &[usize]) -> Option<Vec<usize>> {
    let mut selection = pool.fixed.clone();
    let place = |unit: usize| pool.sensors[pool.units[unit].first].position;
    // A pair of units that mirror each other is represented by its left half.
    let paired = pool.design.symmetry == Symmetry::Wanted;
    let room_m = if paired { 0.5 * pool.extent.length_m() } else { pool.extent.length_m() };
    let left = pool.design.count - pool.size(&selection);
    let steps = if paired { left.div_ceil(2) } else { left };
    for step in 1..=steps {
        let wanted_m = room_m * step as f64 / (steps + 1) as f64;
        let off_m = |unit: usize| {
            let at = place(unit);
            let beside_m = pool.extent.width_m().map_or(0.0, |width_m| (at.y_m - 0.5 * width_m).abs());
            (at.x_m - wanted_m).abs() + beside_m
        };
        let joinable = pool.joinable(&selection, among, None);
        selection.push(joinable.into_iter().min_by(|a, b| off_m(*a).total_cmp(&off_m(*b)))?);
        if pool.is_whole(&selection) {
            break;
        }
    }
    pool.is_whole(&selection).then_some(selection)
}

pub(super) fn random_start(pool: &Pool, among: &[usize], seed: u64) -> Option<Vec<usize>> {
    let order: Vec<usize> = random_order(among.len(), seed).into_iter().map(|i| among[i]).collect();
    let selection = joined(pool, &order);
    pool.is_whole(&selection).then_some(selection)
}
