//! Work that whoever watches it stops.

use palpate_numerics::watch::{Cancelled, Watch};
use std::error::Error;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Does `work` under watches that stop it at its first look, at its second and so on, until it comes to its end: gives what it makes then, and the
/// number of looks.
///
/// # Panics
/// Work that goes on after a look that stops it, or fails for another reason.
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
