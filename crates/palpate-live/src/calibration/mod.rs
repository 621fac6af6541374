//! Guided calibration: presses at planned places, each recorded at rest.
//!
//! The [`Guide`] decides on readings and instants, without device, file or clock. A [`Calibration`] passes it
//! the readings, and a [`Journal`] writes each press before the next request. A [`Machine`] may press, after
//! [`SetUpTask`]s. An [`Assessment`] estimates the error of the locator; a [`Check`] measures it.

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
pub use guide::{AwaitedStep, Guide, Progress, RestingRow};
pub use journal::{DepthKnowledge, Journal, JournalError};
pub use machine::{Machine, MachineError, MachineNote, Motion};
pub use plan::{PlanError, Weights, plan};
pub use press::Press;
pub use repeat_check::RetakeReason;
pub use repeats::{Place, deviation_percent, last_deviation_percent, places};
pub use run::{Calibration, CalibrationError, Note};
pub use set_up::{LONGEST_JOG_M, SetUpNote, SetUpTask, dry_run};
pub use statements::Statements;
pub use touch_off::TouchOffFailure;
pub use trace::Trace;

#[cfg(test)]
mod tests;
