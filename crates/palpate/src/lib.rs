//! palpate.

pub mod report;
