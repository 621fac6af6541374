//! Machines that press by themselves: 3-D printers and mills with G-code firmware.

mod gcode;
mod simulated;
mod thread;
mod url;

pub use gcode::{Firmware, GcodeStage, StageError, StageLink};
pub use simulated::SimulatedMachine;
pub use thread::{Done, Order, StageThread};
pub use url::{StageUrl, StageUrlError};
