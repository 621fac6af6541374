//! Simulated board.

mod faults;
mod finger;
mod hand;
mod link;

pub use faults::FaultConfig;
pub use finger::{Finger, ScriptError};
pub use hand::{HandStyle, Instruction, SimulatedHand};
pub use link::{Link, LinkError, LinkUrl, LinkUrlError};

use crate::frame::{self, Channel};
use faults::{Delivery, Faults};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::{SimulateError, SimulatedBench};
use palpate_mechanics::contact::{Contact, Extent};
use palpate_numerics::watch::Watch;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::time::Duration;

/// Configuration of a simulated board.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardConfig {
    /// Readings per second, positive.
    pub rate_hz: f64,
    /// Seed of noise and faults.
    pub seed: u64,
    /// Load cell, with the last value of each frame.
    pub load_cell: Option<LoadCell>,
    /// Form of the frames.
    pub frames: FrameForm,
}

/// Form of frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FrameForm {
    /// Lines of text.
    #[default]
    Text,
    /// Binary frames with sequence number and time.
    Binary {
        /// Clock error in parts per million.
        clock_ppm: f64,
    },
}

/// Simulated load cell.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadCell {
    /// Name of its values.
    pub name: String,
    /// Noise in newtons.
    pub noise_n: f64,
}

impl Default for BoardConfig {
    fn default() -> Self {
        Self { rate_hz: 100.0, seed: 0, load_cell: None, frames: FrameForm::Text }
    }
}

/// Generator of the frames of a board.
pub struct SimulatedBoard<'a> {
    bench: SimulatedBench<'a>,
    extent: Extent,
    channels: Vec<Channel>,
    finger: Finger,
    faults: Faults,
    rate_hz: f64,
    load_cell: Option<(LoadCell, Xoshiro256PlusPlus)>,
    frames: FrameForm,
    /// Frames can repeat it.
    measured: (Vec<f64>, f64),
    count: u64,
    counts: FrameCounts,
}

/// Counts of frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Whole frames.
    pub whole: u64,
    /// Dropped frames.
    pub dropped: u64,
    /// Torn frames.
    pub torn: u64,
}

impl<'a> SimulatedBoard<'a> {
    /// Board on the bench of a setup.
    ///
    /// # Errors
    /// [`SimulateError`].
    pub fn new(setup: &'a Setup, config: &BoardConfig, finger: Finger) -> Result<Self, SimulateError> {
        let faults = FaultConfig::of_setup(setup);
        let bench = SimulatedBench::perfect_watched(setup, config.seed, Watch::NONE)?;
        let bench = bench.with_imperfections(faults.imperfections, finger.typical_n());
        let channels = Channel::all_of(setup);
        let faults = Faults::new(faults, config.seed);
        Ok(Self {
            bench,
            extent: setup.surface().extent(),
            channels,
            finger,
            faults,
            rate_hz: config.rate_hz,
            frames: config.frames,
            // This random stream is independent of those of the noise and the finger.
            load_cell: config
                .load_cell
                .clone()
                .map(|cell| (cell, Xoshiro256PlusPlus::seed_from_u64(config.seed ^ 0x10AD))),
            measured: (Vec::new(), 0.0),
            count: 0,
            counts: FrameCounts::default(),
        })
    }

    /// Replaces the faults of the setup.
    ///
    /// # Errors
    /// [`SimulateError`].
    pub fn with_faults(mut self, config: FaultConfig, seed: u64) -> Result<Self, SimulateError> {
        config.imperfections.check(self.extent)?;
        if let Some(step) = config.converter_step {
            self.bench = self.bench.with_resolution(step)?;
        }
        self.bench = self.bench.with_imperfections(config.imperfections, self.finger.typical_n());
        self.faults = Faults::new(config, seed);
        Ok(self)
    }

    /// Time of the next frame.
    pub fn next_at(&self) -> Duration {
        Duration::from_secs_f64(self.count as f64 / self.rate_hz)
    }

    /// Counts of frames.
    pub fn sent(&self) -> &FrameCounts {
        &self.counts
    }

    /// Finger.
    pub fn finger_mut(&mut self) -> &mut Finger {
        &mut self.finger
    }

    /// Frames until `elapsed` since the start.
    pub fn send_until(&mut self, elapsed: Duration) -> Vec<u8> {
        let mut bytes = Vec::new();
        while self.next_at() <= elapsed {
            bytes.extend(self.next_frame().unwrap_or_default());
        }
        bytes
    }

    /// Next frame; `None` if dropped.
    pub fn next_frame(&mut self) -> Option<Vec<u8>> {
        let time_s = self.next_at().as_secs_f64();
        let contact = self.finger.contact_at(time_s);
        let clean = self.bench.clean_through_layer(contact.as_slice());
        let values = self.bench.advance(&clean, 1.0 / self.rate_hz);
        if self.count.is_multiple_of(1 + u64::from(self.faults.config.imperfections.repeated_readings)) {
            self.measured = self.measure(&values, contact);
        }
        let mut frame = self.frame(time_s);
        self.count += 1;
        match self.faults.next(frame.len()) {
            Delivery::Whole => self.counts.whole += 1,
            Delivery::Torn { lost } => {
                self.counts.torn += 1;
                frame.drain(lost);
            }
            Delivery::Dropped => {
                self.counts.dropped += 1;
                return None;
            }
        }
        Some(frame)
    }

    fn measure(&mut self, values: &[f64], contact: Option<Contact>) -> (Vec<f64>, f64) {
        let reading = self.bench.measure(values);
        let noise_n = self.load_cell.as_mut().map_or(0.0, |(cell, rng)| {
            let noise: f64 = StandardNormal.sample(rng);
            cell.noise_n * noise
        });
        (reading, contact.map_or(0.0, |contact| contact.force_n) + noise_n)
    }

    /// Frame with values in channel units, to seven digits. A load cell requires names, so that readers find
    /// the channels.
    fn frame(&mut self, time_s: f64) -> Vec<u8> {
        let (reading, force_n) = &self.measured;
        let mut values: Vec<f32> = reading
            .iter()
            .zip(&self.channels)
            .map(|(value, channel)| (value / channel.unit.factor()) as f32)
            .collect();
        values.extend(self.load_cell.as_ref().map(|_| *force_n as f32));
        if let FrameForm::Binary { clock_ppm } = self.frames {
            let mut bytes = Vec::new();
            // Number and time wrap around, as on a microcontroller.
            let time_us = (time_s * (1e6 + clock_ppm)) as u64 as u32;
            frame::encode_into(&mut bytes, self.count as u32, time_us, &values);
            return bytes;
        }
        let labels = self.channels.iter().map(|channel| channel.label.as_str());
        let cells: Vec<String> = match &self.load_cell {
            None => values.iter().map(f32::to_string).collect(),
            Some((cell, _)) => labels
                .chain([cell.name.as_str()])
                .zip(&values)
                .map(|(label, value)| format!("{label}:{value}"))
                .collect(),
        };
        (cells.join(",") + "\n").into_bytes()
    }
}
