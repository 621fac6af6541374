use super::{BadFrame, Channel, ColumnsError, Decoder, Frame};
use crate::input::Arrival;
use std::collections::BTreeMap;

/// Decoder of arrivals that counts readings and bad frames.
#[derive(Debug)]
pub struct FrameReader {
    decoder: Decoder,
    labels: Vec<String>,
    readings: u64,
    bad: BTreeMap<BadFrame, u64>,
    bad_in_a_row: u64,
    last_cause: Option<BadFrame>,
}

impl FrameReader {
    /// Reader of frames with these channels.
    pub fn new(channels: &[Channel]) -> Self {
        Self {
            decoder: Decoder::new(channels),
            labels: channels.iter().map(|channel| channel.label.clone()).collect(),
            readings: 0,
            bad: BTreeMap::new(),
            bad_in_a_row: 0,
            last_cause: None,
        }
    }

    /// Names the values of frames, see [`Decoder::set_columns`].
    ///
    /// # Errors
    /// [`ColumnsError`].
    pub fn set_columns(&mut self, columns: &[String]) -> Result<(), ColumnsError> {
        self.decoder.set_columns(columns)
    }

    /// Readings of an arrival.
    pub fn receive(&mut self, arrival: &Arrival) -> Vec<Frame> {
        let mut frames = Vec::new();
        let hand_on = |frame| frames.push(frame);
        match arrival {
            Arrival::Opened(_) | Arrival::Piped(_) => {
                self.decoder.open();
                self.bad_in_a_row = 0;
            }
            Arrival::Joined(_) => {
                self.decoder.join();
                self.bad_in_a_row = 0;
            }
            Arrival::Lost(_) => self.decoder.open(),
            Arrival::Backlog(bytes) => self.decoder.receive_waiting(bytes),
            Arrival::Bytes(bytes) => self.decoder.receive(bytes, hand_on),
            Arrival::Message(bytes) => self.decoder.receive_message(bytes, hand_on),
            Arrival::Ended => self.decoder.end(hand_on),
        }
        frames.into_iter().filter_map(|frame| self.count(frame)).collect()
    }

    fn count(&mut self, frame: Result<Frame, BadFrame>) -> Option<Frame> {
        match frame {
            Ok(frame) => {
                self.readings += 1;
                self.bad_in_a_row = 0;
                Some(frame)
            }
            Err(cause) => {
                self.count_bad(cause);
                None
            }
        }
    }

    fn count_bad(&mut self, cause: BadFrame) {
        *self.bad.entry(cause).or_default() += 1;
        self.bad_in_a_row += 1;
        self.last_cause = Some(cause);
    }

    /// Counts a received frame as a bad one.
    pub fn refuse(&mut self, cause: BadFrame) {
        self.readings -= 1;
        self.count_bad(cause);
    }

    /// Readings.
    pub fn readings(&self) -> u64 {
        self.readings
    }

    /// Bad frames by cause.
    pub fn bad_frames(&self) -> &BTreeMap<BadFrame, u64> {
        &self.bad
    }

    /// Bad frames since the last reading or opening.
    pub fn bad_in_a_row(&self) -> u64 {
        self.bad_in_a_row
    }

    /// Cause and quotation of the last bad frame.
    pub fn last_bad_frame(&self) -> Option<(BadFrame, String)> {
        self.last_cause.zip(self.decoder.last_bad())
    }

    /// Bytes of the unfinished frame.
    pub fn unfinished(&self) -> &[u8] {
        self.decoder.unfinished()
    }

    /// Labels of the channels.
    pub fn labels(&self) -> impl Iterator<Item = &str> {
        self.labels.iter().map(String::as_str)
    }
}
