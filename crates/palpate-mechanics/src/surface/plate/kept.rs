//! Cache of a plate's latest influence functions: the folds and seeds of a fit all request the same ones.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::influence::PlateInfluence;
use crate::contact::Position;
use crate::sensing::SensorKind;

/// Largest memory of the cache, in bytes: the functions of a fit on the default mesh take 100 MB.
const MOST_BYTES: usize = 128_000_000;

/// Kind and position of a sensor, by their bits.
type Key = (SensorKind, [u64; 2]);

/// Influence functions by sensor.
#[derive(Default)]
pub(super) struct Kept {
    functions: Mutex<HashMap<Key, Arc<PlateInfluence>>>,
}

impl Kept {
    /// The influence functions of some sensors. `solve` is called once for all that are not cached.
    ///
    /// # Errors
    /// The error of `solve`; the cache is then unchanged.
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

    /// Caches functions; when there are then too many, drops all earlier ones.
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
