//! Memo of influence functions.

use super::learning::Learnt;
use crate::influence::config::Structure;
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use std::collections::HashMap;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};

/// Influence functions that the drift, fit and folds of one task share.
pub(crate) struct LearningMemo<'a> {
    setup: &'a Setup,
    learnt: Mutex<HashMap<Key, Option<Arc<Learnt>>>>,
}

/// Structure, most presses and hash of the rows.
type Key = (Structure, usize, u64);

impl<'a> LearningMemo<'a> {
    pub(crate) fn new(setup: &'a Setup) -> Self {
        Self { setup, learnt: Mutex::default() }
    }

    pub(crate) fn setup(&self) -> &'a Setup {
        self.setup
    }

    /// Returns stored functions, or stores the result of `learn` for the memo's setup.
    pub(super) fn get_or_learn<E>(
        &self,
        (setup, recording): (&Setup, &Recording),
        (structure, most_presses): (Structure, usize),
        learn: impl FnOnce() -> Result<Option<Learnt>, E>,
    ) -> Result<Option<Arc<Learnt>>, E> {
        let learn = || Ok(learn()?.map(Arc::new));
        if setup != self.setup {
            return learn();
        }
        let key = (structure, most_presses, hash_of_rows(recording));
        let stored = || self.learnt.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(learnt) = stored().get(&key) {
            return Ok(learnt.clone());
        }
        let learnt = learn()?;
        stored().insert(key, learnt.clone());
        Ok(learnt)
    }
}

impl fmt::Debug for LearningMemo<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("LearningMemo").finish_non_exhaustive()
    }
}

/// Two of a thousand recordings collide with probability 3e-14.
fn hash_of_rows(recording: &Recording) -> u64 {
    let mut hasher = DefaultHasher::new();
    for Row { position, force_n, nuisances, time_s, reading } in &recording.rows {
        [position.x_m, position.y_m].map(f64::to_bits).hash(&mut hasher);
        [force_n, time_s].map(|value| value.map(f64::to_bits)).hash(&mut hasher);
        nuisances.len().hash(&mut hasher);
        nuisances.iter().chain(reading).for_each(|value| value.to_bits().hash(&mut hasher));
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{pad, raw_recording, strip};
    use palpate_mechanics::contact::Position;
    use std::cell::Cell;
    use std::convert::Infallible;

    #[test]
    fn learns_once_for_each_setup_structure_and_recording() {
        let row = Row {
            position: Position::along(0.1),
            force_n: Some(2.0),
            nuisances: Vec::new(),
            time_s: None,
            reading: vec![1.0, 2.0],
        };
        let other = Row { time_s: Some(0.0), ..row.clone() };
        let [first, second] = [vec![row.clone()], vec![row, other]].map(raw_recording);
        let (setup, another) = (strip(), pad());
        let memo = LearningMemo::new(&setup);
        let count = Cell::new(0);
        let learns = |setup: &Setup, recording: &Recording, structure: Structure| {
            let before = count.get();
            let learn = || {
                count.set(before + 1);
                Ok::<_, Infallible>(None)
            };
            let Ok(learnt) = memo.get_or_learn((setup, recording), (structure, 10), learn);
            assert!(learnt.is_none());
            count.get() > before
        };
        assert!(learns(&setup, &first, Structure::Auto));
        assert!(!learns(&setup, &first.clone(), Structure::Auto));
        assert!(learns(&setup, &first, Structure::ForceLinear));
        assert!(learns(&setup, &second, Structure::Auto));
        assert!(!learns(&setup, &second, Structure::Auto));
        assert!(learns(&another, &second, Structure::Auto));
        assert!(learns(&another, &second, Structure::Auto));
    }
}
