use super::head::{Head, LOCATOR, METADATA};
use super::unpack::{self, BlockFault, MOST};
use super::whole_record::parse;
use super::{LocatorFault, RecordingError};
use crate::schemas::TOPICS;
use crate::session::Estimation;
use crc::{CRC_32_ISO_HDLC, Crc};
use mcap::records::{Record, op};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

const MOST_LOOSE: u64 = 1 << 20;

/// Complete or cut-off MCAP file of palpate.
#[derive(Debug)]
pub struct McapFile {
    file: BufReader<File>,
    path: String,
    length: u64,
    pub head: Head,
    locator: Result<String, LocatorFault>,
    pub blocks: Vec<Block>,
    pub is_whole: bool,
    /// End of the data, and checksum.
    data_checksum: Option<(u64, u32)>,
    /// Indices in [`TOPICS`].
    channels: BTreeMap<u16, Option<usize>>,
}

#[derive(Clone, Copy, Debug)]
pub struct Block {
    kind: BlockKind,
    at: u64,
    length: u64,
    pub span_ns: (u64, u64),
    pub readings: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BlockKind {
    Chunk,
    /// Messages outside chunks.
    Loose,
}

#[derive(Clone, Debug, Default)]
pub struct Messages {
    pub messages: Vec<RawMessage>,
    /// Messages on foreign topics.
    pub foreign: u64,
    pub unknown: u64,
    pub fault: Option<BlockFault>,
}

#[derive(Clone, Debug)]
pub struct RawMessage {
    /// Index in [`TOPICS`].
    pub topic: usize,
    pub sequence: u32,
    pub unix_ns: u64,
    /// JSON.
    pub data: Vec<u8>,
}

struct RecordPlace {
    op: u8,
    at: u64,
    length: u64,
}

impl RecordPlace {
    const HEAD: u64 = 9;

    fn end(&self) -> u64 {
        self.at + self.length
    }
}

impl McapFile {
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let shown = path.display().to_string();
        let (file, length) = open_regular(path).map_err(|error| cannot("open", &shown, error))?;
        let head = Head {
            version: String::new(),
            source: String::new(),
            channels: Vec::new(),
            estimation: Estimation::default(),
        };
        let mut own = Self {
            file: BufReader::new(file),
            path: shown,
            length,
            head,
            locator: Err(LocatorFault::Missing),
            blocks: Vec::new(),
            is_whole: false,
            data_checksum: None,
            channels: BTreeMap::new(),
        };
        own.scan_blocks()?;
        Ok(own)
    }

    pub fn locator(&self) -> Result<&str, RecordingError> {
        let fault = |fault: &LocatorFault| RecordingError::Locator { path: self.path.clone(), fault: *fault };
        self.locator.as_deref().map_err(fault)
    }

    fn scan_blocks(&mut self) -> Result<(), RecordingError> {
        self.check_magic()?;
        let mut metadata = None;
        // False until the readings of the last chunk are counted, from the index or the decoded chunk.
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
                op::CHANNEL => {
                    if let Some(record) = self.record(&place)? {
                        self.add_channel(&record);
                    }
                }
                op::MESSAGE => self.add_loose(&place)?,
                op::CHUNK => {
                    self.count_last(counted)?;
                    counted = !self.add_chunk(&place)?;
                    if !self.channels.values().any(|topic| *topic == Some(0)) {
                        self.count_last(counted)?;
                        counted = true;
                    }
                }
                op::MESSAGE_INDEX if !counted => {
                    if let Some(Record::MessageIndex(index)) = self.record(&place)?
                        && self.channels.get(&index.channel_id) == Some(&Some(0))
                        && let Some(chunk) = self.blocks.last_mut()
                    {
                        chunk.readings = index.records.len() as u64;
                        counted = true;
                    }
                }
                op::DATA_END | op::FOOTER => {
                    self.is_whole = true;
                    if place.op == op::DATA_END && place.length == 4 {
                        let checksum = self.body(place.at, 4)?.and_then(|bytes| bytes.first_chunk().copied());
                        // 0 means that the record has no checksum.
                        let checksum = checksum.map(u32::from_le_bytes).filter(|checksum| *checksum != 0);
                        self.data_checksum =
                            checksum.map(|checksum| (place.at - RecordPlace::HEAD, checksum));
                    }
                    break;
                }
                _ => {}
            }
            self.seek(place.end())?;
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
            .ok_or_else(|| lacks("its metadata lack its channels or how readings were located"))?;
        Ok(())
    }

    /// Compares messages outside chunks with the checksum of all data.
    pub fn check_loose(&mut self) -> Result<bool, RecordingError> {
        let is_loose = self.blocks.iter().any(|block| block.kind == BlockKind::Loose);
        let Some((end, checksum)) = self.data_checksum.filter(|_| is_loose) else { return Ok(true) };
        const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
        let mut digest = CRC.digest();
        let mut at = 0;
        while at < end {
            let length = MOST_LOOSE.min(end - at);
            let Some(bytes) = self.body(at, length)? else { return Ok(false) };
            digest.update(&bytes);
            at += length;
        }
        Ok(digest.finalize() == checksum)
    }

    fn check_magic(&mut self) -> Result<(), RecordingError> {
        let mut magic = [0; 8];
        match self.file.read_exact(&mut magic) {
            Err(error) if error.kind() != ErrorKind::UnexpectedEof => Err(self.cannot(error)),
            result if result.is_err() || magic != mcap::MAGIC => {
                Err(RecordingError::NotMcap { path: self.path.clone() })
            }
            _ => Ok(()),
        }
    }

    fn add_chunk(&mut self, place: &RecordPlace) -> Result<bool, RecordingError> {
        let Some([start_ns, end_ns]) = self.numbers(place)? else { return Ok(false) };
        let span_ns = (start_ns, end_ns);
        let RecordPlace { at, length, .. } = *place;
        self.blocks.push(Block { kind: BlockKind::Chunk, at, length, span_ns, readings: 0 });
        Ok(true)
    }

    fn add_loose(&mut self, place: &RecordPlace) -> Result<(), RecordingError> {
        // A message begins with channel and number, then the times.
        let Some([head, head_and_time]) = self.numbers(place)? else { return Ok(()) };
        let [channel_0, channel_1, _, _, _, _, time_0, time_1] = head.to_le_bytes();
        let [t2, t3, t4, t5, t6, t7, _, _] = head_and_time.to_le_bytes();
        let channel = u16::from_le_bytes([channel_0, channel_1]);
        let time_ns = u64::from_le_bytes([time_0, time_1, t2, t3, t4, t5, t6, t7]);
        let start = place.at - RecordPlace::HEAD;
        let readings = u64::from(self.channels.get(&channel) == Some(&Some(0)));
        let follows = |block: &&mut Block| {
            block.kind == BlockKind::Loose
                && block.at + block.length == start
                && place.end() - block.at <= MOST_LOOSE
        };
        if let Some(block) = self.blocks.last_mut().filter(follows) {
            block.length = place.end() - block.at;
            block.span_ns = (block.span_ns.0.min(time_ns), block.span_ns.1.max(time_ns));
            block.readings += readings;
        } else {
            let span_ns = (time_ns, time_ns);
            let length = place.end() - start;
            self.blocks.push(Block { kind: BlockKind::Loose, at: start, length, span_ns, readings });
        }
        Ok(())
    }

    fn numbers(&mut self, place: &RecordPlace) -> Result<Option<[u64; 2]>, RecordingError> {
        if place.length < 16 {
            return Ok(None);
        }
        let mut bytes = [[0; 8]; 2];
        for number in &mut bytes {
            self.file.read_exact(number).map_err(|error| cannot("read", &self.path, error))?;
        }
        Ok(Some(bytes.map(u64::from_le_bytes)))
    }

    fn count_last(&mut self, counted: bool) -> Result<(), RecordingError> {
        let Some(last) = self.blocks.last().copied().filter(|_| !counted) else { return Ok(()) };
        let here = self.position()?;
        let messages = self.messages(&last)?.messages;
        let readings = messages.iter().filter(|message| message.topic == 0).count() as u64;
        if let Some(last) = self.blocks.last_mut() {
            last.readings = readings;
        }
        self.seek(here)
    }

    pub fn messages(&mut self, block: &Block) -> Result<Messages, RecordingError> {
        let mut found = Messages::default();
        let Some(body) = self.body(block.at, block.length)? else {
            found.fault = Some(if block.length > MOST { BlockFault::TooLarge } else { BlockFault::Damaged });
            return Ok(found);
        };
        let take = |record: Record| self.take(record, &mut found);
        let read = match block.kind {
            BlockKind::Chunk => unpack::unpack_chunk(&body, take),
            BlockKind::Loose => unpack::read_loose(&body, take),
        };
        found.fault = read.err();
        Ok(found)
    }

    fn take(&mut self, record: Record, found: &mut Messages) {
        match record {
            Record::Message { header, data } => match self.channels.get(&header.channel_id) {
                Some(Some(topic)) => found.messages.push(RawMessage {
                    topic: *topic,
                    sequence: header.sequence,
                    unix_ns: header.log_time,
                    data: data.into_owned(),
                }),
                Some(None) => found.foreign += 1,
                None => found.unknown += 1,
            },
            other => self.add_channel(&other),
        }
    }

    fn add_channel(&mut self, record: &Record) {
        if let Record::Channel(channel) = record {
            let topic = TOPICS.iter().position(|(name, ..)| *name == channel.topic);
            self.channels.insert(channel.id, topic);
        }
    }

    /// A damaged attachment counts as locator: its name may be damaged.
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

    fn next_place(&mut self) -> Result<Option<RecordPlace>, RecordingError> {
        let at = self.position()?.saturating_add(RecordPlace::HEAD);
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
            // The file was truncated meanwhile.
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(self.cannot(error)),
        }
    }

    fn position(&mut self) -> Result<u64, RecordingError> {
        self.file.stream_position().map_err(|error| cannot("read", &self.path, error))
    }

    /// Keeps buffered bytes for a near position.
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

/// Does not wait for a writer if the path is a pipe.
fn open_regular(path: &Path) -> std::io::Result<(File, u64)> {
    let mut options = File::options();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, nix::fcntl::OFlag::O_NONBLOCK.bits());
    let file = options.open(path)?;
    let found = file.metadata()?;
    if found.is_file() {
        Ok((file, found.len()))
    } else {
        Err(std::io::Error::other("it is not a regular file"))
    }
}

fn cannot(verb: &'static str, path: &str, error: std::io::Error) -> RecordingError {
    RecordingError::File { verb, path: path.to_owned(), error }
}
