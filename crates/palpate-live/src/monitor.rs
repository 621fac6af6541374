//! Monitor of a board without a rig.

use crate::frame::{BadFrame, Channel, Decoder, Frame, is_reserved, quote};
use crate::input::{Arrival, TimedArrival};
use palpate_mechanics::units::Unit;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

const LINES: usize = 100;
const LONGEST: usize = 160;
/// More bytes are not text, or the baud rate is wrong.
const MOST_PARTIAL: usize = 4096;
const MOST_CHANNELS: usize = 64;
const RATE_OVER: Duration = Duration::from_secs(2);
/// Consecutive bad frames that restart the detection.
const UNEXPLAINED: u32 = 20;
const BINARY_SAMPLE: usize = 2048;
/// Valid checksums that establish the number of channels.
const BINARY_FRAMES: usize = 3;

/// Received line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RawLine {
    /// Unix time in seconds.
    pub time_s: f64,
    /// Text, escaped and cut.
    pub text: String,
    /// True for a reading.
    pub reads: bool,
}

/// Values of a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelValues {
    /// Name in the frames, or `s1`, `s2`, …
    pub name: String,
    /// Newest value.
    pub now: Option<f64>,
    /// Lowest and highest value.
    pub range: Option<[f64; 2]>,
}

/// State of a monitor for JSON.
#[derive(Clone, Debug, Serialize)]
pub struct MonitorRecord {
    /// Connected source.
    pub source: Option<String>,
    /// Cause of missing readings.
    pub problem: Option<String>,
    /// Bytes.
    pub bytes: u64,
    /// Readings.
    pub readings: u64,
    /// Readings per second.
    pub rate_hz: f64,
    /// Bad frames by cause.
    pub bad_frames: BTreeMap<BadFrame, u64>,
    /// Detected channels.
    pub channels: Vec<ChannelValues>,
    /// True if the board names its values.
    pub named: bool,
    /// Last lines, oldest first.
    pub lines: Vec<RawLine>,
}

/// Monitor of the bytes of a source.
#[derive(Debug, Default)]
pub struct Monitor {
    source: Option<String>,
    failure: Option<String>,
    lines: VecDeque<RawLine>,
    partial: Vec<u8>,
    bytes: u64,
    detected: Option<DetectedFrames>,
    header: Option<Vec<u8>>,
    sample: Vec<u8>,
    readings: u64,
    arrivals: VecDeque<(Duration, u64)>,
    bad_frames: BTreeMap<BadFrame, u64>,
    unexplained: u32,
}

#[derive(Debug)]
struct DetectedFrames {
    channels: Vec<ChannelValues>,
    decoder: Decoder,
    named: bool,
    is_binary: bool,
}

impl Monitor {
    /// Adds an arrival.
    pub fn receive(&mut self, arrived: &TimedArrival) {
        let time_s = arrived.at.unix_ns as f64 * 1e-9;
        match &arrived.arrival {
            Arrival::Opened(name) | Arrival::Joined(name) | Arrival::Piped(name) => {
                (self.source, self.failure) = (Some(name.clone()), None);
                self.partial.clear();
            }
            Arrival::Lost(why) => (self.source, self.failure) = (None, Some(why.clone())),
            Arrival::Ended => (self.source, self.failure) = (None, Some("the source has ended".to_owned())),
            Arrival::Bytes(bytes) | Arrival::Backlog(bytes) => {
                self.receive_bytes(bytes, time_s, arrived.at.elapsed);
            }
            Arrival::Message(bytes) => {
                self.receive_bytes(bytes, time_s, arrived.at.elapsed);
                // A message ends its last line.
                self.end_line(time_s, arrived.at.elapsed);
            }
        }
    }

    fn receive_bytes(&mut self, bytes: &[u8], time_s: f64, at: Duration) {
        self.bytes += bytes.len() as u64;
        if self.detected.as_ref().is_some_and(|detected| detected.is_binary) {
            return self.receive_binary(bytes, time_s, at);
        }
        for byte in bytes {
            // Boards end lines by a line feed, a carriage return, or both.
            if matches!(byte, b'\n' | b'\r') || self.partial.len() >= MOST_PARTIAL {
                self.end_line(time_s, at);
            }
            if !matches!(byte, b'\n' | b'\r') {
                self.partial.push(*byte);
            }
        }
        if self.detected.is_none() {
            self.sample.extend_from_slice(&bytes[bytes.len().saturating_sub(BINARY_SAMPLE)..]);
            if self.sample.len() >= BINARY_SAMPLE {
                self.find_binary();
                self.sample.clear();
            }
        }
    }

    fn receive_binary(&mut self, bytes: &[u8], time_s: f64, at: Duration) {
        let mut frames = Vec::new();
        if let Some(detected) = &mut self.detected {
            detected.decoder.receive(bytes, |frame| frames.push(frame));
        }
        let reads = frames.iter().any(Result::is_ok);
        self.keep_line(bytes, time_s, reads);
        frames.into_iter().for_each(|frame| self.take(frame, at));
    }

    fn end_line(&mut self, time_s: f64, at: Duration) {
        let line = std::mem::take(&mut self.partial);
        if line.trim_ascii().is_empty() {
            return;
        }
        if self.detected.is_none() || self.unexplained >= UNEXPLAINED {
            self.find_text(&line);
        }
        let mut frames = Vec::new();
        if let Some(detected) = &mut self.detected {
            detected.decoder.receive_message(&line, |frame| frames.push(frame));
        }
        let reads = frames.iter().any(Result::is_ok);
        self.keep_line(&line, time_s, reads);
        frames.into_iter().for_each(|frame| self.take(frame, at));
        if !reads && names_in_header(&line).is_some() {
            self.header = Some(line);
        }
    }

    fn keep_line(&mut self, bytes: &[u8], time_s: f64, reads: bool) {
        self.lines.push_back(RawLine { time_s, text: escaped(bytes, LONGEST), reads });
        if self.lines.len() > LINES {
            self.lines.pop_front();
        }
    }

    fn take(&mut self, frame: Result<Frame, BadFrame>, at: Duration) {
        match frame {
            Ok(frame) => {
                self.readings += 1;
                self.unexplained = 0;
                match self.arrivals.back_mut() {
                    Some((last, count)) if *last == at => *count += 1,
                    _ => self.arrivals.push_back((at, 1)),
                }
                self.forget_arrivals(at);
                let channels = self.detected.iter_mut().flat_map(|detected| &mut detected.channels);
                for (channel, value) in channels.zip(frame.reading) {
                    let [low, high] = channel.range.unwrap_or([value; 2]);
                    (channel.now, channel.range) = (Some(value), Some([low.min(value), high.max(value)]));
                }
            }
            Err(cause) => {
                *self.bad_frames.entry(cause).or_default() += 1;
                self.unexplained = self.unexplained.saturating_add(1);
            }
        }
    }

    fn forget_arrivals(&mut self, now: Duration) {
        while self.arrivals.front().is_some_and(|(at, _)| now.saturating_sub(*at) > RATE_OVER) {
            self.arrivals.pop_front();
        }
    }

    fn find_text(&mut self, line: &[u8]) {
        let header = self.header.as_deref();
        let Some((names, named, uses_header)) = candidates(line, header).find(|(names, _, uses_header)| {
            let mut decoder = decoder_of(names);
            if let Some(header) = header.filter(|_| *uses_header) {
                decoder.receive_message(header, |_| {});
            }
            let mut reads = false;
            decoder.receive_message(line, |frame| reads = frame.is_ok());
            reads
        }) else {
            return;
        };
        let mut decoder = decoder_of(&names);
        if let Some(header) = self.header.as_deref().filter(|_| uses_header) {
            decoder.receive_message(header, |_| {});
        }
        self.detected = Some(DetectedFrames::new(&names, decoder, named, false));
        self.unexplained = 0;
    }

    fn find_binary(&mut self) {
        for count in 1..=MOST_CHANNELS {
            let names = numbered(count);
            let mut decoder = decoder_of(&names);
            decoder.join();
            let mut frames = 0;
            decoder.receive(&self.sample, |frame| frames += usize::from(frame.is_ok()));
            if frames >= BINARY_FRAMES {
                self.detected = Some(DetectedFrames::new(&names, decoder, false, true));
                self.unexplained = 0;
                return;
            }
        }
    }

    /// Current state.
    pub fn record(&self, now: Duration) -> MonitorRecord {
        let recent = self.arrivals.iter().filter(|(at, _)| now.saturating_sub(*at) <= RATE_OVER);
        let (first, count) =
            recent.fold((now, 0), |(first, count), (at, more)| (first.min(*at), count + more));
        let span_s = now.saturating_sub(first).as_secs_f64().max(RATE_OVER.as_secs_f64() / 4.0);
        MonitorRecord {
            source: self.source.clone(),
            problem: self.problem(),
            bytes: self.bytes,
            readings: self.readings,
            rate_hz: count as f64 / span_s,
            bad_frames: self.bad_frames.clone(),
            channels: self.detected.as_ref().map_or_else(Vec::new, |detected| detected.channels.clone()),
            named: self.detected.as_ref().is_some_and(|detected| detected.named),
            lines: self.lines.iter().cloned().collect(),
        }
    }

    fn problem(&self) -> Option<String> {
        if let Some(lost) = &self.failure {
            return Some(lost.clone());
        }
        self.source.as_ref()?;
        if self.bytes == 0 {
            return Some(
                "the board sends no data: check that it runs, and that the port is its own".to_owned(),
            );
        }
        if self.detected.is_some() && self.unexplained < UNEXPLAINED {
            return None;
        }
        let is_text =
            self.lines.iter().rev().take(UNEXPLAINED as usize).all(|line| !line.text.contains("\\x"));
        // A quotation has at most 80 characters.
        let last = self.lines.back().map_or(String::new(), |line| line.text.clone());
        let last = if last.is_empty() { quote(&self.partial) } else { quote(last.as_bytes()) };
        Some(match (self.lines.is_empty(), is_text) {
            (true, _) if self.bytes < MOST_PARTIAL as u64 => format!("no line has ended yet: `{last}`"),
            (false, true) => format!(
                "lines arrive without values; the last is `{last}`; send one line per reading, such as `12,34,56`"
            ),
            _ => format!("the bytes are not text: `{last}`; try another baud rate"),
        })
    }

    /// Fault of a source without readings.
    pub fn fault(&self) -> Option<String> {
        let reason = || self.problem().unwrap_or("the source did not open".to_owned());
        (self.readings == 0).then(|| format!("there was no reading: {}", reason()))
    }

    /// Names of the detected channels.
    pub fn channel_names(&self) -> Vec<String> {
        self.detected
            .iter()
            .flat_map(|detected| &detected.channels)
            .map(|channel| channel.name.clone())
            .collect()
    }

    /// True if the board names its values.
    pub fn is_named(&self) -> bool {
        self.detected.as_ref().is_some_and(|detected| detected.named)
    }
}

impl DetectedFrames {
    fn new(names: &[String], decoder: Decoder, named: bool, is_binary: bool) -> Self {
        let channel = |name: &String| ChannelValues { name: name.clone(), now: None, range: None };
        Self { channels: names.iter().map(channel).collect(), decoder, named, is_binary }
    }
}

fn decoder_of(names: &[String]) -> Decoder {
    let channel = |name: &String| Channel { name: name.clone(), label: name.clone(), unit: Unit::NONE };
    Decoder::new(&names.iter().map(channel).collect::<Vec<_>>())
}

fn numbered(count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("s{i}")).collect()
}

/// Names, whether the board gives them, and whether in the header.
fn candidates<'a>(
    line: &'a [u8],
    header: Option<&'a [u8]>,
) -> impl Iterator<Item = (Vec<String>, bool, bool)> + 'a {
    let named = names_in_line(line).map(|names| (names, true, false));
    let headed = header.and_then(names_in_header).map(|names| (names, true, true));
    // There are at most as many values as pieces between separators.
    let pieces = line.split(|byte| b",; \t[]".contains(byte)).filter(|piece| !piece.is_empty()).count();
    let unnamed = (1..=pieces.min(MOST_CHANNELS)).rev().map(|count| (numbered(count), false, false));
    named.into_iter().chain(headed).chain(unnamed)
}

fn names_in_line(line: &[u8]) -> Option<Vec<String>> {
    let text = std::str::from_utf8(line).ok()?.trim();
    let names: Vec<String> = if text.starts_with('{') {
        let object: serde_json::Map<String, serde_json::Value> = serde_json::from_str(text).ok()?;
        let mut names: Vec<String> =
            object.into_iter().filter(|(_, value)| value.is_number()).map(|(name, _)| name).collect();
        // The order of the board; the object is sorted.
        names.sort_by_key(|name| text.find(&format!("\"{name}\"")));
        names
    } else {
        let ends = text.char_indices().filter(|(_, mark)| matches!(mark, ':' | '='));
        ends.filter_map(|(end, _)| {
            let name = text[..end].trim_end();
            let start = name.rfind([',', ';', ' ', '\t']).map_or(0, |at| at + 1);
            Some(name[start..].to_owned()).filter(|name| !name.is_empty())
        })
        .collect()
    };
    checked(names)
}

fn names_in_header(line: &[u8]) -> Option<Vec<String>> {
    let text = std::str::from_utf8(line).ok()?.trim();
    let separator = [';', '\t', ','].into_iter().find(|separator| text.contains(*separator)).unwrap_or(' ');
    let fields = text.split(separator).map(|field| field.trim().trim_matches('"').to_owned());
    let fields: Vec<String> = fields.filter(|field| !field.is_empty()).collect();
    let are_words =
        fields.iter().all(|field| field.parse::<f64>().is_err() && !field.contains([':', '=', '{', '[']));
    checked(fields.into_iter().filter(|_| are_words).collect())
}

fn checked(names: Vec<String>) -> Option<Vec<String>> {
    let names: Vec<String> = names.into_iter().filter(|name| !is_reserved(name)).collect();
    let mut sorted: Vec<String> = names.iter().map(|name| name.to_ascii_lowercase()).collect();
    sorted.sort_unstable();
    sorted.dedup();
    let usable = !names.is_empty() && names.len() <= MOST_CHANNELS && sorted.len() == names.len();
    usable.then_some(names)
}

/// Escapes control characters and invalid bytes; at most `most` characters.
pub fn escaped(bytes: &[u8], most: usize) -> String {
    let mut text = String::new();
    let mut count = 0;
    for chunk in bytes.utf8_chunks() {
        let valid = chunk.valid().chars().map(|one| match one {
            one if one.is_control() && (one as u32) < 0x80 => format!("\\x{:02x}", one as u32),
            one if one.is_control() => one.escape_unicode().to_string(),
            one => one.to_string(),
        });
        for piece in valid.chain(chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}"))) {
            let length = piece.chars().count();
            if count + length > most {
                text.push('…');
                return text;
            }
            count += length;
            text.push_str(&piece);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::encode_into;
    use crate::stamp::Stamp;

    fn arrived(ms: u64, arrival: Arrival) -> TimedArrival {
        let at = Stamp { elapsed: Duration::from_millis(ms), unix_ns: ms * 1_000_000 };
        TimedArrival { at, arrival }
    }

    fn of_lines(lines: &[&str]) -> Monitor {
        let mut monitor = Monitor::default();
        monitor.receive(&arrived(0, Arrival::Joined("a port".to_owned())));
        for (i, line) in lines.iter().enumerate() {
            monitor.receive(&arrived(10 * i as u64, Arrival::Bytes(line.as_bytes().to_vec())));
        }
        monitor
    }

    fn names_and_values(lines: &[&str]) -> (Vec<String>, Vec<Option<f64>>, bool) {
        let record = of_lines(lines).record(Duration::ZERO);
        let channels = record.channels;
        (
            channels.iter().map(|channel| channel.name.clone()).collect(),
            channels.iter().map(|channel| channel.now).collect(),
            record.named,
        )
    }

    #[test]
    fn finds_channels_in_lines_of_all_forms() {
        let two = || vec![Some(12.0), Some(-3.5)];
        for (line, names, named) in [
            ("12,-3.5\n", ["s1", "s2"], false),
            ("12 -3.5\r\n", ["s1", "s2"], false),
            ("12;-3.5\r", ["s1", "s2"], false),
            ("[12, -3.5]\n", ["s1", "s2"], false),
            ("a:12 b:-3.5\n", ["a", "b"], true),
            ("left=12,right=-3.5\n", ["left", "right"], true),
            ("{\"a\":12,\"b\":-3.5,\"time_ms\":5,\"id\":\"x\"}\n", ["a", "b"], true),
            ("t:5,a:12,b:-3.5\n", ["a", "b"], true),
            ("{\"z\":12,\"a\":-3.5}\n", ["z", "a"], true),
        ] {
            let (found, values, is_named) = names_and_values(&[line]);
            assert_eq!(
                (found.as_slice(), values, is_named),
                (names.map(String::from).as_slice(), two(), named),
                "{line}"
            );
        }
        let (found, values, named) = names_and_values(&["millis,hx 1,hx 2\n", "5,12,-3.5\n"]);
        assert_eq!(
            (found.as_slice(), values, named),
            (["hx 1", "hx 2"].map(String::from).as_slice(), two(), true)
        );
    }

    #[test]
    fn finds_channels_again_after_the_board_has_changed() {
        let mut lines = vec!["1,2,3\n"; 5];
        lines.extend(vec!["1,2,3,4\n"; UNEXPLAINED as usize + 1]);
        let (names, values, _) = names_and_values(&lines);
        assert_eq!((names.len(), values[3]), (4, Some(4.0)));
    }

    #[test]
    fn finds_the_channels_of_binary_frames() {
        let mut bytes = Vec::new();
        for sequence in 0..200 {
            encode_into(&mut bytes, sequence, 10 * sequence, &[1.0, 2.0, -3.0]);
        }
        let mut monitor = Monitor::default();
        monitor.receive(&arrived(0, Arrival::Joined("a port".to_owned())));
        for (i, chunk) in bytes.chunks(100).enumerate() {
            monitor.receive(&arrived(10 * i as u64, Arrival::Bytes(chunk.to_vec())));
        }
        let record = monitor.record(Duration::ZERO);
        let values: Vec<Option<f64>> = record.channels.iter().map(|channel| channel.now).collect();
        assert_eq!(values, [Some(1.0), Some(2.0), Some(-3.0)]);
    }

    #[test]
    fn measures_the_rate_of_the_last_two_seconds() {
        let mut monitor = of_lines(&[]);
        for i in 0..500_u64 {
            monitor.receive(&arrived(10 * i, Arrival::Bytes(b"1,2\n".to_vec())));
        }
        let rate_hz = monitor.record(Duration::from_millis(4990)).rate_hz;
        assert!((rate_hz - 100.0).abs() < 1.0, "{rate_hz}");
        assert_eq!(monitor.record(Duration::from_secs(60)).rate_hz, 0.0);
    }

    #[test]
    fn keeps_the_last_lines_escaped_and_cut() {
        let mut monitor = of_lines(&[]);
        for i in 0..300 {
            monitor.receive(&arrived(i, Arrival::Bytes(format!("{i},5\n").into_bytes())));
        }
        monitor.receive(&arrived(301, Arrival::Bytes(b"<b>\x1b[31m\xff\xc2\xb5".to_vec())));
        monitor.receive(&arrived(302, Arrival::Bytes([vec![b'7'; 1000], vec![b'\n']].concat())));
        let record = monitor.record(Duration::ZERO);
        let last = &record.lines[LINES - 1];
        assert_eq!((record.lines.len(), record.lines[0].text.as_str()), (LINES, "201,5"));
        assert!(last.text.starts_with("<b>\\x1b[31m\\xffµ777") && last.text.ends_with('…'), "{}", last.text);
        assert_eq!(last.text.chars().count(), LONGEST + 1);
        assert!(record.lines[0].reads && !last.reads);
    }

    #[test]
    fn reports_why_no_readings_arrive() {
        let problem = |monitor: &Monitor| monitor.record(Duration::ZERO).problem.unwrap_or_default();
        assert!(problem(&of_lines(&[])).contains("sends no data"));
        assert!(problem(&of_lines(&["hello\n", "world\n"])).contains("without values"));
        let mut monitor = of_lines(&[]);
        monitor.receive(&arrived(1, Arrival::Bytes(vec![0xf8; 5000])));
        assert!(problem(&monitor).contains("baud"), "{}", problem(&monitor));
        monitor.receive(&arrived(2, Arrival::Lost("unplugged".to_owned())));
        assert_eq!(problem(&monitor), "unplugged");
        assert_eq!(problem(&of_lines(&["1,2\n"])), "");
    }
}
