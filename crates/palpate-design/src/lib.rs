//! Where to put the sensors and where to press, scored by the location error that follows.

mod calibration;
pub mod positions;
pub mod sensors;
