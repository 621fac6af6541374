use super::{BadFrame, Channel, Frame, printed};
use std::time::Duration;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    Channel(usize),
    /// Time with its unit in seconds.
    Time(f64),
    Sequence,
    Ignored,
}

/// Names of the time, with units in seconds.
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
const SEQUENCES: [&str; 3] = ["n", "seq", "sequence"];
/// About 30,000 years.
const LONGEST_S: f64 = 1e12;

#[derive(Debug)]
pub struct Names {
    channels: Vec<Channel>,
    factors: Vec<f64>,
}

impl Names {
    pub fn new(channels: &[Channel]) -> Self {
        let factors = channels.iter().map(|channel| channel.unit.factor()).collect();
        Self { channels: channels.to_vec(), factors }
    }

    pub fn len(&self) -> usize {
        self.channels.len()
    }

    pub fn channel(&self, i: usize) -> &Channel {
        &self.channels[i]
    }

    /// Channel by label, else by sensor, else time or sequence number; case-insensitive.
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

    pub fn lacking(&self, roles: &[Role]) -> Option<&Channel> {
        let lacks = |i: &usize| !roles.contains(&Role::Channel(*i));
        (0..self.len()).find(lacks).map(|i| &self.channels[i])
    }
}

pub fn is_reserved(name: &str) -> bool {
    Names::new(&[]).role(name) != Role::Ignored
}

/// Builder of a frame.
pub struct Filling<'a> {
    factors: &'a [f64],
    frame: Frame,
    missing: usize,
}

impl<'a> Filling<'a> {
    pub fn new(names: &'a Names) -> Self {
        let reading = vec![f64::NAN; names.len()];
        let frame = Frame { reading, sequence: None, device_time: None };
        Self { factors: &names.factors, frame, missing: names.len() }
    }

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

    /// Sets the time from text, but ignores a time without milliseconds; false for other text.
    pub fn set_time_text(&mut self, text: &[u8]) -> bool {
        let Ok(text) = std::str::from_utf8(text) else { return false };
        let text = text.trim_matches('"');
        let time_s = printed::time_s(text).filter(|time_s| (0.0..=LONGEST_S).contains(time_s));
        if let Some(time_s) = time_s {
            self.frame.device_time = Some(Duration::from_secs_f64(time_s));
        }
        time_s.is_some() || printed::is_time(text)
    }

    pub fn set_header(&mut self, sequence: u32, device_time: Duration) {
        self.frame.sequence = Some(sequence);
        self.frame.device_time = Some(device_time);
    }

    pub fn finish(self) -> Result<Frame, BadFrame> {
        if self.missing == 0 { Ok(self.frame) } else { Err(BadFrame::MissingChannel) }
    }
}
