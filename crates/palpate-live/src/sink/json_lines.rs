//! Samples and events as lines of JSON.

use super::{Batch, Sink};
use crate::frame::Channel;
use crate::sample::SampleRecord;
use crate::session::Output;
use palpate_mechanics::surface::Extent;
use std::io::{self, Write};
use std::sync::Arc;

/// Writes samples and events as lines of JSON, as they come.
#[derive(Debug)]
pub struct JsonLines<W> {
    out: W,
    channels: Vec<Channel>,
    extent: Extent,
    /// The first error of writing; nothing is written after it.
    failed: Option<io::Error>,
}

impl<W: Write> JsonLines<W> {
    /// A writer of samples of these channels.
    pub fn new(out: W, channels: &[Channel], extent: Extent) -> Self {
        Self { out, channels: channels.to_vec(), extent, failed: None }
    }

    fn write(&mut self, batch: &Batch) -> io::Result<()> {
        for output in &batch.outputs {
            match output {
                Output::Sample(sample) => {
                    serde_json::to_writer(
                        &mut self.out,
                        &SampleRecord::new(sample, &self.channels, self.extent),
                    )?;
                }
                Output::Event(event) => serde_json::to_writer(&mut self.out, event)?,
            }
            self.out.write_all(b"\n")?;
        }
        self.out.flush()
    }
}

impl<W: Write + Send> Sink for JsonLines<W> {
    fn batch(&mut self, batch: &Arc<Batch>) {
        if self.failed.is_none() {
            self.failed = self.write(batch).err();
        }
    }
}
