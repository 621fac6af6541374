use crate::event::{ChannelState, Event};
use palpate_mechanics::sensing::{Layout, SensorKind};
use serde::Serialize;

/// Consecutive equal readings of a dead channel.
const DEAD: u32 = 100;
const SATURATED: u32 = 5;

/// Health of a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelHealth {
    /// Name of the sensor.
    pub name: String,
    /// State.
    pub state: ChannelState,
    /// Lowest and highest value in SI units or raw.
    pub range: [f64; 2],
    /// Standard deviation of untouched readings in SI units or raw; 0 if unknown.
    pub noise_sd: f64,
}

/// 2ⁿ − 1 or −2ⁿ of a converter of 10 to 32 bits.
fn is_converter_end(value: f64) -> bool {
    (9..=32).any(|bits| {
        let range = 2_f64.powi(bits);
        value == range - 1.0 || value == -range
    })
}

#[derive(Debug)]
pub struct HealthWatch {
    channels: Vec<ChannelHealth>,
    limits: Vec<Option<(f64, f64)>>,
    is_raw: Vec<bool>,
    raw_range: [f64; 2],
    last: Vec<f64>,
    before: Vec<f64>,
    same: Vec<u32>,
    at_end: Vec<u32>,
    pairs: u64,
}

impl HealthWatch {
    pub fn new(layout: &Layout) -> Self {
        let health = |name: &String| ChannelHealth {
            name: name.clone(),
            state: ChannelState::Well,
            range: [f64::INFINITY, f64::NEG_INFINITY],
            noise_sd: 0.0,
        };
        let count = layout.len();
        Self {
            channels: layout.names().iter().map(health).collect(),
            limits: layout.sensors().iter().map(|sensor| sensor.channel.range).collect(),
            is_raw: layout.sensors().iter().map(|sensor| sensor.kind == SensorKind::Raw).collect(),
            raw_range: [f64::INFINITY, f64::NEG_INFINITY],
            last: vec![f64::NAN; count],
            before: vec![f64::NAN; count],
            same: vec![0; count],
            at_end: vec![0; count],
            pairs: 0,
        }
    }

    pub fn channels(&self) -> &[ChannelHealth] {
        &self.channels
    }

    /// The difference of untouched readings has twice the variance. Averages a few hundred pairs.
    pub fn learn_noise(&mut self) {
        self.pairs += 1;
        let weight = 1.0 / self.pairs.min(300) as f64;
        let differences = self.last.iter().zip(&self.before).map(|(last, before)| last - before);
        for (channel, difference) in self.channels.iter_mut().zip(differences) {
            let variance = channel.noise_sd.powi(2);
            channel.noise_sd = (variance + weight * (0.5 * difference * difference - variance)).sqrt();
        }
    }

    pub fn add(&mut self, reading: &[f64], mut tell: impl FnMut(Event)) {
        self.before.clone_from(&self.last);
        for (value, _) in reading.iter().zip(&self.is_raw).filter(|(_, is_raw)| **is_raw) {
            self.raw_range = [self.raw_range[0].min(*value), self.raw_range[1].max(*value)];
        }
        for (i, value) in reading.iter().copied().enumerate() {
            let channel = &mut self.channels[i];
            channel.range = [channel.range[0].min(value), channel.range[1].max(value)];
            let same = self.last[i].to_bits() == value.to_bits();
            self.same[i] = if same { self.same[i].saturating_add(1) } else { 0 };
            let ends = match self.limits[i] {
                Some((low, high)) => value <= low || value >= high,
                None => {
                    let is_outermost = value == self.raw_range[usize::from(value > 0.0)];
                    self.is_raw[i] && is_outermost && is_converter_end(value)
                }
            };
            self.at_end[i] = if ends { self.at_end[i].saturating_add(1) } else { 0 };
            self.last[i] = value;
        }
        let others_change = self.same.contains(&0);
        for (i, channel) in self.channels.iter_mut().enumerate() {
            let state = match channel.state {
                _ if self.at_end[i] >= SATURATED => ChannelState::Saturated,
                ChannelState::Dead if self.same[i] > 0 => ChannelState::Dead,
                _ if self.same[i] >= DEAD && others_change => ChannelState::Dead,
                _ => ChannelState::Well,
            };
            if state != channel.state {
                channel.state = state;
                tell(Event::Channel { name: channel.name.clone(), state });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last_state(readings: impl IntoIterator<Item = [f64; 2]>) -> ChannelState {
        let mut watch = HealthWatch::new(&Layout::even(SensorKind::Raw, 2, 0.1));
        readings.into_iter().for_each(|reading| watch.add(&reading, |_| {}));
        watch.channels()[0].state
    }

    #[test]
    fn a_channel_at_the_end_of_a_converter_is_saturated() {
        let stuck = |value: f64| (0..200).map(move |i| [value, f64::from(i % 7)]);
        for value in [8_388_607.0, -8_388_608.0, 32_767.0, 65_535.0, 4095.0, 1023.0, -512.0] {
            assert_eq!(last_state(stuck(value)), ChannelState::Saturated, "{value}");
            assert_eq!(last_state(stuck(value).take(3)), ChannelState::Well, "{value}");
        }
        for value in [8_388_606.0, 0.0, 127.0, 1000.0, 1023.5] {
            assert_eq!(last_state(stuck(value)), ChannelState::Dead, "{value}");
        }
    }

    #[test]
    fn a_value_that_another_channel_exceeds_is_no_end() {
        assert_eq!(last_state((0..200).map(|i| [1023.0, 1024.0 + f64::from(i % 7)])), ChannelState::Dead);
        assert_eq!(last_state((0..20).map(|i| [1023.0, 1024.0 + f64::from(i % 7)])), ChannelState::Well);
    }
}
