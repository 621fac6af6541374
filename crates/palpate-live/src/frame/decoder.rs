use super::binary;
use super::names::{Names, Role};
use super::text::{Line, TextReader, is_text};
use super::{BadFrame, Channel, Frame, quote};

const LONGEST_LINE: usize = 1 << 16;
/// Most bytes of a message.
pub const LONGEST_MESSAGE: usize = 1 << 17;
/// Quotation of 80 characters of four bytes.
const QUOTED: usize = 320;

/// Decoder that detects text by a valid line, binary frames by a checksum.
#[derive(Debug)]
pub struct Decoder {
    text: TextReader,
    form: Form,
    /// Bytes since the last frame end, or the last decided byte.
    buffer: Vec<u8>,
    /// Start of the last line in `held`, for an unknown form.
    line_start: usize,
    not_text: u64,
    /// The start of line or frame is missing.
    torn_line: bool,
    torn_binary: bool,
    /// Skips a frame that is too long.
    skips: bool,
    last_bad: Vec<u8>,
    scratch: Vec<u8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Unknown,
    Text,
    Binary,
}

/// Columns that do not name every channel once.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ColumnsError {
    /// Channel without a column.
    #[error(
        "the columns {columns} have no channel `{channel}`; name every channel, and anything else that a line has"
    )]
    Missing {
        /// Columns.
        columns: String,
        /// Channel.
        channel: String,
    },
    /// Channel with two columns.
    #[error("the columns {columns} have a channel twice; there are {channels} channels")]
    Twice {
        /// Columns.
        columns: String,
        /// Number of channels.
        channels: usize,
    },
}

impl Decoder {
    /// Decoder at the start of a stream.
    pub fn new(channels: &[Channel]) -> Self {
        Self {
            text: TextReader::new(Names::new(channels)),
            form: Form::Unknown,
            buffer: Vec::new(),
            line_start: 0,
            not_text: 0,
            torn_line: false,
            torn_binary: false,
            skips: false,
            last_bad: Vec::new(),
            scratch: Vec::new(),
        }
    }

    /// Names the values of frames without names; an empty list keeps the order.
    ///
    /// # Errors
    /// [`ColumnsError`] unless every channel is named once.
    pub fn set_columns(&mut self, columns: &[String]) -> Result<(), ColumnsError> {
        if columns.is_empty() {
            return Ok(());
        }
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

    /// Begins a stream; keeps header names, which an unplugged board does not repeat.
    pub fn open(&mut self) {
        self.form = Form::Unknown;
        self.text.open();
        self.clear();
        (self.torn_line, self.torn_binary, self.skips) = (false, false, false);
    }

    /// Begins a stream amid a frame, skipped unless certainly whole.
    pub fn join(&mut self) {
        self.open();
        (self.torn_line, self.torn_binary) = (true, true);
    }

    /// Decodes bytes of a stream.
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

    /// Decodes headers in outdated bytes.
    pub fn receive_waiting(&mut self, bytes: &[u8]) {
        self.receive(bytes, |_| {});
        if !self.buffer.is_empty() {
            // The incomplete frame is outdated, too. A binary frame can contain a line end.
            self.clear();
            (self.skips, self.torn_binary) = (true, true);
        }
    }

    /// Quotation of the last bad frame.
    pub fn last_bad(&self) -> Option<String> {
        (!self.last_bad.is_empty()).then(|| quote(&self.last_bad))
    }

    /// Bytes of the unfinished frame.
    pub fn unfinished(&self) -> &[u8] {
        &self.buffer
    }

    /// Decodes a message of whole lines or binary frames.
    pub fn receive_message(&mut self, bytes: &[u8], mut hand_on: impl FnMut(Result<Frame, BadFrame>)) {
        if bytes.len() > LONGEST_MESSAGE {
            self.keep_bad(bytes);
            return hand_on(Err(BadFrame::TooLong));
        }
        if is_text(bytes) {
            bytes.split(is_line_end).for_each(|line| self.read_line(line, &mut hand_on));
        } else {
            let frames = bytes.split(|byte| *byte == 0).filter(|frame| !frame.is_empty());
            frames.for_each(|frame| self.read_binary(frame, &mut hand_on));
        }
    }

    /// Ends a stream with its last frame.
    pub fn end(&mut self, mut hand_on: impl FnMut(Result<Frame, BadFrame>)) {
        let held = std::mem::take(&mut self.buffer);
        if !held.is_empty() && !self.skips {
            match self.form {
                Form::Binary => self.read_binary(&held, &mut hand_on),
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
        self.buffer.clear();
        (self.line_start, self.not_text) = (0, 0);
    }

    fn skip(&mut self, bytes: &[u8]) -> usize {
        let end = bytes.iter().position(|byte| is_line_end(byte) || *byte == 0);
        self.skips = end.is_none();
        end.map_or(bytes.len(), |end| end + 1)
    }

    /// Number of bytes, and whether the end was reached.
    fn hold(
        &mut self,
        bytes: &[u8],
        longest: usize,
        is_end: impl Fn(u8) -> bool,
        hand_on: &mut impl FnMut(Result<Frame, BadFrame>),
    ) -> (usize, bool) {
        let room = longest.saturating_sub(self.buffer.len());
        let end = bytes.iter().take(room + 1).position(|byte| is_end(*byte));
        if end.is_none() && bytes.len() > room {
            if self.buffer.is_empty() {
                self.keep_bad(&bytes[..room]);
            } else {
                let held = std::mem::take(&mut self.buffer);
                self.keep_bad(&held);
            }
            hand_on(Err(BadFrame::TooLong));
            self.open();
            self.skips = true;
            return (room + 1, false);
        }
        let content = &bytes[..end.unwrap_or(bytes.len())];
        self.buffer.extend_from_slice(content);
        (content.len() + usize::from(end.is_some()), end.is_some())
    }

    fn receive_text(&mut self, bytes: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) -> usize {
        // Most lines are whole in the bytes, and need no copy.
        if self.buffer.is_empty()
            && let Some(end) = find_line_end(&bytes[..bytes.len().min(LONGEST_LINE + 1)])
        {
            // The second byte of a line end makes an empty line, which is ignored.
            if end > 0 {
                self.end_line(&bytes[..end], bytes[end], hand_on);
            }
            return end + 1;
        }
        let (taken, ends) = self.hold(bytes, LONGEST_LINE, |byte| is_line_end(&byte), hand_on);
        if ends {
            let line = std::mem::take(&mut self.buffer);
            self.end_line(&line, bytes[taken - 1], hand_on);
            if self.buffer.is_empty() {
                // Reuses the allocation for the next line.
                self.buffer = line;
                self.buffer.clear();
            }
        }
        taken
    }

    /// A line with zeros may be binary frames, the last with a line end within.
    fn end_line(&mut self, line: &[u8], end: u8, hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        let Some(last) = line.iter().rposition(|byte| *byte == 0) else {
            return self.read_line(line, hand_on);
        };
        let mut is_binary = false;
        for frame in line[..last].split(|byte| *byte == 0).filter(|frame| !frame.is_empty()) {
            if let Ok(frame) = self.decode_binary(frame) {
                is_binary = true;
                hand_on(Ok(frame));
            }
        }
        if is_binary {
            self.form = Form::Binary;
            self.buffer = [&line[last + 1..], &[end]].concat();
        } else {
            self.keep_bad(line);
            hand_on(Err(BadFrame::Encoding));
        }
    }

    fn receive_binary(&mut self, bytes: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) -> usize {
        let (taken, ends) = self.hold(bytes, binary::LONGEST, |byte| byte == 0, hand_on);
        if ends && !self.buffer.is_empty() {
            let frame = std::mem::take(&mut self.buffer);
            self.read_binary(&frame, hand_on);
            self.buffer = frame;
            self.buffer.clear();
        }
        taken
    }

    fn receive_unknown(&mut self, bytes: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) -> usize {
        let (taken, ends) = self.hold(bytes, LONGEST_LINE, |byte| is_line_end(&byte) || byte == 0, hand_on);
        if ends {
            match bytes[taken - 1] {
                0 => self.classify_binary(hand_on),
                end => self.classify_line(end, hand_on),
            }
        }
        taken
    }

    fn classify_binary(&mut self, hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        let held = std::mem::take(&mut self.buffer);
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
            Err(cause) => {
                self.keep_bad(&held);
                hand_on(Err(cause));
            }
        }
    }

    /// The line end may be a byte of a binary frame.
    fn classify_line(&mut self, end: u8, hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        let mut held = std::mem::take(&mut self.buffer);
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
                // These bytes are decided again, together with the following bytes up to a zero.
                self.not_text += u64::from(!torn);
                self.keep_bad(&held[self.line_start..]);
                held.push(end);
                self.line_start = held.len();
                self.buffer = held;
                return;
            }
            Err(_) if torn => {}
            Err(cause) => {
                self.keep_bad(&held[self.line_start..]);
                hand_on(Err(cause));
            }
        }
        if !is_first {
            // The line follows bytes that may be the start of a binary frame.
            held.push(end);
            self.line_start = held.len();
            self.buffer = held;
        }
    }

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
            Err(cause) => {
                self.keep_bad(line);
                hand_on(Err(cause));
            }
        }
    }

    fn read_binary(&mut self, stuffed: &[u8], hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        let decoded = self.decode_binary(stuffed);
        if decoded.is_err() {
            self.keep_bad(stuffed);
        }
        hand_on(decoded);
    }

    fn keep_bad(&mut self, frame: &[u8]) {
        let frame = frame.trim_ascii();
        self.last_bad.clear();
        self.last_bad.extend_from_slice(&frame[..frame.len().min(QUOTED)]);
    }

    fn decode_binary(&mut self, stuffed: &[u8]) -> Result<Frame, BadFrame> {
        if stuffed.len() > binary::LONGEST {
            return Err(BadFrame::TooLong);
        }
        binary::decode(stuffed, self.text.names(), self.text.columns(), &mut self.scratch)
    }
}

fn find_line_end(bytes: &[u8]) -> Option<usize> {
    let (chunks, rest) = bytes.as_chunks::<16>();
    let has_end = |chunk: &[u8; 16]| chunk.iter().fold(false, |found, byte| found | is_line_end(byte));
    match chunks.iter().position(has_end) {
        Some(i) => chunks[i].iter().position(is_line_end).map(|at| 16 * i + at),
        None => rest.iter().position(is_line_end).map(|at| bytes.len() - rest.len() + at),
    }
}

fn is_line_end(byte: &u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

#[cfg(test)]
mod tests {
    use super::super::tests::channels;
    use super::*;
    use crate::frame::encode_into;
    use proptest::prelude::*;

    fn decoder() -> Decoder {
        Decoder::new(&channels(&["a", "b"]))
    }

    type Verdict = Result<Vec<f64>, BadFrame>;

    fn received(decoder: &mut Decoder, bytes: &[u8]) -> Vec<Verdict> {
        let mut verdicts = Vec::new();
        decoder.receive(bytes, |frame| verdicts.push(frame.map(|frame| frame.reading)));
        verdicts
    }

    fn binary(numbers: std::ops::Range<u16>) -> Vec<u8> {
        let mut bytes = Vec::new();
        numbers.for_each(|n| encode_into(&mut bytes, n.into(), 10 * u32::from(n), &[f32::from(n), 10.0]));
        bytes
    }

    #[test]
    fn text_and_binary_find_themselves() {
        assert_eq!(
            received(&mut decoder(), b"1,2\r\n\r\n3,x\n5,6\n7,"),
            [Ok(vec![1.0, 2.0]), Err(BadFrame::NotANumber), Ok(vec![5.0, 6.0])]
        );
        // The bytes of sequence numbers up to 300 include line ends.
        let verdicts = received(&mut decoder(), &binary(0..300));
        let expected: Vec<Verdict> = (0..300_u16).map(|n| Ok(vec![f64::from(n), 10.0])).collect();
        assert_eq!(verdicts, expected);
    }

    #[test]
    fn carriage_returns_end_lines() {
        let mut decoder = decoder();
        assert_eq!(received(&mut decoder, b"1,2\r3,4\r5,"), [Ok(vec![1.0, 2.0]), Ok(vec![3.0, 4.0])]);
        assert_eq!(received(&mut decoder, b"6\r\n7,8\r"), [Ok(vec![5.0, 6.0]), Ok(vec![7.0, 8.0])]);
        assert_eq!(received(&mut decoder, b"\n9,1\n"), [Ok(vec![9.0, 1.0])]);
        let mut rates = Vec::new();
        decoder.receive_message(b"1,2\r3,4\r", |frame| rates.push(frame.unwrap().reading[0]));
        assert_eq!(rates, [1.0, 3.0]);
    }

    #[test]
    fn the_last_bad_frame_is_quoted() {
        let mut decoder = decoder();
        assert_eq!(decoder.last_bad(), None);
        received(&mut decoder, b"1,2\nhello\tworld\n3,4\n");
        assert_eq!(decoder.last_bad().as_deref(), Some("hello\\tworld"));
        received(&mut decoder, &vec![b'7'; 2 * LONGEST_LINE]);
        assert_eq!(decoder.last_bad().unwrap().chars().count(), 80);
        decoder.receive_message(&vec![b'8'; LONGEST_MESSAGE + 1], |frame| {
            assert_eq!(frame, Err(BadFrame::TooLong));
        });
        assert!(decoder.last_bad().unwrap().starts_with("888"));
    }

    #[test]
    fn bytes_that_waited_give_names_but_no_readings() {
        let mut decoder = decoder();
        decoder.join();
        decoder.receive_waiting(b"boot\nt,b,a\n1,2,3\n4,5,");
        assert_eq!(received(&mut decoder, b"6\n7,8,9\n"), [Ok(vec![9.0, 8.0])]);
    }

    #[test]
    fn a_torn_start_is_not_counted() {
        let mut decoder = decoder();
        decoder.join();
        // "12.5,1" without its first digit looks like a valid frame.
        assert_eq!(received(&mut decoder, b"2.5,1\n3,4\n"), [Ok(vec![3.0, 4.0])]);
        decoder.join();
        assert_eq!(
            received(&mut decoder, b"\xFF\x80,1\n3,4\nx\n"),
            [Ok(vec![3.0, 4.0]), Err(BadFrame::NotANumber)]
        );
        decoder.join();
        assert_eq!(received(&mut decoder, b"a:1,b:2\n"), [Ok(vec![1.0, 2.0])]);
        for cut in 1..18 {
            decoder.join();
            let verdicts = received(&mut decoder, &binary(0..20)[cut..]);
            assert_eq!(verdicts.len(), 19, "{cut}: {verdicts:?}");
            assert!(verdicts.iter().all(Result::is_ok), "{cut}: {verdicts:?}");
        }
    }

    #[test]
    fn a_damaged_binary_frame_costs_itself_only() {
        let mut decoder = decoder();
        let mut bytes = binary(0..3);
        let size = bytes.len() / 3;
        bytes[size + 4] ^= 0x40;
        let verdicts = received(&mut decoder, &bytes);
        assert!(
            matches!(verdicts[..], [Ok(_), Err(BadFrame::Checksum | BadFrame::Malformed), Ok(_)]),
            "{verdicts:?}"
        );
    }

    #[test]
    fn a_board_that_turns_from_one_form_to_the_other_is_followed() {
        let mut decoder = decoder();
        let bytes = [b"1,2\n".as_slice(), &binary(0..60), b"\0", &b"3,4\n".repeat(1000)].concat();
        let verdicts = received(&mut decoder, &bytes);
        let good = |value: f64| verdicts.iter().filter(|is| matches!(is, Ok(is) if is[1] == value)).count();
        assert_eq!(good(2.0), 1);
        assert!(good(10.0) >= 58, "{}", good(10.0));
        // The loss is limited to the bytes of the longest binary frame.
        assert!(good(4.0) >= 1000 - binary::LONGEST / 4 - 2, "{}", good(4.0));
    }

    #[test]
    fn a_line_without_an_end_is_too_long_once() {
        let mut decoder = decoder();
        let bytes = [b"1,2\n".as_slice(), &vec![b'7'; 3 * LONGEST_LINE], b"\n3,4\n"].concat();
        assert_eq!(
            received(&mut decoder, &bytes),
            [Ok(vec![1.0, 2.0]), Err(BadFrame::TooLong), Ok(vec![3.0, 4.0])]
        );
    }

    #[test]
    fn messages_are_whole() {
        let mut decoder = decoder();
        let mut verdicts = Vec::new();
        let ended = binary(11..12);
        let unended = &ended[..ended.len() - 1];
        for message in [b"1,2".as_slice(), b"3,4\n5,6\n", b"[7,8]", &binary(9..11), unended] {
            decoder.receive_message(message, |frame| verdicts.push(frame.unwrap().reading[0]));
        }
        assert_eq!(verdicts, [1.0, 3.0, 5.0, 7.0, 9.0, 10.0, 11.0]);
    }

    #[test]
    fn the_end_of_a_stream_ends_its_last_line() {
        let mut decoder = decoder();
        assert_eq!(received(&mut decoder, b"1,2\n3,4"), [Ok(vec![1.0, 2.0])]);
        let mut last = Vec::new();
        decoder.end(|frame| last.push(frame.unwrap().reading));
        assert_eq!(last, [[3.0, 4.0]]);
    }

    #[test]
    fn columns_name_every_channel_once() {
        let columns = |names: &str| names.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut decoder = decoder();
        let missing = decoder.set_columns(&columns("a,t")).unwrap_err();
        assert!(missing.to_string().contains("a,t have no channel `b`"), "{missing}");
        let twice = decoder.set_columns(&columns("a,b,S1")).unwrap_err();
        assert!(twice.to_string().contains("a channel twice"), "{twice}");
        decoder.set_columns(&columns("n,B,x,a")).unwrap();
        assert_eq!(received(&mut decoder, b"7,2,99,1\n"), [Ok(vec![1.0, 2.0])]);
    }

    proptest! {
        #[test]
        fn frames_do_not_depend_on_the_chunks(
            parts in prop::collection::vec(
                prop_oneof![
                    Just(b"1.5,2\n".to_vec()),
                    Just(b"b:1;a:2\r\n".to_vec()),
                    Just(b"3;4\r".to_vec()),
                    Just(b">a:1\n>b:2\n".to_vec()),
                    Just(b"Reading: 1, 2\n".to_vec()),
                    Just(b"t,a,b\n".to_vec()),
                    (0..400_u16).prop_map(|n| binary(n..n + 1)),
                    prop::collection::vec(any::<u8>(), 0..40),
                    Just(vec![b'9'; LONGEST_LINE - 1]),
                ],
                0..12,
            ),
            cuts in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
            joins in any::<bool>(),
        ) {
            let bytes = parts.concat();
            let (mut whole, mut cut) = (decoder(), decoder());
            if joins {
                whole.join();
                cut.join();
            }
            let mut places: Vec<usize> = cuts.iter().map(|cut| cut.index(bytes.len() + 1)).collect();
            places.sort_unstable();
            let mut verdicts = Vec::new();
            let mut start = 0;
            for place in places.into_iter().chain([bytes.len()]) {
                verdicts.extend(received(&mut cut, &bytes[start..place]));
                start = place;
            }
            prop_assert_eq!(verdicts, received(&mut whole, &bytes));
        }
    }
}
