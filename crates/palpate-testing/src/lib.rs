//! Tools of the tests and benchmarks of any crate: real recordings, and a message if they are missing; stopped work; a strip that hands press; figures.
#![forbid(unsafe_code)]

pub mod data;
pub mod figure;
pub mod json_numbers;
pub mod skip;
pub mod stopping;
pub mod strip;
