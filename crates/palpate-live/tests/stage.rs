//! A machine that presses by itself: lines of G-code, and a calibration with no hand on it.

use palpate_estimators::evaluation::{Evaluation, limit_ratio};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::simulate::SimulatedBench;
use palpate_live::calibration::{Guide, Press, Progress, Waiting};
use palpate_live::stage::{Firmware, GcodeStage, SimulatedMachine, StageError};
use palpate_mechanics::contact::Position;
use palpate_mechanics::units::mm;
use palpate_rig::{Rig, Stage};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
const DEPTH_M: f64 = 1.5e-3;

fn stage_setup() -> Stage {
    Stage {
        origin_m: (mm(15.0), mm(40.0)),
        touch_z_m: mm(52.0),
        clearance_m: mm(5.0),
        depths_m: vec![DEPTH_M],
        travel_m_per_s: mm(50.0),
        press_m_per_s: mm(2.0),
        load_cell: None,
        force_limit_n: None,
    }
}

fn rig() -> Rig {
    Rig::from_toml(RIG).unwrap()
}

#[test]
fn the_finger_is_where_the_lines_send_it_of_either_firmware() {
    for firmware in [Firmware::Marlin, Firmware::Grbl] {
        let machine = SimulatedMachine::new(firmware, stage_setup(), rig().setup.surface().extent(), 3.0);
        let mut stage = GcodeStage::connect(machine.clone(), stage_setup(), Arc::default()).unwrap();
        assert_eq!(stage.firmware(), firmware);
        assert!(
            matches!(stage.travel(Position::along(mm(100.0))), Err(StageError::Refused { .. })),
            "not homed"
        );
        stage.home().unwrap();
        stage.travel(Position::along(mm(123.0))).unwrap();
        assert_eq!(machine.contact(), None);
        stage.press(DEPTH_M).unwrap();
        let contact = machine.contact().unwrap();
        assert!((contact.position.x_m - mm(123.0)).abs() < 1e-9 && (contact.force_n - 3.0).abs() < 1e-9);
        stage.lift().unwrap();
        assert_eq!(machine.contact(), None);
    }
}

#[test]
fn a_stop_reaches_the_machine_and_nothing_moves_after_it() {
    for firmware in [Firmware::Marlin, Firmware::Grbl] {
        let machine = SimulatedMachine::new(firmware, stage_setup(), rig().setup.surface().extent(), 3.0);
        let stop = Arc::new(AtomicBool::new(false));
        let mut stage = GcodeStage::connect(machine.clone(), stage_setup(), Arc::clone(&stop)).unwrap();
        stage.home().unwrap();
        stop.store(true, Ordering::Relaxed);
        assert!(matches!(stage.press(DEPTH_M), Err(StageError::Stopped)));
        assert!(machine.is_stopped());
        assert_eq!(machine.contact(), None);
    }
}

#[test]
fn numbers_out_of_range_are_refused_with_their_bound() {
    let machine = SimulatedMachine::new(Firmware::Grbl, stage_setup(), rig().setup.surface().extent(), 3.0);
    let setup = Stage { depths_m: vec![0.0], ..stage_setup() };
    let error = GcodeStage::connect(machine, setup, Arc::default()).unwrap_err().to_string();
    assert!(error.contains("the depth") && error.contains("greater than 0"), "{error}");
}

/// From nothing to a locator that is near what physics allows, by machine.
#[test]
fn a_machine_calibrates_by_itself_to_the_limit() {
    let rig = rig();
    let training = rig.training.as_ref().unwrap();
    let force_n = rig.setup.force_n().unwrap();
    let positions = training.positions(rig.setup.surface().extent()).unwrap();
    let plan = positions.iter().flat_map(|position| {
        std::iter::repeat_n(
            Press { position: *position, force_n: Some(force_n), depth_m: None },
            training.repeats,
        )
    });
    let machine =
        SimulatedMachine::new(Firmware::Marlin, stage_setup(), rig.setup.surface().extent(), force_n);
    let mut stage = GcodeStage::connect(machine.clone(), stage_setup(), Arc::default()).unwrap();
    stage.home().unwrap();
    let mut guide = Guide::new(plan.collect());
    let mut bench = SimulatedBench::new(&rig.setup, 5).unwrap();
    let mut rows: Vec<Row> = Vec::new();
    for reading_number in 0_u32.. {
        let clean = bench.clean(machine.contact().as_slice());
        let at = Duration::from_millis(10) * reading_number;
        match guide.add(at, &bench.measure(&clean)) {
            Progress::Pressed { untouched, press } => {
                rows.extend(untouched.into_iter().chain([press]).map(|row| row.row))
            }
            Progress::Untouched(untouched) => rows.push(untouched.row),
            Progress::Waits(_) | Progress::None => {}
            other => panic!("{other:?}"),
        }
        match (guide.waiting(), guide.next_press()) {
            (Waiting::Press, Some((_, press))) => {
                stage.travel(press.position).unwrap();
                stage.press(DEPTH_M).unwrap();
            }
            (Waiting::Release, _) => stage.lift().unwrap(),
            (Waiting::Nothing, _) => break,
            _ => {}
        }
    }
    let recording = Recording::new(rig.setup.layout(), "calibration", rows);
    assert_eq!(recording.touched().rows.len(), positions.len() * training.repeats);
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    let trial = rig.trials(1, 77).unwrap().remove(0);
    let evaluation = Evaluation::new(&locator, &trial.judged).unwrap();
    let ratio = limit_ratio(&rig.setup, &evaluation).unwrap();
    assert!((0.8..1.2).contains(&ratio), "{ratio} × the limit");
}
