//! A board without hardware: sensors under a surface that a finger touches, and the frames that firmware would send.

use crate::frame::Channel;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::{SimulateError, SimulatedBench};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_rig::Rig;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Write;
use std::time::Duration;

/// Configuration of a simulated board.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardConfig {
    /// Readings a second, greater than 0.
    pub rate_hz: f64,
    /// Seed of the sensors' faults and noise.
    pub seed: u64,
}

impl Default for BoardConfig {
    fn default() -> Self {
        Self { rate_hz: 100.0, seed: 0 }
    }
}

/// A simulated board: time in, bytes out.
pub struct SimulatedBoard<'a> {
    bench: SimulatedBench<'a>,
    channels: Vec<Channel>,
    finger: Finger,
    rate_hz: f64,
    /// Frames that were sent.
    count: u64,
}

impl<'a> SimulatedBoard<'a> {
    /// A board on the bench of a setup, touched by a finger.
    ///
    /// # Errors
    /// [`SimulateError`] for a surface without a model, or one whose equations are not solved.
    pub fn new(setup: &'a Setup, config: &BoardConfig, finger: Finger) -> Result<Self, SimulateError> {
        let bench = SimulatedBench::new(setup, config.seed)?;
        Ok(Self { bench, channels: Channel::all_of(setup), finger, rate_hz: config.rate_hz, count: 0 })
    }

    /// Time of the next frame since the start.
    pub fn next_at(&self) -> Duration {
        Duration::from_secs_f64(self.count as f64 / self.rate_hz)
    }

    /// The bytes of all frames that are due by `elapsed` since the start.
    pub fn send_until(&mut self, elapsed: Duration) -> Vec<u8> {
        let mut bytes = Vec::new();
        while self.next_at() <= elapsed {
            let contact = self.finger.contact_at(self.next_at().as_secs_f64());
            let clean = self.bench.clean(contact.as_slice());
            let reading = self.bench.measure(&clean);
            bytes.extend(self.line(&reading).into_bytes());
            self.count += 1;
        }
        bytes
    }

    /// A reading as a line of numbers in the units of the channels, to seven digits.
    fn line(&self, reading: &[f64]) -> String {
        let mut line = String::new();
        for (value, channel) in reading.iter().zip(&self.channels) {
            if !line.is_empty() {
                line.push(',');
            }
            // Writing into a string cannot fail.
            let _ = write!(line, "{}", (value / channel.unit.factor()) as f32);
        }
        line.push('\n');
        line
    }
}

/// A finger that touches, slides and lifts at random.
#[derive(Clone, Debug)]
pub struct Finger {
    rng: Xoshiro256PlusPlus,
    extent: Extent,
    force_n: Option<f64>,
    typical_n: f64,
    touch: Touch,
}

/// A touch: from a place to another.
#[derive(Clone, Copy, Debug)]
struct Touch {
    from: Position,
    to: Position,
    force_n: f64,
    start_s: f64,
    end_s: f64,
}

impl Finger {
    /// Time between touches, in seconds.
    const LIFTED_S: (f64, f64) = (0.8, 2.0);
    /// Length of a touch, in seconds.
    const TOUCH_S: (f64, f64) = (1.5, 5.0);
    /// Time in which the force comes and goes, in seconds.
    const PRESS_S: f64 = 0.1;
    /// Share of the side at either edge that is not touched.
    const MARGIN: f64 = 0.05;

    /// A finger on the surface of a rig, with the rig's force where that is known, else around that of its presses.
    pub fn random(rig: &Rig, seed: u64) -> Self {
        let typical_n = rig.training.as_ref().and_then(|training| training.force_n).unwrap_or(1.0);
        let nowhere = Position::default();
        let touch = Touch { from: nowhere, to: nowhere, force_n: 0.0, start_s: 0.0, end_s: 0.0 };
        let mut finger = Self {
            // A stream of its own, beside that of the noise.
            rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xF1_46E2),
            extent: rig.setup.surface().extent(),
            force_n: rig.setup.force_n(),
            typical_n,
            touch,
        };
        finger.touch = finger.next_touch(0.0);
        finger
    }

    /// The contact at a time in seconds, which never goes back; `None` while nothing touches.
    pub fn contact_at(&mut self, time_s: f64) -> Option<Contact> {
        while time_s >= self.touch.end_s {
            self.touch = self.next_touch(self.touch.end_s);
        }
        let Touch { from, to, force_n, start_s, end_s } = self.touch;
        if time_s < start_s {
            return None;
        }
        let share = smooth((time_s - start_s) / (end_s - start_s));
        let pressed = match self.force_n {
            // Of a surface whose force is known, nothing less presses.
            Some(_) => 1.0,
            None => smooth((time_s - start_s).min(end_s - time_s) / Self::PRESS_S),
        };
        let between = |from: f64, to: f64| from + share * (to - from);
        let position = Position { x_m: between(from.x_m, to.x_m), y_m: between(from.y_m, to.y_m) };
        Some(Contact { position, force_n: force_n * pressed.max(1e-3) })
    }

    fn next_touch(&mut self, after_s: f64) -> Touch {
        let start_s = after_s + self.between(Self::LIFTED_S);
        let end_s = start_s + self.between(Self::TOUCH_S);
        let force_n = match self.force_n {
            Some(force_n) => force_n,
            None => self.typical_n * self.between((0.5, 1.5)),
        };
        Touch { from: self.place(), to: self.place(), force_n, start_s, end_s }
    }

    fn place(&mut self) -> Position {
        let share = (Self::MARGIN, 1.0 - Self::MARGIN);
        let x_m = self.extent.length_m() * self.between(share);
        let y_m = self.extent.width_m().map_or(0.0, |width_m| width_m * self.between(share));
        Position { x_m, y_m }
    }

    fn between(&mut self, (low, high): (f64, f64)) -> f64 {
        self.rng.random_range(low..high)
    }
}

/// A rise from 0 to 1 without a kink.
fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
