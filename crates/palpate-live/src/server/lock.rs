//! Locks of the server, which stay usable after a thread has panicked.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Content of a mutex, even if a thread has panicked with the lock.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
