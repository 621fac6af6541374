//! Units of measure: "400 mm" becomes 0.4 m, and back for people.
//!
//! Everything inside palpate is SI; a number meets its unit only here, in files and in messages.

mod quantity;
mod unit;

pub use quantity::{Quantity, UnitError, format_count, format_length_mm};
pub use unit::{Dimension, Unit};

#[cfg(test)]
mod tests;
