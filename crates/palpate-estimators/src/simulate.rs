//! Recordings made by the model of a surface instead of its bench.

mod moving;

use std::sync::Arc;

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::arrangement::{ArrangementError, Training};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use palpate_mechanics::contact::{Contact, OffSurface, Position};
use palpate_mechanics::sensing::{ChannelErrors, Layout, LayoutError, Sensor, measure};
use palpate_mechanics::surface::{Extent, ResponseFunction, Surface, UniformLoad, Unsolvable};
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::{Cancelled, Watch};

pub use moving::{MovingContact, MovingContacts, simulate_moving, simulate_moving_watched};

/// A rig that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// The surface has no model.
    #[error("a measured surface has no model to simulate; it needs a recording")]
    NoModel,
    /// The contact force is not given.
    #[error("a simulation needs the contact force; there is no [contact] force")]
    NoForce,
    /// The training positions cannot be laid out.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// A number of a sensor is not in its range.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// A force, or the speed of a moving contact, is not in its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The equations of the surface have no solution that is in balance.
    #[error("the equations of the surface could not be solved: {error}; {help}", error = .0, help = .0.help())]
    Surface(#[from] Unsolvable),
    /// A position does not lie on the surface.
    #[error(transparent)]
    OffSurface(#[from] OffSurface),
    /// Whoever watched the work stopped it.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Stage of the work, for the watch.
const STAGE: &str = "simulating";
/// Readings between two looks whether to go on.
const READINGS_EACH: usize = 256;

/// The sensors of a layout under a surface with a model, each with its response function.
pub struct CleanSensors<'a> {
    functions: Vec<Arc<dyn ResponseFunction + 'a>>,
}

impl<'a> CleanSensors<'a> {
    /// The response functions of all sensors of `layout`.
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Self {
        let function = |sensor: &Sensor| surface.response_function(sensor.kind, sensor.position);
        Self { functions: layout.sensors().iter().map(function).collect() }
    }

    /// The same, watched while the surface is solved.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch stopped it.
    pub fn new_watched(surface: &'a dyn Surface, layout: &Layout, watch: Watch) -> Result<Self, Cancelled> {
        // One by one, as without a watch: solved together they might differ in the last bit.
        let function =
            |sensor: &Sensor| surface.response_functions_watched(sensor.kind, &[sensor.position], watch);
        let functions = layout.sensors().iter().map(function).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { functions: functions.into_iter().flatten().collect() })
    }

    /// Faultless reading of the sensors at `contact`, in the SI unit of each sensor.
    pub fn reading(&self, contact: Contact) -> Vec<f64> {
        self.functions.iter().map(|function| function.at(contact)).collect()
    }
}

/// Faultless reading of the sensors of `layout` when `contact` touches `surface`; for more than one contact
/// of the same surface see [`CleanSensors`].
pub fn clean_reading(surface: &dyn Surface, layout: &Layout, contact: Contact) -> Vec<f64> {
    CleanSensors::new(surface, layout).reading(contact)
}

/// A simulated bench that is read again and again: gains, offsets and places of its sensors are drawn once, noise for each reading.
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
    layout: &'a Layout,
    sensors: CleanSensors<'a>,
    errors: ChannelErrors,
    rng: Xoshiro256PlusPlus,
}

impl<'a> SimulatedBench<'a> {
    /// The bench of a setup as a seed has it.
    ///
    /// # Errors
    /// [`SimulateError::NoModel`] for a measured surface, [`SimulateError::Surface`] where the surface's equations are not solved.
    pub fn new(setup: &'a Setup, seed: u64) -> Result<Self, SimulateError> {
        Self::new_watched(setup, seed, Watch::NONE)
    }

    /// The same, watched while the surface is solved.
    ///
    /// # Errors
    /// Those of [`SimulatedBench::new`], and [`SimulateError::Cancelled`].
    pub fn new_watched(setup: &'a Setup, seed: u64, watch: Watch) -> Result<Self, SimulateError> {
        let surface = setup.surface().model().ok_or(SimulateError::NoModel)?;
        surface.check_solution_watched(watch)?;
        let (placed, errors, rng) = draw_faults(setup, seed);
        let sensors = CleanSensors::new_watched(surface, &placed, watch)?;
        Ok(Self { layout: setup.layout(), sensors, errors, rng })
    }

    /// Faultless reading under contacts on the surface, in the SI unit of each sensor: the sum of what each contact alone makes, and 0 under none.
    pub fn clean(&self, contacts: &[Contact]) -> Vec<f64> {
        let mut sum = vec![0.0; self.layout.len()];
        for contact in contacts {
            let reading = self.sensors.reading(*contact);
            sum.iter_mut().zip(reading).for_each(|(sum, value)| *sum += value);
        }
        sum
    }

    /// A reading of the faulty channels, with fresh noise, of what faultless ones read.
    pub fn measure(&mut self, clean: &[f64]) -> Vec<f64> {
        measure(self.layout, clean, &self.errors, &mut self.rng)
    }
}

impl Setup {
    /// The bench as it is when pressed to calibrate: with the force of these presses.
    ///
    /// # Errors
    /// [`OutOfRange`] for a force of the presses that is not greater than 0 and finite.
    pub fn pressed_by(&self, training: &Training) -> Result<Self, OutOfRange> {
        self.clone().with_force(training.force_n.or(self.force_n()))
    }

    /// Presses the simulated surface at the training positions, with the force of the training presses, and records what its
    /// faulty channels report; see [`simulate_at`].
    ///
    /// # Errors
    /// [`SimulateError`] when the bench lacks a model or a force, or the positions cannot be laid out.
    pub fn simulate(&self, training: &Training, seed: u64) -> Result<Recording, SimulateError> {
        self.simulate_watched(training, seed, Watch::NONE)
    }

    /// The same, watched.
    ///
    /// # Errors
    /// Those of [`Setup::simulate`], and [`SimulateError::Cancelled`].
    pub fn simulate_watched(
        &self,
        training: &Training,
        seed: u64,
        watch: Watch,
    ) -> Result<Recording, SimulateError> {
        let positions = training.positions(self.surface().extent())?;
        simulate_at_watched(&self.pressed_by(training)?, &positions, training.repeats, seed, watch)
    }
}

/// Presses the bench's simulated surface with its force at each of `positions`, `repeats` times in a row, and records what its
/// faulty channels report. Gains, offsets and the places of sensors are drawn once for the recording, noise for each reading.
///
/// The same seed gives the same recording.
///
/// # Errors
/// [`SimulateError`] when the bench lacks a model or a force, or a position lies off the surface.
pub fn simulate_at(
    setup: &Setup,
    positions: &[Position],
    repeats: usize,
    seed: u64,
) -> Result<Recording, SimulateError> {
    simulate_at_watched(setup, positions, repeats, seed, Watch::NONE)
}

/// The same, watched.
///
/// # Errors
/// Those of [`simulate_at`], and [`SimulateError::Cancelled`].
pub fn simulate_at_watched(
    setup: &Setup,
    positions: &[Position],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    setup.surface().model().ok_or(SimulateError::NoModel)?;
    let force_n = setup.force_n().ok_or(SimulateError::NoForce)?;
    let contacts: Vec<Contact> =
        positions.iter().map(|position| Contact { position: *position, force_n }).collect();
    simulate_contacts_watched(setup, &contacts, repeats, seed, watch)
}

/// The same with a force of each contact's own.
///
/// # Errors
/// [`SimulateError`] when the bench lacks a model, or a contact lies off the surface.
pub fn simulate_contacts(
    setup: &Setup,
    contacts: &[Contact],
    repeats: usize,
    seed: u64,
) -> Result<Recording, SimulateError> {
    simulate_contacts_watched(setup, contacts, repeats, seed, Watch::NONE)
}

/// The same, watched.
///
/// # Errors
/// Those of [`simulate_contacts`], and [`SimulateError::Cancelled`].
pub fn simulate_contacts_watched(
    setup: &Setup,
    contacts: &[Contact],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    let positions: Vec<Position> = contacts.iter().map(|contact| contact.position).collect();
    let mut bench = SimulatedBench::new_watched(setup, seed, watch)?;
    OffSurface::check("position", &positions, setup.surface().extent())?;
    let mut rows = Vec::new();
    for contact @ Contact { position, force_n } in contacts.iter().copied() {
        let clean = bench.clean(&[contact]);
        for _ in 0..repeats {
            if rows.len().is_multiple_of(READINGS_EACH) {
                watch.counted(STAGE, "readings", rows.len(), contacts.len().saturating_mul(repeats))?;
            }
            let reading = bench.measure(&clean);
            rows.push(Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading });
        }
    }
    Ok(Recording::new(setup.layout(), "simulation", rows).seeded(seed))
}

/// Spreads `loads` over the bench's simulated surface, all at once, `repeats` times in a row, and gives what its faulty channels
/// report. Gains, offsets and the places of sensors are drawn once, noise for each reading.
///
/// The same seed gives the same readings.
///
/// # Errors
/// [`SimulateError::NoModel`] for a measured surface.
pub fn simulate_loads(
    setup: &Setup,
    loads: &[UniformLoad],
    repeats: usize,
    seed: u64,
) -> Result<Vec<Vec<f64>>, SimulateError> {
    simulate_loads_watched(setup, loads, repeats, seed, Watch::NONE)
}

/// The same, watched.
///
/// # Errors
/// Those of [`simulate_loads`], and [`SimulateError::Cancelled`].
pub fn simulate_loads_watched(
    setup: &Setup,
    loads: &[UniformLoad],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Vec<Vec<f64>>, SimulateError> {
    let surface = setup.surface().model().ok_or(SimulateError::NoModel)?;
    surface.check_solution_watched(watch)?;
    let (placed, errors, mut rng) = draw_faults(setup, seed);
    // By superposition.
    let mut clean = Vec::with_capacity(placed.len());
    for sensor in placed.sensors() {
        for function in surface.influence_functions_watched(sensor.kind, &[sensor.position], watch)? {
            clean.push(loads.iter().map(|load| load.force_n() * load.mean(&*function)).sum());
        }
    }
    let mut readings = Vec::new();
    for i in 0..repeats {
        if i.is_multiple_of(READINGS_EACH) {
            watch.counted(STAGE, "readings", i, repeats)?;
        }
        readings.push(measure(setup.layout(), &clean, &errors, &mut rng));
    }
    Ok(readings)
}

/// The places of the sensors, the gains and offsets of the channels, and the stream of their noise.
fn draw_faults(setup: &Setup, seed: u64) -> (Layout, ChannelErrors, Xoshiro256PlusPlus) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    // Places have a stream of their own, so that the noise is the same whether or not sensors are displaced.
    let mut places = rng.clone();
    places.jump();
    let placed = displaced(setup.layout(), setup.surface().extent(), &mut places);
    let errors = ChannelErrors::draw(setup.layout(), &mut rng);
    (placed, errors, rng)
}

/// The layout as one simulated bench happens to have it: every sensor within its position error of its place, held at the
/// surface's edge. A perfectly placed sensor stays where it is.
pub(crate) fn displaced(layout: &Layout, extent: Extent, rng: &mut impl Rng) -> Layout {
    layout.clone().with_positions(|sensor| {
        let error_m = sensor.channel.position_error_m;
        let mut beside =
            |at_m: f64, size_m: f64| (at_m + error_m * rng.random_range(-1.0..=1.0)).clamp(0.0, size_m);
        if error_m > 0.0 {
            let Position { x_m, y_m } = sensor.position;
            let y_m = extent.width_m().map_or(y_m, |width_m| beside(y_m, width_m));
            Position { x_m: beside(x_m, extent.length_m()), y_m }
        } else {
            sensor.position
        }
    })
}

#[cfg(test)]
mod tests;
