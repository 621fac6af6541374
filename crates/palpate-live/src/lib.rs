//! Live contact localization.
//!
//! A [`source`] delivers bytes with arrival times; a [`session`] computes readings, estimates and events,
//! reproducibly without device, file or clock.

mod address;
mod broker;
pub mod calibration;
pub mod commander;
pub mod device_clock;
pub mod event;
pub mod feed;
pub mod frame;
pub mod input;
pub mod login;
pub mod monitor;
pub mod pipeline;
pub mod recording;
pub mod rules;
pub mod sample;
mod schemas;
pub mod server;
pub mod session;
pub mod simulated_board;
pub mod sink;
pub mod source;
pub mod stage;
pub mod stamp;
