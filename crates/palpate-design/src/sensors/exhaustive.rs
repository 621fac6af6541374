//! Every layout there is, where they are few.

use super::candidates::Pool;
use super::exchange::{Found, score_with};
use super::objective::{ForceBelief, Objective, state_of};
use palpate_numerics::watch::{Cancelled, Watch};

/// More layouts than this are not gone through.
pub(super) const MOST_LAYOUTS: f64 = 300_000.0;

/// Largest number of layouts: the ways to choose as many units as there are slots.
pub(super) fn layouts(pool: &Pool, slots: usize) -> f64 {
    let free = pool.units.len() - pool.fixed.len();
    (0..slots).map(|i| (free as f64 - i as f64) / (i as f64 + 1.0)).product::<f64>().max(0.0)
}

/// The best of all layouts of so many free units; `None` when there is none.
pub(super) fn search(
    pool: &Pool,
    objective: &dyn Objective,
    slots: usize,
    watch: Watch,
) -> Result<Option<Found>, Cancelled> {
    let mut search = Search { pool, objective, slots, selection: pool.fixed.clone(), best: None };
    if slots == 0 {
        return Ok(Some(Found::of(pool, objective, pool.fixed.clone())));
    }
    search.from(0, watch)?;
    Ok(search.best)
}

struct Search<'a> {
    pool: &'a Pool,
    objective: &'a dyn Objective,
    slots: usize,
    selection: Vec<usize>,
    best: Option<Found>,
}

impl Search<'_> {
    /// Goes through the units from `first` on for the next slot.
    fn from(&mut self, first: usize, watch: Watch) -> Result<(), Cancelled> {
        let chosen = self.selection.len() - self.pool.fixed.len();
        let count = self.pool.units.len();
        let among: Vec<usize> = (first..count).collect();
        let joinable = self.pool.joinable(&self.selection, &among, None);
        if chosen + 1 == self.slots {
            self.judge(&joinable);
            return Ok(());
        }
        for unit in joinable {
            if chosen == 0 {
                watch.stage("all layouts", unit as f64 / count as f64)?;
            }
            self.selection.push(unit);
            self.from(unit + 1, watch)?;
            self.selection.pop();
        }
        Ok(())
    }

    /// The last slot: every unit that fills the layout.
    fn judge(&mut self, units: &[usize]) {
        let room = self.pool.design.count - self.pool.size(&self.selection);
        let state = state_of(self.objective, &self.pool.candidates(&self.selection), ForceBelief::Vague);
        for unit in units.iter().filter(|unit| self.pool.units[**unit].size() == room) {
            let score = score_with(self.pool, self.objective, &state, *unit);
            if self.best.as_ref().is_none_or(|best| score < best.score) {
                let selection = self.selection.iter().copied().chain([*unit]).collect();
                self.best = Some(Found { selection, score });
            }
        }
    }
}
