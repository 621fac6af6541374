//! A hand that does what the guide of a calibration asks for.

use palpate_core::Status;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::SimulatedBench;

use palpate_live::calibration::{Guide, Press, Progress, Waiting};
use palpate_mechanics::contact::{Contact, Position};
use palpate_rig::Rig;
use std::time::Duration;

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
const FORCE_N: f64 = 3.0;

/// A hand that takes its time, and a surface that takes its time too.
struct Hand<'a> {
    bench: SimulatedBench<'a>,
    /// What the sensors read without noise, which follows the contact with the time constant of a soft surface.
    clean: Vec<f64>,
    contact: Option<Contact>,
    at: Duration,
}

/// Time between readings, and that in which the surface follows all but an e-th of the way.
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

    /// Does what the guide waits for, for at most so many readings; the rows that were taken, each with the mean reading of its stretch at rest.
    fn obey(&mut self, guide: &mut Guide, most: usize) -> Vec<(Row, Vec<f64>)> {
        let mut rows = Vec::new();
        for _ in 0..most {
            let (at, reading) = self.reading();
            if let Progress::Taken { row, mean } = guide.add(at, &reading) {
                rows.push((row, mean));
            }
            self.contact = match guide.waiting() {
                Waiting::Press | Waiting::Rest => guide
                    .next_press()
                    .map(|(_, press)| Contact { position: press.position, force_n: FORCE_N }),
                Waiting::Untouched | Waiting::Release => None,
                Waiting::Nothing => break,
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

fn fitted(rig: &Rig, taken: Vec<(Row, Vec<f64>)>) -> Locator {
    let rows = taken.into_iter().map(|(row, _)| row).collect();
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
    assert_eq!(guide.waiting(), Waiting::Nothing);
    let presses: Vec<&(Row, Vec<f64>)> = rows.iter().filter(|(row, _)| row.touches()).collect();
    assert_eq!(presses.len(), plan.len());
    // An untouched row before the first press, and one after each.
    assert_eq!(rows.len() - presses.len(), plan.len() + 1);
    for ((row, mean), press) in presses.into_iter().zip(&plan) {
        assert_eq!((row.position, row.force_n), (press.position, press.force_n));
        let clean = hand.bench.clean(&[Contact { position: press.position, force_n: FORCE_N }]);
        // At rest within a percent of the reading. The noise of a reading is 5 µm, that of a mean of 80 readings a ninth of it.
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

/// The beam as a board without a model, of whose noise nothing is said.
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
    assert_eq!(guide.waiting(), Waiting::Release, "the press that was taken back is still held");
    guide.skip();
    assert_eq!(guide.plan().len(), 8);
    let rows = hand.obey(&mut guide, 2000);
    assert!(rows.iter().filter(|(row, _)| row.touches()).count() >= 2);
    guide.stop();
    assert_eq!((guide.waiting(), guide.next_press()), (Waiting::Nothing, None));
    guide.extend([Press { position: Position::along(0.2), force_n: Some(FORCE_N), depth_m: None }]);
    assert_eq!(hand.obey(&mut guide, 2000).iter().filter(|(row, _)| row.touches()).count(), 1);
}

#[test]
fn a_surface_that_is_touched_or_never_rests_is_not_taken() {
    let rig = Rig::from_toml(RIG).unwrap();
    let mut guide = Guide::new(plan(&rig));
    let mut hand = Hand::new(&rig.setup);
    // A load that goes to and fro from the beginning.
    for i in 0..2000 {
        let position = Position::along(0.2 + 0.1 * (f64::from(i) * 0.01).sin());
        hand.contact = Some(Contact { position, force_n: FORCE_N });
        let (at, reading) = hand.reading();
        assert_eq!(guide.add(at, &reading), Progress::None, "{i}");
    }
    assert_eq!(guide.waiting(), Waiting::Untouched);
}

#[test]
fn a_press_that_is_held_for_long_is_not_taken_for_an_untouched_surface() {
    let rig = Rig::from_toml(RIG).unwrap();
    let mut guide = Guide::new(plan(&rig)[..2].to_vec());
    let mut hand = Hand::new(&rig.setup);
    while guide.waiting() != Waiting::Release {
        hand.obey(&mut guide, 1);
    }
    let position = guide.plan()[0].position;
    hand.contact = Some(Contact { position, force_n: FORCE_N });
    for _ in 0..2000 {
        let (at, reading) = hand.reading();
        assert_eq!(guide.add(at, &reading), Progress::None);
    }
    assert_eq!(guide.waiting(), Waiting::Release);
}
