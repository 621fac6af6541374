//! Cache of influence functions, for the folds and seeds of a fit.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::influence::PlateInfluence;
use crate::contact::Position;
use crate::sensing::SensorKind;

/// A fit on the default mesh takes 100 MB.
const MOST_BYTES: usize = 128_000_000;

type Key = (SensorKind, [u64; 2]);

#[derive(Default)]
pub(super) struct InfluenceCache {
    functions: Mutex<HashMap<Key, Arc<PlateInfluence>>>,
}

impl InfluenceCache {
    /// Returns functions, by one call of `solve` for missing ones.
    pub fn of_all<E>(
        &self,
        kind: SensorKind,
        sensors: &[Position],
        solve: impl FnOnce(&[Position]) -> Result<Vec<PlateInfluence>, E>,
    ) -> Result<Vec<Arc<PlateInfluence>>, E> {
        let key = |at: &Position| (kind, [at.x_m.to_bits(), at.y_m.to_bits()]);
        let mut found: HashMap<Key, Arc<PlateInfluence>> = {
            let kept = self.functions.lock().unwrap_or_else(PoisonError::into_inner);
            sensors.iter().map(key).filter_map(|key| Some((key, kept.get(&key)?.clone()))).collect()
        };
        let missing: Vec<Position> =
            sensors.iter().filter(|at| !found.contains_key(&key(at))).copied().collect();
        if !missing.is_empty() {
            let solved: Vec<_> =
                missing.iter().map(key).zip(solve(&missing)?.into_iter().map(Arc::new)).collect();
            self.keep(&solved);
            found.extend(solved);
        }
        Ok(sensors.iter().filter_map(|at| found.get(&key(at)).cloned()).collect())
    }

    fn keep(&self, solved: &[(Key, Arc<PlateInfluence>)]) {
        let bytes = |functions: &mut dyn Iterator<Item = &Arc<PlateInfluence>>| -> usize {
            functions.map(|function| function.bytes()).sum()
        };
        let new = bytes(&mut solved.iter().map(|(_, function)| function));
        if new > MOST_BYTES {
            return;
        }
        let mut kept = self.functions.lock().unwrap_or_else(PoisonError::into_inner);
        if bytes(&mut kept.values()) + new > MOST_BYTES {
            kept.clear();
        }
        kept.extend(solved.iter().cloned());
    }
}
