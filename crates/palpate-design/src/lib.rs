//! Where to put the sensors and where to press, scored by the location error that follows.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod calibration;
#[cfg(test)]
mod fixtures;
pub mod positions;
pub mod sensors;
