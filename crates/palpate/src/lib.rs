//! The library behind the `palpate` command: everything that a notebook needs, without clock, files or terminal.

pub mod arrangement;
pub mod bench;
pub mod centroid;
pub mod closed_form;
pub mod contact;
pub mod design;
pub mod digit;
pub mod distribution;
pub mod estimator;
pub mod evaluation;
pub mod features;
pub mod gaussian_process;
pub mod influence;
pub mod limit;
pub mod mechanics;
pub mod method;
pub mod neighbours;
pub mod network;
pub mod numerics;
pub mod recording;
pub mod regression;
pub mod report;
pub mod rig;
pub mod sensing;
pub mod simulate;
pub mod study;
pub mod tracking;
pub mod units;

#[cfg(test)]
#[path = "../tests/support/mod.rs"]
mod support;
