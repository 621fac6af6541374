//! Lines on stderr: remarks, which `--quiet` omits, and alerts.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

static QUIET: AtomicBool = AtomicBool::new(false);

/// Prints a note or a warning on stderr, which `--quiet` omits. A closed stderr is ignored.
macro_rules! remark {
    ($($words:tt)*) => { $crate::remark::print_remark(format_args!($($words)*)) };
}

/// Prints an alert on stderr, also with `--quiet`: an error, lost data, or an address that the user
/// needs.
macro_rules! alert {
    ($($words:tt)*) => { $crate::remark::print_alert(format_args!($($words)*)) };
}
pub(crate) use {alert, remark};

/// Omits remarks and progress from here on.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

pub fn print_remark(words: std::fmt::Arguments) {
    if !is_quiet() {
        print_alert(words);
    }
}

/// Writes a line to stderr; a failed write is ignored.
pub fn print_alert(words: std::fmt::Arguments) {
    let _ = std::io::stderr().lock().write_all(format!("{words}\n").as_bytes());
}
