//! Where to put the sensors and where to press, scored by the location error that follows.

mod calibration;
#[cfg(test)]
mod fixtures;
pub mod positions;
pub mod sensors;
