//! Commands, files and measurements that several modules of tests share.

#[cfg(unix)]
pub mod attempt;
pub mod board;
pub mod browser;
pub mod command;
pub mod examples;
#[cfg(unix)]
pub mod shell;
pub mod toml;
