//! A machine that presses by itself: lines of G-code, faults, and a calibration without a user.

use palpate_estimators::evaluation::{Evaluation, limit_ratio};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::simulate::SimulatedBench;
use palpate_live::calibration::{AwaitedStep, Guide, Press, Progress};
use palpate_live::stage::{
    FaultKind, Finger, Firmware, GcodeStage, Greeting, MachineConfig, MachineFault, SimulatedLink,
    SimulatedMachine, StageError, StageLink, StopReason, Stopping,
};
use palpate_mechanics::contact::Position;
use palpate_mechanics::units::mm;
use palpate_rig::{Rig, Stage};
use std::io::{self, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
const DEPTH_M: f64 = 1.5e-3;
const FIRMWARES: [Firmware; 2] = [Firmware::Marlin, Firmware::Grbl];

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
        dtr_reset: false,
    }
}

fn rig() -> Rig {
    Rig::from_toml(RIG).unwrap()
}

fn machine(firmware: Firmware, config: MachineConfig) -> SimulatedMachine {
    SimulatedMachine::with_config(firmware, stage_setup(), rig().setup.surface().extent(), 3.0, config)
}

fn connect(machine: &SimulatedMachine) -> Result<GcodeStage<SimulatedLink>, StageError> {
    GcodeStage::connect(machine.link(), stage_setup(), Arc::default())
}

/// Homes, and presses at three places.
fn press_three_places(machine: &SimulatedMachine) -> Result<(), StageError> {
    let mut stage = connect(machine)?;
    stage.home()?;
    for at_mm in [60.0, 210.0, 270.0] {
        stage.travel(Position::along(mm(at_mm)))?;
        assert_eq!(machine.contact(), None, "it travels at a safe height");
        stage.press(DEPTH_M)?;
        let contact = machine.contact().unwrap();
        assert!((contact.position.x_m - mm(at_mm)).abs() < 1e-4, "pressed at {contact:?}, not {at_mm} mm");
        stage.lift()?;
    }
    Ok(())
}

#[test]
fn finger_is_where_lines_send_it_of_either_firmware() {
    for firmware in FIRMWARES {
        let machine = machine(firmware, MachineConfig::default());
        let mut stage = connect(&machine).unwrap();
        assert_eq!((stage.firmware(), stage.stopping()), (firmware, Stopping::AtOnce));
        assert!(matches!(stage.travel(Position::along(mm(100.0))), Err(StageError::NotHomed)));
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

/// Slow or quiet machines still execute every move when it is requested.
#[test]
fn slow_and_quiet_machines_stay_in_step() {
    let seconds = Duration::from_secs;
    let plain = || MachineConfig { is_paced: true, ..MachineConfig::default() };
    let configs = [
        MachineConfig { greeting: Greeting::None, ..plain() },
        MachineConfig { greeting: Greeting::After(seconds(2)), ..plain() },
        MachineConfig { greeting: Greeting::After(seconds(8)), ..plain() },
        MachineConfig { greeting: Greeting::None, delay: seconds(2), ..plain() },
        MachineConfig { greeting: Greeting::After(seconds(4)), delay: seconds(4), ..plain() },
        MachineConfig { delay: Duration::from_millis(700), ..plain() },
        MachineConfig { homing: seconds(240), ..plain() },
        MachineConfig { emergency_parser: false, ..plain() },
    ];
    for firmware in FIRMWARES {
        for config in &configs {
            let machine = machine(firmware, config.clone());
            let outcome = press_three_places(&machine);
            assert!(outcome.is_ok(), "{firmware:?} {config:?}: {outcome:?}");
            assert_eq!(machine.unsafe_moves(), 0, "{firmware:?} {config:?}");
        }
    }
}

/// The lines at which a fault occurs, in the dialect of the firmware.
fn lines_of(firmware: Firmware) -> [(&'static str, u32); 6] {
    match firmware {
        // A travel, a press, the lift after it, the wait of a travel, the wait of a press, homing.
        Firmware::Marlin => [("G1 X", 2), ("G1 Z", 4), ("G1 Z", 5), ("M400", 2), ("M400", 3), ("G28", 1)],
        Firmware::Grbl => [("G1 X", 2), ("G1 Z", 4), ("G1 Z", 5), ("G4", 2), ("G4", 3), ("$H", 1)],
    }
}

/// Every fault, at every kind of line, of either firmware: only a lift follows, the machine is halted, and the finger is up if the message states it.
#[test]
fn any_fault_stops_the_machine_and_lifts_or_reports() {
    use FaultKind::*;
    let kinds = [Unknown, Lost, Silence, Resend, HomeFirst, Error, Reset, ResetMoving, Endstop, ExtraOk];
    for firmware in FIRMWARES {
        for (line, nth) in lines_of(firmware) {
            for kind in kinds {
                for is_paced in [false, true] {
                    // Only Marlin has an emergency parser.
                    for emergency_parser in
                        [true, false].into_iter().take(1 + usize::from(firmware == Firmware::Marlin))
                    {
                        let faults = vec![MachineFault { kind, line: line.to_owned(), nth }];
                        let config =
                            MachineConfig { faults, is_paced, emergency_parser, ..MachineConfig::default() };
                        let name = format!("{firmware:?} {config:?}");
                        let machine = machine(firmware, config);
                        stops_for_a_fault(&machine, kind, &name);
                    }
                }
            }
        }
    }
}

fn stops_for_a_fault(machine: &SimulatedMachine, kind: FaultKind, name: &str) {
    let outcome = press_three_places(machine);
    assert_eq!(machine.faults_met(), 1, "{name}: {outcome:?}");
    let Err(StageError::Unexpected { reason: doubt, finger }) = outcome else {
        panic!("{name}: {outcome:?}")
    };
    assert_eq!(machine.unsafe_moves(), 0, "{name}: {doubt}");
    // A Marlin that halts by itself reads no stop any more.
    assert!(machine.is_stopped() || kind == FaultKind::Error, "{name}: {doubt}");
    match finger {
        Finger::Lifted | Finger::Up => assert_eq!(machine.contact(), None, "{name}: {doubt}"),
        Finger::Unknown => assert!(
            matches!(
                kind,
                FaultKind::Silence
                    | FaultKind::Error
                    | FaultKind::Reset
                    | FaultKind::ResetMoving
                    | FaultKind::Endstop
                    | FaultKind::HomeFirst
            ) || name.contains("G28")
                || name.contains("$H"),
            "{name}: could be lifted after `{doubt}`"
        ),
        Finger::Unmoved => panic!("{name}: it has moved"),
    }
    let words = StageError::Unexpected { reason: doubt, finger }.to_string();
    let quote = match (kind, name.starts_with("Marlin")) {
        (FaultKind::Unknown, true) => "echo:Unknown command",
        (FaultKind::Unknown, false) => "error:20",
        (FaultKind::Resend, true) => "Error:Line Number is not Last Line Number+1",
        (FaultKind::HomeFirst, true) => "echo:Home XYZ First",
        (FaultKind::Error, true) => "Error:Printer halted. kill() called!",
        (FaultKind::Error | FaultKind::Endstop, false) => "ALARM:1",
        (FaultKind::Endstop, true) => "echo:endstops hit",
        (FaultKind::Reset | FaultKind::ResetMoving, _) => "was reset",
        (FaultKind::Lost | FaultKind::Silence, _) => "did not answer",
        (FaultKind::ExtraOk, _) => "`ok`",
        (_, false) => "error:",
    };
    assert!(words.contains(quote), "{name}: {words}");
}

#[test]
fn reset_at_rest_is_seen_before_the_next_move() {
    for firmware in FIRMWARES {
        let machine = machine(firmware, MachineConfig::default());
        let mut stage = connect(&machine).unwrap();
        stage.home().unwrap();
        stage.travel(Position::along(mm(100.0))).unwrap();
        stage.press(DEPTH_M).unwrap();
        stage.watch().unwrap();
        machine.open();
        let error = stage.watch().unwrap_err();
        assert!(
            matches!(
                error,
                StageError::Unexpected { reason: StopReason::Restart { .. }, finger: Finger::Unknown }
            ),
            "{error}"
        );
        assert!(matches!(stage.lift(), Err(StageError::Stopped)));
        assert_eq!(machine.unsafe_moves(), 0);
        assert!(machine.is_stopped());
    }
}

#[test]
fn clamped_position_is_no_place() {
    for firmware in FIRMWARES {
        let any = (f64::NEG_INFINITY, f64::INFINITY);
        let soft_limits_m = Some([(0.0, mm(215.0)), any, any]);
        let machine = machine(firmware, MachineConfig { soft_limits_m, ..MachineConfig::default() });
        let error = press_three_places(&machine).unwrap_err();
        let words = match firmware {
            Firmware::Marlin => {
                "the machine reports X 215.00 mm and was sent to X 225.00 mm; it was stopped with its finger up"
            }
            Firmware::Grbl => "the machine answered `ALARM:2` to `G1 X225.000 Y40.000 F3000.000`",
        };
        assert!(error.to_string().contains(words), "{error}");
        assert!(machine.is_stopped() && machine.contact().is_none());
    }
}

/// A link that requests a stop at the time `at`.
struct StopAt {
    link: SimulatedLink,
    machine: SimulatedMachine,
    at: Duration,
    stop: Arc<AtomicBool>,
}

impl Read for StopAt {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.link.read(buffer);
        if self.link.now() >= self.at && self.machine.is_moving() {
            self.stop.store(true, Ordering::Relaxed);
            self.at = self.at.min(self.link.now());
        }
        read
    }
}

impl Write for StopAt {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.link.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.link.flush()
    }
}

impl StageLink for StopAt {
    fn now(&self) -> Duration {
        self.link.now()
    }

    fn reset_by_dtr(&mut self) -> io::Result<bool> {
        self.link.reset_by_dtr()
    }

    fn has_dtr(&self) -> bool {
        self.link.has_dtr()
    }
}

/// Stops in the middle of a move, at the instant `at` of the machine's time. Returns the delay until the stop takes effect.
fn stop_during_a_move(
    firmware: Firmware,
    emergency_parser: bool,
    dtr_reset: bool,
    at: Duration,
) -> (Stopping, Duration) {
    let config = MachineConfig { is_paced: true, emergency_parser, ..MachineConfig::default() };
    let machine = machine(firmware, config);
    let stop = Arc::new(AtomicBool::new(false));
    let link = StopAt { link: machine.link(), machine: machine.clone(), at, stop: Arc::clone(&stop) };
    let setup = Stage { dtr_reset, ..stage_setup() };
    let mut stage = GcodeStage::connect(link, setup, Arc::clone(&stop)).unwrap();
    let stopping = stage.stopping();
    let mut outcome = stage.home();
    while outcome.is_ok() {
        outcome = stage
            .travel(Position::along(mm(60.0)))
            .and_then(|()| stage.press(DEPTH_M))
            .and_then(|()| stage.lift())
            .and_then(|()| stage.jog([mm(10.0), 0.0, 0.0]))
            .and_then(|()| stage.lower(stage_setup().touch_z_m))
            .and_then(|()| stage.travel(Position::along(mm(270.0))));
    }
    assert!(matches!(outcome, Err(StageError::Stopped)), "{outcome:?}");
    assert!(!machine.is_moving() && matches!(stage.lift(), Err(StageError::Stopped)));
    // The stop is requested at the first read of a move after `at`.
    (stopping, machine.stopped_at().unwrap().saturating_sub(at))
}

/// Stops at a hundred instants of moves of each machine, in the machine's own time: within 50 ms even if its firmware reads no stop during a move.
#[test]
fn stop_takes_effect_within_50_ms_at_any_time_of_a_move() {
    const STOPS: u64 = 100;
    for (firmware, emergency_parser, dtr_reset, expected) in [
        (Firmware::Marlin, true, false, Stopping::AtOnce),
        (Firmware::Marlin, false, false, Stopping::BetweenMoves),
        (Firmware::Marlin, false, true, Stopping::ByReset),
        (Firmware::Grbl, true, false, Stopping::AtOnce),
    ] {
        let mut took: Vec<Duration> = (0..STOPS)
            .map(|i| {
                // An irrational step spreads the instants over all phases of moves and reads.
                let at = Duration::from_secs_f64(1.0 + 0.1 * (i as f64) * std::f64::consts::FRAC_1_SQRT_2);
                let (stopping, took) = stop_during_a_move(firmware, emergency_parser, dtr_reset, at);
                assert_eq!(stopping, expected);
                took
            })
            .collect();
        took.sort();
        let quantile = |percent: usize| took[(took.len() * percent).div_ceil(100) - 1];
        println!(
            "{} {expected:?}: {STOPS} stops, median {:?}, 99 % within {:?}, the longest {:?}",
            firmware.name(),
            quantile(50),
            quantile(99),
            quantile(100)
        );
        assert!(quantile(100) <= Duration::from_millis(50), "{firmware:?} {expected:?}: {took:?}");
    }
}

/// Jogs stay at the height of travel or above, and no move goes below the deepest press.
#[test]
fn jogs_and_touch_offs_keep_their_heights() {
    for firmware in FIRMWARES {
        let machine = machine(firmware, MachineConfig::default());
        let mut stage = connect(&machine).unwrap();
        assert!(matches!(stage.jog([mm(1.0), 0.0, 0.0]), Err(StageError::NotHomed)));
        stage.home().unwrap();
        let z_mm = |stage: &GcodeStage<SimulatedLink>| (stage.position_m().unwrap()[2] * 1e3).round();
        stage.jog([mm(100.0), mm(40.0), mm(-10.0)]).unwrap();
        assert_eq!((z_mm(&stage), machine.contact()), (57.0, None));
        stage.jog([0.0, 0.0, mm(10.0)]).unwrap();
        stage.jog([0.0, 0.0, mm(-1.0)]).unwrap();
        assert_eq!(z_mm(&stage), 66.0);
        stage.lower(mm(-1000.0)).unwrap();
        let depth_m = stage_setup().touch_z_m - stage.position_m().unwrap()[2];
        assert!((depth_m - DEPTH_M).abs() < 1e-9 && machine.contact().is_some(), "{depth_m}");
        // The finger is lifted before it moves aside.
        stage.jog([mm(1.0), 0.0, mm(-1.0)]).unwrap();
        assert_eq!((z_mm(&stage), machine.contact()), (57.0, None));
    }
}

/// Faults of jogs and of the descent of a touch-off are handled as those of presses.
#[test]
fn any_fault_of_a_jog_or_a_touch_off_stops_the_machine() {
    use FaultKind::*;
    for firmware in FIRMWARES {
        // The lift after homing, a jog, the second step down.
        for (line, nth) in [("G1 X", 1), ("G1 Z", 2), ("G1 Z", 3)] {
            for kind in [Unknown, Lost, Silence, Resend, HomeFirst, Error, Reset, ResetMoving, Endstop] {
                let faults = vec![MachineFault { kind, line: line.to_owned(), nth }];
                let config = MachineConfig { faults, is_paced: true, ..MachineConfig::default() };
                let name = format!("{firmware:?} {config:?}");
                let machine = machine(firmware, config);
                let mut stage = connect(&machine).unwrap();
                let touch_m = stage_setup().touch_z_m;
                let outcome = stage
                    .home()
                    .and_then(|()| stage.jog([mm(100.0), mm(40.0), 0.0]))
                    .and_then(|()| stage.lower(touch_m + mm(1.0)))
                    .and_then(|()| stage.lower(touch_m - mm(1.0)))
                    .and_then(|()| stage.lift());
                assert_eq!(machine.faults_met(), 1, "{name}");
                let Err(StageError::Unexpected { finger, .. }) = outcome else {
                    panic!("{name}: {outcome:?}")
                };
                assert!(machine.is_stopped() || kind == Error, "{name}");
                assert_eq!(machine.unsafe_moves(), 0, "{name}");
                assert!(finger == Finger::Unknown || machine.contact().is_none(), "{name}: {finger:?}");
                assert!(matches!(stage.jog([mm(1.0), 0.0, 0.0]), Err(StageError::Stopped)), "{name}");
            }
        }
    }
}

#[test]
fn machine_does_not_move_after_a_stop() {
    for firmware in FIRMWARES {
        let machine = machine(firmware, MachineConfig::default());
        let stop = Arc::new(AtomicBool::new(false));
        let mut stage = GcodeStage::connect(machine.link(), stage_setup(), Arc::clone(&stop)).unwrap();
        stage.home().unwrap();
        stop.store(true, Ordering::Relaxed);
        assert!(matches!(stage.press(DEPTH_M), Err(StageError::Stopped)));
        assert!(machine.is_stopped());
        assert_eq!(machine.contact(), None);
    }
}

#[test]
fn rejects_numbers_out_of_range_with_their_bound() {
    let machine = machine(Firmware::Grbl, MachineConfig::default());
    let setup = Stage { depths_m: vec![0.0], ..stage_setup() };
    let error = GcodeStage::connect(machine.link(), setup, Arc::default()).unwrap_err().to_string();
    assert!(error.contains("the depth") && error.contains("greater than 0"), "{error}");
}

#[test]
fn rejects_descriptions_of_machines_with_the_parts_that_there_are() {
    let config: MachineConfig = "no-greeting, paced,unknown@G1 Z:3,homing=90s".parse().unwrap();
    assert_eq!((config.greeting, config.homing.as_secs()), (Greeting::None, 90));
    let fault = MachineFault { kind: FaultKind::Unknown, line: "G1 Z".to_owned(), nth: 3 };
    assert_eq!(config.faults, [fault]);
    for wrong in ["fast", "delay=-1s", "delay=1e300s", "unknown@G1:0", "burns@G1", "greeting="] {
        let error = wrong.parse::<MachineConfig>().unwrap_err().to_string();
        assert!(error.contains(wrong) && error.contains("no-emergency-parser"), "{error}");
    }
}

/// A calibration by machine gives a locator with errors near the Cramér–Rao bound.
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
    let machine = machine(Firmware::Marlin, MachineConfig::default());
    let mut stage = connect(&machine).unwrap();
    stage.home().unwrap();
    let mut guide = Guide::new(plan.collect());
    let mut bench = SimulatedBench::new(&rig.setup, 5).unwrap();
    let mut rows: Vec<Row> = Vec::new();
    for reading_number in 0_u32.. {
        let clean = bench.clean(machine.contact().as_slice());
        let at = Duration::from_millis(10) * reading_number;
        match guide.add(at, &bench.measure(&clean)) {
            Progress::Pressed { untouched, press } => {
                rows.extend(untouched.into_iter().chain([press]).map(|row| row.row));
            }
            Progress::Untouched(untouched) => rows.push(untouched.row),
            Progress::Waits(_) | Progress::None => {}
            other => panic!("{other:?}"),
        }
        match (guide.awaited_step(), guide.next_press()) {
            (AwaitedStep::Press, Some((_, press))) => {
                stage.travel(press.position).unwrap();
                stage.press(DEPTH_M).unwrap();
            }
            (AwaitedStep::Release, _) => stage.lift().unwrap(),
            (AwaitedStep::Nothing, _) => break,
            _ => {}
        }
    }
    let recording = Recording::new(rig.setup.layout(), "calibration", rows);
    assert_eq!(recording.touched().rows.len(), positions.len() * training.repeats);
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    let trial = rig.trials(1, 77).unwrap().remove(0);
    let evaluation = Evaluation::new(&locator, &trial.held_out).unwrap();
    let ratio = limit_ratio(&rig.setup, &evaluation).unwrap();
    assert!((0.8..1.2).contains(&ratio), "{ratio} × the limit");
}
