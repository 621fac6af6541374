//! Remarks on stderr.

use std::io::Write;

/// Prints a line on stderr. A closed stderr is ignored: work does not end because of a remark.
macro_rules! remark {
    ($($words:tt)*) => { $crate::remark::print_remark(format_args!($($words)*)) };
}
pub(crate) use remark;

/// Writes a line to stderr for [`remark`]; a failed write is ignored.
pub fn print_remark(words: std::fmt::Arguments) {
    let _ = std::io::stderr().lock().write_all(format!("{words}\n").as_bytes());
}
