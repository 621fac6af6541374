//! State of stdout at the start of the process.
//!
//! The standard library replaces a closed stdout by `/dev/null` before `main`, and output is lost
//! without an error. An initializer of the program checks stdout before that.

use std::sync::atomic::{AtomicBool, Ordering};

static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Returns true if the process was started without stdout, as by `palpate … >&-`.
pub fn was_closed() -> bool {
    WAS_CLOSED.load(Ordering::Relaxed)
}

#[cfg(unix)]
#[ctor::ctor]
fn look() {
    let is_closed = rustix::io::fcntl_getfd(rustix::stdio::stdout()).is_err();
    WAS_CLOSED.store(is_closed, Ordering::Relaxed);
}
