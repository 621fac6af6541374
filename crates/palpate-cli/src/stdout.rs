//! Stdout at the start of the process.
//!
//! The standard library opens `/dev/null` in the place of a closed stdout before `main` runs, and answers written there are lost without
//! an error. An initializer of the program looks at stdout before that.

use std::sync::atomic::{AtomicBool, Ordering};

static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

/// True if the process was started without stdout, as by `palpate … >&-`.
pub fn was_closed() -> bool {
    WAS_CLOSED.load(Ordering::Relaxed)
}

#[cfg(unix)]
#[ctor::ctor]
fn look() {
    let is_closed = rustix::io::fcntl_getfd(rustix::stdio::stdout()).is_err();
    WAS_CLOSED.store(is_closed, Ordering::Relaxed);
}
