//! Machines that press by themselves: 3-D printers and mills with G-code firmware.

mod gcode;
mod simulated;

pub use gcode::{Firmware, GcodeStage, StageError, StageSetup};
pub use simulated::SimulatedMachine;
