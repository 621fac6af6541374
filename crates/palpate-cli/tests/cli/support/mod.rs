//! What several modules of tests use.

pub mod browser;
pub mod command;
pub mod examples;
pub mod toml;
