//! A simulated board through a session: the estimates and events match the finger.

use palpate_core::Status;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation};
use palpate_live::event::Event;
use palpate_live::feed::FeedWatch;
use palpate_live::input::{Arrival, TimedArrival};
use palpate_live::sample::Sample;
use palpate_live::session::{CreepConfig, Estimation, Output, Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, FaultConfig, Finger, FrameForm, SimulatedBoard};
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
    let mut session = Session::new(&locator, &SessionConfig::default()).unwrap();
    let mut out = Vec::new();
    let start_ns = 1_800_000_000_000_000_000;
    let (mut downs, mut offs, mut errors_m) = (0_i32, 0_i32, Vec::new());
    for frame in 0..8000_u64 {
        let elapsed = board.next_at();
        let bytes = board.send_until(elapsed);
        let at = Stamp { elapsed, unix_ns: start_ns + elapsed.as_nanos() as u64 };
        session.receive(&TimedArrival { at, arrival: Arrival::Bytes(bytes) }, &mut out);
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
    // 5 µm, estimated while the surface is untouched.
    for channel in session.health() {
        assert!((4e-6..6e-6).contains(&channel.noise_sd), "{channel:?}");
    }
    assert!((session.rate_hz() - 200.0).abs() < 2.0, "{}", session.rate_hz());
    assert_eq!(board.next_at(), Duration::from_secs(40));
}

#[test]
fn a_board_that_repeats_its_readings_is_named_once_and_its_noise_learnt_from_each_reading() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let config = BoardConfig { rate_hz: 100.0, seed: 3, ..BoardConfig::default() };
    let mut board = SimulatedBoard::new(&rig.setup, &config, Finger::random(&rig, 3)).unwrap();
    let mut session = Session::new(&locator, &SessionConfig::default()).unwrap();
    let (mut out, mut named) = (Vec::new(), 0);
    for _ in 0..2000 {
        let taken = board.next_at();
        let bytes = board.send_until(taken);
        for repeat in 0..4_u64 {
            let elapsed = taken + Duration::from_micros(2500 * repeat);
            let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
            session.receive(&TimedArrival { at, arrival: Arrival::Bytes(bytes.clone()) }, &mut out);
        }
        let is_named = |output: &Output| matches!(output, Output::Event(event) if matches!(&event.event, Event::Trouble { text } if text.contains("repeats readings")));
        named += out.drain(..).filter(is_named).count();
    }
    assert_eq!((named, session.counters().readings), (1, 8000));
    // 5 µm; counted as independent, three repeats of four would make it 2.5 µm.
    for channel in session.health() {
        assert!((4e-6..6e-6).contains(&channel.noise_sd), "{channel:?}");
    }
}

/// A board with a fast clock, and frames that arrive up to 5 ms late: the times are those of the host.
#[test]
fn binary_frames_keep_host_time_with_any_board_clock() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let frames = FrameForm::Binary { clock_ppm: 300.0 };
    let config = BoardConfig { rate_hz: 100.0, seed: 3, frames, ..BoardConfig::default() };
    let mut board = SimulatedBoard::new(&rig.setup, &config, Finger::random(&rig, 3)).unwrap();
    let mut session = Session::new(&locator, &SessionConfig::default()).unwrap();
    let mut out = Vec::new();
    let start_ns = 1_800_000_000_000_000_000;
    for frame in 0..6000_u64 {
        let taken = board.next_at();
        let bytes = board.send_until(taken);
        let elapsed = taken + Duration::from_micros(frame * 7919 % 5000);
        let at = Stamp { elapsed, unix_ns: start_ns + elapsed.as_nanos() as u64 };
        session.receive(&TimedArrival { at, arrival: Arrival::Bytes(bytes) }, &mut out);
        for output in out.drain(..) {
            let Output::Sample(sample) = output else { continue };
            let off_s = (sample.unix_ns as f64 - (start_ns + taken.as_nanos() as u64) as f64) * 1e-9;
            // Without a correction of the drift the error would be 18 ms after a minute. The drift is estimated in the first seconds.
            assert!(frame < 1000 || off_s.abs() < 1e-3, "frame {frame}: {off_s} s");
        }
    }
    // A stream is recognized as binary once a frame has ended.
    assert!(session.counters().readings >= 5998, "{:?}", session.counters());
    assert_eq!(session.counters().lost_frames, 0);
}

/// A session on the bench of a rig, with a finger that follows commands or moves at random.
struct Bench<'a> {
    session: Session<'a>,
    board: SimulatedBoard<'a>,
    /// Total time of silence of the board.
    silent: Duration,
}

impl<'a> Bench<'a> {
    fn new(rig: &'a Rig, locator: &'a Locator, estimation: Estimation) -> Self {
        let config = BoardConfig { rate_hz: 500.0, seed: 5, ..BoardConfig::default() };
        let board = SimulatedBoard::new(&rig.setup, &config, Finger::random(rig, 5)).unwrap();
        let config = SessionConfig { estimation, ..SessionConfig::default() };
        Self { session: Session::new(locator, &config).unwrap(), board, silent: Duration::ZERO }
    }

    fn finger(&mut self, line: &str) {
        self.board.finger_mut().execute(line).unwrap();
    }

    /// Leaves the surface untouched at first, so the baseline is known before the first contact.
    fn untouched_first(mut self) -> Self {
        self.finger("lift");
        self.take(200);
        self
    }

    /// Samples and events of the next frames.
    fn take(&mut self, frames: usize) -> (Vec<Sample>, Vec<Event>) {
        let mut out = Vec::new();
        for _ in 0..frames {
            let elapsed = self.board.next_at();
            let arrival = Arrival::Bytes(self.board.send_until(elapsed));
            let elapsed = elapsed + self.silent;
            let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
            self.session.receive(&TimedArrival { at, arrival }, &mut out);
        }
        let (mut samples, mut events) = (Vec::new(), Vec::new());
        for output in out {
            match output {
                Output::Sample(sample) => samples.push(*sample),
                Output::Event(record) => events.push(record.event),
            }
        }
        (samples, events)
    }
}

/// Mean and standard deviation of the positions, in metres.
fn positions_m(samples: &[Sample]) -> (f64, f64) {
    let xs = || samples.iter().map(|sample| sample.estimate.contact.position.x_m);
    let count = samples.len() as f64;
    let mean = xs().sum::<f64>() / count;
    (mean, (xs().map(|x_m| (x_m - mean).powi(2)).sum::<f64>() / count).sqrt())
}

#[test]
fn a_tracked_contact_is_closer_than_single_readings_and_its_intervals_hold_it() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let of = |estimation: Estimation| {
        let mut bench = Bench::new(&rig, &locator, estimation);
        let mut finger = Finger::random(&rig, 5);
        let (samples, events) = bench.take(10_000);
        let (mut errors_m, mut held) = (Vec::new(), 0);
        for sample in &samples {
            let truth = finger.contact_at(sample.number as f64 / 500.0);
            let (Some(truth), Status::Located) = (truth, sample.estimate.status) else { continue };
            let contact = sample.estimate.contact;
            errors_m.push(contact.position.distance_m(truth.position));
            let (low_m, high_m) = contact.uncertainty.unwrap().x_95_m;
            held += usize::from((low_m..=high_m).contains(&truth.position.x_m));
        }
        let count = |is: fn(&Event) -> bool| events.iter().filter(|event| is(event)).count();
        let downs = count(|event| matches!(event, Event::TouchDown { .. }));
        let offs = count(|event| matches!(event, Event::LiftOff { .. }));
        let mean_m = errors_m.iter().sum::<f64>() / errors_m.len() as f64;
        println!(
            "{estimation:?}: {:.4} mm, {} of {} held, {downs} touch-downs",
            1e3 * mean_m,
            held,
            errors_m.len()
        );
        assert!(errors_m.len() > 4000 && downs.abs_diff(offs) <= 1);
        (mean_m, held as f64 / errors_m.len() as f64, downs)
    };
    let (single_m, _, single_downs) = of(Estimation::Single);
    let (tracked_m, held, downs) = of(Estimation::Track { frequency_hz: None, creep: None });
    assert!(tracked_m < 0.5 * single_m, "{tracked_m} {single_m}");
    assert!((0.88..=1.0).contains(&held), "{held}");
    assert_eq!(downs, single_downs);
}

/// A contact of one minute on a creeping surface and a drifting board. The tracker with creep in its state stays at the true position, within its
/// interval. Without creep in the state the estimate wanders, and a contact remains after the true one has ended.
#[test]
fn drift_and_creep_are_followed_by_the_trackers_state() {
    let rig = Rig::from_toml(RIG).unwrap();
    // Calibrated by fresh presses: a share of their readings has not yet crept.
    let mut presses = rig.simulate(0).unwrap();
    presses.rows.iter_mut().flat_map(|row| &mut row.reading).for_each(|value| *value *= 0.95);
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &presses)).unwrap();
    let imperfections = Imperfections {
        drift: OffsetDrift { line_per_s: Amount::Value(1e-7), ..OffsetDrift::default() },
        creep: [Relaxation { share: 0.05, time_s: 20.0 }, Relaxation::default()],
        ..Imperfections::default()
    };
    let faults = FaultConfig { imperfections, ..FaultConfig::default() };
    let held = |creep: Option<CreepConfig>| {
        let mut bench = Bench::new(&rig, &locator, Estimation::Track { frequency_hz: None, creep });
        bench.board = bench.board.with_faults(faults.clone(), 5).unwrap();
        let mut bench = bench.untouched_first();
        bench.take(20 * 500);
        bench.finger("finger 117 0 3");
        let (samples, _) = bench.take(60 * 500);
        let (mut errors_m, mut covered) = (Vec::new(), 0);
        for sample in &samples[500..] {
            let contact = sample.estimate.contact;
            errors_m.push((contact.position.x_m - 0.117).abs());
            let (low_m, high_m) = contact.uncertainty.map_or((0.0, 0.0), |uncertainty| uncertainty.x_95_m);
            covered += usize::from((low_m..=high_m).contains(&0.117));
        }
        bench.finger("lift");
        let (after, _) = bench.take(2 * 500);
        let gone = after.iter().filter(|sample| sample.estimate.status == Status::NoContact).count();
        let mean_m = errors_m.iter().sum::<f64>() / errors_m.len() as f64;
        println!("{creep:?}: {:.3} mm, {covered} of {}, {gone} untouched", 1e3 * mean_m, errors_m.len());
        (mean_m, covered as f64 / errors_m.len() as f64, gone)
    };
    let (without_m, _, ghosts) = held(None);
    // 95 % of a reading are immediate, and 5 % creep.
    let (with_m, covered, gone) = held(Some(CreepConfig { share: 0.05 / 0.95, time_s: 20.0 }));
    assert!(with_m < 2e-4 && without_m > 10.0 * with_m, "{with_m} {without_m}");
    assert!(covered > 0.85, "{covered}");
    assert!(gone > 900 && ghosts < 500, "{gone} {ghosts}");
}

#[test]
fn a_tracker_is_carried_over_gaps_and_immense_readings() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let tracked = Estimation::Track { frequency_hz: None, creep: None };
    let mut bench = Bench::new(&rig, &locator, tracked).untouched_first();
    bench.finger("finger 120 0 3");
    let sd_m = |sample: &Sample| sample.estimate.contact.uncertainty.unwrap().covariance[0].sqrt();
    let (before, _) = bench.take(500);
    // Ten seconds, and four months: the earlier state loses weight, and new readings are as informative as before.
    for silent_s in [10.0, 1e7] {
        bench.silent += Duration::from_secs_f64(silent_s);
        bench.finger("finger 280 0 3");
        let (after, events) = bench.take(500);
        assert!(events.iter().any(|event| matches!(event, Event::Gap { .. })), "{events:?}");
        assert!(sd_m(&after[0]) > 2.0 * sd_m(&before[499]), "{silent_s} s");
        assert_eq!(after[499].estimate.status, Status::Located);
        assert!((after[499].estimate.contact.position.x_m - 0.28).abs() < 2e-4, "{silent_s} s");
    }
    let line = palpate_live::source::line(&[1e300; 8]).into_bytes();
    let elapsed = bench.board.next_at() + bench.silent;
    let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
    let mut out = Vec::new();
    bench.session.receive(&TimedArrival { at, arrival: Arrival::Bytes(line) }, &mut out);
    for output in &out {
        let Output::Sample(sample) = output else { continue };
        assert!(sample.estimate.is_in_numbers() && sample.estimate.status != Status::Located, "{sample:?}");
    }
    let (after, _) = bench.take(500);
    assert!(after.iter().all(|sample| sample.estimate.is_in_numbers()));
    assert!((after[499].estimate.contact.position.x_m - 0.28).abs() < 2e-4);
}

/// α/(2 − α) of the variance of single readings remains.
#[test]
fn a_low_pass_leaves_the_noise_that_it_should_and_is_reset_by_silence() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let held = |estimation: Estimation| {
        let mut bench = Bench::new(&rig, &locator, estimation).untouched_first();
        bench.finger("finger 120 0 3");
        let (samples, _) = bench.take(5000);
        (bench, positions_m(&samples[1000..]))
    };
    let (_, (_, single_m)) = held(Estimation::Single);
    let (mut bench, (mean_m, filtered_m)) = held(Estimation::LowPass { cutoff_hz: 10.0 });
    let alpha = 1.0 - (-std::f64::consts::TAU * 10.0 / 500.0_f64).exp();
    let expected = (alpha / (2.0 - alpha)).sqrt();
    let ratio = filtered_m / single_m;
    assert!((ratio / expected - 1.0).abs() < 0.15, "{ratio}, {expected} expected");
    assert!((mean_m - 0.12).abs() < 2e-4, "{mean_m}");
    // Within a stream the filter lags; after a silence the first reading passes unfiltered.
    bench.finger("finger 280 0 3");
    let (late, _) = bench.take(2);
    assert!((late[1].estimate.contact.position.x_m - 0.28).abs() > 0.01, "{:?}", late[1].estimate.contact);
    bench.take(500);
    bench.silent += Duration::from_secs(2);
    bench.finger("finger 120 0 3");
    let (first, events) = bench.take(1);
    assert!(matches!(events[0], Event::Gap { .. }), "{events:?}");
    assert!((first[0].estimate.contact.position.x_m - 0.12).abs() < 2e-3, "{:?}", first[0].estimate.contact);
}

#[test]
fn a_session_that_cannot_be_had_is_refused_with_the_reason() {
    let rig = Rig::from_toml(RIG).unwrap();
    let influence = locator(&rig);
    let refused = |locator: &Locator, estimation: Estimation| {
        let config = SessionConfig { estimation, ..SessionConfig::default() };
        Session::new(locator, &config).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let cutoff = refused(&influence, Estimation::LowPass { cutoff_hz: f64::NAN });
    assert!(cutoff.contains("the cut-off frequency is NaN"), "{cutoff}");
    let frequency = refused(&influence, Estimation::Track { frequency_hz: Some(-1.0), creep: None });
    assert!(frequency.contains("the natural frequency is -1"), "{frequency}");
    let creep = Some(CreepConfig { share: 1.5, time_s: 20.0 });
    let share = refused(&influence, Estimation::Track { frequency_hz: None, creep });
    assert!(share.contains("the share of the creep is 1.5"), "{share}");
    let recording = rig.simulate(0).unwrap();
    let centroid = palpate_estimators::estimator::Estimator::Centroid(palpate_estimators::centroid::Centroid);
    let centroid = centroid.fit_task(FitTask::new(&rig.setup, &recording)).unwrap();
    let kind = refused(&centroid, Estimation::Track { frequency_hz: None, creep: None });
    assert!(kind.contains("a locator of kind `influence`"), "{kind}");
}

/// A session and the monitor of its feed, in virtual time.
struct FeedBench<'a> {
    session: Session<'a>,
    feed: FeedWatch,
}

impl FeedBench<'_> {
    /// The report, if any, after an arrival at some time.
    fn report_after(&mut self, ms: u64, arrival: Arrival) -> Option<String> {
        let elapsed = Duration::from_millis(ms);
        let at = Stamp { elapsed, unix_ns: 1_800_000_000_000_000_000 + elapsed.as_nanos() as u64 };
        let arrived = TimedArrival { at, arrival };
        self.session.receive(&arrived, &mut Vec::new());
        self.feed.receive(&arrived.arrival, elapsed, self.session.frames());
        self.feed.report(elapsed, self.session.frames())
    }

    fn report_at(&mut self, ms: u64) -> Option<String> {
        self.feed.report(Duration::from_millis(ms), self.session.frames())
    }
}

#[test]
fn a_feed_without_readings_is_reported_once_and_with_its_cause() {
    let rig = Rig::from_toml(RIG).unwrap();
    let locator = locator(&rig);
    let session = Session::new(&locator, &SessionConfig::default()).unwrap();
    let mut bench = FeedBench { session, feed: FeedWatch::default() };
    let bytes = |text: &str| Arrival::Bytes(text.as_bytes().to_vec());
    assert_eq!(bench.report_after(0, Arrival::Opened("board".to_owned())), None);
    assert_eq!(bench.report_at(2900), None);
    let report = bench.report_at(3000).unwrap();
    assert!(report.contains("sends no data"), "{report}");
    assert_eq!(bench.report_at(9000), None, "it is reported once");
    // A starting board prints some lines first.
    assert_eq!(bench.report_after(10_000, Arrival::Joined("board".to_owned())), None);
    assert_eq!(bench.report_after(10_500, bytes("boot\nboot\nboot\nboot\nboot\nboot\n")), None);
    assert_eq!(bench.report_after(10_900, bytes("0,0,0,0,0,0,0,0\n")), None);
    assert!(bench.feed.fault(bench.session.frames()).is_none());
    // A channel vanishes.
    assert_eq!(bench.report_after(11_000, bytes(&"0,0,0,0,0,0,0\n".repeat(50))), None);
    let report = bench.report_after(11_900, bytes("0,0,0,0,0,0,0\n")).unwrap();
    assert!(report.contains("51 frames in a row are not readings: another number of values"), "{report}");
    assert!(report.contains("`0,0,0,0,0,0,0`"), "{report}");
    assert_eq!(bench.report_after(12_900, bytes("0,0,0,0,0,0,0\n")), None, "it is reported once");
    assert!(
        bench.feed.fault(bench.session.frames()).unwrap().contains("the readings ended early: 52 frames")
    );
    // The channel returns, and the baud rate changes.
    assert_eq!(bench.report_after(13_000, bytes("0,0,0,0,0,0,0,0\n")), None);
    assert_eq!(bench.report_after(13_100, bytes(&"\u{7F}~".repeat(60))), None);
    assert_eq!(bench.report_at(16_000), None, "readings came every 2 s");
    let report = bench.report_at(24_000).unwrap();
    assert!(
        report.contains("120 bytes without the end of a line") && report.contains("baud rate"),
        "{report}"
    );
    assert_eq!(bench.report_after(25_000, Arrival::Lost("unplugged".to_owned())), None);
    assert_eq!(bench.feed.fault(bench.session.frames()).unwrap(), "the readings ended early: unplugged");
}
