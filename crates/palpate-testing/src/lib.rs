//! Tools of tests and benchmarks.
#![forbid(unsafe_code)]

pub mod data;
pub mod figure;
pub mod json_numbers;
pub mod random_field;
pub mod skip;
pub mod stopping;
pub mod strip;
