//! One module per verb.

pub mod calibrate;
pub mod compare;
pub mod completions;
pub mod design;
pub mod evaluate;
pub mod fit;
pub mod init;
pub mod inspect;
mod jog;
mod learnt;
pub mod limit;
pub mod locate;
pub mod man;
mod operator;
mod outlets;
pub mod profile;
pub mod record;
pub mod recover;
pub mod replay;
mod sample_benches;
pub mod serve;
pub mod simulate;
pub mod simulated_board;
pub mod study;
pub mod track;
