use super::head::RecordedChannel;
use super::mcap_file::{Block, McapFile, RawMessage};
use super::{BlockFault, EXTENSION, Head, RecordingError};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::path::Path;

/// Summary of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingSummary {
    /// File name.
    pub name: String,
    /// File size.
    pub bytes: u64,
    /// Unix time of the start in seconds.
    pub start_s: Option<f64>,
    /// Duration in seconds.
    pub seconds: f64,
    /// Readings.
    pub readings: u64,
    /// True for an active or cut-off recording.
    pub is_cut_off: bool,
}

/// Thinned part of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Excerpt {
    /// Channels of a reading.
    pub channels: Vec<RecordedChannel>,
    /// Unix time of the recording's start in seconds.
    pub start_s: Option<f64>,
    /// Duration of the recording in seconds.
    pub seconds: f64,
    /// Samples as [`SampleRecord`](crate::sample::SampleRecord).
    pub samples: Vec<Value>,
    /// All events as [`EventRecord`](crate::event::EventRecord).
    pub events: Vec<Value>,
}

/// Lists the recordings of a folder, newest first.
///
/// # Errors
/// An unreadable folder.
pub fn list(folder: &Path) -> Result<Vec<RecordingSummary>, RecordingError> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => {
            return Err(RecordingError::File { verb: "list", path: folder.display().to_string(), error });
        }
        Ok(entries) => entries,
    };
    // A link can lead out of the folder, and a pipe would block.
    let files = entries.flatten().filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
    let mut found: Vec<_> = files
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == EXTENSION))
        .filter_map(|path| summary(&path).ok())
        .collect();
    found.sort_by(|a, b| {
        let start = |summary: &RecordingSummary| summary.start_s.unwrap_or(f64::NEG_INFINITY);
        start(b).total_cmp(&start(a)).then_with(|| a.name.cmp(&b.name))
    });
    Ok(found)
}

/// Reads the summary of a recording.
///
/// # Errors
/// An unreadable file, or not a recording.
pub fn summary(path: &Path) -> Result<RecordingSummary, RecordingError> {
    let file = McapFile::open(path)?;
    let (start_s, seconds) = span_s(&file.blocks);
    Ok(RecordingSummary {
        name: path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        bytes: std::fs::metadata(path).map_or(0, |found| found.len()),
        start_s,
        seconds,
        readings: file.blocks.iter().map(|block| block.readings).sum(),
        is_cut_off: !file.is_whole,
    })
}

/// Reads a part in seconds from the start, thinned to `points` samples and the last.
///
/// # Errors
/// An unreadable file, or not a recording.
pub fn read(path: &Path, from_s: f64, to_s: f64, points: usize) -> Result<Excerpt, RecordingError> {
    let mut file = McapFile::open(path)?;
    let (start_s, seconds) = span_s(&file.blocks);
    let start_ns =
        file.blocks.iter().map(|block| block.span_ns.0).filter(|start| *start > 0).min().unwrap_or(0);
    let at_ns = |after_s: f64| start_ns.saturating_add((after_s.max(0.0) * 1e9) as u64);
    let (from_ns, to_ns) = (at_ns(from_s), at_ns(to_s));
    let blocks = file.blocks.iter().filter(|block| block.span_ns.0 <= to_ns && block.span_ns.1 >= from_ns);
    let blocks: Vec<Block> = blocks.copied().collect();
    let readings: u64 = blocks.iter().map(|block| block.readings).sum();
    let mut thinning = Thinning {
        stride: readings.div_ceil(points.max(1) as u64).max(1),
        channels: file.head.channels.clone(),
        count: 0,
        samples: Vec::new(),
        last: None,
        events: Vec::new(),
    };
    for block in &blocks {
        for message in file.messages(block)?.messages {
            if (from_ns..=to_ns).contains(&message.unix_ns) {
                thinning.add(message);
            }
        }
    }
    let (samples, events) = thinning.finish();
    Ok(Excerpt { channels: file.head.channels.clone(), start_s, seconds, samples, events })
}

fn span_s(blocks: &[Block]) -> (Option<f64>, f64) {
    // A chunk without messages, or with messages before the clock was set, has the time 0.
    let blocks = || blocks.iter().filter(|block| block.span_ns.0 > 0);
    let (start, end) =
        (blocks().map(|block| block.span_ns.0).min(), blocks().map(|block| block.span_ns.1).max());
    let seconds = start.zip(end).map_or(0.0, |(start, end)| end.saturating_sub(start) as f64 * 1e-9);
    (start.map(|start| start as f64 * 1e-9), seconds)
}

struct Thinning {
    stride: u64,
    channels: Vec<RecordedChannel>,
    count: u64,
    samples: Vec<Value>,
    last: Option<(Pending, Retention)>,
    events: Vec<Value>,
}

struct Pending {
    reading: RawMessage,
    estimate: Option<RawMessage>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Retention {
    Surely,
    AsTheLast,
}

impl Thinning {
    fn add(&mut self, message: RawMessage) {
        match message.topic {
            0 => {
                if let Some((pending, Retention::Surely)) = self.last.take() {
                    self.samples.extend(self.sample(&pending));
                }
                let keep = if self.count.is_multiple_of(self.stride) {
                    Retention::Surely
                } else {
                    Retention::AsTheLast
                };
                self.count += 1;
                self.last = Some((Pending { reading: message, estimate: None }, keep));
            }
            1 => {
                if let Some((pending, _)) = &mut self.last {
                    pending.estimate = Some(message);
                }
            }
            _ => self.events.extend(serde_json::from_slice::<Value>(&message.data)),
        }
    }

    fn finish(mut self) -> (Vec<Value>, Vec<Value>) {
        if let Some((pending, _)) = self.last.take() {
            self.samples.extend(self.sample(&pending));
        }
        (self.samples, self.events)
    }

    fn sample(&self, pending: &Pending) -> Option<Value> {
        let reading: StoredReading = serde_json::from_slice(&pending.reading.data).ok()?;
        let mut sample = Map::new();
        sample.insert("number".to_owned(), reading.number.into());
        sample.insert("time_s".to_owned(), (pending.reading.unix_ns as f64 * 1e-9).into());
        sample.insert("reading".to_owned(), reading.in_order(&self.channels)?.into());
        if let Some(estimate) = &pending.estimate
            && let Ok(estimate) = serde_json::from_slice::<Map<String, Value>>(&estimate.data)
            && estimate.get("number") == sample.get("number")
        {
            sample.extend(estimate.into_iter().filter(|(key, _)| key != "located" && key != "number"));
        }
        Some(sample.into())
    }
}

#[derive(Deserialize)]
struct StoredReading {
    number: u64,
    values: Map<String, Value>,
}

impl StoredReading {
    fn in_order(&self, channels: &[RecordedChannel]) -> Option<Vec<f64>> {
        channels.iter().map(|channel| self.values.get(&channel.name)?.as_f64()).collect()
    }
}

/// Message of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Recorded {
    /// Reading.
    Reading {
        /// Number, from 0.
        number: u64,
        /// Unix time in ns.
        unix_ns: u64,
        /// Values in the units of the head.
        values: Vec<f64>,
    },
    /// Estimate.
    Estimate {
        /// Number of the reading.
        number: u64,
        /// Unix time in ns.
        unix_ns: u64,
        /// Located reading in SI units or raw.
        located: Vec<f64>,
        /// Record.
        estimate: Map<String, Value>,
    },
    /// Event.
    Event {
        /// Unix time in ns.
        unix_ns: u64,
        /// Record.
        event: Map<String, Value>,
    },
}

/// Iterator over the messages of a recording.
#[derive(Debug)]
pub struct Playback {
    file: McapFile,
    block: usize,
    messages: std::vec::IntoIter<RawMessage>,
    skipped: SkippedData,
}

/// Skipped blocks and messages of a playback.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SkippedData {
    /// Unreadable blocks.
    pub blocks: u64,
    /// Readings in unreadable blocks, if an index counts them.
    pub readings: u64,
    /// Fault of the first unreadable block.
    pub fault: Option<BlockFault>,
    /// Messages that are damaged, or on channels without a description.
    pub messages: u64,
    /// Messages on foreign topics.
    pub foreign: u64,
    /// True if messages outside chunks do not match the checksum.
    pub is_altered: bool,
}

impl SkippedData {
    /// Describes the unreadable data.
    pub fn loss(&self) -> Option<String> {
        let blocks = (self.blocks > 0).then(|| {
            let fault = self.fault.as_ref().map_or_else(String::new, |fault| format!(": {fault}"));
            // Readings of a block with unknown channels are not counted.
            let readings =
                if self.readings > 0 { format!(" with {} readings", self.readings) } else { String::new() };
            format!("{} blocks{readings} cannot be read, the first{fault}", self.blocks)
        });
        let messages = (self.messages > 0).then(|| format!("{} messages are damaged", self.messages));
        let altered = "its bytes do not match its checksum, so that some messages may be wrong";
        let altered = self.is_altered.then(|| altered.to_owned());
        let parts: Vec<String> = blocks.into_iter().chain(messages).chain(altered).collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

impl Playback {
    /// Opens a complete or cut-off recording.
    ///
    /// # Errors
    /// An unreadable file, or not a recording.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut file = McapFile::open(path)?;
        let passed_over = SkippedData { is_altered: !file.check_loose()?, ..SkippedData::default() };
        Ok(Self { file, block: 0, messages: Vec::new().into_iter(), skipped: passed_over })
    }

    /// Head.
    pub fn head(&self) -> &Head {
        &self.file.head
    }

    /// Attached locator file.
    ///
    /// # Errors
    /// [`RecordingError::Locator`]; the readings are available.
    pub fn locator(&self) -> Result<&str, RecordingError> {
        self.file.locator()
    }

    /// True if the file has a complete end.
    pub fn is_whole(&self) -> bool {
        self.file.is_whole
    }

    /// Skipped data.
    pub fn skipped(&self) -> &SkippedData {
        &self.skipped
    }

    /// Reads the next message.
    ///
    /// # Errors
    /// An unreadable file.
    pub fn next_recorded(&mut self) -> Result<Option<Recorded>, RecordingError> {
        while let Some(message) = self.next_message()? {
            match self.understand(&message) {
                Some(recorded) => return Ok(Some(recorded)),
                None => self.skipped.messages += 1,
            }
        }
        Ok(None)
    }

    pub(super) fn next_message(&mut self) -> Result<Option<RawMessage>, RecordingError> {
        loop {
            if let Some(message) = self.messages.next() {
                return Ok(Some(message));
            }
            let Some(block) = self.file.blocks.get(self.block).copied() else { return Ok(None) };
            self.block += 1;
            let found = self.file.messages(&block)?;
            if let Some(fault) = found.fault {
                self.skipped.blocks += 1;
                self.skipped.readings += block.readings;
                self.skipped.fault.get_or_insert(fault);
            }
            self.skipped.foreign += found.foreign;
            self.skipped.messages += found.unknown;
            self.messages = found.messages.into_iter();
        }
    }

    fn understand(&self, message: &RawMessage) -> Option<Recorded> {
        let (unix_ns, data) = (message.unix_ns, &message.data);
        match message.topic {
            0 => {
                let reading: StoredReading = serde_json::from_slice(data).ok()?;
                let values = reading.in_order(&self.file.head.channels)?;
                Some(Recorded::Reading { number: reading.number, unix_ns, values })
            }
            1 => {
                let mut estimate: Map<String, Value> = serde_json::from_slice(data).ok()?;
                let number = estimate.remove("number")?.as_u64()?;
                let located = estimate.remove("located")?;
                // The covariance is not part of the record.
                estimate.remove("covariance_mm2");
                let located = located.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
                Some(Recorded::Estimate { number, unix_ns, located, estimate })
            }
            _ => Some(Recorded::Event { unix_ns, event: serde_json::from_slice(data).ok()? }),
        }
    }
}
