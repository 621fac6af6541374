//! Simulated moving contacts.

use super::{CleanSensors, READINGS_EACH, STAGE, SimulateError, SimulatedBench};
use crate::imperfections::distribute_contact;
use crate::recording::{Recording, Row, TimedRecording};
use crate::setup::Setup;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::sensing::{Layout, Sensor};
use palpate_mechanics::surface::Motion;
use palpate_mechanics::surface::modal::{ModalBeam, ModalResponse};
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Watch;

/// Higher modes follow without delay.
const MODES: usize = 10;

/// One or two moving contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingContacts {
    /// First contact.
    pub first: MovingContact,
    /// Second contact.
    pub second: Option<MovingContact>,
    /// Vibrating beam; `None` for a plate in balance.
    pub beam: Option<ModalBeam>,
    /// Readings per second; greater than 0.
    pub rate_hz: f64,
}

/// Moving contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingContact {
    /// Motion.
    pub motion: Motion,
    /// Force; `None` for that of the presses.
    pub force_n: Option<f64>,
}

impl MovingContacts {
    /// Time until all motions end.
    pub fn duration_s(&self) -> f64 {
        self.moving().map(|contact| contact.motion.duration_s()).fold(0.0, f64::max)
    }

    /// Returns the contacts at `time_s`, by default of `force_n`.
    pub fn contacts_at(&self, time_s: f64, force_n: f64) -> Vec<Contact> {
        let at =
            |contact: MovingContact| contact.motion.contact_at(time_s, contact.force_n.unwrap_or(force_n));
        self.moving().map(at).collect()
    }

    /// Sets the speed of the first contact.
    ///
    /// # Errors
    /// [`OutOfRange`] unless positive and finite.
    pub fn at_speed(self, speed_m_per_s: f64) -> Result<Self, OutOfRange> {
        let motion = self.first.motion.with_speed(speed_m_per_s)?;
        Ok(Self { first: MovingContact { motion, ..self.first }, ..self })
    }

    /// Ends of straight path pieces; see [`Motion::breaks_s`].
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

/// Simulates moving contacts on a beam from balance, or a plate in balance, with draws as in
/// [`simulate_at`](super::simulate_at). A lifted contact has force 0 at its next position.
///
/// # Errors
/// [`SimulateError`] without a force or a model.
pub fn simulate_moving(
    setup: &Setup,
    moving: &MovingContacts,
    seed: u64,
) -> Result<TimedRecording, SimulateError> {
    simulate_moving_watched(setup, moving, seed, Watch::NONE)
}

/// [`simulate_moving`], watched.
///
/// # Errors
/// As there, and [`SimulateError::Cancelled`].
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
        Some(beam) => SurfaceResponse::Swings(beam.at_rest(MODES, &points_at(0.0))),
        None => SurfaceResponse::Balances(CleanSensors::new_watched(surface, layout, watch)?),
    };
    let (mut rows, mut second) = (Vec::<Row>::with_capacity(count), Vec::new());
    for (i, time_s) in times_s.iter().enumerate() {
        if i.is_multiple_of(READINGS_EACH) {
            watch.counted(STAGE, "readings", i, count)?;
        }
        let contacts = moving.contacts_at(*time_s, force_n);
        if let (SurfaceResponse::Swings(response), Some(before)) = (&mut under, i.checked_sub(1)) {
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

fn points_of(setup: &Setup, contacts: &[Contact]) -> Vec<Contact> {
    let width_m = setup.imperfections().map_or(0.0, |imperfections| imperfections.touch_width_m);
    let spread = |contact: &Contact| distribute_contact(*contact, width_m, setup.surface().extent());
    contacts.iter().flat_map(spread).collect()
}

enum SurfaceResponse<'a> {
    Swings(ModalResponse),
    Balances(CleanSensors<'a>),
}

impl SurfaceResponse<'_> {
    /// A vibrating beam has been advanced to the contacts.
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
