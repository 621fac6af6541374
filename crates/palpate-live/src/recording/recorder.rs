use super::RecordingError;
use super::head::{Head, LOCATOR, METADATA, Subject};
use super::tail::Tail;
use crate::input::{Command, Input};
use crate::schemas::{EstimateMessage, ReadingMessage, TOPICS};
use crate::session::Output;
use crate::sink::{Batch, Sink};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use serde::Serialize;
use std::io::{Seek, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const WAITING: usize = 8192;
/// Half of the promised 100 ms that a killed process loses.
const FLUSH_EVERY: Duration = Duration::from_millis(50);
const CHUNK: u64 = 1 << 16;
const MOST_PENDING: usize = 8 << 20;
/// Period of retries and checks of the file.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Status of a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RecordingStatus {
    /// File name.
    pub name: String,
    /// File size.
    pub bytes: u64,
    /// Duration in seconds.
    pub seconds: f64,
    /// Readings in the file.
    pub readings: u64,
    /// Readings lost to a full or slow disk.
    pub lost: u64,
    /// Current problem.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// Sink that writes a file in a separate thread.
#[derive(Debug)]
pub struct Recorder {
    to: Option<SyncSender<Arc<Batch>>>,
    status: Arc<Mutex<RecordingStatus>>,
    thread: Option<JoinHandle<()>>,
}

impl Recorder {
    pub(super) fn begin(
        path: &Path,
        subject: Arc<Subject>,
        reports: SyncSender<Input>,
    ) -> Result<Self, RecordingError> {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let tail = Tail::create(path)?;
        let status = Arc::new(Mutex::new(RecordingStatus { name, ..RecordingStatus::default() }));
        let (to, from) = sync_channel(WAITING);
        let shared = Arc::clone(&status);
        let work = move || {
            let mut recording = match Recording::begin(tail, &subject, shared, reports) {
                Ok(recording) => recording,
                Err((shared, problem)) => {
                    lock(&shared).problem = Some(problem);
                    return;
                }
            };
            recording.run(&from);
        };
        let thread =
            std::thread::Builder::new().name("recorder".to_owned()).spawn(work).map_err(|error| {
                RecordingError::File { verb: "record into", path: path.display().to_string(), error }
            })?;
        Ok(Self { to: Some(to), status, thread: Some(thread) })
    }

    /// Status.
    pub fn status(&self) -> RecordingStatus {
        lock(&self.status).clone()
    }

    /// Ends the recording, and waits for the file.
    pub fn finish(mut self) -> RecordingStatus {
        self.close();
        self.status()
    }

    fn close(&mut self) {
        drop(self.to.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            lock(&self.status).problem = Some("the recorder has failed".to_owned());
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.close();
    }
}

impl Sink for Recorder {
    fn batch(&mut self, batch: &Arc<Batch>) {
        let Some(to) = &self.to else { return };
        if let Err(TrySendError::Full(batch) | TrySendError::Disconnected(batch)) =
            to.try_send(Arc::clone(batch))
        {
            lock(&self.status).lost += batch.samples().count() as u64;
        }
    }
}

fn lock(status: &Mutex<RecordingStatus>) -> std::sync::MutexGuard<'_, RecordingStatus> {
    status.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Clone, Debug, Default)]
struct SharedBuffer(Arc<Mutex<Vec<u8>>>);

impl SharedBuffer {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Write for SharedBuffer {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// The MCAP writer writes into memory, which never fails; [`Tail`] writes the file.
struct Recording<'a> {
    writer: Writer<NoSeek<SharedBuffer>>,
    encoded: SharedBuffer,
    tail: Tail,
    subject: &'a Subject,
    names: Vec<(String, f64)>,
    topics: [u16; 3],
    sequence: u32,
    scratch: Vec<u8>,
    times_ns: Option<(u64, u64)>,
    /// The status counts readings in the file.
    encoded_readings: u64,
    status: Arc<Mutex<RecordingStatus>>,
    reports: SyncSender<Input>,
    look_at: Instant,
    health: Health,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Health {
    Well,
    Full,
    /// The file was removed, or the encoder failed: the recording has ended.
    Gone,
}

impl<'a> Recording<'a> {
    fn begin(
        tail: Tail,
        subject: &'a Subject,
        status: Arc<Mutex<RecordingStatus>>,
        reports: SyncSender<Input>,
    ) -> Result<Self, (Arc<Mutex<RecordingStatus>>, String)> {
        let encoded = SharedBuffer::default();
        let (writer, topics) = match begin_file(encoded.clone(), subject) {
            Ok(begun) => begun,
            Err(error) => return Err((status, RecordingError::Encode(error.to_string()).to_string())),
        };
        let names =
            subject.channels.iter().map(|channel| (channel.name.clone(), channel.unit.factor())).collect();
        Ok(Self {
            writer,
            encoded,
            tail,
            subject,
            names,
            topics,
            sequence: 0,
            scratch: Vec::new(),
            times_ns: None,
            encoded_readings: 0,
            status,
            reports,
            look_at: Instant::now() + LOOK_EVERY,
            health: Health::Well,
        })
    }

    fn run(&mut self, batches: &Receiver<Arc<Batch>>) {
        self.flush();
        let mut next_flush = Instant::now() + FLUSH_EVERY;
        loop {
            match batches.recv_timeout(next_flush.saturating_duration_since(Instant::now())) {
                Ok(batch) => self.add(&batch),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if Instant::now() >= next_flush {
                self.flush();
                next_flush = Instant::now() + FLUSH_EVERY;
            }
        }
        self.finish();
    }

    fn add(&mut self, batch: &Batch) {
        if self.health == Health::Gone || self.tail.waiting() > MOST_PENDING {
            lock(&self.status).lost += batch.samples().count() as u64;
            return;
        }
        for output in &batch.outputs {
            if let Err(error) = self.add_output(output) {
                self.health = Health::Gone;
                self.set_problem(&RecordingError::Encode(error.to_string()).to_string());
                return;
            }
        }
    }

    fn add_output(&mut self, output: &Output) -> Result<(), McapError> {
        let [reading, estimate, event] = self.topics;
        match output {
            Output::Sample(sample) => {
                let names = std::mem::take(&mut self.names);
                let written =
                    self.message(reading, sample.unix_ns, &ReadingMessage { sample, channels: &names });
                self.names = names;
                written?;
                let message = EstimateMessage::new(sample, self.subject.extent);
                self.message(estimate, sample.unix_ns, &message)?;
                let (first, _) = self.times_ns.unwrap_or((sample.unix_ns, 0));
                self.times_ns = Some((first, sample.unix_ns));
                self.encoded_readings += 1;
                let mut status = lock(&self.status);
                status.seconds = sample.unix_ns.saturating_sub(first) as f64 * 1e-9;
                Ok(())
            }
            Output::Event(record) => self.message(event, (record.time_s * 1e9) as u64, record),
        }
    }

    fn message(&mut self, channel_id: u16, time_ns: u64, message: &impl Serialize) -> Result<(), McapError> {
        self.scratch.clear();
        serde_json::to_writer(&mut self.scratch, message).map_err(|error| McapError::Io(error.into()))?;
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time_ns, publish_time: time_ns };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &self.scratch)
    }

    fn flush(&mut self) {
        if self.health == Health::Gone {
            return;
        }
        if let Err(error) = self.writer.flush() {
            self.health = Health::Gone;
            return self.set_problem(&RecordingError::Encode(error.to_string()).to_string());
        }
        self.tail.push(&self.encoded.take());
        let now = Instant::now();
        if now >= self.look_at {
            self.look_at = now + LOOK_EVERY;
            if !self.tail.is_there() {
                self.health = Health::Gone;
                return self.set_problem("its file was removed; the recording has ended");
            }
        } else if self.health == Health::Full {
            return;
        }
        self.write();
    }

    fn write(&mut self) {
        match (self.tail.write(), self.health) {
            (Ok(()), Health::Full) => {
                self.health = Health::Well;
                let lost = {
                    let mut status = lock(&self.status);
                    status.problem = None;
                    status.lost
                };
                self.report(&format!("is written again; it lacks {lost} readings"));
            }
            (Err(error), Health::Well) => {
                self.health = Health::Full;
                self.set_problem(&format!("cannot be written: {error}; it is tried again every second"));
            }
            _ => {}
        }
        let mut status = lock(&self.status);
        status.bytes = self.tail.bytes();
        if self.health == Health::Well {
            status.readings = self.encoded_readings;
        }
    }

    fn finish(&mut self) {
        self.finish_file();
        let mut status = lock(&self.status);
        status.lost += self.encoded_readings - status.readings;
    }

    fn finish_file(&mut self) {
        if self.health == Health::Gone {
            return;
        }
        if let Err(error) = self.writer.finish() {
            return self.set_problem(&RecordingError::Encode(error.to_string()).to_string());
        }
        self.tail.push(&self.encoded.take());
        self.health = Health::Well;
        lock(&self.status).problem = None;
        self.write();
    }

    fn set_problem(&self, problem: &str) {
        lock(&self.status).problem = Some(problem.to_owned());
        self.report(problem);
    }

    fn report(&self, problem: &str) {
        let text = format!("recording {}: {problem}", lock(&self.status).name);
        // A session with a full queue finds the problem in the status.
        let _ = self.reports.try_send(Input::Command(Command::Trouble(text)));
    }
}

/// Written bytes never change.
fn begin_file(
    encoded: SharedBuffer,
    subject: &Subject,
) -> Result<(Writer<NoSeek<SharedBuffer>>, [u16; 3]), McapError> {
    let options = options(&subject.head.version).disable_seeking(true);
    let mut writer = options.create(NoSeek::new(encoded))?;
    let topics = describe(&mut writer, &subject.head, Some(&subject.locator))?;
    Ok((writer, topics))
}

pub(super) fn options(version: &str) -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(CHUNK))
        .library(format!("palpate {version}"))
}

pub(super) fn describe<W: Write + Seek>(
    writer: &mut Writer<W>,
    head: &Head,
    locator: Option<&str>,
) -> Result<[u16; 3], McapError> {
    writer
        .write_metadata(&mcap::records::Metadata { name: METADATA.to_owned(), metadata: head.metadata() })?;
    if let Some(locator) = locator {
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: LOCATOR.to_owned(),
            media_type: "application/json".to_owned(),
            data: locator.as_bytes().into(),
        })?;
    }
    let mut ids = [0; 3];
    for (id, (topic, name, schema)) in ids.iter_mut().zip(TOPICS) {
        let schema_id = writer.add_schema(name, "jsonschema", schema.as_bytes())?;
        *id = writer.add_channel(schema_id, topic, "json", &std::collections::BTreeMap::new())?;
    }
    Ok(ids)
}
