//! Commands, files and measurements that several modules of tests share.

pub mod board;
pub mod browser;
pub mod command;
pub mod examples;
pub mod toml;
