//! Remarks on stderr.

use std::io::Write;

/// Prints a line on stderr. Where nobody can be told there is nobody to tell: work does not end for a remark.
macro_rules! remark {
    ($($words:tt)*) => { $crate::remark::print_remark(format_args!($($words)*)) };
}
pub(crate) use remark;

/// Writes a line to stderr for [`remark`]; a stderr that takes nothing is no failure.
pub fn print_remark(words: std::fmt::Arguments) {
    let _ = std::io::stderr().lock().write_all(format!("{words}\n").as_bytes());
}
