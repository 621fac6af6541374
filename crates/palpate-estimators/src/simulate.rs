//! Recordings simulated with the model of a surface.

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

/// A rig that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// The surface has no model.
    #[error("a measured surface has no model to simulate; it needs a recording")]
    NoModel,
    /// The contact force is not given.
    #[error("a simulation needs the contact force; `force` in [contact] is missing")]
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
    /// The equations of the surface have no solution in balance.
    #[error("the equations of the surface could not be solved: {error}; {help}", error = .0, help = .0.help())]
    Surface(#[from] Unsolvable),
    /// A position does not lie on the surface.
    #[error(transparent)]
    OffSurface(#[from] OffSurface),
    /// The zero of the readings needs untouched rows.
    #[error("`zero = \"last\"` needs untouched rows, and only a bench with [imperfections] simulates them")]
    NoUntouchedRow(#[from] NoUntouchedRow),
    /// The watch stopped the work.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Stage of the work, for the watch.
const STAGE: &str = "simulating";
/// Readings between two checks of the watch.
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

    /// The response functions of all sensors of `layout`, watched while the surface is solved.
    ///
    /// # Errors
    /// [`Cancelled`] when the watch stopped it.
    pub fn new_watched(surface: &'a dyn Surface, layout: &Layout, watch: Watch) -> Result<Self, Cancelled> {
        // One by one, as without a watch: a joint solution might differ in the last bit.
        let function =
            |sensor: &Sensor| surface.response_functions_watched(sensor.kind, &[sensor.position], watch);
        let functions = layout.sensors().iter().map(function).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { functions: functions.into_iter().flatten().collect() })
    }

    /// Faultless reading of the sensors under `contact`, in the SI unit of each sensor.
    pub fn reading(&self, contact: Contact) -> Vec<f64> {
        self.functions.iter().map(|function| function.at(contact)).collect()
    }
}

/// Faultless reading of the sensors of `layout` when `contact` touches `surface`; for more than one contact
/// of the same surface see [`CleanSensors`].
pub fn clean_reading(surface: &dyn Surface, layout: &Layout, contact: Contact) -> Vec<f64> {
    CleanSensors::new(surface, layout).reading(contact)
}

impl Setup {
    /// The bench during calibration: with the force of the training presses.
    ///
    /// # Errors
    /// [`OutOfRange`] for a force of the presses that is not greater than 0 and finite.
    pub fn pressed_by(&self, training: &Training) -> Result<Self, OutOfRange> {
        self.clone().with_force(training.force_n.or(self.force_n()))
    }

    /// Presses the simulated surface at the training positions, with the force of the training presses, and records what its
    /// faulty channels report; see [`simulate_at`]. With imperfections the presses are displaced from the positions of their rows by the placement of
    /// the training.
    ///
    /// # Errors
    /// [`SimulateError`] when the bench lacks a model or a force, or the positions cannot be laid out.
    pub fn simulate(&self, training: &Training, seed: u64) -> Result<Recording, SimulateError> {
        self.simulate_watched(training, seed, Watch::NONE)
    }

    /// Simulates the presses of `training`, watched.
    ///
    /// # Errors
    /// As for [`Setup::simulate`], and [`SimulateError::Cancelled`].
    pub fn simulate_watched(
        &self,
        training: &Training,
        seed: u64,
        watch: Watch,
    ) -> Result<Recording, SimulateError> {
        let positions = training.positions(self.surface().extent())?;
        let pressed = self.pressed_by(training)?;
        let contacts = contacts_at(&pressed, &positions)?;
        simulate_presses_watched(&pressed, &contacts, training.repeats, training.placement_sd_m, seed, watch)
    }
}

/// Presses the bench's simulated surface with its force at each of `positions`, `repeats` times in a row, and records what its
/// faulty channels report. Gains, offsets and the places of sensors are drawn once for the recording, noise for each reading.
///
/// A setup with imperfections has a course in time. Each press is read `repeats` times; untouched rows (force 0) stand before the presses,
/// between them and after them; every row has its time; see [`Schedule`].
///
/// Equal seeds give equal recordings.
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

/// Presses the simulated surface as by [`simulate_at`], watched.
///
/// # Errors
/// As for [`simulate_at`], and [`SimulateError::Cancelled`].
pub fn simulate_at_watched(
    setup: &Setup,
    positions: &[Position],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    simulate_contacts_watched(setup, &contacts_at(setup, positions)?, repeats, seed, watch)
}

/// Contacts at positions with the force of a bench with a model.
///
/// # Errors
/// [`SimulateError::NoModel`] and [`SimulateError::NoForce`].
pub fn contacts_at(setup: &Setup, positions: &[Position]) -> Result<Vec<Contact>, SimulateError> {
    setup.surface().model().ok_or(SimulateError::NoModel)?;
    let force_n = setup.force_n().ok_or(SimulateError::NoForce)?;
    Ok(positions.iter().map(|position| Contact { position: *position, force_n }).collect())
}

/// Touches a calibrated bench in use with each of `contacts`, once, and records it, watched. A bench with imperfections is the one of the
/// calibration with this provenance, after the pause of its schedule; the seed draws noise and random walks from there on. Another bench is drawn
/// from the seed as by [`simulate_contacts`].
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

/// Presses the simulated surface as by [`simulate_at`], with a force of each contact's own.
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

/// Presses the simulated surface as by [`simulate_contacts`], watched.
///
/// # Errors
/// As for [`simulate_contacts`], and [`SimulateError::Cancelled`].
pub fn simulate_contacts_watched(
    setup: &Setup,
    contacts: &[Contact],
    repeats: usize,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    simulate_presses_watched(setup, contacts, repeats, None, seed, watch)
}

/// Simulates presses of these contacts, watched; see [`simulate_contacts`]. Where the bench has imperfections, the pressed places deviate
/// from those of the contacts by the standard deviation `placement_sd_m` in each direction, in metres.
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

/// Spreads `loads` over the bench's simulated surface, all at once, `repeats` times in a row, and returns the readings of its faulty
/// channels. Gains, offsets and the places of sensors are drawn once, noise for each reading. Imperfections act by their schedule; a soft layer
/// does not, as the loads themselves define their extent.
///
/// Equal seeds give equal readings.
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

/// Spreads `loads` as by [`simulate_loads`], watched.
///
/// # Errors
/// As for [`simulate_loads`], and [`SimulateError::Cancelled`].
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

/// The places of the sensors, the gains and offsets of the channels, and the stream of their noise.
fn draw_faults(setup: &Setup, seed: u64) -> (Layout, ChannelErrors, Xoshiro256PlusPlus) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    // Places have their own random stream, so the noise does not depend on displaced sensors.
    let mut places = rng.clone();
    places.jump();
    let placed = displaced(setup.layout(), setup.surface().extent(), &mut places);
    let errors = ChannelErrors::draw(setup.layout(), &mut rng);
    (placed, errors, rng)
}

/// The layout of one simulated bench: every sensor lies within its position error of its place, clamped to the surface. A perfectly placed
/// sensor stays where it is.
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
