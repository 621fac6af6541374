//! A simulated board through a session: what the finger does is what the session says.

use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_live::event::Event;
use palpate_live::input::{Arrival, Arrived};
use palpate_live::session::{Output, Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, Finger, FrameForm, SimulatedBoard};
use palpate_live::stamp::Stamp;
use palpate_rig::Rig;
use std::time::Duration;

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");

fn locator(rig: &Rig) -> Locator {
    let recording = rig.simulate(0).unwrap();
    rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap()
}

#[test]
fn a_finger_is_followed_from_touch_down_to_lift_off() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let mut board = SimulatedBoard::new(
        &rig.setup,
        &BoardConfig { rate_hz: 200.0, seed: 3, ..BoardConfig::default() },
        Finger::random(&rig, 3),
    )
    .unwrap();
    let mut finger = Finger::random(&rig, 3);
    let mut session = Session::new(&locator, &SessionConfig::default());
    let mut out = Vec::new();
    let start_ns = 1_800_000_000_000_000_000;
    let (mut downs, mut offs, mut errors_m) = (0_i32, 0_i32, Vec::new());
    for frame in 0..8000_u64 {
        let elapsed = board.next_at();
        let bytes = board.send_until(elapsed);
        let at = Stamp { elapsed, unix_ns: start_ns + elapsed.as_nanos() as u64 };
        session.receive(&Arrived { at, arrival: Arrival::Bytes(bytes) }, &mut out);
        let truth = finger.contact_at(elapsed.as_secs_f64());
        for output in out.drain(..) {
            match output {
                Output::Event(event) => match event.event {
                    Event::TouchDown { .. } => downs += 1,
                    Event::LiftOff { .. } => offs += 1,
                    Event::Move { .. } => {}
                    other => panic!("frame {frame}: {other:?}"),
                },
                Output::Sample(sample) => {
                    let estimated = sample.estimate.contact.position;
                    if let (Some(truth), true) = (truth, session.is_touched()) {
                        errors_m.push(truth.position.distance_m(estimated));
                    }
                }
            }
        }
    }
    assert!(downs >= 8 && (downs - offs).abs() <= 1, "{downs} {offs}");
    errors_m.sort_by(f64::total_cmp);
    let median_m = errors_m[errors_m.len() / 2];
    assert!(median_m < 0.3e-3, "{median_m}");
    assert_eq!(session.counters().readings, 8000);
    // 5 µm, learnt while nothing touches.
    for channel in session.health() {
        assert!((4e-6..6e-6).contains(&channel.noise_sd), "{channel:?}");
    }
    assert!((session.rate_hz() - 200.0).abs() < 2.0, "{}", session.rate_hz());
    assert_eq!(board.next_at(), Duration::from_secs(40));
}

/// A board whose clock is fast, and frames that arrive up to 5 ms late: times are the host's.
#[test]
fn binary_frames_keep_the_hosts_time_whatever_the_boards_clock_does() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let frames = FrameForm::Binary { clock_ppm: 300.0 };
    let config = BoardConfig { rate_hz: 100.0, seed: 3, frames, ..BoardConfig::default() };
    let mut board = SimulatedBoard::new(&rig.setup, &config, Finger::random(&rig, 3)).unwrap();
    let mut session = Session::new(&locator, &SessionConfig::default());
    let mut out = Vec::new();
    let start_ns = 1_800_000_000_000_000_000;
    for frame in 0..6000_u64 {
        let taken = board.next_at();
        let bytes = board.send_until(taken);
        let elapsed = taken + Duration::from_micros(frame * 7919 % 5000);
        let at = Stamp { elapsed, unix_ns: start_ns + elapsed.as_nanos() as u64 };
        session.receive(&Arrived { at, arrival: Arrival::Bytes(bytes) }, &mut out);
        for output in out.drain(..) {
            let Output::Sample(sample) = output else { continue };
            let off_s = (sample.unix_ns as f64 - (start_ns + taken.as_nanos() as u64) as f64) * 1e-9;
            // Without the drift it would be off by 18 ms after a minute. The first seconds learn it.
            assert!(frame < 1000 || off_s.abs() < 1e-3, "frame {frame}: {off_s} s");
        }
    }
    // A stream is known to be binary once a frame has ended.
    assert!(session.counters().readings >= 5998, "{:?}", session.counters());
    assert_eq!(session.counters().lost_frames, 0);
}
