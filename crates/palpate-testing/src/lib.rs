//! What tests of any crate need: real recordings, and a word when they are not there.

pub mod data;
pub mod skip;
