//! Greedy choice and exchange: the main search.
//!
//! Sensors are added one at a time, each the one that improves the score most; then each in turn is exchanged for the best
//! other one, until no exchange improves (Fedorov 1972 for designs of experiments; greedy choice of sensors by their
//! information: Krause, Singh and Guestrin, *Journal of Machine Learning Research* 9, 2008). What it ends in no single exchange
//! improves; several starts make it likely that nothing else does either. Of very many sites a sample is searched from all
//! starts, and the best layout is exchanged among their neighbours and then among all of them.

use super::objective::{ForceBelief, Objective, State, score_of, state_of};
use super::pool::Pool;
use super::starts;
use crate::design::sensors::{KeepGoing, Stage};

/// With more units than this, searches begin in a sample of them.
const SAMPLE: usize = 2000;
/// Random layouts from which the exchange starts too.
const RANDOM_STARTS: u64 = 6;
/// An exchange must improve the score by more than this share of it.
const LEAST_GAIN: f64 = 1e-10;
/// Rounds of exchange, far more than any search takes.
const MOST_ROUNDS: usize = 100;

/// A layout and its score.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Found {
    pub selection: Vec<usize>,
    pub score: f64,
}

impl Found {
    pub fn of(pool: &Pool, objective: &dyn Objective, selection: Vec<usize>) -> Self {
        let score = score_of(objective, &pool.candidates(&selection));
        Self { selection, score }
    }

    /// The better of the two.
    pub fn or_better(self, other: Option<Self>) -> Self {
        match other {
            Some(other) if other.score < self.score => other,
            _ => self,
        }
    }
}

/// The best layout of several starts; `packed` is one that keeps all constraints. `None` when `keep_going` says no.
pub(super) fn search(
    pool: &Pool,
    objective: &dyn Objective,
    packed: &[usize],
    seed: u64,
    keep_going: &mut KeepGoing,
) -> Option<Found> {
    let sample = sample(pool, packed);
    let starts = [greedy(pool, objective, &sample), starts::spread(pool, &sample), Some(packed.to_vec())];
    let random = (0..RANDOM_STARTS).map(|k| starts::random(pool, &sample, seed.wrapping_add(k)));
    let starts: Vec<Vec<usize>> = starts.into_iter().chain(random).flatten().collect();
    let mut best: Option<Found> = None;
    for (done, start) in starts.iter().enumerate() {
        if !keep_going(Stage::Exchange, done as f64 / starts.len() as f64) {
            return None;
        }
        let found = exchange(pool, objective, &sample, start.clone(), keep_going)?;
        best = Some(found.or_better(best));
    }
    let best = best?;
    if sample.len() == pool.units.len() {
        return Some(best);
    }
    // First among the neighbours that the sample left out, so that few passes go over all.
    let near = exchange(pool, objective, &nearby(pool, &best.selection), best.selection, keep_going)?;
    let all: Vec<usize> = (0..pool.units.len()).collect();
    exchange(pool, objective, &all, near.selection, keep_going)
}

/// The units between a layout's own and the next ones of the sample.
fn nearby(pool: &Pool, layout: &[usize]) -> Vec<usize> {
    let count = pool.units.len();
    let step = count.div_ceil(SAMPLE);
    let around = |unit: &usize| unit.saturating_sub(step)..(unit + step + 1).min(count);
    let mut nearby: Vec<usize> = layout.iter().flat_map(around).collect();
    nearby.sort_unstable();
    nearby.dedup();
    nearby
}

/// Units evenly out of all of them, with those of a layout.
fn sample(pool: &Pool, layout: &[usize]) -> Vec<usize> {
    let count = pool.units.len();
    let mut sample: Vec<usize> = (0..count).step_by(count.div_ceil(SAMPLE)).collect();
    sample.extend(layout);
    sample.sort_unstable();
    sample.dedup();
    sample
}

/// The layout that grows by the best unit at a time; `None` where it gets stuck.
pub(super) fn greedy(pool: &Pool, objective: &dyn Objective, among: &[usize]) -> Option<Vec<usize>> {
    let mut selection = pool.fixed.clone();
    while pool.size(&selection) < pool.design.count {
        // Two sensors are the least that tell a position and a force.
        let early = pool.size(&selection) < 3;
        let belief = if early { ForceBelief::Rough } else { ForceBelief::Vague };
        let state = state_of(objective, &pool.candidates(&selection), belief);
        let joinable = pool.joinable(&selection, among, None);
        selection.push(best_of(pool, objective, &state, &joinable)?.0);
    }
    Some(selection)
}

/// Exchanges one unit after the other for the best, until nothing improves. `None` when `keep_going` says no.
pub(super) fn exchange(
    pool: &Pool,
    objective: &dyn Objective,
    among: &[usize],
    selection: Vec<usize>,
    keep_going: &mut KeepGoing,
) -> Option<Found> {
    let mut found = Found::of(pool, objective, selection);
    let fixed = pool.fixed.len();
    let mut unchanged = 0;
    let slots = found.selection.len() - fixed;
    for step in 0..MOST_ROUNDS * slots {
        if unchanged == slots {
            break;
        }
        if !keep_going(Stage::Exchange, f64::NAN) {
            return None;
        }
        let slot = fixed + step % slots;
        let improved = exchange_one(pool, objective, among, &mut found, slot);
        unchanged = if improved { 0 } else { unchanged + 1 };
    }
    Some(found)
}

/// Exchanges the unit in one slot for the best of its size, if that improves the score.
fn exchange_one(
    pool: &Pool,
    objective: &dyn Objective,
    among: &[usize],
    found: &mut Found,
    slot: usize,
) -> bool {
    let mut others = found.selection.clone();
    let leaving = others.remove(slot);
    let state = state_of(objective, &pool.candidates(&others), ForceBelief::Vague);
    let joinable = pool.joinable(&others, among, Some(pool.units[leaving].size()));
    let Some((unit, score)) = best_of(pool, objective, &state, &joinable) else { return false };
    let improves = unit != leaving && score < found.score - LEAST_GAIN * found.score.abs();
    if improves {
        found.selection[slot] = unit;
        found.score = score;
    }
    improves
}

/// The unit whose addition scores best, the first of equals.
fn best_of(pool: &Pool, objective: &dyn Objective, state: &State, units: &[usize]) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for unit in units {
        let score = score_with(pool, objective, state, *unit);
        if best.is_none_or(|(_, least)| score < least) {
            best = Some((*unit, score));
        }
    }
    best
}

/// The score with one more unit.
pub(super) fn score_with(pool: &Pool, objective: &dyn Objective, state: &State, unit: usize) -> f64 {
    let unit = pool.units[unit];
    match unit.twin {
        None => objective.score_with(state, objective.row(unit.first)),
        Some(twin) => {
            let with_first = objective.with(state, objective.row(unit.first));
            objective.score_with(&with_first, objective.row(twin))
        }
    }
}
