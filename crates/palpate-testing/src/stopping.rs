//! Cancellation of work at every check.

use palpate_numerics::watch::{Cancelled, Watch};
use std::error::Error;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Cancels `work` at its first check, second check and so on until it completes; returns result and number of
/// checks.
///
/// # Panics
/// Panics if work continues after a cancellation or fails otherwise.
pub fn stopped_at_every_look<T, E: Error + 'static>(
    mut work: impl FnMut(Watch) -> Result<T, E>,
) -> (T, usize) {
    for n in 0.. {
        let looks = AtomicUsize::new(0);
        let watch = |_| looks.fetch_add(1, Ordering::Relaxed) < n;
        match work(Watch::new(&watch)) {
            Ok(made) => return (made, n),
            Err(error) => assert!(Cancelled::caused(&error), "{n}: {error}"),
        }
        assert_eq!(looks.into_inner(), n + 1, "it went on");
    }
    unreachable!("it never ends")
}
