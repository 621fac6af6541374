//! What sensors read when a contact touches an elastic surface, and what physics allows to be told from it.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

pub mod contact;
pub mod limit;
pub mod sensing;
pub mod surface;
pub mod units;
