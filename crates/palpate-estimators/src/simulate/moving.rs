//! A moving contact, on a beam that swings or on a plate in balance.

use super::{CleanSensors, READINGS_EACH, STAGE, SimulateError, SimulatedBench};
use crate::imperfections::spread_contact;
use crate::recording::{Recording, Row, TimedRecording};
use crate::setup::Setup;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::sensing::{Layout, Sensor};
use palpate_mechanics::surface::Motion;
use palpate_mechanics::surface::modal::{ModalBeam, ModalResponse};
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Watch;

/// Modes of the beam that swing; the others follow the contact without delay. The tenth is a hundred times as fast as the first.
const MODES: usize = 10;

/// Contacts that move over a surface: one or two, and the beam that swings under them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingContacts {
    /// The contact, or the first of two.
    pub first: MovingContact,
    /// The other one.
    pub second: Option<MovingContact>,
    /// The beam with its inertia and damping; `None` for a plate, which is in balance at every reading.
    pub beam: Option<ModalBeam>,
    /// Readings a second, in hertz; greater than 0.
    pub rate_hz: f64,
}

/// One contact that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingContact {
    /// Motion.
    pub motion: Motion,
    /// Force of the contact in newtons; `None` for the force of the rig's presses.
    pub force_n: Option<f64>,
}

impl MovingContacts {
    /// Time until every contact has arrived, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.moving().map(|contact| contact.motion.duration_s()).fold(0.0, f64::max)
    }

    /// The contacts at `time_s`; `force_n` is the force, in newtons, of those without one of their own.
    pub fn contacts_at(&self, time_s: f64, force_n: f64) -> Vec<Contact> {
        let at =
            |contact: MovingContact| contact.motion.contact_at(time_s, contact.force_n.unwrap_or(force_n));
        self.moving().map(at).collect()
    }

    /// These contacts, the first at another speed between its turns.
    ///
    /// # Errors
    /// [`OutOfRange`] for a speed that is not greater than 0 and finite.
    pub fn at_speed(self, speed_m_per_s: f64) -> Result<Self, OutOfRange> {
        let motion = self.first.motion.with_speed(speed_m_per_s)?;
        Ok(Self { first: MovingContact { motion, ..self.first }, ..self })
    }

    /// Ends of the straight pieces of all contacts' paths after `from_s`, `to_s` the last; see [`Motion::breaks_s`].
    fn pieces_s(&self, from_s: f64, to_s: f64) -> Vec<f64> {
        let mut ends: Vec<f64> =
            self.moving().flat_map(|contact| contact.motion.breaks_s(from_s, to_s)).collect();
        ends.push(to_s);
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        ends
    }

    fn moving(&self) -> impl Iterator<Item = MovingContact> {
        std::iter::once(self.first).chain(self.second)
    }
}

/// Moves contacts over the bench's simulated surface, and records what the faulty channels report: over a beam that swings,
/// from its balance under them, or over a plate that is in balance at every reading. Gains and offsets are drawn once for
/// the recording, noise for each reading. While a contact is lifted its force is 0, and its position is where it comes down
/// again. Imperfections act in the course of the motion.
///
/// Equal seeds give equal recordings.
///
/// # Errors
/// [`SimulateError`] when the bench has no force or no model.
pub fn simulate_moving(
    setup: &Setup,
    moving: &MovingContacts,
    seed: u64,
) -> Result<TimedRecording, SimulateError> {
    simulate_moving_watched(setup, moving, seed, Watch::NONE)
}

/// Moves contacts over the simulated surface as by [`simulate_moving`], watched.
///
/// # Errors
/// As for [`simulate_moving`], and [`SimulateError::Cancelled`].
pub fn simulate_moving_watched(
    setup: &Setup,
    moving: &MovingContacts,
    seed: u64,
    watch: Watch,
) -> Result<TimedRecording, SimulateError> {
    let force_n = setup.force_n().ok_or(SimulateError::NoForce)?;
    let surface = setup.surface().model().ok_or(SimulateError::NoModel)?;
    surface.check_solution_watched(watch)?;
    let layout = setup.layout();
    let mut channels = SimulatedBench::channels_watched(setup, force_n, seed, watch)?;
    let count = (moving.duration_s() * moving.rate_hz).floor() as usize + 1;
    let times_s: Vec<f64> = (0..count).map(|i| i as f64 / moving.rate_hz).collect();
    let repeats = setup.imperfections().map_or(0, |imperfections| imperfections.repeated_readings as usize);
    let points_at = |time_s: f64| points_of(setup, &moving.contacts_at(time_s, force_n));
    let mut under = match moving.beam {
        Some(beam) => Under::Swings(beam.at_rest(MODES, &points_at(0.0))),
        None => Under::Balances(CleanSensors::new_watched(surface, layout, watch)?),
    };
    let (mut rows, mut second) = (Vec::<Row>::with_capacity(count), Vec::new());
    for (i, time_s) in times_s.iter().enumerate() {
        if i.is_multiple_of(READINGS_EACH) {
            watch.counted(STAGE, "readings", i, count)?;
        }
        let contacts = moving.contacts_at(*time_s, force_n);
        if let (Under::Swings(response), Some(before)) = (&mut under, i.checked_sub(1)) {
            advance(response, moving, &points_at, (times_s[before], *time_s));
        }
        let clean = under.reading(layout, &points_at(*time_s));
        let values = channels.advance(&clean, if i == 0 { 0.0 } else { 1.0 / moving.rate_hz });
        let repeated = rows.last().filter(|_| !i.is_multiple_of(1 + repeats));
        let reading = repeated.map_or_else(|| channels.measure(&values), |row| row.reading.clone());
        let Contact { position, force_n } = contacts[0];
        rows.push(Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading });
        second.extend(contacts.get(1));
    }
    let recording = Recording::new(layout, "simulation", rows).seeded(seed);
    Ok(TimedRecording { recording, times_s, second })
}

/// The contacts, each spread where the setup has a soft layer.
fn points_of(setup: &Setup, contacts: &[Contact]) -> Vec<Contact> {
    let width_m = setup.imperfections().map_or(0.0, |imperfections| imperfections.touch_width_m);
    let spread = |contact: &Contact| spread_contact(*contact, width_m, setup.surface().extent());
    contacts.iter().flat_map(spread).collect()
}

/// The surface under the contacts.
enum Under<'a> {
    Swings(ModalResponse),
    Balances(CleanSensors<'a>),
}

impl Under<'_> {
    /// Faultless reading of the sensors under `contacts`; a beam that swings has been advanced to them.
    fn reading(&self, layout: &Layout, contacts: &[Contact]) -> Vec<f64> {
        match self {
            Self::Swings(response) => {
                let clean = |sensor: &Sensor| response.reading(sensor.kind, sensor.position);
                layout.sensors().iter().map(clean).collect()
            }
            Self::Balances(sensors) => {
                let readings = contacts.iter().map(|contact| sensors.reading(*contact));
                let sum = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| a + b).collect();
                readings.reduce(sum).unwrap_or_default()
            }
        }
    }
}

/// Moves the contacts from one instant to another along their paths, for any time between readings.
fn advance(
    response: &mut ModalResponse,
    moving: &MovingContacts,
    points_at: &dyn Fn(f64) -> Vec<Contact>,
    (from_s, to_s): (f64, f64),
) {
    let mut now_s = from_s;
    for end_s in moving.pieces_s(from_s, to_s) {
        response.advance(&points_at(end_s), end_s - now_s);
        now_s = end_s;
    }
}
