//! What tests of any crate need: real recordings, and a word when they are not there.
#![forbid(unsafe_code)]

pub mod data;
pub mod json_numbers;
pub mod skip;
