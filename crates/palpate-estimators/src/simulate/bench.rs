//! A simulated bench: sensors under a surface, their faults, and imperfections in the course of time.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::faulty_channels::FaultyChannels;
use super::{CleanSensors, SimulateError};
use crate::imperfections::{BenchState, ImperfectChannels, Imperfections, StandardNoise, spread_contact};
use crate::setup::Setup;
use palpate_mechanics::contact::{Contact, Extent, Position};
use palpate_numerics::watch::Watch;

/// A simulated bench for repeated readings: gains, offsets and places of its sensors are drawn once, noise for each reading.
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

/// Positions along each side at which the range of a channel is searched.
const RANGE_POSITIONS: u32 = 20;

impl<'a> SimulatedBench<'a> {
    /// The bench of a setup as drawn by a seed, with the imperfections of the setup.
    ///
    /// # Errors
    /// [`SimulateError::NoModel`] for a measured surface, [`SimulateError::Surface`] where the surface's equations are not solved,
    /// [`SimulateError::NoForce`] for imperfections without a force for the channels' ranges.
    pub fn new(setup: &'a Setup, seed: u64) -> Result<Self, SimulateError> {
        Self::new_watched(setup, seed, Watch::NONE)
    }

    /// The bench of a setup as drawn by a seed, with the imperfections of the setup, watched while the surface is solved.
    ///
    /// # Errors
    /// As for [`SimulatedBench::new`], and [`SimulateError::Cancelled`].
    pub fn new_watched(setup: &'a Setup, seed: u64, watch: Watch) -> Result<Self, SimulateError> {
        let bench = Self::perfect_watched(setup, seed, watch)?;
        let Some(imperfections) = setup.imperfections() else { return Ok(bench) };
        let force_n = imperfections.range_force_n.or(setup.force_n()).ok_or(SimulateError::NoForce)?;
        Ok(bench.with_imperfections(*imperfections, force_n))
    }

    /// The bench with only the faults of its channels, without the imperfections of the setup.
    ///
    /// # Errors
    /// As for [`SimulatedBench::new_watched`], except for the force.
    pub fn perfect_watched(setup: &'a Setup, seed: u64, watch: Watch) -> Result<Self, SimulateError> {
        let surface = setup.surface().model().ok_or(SimulateError::NoModel)?;
        surface.check_solution_watched(watch)?;
        let (placed, channels) = FaultyChannels::draw(setup, seed);
        let sensors = CleanSensors::new_watched(surface, &placed, watch)?;
        Ok(Self { extent: setup.surface().extent(), sensors, channels, range_force_n: 0.0, seed })
    }

    /// This bench with these imperfections, at rest at time 0. Ranges of channels are for their force, or else for `range_force_n`, in newtons.
    #[must_use]
    pub fn with_imperfections(mut self, imperfections: Imperfections, range_force_n: f64) -> Self {
        let untouched = self.clean(&[]);
        self.range_force_n = imperfections.range_force_n.unwrap_or(range_force_n);
        let ranges = self.ranges(&untouched, self.range_force_n);
        self.channels.noise = StandardNoise::new(Some(&imperfections));
        self.channels.imperfect = Some(ImperfectChannels::new(imperfections, &untouched, &ranges, self.seed));
        self
    }

    /// This bench with another step of every channel's converter, in its SI unit.
    ///
    /// # Errors
    /// [`SimulateError::Layout`] for a step that is less than 0 or not finite.
    pub fn with_resolution(mut self, step: f64) -> Result<Self, SimulateError> {
        let layout = &mut self.channels.layout;
        layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.resolution = step))?;
        Ok(self)
    }

    /// This bench in the final state of an earlier recording; the seed draws noise and random walks from there on.
    #[must_use]
    pub fn resumed(mut self, state: &BenchState, seed: u64) -> Self {
        // A stream different from the initial one of any bench with this seed.
        self.channels.rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        self.channels.rng.long_jump();
        self.channels.imperfect = self.channels.imperfect.map(|channels| channels.resumed(state));
        self
    }

    /// Faultless reading under contacts on the surface, in the SI unit of each sensor: the sum over the contacts, and 0 without any.
    pub fn clean(&self, contacts: &[Contact]) -> Vec<f64> {
        let mut sum = vec![0.0; self.channels.layout.len()];
        for contact in contacts {
            let reading = self.sensors.reading(*contact);
            sum.iter_mut().zip(reading).for_each(|(sum, value)| *sum += value);
        }
        sum
    }

    /// Faultless reading under contacts, each spread by the soft layer where the bench has one.
    pub fn clean_through_layer(&self, contacts: &[Contact]) -> Vec<f64> {
        let width_m = self.imperfections().map_or(0.0, |imperfections| imperfections.touch_width_m);
        let points = contacts.iter().flat_map(|contact| spread_contact(*contact, width_m, self.extent));
        self.clean(&points.collect::<Vec<_>>())
    }

    /// Advances time by a step under constant contacts with the faultless reading `clean`. Returns the reading at the end of the step with the
    /// imperfections, without noise.
    pub fn advance(&mut self, clean: &[f64], step_s: f64) -> Vec<f64> {
        self.channels.advance(clean, step_s)
    }

    /// A reading of the faulty channels for the faultless reading `clean`, with fresh noise.
    pub fn measure(&mut self, clean: &[f64]) -> Vec<f64> {
        self.channels.measure(clean)
    }

    /// The channels of a bench, with the imperfections of the setup; ranges are for their force, or else for `force_n`, in newtons.
    ///
    /// # Errors
    /// As for [`SimulatedBench::perfect_watched`] where the setup has imperfections.
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

    /// Time since the start in seconds, where the bench has imperfections.
    pub fn time_s(&self) -> Option<f64> {
        self.channels.imperfect.as_ref().map(ImperfectChannels::time_s)
    }

    /// State of the imperfections, for [`SimulatedBench::resumed`]; `None` without imperfections.
    pub fn state(&self) -> Option<BenchState> {
        let channels = self.channels.imperfect.as_ref()?;
        Some(BenchState {
            seed: self.seed,
            range_force_n: self.range_force_n,
            time_s: channels.time_s(),
            channels: channels.states().to_vec(),
        })
    }

    /// Largest deviation of each channel from its untouched reading, under a force on a grid of positions.
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
