//! Where to put the sensors, scored by the location error that follows.

pub mod sensors;
