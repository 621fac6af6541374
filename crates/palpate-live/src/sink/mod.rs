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

/// Outputs from one arrival, in their order; shared by all sinks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// The outputs.
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

/// State of a session, sent about sixty times per second.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StateRecord {
    /// Name of the source, while it is available.
    pub source: Option<String>,
    /// Readings per second.
    pub rate_hz: f64,
    /// True while the surface is touched.
    pub touched: bool,
    /// Numbers of readings, frames and losses.
    pub counters: Counters,
    /// State of each channel, in the order of a reading.
    pub channels: Vec<ChannelRecord>,
}

/// State of a channel as a record, in the unit of the board.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelRecord {
    /// State.
    pub state: ChannelState,
    /// Lowest and highest value so far.
    pub range: Option<[f64; 2]>,
    /// Standard deviation of the noise of a reading.
    pub noise_sd: f64,
}

/// A sink. It must not block: outputs that it cannot take at once go into a bounded queue, or are counted as lost.
pub trait Sink: Send {
    /// Takes a batch, which is not empty.
    fn batch(&mut self, batch: &Arc<Batch>);

    /// Takes the state of the session.
    fn state(&mut self, state: &Arc<StateRecord>) {
        let _ = state;
    }
}

/// Opens a sink for each new session, for samples of these channels on a surface of this extent. Problems are reported to the session.
///
/// # Errors
/// The system gives no thread for the sink.
pub type OpenSink =
    Box<dyn Fn(&[Channel], Extent, SyncSender<Input>) -> std::io::Result<Box<dyn Sink>> + Send + Sync>;
