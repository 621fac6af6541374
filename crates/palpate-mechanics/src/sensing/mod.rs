//! What is measured where, and how well: sensor kinds, the layout, and the faults of real channels.

mod channel;
mod group;
mod layout;
mod noise;

pub use channel::{ChannelErrors, ChannelModel, measure};
pub use group::{Placement, SensorGroup};
pub use layout::{Layout, Sensor, SensorKind, even_positions};
pub use noise::NoiseError;

#[cfg(test)]
mod tests;
