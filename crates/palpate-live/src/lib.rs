//! Live use of palpate: turns the bytes of a board into contacts.
//!
//! A [`source`] brings bytes, each with the instant of its arrival. A [`session`] turns them into readings, estimates and events. The session uses no
//! device, file or clock. Therefore the same bytes at the same instants give the same results in a test, in a replay or on the bench.

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
