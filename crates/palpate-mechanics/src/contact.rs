//! Where and how hard a surface is touched; the same types as on a microcontroller.

pub use palpate_core::{Contact, Position};
