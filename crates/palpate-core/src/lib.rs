//! The part of palpate that also runs on a microcontroller: a reading goes in, an estimate comes out.
//! No allocation, no standard library.
#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod activation;
mod contact;
mod estimate;
mod network;

pub use activation::{Activation, Logistic};
pub use contact::{Contact, Position};
pub use estimate::{BoundedList, ContactEstimate, Estimate, Mode, Status, Uncertainty};
pub use network::{BufferMismatch, Network};
