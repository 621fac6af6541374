//! Guided calibrations with a simulated hand that follows the guide.

use palpate_core::Status;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulatedBench;

use palpate_live::calibration::{AwaitedStep, Guide, Press, Progress, RestingRow, RetakeReason};
use palpate_mechanics::contact::{Contact, Position};
use palpate_rig::Rig;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::time::Duration;

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
const FORCE_N: f64 = 3.0;

/// A slow hand on a surface that responds slowly.
struct Hand<'a> {
    bench: SimulatedBench<'a>,
    /// Readings without noise, which follow the contact with the time constant of a soft surface.
    clean: Vec<f64>,
    contact: Option<Contact>,
    at: Duration,
}

/// Time between readings, and time constant of the surface.
const EVERY: Duration = Duration::from_millis(5);
const FOLLOWS_S: f64 = 0.15;

impl<'a> Hand<'a> {
    fn new(setup: &'a Setup) -> Self {
        let bench = SimulatedBench::new(setup, 7).unwrap();
        Self { clean: bench.clean(&[]), bench, contact: None, at: Duration::ZERO }
    }

    fn reading(&mut self) -> (Duration, Vec<f64>) {
        self.at += EVERY;
        let target = self.bench.clean(self.contact.as_slice());
        let share = 1.0 - (-EVERY.as_secs_f64() / FOLLOWS_S).exp();
        self.clean.iter_mut().zip(&target).for_each(|(clean, target)| *clean += share * (target - *clean));
        (self.at, self.bench.measure(&self.clean))
    }

    /// Does what the guide waits for, for at most `most` readings. Returns the recorded rows, each with the mean reading of its stretch at rest.
    fn obey(&mut self, guide: &mut Guide, most: usize) -> Vec<RestingRow> {
        let mut rows = Vec::new();
        for _ in 0..most {
            let (at, reading) = self.reading();
            match guide.add(at, &reading) {
                Progress::Pressed { untouched, press } => rows.extend(untouched.into_iter().chain([press])),
                Progress::Untouched(untouched) => rows.push(untouched),
                Progress::Waits(_) | Progress::None => {}
                other => panic!("{other:?}"),
            }
            self.contact = match guide.awaited_step() {
                AwaitedStep::Press | AwaitedStep::Rest => guide
                    .next_press()
                    .map(|(_, press)| Contact { position: press.position, force_n: FORCE_N }),
                AwaitedStep::Untouched | AwaitedStep::Release => None,
                AwaitedStep::Nothing => break,
            };
        }
        rows
    }
}

fn plan(rig: &Rig) -> Vec<Press> {
    let training = rig.training.as_ref().unwrap();
    let positions = training.positions(rig.setup.surface().extent()).unwrap();
    positions
        .iter()
        .flat_map(|position| {
            std::iter::repeat_n(Press { position: *position, force_n: Some(FORCE_N), depth_m: None }, 3)
        })
        .collect()
}

fn fitted(rig: &Rig, taken: Vec<RestingRow>) -> Locator {
    let rows = taken.into_iter().map(|taken| taken.row).collect();
    let recording = Recording::new(rig.setup.layout(), "calibration", rows);
    rig.estimator.fit_task(FitTask::new(&rig.setup, &recording)).unwrap()
}

#[test]
fn presses_are_taken_at_rest_and_the_locator_is_near_the_limit() {
    let rig = Rig::from_toml(RIG).unwrap();
    let plan = plan(&rig);
    let mut guide = Guide::new(plan.clone());
    let mut hand = Hand::new(&rig.setup);
    let rows = hand.obey(&mut guide, 100_000);
    assert_eq!(guide.awaited_step(), AwaitedStep::Nothing);
    let presses: Vec<&RestingRow> = rows.iter().filter(|taken| taken.row.touches()).collect();
    assert_eq!(presses.len(), plan.len());
    // An untouched row before the first press, and one after each.
    assert_eq!(rows.len() - presses.len(), plan.len() + 1);
    for (RestingRow { row, mean }, press) in presses.into_iter().zip(&plan) {
        assert_eq!((row.position, row.force_n), (press.position, press.force_n));
        let clean = hand.bench.clean(&[Contact { position: press.position, force_n: FORCE_N }]);
        // The surface is at rest within a percent of the reading. The noise of a reading is 5 µm, that of a mean of 80 readings a ninth of it.
        let size = clean.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        for ((value, mean), clean) in row.reading.iter().zip(mean).zip(&clean) {
            assert!((mean - clean).abs() < 5e-6 + 0.01 * size, "{mean} {clean}");
            assert!((value - mean).abs() < 25e-6 + 0.01 * size, "{value} {mean}");
        }
    }
    let locator = fitted(&rig, rows);
    let estimate =
        locator.locate(&hand.bench.clean(&[Contact { position: Position::along(0.1234), force_n: FORCE_N }]));
    let x_m = estimate.unwrap().contact.position.x_m;
    assert!((x_m - 0.1234).abs() < 1e-3, "{x_m}");
}

/// The beam as a board without a model, with unspecified noise.
const BOARD: &str = r#"
[surface]
kind = "measured"
length = "400 mm"

[sensors]
measure = "raw"
count = 8

[recording]
position = "position"
position_unit = "mm"
force = "force"
channels = [2, 3, 4, 5, 6, 7, 8, 9]

[estimator]
kind = "influence"
"#;

#[test]
fn a_board_learns_the_noise_of_the_readings_that_it_will_locate() {
    let rig = Rig::from_toml(RIG).unwrap();
    let mut guide = Guide::new(plan(&rig));
    let mut hand = Hand::new(&rig.setup);
    let rows = hand.obey(&mut guide, 100_000);
    let locator = fitted(&Rig::from_toml(BOARD).unwrap(), rows);
    hand.contact = None;
    (0..400).for_each(|_| drop(hand.reading()));
    let untouched = (0..500).filter(|_| {
        let (_, reading) = hand.reading();
        locator.locate(&reading).unwrap().status == Status::NoContact
    });
    let untouched = untouched.count();
    assert!(untouched >= 490, "{untouched} of 500 untouched readings are `no_contact`");
    let held = (0..200).filter(|i| {
        let x_m = 0.04 + 0.32 * f64::from(*i) / 199.0;
        let clean = hand.bench.clean(&[Contact { position: Position::along(x_m), force_n: FORCE_N }]);
        let estimate = locator.locate(&hand.bench.measure(&clean)).unwrap();
        let (low_m, high_m) = estimate.contact.uncertainty.unwrap().x_95_m;
        (low_m..=high_m).contains(&x_m)
    });
    let held = held.count();
    println!(
        "{untouched} of 500 untouched readings are `no_contact`; {held} of 200 intervals hold their contact"
    );
    assert!((180..=200).contains(&held), "{held} of 200 intervals hold their contact");
}

#[test]
fn presses_can_be_taken_back_left_out_and_ended() {
    let rig = Rig::from_toml(RIG).unwrap();
    let mut guide = Guide::new(plan(&rig)[..9].to_vec());
    let mut hand = Hand::new(&rig.setup);
    assert!(!guide.redo(), "nothing was taken yet");
    // The untouched row and the first press.
    while guide.next_press().unwrap().0 == 0 {
        hand.obey(&mut guide, 1);
    }
    assert!(guide.redo() && guide.next_press().unwrap().0 == 0);
    assert_eq!(guide.awaited_step(), AwaitedStep::Release, "the press that was taken back is still held");
    guide.skip();
    assert_eq!(guide.plan().len(), 8);
    let rows = hand.obey(&mut guide, 2000);
    assert!(rows.iter().filter(|taken| taken.row.touches()).count() >= 2);
    guide.stop();
    assert_eq!((guide.awaited_step(), guide.next_press()), (AwaitedStep::Nothing, None));
    guide.extend([Press { position: Position::along(0.2), force_n: Some(FORCE_N), depth_m: None }]);
    assert_eq!(hand.obey(&mut guide, 2000).iter().filter(|taken| taken.row.touches()).count(), 1);
}

#[test]
fn a_surface_that_is_touched_or_never_rests_is_not_taken() {
    let rig = Rig::from_toml(RIG).unwrap();
    let mut guide = Guide::new(plan(&rig));
    let mut hand = Hand::new(&rig.setup);
    // A load that changes periodically from the beginning.
    for i in 0..2000 {
        let position = Position::along(0.2 + 0.1 * (f64::from(i) * 0.01).sin());
        hand.contact = Some(Contact { position, force_n: FORCE_N });
        let (at, reading) = hand.reading();
        assert_eq!(guide.add(at, &reading), Progress::None, "{i}");
    }
    assert_eq!(guide.awaited_step(), AwaitedStep::Untouched);
}

#[test]
fn a_press_that_is_held_for_long_is_not_taken_for_an_untouched_surface() {
    let rig = Rig::from_toml(RIG).unwrap();
    let mut guide = Guide::new(plan(&rig)[..2].to_vec());
    let mut hand = Hand::new(&rig.setup);
    while guide.awaited_step() != AwaitedStep::Release {
        hand.obey(&mut guide, 1);
    }
    let position = guide.plan()[0].position;
    hand.contact = Some(Contact { position, force_n: FORCE_N });
    for _ in 0..2000 {
        let (at, reading) = hand.reading();
        assert_eq!(guide.add(at, &reading), Progress::None);
    }
    assert_eq!(guide.awaited_step(), AwaitedStep::Release);
}

/// Readings of two channels at 100 Hz with a standard deviation of 1 about a mean that is a function of the time in seconds.
fn course(seed: u64, seconds: f64, mean: impl Fn(f64) -> [f64; 2]) -> Vec<(Duration, [f64; 2])> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut noisy =
        |mean: [f64; 2]| mean.map(|mean| mean + Distribution::<f64>::sample(&StandardNormal, &mut rng));
    (0..(100.0 * seconds) as u64)
        .map(|i| (Duration::from_millis(10 * i), noisy(mean(i as f64 * 0.01))))
        .collect()
}

fn presses_at(count: usize) -> Vec<Press> {
    vec![Press { position: Position::along(0.1), force_n: Some(2.0), depth_m: None }; count]
}

#[test]
fn drift_is_never_a_press() {
    for drift_per_s in [1.0, 5.0, 20.0] {
        let mut guide = Guide::new(presses_at(2));
        for (at, reading) in course(1, 90.0, |s| [1000.0 + drift_per_s * s, 2000.0 - 0.5 * drift_per_s * s]) {
            let progress = guide.add(at, &reading);
            assert!(!matches!(progress, Progress::Pressed { .. }), "{drift_per_s}/s at {at:?}: {progress:?}");
        }
    }
}

#[test]
fn a_drift_that_begins_late_is_learnt_anew() {
    let mut guide = Guide::new(presses_at(1));
    let drift = |s: f64| 20.0 * (s - 5.0).max(0.0);
    let progress: Vec<Progress> = course(2, 300.0, |s| [drift(s), drift(s)])
        .into_iter()
        .map(|(at, reading)| guide.add(at, &reading))
        .collect();
    assert!(!progress.iter().any(|progress| matches!(progress, Progress::Pressed { .. })));
}

#[test]
fn a_firm_press_replaces_a_light_touch_before_it() {
    let mut guide = Guide::new(presses_at(2));
    let force = |s: f64| match s {
        2.0..4.0 => 0.05,
        4.0..6.0 => 1.0,
        _ => 0.0,
    };
    let mut replaced = None;
    for (at, reading) in course(3, 10.0, |s| [3000.0 * force(s), 1000.0 * force(s)]) {
        if let Progress::Replaced(press) = guide.add(at, &reading) {
            replaced = Some(press.mean[0]);
        }
    }
    assert!(replaced.is_some_and(|mean| (mean - 3000.0).abs() < 5.0), "{replaced:?}");
    assert_eq!((guide.awaited_step(), guide.taken()), (AwaitedStep::Press, 1));
}

#[test]
fn a_press_that_grows_and_is_lifted_at_once_is_taken_back() {
    let mut guide = Guide::new(presses_at(2));
    // A finger rests lightly, presses for 0.3 s and lifts; then it does so again, and keeps pressing.
    let force = |s: f64| match s {
        2.0..2.7 | 5.0..5.7 => 0.05,
        2.7..3.0 | 5.7..8.0 => 1.0,
        _ => 0.0,
    };
    let mut taken_back = Vec::new();
    let mut recorded = Vec::new();
    for (at, reading) in course(3, 10.0, |s| [3000.0 * force(s), 1000.0 * force(s)]) {
        match guide.add(at, &reading) {
            Progress::TakenBack(doubt) => {
                taken_back.push(doubt);
                recorded.pop();
            }
            Progress::Pressed { press, .. } => recorded.push(press.mean[0]),
            _ => {}
        }
    }
    assert_eq!(taken_back, [RetakeReason::Grew]);
    assert!(matches!(recorded[..], [mean] if (mean - 3000.0).abs() < 5.0), "{recorded:?}");
    assert_eq!((guide.awaited_step(), guide.taken()), (AwaitedStep::Press, 1));
}

#[test]
fn a_touch_that_stays_is_released_by_learning_the_untouched_reading_anew() {
    let mut guide = Guide::new(presses_at(2));
    // The offsets step once and stay.
    let step = |s: f64| if s < 2.0 { 0.0 } else { 300.0 };
    for (at, reading) in course(4, 20.0, |s| [step(s), step(s)]) {
        guide.add(at, &reading);
    }
    assert_eq!(guide.awaited_step(), AwaitedStep::Release);
    assert!(guide.explain().unwrap().contains("100 % of the press"), "{:?}", guide.explain());
    assert!(guide.redo());
    guide.relearn();
    for (at, reading) in course(5, 3.0, |_| [300.0, 300.0]) {
        guide.add(at + Duration::from_secs(20), &reading);
    }
    assert_eq!((guide.awaited_step(), guide.taken()), (AwaitedStep::Press, 0));
}

#[test]
fn a_press_far_off_its_repeats_is_asked_for_again_and_confirmed_by_a_second_one() {
    let mut guide = Guide::new(presses_at(3));
    let force = |s: f64| match (s / 4.0).floor() as i32 {
        press @ 0..=3 if s % 4.0 > 1.5 && s % 4.0 < 3.5 => [1.0, 0.6, 0.6, 1.0][press as usize],
        _ => 0.0,
    };
    let (mut doubts, mut sizes) = (Vec::new(), Vec::new());
    for (at, reading) in course(6, 17.0, |s| [3000.0 * force(s), 1000.0 * force(s)]) {
        match guide.add(at, &reading) {
            Progress::AskedAgain(doubt) => doubts.push(doubt),
            Progress::Pressed { press, .. } => sizes.push((press.mean[0] / 100.0).round()),
            _ => {}
        }
    }
    assert_eq!(sizes, [30.0, 18.0, 30.0]);
    assert!(
        matches!(doubts[..], [RetakeReason::OffRepeats { percent }] if (percent - 40.0).abs() < 1.0),
        "{doubts:?}"
    );
}

#[test]
fn a_press_during_a_pause_of_the_readings_is_no_drift() {
    let mut guide = Guide::new(presses_at(1));
    let pressed = |s: f64| if s > 2.5 { 3000.0 } else { 0.0 };
    let readings = course(7, 6.0, |s| [pressed(s), pressed(s)]);
    let progress: Vec<Progress> = readings
        .into_iter()
        .filter(|(at, _)| !(1.5..3.0).contains(&at.as_secs_f64()))
        .map(|(at, reading)| guide.add(at, &reading))
        .collect();
    assert!(progress.iter().any(|progress| matches!(progress, Progress::Pressed { .. })));
}

#[test]
fn a_quick_repeat_of_a_press_is_no_drift() {
    let mut guide = Guide::new(presses_at(4));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    // A finger without any delay.
    for i in 0..2000 {
        let mean =
            if matches!(guide.awaited_step(), AwaitedStep::Press | AwaitedStep::Rest) { 3000.0 } else { 0.0 };
        let reading = [(); 2].map(|()| mean + Distribution::<f64>::sample(&StandardNormal, &mut rng));
        let progress = guide.add(Duration::from_millis(10 * i), &reading);
        assert!(!matches!(progress, Progress::AskedAgain(_)), "{progress:?}");
    }
    assert_eq!(guide.awaited_step(), AwaitedStep::Nothing);
}
