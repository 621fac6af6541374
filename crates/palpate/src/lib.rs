//! The library behind the `palpate` command: everything that a notebook needs, without clock, files or terminal.

pub mod arrangement;
pub mod bench;
pub mod contact;
pub mod estimator;
pub mod evaluation;
pub mod features;
pub mod gaussian_process;
pub mod influence;
pub mod mechanics;
pub mod method;
pub mod network;
pub mod numerics;
pub mod recording;
pub mod regression;
pub mod report;
pub mod rig;
pub mod sensing;
pub mod simulate;
pub mod study;
pub mod units;
