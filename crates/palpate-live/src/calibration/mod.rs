//! Guided calibration: presses at the right places, each taken when its reading is at rest.
//!
//! The [`Guide`] is told readings with their instants and says what it waits for; it touches no device, file or clock. A [`Calibration`] feeds it with
//! what a source brings, and keeps every press in the file of a [`Journal`] before the next one is asked for. A [`Machine`] presses where a
//! person would; an [`Assessment`] estimates the error of the outcome, and the gain of more presses; a [`Check`] measures the error at fresh
//! places. [`Statements`] are what the operator says before the first press.

mod assessment;
mod check;
mod guide;
mod journal;
mod machine;
mod plan;
mod repeats;
mod run;
mod settling;
mod statements;
mod trace;

pub use assessment::{Assessment, Gain, HeldOut};
pub use check::{CHECK_PLACES, Check, CheckedPlace, check_path, check_presses};
pub use guide::{Guide, Press, Progress, Waiting};
pub use journal::{DepthKnowledge, Journal, JournalError};
pub use machine::{Machine, MachineError, MachineNote, Motion};
pub use plan::{PlanError, Weights, plan};
pub use repeats::{Place, deviation_percent, last_deviation_percent, places};
pub use run::{Calibration, CalibrationError, Note};
pub use statements::Statements;
pub use trace::Trace;

#[cfg(test)]
mod tests;
