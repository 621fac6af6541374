//! The records of an MCAP file, one by one, without holding the file: chunks are passed over, and decoded where they are wanted.

use super::head::{Head, LOCATOR, METADATA};
use super::whole_record::parse;
use super::{LocatorFault, RecordingError};
use crate::schemas::TOPICS;
use crate::session::Estimation;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// Most bytes of a record that is read, and of a chunk without its compression: what is beyond is no recording of palpate, and is passed over.
const MOST: u64 = 256 << 20;

/// An MCAP file of palpate, cut off or whole.
#[derive(Debug)]
pub struct McapFile {
    file: BufReader<File>,
    path: String,
    length: u64,
    /// Head of the recording.
    pub head: Head,
    /// The locator that is attached, as its file has it.
    locator: Result<String, LocatorFault>,
    /// Its chunks, in their order.
    pub chunks: Vec<ChunkPlace>,
    /// True where it ends as it should.
    pub is_whole: bool,
    /// Number of the channel of each topic.
    topics: [Option<u16>; 3],
}

/// Place of a chunk in the file.
#[derive(Clone, Copy, Debug)]
pub struct ChunkPlace {
    at: u64,
    length: u64,
    /// Times of its first and its last message, in ns since 1970.
    pub span_ns: (u64, u64),
    /// Readings in it.
    pub readings: u64,
}

/// Message of a recording.
#[derive(Clone, Debug)]
pub struct RawMessage {
    /// Its topic, by its place in [`TOPICS`].
    pub topic: usize,
    /// Its time, in ns since 1970.
    pub unix_ns: u64,
    /// Its JSON.
    pub data: Vec<u8>,
}

/// Place of a record: its kind, and where its content is.
struct RecordPlace {
    op: u8,
    at: u64,
    length: u64,
}

/// Bytes of a chunk's record beside its texts: times, uncompressed size and checksum, and two lengths.
const CHUNK_NUMBERS: usize = 8 + 8 + 8 + 4 + 4 + 8;

impl McapFile {
    /// Looks a file through: its head, and where its chunks are.
    ///
    /// # Errors
    /// [`RecordingError`] for a file that cannot be read, or is no recording of palpate.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let shown = path.display().to_string();
        let file = File::open(path).map_err(|error| cannot("open", &shown, error))?;
        let found = file.metadata().map_err(|error| cannot("open", &shown, error))?;
        if !found.is_file() {
            return Err(cannot("open", &shown, std::io::Error::other("it is no regular file")));
        }
        let head = Head {
            version: String::new(),
            source: String::new(),
            channels: Vec::new(),
            estimation: Estimation::default(),
        };
        let mut own = Self {
            file: BufReader::new(file),
            path: shown,
            length: found.len(),
            head,
            locator: Err(LocatorFault::Missing),
            chunks: Vec::new(),
            is_whole: false,
            topics: [None; 3],
        };
        own.look_through()?;
        Ok(own)
    }

    /// The locator that is attached, as its file has it.
    pub fn locator(&self) -> Result<&str, RecordingError> {
        let fault = |fault: &LocatorFault| RecordingError::Locator { path: self.path.clone(), fault: *fault };
        self.locator.as_deref().map_err(fault)
    }

    fn look_through(&mut self) -> Result<(), RecordingError> {
        let mut magic = [0; 8];
        match self.file.read_exact(&mut magic) {
            Err(error) if error.kind() != ErrorKind::UnexpectedEof => return Err(self.cannot(error)),
            result if result.is_err() || magic != mcap::MAGIC => {
                return Err(RecordingError::NotMcap { path: self.path.clone() });
            }
            _ => {}
        }
        let mut metadata = None;
        let mut counted = true;
        while let Some(place) = self.next_place()? {
            match place.op {
                op::METADATA => {
                    if let Some(Record::Metadata(found)) = self.record(&place)?
                        && found.name == METADATA
                    {
                        metadata = Some(found.metadata);
                    }
                }
                op::ATTACHMENT if self.locator.is_err() => self.locator = self.attached(&place)?,
                op::CHUNK => {
                    self.count_last(counted)?;
                    counted = false;
                    let mut times = [0; 16];
                    if place.length >= 16 {
                        self.file
                            .read_exact(&mut times)
                            .map_err(|error| cannot("read", &self.path, error))?;
                        let time = |bytes: &[u8]| u64::from_le_bytes(bytes.try_into().unwrap_or_default());
                        let span_ns = (time(&times[..8]), time(&times[8..]));
                        self.chunks.push(ChunkPlace {
                            at: place.at,
                            length: place.length,
                            span_ns,
                            readings: 0,
                        });
                        if self.topics[0].is_none() {
                            self.count_last(false)?;
                            counted = true;
                        }
                    }
                }
                op::MESSAGE_INDEX if !counted => {
                    if let Some(Record::MessageIndex(index)) = self.record(&place)?
                        && Some(index.channel_id) == self.topics[0]
                        && let Some(chunk) = self.chunks.last_mut()
                    {
                        chunk.readings = index.records.len() as u64;
                        counted = true;
                    }
                }
                op::DATA_END | op::FOOTER => {
                    self.is_whole = true;
                    break;
                }
                _ => {}
            }
            self.seek(place.at + place.length)?;
        }
        self.count_last(counted)?;
        if self.locator == Err(LocatorFault::Missing) && !self.is_whole {
            self.locator = Err(LocatorFault::CutOff);
        }
        let lacks = |lacks| RecordingError::NotOurs { path: self.path.clone(), lacks };
        let metadata = metadata.ok_or_else(|| {
            lacks(match self.is_whole {
                true => "it has no metadata `palpate`",
                false => "it is cut off before its metadata `palpate`, or has none",
            })
        })?;
        self.head = Head::from_metadata(&metadata)
            .ok_or_else(|| lacks("its metadata do not say its channels and how readings were located"))?;
        Ok(())
    }

    /// Counts the readings of the last chunk by decoding it, where no index has told them.
    fn count_last(&mut self, counted: bool) -> Result<(), RecordingError> {
        let Some(last) = self.chunks.last().copied().filter(|_| !counted) else { return Ok(()) };
        let here = self.position()?;
        let readings = self.messages(&last)?.iter().filter(|message| message.topic == 0).count() as u64;
        if let Some(last) = self.chunks.last_mut() {
            last.readings = readings;
        }
        self.seek(here)
    }

    /// The messages of a chunk; those before the damage of one that is damaged.
    pub fn messages(&mut self, chunk: &ChunkPlace) -> Result<Vec<RawMessage>, RecordingError> {
        let mut messages = Vec::new();
        let Some(body) = self.body(chunk.at, chunk.length)? else { return Ok(messages) };
        let Some(Record::Chunk { header, data }) = parse(op::CHUNK, &body) else {
            return Ok(messages);
        };
        if header.uncompressed_size > MOST {
            return Ok(messages);
        }
        // What lies behind the data is left out: MCAP's reader would take it for the rest of a record that reaches beyond the chunk.
        let whole = CHUNK_NUMBERS + header.compression.len() + data.len();
        drop(data);
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(MOST as usize);
        let mut records = LinearReader::new_with_options(options);
        // A file of one record, the chunk: MCAP's reader of chunks alone allocates whatever length a damaged record says.
        let mut file = vec![op::CHUNK];
        file.extend((whole as u64).to_le_bytes());
        file.extend(&body[..whole]);
        let mut rest = file.as_slice();
        while let Some(event) = records.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    let (next, later) = rest.split_at(wanted.min(rest.len()));
                    records.insert(next.len()).copy_from_slice(next);
                    records.notify_read(next.len());
                    rest = later;
                }
                Ok(LinearReadEvent::Record { data, opcode }) => {
                    parse(opcode, data).into_iter().for_each(|record| self.take(record, &mut messages));
                }
                Err(_) => break,
            }
        }
        Ok(messages)
    }

    /// Takes a record of a chunk: a channel, or a message of one that is known.
    fn take(&mut self, record: Record, messages: &mut Vec<RawMessage>) {
        match record {
            Record::Channel(channel) => {
                if let Some(topic) = TOPICS.iter().position(|(name, ..)| *name == channel.topic) {
                    self.topics[topic] = Some(channel.id);
                }
            }
            Record::Message { header, data } => {
                if let Some(topic) = self.topics.iter().position(|id| *id == Some(header.channel_id)) {
                    messages.push(RawMessage { topic, unix_ns: header.log_time, data: data.into_owned() });
                }
            }
            _ => {}
        }
    }

    /// The locator, where this attachment is it. One that is damaged is held to be: a recording has no other, and its name may be what is damaged.
    fn attached(&mut self, place: &RecordPlace) -> Result<Result<String, LocatorFault>, RecordingError> {
        let body = self.body(place.at, place.length)?;
        Ok(match body.as_deref().and_then(|body| parse(op::ATTACHMENT, body)) {
            Some(Record::Attachment { header, data, .. }) if header.name == LOCATOR => {
                String::from_utf8(data.into_owned()).map_err(|_| LocatorFault::Damaged)
            }
            Some(_) => self.locator.clone(),
            None => Err(LocatorFault::Damaged),
        })
    }

    fn record(&mut self, place: &RecordPlace) -> Result<Option<Record<'static>>, RecordingError> {
        let Some(body) = self.body(place.at, place.length)? else { return Ok(None) };
        Ok(parse(place.op, &body).map(Record::into_owned))
    }

    /// The next record that is whole; the file is at its content then.
    fn next_place(&mut self) -> Result<Option<RecordPlace>, RecordingError> {
        let at = self.position()?.saturating_add(9);
        if at > self.length {
            return Ok(None);
        }
        let mut head = [0; 9];
        self.file.read_exact(&mut head).map_err(|error| cannot("read", &self.path, error))?;
        let length = head[1..].try_into().map(u64::from_le_bytes).unwrap_or_default();
        let is_there = at.checked_add(length).is_some_and(|end| end <= self.length);
        Ok(is_there.then_some(RecordPlace { op: head[0], at, length }))
    }

    fn body(&mut self, at: u64, length: u64) -> Result<Option<Vec<u8>>, RecordingError> {
        if length > MOST {
            return Ok(None);
        }
        self.seek(at)?;
        let mut body = vec![0; length as usize];
        match self.file.read_exact(&mut body) {
            Ok(()) => Ok(Some(body)),
            // It was cut off meanwhile.
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(self.cannot(error)),
        }
    }

    fn position(&mut self) -> Result<u64, RecordingError> {
        self.file.stream_position().map_err(|error| cannot("read", &self.path, error))
    }

    /// Goes to a place; what is read ahead is kept where it is near.
    fn seek(&mut self, to: u64) -> Result<(), RecordingError> {
        let here = self.position()?;
        let by = i64::try_from(i128::from(to) - i128::from(here)).ok();
        let result = match by {
            Some(by) => self.file.seek_relative(by),
            None => self.file.seek(SeekFrom::Start(to)).map(drop),
        };
        result.map_err(|error| cannot("read", &self.path, error))
    }

    fn cannot(&self, error: std::io::Error) -> RecordingError {
        cannot("read", &self.path, error)
    }
}

fn cannot(verb: &'static str, path: &str, error: std::io::Error) -> RecordingError {
    RecordingError::File { verb, path: path.to_owned(), error }
}
