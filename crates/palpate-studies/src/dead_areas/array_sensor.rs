//! An array sensor: sensors side by side, each of which responds to contacts near it only.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use palpate_estimators::evaluation::Split;
use palpate_estimators::recording::{Provenance, Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulateError;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelModel, Layout, Sensor, SensorKind};
use palpate_mechanics::surface::{Extent, SurfaceSpec};
use palpate_rig::{Rig, RigSimulationError};

/// Standard deviation of a point spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// In metres, whatever the pitch.
    Metres(f64),
    /// In pitches of the array.
    Pitches(f64),
}

/// A line of n sensors at (i + ½)·l/n. Sensor i reads exp(−(a − x_i)²/(2·s²)) of a contact at a, its response over itself being
/// 1, plus Gaussian noise; s is its point spread. It is a surface without a model: raw channels, known by recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct ArraySensor {
    rig: Rig,
    spread: Spread,
    spread_m: f64,
    noise_sd: f64,
    training: Vec<Position>,
    repeats: usize,
}

impl ArraySensor {
    /// An array as long as a rig's surface, pressed at the same training positions with the same force. Its noise has the
    /// same share of the full scale as that of the rig's first sensor.
    ///
    /// # Errors
    /// [`RigSimulationError`] for a rig without a model or training positions.
    pub fn like(rig: &Rig, count: usize, spread: Spread) -> Result<Self, RigSimulationError> {
        let model = rig.setup.surface.model().ok_or(SimulateError::NoModel)?;
        let force_n = rig.setup.force_n.ok_or(SimulateError::NoForce)?;
        let training = rig.training()?;
        let length_m = model.length_m();
        let share = |sensor: &Sensor| sensor.channel.noise_sd / (force_n * model.full_scale(sensor.kind));
        let noise_sd = rig.setup.layout.sensors().first().map_or(0.0, share);
        let pitch_m = length_m / count as f64;
        let sensor = |i: usize| Sensor {
            kind: SensorKind::Raw,
            position: Position::along((i as f64 + 0.5) * pitch_m),
            name: format!("raw_{}", i + 1),
            channel: ChannelModel { noise_sd, ..ChannelModel::default() },
        };
        let setup = Setup {
            surface: SurfaceSpec::Measured(Extent::Line { length_m }),
            layout: Layout::new((0..count).map(sensor).collect()).map_err(SimulateError::from)?,
            force_n: Some(force_n),
            columns: None,
        };
        let spread_m = match spread {
            Spread::Metres(spread_m) => spread_m,
            Spread::Pitches(pitches) => pitches * pitch_m,
        };
        let (positions, repeats) =
            (training.positions(setup.surface.extent()).map_err(SimulateError::from)?, training.repeats);
        let rig = Rig { setup, loads: Vec::new(), ..rig.clone() };
        Ok(Self { rig, spread, spread_m, noise_sd, training: positions, repeats })
    }

    /// Its bench, with the rig's training positions.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// "array, spread 10 mm", or "array, spread 0.5 pitch".
    pub fn name(&self) -> String {
        match self.spread {
            Spread::Metres(spread_m) => format!("array, spread {} mm", spread_m * 1e3),
            Spread::Pitches(pitches) => format!("array, spread {pitches} pitch"),
        }
    }

    /// Simulated calibrations, each judged by one press at each of 399 positions 1/400 of the length apart.
    pub fn trials(&self, count: u64, seed: u64) -> Vec<Split> {
        let length_m = self.rig.setup.surface.extent().length_m();
        let pressed: Vec<Position> =
            self.training.iter().flat_map(|at| std::iter::repeat_n(*at, self.repeats)).collect();
        let judged: Vec<Position> =
            (1..400).map(|i| Position::along(f64::from(i) / 400.0 * length_m)).collect();
        let trial = |k: u64| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_add(k));
            let training = self.recording(&pressed, seed, &mut rng);
            Split { training, judged: self.recording(&judged, seed, &mut rng) }
        };
        (0..count).map(trial).collect()
    }

    fn recording(&self, positions: &[Position], seed: u64, rng: &mut Xoshiro256PlusPlus) -> Recording {
        let layout = &self.rig.setup.layout;
        let row = |position: &Position| {
            let reading = layout.sensors().iter().map(|sensor| {
                let off = position.distance_m(sensor.position) / self.spread_m;
                (-0.5 * off * off).exp() + self.noise_sd * rng.sample::<f64, _>(StandardNormal)
            });
            Row {
                position: *position,
                force_n: self.rig.setup.force_n,
                nuisance: None,
                reading: reading.collect(),
            }
        };
        let rows: Vec<Row> = positions.iter().map(row).collect();
        let source = "simulation of an array sensor".to_owned();
        let provenance = Provenance { source, rows: rows.len(), digests: Vec::new(), seed: Some(seed) };
        Recording { channels: layout.names(), kinds: layout.kinds(), rows, provenance }
    }
}
