//! Experiments over the public API of palpate, each a table of figures: `cargo xtask validate NAME`.
//!
//! [`real_benches`] calibrates benches as they come and locates contacts on them afterwards, beside the same benches in a clean world.
//! [`one_weight`] calibrates with one weight, and locates it and heavier ones.
//! [`load_profiles`] estimates loads on the founding paper's beam.
#![forbid(unsafe_code)]

mod experiment;
pub mod load_profiles;
pub mod one_weight;
mod parallel;
pub mod real_benches;
mod results;
mod tally;

pub use results::{Results, RigText};
pub use tally::Figures;
