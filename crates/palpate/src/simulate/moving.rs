//! A moving contact, on a surface that swings.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::SimulateError;
use crate::contact::Contact;
use crate::recording::{Provenance, Recording, Row, TimedRecording};
use crate::rig::Rig;
use crate::sensing::{ChannelErrors, Sensor, measure};

/// Modes of the beam that swing; the others follow the contact at once. The tenth is a hundred times as fast as the first.
const MODES: usize = 10;

/// Moves the contacts of a rig as its `[motion]` says, from the beam in balance under them, and records what the faulty
/// channels report. Gains and offsets are drawn once for the recording, noise for each reading. While a contact is
/// lifted its force is 0, and its position is where it comes down again.
///
/// The same seed gives the same recording.
///
/// # Errors
/// [`SimulateError`] when the rig has no motion or no force.
pub fn simulate_moving(rig: &Rig, seed: u64) -> Result<TimedRecording, SimulateError> {
    let moving = rig.motion.ok_or(SimulateError::NoMotion)?;
    let force_n = rig.pressed_bench().force_n.ok_or(SimulateError::NoForce)?;
    let layout = &rig.bench.layout;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let errors = ChannelErrors::draw(layout, &mut rng);
    let count = (moving.duration_s() * moving.rate_hz).floor() as usize + 1;
    let times_s: Vec<f64> = (0..count).map(|i| i as f64 / moving.rate_hz).collect();
    let mut response = moving.beam.at_rest(MODES, &moving.contacts_at(0.0, force_n));
    let (mut rows, mut second) = (Vec::with_capacity(count), Vec::new());
    for (i, time_s) in times_s.iter().enumerate() {
        let contacts = moving.contacts_at(*time_s, force_n);
        if i > 0 {
            response.advance(&contacts, 1.0 / moving.rate_hz);
        }
        let clean = |sensor: &Sensor| response.reading(sensor.kind, sensor.position);
        let clean: Vec<f64> = layout.sensors.iter().map(clean).collect();
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
