//! A board without hardware: simulates sensors under a surface, a finger that touches it, and the frames of the firmware.

mod faults;
mod finger;
mod hand;
mod link;

pub use faults::FaultConfig;
pub use finger::{Finger, ScriptError};
pub use hand::{Hand, HandStyle, Instruction};
pub use link::{Link, LinkError, LinkUrl, LinkUrlError};

use crate::frame::{self, Channel};
use faults::{Fate, Faults};
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
    /// Readings per second, greater than 0.
    pub rate_hz: f64,
    /// Seed of the sensors' faults and noise.
    pub seed: u64,
    /// A load cell under the finger; its force is the last value of every frame.
    pub load_cell: Option<LoadCell>,
    /// Form of the frames.
    pub frames: FrameForm,
}

/// Form of the frames of a simulated board.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FrameForm {
    /// Lines of text.
    #[default]
    Text,
    /// Binary frames, with the number of the frame and the time by the board's clock.
    Binary {
        /// Relative error by which the clock is fast, in millionths.
        clock_ppm: f64,
    },
}

/// Load cell of a simulated machine.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadCell {
    /// Name of the values.
    pub name: String,
    /// Standard deviation of the noise in newtons.
    pub noise_n: f64,
}

impl Default for BoardConfig {
    fn default() -> Self {
        Self { rate_hz: 100.0, seed: 0, load_cell: None, frames: FrameForm::Text }
    }
}

/// A simulated board, which makes the bytes of its frames from the time.
pub struct SimulatedBoard<'a> {
    bench: SimulatedBench<'a>,
    extent: Extent,
    channels: Vec<Channel>,
    finger: Finger,
    faults: Faults,
    rate_hz: f64,
    load_cell: Option<(LoadCell, Xoshiro256PlusPlus)>,
    frames: FrameForm,
    /// Last reading and force at the load cell, which frames can repeat.
    measured: (Vec<f64>, f64),
    /// Number of frames so far.
    count: u64,
    sent: Sent,
}

/// Numbers of frames of a board by their fate.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Frames that were sent whole.
    pub whole: u64,
    /// Frames that were dropped.
    pub dropped: u64,
    /// Frames with a missing part.
    pub torn: u64,
}

impl<'a> SimulatedBoard<'a> {
    /// A board on the bench of a setup, with the imperfections of the setup, touched by a finger.
    ///
    /// # Errors
    /// [`SimulateError`] for a surface without a model, or one with equations that are not solved.
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
            sent: Sent::default(),
        })
    }

    /// Replaces the faults of the setup with these; the seed draws dropped and torn frames.
    ///
    /// # Errors
    /// [`SimulateError`] for a number out of range.
    pub fn with_faults(mut self, config: FaultConfig, seed: u64) -> Result<Self, SimulateError> {
        config.imperfections.check(self.extent)?;
        if let Some(step) = config.converter_step {
            self.bench = self.bench.with_resolution(step)?;
        }
        self.bench = self.bench.with_imperfections(config.imperfections, self.finger.typical_n());
        self.faults = Faults::new(config, seed);
        Ok(self)
    }

    /// Time of the next frame since the start.
    pub fn next_at(&self) -> Duration {
        Duration::from_secs_f64(self.count as f64 / self.rate_hz)
    }

    /// Numbers of frames so far, by their fate.
    pub fn sent(&self) -> &Sent {
        &self.sent
    }

    /// The finger, for a stage that moves it.
    pub fn finger_mut(&mut self) -> &mut Finger {
        &mut self.finger
    }

    /// The bytes of all frames that are due by `elapsed` since the start.
    pub fn send_until(&mut self, elapsed: Duration) -> Vec<u8> {
        let mut bytes = Vec::new();
        while self.next_at() <= elapsed {
            bytes.extend(self.next_frame().unwrap_or_default());
        }
        bytes
    }

    /// The bytes of the next frame, whole or torn; `None` for a dropped frame.
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
            Fate::Whole => self.sent.whole += 1,
            Fate::Torn { lost } => {
                self.sent.torn += 1;
                frame.drain(lost);
            }
            Fate::Dropped => {
                self.sent.dropped += 1;
                return None;
            }
        }
        Some(frame)
    }

    /// A reading with the noise of the sensors and the load cell.
    fn measure(&mut self, values: &[f64], contact: Option<Contact>) -> (Vec<f64>, f64) {
        let reading = self.bench.measure(values);
        let noise_n = self.load_cell.as_mut().map_or(0.0, |(cell, rng)| {
            let noise: f64 = StandardNormal.sample(rng);
            cell.noise_n * noise
        });
        (reading, contact.map_or(0.0, |contact| contact.force_n) + noise_n)
    }

    /// The bytes of the reading in the units of the channels, to seven digits. With a load cell, its force is the last value, and lines of text have
    /// names, so readers of the channels alone can find them.
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
