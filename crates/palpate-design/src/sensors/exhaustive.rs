//! Exhaustive search of few layouts.

use super::candidates::Pool;
use super::exchange::{Search, SearchResult};
use super::objective::ForceBelief;
use palpate_numerics::watch::Cancelled;

pub(super) const MOST_LAYOUTS: f64 = 300_000.0;

/// Upper bound of the number of layouts.
pub(super) fn layouts(pool: &Pool, slots: usize) -> f64 {
    let free = pool.units.len() - pool.fixed.len();
    (0..slots).map(|i| (free as f64 - i as f64) / (i as f64 + 1.0)).product::<f64>().max(0.0)
}

pub(super) fn search(search: &Search, slots: usize) -> Result<Option<SearchResult>, Cancelled> {
    let selection = search.pool.fixed.clone();
    if slots == 0 {
        return Ok(Some(search.scored(selection)));
    }
    let mut enumeration = Enumeration { search, slots, selection, best: None };
    enumeration.fill_slot(0)?;
    Ok(enumeration.best)
}

struct Enumeration<'a> {
    search: &'a Search<'a>,
    slots: usize,
    selection: Vec<usize>,
    best: Option<SearchResult>,
}

impl Enumeration<'_> {
    fn fill_slot(&mut self, first: usize) -> Result<(), Cancelled> {
        let chosen = self.selection.len() - self.search.pool.fixed.len();
        let count = self.search.pool.units.len();
        let among: Vec<usize> = (first..count).collect();
        let joinable = self.search.pool.joinable(&self.selection, &among, None);
        if chosen + 1 == self.slots {
            self.score_selection(&joinable);
            return Ok(());
        }
        for unit in joinable {
            if chosen == 0 {
                self.search.watch.stage("all layouts", unit as f64 / count as f64)?;
            }
            self.selection.push(unit);
            self.fill_slot(unit + 1)?;
            self.selection.pop();
        }
        Ok(())
    }

    fn score_selection(&mut self, units: &[usize]) {
        let room = self.search.pool.design.count - self.search.pool.size(&self.selection);
        let state = self.search.state(&self.selection, ForceBelief::Vague);
        for unit in units.iter().filter(|unit| self.search.pool.units[**unit].size() == room) {
            let score = self.search.score_with(&state, *unit);
            if self.best.as_ref().is_none_or(|best| score < best.score) {
                let selection = self.selection.iter().copied().chain([*unit]).collect();
                self.best = Some(SearchResult { selection, score });
            }
        }
    }
}
