//! The k nearest neighbours: a contact is where the training presses were whose readings are most alike.

mod fitting;
mod locator;
mod search;

pub use fitting::{Neighbours, NeighboursFitError};
pub use locator::{Neighbour, NeighboursLocator};

#[cfg(test)]
mod tests;
