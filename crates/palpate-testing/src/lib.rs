//! Tools of the tests of any crate: real recordings, and a word when they are not there; work that is stopped; a strip that hands press.
#![forbid(unsafe_code)]

pub mod data;
pub mod json_numbers;
pub mod skip;
pub mod stopping;
pub mod strip;
