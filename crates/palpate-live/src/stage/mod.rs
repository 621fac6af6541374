//! Machines that press: 3-D printers and mills with G-code firmware.
//!
//! A [`GcodeStage`] controls a machine over a [`StageLink`], and verifies every answer and position. A
//! mismatch stops the machine, and lifts its finger if that is safe. A [`SimulatedMachine`] reproduces
//! faults.

mod error;
mod firmware;
mod gcode;
mod link;
mod retreat;
mod simulated;
mod thread;
mod url;

pub use error::{Finger, StageError, StopReason};
pub use firmware::Firmware;
pub use gcode::{GcodeStage, Stopping};
pub use link::StageLink;
pub use simulated::{
    FaultKind, Greeting, MachineConfig, MachineConfigError, MachineFault, SimulatedLink, SimulatedMachine,
};
pub use thread::{Order, StagePosition, StageThread};
pub use url::{StageUrl, StageUrlError};
