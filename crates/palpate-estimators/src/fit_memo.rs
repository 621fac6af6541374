//! Results that the fits of one task share.

use crate::recording::{Recording, Row};
use crate::setup::Setup;
use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};

/// Results of one task. The drift of a recording, its fit and those of its folds need the same ones.
pub(crate) struct FitMemo<'a> {
    setup: &'a Setup,
    results: Mutex<HashMap<(TypeId, u64), MemoEntry>>,
}

type MemoEntry = Arc<dyn Any + Send + Sync>;

impl<'a> FitMemo<'a> {
    pub fn new(setup: &'a Setup) -> Self {
        Self { setup, results: Mutex::default() }
    }

    pub fn setup(&self) -> &'a Setup {
        self.setup
    }

    /// Returns the stored result for a recording and options, or stores that of `compute`. Results of another setup are not
    /// stored.
    pub fn get_or_compute<T: Any + Send + Sync, E>(
        &self,
        (setup, recording): (&Setup, &Recording),
        options: impl Hash,
        compute: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        if setup != self.setup {
            return compute().map(Arc::new);
        }
        let key = (TypeId::of::<T>(), hash(recording, options));
        let results = || self.results.lock().unwrap_or_else(PoisonError::into_inner);
        let stored = results().get(&key).cloned();
        if let Some(Ok(result)) = stored.map(Arc::downcast::<T>) {
            return Ok(result);
        }
        let result = Arc::new(compute()?);
        let stored: MemoEntry = Arc::<T>::clone(&result);
        results().insert(key, stored);
        Ok(result)
    }
}

impl fmt::Debug for FitMemo<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("FitMemo").finish_non_exhaustive()
    }
}

/// 64 bits: two of a thousand recordings have the same hash with a probability of 3e-14.
fn hash(recording: &Recording, options: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    options.hash(&mut hasher);
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
    fn computes_once_for_each_setup_recording_and_options() {
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
        let memo = FitMemo::new(&setup);
        let count = Cell::new(0);
        let computes = |setup: &Setup, recording: &Recording, options: u8| {
            let before = count.get();
            let compute = || {
                count.set(before + 1);
                Ok::<_, Infallible>((recording.rows.len(), options))
            };
            let Ok(result) = memo.get_or_compute((setup, recording), options, compute);
            assert_eq!(*result, (recording.rows.len(), options));
            count.get() > before
        };
        assert!(computes(&setup, &first, 0));
        assert!(!computes(&setup, &first.clone(), 0));
        assert!(computes(&setup, &first, 1));
        assert!(computes(&setup, &second, 0));
        assert!(!computes(&setup, &second, 0));
        assert!(computes(&another, &second, 0));
        assert!(computes(&another, &second, 0));
    }
}
