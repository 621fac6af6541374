//! Frames of a stream or of messages, text or binary.

use super::binary;
use super::names::{Names, Role};
use super::text::{Line, TextReader, is_text};
use super::{BadFrame, Channel, Frame};

/// Most bytes of a line.
const LONGEST_LINE: usize = 1 << 16;

/// Decoder of the frames of a source: text or binary, whichever it sends.
///
/// A stream is text once a line is a frame or a header, and binary once the bytes between two zeros are a frame with its checksum. What it is does
/// not depend on how its bytes are cut.
#[derive(Debug)]
pub struct Decoder {
    text: TextReader,
    form: Form,
    /// Bytes since the last line end (text), the last zero (binary), or the last that is judged (unknown).
    held: Vec<u8>,
    /// Unknown form: start of the last line in `held`.
    line_start: usize,
    /// Unknown form: lines in `held` that are no text.
    not_text: u64,
    /// The start of the present line, or binary frame, is not there.
    torn_line: bool,
    torn_binary: bool,
    /// Bytes are left out until a frame ends, for there were too many.
    skips: bool,
    scratch: Vec<u8>,
}

/// Form of a stream's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Unknown,
    Text,
    Binary,
}

/// Names of unnamed values that do not name every channel.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ColumnsError {
    /// A channel that has no column.
    #[error("the columns {columns} have no channel `{channel}`; name every channel, and anything else that a line has")]
    Missing {
        /// The columns.
        columns: String,
        /// The channel.
        channel: String,
    },
    /// Two columns of one channel.
    #[error("the columns {columns} have a channel twice; there are {channels} channels")]
    Twice {
        /// The columns.
        columns: String,
        /// Number of channels.
        channels: usize,
    },
}

impl Decoder {
    /// A decoder of frames of these channels, at the start of a stream.
    pub fn new(channels: &[Channel]) -> Self {
        Self {
            text: TextReader::new(Names::new(channels)),
            form: Form::Unknown,
            held: Vec::new(),
            line_start: 0,
            not_text: 0,
            torn_line: false,
            torn_binary: false,
            skips: false,
            scratch: Vec::new(),
        }
    }

    /// Names the values of frames that have no names: channels, time, number of the frame, and others, which are left out.
    ///
    /// # Errors
    /// [`ColumnsError`] unless every channel is named once.
    pub fn set_columns(&mut self, columns: &[String]) -> Result<(), ColumnsError> {
        let names = self.text.names();
        let roles: Vec<Role> = columns.iter().map(|column| names.role(column)).collect();
        let columns = columns.join(",");
        if let Some(channel) = names.lacking(&roles) {
            return Err(ColumnsError::Missing { columns, channel: channel.label.clone() });
        }
        if roles.iter().filter(|role| matches!(role, Role::Channel(_))).count() > names.len() {
            return Err(ColumnsError::Twice { columns, channels: names.len() });
        }
        self.text.set_columns(roles);
        Ok(())
    }

    /// Begins a stream; names that a header gave are kept, for a board that was merely unplugged from the host does not say them again.
    pub fn open(&mut self) {
        self.form = Form::Unknown;
        self.clear();
        (self.torn_line, self.torn_binary, self.skips) = (false, false, false);
    }

    /// Begins a stream amid its frames: what comes before the first end of a frame is left out, unless it is a frame for certain.
    pub fn join(&mut self) {
        self.open();
        (self.torn_line, self.torn_binary) = (true, true);
    }

    /// Takes the next bytes of a stream, and hands on the frames that they end.
    pub fn receive(&mut self, mut bytes: &[u8], mut hand_on: impl FnMut(Result<Frame, BadFrame>)) {
        while !bytes.is_empty() {
            let taken = if self.skips {
                self.skip(bytes)
            } else {
                match self.form {
                    Form::Unknown => self.receive_unknown(bytes, &mut hand_on),
                    Form::Text => self.receive_text(bytes, &mut hand_on),
                    Form::Binary => self.receive_binary(bytes, &mut hand_on),
                }
            };
            bytes = &bytes[taken..];
        }
    }

    /// Takes a message: lines of text, or binary frames, all whole.
    pub fn receive_message(&mut self, bytes: &[u8], mut hand_on: impl FnMut(Result<Frame, BadFrame>)) {
        if is_text(bytes) {
            bytes.split(|byte| *byte == b'\n').for_each(|line| self.read_line(line, &mut hand_on));
        } else {
            let frames = bytes.split(|byte| *byte == 0).filter(|frame| !frame.is_empty());
            frames.for_each(|frame| hand_on(self.decode_binary(frame)));
        }
    }

    /// Ends a stream: what it leaves without an end is a frame of its own.
    pub fn end(&mut self, mut hand_on: impl FnMut(Result<Frame, BadFrame>)) {
        let held = std::mem::take(&mut self.held);
        if !held.is_empty() && !self.skips {
            match self.form {
                Form::Binary => hand_on(self.decode_binary(&held)),
                Form::Text => self.read_line(&held, &mut hand_on),
                Form::Unknown => {
                    (0..self.not_text).for_each(|_| hand_on(Err(BadFrame::Encoding)));
                    self.read_line(&held[self.line_start..], &mut hand_on);
                }
            }
        }
        self.open();
    }

    fn clear(&mut self) {
        self.held.clear();
        (self.line_start, self.not_text) = (0, 0);
    }

    /// Leaves out bytes up to the end of a frame.
    fn skip(&mut self, bytes: &[u8]) -> usize {
        let end = bytes.iter().position(|byte| matches!(byte, b'\n' | 0));
        self.skips = end.is_none();
        end.map_or(bytes.len(), |end| end + 1)
    }

    /// Adds bytes up to the next `end` to what is held; the bytes taken, and whether the end is there. Hands on the cause where there are too many.
    fn hold(
        &mut self,
        bytes: &[u8],
        longest: usize,
        is_end: impl Fn(u8) -> bool,
        hand_on: &mut impl FnMut(Result<Frame, BadFrame>),
    ) -> (usize, bool) {
        let room = longest.saturating_sub(self.held.len());
        let end = bytes.iter().take(room + 1).position(|byte| is_end(*byte));
        if end.is_none() && bytes.len() > room {
            hand_on(Err(BadFrame::TooLong));
            self.open();
            self.skips = true;
            return (room + 1, false);
        }
        let content = &bytes[..end.unwrap_or(bytes.len())];
        self.held.extend_from_slice(content);
        (content.len() + usize::from(end.is_some()), end.is_some())
    }

    fn receive_text(&mut self, bytes: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) -> usize {
        // Most lines are whole in the bytes, and need no copy.
        if self.held.is_empty()
            && let Some(end) = bytes.iter().take(LONGEST_LINE + 1).position(|byte| *byte == b'\n')
        {
            self.end_line(&bytes[..end], hand_on);
            return end + 1;
        }
        let (taken, ends) = self.hold(bytes, LONGEST_LINE, |byte| byte == b'\n', hand_on);
        if ends {
            let line = std::mem::take(&mut self.held);
            self.end_line(&line, hand_on);
            if self.held.is_empty() {
                // Kept for the next line.
                self.held = line;
                self.held.clear();
            }
        }
        taken
    }

    /// Reads a line of a stream of text; one with zeros may be binary frames, of which the last has a line end in it.
    fn end_line(&mut self, line: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        let Some(last) = line.iter().rposition(|byte| *byte == 0) else { return self.read_line(line, hand_on) };
        let mut is_binary = false;
        for frame in line[..last].split(|byte| *byte == 0).filter(|frame| !frame.is_empty()) {
            if let Ok(frame) = self.decode_binary(frame) {
                is_binary = true;
                hand_on(Ok(frame));
            }
        }
        if is_binary {
            self.form = Form::Binary;
            self.held = [&line[last + 1..], b"\n"].concat();
        } else {
            hand_on(Err(BadFrame::Encoding));
        }
    }

    fn receive_binary(&mut self, bytes: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) -> usize {
        let (taken, ends) = self.hold(bytes, binary::LONGEST, |byte| byte == 0, hand_on);
        if ends && !self.held.is_empty() {
            let frame = std::mem::take(&mut self.held);
            hand_on(self.decode_binary(&frame));
            self.held = frame;
            self.held.clear();
        }
        taken
    }

    fn receive_unknown(&mut self, bytes: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) -> usize {
        let (taken, ends) =
            self.hold(bytes, LONGEST_LINE, |byte| matches!(byte, b'\n' | 0), hand_on);
        if ends {
            match bytes[taken - 1] {
                0 => self.judge_binary(hand_on),
                _ => self.judge_line(hand_on),
            }
        }
        taken
    }

    /// Judges the bytes that a zero ended.
    fn judge_binary(&mut self, hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        let held = std::mem::take(&mut self.held);
        self.clear();
        let torn = std::mem::take(&mut self.torn_binary);
        if held.is_empty() {
            return;
        }
        match self.decode_binary(&held) {
            Ok(frame) => {
                self.form = Form::Binary;
                self.torn_line = false;
                hand_on(Ok(frame));
            }
            Err(_) if torn => {}
            Err(cause) => hand_on(Err(cause)),
        }
    }

    /// Judges the bytes that a line end ended, which may as well stand within a binary frame.
    fn judge_line(&mut self, hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        let mut held = std::mem::take(&mut self.held);
        let torn = std::mem::take(&mut self.torn_line);
        let line = &held[self.line_start..];
        let read = if is_text(line) { self.text.read(line) } else { Err(BadFrame::Encoding) };
        let is_first = self.line_start == 0;
        match read {
            Ok(Line::Unnamed(_)) if torn => {}
            Ok(Line::Unnamed(frame) | Line::Whole(frame)) => {
                self.begin_text(hand_on);
                hand_on(Ok(frame));
                return;
            }
            Ok(Line::Header) => return self.begin_text(hand_on),
            Ok(Line::Nothing) => {}
            Err(BadFrame::Encoding) => {
                // Judged anew with all that follows, up to a zero.
                self.not_text += u64::from(!torn);
                held.push(b'\n');
                self.line_start = held.len();
                self.held = held;
                return;
            }
            Err(_) if torn => {}
            Err(cause) => hand_on(Err(cause)),
        }
        if !is_first {
            // Behind bytes that may be the start of a binary frame.
            held.push(b'\n');
            self.line_start = held.len();
            self.held = held;
        }
    }

    /// Knows the stream for text; lines before that were no text are counted now.
    fn begin_text(&mut self, hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        (0..self.not_text).for_each(|_| hand_on(Err(BadFrame::Encoding)));
        self.clear();
        self.form = Form::Text;
        self.torn_binary = false;
    }

    fn read_line(&mut self, line: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        match self.text.read(line) {
            Ok(Line::Unnamed(frame) | Line::Whole(frame)) => hand_on(Ok(frame)),
            Ok(Line::Nothing | Line::Header) => {}
            Err(cause) => hand_on(Err(cause)),
        }
    }

    fn decode_binary(&mut self, stuffed: &[u8]) -> Result<Frame, BadFrame> {
        if stuffed.len() > binary::LONGEST {
            return Err(BadFrame::TooLong);
        }
        binary::decode(stuffed, self.text.names(), self.text.columns(), &mut self.scratch)
    }
}
