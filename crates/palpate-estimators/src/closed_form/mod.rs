//! Contact position and force from the beam's own equations, without training: after Ellis and his colleagues (1994) and
//! Stone and Brett (1995), who solved the equations of a supported strip for the contact.
//!
//! Between two neighbouring sensors every influence function of a beam is a cubic polynomial of the contact position,
//! so what explains a reading best is a root of a polynomial: all roots are found, and all are reported.

mod balance;
mod fitting;
mod locator;
mod polynomial;
mod posterior;
mod segment;

pub use fitting::{ClosedForm, ClosedFormFitError};
pub use locator::ClosedFormLocator;

#[cfg(test)]
mod tests;
