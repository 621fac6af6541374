//! Calibrations by a machine, started and stopped by requests: a simulated machine moves the finger of a simulated board.

use crate::client::{get, post};
use palpate_live::calibration::Statements;
use palpate_live::server::{Access, CalibrationPlan, Live, Server};
use palpate_live::simulated_board::{BoardConfig, Finger, Link, LoadCell, SimulatedBoard};
use palpate_live::stage::{Firmware, MachineConfig, SimulatedMachine};
use palpate_live::stamp::HostClock;
use palpate_rig::Rig;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Factor by which the clocks of server, board and machine run fast.
const SPEED: u32 = 5;
/// Timeout of all waits, for a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Time after which the user counts as absent, with a margin.
const ABSENCE: Duration = Duration::from_secs(6);

fn rig() -> Rig {
    rig_with_repeats(1)
}

fn rig_with_repeats(repeats: usize) -> Rig {
    let text = include_str!("../../../../examples/fsi-like.toml");
    let text = text.replace("repeats = 3", &format!("repeats = {repeats}"));
    Rig::from_toml(&text.replace("count = 9", "count = 4")).unwrap()
}

/// Board and machine behind TCP, until it is dropped.
struct Bench {
    from: String,
    stage: String,
    machine: SimulatedMachine,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Bench {
    fn start() -> Self {
        Self::with(Firmware::Marlin, MachineConfig::default())
    }

    fn with(firmware: Firmware, config: MachineConfig) -> Self {
        let open = || Link::open(&"tcp://:0".parse().unwrap()).unwrap();
        let (mut to, mut way) = (open(), open());
        let at = |link: &Link| link.name().rsplit(' ').next().unwrap().to_owned();
        let (from, stage) = (at(&to), format!("gcode:{}", at(&way)));
        let rig = rig();
        let setup = rig.stage.clone().unwrap();
        let extent = rig.setup.surface().extent();
        let machine = SimulatedMachine::with_config(firmware, setup, extent, 1.0, config);
        let ends = Arc::new(AtomicBool::new(false));
        let (moved, over) = (machine.clone(), Arc::clone(&ends));
        let thread = std::thread::spawn(move || {
            let load_cell = Some(LoadCell { name: "F".to_owned(), noise_n: 2e-3 });
            let config = BoardConfig { rate_hz: 100.0, seed: 1, load_cell, ..BoardConfig::default() };
            let mut board = SimulatedBoard::new(&rig.setup, &config, Finger::random(&rig, 1)).unwrap();
            let (clock, machine, mut was_there) = (HostClock::with_speed(SPEED), moved, false);
            while !over.load(Ordering::Relaxed) {
                machine.advance_to(clock.elapsed());
                match way.bytes().unwrap() {
                    Some(bytes) => {
                        if !std::mem::replace(&mut was_there, true) {
                            machine.open();
                        }
                        machine.receive(&bytes);
                        way.send(&machine.take_answers()).unwrap();
                    }
                    None => was_there = false,
                }
                board.finger_mut().set_contact(machine.contact());
                while board.next_at() <= clock.elapsed() {
                    if let Some(frame) = board.next_frame() {
                        to.send(&frame).unwrap();
                    }
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        Self { from, stage, machine, ends, thread: Some(thread) }
    }
}

impl Bench {
    /// Waits until the machine is stopped.
    fn is_told_to_stop(&self) {
        let start = Instant::now();
        while !self.machine.is_stopped() {
            assert!(start.elapsed() < Duration::from_secs(1));
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
    }
}

fn served(folder: &Path, from: &str, stage: Option<&str>) -> (Arc<Live>, Server) {
    served_rig(rig(), folder, from, stage)
}

fn served_rig(rig: Rig, folder: &Path, from: &str, stage: Option<&str>) -> (Arc<Live>, Server) {
    let plan = CalibrationPlan {
        rig,
        from: from.parse().unwrap(),
        presses: folder.join("presses.csv"),
        out: folder.join("locator.json"),
        comment: "a test".to_owned(),
        force_n: None,
        machine: stage.map(|stage| stage.parse().unwrap()),
        before: Vec::new(),
        statements: Statements::default(),
        seed: 0,
    };
    let live = Arc::new(Live::calibrating(plan, PathBuf::new(), HostClock::with_speed(SPEED)));
    let address: SocketAddr = "127.0.0.1:0".parse().unwrap();
    let access = Access::new(address, None, Vec::new()).unwrap();
    let server = Server::start(address, access, Arc::clone(&live)).unwrap();
    (live, server)
}

fn step(server: &Server, step: &str) -> (u16, Value) {
    post(server, "/api/calibration", &json!({ "step": step }).to_string())
}

/// Waits for a state that satisfies `is_so`. The requests count as attendance.
fn waited(server: &Server, is_so: impl Fn(&Value) -> bool) -> Value {
    let start = Instant::now();
    loop {
        let state = get(server, "/api/calibration").1;
        if is_so(&state) {
            return state;
        }
        assert!(start.elapsed() < PATIENCE, "{state}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_machine_is_stopped_gone_on_with_and_ends_in_a_locator() {
    let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::start());
    let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
    let ready = get(&server, "/api/calibration").1;
    let moves = &ready["machine"]["moves"];
    assert_eq!((&ready["left"], &ready["machine"]["runs"]), (&json!(8), &json!(false)));
    assert_eq!(moves["depths_mm"], json!([1.0, 2.0]));
    assert_eq!((&moves["travel_z_mm"], &moves["force_limit_n"]), (&json!(27.0), &json!(3.0)));
    assert_eq!(bench.machine.contact(), None, "nothing moves before somebody begins");

    assert_eq!(step(&server, "begin").0, 200);
    assert_eq!(step(&server, "begin").0, 409);
    let pressed = waited(&server, |state| state["taken"] == 2);
    assert!(pressed["machine"]["runs"] == true && pressed["machine"]["firmware"] == "Marlin", "{pressed}");
    assert!(pressed["machine"]["x_mm"].is_number() && pressed["machine"]["left_s"].is_number(), "{pressed}");
    // Steps that would skip a press of the machine are refused, with the required step.
    for refused in ["redo", "skip", "finish"] {
        let (status, answer) = step(&server, refused);
        assert_eq!((status, &answer["help"]), (409, &json!("end it early, or wait until it has ended")));
    }
    assert_eq!(post(&server, "/api/emergency-stop", "{}").0, 200);
    let stopped = waited(&server, |state| state["machine"]["runs"] == false);
    bench.is_told_to_stop();
    assert_eq!(stopped["phase"], "ready");
    let problem = stopped["problem"].as_str().unwrap();
    assert!(problem.contains("stopped by hand") && problem.contains("reset it"), "{problem}");

    assert_eq!(step(&server, "begin").0, 200);
    let all = waited(&server, |state| state["phase"] == "ready");
    assert_eq!((&all["taken"], &all["left"], &all["problem"]), (&json!(8), &json!(0), &Value::Null));
    assert!(!bench.machine.is_stopped(), "it ends with its finger lifted, not with a stop");
    assert_eq!(bench.machine.contact(), None);
    assert_eq!(step(&server, "finish").0, 200);
    let done = waited(&server, |state| state["phase"] == "done" || state["problem"].is_string());
    assert_eq!((&done["outcome"]["presses"], &done["can_check"]), (&json!(8), &json!(true)), "{done}");
    assert_eq!(get(&server, "/api/session").1["source"], bench.from.as_str());

    assert_eq!(step(&server, "check").0, 200);
    let checked = waited(&server, |state| state["phase"] == "done");
    let check = &checked["check"];
    assert_eq!(
        (&checked["problem"], check["places"].as_array().unwrap().len()),
        (&Value::Null, 5),
        "{checked}"
    );
    assert!(check["median_mm"].as_f64().unwrap() < 1.0 && check["covered"].is_u64(), "{check}");
    assert!(!bench.machine.is_stopped() && bench.machine.contact().is_none());
    // A stopped check leaves the locator in use, and assesses it with the recorded presses.
    assert_eq!(step(&server, "check").0, 200);
    waited(&server, |state| state["phase"] == "checking" && state["taken"] == 2);
    assert_eq!(post(&server, "/api/emergency-stop", "{}").0, 200);
    let stopped = waited(&server, |state| state["phase"] == "done");
    assert!(stopped["problem"].as_str().unwrap().contains("stopped by hand"), "{stopped}");
    let places = stopped["check"]["places"].as_array().unwrap().len();
    assert!((2..5).contains(&places) && bench.machine.is_stopped(), "{stopped}");
    assert_eq!(get(&server, "/api/session").1["source"], bench.from.as_str());
    live.end();
}

#[test]
fn a_machine_that_ends_early_lifts_its_finger() {
    let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::start());
    let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
    step(&server, "begin");
    waited(&server, |state| state["taken"] == 1);
    assert_eq!(step(&server, "stop").0, 200);
    let ended = waited(&server, |state| state["phase"] == "ready");
    assert!(ended["left"].as_u64().unwrap() > 0 && ended["problem"].is_null(), "{ended}");
    assert!(!bench.machine.is_stopped() && bench.machine.contact().is_none());
    live.end();
}

#[test]
fn unattended_machine_lifts_its_finger_and_ends() {
    let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::start());
    // More presses than fit into the time after which the user counts as absent.
    let rig = rig_with_repeats(20);
    let (live, server) = served_rig(rig, folder.path(), &bench.from, Some(&bench.stage));
    step(&server, "begin");
    std::thread::sleep(ABSENCE);
    let state = get(&server, "/api/calibration").1;
    assert_eq!((&state["phase"], &state["machine"]["runs"]), (&json!("ready"), &json!(false)));
    assert!(state["problem"].as_str().unwrap().contains("no page has been open for 5 s"), "{state}");
    assert!((1..160).contains(&state["taken"].as_u64().unwrap()), "{state}");
    assert!(!bench.machine.is_stopped() && bench.machine.contact().is_none());
    live.end();
}

#[test]
fn a_server_that_ends_stops_the_machine() {
    let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::start());
    let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
    step(&server, "begin");
    waited(&server, |state| state["taken"] == 1);
    live.end();
    bench.is_told_to_stop();
}

/// A machine that starts the descent and never confirms it. Returns its lines with the instants of their arrival.
fn stuck_machine() -> (String, Receiver<(Instant, String)>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("gcode:tcp://{}", listener.local_addr().unwrap());
    let (tell, told) = channel();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let (setup, extent) = (rig().stage.unwrap(), rig().setup.surface().extent());
        // The third wait is that of the first press.
        let config = "lost@M400:3".parse().unwrap();
        let machine = SimulatedMachine::with_config(Firmware::Marlin, setup, extent, 1.0, config);
        stream.write_all(&machine.take_answers()).unwrap();
        for line in BufReader::new(stream.try_clone().unwrap()).lines().map_while(Result::ok) {
            machine.receive(format!("{line}\n").as_bytes());
            if tell.send((Instant::now(), line)).is_err()
                || stream.write_all(&machine.take_answers()).is_err()
            {
                return;
            }
        }
    });
    (url, told)
}

#[test]
fn a_stop_reaches_a_machine_that_is_in_the_middle_of_a_press() {
    let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::start());
    let (stage, lines) = stuck_machine();
    let (live, server) = served(folder.path(), &bench.from, Some(&stage));
    step(&server, "begin");
    while !lines.recv_timeout(PATIENCE).unwrap().1.starts_with("G1 Z21") {}
    assert_eq!(lines.recv_timeout(PATIENCE).unwrap().1, "M400");
    // A full second of requests must not delay the stop request.
    while post(&server, "/api/mark", "{}").0 != 429 {}
    let asked = Instant::now();
    assert_eq!(post(&server, "/api/emergency-stop", "").0, 200);
    let (at, line) = lines.recv_timeout(PATIENCE).unwrap();
    assert_eq!(line, "M112");
    let took = at - asked;
    println!("from the request to the stop at the machine: {took:?}");
    assert!(took < Duration::from_millis(250), "{took:?}");
    waited(&server, |state| state["phase"] == "ready");
    live.end();
}

/// A fault of a machine in the middle of a run, with the message of the page.
struct FaultCase {
    config: String,
    /// Text of the problem, for Marlin and for GRBL.
    words: [&'static str; 2],
    finger: &'static str,
    /// Presses recorded before the fault.
    taken: usize,
}

const UP: &str = "it was stopped with its finger up";
const LIFTED: &str = "it was stopped, and its finger is lifted";
const UNKNOWN: &str = "it may still press, so lift it by hand";

fn fault_cases(firmware: Firmware) -> Vec<FaultCase> {
    let wait = if firmware == Firmware::Marlin { "M400" } else { "G4" };
    let case = |config: &str, words, finger, taken| FaultCase {
        config: config.replace("WAIT", wait),
        words,
        finger,
        taken,
    };
    // The first `G1 Z` is the lift after homing, the second the first press, the third its lift; the third wait is that of the first press.
    vec![
        case("unknown@G1 X:2", ["`echo:Unknown command: \"G1 X", "`error:20` to `G1 X"], UP, 1),
        case("no-greeting,unknown@G1 Z:2", ["to `G1 Z21.000 F120.000`", "to `G1 Z21.000 F120.000`"], UP, 0),
        case("lost@G1 Z:3", ["did not answer `G1 Z27.000 F3000.000` within 5 s"; 2], LIFTED, 1),
        case("silence@G1 X:2", ["did not answer `"; 2], UP, 1),
        case("silence@WAIT:3", ["did not answer `M400`", "did not answer `G4 P0.01`"], UNKNOWN, 0),
        case("resend@G1 Z:3", ["`Error:Line Number is not Last Line Number+1", "`error:2`"], LIFTED, 1),
        case("home-first@G1 X:2", ["`echo:Home XYZ First`", "`error:9`"], UP, 1),
        case("error@WAIT:3", ["`Error:Printer halted. kill() called!`", "`ALARM:1`"], UNKNOWN, 0),
        case("reset@G1 Z:4", ["was reset: it sent `start`", "was reset: it sent `Grbl 1.1h"], UNKNOWN, 1),
        case(
            "reset-moving@G1 Z:2,paced",
            ["was reset: it sent `start`", "was reset: it sent `Grbl"],
            UNKNOWN,
            0,
        ),
        case("endstop@G1 X:2", ["`echo:endstops hit", "`ALARM:1`"], UP, 1),
        case("extra-ok@G1 Z:3", ["`ok`"; 2], "it was stopped", 1),
        case("soft-limit-x=90mm", ["reports X 90.00 mm and was sent to X 97.50 mm", "`ALARM:2`"], UP, 2),
    ]
}

/// Every kind of fault, of either firmware, from the browser: the page quotes the line, and every row belongs to a press that happened.
#[test]
fn fault_of_a_machine_ends_the_run_with_its_words() {
    let runs = [Firmware::Marlin, Firmware::Grbl].into_iter().enumerate().flat_map(|(of, firmware)| {
        fault_cases(firmware)
            .into_iter()
            .map(move |case| std::thread::spawn(move || ends_with_its_words(firmware, &case, case.words[of])))
    });
    let runs: Vec<_> = runs.collect();
    runs.into_iter().for_each(|run| run.join().unwrap());
}

fn ends_with_its_words(firmware: Firmware, case: &FaultCase, words: &str) {
    let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::with(firmware, case.config.parse().unwrap()));
    let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
    assert_eq!(step(&server, "begin").0, 200);
    let ended = waited(&server, |state| state["machine"]["runs"] == false);
    let problem = ended["problem"].as_str().unwrap_or_default();
    let name = format!("{firmware:?} {}: {problem}", case.config);
    assert!(problem.contains(words) && problem.contains(case.finger), "{name}");
    assert!(problem.contains("reset it"), "the remedy of {name}");
    assert_eq!(ended["taken"], case.taken, "{name}");
    assert_eq!(bench.machine.unsafe_moves(), 0, "{name}");
    // A Marlin that halts by itself reads no stop any more.
    assert!(bench.machine.is_stopped() || case.config.starts_with("error@"), "{name}");
    assert!(case.finger == UNKNOWN || bench.machine.contact().is_none(), "{name}");
    live.end();
}

/// After a reset while the finger rests on the surface, the machine gets no further moves.
#[test]
fn reset_at_rest_ends_the_run() {
    of_both_firmwares(|firmware| {
        let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::with(firmware, MachineConfig::default()));
        let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
        assert_eq!(step(&server, "begin").0, 200);
        waited(&server, |state| state["machine"]["motion"] == "down");
        bench.machine.open();
        let ended = waited(&server, |state| state["machine"]["runs"] == false);
        let problem = ended["problem"].as_str().unwrap_or_default();
        assert!(problem.contains("the machine was reset: it sent `"), "{firmware:?}: {problem}");
        assert_eq!(bench.machine.unsafe_moves(), 0, "{firmware:?}: {problem}");
        live.end();
    });
}

/// The server waits for slow homing, with `busy` messages of Marlin and the silence of GRBL.
#[test]
fn slow_homing_is_waited_for() {
    of_both_firmwares(|firmware| {
        let config = "homing=6s,delay=50ms".parse().unwrap();
        let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::with(firmware, config));
        let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
        assert_eq!(step(&server, "begin").0, 200);
        let pressed = waited(&server, |state| state["taken"] == 1 || state["problem"].is_string());
        assert_eq!(pressed["problem"], Value::Null, "{firmware:?}");
        live.end();
    });
}

/// Runs a test with both firmwares in parallel, because it mostly waits.
fn of_both_firmwares(test: fn(Firmware)) {
    let runs = [Firmware::Marlin, Firmware::Grbl].map(|firmware| std::thread::spawn(move || test(firmware)));
    runs.into_iter().for_each(|run| run.join().unwrap());
}

/// A dry run, jogs and a touch-off from the browser. The presses use the height of the touch-off.
#[test]
fn a_machine_is_set_up_before_its_presses() {
    of_both_firmwares(|firmware| {
        let (folder, bench) = (tempfile::tempdir().unwrap(), Bench::with(firmware, MachineConfig::default()));
        let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
        let ask = |body: Value| post(&server, "/api/calibration", &body.to_string()).0;
        assert_eq!(step(&server, "touch_off").0, 409, "it is not connected");
        assert_eq!(step(&server, "dry_run").0, 200);
        let flown = waited(&server, |state| state["phase"] == "ready");
        assert_eq!(flown["hint"], "Dry run: 4 positions reached at the height of travel, none pressed.");
        assert_eq!((&flown["taken"], &flown["problem"]), (&json!(0), &Value::Null));

        assert_eq!(step(&server, "set_up").0, 200);
        assert_eq!(step(&server, "begin").0, 409);
        waited(&server, |state| state["machine"]["motion"] == "up");
        for wrong in [json!(0), json!(10.5), json!(-1e9), Value::Null] {
            assert_eq!(ask(json!({ "step": "jog", "axis": "x", "by_mm": wrong })), 400, "{wrong}");
        }
        assert_eq!(ask(json!({ "step": "jog", "by_mm": 1 })), 400);
        for _ in 0..7 {
            assert_eq!(ask(json!({ "step": "jog", "axis": "x", "by_mm": 10 })), 200);
        }
        // No jog leads below the height of travel.
        assert_eq!(ask(json!({ "step": "jog", "axis": "z", "by_mm": -10 })), 200);
        waited(&server, |state| state["hint"] == "The finger is at x 70, y 0, z 27 mm of the machine.");
        assert_eq!(step(&server, "touch_off").0, 200);
        let touched = waited(&server, |state| state["machine"]["found_touch_mm"].is_number());
        let touch_mm = touched["machine"]["found_touch_mm"].as_f64().unwrap();
        assert!((touch_mm - 22.0).abs() < 0.06, "{firmware:?}: {touch_mm}");
        assert_eq!(bench.machine.contact(), None);
        assert_eq!(step(&server, "stop").0, 200);
        let ready = waited(&server, |state| state["phase"] == "ready");
        assert_eq!((&ready["problem"], &ready["taken"]), (&Value::Null, &json!(0)));
        assert_eq!(ready["machine"]["moves"]["touch_z_mm"], touched["machine"]["found_touch_mm"]);
        assert!(!bench.machine.is_stopped() && !folder.path().join("presses.csv").exists());
        live.end();
    });
}

/// A touch-off is stopped as presses are: by the button at once, by a fault with its message, and for an absent user with its finger up.
#[test]
fn a_machine_that_is_set_up_stops_as_one_that_presses() {
    of_both_firmwares(|firmware| {
        let down = |config: &str| {
            let (folder, bench) =
                (tempfile::tempdir().unwrap(), Bench::with(firmware, config.parse().unwrap()));
            let (live, server) = served(folder.path(), &bench.from, Some(&bench.stage));
            assert_eq!(step(&server, "set_up").0, 200);
            assert_eq!(step(&server, "touch_off").0, 200);
            (folder, bench, live, server)
        };
        let (_folder, bench, live, server) = down("");
        waited(&server, |state| state["machine"]["motion"] == "down");
        assert_eq!(post(&server, "/api/emergency-stop", "{}").0, 200);
        let stopped = waited(&server, |state| state["phase"] == "ready");
        assert!(stopped["problem"].as_str().unwrap().contains("stopped by hand"), "{stopped}");
        bench.is_told_to_stop();
        live.end();

        // The third step down.
        let (_folder, bench, live, server) = down("unknown@G1 Z:4");
        let ended = waited(&server, |state| state["phase"] == "ready");
        let problem = ended["problem"].as_str().unwrap();
        assert!(problem.contains("to `G1 Z26.700 ") && problem.contains(LIFTED), "{firmware:?}: {problem}");
        assert!(bench.machine.is_stopped() && bench.machine.unsafe_moves() == 0);
        live.end();

        let (_folder, bench, live, server) = down("");
        std::thread::sleep(ABSENCE);
        let ended = get(&server, "/api/calibration").1;
        assert!(ended["problem"].as_str().unwrap().contains("no page has been open"), "{ended}");
        assert!(!bench.machine.is_stopped() && bench.machine.contact().is_none());
        live.end();
    });
}

#[test]
fn impossible_requests_are_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let (live, server) = served(folder.path(), "udp://127.0.0.1:47613", Some("gcode:tcp://127.0.0.1:1"));
    for body in ["", "{", "{}", r#"{"step":"press"}"#, r#"{"step":1}"#] {
        let (status, answer) = post(&server, "/api/calibration", body);
        assert!(status == 400 && answer["help"].is_string(), "{body}: {status} {answer}");
    }
    for url in ["simulated", "tcp://127.0.0.1:1"] {
        let (status, answer) = post(&server, "/api/source", &json!({ "url": url }).to_string());
        assert_eq!(status, 409, "{answer}");
        assert!(answer["error"].as_str().unwrap().contains("udp://"), "{answer}");
        assert!(answer["help"].as_str().unwrap().contains("--calibrate` with another --from"), "{answer}");
    }
    assert_eq!(step(&server, "stop").0, 409);
    assert_eq!(step(&server, "begin").0, 200);
    let failed = waited(&server, |state| state["machine"]["runs"] == false);
    let problem = failed["problem"].as_str().unwrap();
    assert!(
        problem.contains("the line to the machine is broken") && problem.contains("check that it is on"),
        "{problem}"
    );
    live.end();

    let (live, server) = served(folder.path(), "udp://127.0.0.1:47613", None);
    let (status, answer) = post(&server, "/api/emergency-stop", "{}");
    assert_eq!((status, &answer["error"]), (409, &json!("no machine runs")));
    assert_eq!(get(&server, "/api/calibration").1["machine"], Value::Null);
    assert_eq!(get(&server, "/api/emergency-stop").0, 405);
    live.end();
}
