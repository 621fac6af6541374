//! Sink of browsers, which share the encoded messages.

use super::connections::most_open;
use super::history::History;
use super::lock::locked;
use crate::event::EventRecord;
use crate::frame::Channel;
use crate::sample::{Sample, SampleRecord};
use crate::session::Output;
use crate::sink::{Batch, Sink, StateRecord};
use axum::body::Bytes;
use axum::extract::ws::Utf8Bytes;
use palpate_core::Status;
use palpate_mechanics::surface::Extent;
use serde::Serialize;
use std::sync::{Arc, Mutex};
use tokio::sync::{Semaphore, broadcast};

/// Queue at 60 Hz: about a second.
const STATES: usize = 64;
const BATCHES: usize = 512;
const MOST_SAMPLES: usize = 64;
const NONE_MISSED: &str = "\"missed\":0}";

/// Connection between a session and its browsers.
#[derive(Clone, Debug)]
pub struct Hub {
    pub(super) states: broadcast::Sender<Utf8Bytes>,
    pub(super) json: broadcast::Sender<Utf8Bytes>,
    pub(super) binary: broadcast::Sender<Bytes>,
    pub(super) places: Arc<Semaphore>,
    pub(super) history: Arc<Mutex<History>>,
}

impl Default for Hub {
    fn default() -> Self {
        Self {
            states: broadcast::Sender::new(STATES),
            json: broadcast::Sender::new(BATCHES),
            binary: broadcast::Sender::new(BATCHES),
            places: Arc::new(Semaphore::new(most_open())),
            history: Arc::default(),
        }
    }
}

impl Hub {
    pub(super) fn forget_past(&self) {
        *locked(&self.history) = History::default();
    }
}

/// Sink of a session into a hub.
#[derive(Debug)]
pub struct WebSink {
    hub: Hub,
    channels: Vec<Channel>,
    extent: Extent,
    recent: Vec<Arc<Batch>>,
}

#[derive(Serialize)]
struct BatchRecord<'a> {
    samples: Vec<SampleRecord>,
    events: Vec<&'a EventRecord>,
}

#[derive(Serialize)]
struct SnapshotRecord<'a> {
    state: &'a StateRecord,
    samples: Vec<SampleRecord>,
    events: Vec<&'a EventRecord>,
    missed: u64,
}

impl WebSink {
    /// Sink for these channels.
    pub fn new(hub: Hub, channels: &[Channel], extent: Extent) -> Self {
        Self { hub, channels: channels.to_vec(), extent, recent: Vec::new() }
    }

    fn keep(&self, batch: &Batch) {
        let mut past = locked(&self.hub.history);
        for output in &batch.outputs {
            match output {
                Output::Sample(sample) => {
                    let time_s = sample.unix_ns as f64 * 1e-9;
                    if past.is_due(time_s)
                        && let Ok(text) = serde_json::to_string(&self.record(sample))
                    {
                        past.push_sample(time_s, &text);
                    }
                }
                Output::Event(event) => past.push_event(event),
            }
        }
    }

    fn record(&self, sample: &Sample) -> SampleRecord {
        SampleRecord::new(sample, &self.channels, self.extent)
    }
}

impl Sink for WebSink {
    fn batch(&mut self, batch: &Arc<Batch>) {
        self.keep(batch);
        if self.hub.states.receiver_count() > 0 {
            self.recent.push(Arc::clone(batch));
        }
        if self.hub.json.receiver_count() > 0 {
            let samples = batch.samples().map(|sample| self.record(sample)).collect();
            if let Ok(text) =
                serde_json::to_string(&BatchRecord { samples, events: batch.events().collect() })
            {
                // Fails without browsers.
                let _ = self.hub.json.send(text.into());
            }
        }
        if self.hub.binary.receiver_count() > 0 {
            let packet = packet(batch, &self.channels);
            if !packet.is_empty() {
                let _ = self.hub.binary.send(packet.into());
            }
        }
    }

    fn state(&mut self, state: &Arc<StateRecord>) {
        let recent = std::mem::take(&mut self.recent);
        if self.hub.states.receiver_count() == 0 {
            return;
        }
        let samples: Vec<&Sample> = recent.iter().flat_map(|batch| batch.samples()).collect();
        let samples = thinned(&samples).into_iter().map(|sample| self.record(sample)).collect();
        let events = recent.iter().flat_map(|batch| batch.events()).collect();
        if let Ok(text) = serde_json::to_string(&SnapshotRecord { state, samples, events, missed: 0 }) {
            let _ = self.hub.states.send(text.into());
        }
    }
}

/// Evenly spaced samples, including the last.
fn thinned<'a>(samples: &[&'a Sample]) -> Vec<&'a Sample> {
    let every = samples.len().div_ceil(MOST_SAMPLES).max(1);
    let mut thinned: Vec<&Sample> = samples.iter().rev().step_by(every).copied().collect();
    thinned.reverse();
    thinned
}

pub fn with_missed(message: &Utf8Bytes, missed: u64) -> Utf8Bytes {
    match message.strip_suffix(NONE_MISSED) {
        Some(rest) if missed > 0 => format!("{rest}\"missed\":{missed}}}").into(),
        _ => message.clone(),
    }
}

const PACKET_VERSION: u8 = 2;
const HEAD_BYTES: usize = 8;
const SAMPLE_BYTES: usize = 48;

/// Encodes a batch (docs/reference/server.md).
fn packet(batch: &Batch, channels: &[Channel]) -> Vec<u8> {
    let count = batch.samples().count();
    if count == 0 {
        return Vec::new();
    }
    let mut bytes = Vec::with_capacity(HEAD_BYTES + count * (SAMPLE_BYTES + 4 * channels.len()));
    bytes.extend([b'p', PACKET_VERSION]);
    bytes.extend((channels.len() as u16).to_le_bytes());
    bytes.extend((count as u32).to_le_bytes());
    for sample in batch.samples() {
        let contact = &sample.estimate.contact;
        let sd = |variance: fn(&[f64; 6]) -> f64| {
            contact.uncertainty.map_or(f64::NAN, |uncertainty| variance(&uncertainty.covariance).sqrt())
        };
        bytes.extend(sample.number.to_le_bytes());
        bytes.extend(sample.unix_ns.to_le_bytes());
        bytes.extend([code(sample.estimate.status), sample.estimate.further.as_slice().len() as u8, 0, 0]);
        let figures = [
            contact.position.x_m * 1e3,
            contact.position.y_m * 1e3,
            contact.force_n.unwrap_or(f64::NAN),
            sd(|covariance| covariance[0]) * 1e3,
            sd(|covariance| covariance[3]) * 1e3,
            sd(|covariance| covariance[5]),
            contact.uncertainty.map_or(f64::NAN, |uncertainty| uncertainty.covariance[1]) * 1e6,
        ];
        let readings =
            sample.reading.iter().zip(channels).map(|(value, channel)| value / channel.unit.factor());
        let floats = figures.into_iter().chain(readings);
        floats.for_each(|value| bytes.extend((value as f32).to_le_bytes()));
    }
    bytes
}

fn code(status: Status) -> u8 {
    match status {
        Status::NoContact => 0,
        Status::Located => 1,
        Status::Ambiguous => 2,
        Status::OutsideModel => 3,
        _ => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::Counters;
    use tokio::sync::broadcast::error::TryRecvError;

    #[test]
    fn the_oldest_messages_are_dropped_and_counted() {
        let hub = Hub::default();
        let mut slow = hub.states.subscribe();
        let mut sink = WebSink::new(hub, &[], Extent::line(0.4).unwrap());
        for readings in 0..200 {
            let counters = Counters { readings, ..Counters::default() };
            sink.state(&Arc::new(StateRecord { counters, ..StateRecord::default() }));
        }
        assert!(matches!(slow.try_recv(), Err(TryRecvError::Lagged(136))));
        let message = slow.try_recv().unwrap();
        let told: serde_json::Value = serde_json::from_str(&with_missed(&message, 136)).unwrap();
        assert_eq!((&told["missed"], &told["state"]["counters"]["readings"]), (&136.into(), &136.into()));
        // The bytes are shared, without missed messages.
        assert_eq!(with_missed(&message, 0).as_ptr(), message.as_ptr());
    }
}
