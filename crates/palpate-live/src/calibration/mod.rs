//! Guided calibration: presses at the right places, each taken when its reading is at rest.
//!
//! The [`Guide`] is told readings with their instants and says what it waits for; it touches no device, file or clock.

mod guide;
mod settling;

pub use guide::{Guide, Press, Progress, Waiting};
