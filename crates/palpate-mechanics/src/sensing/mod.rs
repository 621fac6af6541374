//! What is measured where, and how well: sensor kinds, the layout, and the faults of real channels.

mod channel;
mod layout;
mod noise;

pub use channel::{ChannelErrors, ChannelModel, measure};
pub use layout::{Layout, even_positions, Sensor, SensorKind};
pub use noise::NoiseError;

#[cfg(test)]
mod tests;
