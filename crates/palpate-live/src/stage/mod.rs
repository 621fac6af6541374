//! Machines that press by themselves: 3-D printers and mills with G-code firmware.
//!
//! A [`GcodeStage`] communicates with a machine over a [`StageLink`]. Every answer must belong to the last command, and the position is compared
//! after every move. Any mismatch stops the machine, and lifts its finger if that is safe. A [`SimulatedMachine`] reproduces the faults of real
//! ones.

mod error;
mod firmware;
mod gcode;
mod link;
mod retreat;
mod simulated;
mod thread;
mod url;

pub use error::{Doubt, Finger, StageError};
pub use firmware::Firmware;
pub use gcode::{GcodeStage, Stopping};
pub use link::StageLink;
pub use simulated::{
    FaultKind, Greeting, MachineConfig, MachineConfigError, MachineFault, SimulatedLink, SimulatedMachine,
};
pub use thread::{Done, Order, StageThread};
pub use url::{StageUrl, StageUrlError};
