//! Sinks of the outputs of a session.

mod alarms;
mod commands;
#[cfg(feature = "foxglove")]
pub mod foxglove;
mod json_lines;
mod mqtt;
pub mod ros;

pub use alarms::{AlarmSink, Alarms};
pub use commands::CommandSink;
pub use json_lines::JsonLines;
pub use mqtt::{MqttSink, MqttUrl, MqttUrlError};

use crate::event::{ChannelState, EventRecord};
use crate::frame::Channel;
use crate::input::Input;
use crate::sample::Sample;
use crate::session::{Counters, Output};
use palpate_mechanics::surface::Extent;
use serde::Serialize;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;

/// Outputs of one arrival, shared by all sinks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// Outputs in order.
    pub outputs: Vec<Output>,
}

impl Batch {
    /// Samples.
    pub fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.outputs.iter().filter_map(|output| match output {
            Output::Sample(sample) => Some(sample.as_ref()),
            Output::Event(_) => None,
        })
    }

    /// Events.
    pub fn events(&self) -> impl Iterator<Item = &EventRecord> {
        self.outputs.iter().filter_map(|output| match output {
            Output::Event(event) => Some(event),
            Output::Sample(_) => None,
        })
    }
}

/// State of a session, sent at 60 Hz.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StateRecord {
    /// Connected source.
    pub source: Option<String>,
    /// Readings per second.
    pub rate_hz: f64,
    /// True if touched.
    pub touched: bool,
    /// Counts of readings and frames.
    pub counters: Counters,
    /// State of each channel.
    pub channels: Vec<ChannelRecord>,
}

/// State of a channel in board units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelRecord {
    /// State.
    pub state: ChannelState,
    /// Lowest and highest value.
    pub range: Option<[f64; 2]>,
    /// Standard deviation of the noise.
    pub noise_sd: f64,
}

/// Receiver of outputs, which must not block.
pub trait Sink: Send {
    /// Receives a batch.
    fn batch(&mut self, batch: &Arc<Batch>);

    /// Receives the state.
    fn state(&mut self, state: &Arc<StateRecord>) {
        let _ = state;
    }
}

/// Factory of sinks.
///
/// # Errors
/// The system provides no thread.
pub type OpenSink =
    Box<dyn Fn(&[Channel], Extent, SyncSender<Input>) -> std::io::Result<Box<dyn Sink>> + Send + Sync>;
