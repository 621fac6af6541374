//! Recordings simulated by the model of a surface.

mod bench;
mod faulty_channels;
mod moving;
mod presses;

use std::sync::Arc;

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::arrangement::{ArrangementError, Training};
use crate::imperfections::Schedule;
use crate::recording::{NoUntouchedRow, Provenance, Recording, Row};
use crate::setup::Setup;
use palpate_mechanics::contact::{Contact, OffSurface, Position};
use palpate_mechanics::sensing::{ChannelErrors, Layout, LayoutError, Sensor};
use palpate_mechanics::surface::{Extent, ResponseFunction, Surface, UniformLoad, Unsolvable};
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::{Cancelled, Watch};

pub use bench::SimulatedBench;
pub use moving::{MovingContact, MovingContacts, simulate_moving, simulate_moving_watched};
pub(crate) use presses::{Press, PressedBench};

/// Error of a simulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// Surface without a model.
    #[error("a measured surface has no model to simulate; it needs a recording")]
    NoModel,
    /// Unknown contact force.
    #[error("a simulation needs the contact force; `force` in [contact] is missing")]
    NoForce,
    /// Invalid training positions.
    #[error(transparent)]
    Arrangement(#[from] ArrangementError),
    /// Sensor number out of range.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// Force or speed out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// Surface equations without a solution.
    #[error("the equations of the surface could not be solved: {error}; {help}", error = .0, help = .0.help())]
    Surface(#[from] Unsolvable),
    /// Position off the surface.
    #[error(transparent)]
    OffSurface(#[from] OffSurface),
    /// Zero without untouched rows.
    #[error("`zero = \"last\"` needs untouched rows, and only a bench with [imperfections] simulates them")]
    NoUntouchedRow(#[from] NoUntouchedRow),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

const STAGE: &str = "simulating";
const READINGS_EACH: usize = 256;

/// Response functions of sensors.
pub struct CleanSensors<'a> {
    functions: Vec<Arc<dyn ResponseFunction + 'a>>,
}

impl<'a> CleanSensors<'a> {
    /// Returns the response functions of a layout.
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Self {
        let function = |sensor: &Sensor| surface.response_function(sensor.kind, sensor.position);
        Self { functions: layout.sensors().iter().map(function).collect() }
    }

    /// [`CleanSensors::new`], watched.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn new_watched(surface: &'a dyn Surface, layout: &Layout, watch: Watch) -> Result<Self, Cancelled> {
        // One by one, as without a watch: a joint solution might differ in the last bit.
        let function =
            |sensor: &Sensor| surface.response_functions_watched(sensor.kind, &[sensor.position], watch);
        let functions = layout.sensors().iter().map(function).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { functions: functions.into_iter().flatten().collect() })
    }

    /// Returns the faultless reading, in SI units.
    pub fn reading(&self, contact: Contact) -> Vec<f64> {
        self.functions.iter().map(|function| function.at(contact)).collect()
    }
}

/// Returns the faultless reading of one contact; see [`CleanSensors`].
pub fn clean_reading(surface: &dyn Surface, layout: &Layout, contact: Contact) -> Vec<f64> {
    CleanSensors::new(surface, layout).reading(contact)
}

impl Setup {
    /// Returns the setup with the force of the presses.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn with_training_force(&self, training: &Training) -> Result<Self, OutOfRange> {
        self.clone().with_force(training.force_n.or(self.force_n()))
    }

    /// Simulates training presses; see [`simulate_at`]. With imperfections they are displaced by the
    /// training's placement.
    ///
    /// # Errors
    /// [`SimulateError`] without a model or a force, or for invalid positions.
    pub fn simulate(&self, training: &Training, seed: u64) -> Result<Recording, SimulateError> {
        self.simulate_watched(training, seed, Watch::NONE)
    }

    /// [`Setup::simulate`], watched.
    ///
    /// # Errors
    /// As there, and [`SimulateError::Cancelled`].
    pub fn simulate_watched(
        &self,
        training: &Training,
        seed: u64,
        watch: Watch,
    ) -> Result<Recording, SimulateError> {
        let positions = training.positions(self.surface().extent())?;
        let pressed = self.with_training_force(training)?;
        let contacts = contacts_at(&pressed, &positions)?;
        simulate_presses_watched(&pressed, &contacts, training.repeats, training.placement_sd_m, seed, watch)
    }
}

/// Simulates `repeats` presses at each position. Gains, offsets and sensor positions are drawn once, noise
/// for each reading; a seed determines the recording.
///
/// With imperfections these are readings of one press, with times, and untouched rows (force 0) separate
/// presses; see [`Schedule`].
///
/// # Errors
/// [`SimulateError`] without a model or a force, or off the surface.
pub fn simulate_at(
    setup: &Setup,
    positions: &[Position],
    repeats: usize,
    seed: u64,
) -> Result<Recording, SimulateError> {
    simulate_at_watched(setup, positions, repeats, seed, Watch::NONE)
}

/// [`simulate_at`], watched.
///
/// # Errors
/// As there, and [`SimulateError::Cancelled`].
pub fn simulate_at_watched(
    setup: &Setup,
    positions: &[Position],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    simulate_contacts_watched(setup, &contacts_at(setup, positions)?, repeats, seed, watch)
}

/// Returns contacts with the setup's force.
///
/// # Errors
/// [`SimulateError::NoModel`] and [`SimulateError::NoForce`].
pub fn contacts_at(setup: &Setup, positions: &[Position]) -> Result<Vec<Contact>, SimulateError> {
    setup.surface().model().ok_or(SimulateError::NoModel)?;
    let force_n = setup.force_n().ok_or(SimulateError::NoForce)?;
    Ok(positions.iter().map(|position| Contact { position: *position, force_n }).collect())
}

/// Simulates contacts in use, watched. A bench with imperfections continues from its calibration after the
/// scheduled pause; another is new.
///
/// # Errors
/// As for [`simulate_contacts_watched`].
pub fn simulate_use_watched(
    setup: &Setup,
    calibration: &Provenance,
    contacts: &[Contact],
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    let (Some(_), Some(state)) = (setup.imperfections(), &calibration.bench) else {
        return simulate_contacts_watched(setup, contacts, 1, seed, watch);
    };
    let positions: Vec<Position> = contacts.iter().map(|contact| contact.position).collect();
    OffSurface::check("position", &positions, setup.surface().extent())?;
    let presses: Vec<Press> = contacts.iter().map(|contact| Press { contact: *contact, rows: 1 }).collect();
    let mut bench = PressedBench::resumed(setup, state, seed, watch)?;
    bench.pause();
    bench.record(&presses, None, watch)
}

/// [`simulate_at`], with each contact's own force.
///
/// # Errors
/// [`SimulateError`] without a model, or off the surface.
pub fn simulate_contacts(
    setup: &Setup,
    contacts: &[Contact],
    repeats: usize,
    seed: u64,
) -> Result<Recording, SimulateError> {
    simulate_contacts_watched(setup, contacts, repeats, seed, Watch::NONE)
}

/// [`simulate_contacts`], watched.
///
/// # Errors
/// As there, and [`SimulateError::Cancelled`].
pub fn simulate_contacts_watched(
    setup: &Setup,
    contacts: &[Contact],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    simulate_presses_watched(setup, contacts, repeats, None, seed, watch)
}

/// [`simulate_contacts`], watched; with imperfections displaced by `placement_sd_m`.
///
/// # Errors
/// As for [`simulate_contacts_watched`].
pub fn simulate_presses_watched(
    setup: &Setup,
    contacts: &[Contact],
    repeats: usize,
    placement_sd_m: Option<f64>,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    let positions: Vec<Position> = contacts.iter().map(|contact| contact.position).collect();
    if setup.imperfections().is_some() {
        OffSurface::check("position", &positions, setup.surface().extent())?;
        let presses: Vec<Press> =
            contacts.iter().map(|contact| Press { contact: *contact, rows: repeats }).collect();
        return PressedBench::new(setup, &presses, seed, watch)?.record(&presses, placement_sd_m, watch);
    }
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

/// Simulates readings of all `loads` at once, drawn as in [`simulate_at`], without a soft layer.
///
/// # Errors
/// [`SimulateError::NoModel`].
pub fn simulate_loads(
    setup: &Setup,
    loads: &[UniformLoad],
    repeats: usize,
    seed: u64,
) -> Result<Vec<Vec<f64>>, SimulateError> {
    simulate_loads_watched(setup, loads, repeats, seed, Watch::NONE)
}

/// [`simulate_loads`], watched.
///
/// # Errors
/// As there, and [`SimulateError::Cancelled`].
pub fn simulate_loads_watched(
    setup: &Setup,
    loads: &[UniformLoad],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Vec<Vec<f64>>, SimulateError> {
    let surface = setup.surface().model().ok_or(SimulateError::NoModel)?;
    surface.check_solution_watched(watch)?;
    let (placed, ..) = draw_faults(setup, seed);
    // By superposition.
    let mut clean = Vec::with_capacity(placed.len());
    for sensor in placed.sensors() {
        for function in surface.influence_functions_watched(sensor.kind, &[sensor.position], watch)? {
            clean.push(loads.iter().map(|load| load.force_n() * load.mean(&*function)).sum());
        }
    }
    let largest_n = loads.iter().map(|load| load.force_n().abs()).fold(0.0, f64::max);
    let force_n = setup.force_n().unwrap_or(largest_n);
    let mut channels = SimulatedBench::channels_watched(setup, force_n, seed, watch)?;
    let schedule =
        setup.imperfections().map_or_else(Schedule::default, |imperfections| imperfections.schedule);
    let mut readings = Vec::new();
    for i in 0..repeats {
        if i.is_multiple_of(READINGS_EACH) {
            watch.counted(STAGE, "readings", i, repeats)?;
        }
        let values = channels.advance(&clean, if i == 0 { schedule.settle_s } else { schedule.row_s() });
        readings.push(channels.measure(&values));
    }
    Ok(readings)
}

fn draw_faults(setup: &Setup, seed: u64) -> (Layout, ChannelErrors, Xoshiro256PlusPlus) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    // Positions have their own random stream, so the noise does not depend on displaced sensors.
    let mut places = rng.clone();
    places.jump();
    let placed = displaced(setup.layout(), setup.surface().extent(), &mut places);
    let errors = ChannelErrors::draw(setup.layout(), &mut rng);
    (placed, errors, rng)
}

/// Sensors within their position errors, clamped to the surface.
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
