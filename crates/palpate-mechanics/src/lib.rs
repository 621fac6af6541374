//! What sensors read when a contact touches an elastic surface, and what physics allows to be told from it.

pub mod contact;
pub mod limit;
pub mod sensing;
pub mod surface;
pub mod units;
