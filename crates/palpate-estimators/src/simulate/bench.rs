//! Simulated bench with faults and imperfections.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::faulty_channels::FaultyChannels;
use super::{CleanSensors, SimulateError};
use crate::imperfections::{BenchState, ImperfectChannels, Imperfections, StandardNoise, distribute_contact};
use crate::setup::Setup;
use palpate_mechanics::contact::{Contact, Extent, Position};
use palpate_numerics::watch::Watch;

/// Simulated bench: faults are drawn once, noise for each reading.
///
/// ```
/// use palpate_estimators::{setup::Setup, simulate::SimulatedBench};
/// use palpate_mechanics::contact::{Contact, Position};
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::Beam;
/// use palpate_mechanics::units::{gpa, mm, um};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
/// let mut bench = SimulatedBench::new(&setup, 0)?;
/// let clean = bench.clean(&[Contact { position: Position::along(mm(180.0)), force_n: 3.0 }]);
/// let (first, second) = (bench.measure(&clean), bench.measure(&clean));
/// assert!(first != second && (first[3] - clean[3]).abs() < um(30.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SimulatedBench<'a> {
    extent: Extent,
    sensors: CleanSensors<'a>,
    channels: FaultyChannels,
    range_force_n: f64,
    seed: u64,
}

const RANGE_POSITIONS: u32 = 20;

impl<'a> SimulatedBench<'a> {
    /// Draws the bench of a setup.
    ///
    /// # Errors
    /// [`SimulateError`] without a model or a solution, or for imperfections without a force.
    pub fn new(setup: &'a Setup, seed: u64) -> Result<Self, SimulateError> {
        Self::new_watched(setup, seed, Watch::NONE)
    }

    /// [`SimulatedBench::new`], watched.
    ///
    /// # Errors
    /// As there, and [`SimulateError::Cancelled`].
    pub fn new_watched(setup: &'a Setup, seed: u64, watch: Watch) -> Result<Self, SimulateError> {
        let bench = Self::perfect_watched(setup, seed, watch)?;
        let Some(imperfections) = setup.imperfections() else { return Ok(bench) };
        let force_n = imperfections.range_force_n.or(setup.force_n()).ok_or(SimulateError::NoForce)?;
        Ok(bench.with_imperfections(*imperfections, force_n))
    }

    /// [`SimulatedBench::new_watched`], without imperfections.
    ///
    /// # Errors
    /// As there, except for the force.
    pub fn perfect_watched(setup: &'a Setup, seed: u64, watch: Watch) -> Result<Self, SimulateError> {
        let surface = setup.surface().model().ok_or(SimulateError::NoModel)?;
        surface.check_solution_watched(watch)?;
        let (placed, channels) = FaultyChannels::draw(setup, seed);
        let sensors = CleanSensors::new_watched(surface, &placed, watch)?;
        Ok(Self { extent: setup.surface().extent(), sensors, channels, range_force_n: 0.0, seed })
    }

    /// Sets the imperfections, at rest. Channel ranges are for their force, or else for `range_force_n`.
    #[must_use]
    pub fn with_imperfections(mut self, imperfections: Imperfections, range_force_n: f64) -> Self {
        let untouched = self.clean(&[]);
        self.range_force_n = imperfections.range_force_n.unwrap_or(range_force_n);
        let ranges = self.ranges(&untouched, self.range_force_n);
        self.channels.noise = StandardNoise::new(Some(&imperfections));
        self.channels.imperfect = Some(ImperfectChannels::new(imperfections, &untouched, &ranges, self.seed));
        self
    }

    /// Sets the resolution of every channel.
    ///
    /// # Errors
    /// [`SimulateError::Layout`] for an invalid step.
    pub fn with_resolution(mut self, step: f64) -> Result<Self, SimulateError> {
        let layout = &mut self.channels.layout;
        layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.resolution = step))?;
        Ok(self)
    }

    /// Continues from an earlier state, with new noise and walks.
    #[must_use]
    pub fn resumed(mut self, state: &BenchState, seed: u64) -> Self {
        // A stream that differs from the initial one of any bench of this seed.
        self.channels.rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        self.channels.rng.long_jump();
        self.channels.imperfect = self.channels.imperfect.map(|channels| channels.resumed(state));
        self
    }

    /// Returns the faultless reading, the sum over the contacts.
    pub fn clean(&self, contacts: &[Contact]) -> Vec<f64> {
        let mut sum = vec![0.0; self.channels.layout.len()];
        for contact in contacts {
            let reading = self.sensors.reading(*contact);
            sum.iter_mut().zip(reading).for_each(|(sum, value)| *sum += value);
        }
        sum
    }

    /// Returns the faultless reading under the soft layer.
    pub fn clean_through_layer(&self, contacts: &[Contact]) -> Vec<f64> {
        let width_m = self.imperfections().map_or(0.0, |imperfections| imperfections.touch_width_m);
        let points = contacts.iter().flat_map(|contact| distribute_contact(*contact, width_m, self.extent));
        self.clean(&points.collect::<Vec<_>>())
    }

    /// Advances time under constant contacts, and returns the reading without noise.
    pub fn advance(&mut self, clean: &[f64], step_s: f64) -> Vec<f64> {
        self.channels.advance(clean, step_s)
    }

    /// Returns a reading with fresh noise.
    pub fn measure(&mut self, clean: &[f64]) -> Vec<f64> {
        self.channels.measure(clean)
    }

    /// Channel ranges are for the stated force, or else for `force_n`.
    pub(super) fn channels_watched(
        setup: &'a Setup,
        force_n: f64,
        seed: u64,
        watch: Watch,
    ) -> Result<FaultyChannels, SimulateError> {
        let Some(imperfections) = setup.imperfections() else {
            return Ok(FaultyChannels::draw(setup, seed).1);
        };
        Ok(Self::perfect_watched(setup, seed, watch)?.with_imperfections(*imperfections, force_n).channels)
    }

    fn imperfections(&self) -> Option<&Imperfections> {
        self.channels.imperfect.as_ref().map(ImperfectChannels::imperfections)
    }

    /// Time since the start.
    pub fn time_s(&self) -> Option<f64> {
        self.channels.imperfect.as_ref().map(ImperfectChannels::time_s)
    }

    /// State for [`SimulatedBench::resumed`].
    pub fn state(&self) -> Option<BenchState> {
        let channels = self.channels.imperfect.as_ref()?;
        Some(BenchState {
            seed: self.seed,
            range_force_n: self.range_force_n,
            time_s: channels.time_s(),
            channels: channels.states().to_vec(),
        })
    }

    fn ranges(&self, untouched: &[f64], force_n: f64) -> Vec<f64> {
        let along = |side_m: f64| {
            (1..RANGE_POSITIONS).map(move |i| side_m * f64::from(i) / f64::from(RANGE_POSITIONS))
        };
        let across: Vec<f64> =
            self.extent.width_m().map_or_else(|| vec![0.0], |width_m| along(width_m).collect());
        let mut ranges = vec![0.0_f64; untouched.len()];
        for x_m in along(self.extent.length_m()) {
            for y_m in &across {
                let contact = Contact { position: Position { x_m, y_m: *y_m }, force_n };
                let reading = self.clean(&[contact]);
                for ((range, value), untouched) in ranges.iter_mut().zip(reading).zip(untouched) {
                    *range = range.max((value - untouched).abs());
                }
            }
        }
        ranges
    }
}
