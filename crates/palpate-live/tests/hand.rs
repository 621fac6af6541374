//! Hands of all kinds press a board with hysteresis, creep, residue, drift and a converter. Every recorded press has a touch, and every calibration
//! ends.

use palpate_estimators::estimator::{Locator, Status};
use palpate_estimators::fit::Fit;
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulatedBench;
use palpate_live::calibration::{AwaitedStep, Calibration, DepthKnowledge, Journal, Note, Weights, plan};
use palpate_live::event::Event;
use palpate_live::frame::Channel;
use palpate_live::input::{Arrival, Command, TimedArrival};
use palpate_live::session::{Output, Session, SessionConfig};
use palpate_live::simulated_board::{
    BoardConfig, FaultConfig, Finger, HandStyle, Instruction, SimulatedBoard, SimulatedHand,
};
use palpate_live::stamp::{HostClock, Stamp};
use palpate_mechanics::contact::{Contact, Position};
use palpate_rig::Rig;
use palpate_testing::strip::{CLAMPED_STRIP, STRIP_FORCE_N as FORCE_N, clamped_strip};
use std::time::Duration;

/// Largest reading of a press, in standard deviations of the noise.
const LARGEST_SD: f64 = 3455.0;

/// Reading of a detectable force, in standard deviations of the noise: single readings show a touch from 8 on.
const FELT_SD: f64 = 10.0;

/// Outcome of a calibration.
#[derive(Debug, Default, PartialEq)]
struct Outcome {
    /// Presses recorded while the force was below nine tenths of that of a press.
    without_touch: usize,
    /// Untouched rows recorded during a detectable force.
    touched: usize,
    presses: usize,
    asked_again: usize,
    /// Longest time in one step, in seconds.
    longest_s: f64,
    /// Notes that the board repeats readings.
    repeats_noted: usize,
    is_finished: bool,
}

/// The rig, with noise such that the largest press reads [`LARGEST_SD`] standard deviations.
fn rig() -> (Rig, f64) {
    let rig = Rig::from_toml(CLAMPED_STRIP).unwrap();
    let bench = SimulatedBench::new(&rig.setup, 0).unwrap();
    let read = |x_mm: i32| {
        let position = Position::along(f64::from(x_mm) * 1e-3);
        bench
            .clean(&[Contact { position, force_n: FORCE_N }])
            .into_iter()
            .fold(0.0_f64, |a, b| a.max(b.abs()))
    };
    let noise = (1..300).map(read).fold(0.0, f64::max) / LARGEST_SD;
    drop(bench);
    (Rig::from_toml(&clamped_strip(1e6 * noise)).unwrap(), noise)
}

/// Linear drift of each channel with this slope.
fn line(per_s: f64) -> OffsetDrift {
    OffsetDrift { line_per_s: Amount::Value(per_s), ..OffsetDrift::default() }
}

/// Creep with one share.
fn creep(share: f64, time_s: f64) -> [Relaxation; 2] {
    [Relaxation { share, time_s }, Relaxation::default()]
}

/// Faults of a board with these imperfections.
fn imperfect(imperfections: Imperfections) -> FaultConfig {
    FaultConfig { imperfections, ..FaultConfig::default() }
}

/// A board under a hand.
struct Bench<'a> {
    rig: &'a Rig,
    board: SimulatedBoard<'a>,
    hand: SimulatedHand,
    start: Stamp,
}

impl<'a> Bench<'a> {
    fn new(rig: &'a Rig, style: HandStyle, faults: FaultConfig, rate_hz: f64, seed: u64) -> Self {
        let config = BoardConfig { seed, rate_hz, ..BoardConfig::default() };
        let finger = Finger::random(rig, seed);
        let board = SimulatedBoard::new(&rig.setup, &config, finger).unwrap();
        let board = board.with_faults(faults, seed).unwrap();
        let hand = SimulatedHand::new(style, rig.setup.surface().extent(), seed);
        Self { rig, board, hand, start: HostClock::new().now() }
    }

    /// The next frame, and the contact during its reading.
    fn next(&mut self, instruction: Instruction) -> (TimedArrival, Option<Contact>) {
        let elapsed = self.board.next_at();
        let contact = self.hand.contact_at(elapsed.as_secs_f64(), instruction);
        self.board.finger_mut().set_contact(contact);
        let arrival = Arrival::Bytes(self.board.next_frame().unwrap_or_default());
        (TimedArrival { at: Stamp { elapsed, ..self.start }, arrival }, contact)
    }

    /// A guided calibration, with its outcome, and the contact at every reading, on the time scale of the rows.
    fn calibrate(&mut self) -> (Calibration, Outcome, Vec<Option<Contact>>) {
        let folder = tempfile::tempdir().unwrap();
        let (setup, presses) = (&self.rig.setup, folder.path().join("presses.csv"));
        let journal =
            Journal::new(setup, &presses, "test".to_owned(), Vec::new(), DepthKnowledge::Unknown).unwrap();
        let plan = plan(self.rig, Weights::default(), &[], &[]).unwrap();
        let mut calibration = Calibration::new(setup, None, &[], plan, journal).unwrap();
        let mut outcome = Outcome::default();
        let mut contacts = Vec::new();
        let (mut waiting, mut since) = (AwaitedStep::Untouched, Duration::ZERO);
        for _ in 0..400_000 {
            let guide = calibration.guide();
            let instruction = match (guide.awaited_step(), guide.next_press()) {
                (AwaitedStep::Press, Some((_, press))) => {
                    Instruction::Press(Contact { position: press.position, force_n: FORCE_N })
                }
                (AwaitedStep::Rest, _) => Instruction::Hold,
                _ => Instruction::Lift,
            };
            let is_next_step = guide.awaited_step() != waiting;
            waiting = guide.awaited_step();
            let (arrived, contact) = self.next(instruction);
            let now = arrived.at.elapsed;
            if is_next_step {
                since = now;
            }
            outcome.longest_s = outcome.longest_s.max((now - since).as_secs_f64());
            contacts.push(contact);
            let mut notes = Vec::new();
            calibration.receive(&arrived, &mut notes).unwrap();
            outcome.repeats_noted += notes.iter().filter(|note| **note == Note::RepeatedReadings).count();
            outcome.asked_again += notes.iter().filter(|note| matches!(note, Note::AskedAgain(_))).count();
            if waiting == AwaitedStep::Nothing || now > Duration::from_secs(1000) {
                break;
            }
        }
        outcome.is_finished = calibration.guide().awaited_step() == AwaitedStep::Nothing;
        (calibration, outcome, contacts)
    }
}

fn calibrate(style: HandStyle, faults: FaultConfig, rate_hz: f64, seed: u64) -> Outcome {
    let (rig, noise) = rig();
    let hysteresis = faults.imperfections.hysteresis;
    let (calibration, mut outcome, contacts) = Bench::new(&rig, style, faults, rate_hz, seed).calibrate();
    let bench = SimulatedBench::new(&rig.setup, 0).unwrap();
    let untouched = bench.clean(&[]);
    let felt_sd = |contact: Option<Contact>| {
        let reading = bench.clean(contact.as_slice());
        reading.iter().zip(&untouched).fold(0.0_f64, |size, (value, zero)| size.max((value - zero).abs()))
            / noise
    };
    for row in calibration.journal().rows() {
        let reading_number = (row.time_s.unwrap() * rate_hz).round() as usize;
        let contact = contacts[reading_number];
        if row.touches() {
            outcome.presses += 1;
            outcome.without_touch +=
                usize::from(contact.is_none_or(|contact| contact.force_n < 0.9 * FORCE_N));
        } else {
            outcome.touched += usize::from(felt_sd(contact) > FELT_SD + hysteresis * LARGEST_SD);
        }
    }
    outcome
}

#[test]
fn every_press_of_any_hand_has_a_touch() {
    let (_, noise) = rig();
    let exact = HandStyle { placement_m: 5e-4, ..HandStyle::default() };
    let hands = [
        ("quick", exact),
        ("slow", HandStyle { press_s: 1.0, lift_s: 1.0, ..exact }),
        ("early lift", HandStyle { early_lift: 0.3, lift_s: 0.5, ..exact }),
        ("hovering", HandStyle { hover_share: 0.08, hover_s: 0.8, lift_s: 0.3, ..exact }),
        ("tapping", HandStyle { taps: 2, ..exact }),
    ];
    let benches = [
        ("ideal", FaultConfig::default()),
        (
            "hysteresis 1 %",
            FaultConfig {
                converter_step: Some(noise),
                ..imperfect(Imperfections { hysteresis: 0.01, ..Imperfections::default() })
            },
        ),
        (
            "hysteresis 3 %, drift",
            imperfect(Imperfections {
                hysteresis: 0.03,
                drift: line(2.0 * noise),
                ..Imperfections::default()
            }),
        ),
        (
            "creep, residue, drift",
            imperfect(Imperfections {
                creep: creep(0.03, 5.0),
                residue: Relaxation { share: 0.01, time_s: 20.0 },
                drift: line(noise),
                ..Imperfections::default()
            }),
        ),
    ];
    let (mut presses, mut asked_again) = (0, 0);
    for (i, (hand, style)) in hands.into_iter().enumerate() {
        for (j, (bench, faults)) in benches.iter().enumerate() {
            let outcome = calibrate(style, faults.clone(), 100.0, (10 * i + j) as u64);
            println!("{hand}, {bench}: {outcome:?}");
            assert!(outcome.is_finished && outcome.presses == 20, "{hand}, {bench}: {outcome:?}");
            assert!(outcome.longest_s < 10.0, "{hand}, {bench}: {outcome:?}");
            assert_eq!((outcome.without_touch, outcome.touched), (0, 0), "{hand}, {bench}: {outcome:?}");
            presses += outcome.presses;
            asked_again += outcome.asked_again;
        }
    }
    println!("{asked_again} of {presses} presses were asked for again");
    assert!(asked_again * 50 <= presses, "{asked_again} of {presses} presses were asked for again");
}

#[test]
fn presses_on_slow_boards_and_on_boards_that_repeat_readings_have_a_touch() {
    let (_, noise) = rig();
    let exact = HandStyle { placement_m: 5e-4, ..HandStyle::default() };
    let early = HandStyle { early_lift: 0.3, lift_s: 0.5, ..exact };
    let slow = HandStyle { press_s: 1.0, lift_s: 1.0, ..exact };
    let hovering = HandStyle { hover_share: 0.08, hover_s: 0.3, lift_s: 0.3, ..exact };
    let ideal = FaultConfig::default();
    let repeating =
        |repeated_readings| imperfect(Imperfections { repeated_readings, ..Imperfections::default() });
    let imperfections = Imperfections { hysteresis: 0.01, drift: line(noise), ..Imperfections::default() };
    let worn = FaultConfig { converter_step: Some(noise), ..imperfect(imperfections) };
    let runs = [
        ("quick, each reading twice", exact, 100.0, repeating(1)),
        ("slow, each reading 10 times", slow, 100.0, repeating(9)),
        (
            "early lift, each reading 5 times, hysteresis, drift",
            early,
            100.0,
            FaultConfig {
                imperfections: Imperfections { repeated_readings: 4, ..imperfections },
                ..worn.clone()
            },
        ),
        ("tapping, each reading 25 times", HandStyle { taps: 2, ..exact }, 200.0, repeating(24)),
        ("quick, 10 readings a second", exact, 10.0, ideal.clone()),
        ("hovering, 10 readings a second, hysteresis, drift", hovering, 10.0, worn),
    ];
    let mut asked_again = 0;
    for (i, (name, style, rate_hz, faults)) in runs.into_iter().enumerate() {
        let repeats_noted = usize::from(faults.imperfections.repeated_readings > 0);
        let outcome = calibrate(style, faults, rate_hz, i as u64);
        println!("{name}: {outcome:?}");
        assert!(outcome.is_finished && outcome.presses == 20, "{name}: {outcome:?}");
        assert!(outcome.longest_s < 10.0, "{name}: {outcome:?}");
        assert_eq!((outcome.without_touch, outcome.touched), (0, 0), "{name}: {outcome:?}");
        assert_eq!(outcome.repeats_noted, repeats_noted, "{name}: {outcome:?}");
        asked_again += outcome.asked_again;
    }
    assert!(asked_again * 50 <= 120, "{asked_again} of 120 presses were asked for again");
}

/// Touches in the course of a session.
#[derive(Debug, Default, PartialEq)]
struct Tally {
    /// Touches with `no_contact` for all readings from one second after their end on.
    ended: usize,
    touch_downs: usize,
    lift_offs: usize,
    /// Lift-offs without a touch-down before.
    unpaired: usize,
}

impl Tally {
    fn add(&mut self, event: &Event) {
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

/// Number of touches of a session.
const TOUCHES: usize = 4;

/// The locator of a setup, fitted to the presses of a calibration.
fn fit(rig: &Rig, setup: &Setup, calibration: &Calibration) -> Locator {
    let mut rows = calibration.journal().rows().to_vec();
    if setup.surface().model().is_none() {
        // Readings of raw channels are the numbers of the frames.
        let factors: Vec<f64> =
            Channel::all_of(&rig.setup).iter().map(|channel| channel.unit.factor()).collect();
        let values = rows.iter_mut().flat_map(|row| row.reading.iter_mut().zip(&factors));
        values.for_each(|(value, factor)| *value /= factor);
    }
    rig.estimator.fit(setup, &Recording::new(setup.layout(), "presses", rows)).unwrap()
}

#[test]
fn a_session_after_a_drifting_calibration_begins_untouched() {
    let (rig, noise) = rig();
    let names = rig.setup.layout().names();
    let names: Vec<&str> = names.iter().map(|name| name.as_ref()).collect();
    let measured = Setup::measured(0.3, &names).unwrap();
    let faults =
        imperfect(Imperfections { hysteresis: 0.01, drift: line(noise), ..Imperfections::default() });
    let mut contacts_of_unaware = 0;
    for setup in [rig.setup.clone().with_force(None).unwrap(), measured] {
        let mut bench = Bench::new(&rig, HandStyle::default(), faults.clone(), 100.0, 7);
        let (calibration, ..) = bench.calibrate();
        let locator = fit(&rig, &setup, &calibration);
        // Half a minute passes.
        for _ in 0..3000 {
            bench.next(Instruction::Lift);
        }
        let untouched: Vec<TimedArrival> = (0..500).map(|_| bench.next(Instruction::Lift).0).collect();
        let contacts = contacts_of(&locator, &untouched);
        assert!(contacts <= 5, "{contacts} of 500 untouched readings are contacts");
        let unaware = Locator { untouched_drift: None, ..locator };
        contacts_of_unaware += contacts_of(&unaware, &untouched);
    }
    assert!(contacts_of_unaware > 500, "{contacts_of_unaware}");
}

/// Readings of a session with another status than `no_contact`.
fn contacts_of(locator: &Locator, arrived: &[TimedArrival]) -> usize {
    let mut session = Session::new(locator, &SessionConfig::default()).unwrap();
    let mut out = Vec::new();
    arrived.iter().for_each(|arrived| session.receive(arrived, &mut out));
    let is_contact = |output: &&Output| matches!(output, Output::Sample(sample) if sample.estimate.status != Status::NoContact);
    out.iter().filter(is_contact).count()
}

/// Touches by the hand that calibrated the board, after a tare; `setup` is that of the locator.
fn touch(rig: &Rig, setup: &Setup, style: HandStyle, faults: FaultConfig) -> Tally {
    const RATE_HZ: usize = 50;
    let mut bench = Bench::new(rig, style, faults, RATE_HZ as f64, 7);
    let (calibration, ..) = bench.calibrate();
    let locator = fit(rig, setup, &calibration);
    let mut session = Session::new(&locator, &SessionConfig::default()).unwrap();
    let (mut tally, mut out) = (Tally::default(), Vec::new());
    session.command(bench.start, Command::Tare, &mut out);
    for _ in 0..4 * RATE_HZ {
        session.receive(&bench.next(Instruction::Lift).0, &mut out);
    }
    for i in 0..TOUCHES {
        let x_m = 0.3 * (0.15 + 0.7 * (i * 3 % TOUCHES) as f64 / (TOUCHES - 1) as f64);
        let press = Instruction::Press(Contact { position: Position::along(x_m), force_n: FORCE_N });
        let (mut late, mut untouched_for) = (Vec::new(), 0);
        for reading in 0..9 * RATE_HZ {
            let is_pressed = reading < 4 * RATE_HZ;
            let (arrived, contact) = bench.next(if is_pressed { press } else { Instruction::Lift });
            untouched_for = if contact.is_some() || is_pressed { 0 } else { untouched_for + 1 };
            session.receive(&arrived, &mut out);
            for output in out.drain(..) {
                match output {
                    Output::Sample(sample) if untouched_for > RATE_HZ => late.push(sample.estimate.status),
                    Output::Sample(_) => {}
                    Output::Event(event) => tally.add(&event.event),
                }
            }
        }
        // A reading in a thousand is a false alarm.
        let contacts = late.iter().filter(|status| **status != Status::NoContact).count();
        tally.ended += usize::from(contacts <= 1 + late.len() / 100 && !session.is_touched());
    }
    tally
}

#[test]
fn every_touch_ends_within_a_second_of_the_lift() {
    let (rig, noise) = rig();
    let names = rig.setup.layout().names();
    let names: Vec<&str> = names.iter().map(|name| name.as_ref()).collect();
    let measured = Setup::measured(0.3, &names).unwrap();
    let exact = HandStyle { placement_m: 5e-4, lift_s: 0.5, ..HandStyle::default() };
    let worn = Imperfections {
        creep: creep(0.01, 3.0),
        residue: Relaxation { share: 0.005, time_s: 20.0 },
        drift: line(2.0 * noise),
        ..Imperfections::default()
    };
    let setups = [
        ("model, known force", rig.setup.clone(), true),
        ("model, unknown force", rig.setup.clone().with_force(None).unwrap(), false),
        ("measured, known force", measured.clone().known_force(FORCE_N).unwrap(), true),
        ("measured, unknown force", measured, false),
    ];
    for (name, setup, is_force_known) in setups {
        for hysteresis in [0.0, 0.01, 0.03] {
            let tally = touch(&rig, &setup, exact, imperfect(Imperfections { hysteresis, ..worn }));
            println!("{name}, hysteresis {hysteresis}: {tally:?}");
            let Tally { ended, touch_downs, lift_offs, unpaired } = tally;
            assert_eq!(
                (ended, unpaired, lift_offs),
                (TOUCHES, 0, touch_downs),
                "{name}, {hysteresis}: {tally:?}"
            );
            // Creep and hysteresis change the gain. If the force is known, or the hysteresis is 3 %, the model may not explain a touch: its status is
            // `outside_model`, which has separate events.
            let is_explained = setup.surface().model().is_none() || (!is_force_known && hysteresis <= 0.01);
            assert!(touch_downs >= TOUCHES || !is_explained, "{name}, {hysteresis}: {tally:?}");
        }
    }
}
