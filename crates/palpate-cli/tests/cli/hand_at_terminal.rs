//! Hands of several kinds follow what `palpate calibrate` says, and press a board at a pseudo-terminal.
#![cfg(unix)]

use crate::support::attempt::Attempt;
use crate::support::command::folder;
use palpate_estimators::estimator::Locator;
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation};
use palpate_estimators::simulate::SimulatedBench;
use palpate_live::simulated_board::{
    BoardConfig, FaultConfig, Finger, HandStyle, Instruction, Link, SimulatedBoard, SimulatedHand,
};
use palpate_mechanics::contact::{Contact, Position};
use palpate_rig::Rig;
use palpate_testing::strip::{STRIP_FORCE_N as FORCE_N, clamped_strip};
use std::thread;
use std::time::{Duration, Instant};

/// Noise of the gauges, a 3,000th of the largest press or less.
const NOISE: f64 = 0.03e-6;
const PRESSES: usize = 6;
/// Longest time of a calibration, under load too.
const PATIENCE: Duration = Duration::from_secs(180);

/// Presses that were recorded, and those among them whose reading is nearer the untouched one than that of the press.
#[derive(Debug, PartialEq)]
struct Outcome {
    presses: usize,
    without_touch: usize,
    asked_again: usize,
}

/// The instruction of a line, after which the hand does something else.
fn instruction(line: &str) -> Option<Instruction> {
    if let Some((place, _)) = line.strip_prefix("press at ").and_then(|rest| rest.split_once(" mm")) {
        let position = Position::along(1e-3 * place.parse::<f64>().ok()?);
        return Some(Instruction::Press(Contact { position, force_n: FORCE_N }));
    }
    match line {
        "hold" => Some(Instruction::Hold),
        "let go" | "leave the surface alone" => Some(Instruction::Lift),
        _ => None,
    }
}

fn calibrate(style: HandStyle, faults: FaultConfig, seed: u64) -> Outcome {
    let strip = clamped_strip(1e6 * NOISE).replace("count = 10", "count = 3");
    let rig = Rig::from_toml(&strip).unwrap();
    let bench = folder(strip);
    let mut link = Link::open(&"pty".parse().unwrap()).unwrap();
    let config = BoardConfig { seed, ..BoardConfig::default() };
    let board = SimulatedBoard::new(&rig.setup, &config, Finger::random(&rig, seed)).unwrap();
    let mut board = board.with_faults(faults, seed).unwrap();
    let mut hand = SimulatedHand::new(style, rig.setup.surface().extent(), seed);
    let from = format!("serial://{}", link.name());
    let arguments =
        ["calibrate", "rig.toml", "--from", &from, "--presses", "presses.csv", "--out", "strip.json"];
    let mut attempt = Attempt::begin(bench.path(), &arguments);
    let start = Instant::now();
    let mut now = Instruction::Lift;
    let code = loop {
        while let Some(line) = attempt.line() {
            now = instruction(&line).unwrap_or(now);
        }
        if let Some(code) = attempt.ended() {
            break code;
        }
        assert!(start.elapsed() < PATIENCE, "{style:?}: {}", attempt.said());
        while board.next_at() <= start.elapsed() {
            let contact = hand.contact_at(board.next_at().as_secs_f64(), now);
            board.finger_mut().set_contact(contact);
            link.send(&board.next_frame().unwrap_or_default()).unwrap();
        }
        thread::sleep(Duration::from_millis(2));
    };
    let said = attempt.said();
    assert_eq!(code, Some(0), "{style:?}: {said}");
    Locator::from_json(&std::fs::read_to_string(bench.path().join("strip.json")).unwrap()).unwrap();
    let presses = std::fs::read(bench.path().join("presses.csv")).unwrap();
    let recording = rig.setup.read_recording("presses.csv", presses.as_slice()).unwrap();
    let simulated = SimulatedBench::new(&rig.setup, 0).unwrap();
    let distance = |reading: &[f64], contacts: &[Contact]| {
        let clean = simulated.clean(contacts);
        reading.iter().zip(clean).map(|(value, clean)| (value - clean).powi(2)).sum::<f64>()
    };
    let is_untouched = |reading: &[f64], position| {
        distance(reading, &[]) < distance(reading, &[Contact { position, force_n: FORCE_N }])
    };
    let rows = &recording.touched().rows;
    Outcome {
        presses: rows.len(),
        without_touch: rows.iter().filter(|row| is_untouched(&row.reading, row.position)).count(),
        asked_again: said.matches("press rejected:").count(),
    }
}

#[test]
fn hands_of_all_kinds_calibrate_a_board_at_a_serial_port() {
    let exact = HandStyle { placement_m: 5e-4, ..HandStyle::default() };
    let imperfect = |imperfections| FaultConfig { imperfections, ..FaultConfig::default() };
    let hysteresis = |hysteresis| imperfect(Imperfections { hysteresis, ..Imperfections::default() });
    let drift = imperfect(Imperfections {
        hysteresis: 0.01,
        drift: OffsetDrift { line_per_s: Amount::Value(2.0 * NOISE), ..OffsetDrift::default() },
        creep: [Relaxation { share: 0.03, time_s: 5.0 }, Relaxation::default()],
        ..Imperfections::default()
    });
    let hands = [
        ("quick", exact, FaultConfig::default()),
        ("slow", HandStyle { press_s: 1.0, lift_s: 1.0, ..exact }, hysteresis(0.01)),
        ("early lift", HandStyle { early_lift: 0.3, lift_s: 0.5, ..exact }, drift.clone()),
        ("hovering", HandStyle { hover_share: 0.08, hover_s: 0.8, lift_s: 0.3, ..exact }, hysteresis(0.03)),
        ("tapping", HandStyle { taps: 2, ..exact }, drift),
    ];
    let outcomes: Vec<(&str, Outcome)> = thread::scope(|scope| {
        let run = |(seed, (name, style, faults)): (usize, (&'static str, HandStyle, FaultConfig))| {
            (name, scope.spawn(move || calibrate(style, faults, seed as u64)))
        };
        let running: Vec<_> = hands.into_iter().enumerate().map(run).collect();
        running.into_iter().map(|(name, outcome)| (name, outcome.join().unwrap())).collect()
    });
    for (name, outcome) in outcomes {
        println!("{name}: {outcome:?}");
        assert_eq!((outcome.presses, outcome.without_touch), (PRESSES, 0), "{name}: {outcome:?}");
        assert!(outcome.asked_again <= 2, "{name}: {outcome:?}");
    }
}
