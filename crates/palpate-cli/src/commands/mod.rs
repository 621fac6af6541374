//! One module a verb.

pub mod compare;
pub mod design;
pub mod evaluate;
pub mod fit;
pub mod init;
pub mod inspect;
mod learnt;
pub mod limit;
pub mod locate;
pub mod profile;
pub mod serve;
pub mod simulate;
pub mod study;
pub mod track;
