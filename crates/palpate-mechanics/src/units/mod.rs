//! Units of measure: "400 mm" becomes 0.4 m, and back for people.
//!
//! Everything inside palpate is SI; a number meets its unit only here, in files and in messages.

mod quantity;
mod si;
mod unit;

pub use quantity::{Quantity, UnitError, format_count, format_length_mm};
pub use si::{gpa, microstrain, mm, mpa, newtons, um};
pub use unit::{Dimension, Unit};

#[cfg(test)]
mod tests;
