//! Live use of palpate: bytes of a board in, contacts out.
//!
//! A [`source`] brings bytes, each with the instant of its arrival. A [`session`] turns them into readings, estimates and events; it touches no
//! device, file or clock, so that the same bytes at the same instants give the same answers, in a test, a replay or on the bench.

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
pub mod whole_file;
