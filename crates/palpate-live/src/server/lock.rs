//! Locks of the server, which a thread that panics does not take with it.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Content of a mutex, also of one whose thread has panicked.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
