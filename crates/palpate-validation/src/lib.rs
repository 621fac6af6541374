//! Experiments over the public API of palpate: `cargo xtask validate NAME`.
//!
//! [`registry::EXPERIMENTS`] lists them. [`report::Report`] runs one and writes its tables; [`check`] compares them with stored ones.
#![forbid(unsafe_code)]

mod beam_ends;
mod bench;
pub mod check;
mod comparisons;
mod coverage;
mod designs;
mod drift_and_creep;
pub mod experiment;
mod false_alarms;
mod influence_sources;
mod load_patches;
mod load_profiles;
mod machine;
mod measured_edges;
mod mechanics;
mod moving_contacts;
mod moving_without_model;
mod one_weight;
mod outliers;
mod parallel;
mod plate_edges;
mod plate_limit;
mod raw_bench;
mod real_benches;
pub mod registry;
mod regression;
pub mod report;
mod statistics;
mod statuses;
mod strips;
mod studies;
mod surfaces;
pub mod table;
mod tally;
mod weighed;
