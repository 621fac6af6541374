use super::{Batch, Sink};
use crate::frame::Channel;
use crate::input::{Command, Input};
use crate::sample::SampleRecord;
use crate::session::Output;
use palpate_mechanics::surface::Extent;
use std::io::{self, Write};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, OnceLock};

/// Sink that writes lines of JSON immediately.
#[derive(Debug)]
pub struct JsonLines<W> {
    out: W,
    channels: Vec<Channel>,
    extent: Extent,
    reports: SyncSender<Input>,
    failed: Arc<OnceLock<io::Error>>,
}

impl<W: Write> JsonLines<W> {
    /// Sink; `reports` receives a write error.
    pub fn new(out: W, channels: &[Channel], extent: Extent, reports: SyncSender<Input>) -> Self {
        Self { out, channels: channels.to_vec(), extent, reports, failed: Arc::default() }
    }

    /// First write error.
    pub fn failed(&self) -> Arc<OnceLock<io::Error>> {
        Arc::clone(&self.failed)
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
        if self.failed.get().is_some() {
            return;
        }
        if let Err(error) = self.write(batch) {
            // A closed pipe is expected.
            if error.kind() != io::ErrorKind::BrokenPipe {
                let text = format!("samples are not printed any longer: {error}");
                let _ = self.reports.try_send(Input::Command(Command::Trouble(text)));
            }
            let _ = self.failed.set(error);
        }
    }
}
