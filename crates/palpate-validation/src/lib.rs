//! Experiments over the public API of palpate, each a table of figures: `cargo xtask validate NAME`.
//!
//! [`real_benches`] calibrates benches as they come and locates contacts on them afterwards, beside the same benches in a clean world.
#![forbid(unsafe_code)]

mod experiment;
pub mod real_benches;
mod tally;

pub use tally::Figures;
