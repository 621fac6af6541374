//! Sessions over a strip with hysteresis, creep and drift.

mod strip;

use super::*;
use crate::input::{Arrival, Arrived};
use crate::stamp::Stamp;
use palpate_estimators::fit::Fit;
use palpate_estimators::influence::Influence;
use rand::RngExt;
use std::time::Duration;
use strip::{Imperfections, PRESS_N, STRIP_M, Strip};

/// Knowledge of the force of touches.
#[derive(Clone, Copy, Debug)]
enum Force {
    Known,
    Unknown,
}

/// A locator for touches of the one known weight of its presses, or of any force, from presses of two weights.
fn locator(strip: &mut Strip, force: Force) -> Locator {
    let setup = Strip::setup();
    let (setup, recording) = match force {
        Force::Known => (setup.known_force(PRESS_N).unwrap(), strip.calibrate(10, &[PRESS_N])),
        Force::Unknown => (setup, strip.calibrate(10, &[PRESS_N, 0.5 * PRESS_N])),
    };
    Influence::default().fit(&setup, &recording).unwrap().into_locator()
}

/// Events and samples of readings that arrive one by one.
fn receive(session: &mut Session, strip: &Strip, readings: Vec<Vec<f64>>) -> (Vec<Event>, Vec<Sample>) {
    let first = strip.frames - readings.len() as u64;
    let mut out = Vec::new();
    for (i, reading) in readings.into_iter().enumerate() {
        let elapsed = Duration::from_secs_f64((first + i as u64) as f64 / strip.rate_hz);
        let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
        let line = reading.iter().map(|value| value.to_string()).collect::<Vec<_>>().join(",") + "\n";
        session.receive(&Arrived { at, arrival: Arrival::Bytes(line.into_bytes()) }, &mut out);
    }
    let (mut events, mut samples) = (Vec::new(), Vec::new());
    for output in out {
        match output {
            Output::Event(event) => events.push(event.event),
            Output::Sample(sample) => samples.push(*sample),
        }
    }
    (events, samples)
}

/// Touches in the course of a session.
#[derive(Debug, Default)]
struct Tally {
    touches: usize,
    /// Touches after which all is `no_contact` from a second on.
    ended: usize,
    touch_downs: usize,
    lift_offs: usize,
    /// Lift-offs without a touch-down before.
    unpaired: usize,
}

impl Tally {
    fn add(&mut self, events: &[Event]) {
        for event in events {
            match event {
                Event::TouchDown { .. } => self.touch_downs += 1,
                Event::LiftOff { .. } => {
                    self.lift_offs += 1;
                    self.unpaired += usize::from(self.lift_offs > self.touch_downs);
                }
                _ => {}
            }
        }
    }

    /// Touches by a hand that lifts in 0.1 to 1 s.
    fn of_session(imperfections: Imperfections, force: Force, seed: u64) -> Self {
        const TOUCHES: usize = 2;
        let mut strip = Strip::new(imperfections, seed);
        let locator = locator(&mut strip, force);
        let mut session = Session::new(&locator, &SessionConfig::default()).unwrap();
        let start = Stamp { elapsed: Duration::from_secs_f64(strip.time_s()), unix_ns: 0 };
        session.command(start, Command::Tare, &mut Vec::new());
        let mut tally = Self { touches: TOUCHES, ..Self::default() };
        let untouched = strip.rest(4.0);
        tally.add(&receive(&mut session, &strip, untouched).0);
        for _ in 0..TOUCHES {
            let at_m = STRIP_M * strip.rng.random_range(0.1..0.9);
            let timing = (strip.rng.random_range(0.1..1.0), strip.rng.random_range(0.5..3.0));
            let force_n = match force {
                Force::Known => PRESS_N,
                Force::Unknown => PRESS_N * strip.rng.random_range(0.3..1.5),
            };
            let press = strip.press(at_m, force_n, timing);
            tally.add(&receive(&mut session, &strip, press).0);
            let seconds = strip.rng.random_range(1.5..5.0);
            let rest = strip.rest(seconds);
            let (events, samples) = receive(&mut session, &strip, rest);
            tally.add(&events);
            // A reading in a thousand is a false alarm.
            let late = &samples[strip.rate_hz as usize..];
            let contacts = late.iter().filter(|sample| sample.estimate.status != Status::NoContact).count();
            tally.ended += usize::from(contacts <= 1 + late.len() / 100 && !session.is_touched());
        }
        tally
    }
}

#[test]
fn every_touch_ends_on_a_strip_with_residue() {
    for force in [Force::Known, Force::Unknown] {
        let imperfections = Imperfections { hysteresis: 0.01, creep: 0.01, drift: 2.0 };
        let tally = Tally::of_session(imperfections, force, 7);
        let Tally { touches, ended, touch_downs, lift_offs, unpaired } = tally;
        assert_eq!((ended, unpaired), (touches, 0), "{force:?} {tally:?}");
        assert!(touch_downs == lift_offs && touch_downs >= touches, "{force:?} {tally:?}");
    }
}

#[test]
fn a_lift_off_has_a_touch_down_before_it() {
    use palpate_core::{Estimate, Position};
    let mut watch = ContactWatch::new(Strip::setup().surface().extent());
    let mut kinds = Vec::new();
    let mut tell = |status: Status, count: u64| {
        for i in 0..count {
            let estimate = Estimate::of_position(Position::along(0.1), status);
            watch.add(Duration::from_millis(i), &estimate, |event| kinds.push(event.name()));
        }
    };
    for status in [Status::OutsideModel, Status::NoContact, Status::OutsideModel, Status::Located] {
        tell(status, 5);
    }
    for status in [Status::OutsideModel, Status::Located, Status::OutsideModel, Status::NoContact] {
        tell(status, 5);
    }
    let expected =
        ["outside_model", "outside_model", "touch_down", "outside_model", "outside_model", "lift_off"];
    assert_eq!(kinds, expected);
}
