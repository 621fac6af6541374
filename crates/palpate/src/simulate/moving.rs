//! A moving contact, on a beam that swings or on a plate in balance.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{CleanSensors, SimulateError};
use crate::contact::Contact;
use crate::mechanics::modal::ModalResponse;
use crate::recording::{Provenance, Recording, Row, TimedRecording};
use crate::rig::Rig;
use crate::sensing::{ChannelErrors, Layout, Sensor, measure};

/// Modes of the beam that swing; the others follow the contact at once. The tenth is a hundred times as fast as the first.
const MODES: usize = 10;

/// Moves the contacts of a rig as its `[motion]` says, and records what the faulty channels report: over a beam that swings,
/// from its balance under them, or over a plate that is in balance at every reading. Gains and offsets are drawn once for
/// the recording, noise for each reading. While a contact is lifted its force is 0, and its position is where it comes down
/// again.
///
/// The same seed gives the same recording.
///
/// # Errors
/// [`SimulateError`] when the rig has no motion, no force or no model.
pub fn simulate_moving(rig: &Rig, seed: u64) -> Result<TimedRecording, SimulateError> {
    let moving = rig.motion.ok_or(SimulateError::NoMotion)?;
    let force_n = rig.pressed_bench().force_n.ok_or(SimulateError::NoForce)?;
    let surface = rig.bench.surface.model().ok_or(SimulateError::NoModel)?;
    let layout = &rig.bench.layout;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let errors = ChannelErrors::draw(layout, &mut rng);
    let count = (moving.duration_s() * moving.rate_hz).floor() as usize + 1;
    let times_s: Vec<f64> = (0..count).map(|i| i as f64 / moving.rate_hz).collect();
    let mut under = match moving.beam {
        Some(beam) => Under::Swings(beam.at_rest(MODES, &moving.contacts_at(0.0, force_n))),
        None => Under::Balances(CleanSensors::new(surface, layout)),
    };
    let (mut rows, mut second) = (Vec::with_capacity(count), Vec::new());
    for (i, time_s) in times_s.iter().enumerate() {
        let contacts = moving.contacts_at(*time_s, force_n);
        let since_s = if i > 0 { 1.0 / moving.rate_hz } else { 0.0 };
        let clean = under.reading(layout, &contacts, since_s);
        let reading = measure(layout, &clean, &errors, &mut rng);
        let Contact { position, force_n } = contacts[0];
        rows.push(Row { position, force_n: Some(force_n), hidden: None, reading });
        second.extend(contacts.get(1));
    }
    let provenance =
        Provenance { source: "simulation".to_owned(), rows: count, digests: Vec::new(), seed: Some(seed) };
    let recording = Recording { channels: layout.names(), kinds: layout.kinds(), rows, provenance };
    Ok(TimedRecording { recording, times_s, second })
}

/// What is under the contacts.
enum Under<'a> {
    Swings(ModalResponse),
    Balances(CleanSensors<'a>),
}

impl Under<'_> {
    /// What the sensors would read without any fault, `since_s` seconds after the reading before; 0 for the first one.
    fn reading(&mut self, layout: &Layout, contacts: &[Contact], since_s: f64) -> Vec<f64> {
        match self {
            Self::Swings(response) => {
                if since_s > 0.0 {
                    response.advance(contacts, since_s);
                }
                let clean = |sensor: &Sensor| response.reading(sensor.kind, sensor.position);
                layout.sensors.iter().map(clean).collect()
            }
            Self::Balances(sensors) => {
                let readings = contacts.iter().map(|contact| sensors.reading(*contact));
                let sum = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| a + b).collect();
                readings.reduce(sum).unwrap_or_default()
            }
        }
    }
}
