//! Names of the values of a frame, and a builder of frames from named values.

use super::{BadFrame, Channel, Frame, printed};
use std::time::Duration;

/// Role of a value of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// The value of a channel, by its index.
    Channel(usize),
    /// The time by the clock of the board; the number is its unit in seconds.
    Time(f64),
    /// The number of the frame.
    Sequence,
    /// An unknown name; its value is ignored.
    Ignored,
}

/// Names of the time, with its unit in seconds.
const TIMES: [(&str, f64); 8] = [
    ("t", 1.0),
    ("time", 1.0),
    ("time_s", 1.0),
    ("time_ms", 1e-3),
    ("ms", 1e-3),
    ("millis", 1e-3),
    ("us", 1e-6),
    ("micros", 1e-6),
];
/// Names of the number of the frame.
const SEQUENCES: [&str; 3] = ["n", "seq", "sequence"];
/// Longest time by the clock of a board, in seconds: about 30,000 years.
const LONGEST_S: f64 = 1e12;

/// Names of channels, and factors of their units.
#[derive(Debug)]
pub struct Names {
    channels: Vec<Channel>,
    factors: Vec<f64>,
}

impl Names {
    /// Names of these channels.
    pub fn new(channels: &[Channel]) -> Self {
        let factors = channels.iter().map(|channel| channel.unit.factor()).collect();
        Self { channels: channels.to_vec(), factors }
    }

    /// Number of channels.
    pub fn len(&self) -> usize {
        self.channels.len()
    }

    /// A channel.
    pub fn channel(&self, i: usize) -> &Channel {
        &self.channels[i]
    }

    /// Role of a name: a channel by label, else by the name of its sensor, else time or number of the frame. The case of ASCII letters is ignored.
    pub fn role(&self, name: &str) -> Role {
        let is = |known: &str| known.eq_ignore_ascii_case(name);
        let channels = || self.channels.iter();
        let channel = channels()
            .position(|channel| is(&channel.label))
            .or_else(|| channels().position(|channel| is(&channel.name)));
        if let Some(channel) = channel {
            Role::Channel(channel)
        } else if let Some((_, unit_s)) = TIMES.iter().find(|(time, _)| is(time)) {
            Role::Time(*unit_s)
        } else if SEQUENCES.iter().any(|sequence| is(sequence)) {
            Role::Sequence
        } else {
            Role::Ignored
        }
    }

    /// The first channel that is missing among these roles.
    pub fn lacking(&self, roles: &[Role]) -> Option<&Channel> {
        let lacks = |i: &usize| !roles.contains(&Role::Channel(*i));
        (0..self.len()).find(lacks).map(|i| &self.channels[i])
    }
}

/// True for a name of the time or of the number of a frame.
pub fn is_reserved(name: &str) -> bool {
    Names::new(&[]).role(name) != Role::Ignored
}

/// A frame under construction, value by value.
pub struct Filling<'a> {
    factors: &'a [f64],
    frame: Frame,
    missing: usize,
}

impl<'a> Filling<'a> {
    /// A frame without values.
    pub fn new(names: &'a Names) -> Self {
        let reading = vec![f64::NAN; names.len()];
        let frame = Frame { reading, sequence: None, device_time: None };
        Self { factors: &names.factors, frame, missing: names.len() }
    }

    /// Sets a value by its role.
    pub fn set(&mut self, role: Role, value: f64) -> Result<(), BadFrame> {
        match role {
            Role::Channel(i) => {
                let value = value * self.factors[i];
                if !value.is_finite() {
                    return Err(BadFrame::NotANumber);
                }
                let old = std::mem::replace(&mut self.frame.reading[i], value);
                if !old.is_nan() {
                    return Err(BadFrame::Channels);
                }
                self.missing -= 1;
            }
            Role::Time(unit_s) => {
                let time_s = value * unit_s;
                if !(0.0..=LONGEST_S).contains(&time_s) {
                    return Err(BadFrame::NotANumber);
                }
                self.frame.device_time = Some(Duration::from_secs_f64(time_s));
            }
            Role::Sequence => {
                if value.fract() != 0.0 || !(0.0..9e15).contains(&value) {
                    return Err(BadFrame::NotANumber);
                }
                // A counter with more bits is reduced to its lowest 32.
                self.frame.sequence = Some(value as u64 as u32);
            }
            Role::Ignored => {}
        }
        Ok(())
    }

    /// Sets the time from a date with a time of day, or a time of day alone; false for any other text. A time without milliseconds is ignored.
    pub fn set_time_text(&mut self, text: &[u8]) -> bool {
        let Ok(text) = std::str::from_utf8(text) else { return false };
        let text = text.trim_matches('"');
        let time_s = printed::time_s(text).filter(|time_s| (0.0..=LONGEST_S).contains(time_s));
        if let Some(time_s) = time_s {
            self.frame.device_time = Some(Duration::from_secs_f64(time_s));
        }
        time_s.is_some() || printed::is_time(text)
    }

    /// Sets the number and the time of a binary frame.
    pub fn set_header(&mut self, sequence: u32, device_time: Duration) {
        self.frame.sequence = Some(sequence);
        self.frame.device_time = Some(device_time);
    }

    /// The frame, once every channel has its value.
    pub fn finish(self) -> Result<Frame, BadFrame> {
        if self.missing == 0 { Ok(self.frame) } else { Err(BadFrame::MissingChannel) }
    }
}
