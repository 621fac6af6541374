//! Frames of text: a line a reading.

use super::{BadFrame, Channel, Frame};

/// Most bytes of a line.
const LONGEST: usize = 1 << 16;

/// Decoder of lines of numbers, one a channel, separated by commas.
#[derive(Debug)]
pub struct TextDecoder {
    factors: Vec<f64>,
    line: Vec<u8>,
    skips: bool,
}

impl TextDecoder {
    /// A decoder of frames of these channels.
    pub fn new(channels: &[Channel]) -> Self {
        let factors = channels.iter().map(|channel| channel.unit.factor()).collect();
        Self { factors, line: Vec::new(), skips: false }
    }

    /// Takes the next bytes, and hands on the frames that they end.
    pub fn receive(&mut self, bytes: &[u8], mut hand_on: impl FnMut(Result<Frame, BadFrame>)) {
        for byte in bytes {
            match byte {
                b'\n' => self.end_line(&mut hand_on),
                _ if self.line.len() >= LONGEST => self.skips = true,
                byte => self.line.push(*byte),
            }
        }
    }

    /// Ends a message: what a datagram leaves without a line end is a frame of its own.
    pub fn end_message(&mut self, mut hand_on: impl FnMut(Result<Frame, BadFrame>)) {
        self.end_line(&mut hand_on);
    }

    /// Forgets what a source left unfinished when it went away.
    pub fn reset(&mut self) {
        self.line.clear();
        self.skips = false;
    }

    fn end_line(&mut self, hand_on: &mut impl FnMut(Result<Frame, BadFrame>)) {
        if std::mem::take(&mut self.skips) {
            hand_on(Err(BadFrame::TooLong));
        } else if !self.line.trim_ascii().is_empty() {
            hand_on(self.frame());
        }
        self.line.clear();
    }

    fn frame(&self) -> Result<Frame, BadFrame> {
        let line = std::str::from_utf8(&self.line).map_err(|_| BadFrame::Encoding)?;
        let mut reading = Vec::with_capacity(self.factors.len());
        for (i, value) in line.split(',').enumerate() {
            let factor = self.factors.get(i).ok_or(BadFrame::Channels)?;
            let value: f64 = value.trim().parse().map_err(|_| BadFrame::NotANumber)?;
            if !value.is_finite() {
                return Err(BadFrame::NotANumber);
            }
            reading.push(value * factor);
        }
        if reading.len() != self.factors.len() {
            return Err(BadFrame::Channels);
        }
        Ok(Frame { reading, sequence: None, device_time: None })
    }
}
