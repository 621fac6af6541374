//! Hands of all kinds press a board that has hysteresis, creep, residue, drift and a converter: every recorded press has a touch, and nobody waits for ever.

use palpate_estimators::simulate::SimulatedBench;
use palpate_live::calibration::{Calibration, DepthKnowledge, Journal, Note, Waiting, Weights, plan};
use palpate_live::input::{Arrival, Arrived};
use palpate_live::simulated_board::{
    BoardConfig, FaultConfig, Finger, Hand, HandStyle, Instruction, SimulatedBoard,
};
use palpate_live::stamp::HostClock;
use palpate_mechanics::contact::{Contact, Position};
use palpate_rig::Rig;
use std::time::Duration;

/// A clamped strip of 300 mm with six strain gauges, pressed with 2 N.
const STRIP: &str = r#"
[surface]
kind = "beam"
length = "300 mm"
width = "30 mm"
thickness = "1.5 mm"
youngs_modulus = "70 GPa"
supports = [{ at = "0 mm", kind = "clamped" }, { at = "300 mm", kind = "clamped" }]

[sensors]
measure = "strain"
count = 6

[contact]
force = "2 N"

[training]
arrangement = "even"
count = 10
repeats = 2

[estimator]
kind = "influence"
"#;
const FORCE_N: f64 = 2.0;
/// Largest reading of a press, in standard deviations of the noise.
const LARGEST_SD: f64 = 3455.0;

/// Reading of a force that is felt, in standard deviations of the noise: single readings show a touch from 8 on.
const FELT_SD: f64 = 10.0;

/// What came of a calibration.
#[derive(Debug, Default, PartialEq)]
struct Outcome {
    /// Presses recorded while the force was below nine tenths of that of a press.
    without_touch: usize,
    /// Untouched rows recorded while a force was felt.
    touched: usize,
    presses: usize,
    asked_again: usize,
    /// Longest time in one step, in seconds.
    longest_s: f64,
    /// Notes that the board repeats readings.
    repeats_noted: usize,
    is_finished: bool,
}

/// The rig, with noise such that the largest press reads [`LARGEST_SD`] of it.
fn rig() -> (Rig, f64) {
    let rig = Rig::from_toml(STRIP).unwrap();
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
    let text = STRIP.replace("count = 6", &format!("count = 6\nnoise = \"{} um/m\"", noise * 1e6));
    (Rig::from_toml(&text).unwrap(), noise)
}

fn calibrate(style: HandStyle, faults: FaultConfig, rate_hz: f64, seed: u64) -> Outcome {
    let (rig, noise) = rig();
    let hysteresis = faults.hysteresis;
    let folder = tempfile::tempdir().unwrap();
    let presses = folder.path().join("presses.csv");
    let journal =
        Journal::new(&rig.setup, &presses, "test".to_owned(), Vec::new(), DepthKnowledge::Unknown).unwrap();
    let plan = plan(&rig, Weights::default(), &[], &[]).unwrap();
    let mut calibration = Calibration::new(&rig.setup, None, &[], plan, journal).unwrap();
    let config = BoardConfig { seed, rate_hz, ..BoardConfig::default() };
    let finger = Finger::random(&rig, seed);
    let mut board = SimulatedBoard::new(&rig.setup, &config, finger).unwrap().with_faults(faults, seed);
    let mut hand = Hand::new(style, rig.setup.surface().extent(), seed);
    let start = HostClock::new().now();
    let mut outcome = Outcome::default();
    // Contact at every reading, by the time that the rows carry.
    let mut contacts = Vec::new();
    let (mut waiting, mut since_s) = (Waiting::Untouched, 0.0);
    for _ in 0..400_000 {
        let time = board.next_at();
        let guide = calibration.guide();
        let next = guide.next_press().map(|(_, press)| press);
        if guide.waiting() != waiting {
            (waiting, since_s) = (guide.waiting(), time.as_secs_f64());
        }
        outcome.longest_s = outcome.longest_s.max(time.as_secs_f64() - since_s);
        let instruction = match (waiting, next) {
            (Waiting::Press, Some(press)) => {
                Instruction::Press(Contact { position: press.position, force_n: FORCE_N })
            }
            (Waiting::Rest, _) => Instruction::Hold,
            _ => Instruction::Lift,
        };
        let contact = hand.contact_at(time.as_secs_f64(), instruction);
        contacts.push(contact);
        board.finger_mut().hold(contact);
        let bytes = board.next_frame().unwrap_or_default();
        let at = palpate_live::stamp::Stamp { elapsed: time, ..start };
        let mut notes = Vec::new();
        calibration.receive(&Arrived { at, arrival: Arrival::Bytes(bytes) }, &mut notes).unwrap();
        outcome.repeats_noted += notes.iter().filter(|note| **note == Note::RepeatedReadings).count();
        outcome.asked_again += notes.iter().filter(|note| matches!(note, Note::AskedAgain(_))).count();
        if waiting == Waiting::Nothing || time > Duration::from_secs(1000) {
            break;
        }
    }
    let bench = SimulatedBench::new(&rig.setup, 0).unwrap();
    let untouched = bench.clean(&[]);
    let felt_sd = |contact: Option<Contact>| {
        let reading = bench.clean(contact.as_slice());
        reading.iter().zip(&untouched).fold(0.0_f64, |size, (value, zero)| size.max((value - zero).abs()))
            / noise
    };
    outcome.is_finished = calibration.guide().waiting() == Waiting::Nothing;
    for row in calibration.journal().rows() {
        let reading_number = (row.time_s.unwrap() * config.rate_hz).round() as usize;
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
        ("hysteresis 1 %", FaultConfig { hysteresis: 0.01, converter_step: noise, ..FaultConfig::default() }),
        (
            "hysteresis 3 %, drift",
            FaultConfig { hysteresis: 0.03, drift_per_s: 2.0 * noise, ..FaultConfig::default() },
        ),
        (
            "creep, residue, drift",
            FaultConfig {
                creep: 0.03,
                creep_s: 5.0,
                residue: 0.01,
                residue_s: 20.0,
                drift_per_s: noise,
                ..FaultConfig::default()
            },
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
    let repeating = |repeats| FaultConfig { repeats, ..ideal.clone() };
    let worn = FaultConfig { hysteresis: 0.01, converter_step: noise, drift_per_s: noise, ..ideal.clone() };
    let runs = [
        ("quick, each reading twice", exact, 100.0, repeating(1)),
        ("slow, each reading 10 times", slow, 100.0, repeating(9)),
        (
            "early lift, each reading 5 times, hysteresis, drift",
            early,
            100.0,
            FaultConfig { repeats: 4, ..worn.clone() },
        ),
        ("tapping, each reading 25 times", HandStyle { taps: 2, ..exact }, 200.0, repeating(24)),
        ("quick, 10 readings a second", exact, 10.0, ideal.clone()),
        ("hovering, 10 readings a second, hysteresis, drift", hovering, 10.0, worn),
    ];
    let mut asked_again = 0;
    for (i, (name, style, rate_hz, faults)) in runs.into_iter().enumerate() {
        let repeats_noted = usize::from(faults.repeats > 0);
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
