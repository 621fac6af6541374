//! One module per verb.

#[cfg(feature = "live")]
pub mod calibrate;
pub mod compare;
pub mod completions;
pub mod design;
pub mod evaluate;
pub mod fit;
pub mod init;
pub mod inspect;
#[cfg(feature = "live")]
mod jog;
mod learnt;
pub mod limit;
pub mod locate;
pub mod man;
#[cfg(feature = "live")]
mod operator;
pub mod profile;
#[cfg(feature = "live")]
pub mod record;
#[cfg(feature = "live")]
pub mod recover;
#[cfg(feature = "live")]
pub mod replay;
mod sample_benches;
#[cfg(feature = "live")]
pub mod serve;
pub mod simulate;
#[cfg(feature = "live")]
pub mod simulated_board;
#[cfg(feature = "live")]
mod sink_options;
pub mod study;
pub mod track;
