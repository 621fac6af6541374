use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks a mutex, even after a panic.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
