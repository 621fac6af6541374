//! Locators for microcontrollers, without allocation.
//!
//! ```
//! use palpate_core::{Activation, Estimate, Network, Position, Status};
//!
//! // Two readings, one hidden node, and the position in metres out.
//! let network = Network {
//!     sizes: &[2, 1, 1],
//!     biases: true,
//!     hidden_activation: Activation::Tanh,
//!     output_activation: Activation::Linear,
//!     weights: &[1.0, -2.0, 0.5, 3.0, 0.25],
//! };
//! let (mut output, mut scratch) = ([0.0], [0.0; 4]);
//! network.forward_into(&[0.3, 0.1], &mut output, &mut scratch).unwrap();
//! let estimate = Estimate::of_position(Position::along(output[0]), Status::Located);
//! assert!((estimate.contact.position.x_m - (3.0 * 0.6f64.tanh() + 0.25)).abs() < 1e-15);
//! ```
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
mod tare;

pub use activation::{Activation, Logistic};
pub use contact::{Contact, Position};
pub use estimate::{BoundedList, ContactEstimate, Estimate, LARGEST_READING, Mode, Status, Uncertainty};
pub use network::{BufferMismatch, Network};
pub use tare::{Tare, TareError};
