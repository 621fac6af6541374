//! Guided calibration: presses at the planned places, each recorded when its reading is at rest.
//!
//! The [`Guide`] receives readings with their instants and reports the step that it waits for; it uses no device, file or clock. A [`Calibration`]
//! passes the readings of a source to it, and writes every press to the file of a [`Journal`] before it requests the next one. A [`Machine`]
//! presses in place of a person. An [`Assessment`] estimates the error of the locator, and the gain of more presses; a [`Check`] measures the error
//! at fresh places. [`Statements`] contain the information of the operator before the first press. A [`SetUpTask`] lets a machine show its path, or
//! find the height of the touch, before the first press.

mod assessment;
mod baseline;
mod check;
mod guide;
mod journal;
mod machine;
mod plan;
mod press;
mod repeat_check;
mod repeats;
mod run;
mod set_up;
mod statements;
mod stretch;
mod touch_off;
mod trace;

pub use assessment::{Assessment, Gain, HeldOut};
pub use check::{CHECK_PLACES, Check, CheckedPlace, check_path, check_presses};
pub use guide::{Guide, Progress, RestingRow, Waiting};
pub use journal::{DepthKnowledge, Journal, JournalError};
pub use machine::{Machine, MachineError, MachineNote, Motion};
pub use plan::{PlanError, Weights, plan};
pub use press::Press;
pub use repeat_check::Doubt;
pub use repeats::{Place, deviation_percent, last_deviation_percent, places};
pub use run::{Calibration, CalibrationError, Note};
pub use set_up::{LONGEST_JOG_M, SetUpNote, SetUpTask, dry_run};
pub use statements::Statements;
pub use touch_off::TouchOffFailure;
pub use trace::Trace;

#[cfg(test)]
mod tests;
