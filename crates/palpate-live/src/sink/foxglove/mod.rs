//! WebSocket server for Foxglove, with the topics of a recording and a 3D scene.

mod scene;

use self::scene::Scene;
use super::{Batch, Sink};
use crate::event::EventRecord;
use crate::frame::Channel;
use crate::sample::Sample;
use crate::schemas::{
    ESTIMATE, ESTIMATE_SCHEMA, EVENT, EVENT_SCHEMA, EstimateMessage, READING, ReadingMessage,
};
use foxglove::messages::SceneUpdate;
use foxglove::{
    ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServer,
    WebSocketServerHandle,
};
use palpate_mechanics::surface::Extent;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::net::SocketAddr;
use std::sync::Arc;

/// Topic of the scene.
pub const CONTACT: &str = "/contact";

/// Server for Foxglove; clients cannot affect the session.
pub struct FoxgloveServer {
    context: Arc<Context>,
    address: SocketAddr,
    handle: Option<WebSocketServerHandle>,
}

/// Error of an address.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen at {address} for Foxglove: {error}")]
pub struct FoxgloveServerError {
    /// Address.
    pub address: SocketAddr,
    error: FoxgloveError,
}

impl FoxgloveServer {
    /// Starts a server; port 0 selects a free port.
    ///
    /// # Errors
    /// The address is in use, or not of this machine.
    ///
    /// # Panics
    /// In an asynchronous context, because the server has its own runtime.
    pub fn start(address: SocketAddr) -> Result<Self, FoxgloveServerError> {
        let context = Context::new();
        // In URLs an IPv6 address is in brackets.
        let host = match address {
            SocketAddr::V4(address) => address.ip().to_string(),
            SocketAddr::V6(address) => format!("[{}]", address.ip()),
        };
        let server = WebSocketServer::new().name("palpate").context(&context).bind(host, address.port());
        let handle = server.start_blocking().map_err(|error| FoxgloveServerError { address, error })?;
        let address = SocketAddr::new(address.ip(), handle.port());
        Ok(Self { context, address, handle: Some(handle) })
    }

    /// Address.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sink; a slow client loses the oldest of 1,024 messages.
    ///
    /// # Errors
    /// A topic without an encoding, not expected.
    pub fn sink(&self, channels: &[Channel], extent: Extent) -> std::io::Result<FoxgloveSink> {
        let json = |topic, name: &str, schema: Vec<u8>| {
            ChannelBuilder::new(topic)
                .context(&self.context)
                .message_encoding("json")
                .schema(Schema::new(name, "jsonschema", schema))
                .build_raw()
                .map_err(std::io::Error::other)
        };
        Ok(FoxgloveSink {
            reading: json(READING, "palpate.Reading", reading_schema(channels))?,
            estimate: json(ESTIMATE, "palpate.Estimate", ESTIMATE_SCHEMA.into())?,
            event: json(EVENT, "palpate.Event", EVENT_SCHEMA.into())?,
            contact: ChannelBuilder::new(CONTACT).context(&self.context).build(),
            scene: Scene::new(extent),
            channels: channels.iter().map(|channel| (channel.name.clone(), channel.unit.factor())).collect(),
            extent,
        })
    }
}

impl Drop for FoxgloveServer {
    fn drop(&mut self) {
        let Some(handle) = self.handle.take() else { return };
        // Waits in a separate thread, because an asynchronous context refuses it, and the server may be
        // dropped in one.
        let wait = move || handle.stop().wait_blocking();
        if let Ok(thread) = std::thread::Builder::new().name("foxglove-end".to_owned()).spawn(wait) {
            let _ = thread.join();
        }
    }
}

/// Foxglove offers each channel for plots.
fn reading_schema(channels: &[Channel]) -> Vec<u8> {
    let values: Map<String, Value> =
        channels.iter().map(|channel| (channel.name.clone(), json!({ "type": "number" }))).collect();
    let schema = json!({
        "title": "palpate.Reading",
        "type": "object",
        "properties": {
            "number": { "type": "integer", "description": "which reading of the session, from 0" },
            "values": {
                "type": "object",
                "properties": values,
                "description": "what the board sent, one number a channel, in its unit",
            },
        },
    });
    schema.to_string().into_bytes()
}

/// Sink of a [`FoxgloveServer`].
pub struct FoxgloveSink {
    reading: Arc<RawChannel>,
    estimate: Arc<RawChannel>,
    event: Arc<RawChannel>,
    contact: foxglove::Channel<SceneUpdate>,
    scene: Scene,
    channels: Vec<(String, f64)>,
    extent: Extent,
}

impl FoxgloveSink {
    fn sample(&self, sample: &Sample) {
        let at_ns = sample.unix_ns;
        log(&self.reading, at_ns, || ReadingMessage { sample, channels: &self.channels });
        log(&self.estimate, at_ns, || EstimateMessage::new(sample, self.extent));
        if self.contact.has_sinks() {
            self.contact.log_with_time(&self.scene.update(&sample.estimate, at_ns), at_ns);
        }
    }

    fn event(&self, event: &EventRecord) {
        log(&self.event, (event.time_s * 1e9) as u64, || event);
    }
}

impl Sink for FoxgloveSink {
    fn batch(&mut self, batch: &Arc<Batch>) {
        batch.samples().for_each(|sample| self.sample(sample));
        batch.events().for_each(|event| self.event(event));
    }
}

fn log<T: Serialize>(topic: &RawChannel, at_ns: u64, record: impl FnOnce() -> T) {
    if !topic.has_sinks() {
        return;
    }
    if let Ok(json) = serde_json::to_vec(&record()) {
        topic.log_with_meta(&json, PartialMetadata::with_log_time(at_ns));
    }
}
