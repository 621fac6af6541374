//! Lines on stderr: remarks, which `--quiet` omits, and alerts.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

/// True if `--quiet` is given.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Prints a remark on stderr: a note or a warning, which `--quiet` omits. A closed stderr is ignored: work does not end because of a
/// remark.
macro_rules! remark {
    ($($words:tt)*) => { $crate::remark::print_remark(format_args!($($words)*)) };
}

/// Prints an alert on stderr, also with `--quiet`: an error, lost data, or an address without which the command is of no use.
macro_rules! alert {
    ($($words:tt)*) => { $crate::remark::print_alert(format_args!($($words)*)) };
}
pub(crate) use {alert, remark};

/// Omits remarks and progress from here on.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// True if remarks and progress are omitted.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Writes a line to stderr for [`remark`].
pub fn print_remark(words: std::fmt::Arguments) {
    if !is_quiet() {
        print_alert(words);
    }
}

/// Writes a line to stderr for [`alert`]; a failed write is ignored.
pub fn print_alert(words: std::fmt::Arguments) {
    let _ = std::io::stderr().lock().write_all(format!("{words}\n").as_bytes());
}
