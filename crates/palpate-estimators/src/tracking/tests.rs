//! The paper's beam in balance, under a contact that moves, ends and returns.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;

mod drift;
mod on_plane;
mod without_model;

use super::slow::SlowState;
use super::*;
use crate::estimator::Locator;
use crate::fit::{Fit, FitTask};
use crate::fixtures::{Example, along_the_beam, moving_beam, swinging_beam, two_moving_loads};
use crate::influence::{BeamLikelihood, Influence};
use crate::interval_check::IntervalCheck;
use crate::likelihood::{ContactFit, Likelihood, LineLikelihood, LocatorChecks};
use crate::recording::Row;
use crate::simulate::{CleanSensors, clean_reading};
use crate::track_errors::TrackErrors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{ChannelErrors, measure};
use palpate_mechanics::surface::Motion;
use palpate_numerics::watch::{Cancelled, Progress, Watch};
use std::sync::atomic::{AtomicUsize, Ordering};

const RATE_HZ: f64 = 1000.0;

fn rig() -> Example {
    moving_beam()
}

fn likelihood(rig: &Example, force_n: Option<f64>) -> BeamLikelihood {
    let recording = rig.simulate(1);
    let setup = rig.setup.clone().with_force(force_n).unwrap();
    let task = FitTask::new(&setup, &recording);
    BeamLikelihood::new(&Influence::default().fit_beam(task).unwrap())
}

/// Time in seconds, true contact, and reading.
pub(super) type Timed = (f64, Contact, Vec<f64>);

/// Contacts along a motion with a force, and readings in balance.
pub(super) fn timed_readings(rig: &Example, motion: Motion, force_n: f64, seed: u64) -> Vec<Timed> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let layout = rig.setup.layout();
    let errors = ChannelErrors::none(layout);
    let sensors = CleanSensors::new(rig.setup.surface().model().unwrap(), layout);
    let at = |i: usize| {
        let time_s = i as f64 / RATE_HZ;
        let contact = motion.contact_at(time_s, force_n);
        (time_s, contact, measure(layout, &sensors.reading(contact), &errors, &mut rng))
    };
    (0..(motion.duration_s() * RATE_HZ) as usize).map(at).collect()
}

/// Number of readings with a missed or false detection.
pub(super) fn wrongly_touching(likelihood: impl Likelihood + 'static, readings: &[Timed]) -> usize {
    let mut tracker = Tracker::new(Arc::new(likelihood), TrackerConfig::default());
    let mut wrong = 0;
    for (time_s, truth, reading) in readings {
        let track = tracker.update(*time_s, reading).unwrap();
        let touching = !track.contacts.is_empty();
        assert_eq!(touching, track.touching() > 0.5);
        wrong += usize::from(touching != (truth.force_n > 0.0));
    }
    wrong
}

fn readings(rig: &Example, motion: Motion, seed: u64) -> Vec<Timed> {
    timed_readings(rig, motion, 3.0, seed)
}

/// Asserts the ratio of mean errors of single readings to those of the filter and smoother; returns the coverage
/// of the filter's 95 % regions.
pub(super) fn assert_closer_than_readings(
    likelihood: impl Likelihood + 'static,
    readings: &[Timed],
    [filter, smoother]: [f64; 2],
) -> f64 {
    let likelihood: Arc<dyn Likelihood> = Arc::new(likelihood);
    let mut tracker = SmoothTracker::new(Arc::clone(&likelihood), TrackerConfig::default());
    for (time_s, _, reading) in readings {
        tracker.update(*time_s, reading).unwrap();
    }
    let truths: Vec<Vec<Contact>> = readings.iter().map(|(_, truth, _)| vec![*truth]).collect();
    let errors = |tracks: &[Track]| TrackErrors::new(tracks, &truths, likelihood.extent()).unwrap();
    let (filtered, smoothed) = (errors(tracker.filtered()), errors(&tracker.smoothed(Watch::NONE).unwrap()));
    assert_eq!((filtered.tracked, smoothed.tracked), (readings.len(), readings.len()));
    assert!(filtered.ratio() > filter, "{filtered:?}");
    assert!(smoothed.ratio() > smoother, "{smoothed:?}");
    assert!(filtered.track_covered >= 0.88, "{filtered:?}");
    filtered.track_covered
}

#[test]
fn a_track_is_several_times_closer_than_its_readings() {
    let rig = rig();
    let motion = along_the_beam().with_speed(0.2).unwrap().with_passes(2).unwrap();
    let readings = readings(&rig, motion, 2);
    for (force_n, factors) in [(Some(3.0), [3.0, 5.0]), (None, [4.0, 6.0])] {
        assert!(assert_closer_than_readings(likelihood(&rig, force_n), &readings, factors) < 1.0);
    }
}

#[test]
fn smoothing_stops_on_request() {
    let rig = rig();
    let likelihood = likelihood(&rig, Some(3.0));
    let mut tracker = SmoothTracker::new(Arc::new(likelihood), TrackerConfig::default());
    for (time_s, _, reading) in readings(&rig, along_the_beam(), 2).iter().take(200) {
        tracker.update(*time_s, reading).unwrap();
    }
    assert_eq!(tracker.smoothed(Watch::NONE).unwrap().len(), 200);
    let most = AtomicUsize::new(0);
    let stop_at_half = |progress| match progress {
        Progress::Counted { done, of, .. } => {
            most.fetch_max(done, Ordering::Relaxed);
            done < of / 2
        }
        _ => true,
    };
    assert_eq!(tracker.smoothed(Watch::new(&stop_at_half)), Err(Cancelled));
    let most = most.into_inner();
    assert!((100..200).contains(&most), "{most}");
}

#[test]
fn a_contact_that_lets_go_is_lost_and_found_again() {
    let rig = rig();
    let motion = along_the_beam().with_speed(1.0).unwrap().with_passes(2).unwrap();
    let motion = motion.with_lifts(0.2, 0.02).unwrap();
    let wrong = wrongly_touching(likelihood(&rig, None), &readings(&rig, motion, 3));
    // Only while the force is too small to be detected.
    assert!(wrong <= 15, "{wrong}");
}

#[test]
fn a_beam_that_swings_is_explained_by_its_first_mode() {
    let rig = rig();
    let likelihood = likelihood(&rig, Some(3.0));
    let load = |x_m: f64| Contact { position: Position::along(x_m), force_n: 3.0 };
    // Bent as by a load in the middle that has just jumped.
    let mut response = swinging_beam().at_rest(1, &[load(0.2)]);
    response.change_loads(&[load(0.1)]);
    let sensors = &rig.setup.layout().sensors();
    let reading: Vec<f64> =
        sensors.iter().map(|sensor| response.reading(sensor.kind, sensor.position)).collect();
    let mut whitened = Vec::new();
    likelihood.whiten(&reading, &mut whitened);
    let misfit = |mode_n: Option<f64>| likelihood.fit_one(&whitened, load(0.1), mode_n).misfit;
    assert!(misfit(Some(3.0)) < 2.0, "{}", misfit(Some(3.0)));
    assert!(misfit(None) > 1e3, "{}", misfit(None));
}

#[test]
fn the_scores_of_a_fit_are_the_slopes_of_its_misfit() {
    let rig = rig();
    let likelihood = likelihood(&rig, None);
    let whitened: Vec<f64> = (0..8).map(|i| f64::from(i % 3) * 4.0).collect();
    let unknowns = [4.0, 0.1013, 3.0, 0.3021, 2.0];
    let fit = |[mode_n, x_m, force_n, other_m, other_n]: [f64; 5]| {
        let contacts = [(x_m, force_n), (other_m, other_n)]
            .map(|(x_m, force_n)| Contact { position: Position::along(x_m), force_n });
        likelihood.fit_two(&whitened, contacts, Some(mode_n))
    };
    assert_scores_are_slopes(fit, unknowns, [1e-4, 1e-7, 1e-4, 1e-7, 1e-4]);
}

/// Asserts that each score is −½ of the misfit's slope, by central differences.
pub(super) fn assert_scores_are_slopes<const K: usize>(
    fit: impl Fn([f64; K]) -> ContactFit<K>,
    unknowns: [f64; K],
    steps: [f64; K],
) {
    for (k, step) in steps.into_iter().enumerate() {
        let moved = |by: f64| {
            let mut unknowns = unknowns;
            unknowns[k] += by;
            fit(unknowns).misfit
        };
        let slope = (moved(step) - moved(-step)) / (2.0 * step);
        let score = fit(unknowns).score[k];
        assert!((slope + 2.0 * score).abs() < 1e-4 * score.abs(), "{k}: {slope} {score}");
    }
}

/// Readings in balance under two contacts, each with its force.
fn two_readings(rig: &Example, motions: [Motion; 2], seed: u64) -> Vec<(f64, [Contact; 2], Vec<f64>)> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let errors = ChannelErrors::none(rig.setup.layout());
    let surface = rig.setup.surface().model().unwrap();
    let duration_s = motions[0].duration_s().max(motions[1].duration_s());
    let at = |i: usize| {
        let time_s = i as f64 / RATE_HZ;
        let contacts = [motions[0].contact_at(time_s, 3.0), motions[1].contact_at(time_s, 2.0)];
        let [first, second] = contacts.map(|contact| clean_reading(surface, rig.setup.layout(), contact));
        let clean: Vec<f64> = first.iter().zip(&second).map(|(a, b)| a + b).collect();
        (time_s, contacts, measure(rig.setup.layout(), &clean, &errors, &mut rng))
    };
    (0..(duration_s * RATE_HZ) as usize).map(at).collect()
}

#[test]
fn two_contacts_are_followed_while_one_lets_go_and_comes_down_again() {
    let (rig, motions) = two_moving_loads();
    let recording = rig.simulate(1);
    let task = FitTask::new(&rig.setup, &recording);
    let config = Influence { contacts: 2, ..Influence::default() };
    let likelihood = BeamLikelihood::new(&config.fit_beam(task).unwrap());
    let mut tracker = Tracker::new(Arc::new(likelihood), TrackerConfig::default());
    let (mut wrong, mut all) = (0, 0);
    let (mut tracked, mut alone) = (Vec::new(), Vec::new());
    for (time_s, truths, reading) in two_readings(&rig, motions, 3) {
        let track = tracker.update(time_s, &reading).unwrap();
        let touching: Vec<f64> =
            truths.iter().filter(|truth| truth.force_n > 0.0).map(|truth| truth.position.x_m).collect();
        all += 1;
        wrong += usize::from(touching.len() != track.contacts.len());
        tracked.extend(off_m(&touching, track.contacts.iter().map(|tracked| tracked.x_m).collect()));
        let single = std::iter::once(&track.single.contact).chain(track.single.further.as_slice());
        alone.extend(off_m(&touching, single.map(|contact| contact.position.x_m).collect()));
    }
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    let (tracked_m, alone_m) = (mean(&tracked), mean(&alone));
    eprintln!("{wrong} of {all} wrong; off by {tracked_m} m, readings alone {alone_m} m");
    assert!(wrong * 20 < all, "{wrong} of {all}");
    assert!(2.0 * tracked_m < alone_m, "{tracked_m} {alone_m}");
}

/// Errors of the positions `found`; empty for another number.
fn off_m(touching: &[f64], mut found: Vec<f64>) -> Vec<f64> {
    found.sort_by(f64::total_cmp);
    let pairs = touching.iter().zip(&found);
    if touching.len() == found.len() { pairs.map(|(a, b)| (a - b).abs()).collect() } else { Vec::new() }
}

#[test]
fn readings_out_of_order_are_refused_without_effect() {
    let rig = rig();
    let likelihood: Arc<dyn Likelihood> = Arc::new(likelihood(&rig, Some(3.0)));
    let surface = rig.setup.surface().model().unwrap();
    let contact = Contact { position: Position::along(0.1), force_n: 3.0 };
    let reading = clean_reading(surface, rig.setup.layout(), contact);
    let (mut one, mut other) = (
        Tracker::new(Arc::clone(&likelihood), TrackerConfig::default()),
        Tracker::new(likelihood, TrackerConfig::default()),
    );
    for tracker in [&mut one, &mut other] {
        tracker.update(1.0, &reading).unwrap();
    }
    for time_s in [1.0, 0.5, f64::NAN] {
        assert!(one.update(time_s, &reading).is_err());
    }
    let told = one.update(0.5, &reading).unwrap_err().to_string();
    assert_eq!(told, "the reading is of 0.5 s; it must be later than the previous one, of 1 s");
    assert_eq!(one.update(2.0, &reading), other.update(2.0, &reading));
}

#[test]
fn absurd_readings_and_gaps_leave_numbers_behind() {
    let rig = rig();
    let likelihood = likelihood(&rig, None);
    assert_numbers_after_absurd_readings(
        likelihood,
        [[0.0; 8], [1e9; 8], [-1e150; 8], [1e-3; 8], [-3e-3; 8]],
    );
}

/// Asserts finite contacts on the surface after readings beyond any contact, at increasing intervals.
pub(super) fn assert_numbers_after_absurd_readings<const C: usize>(
    likelihood: impl Likelihood + 'static,
    absurd: [[f64; C]; 5],
) {
    let likelihood: Arc<dyn Likelihood> = Arc::new(likelihood);
    let mut tracker = Tracker::new(Arc::clone(&likelihood), TrackerConfig::default());
    for (i, reading) in absurd.iter().chain(&absurd).enumerate() {
        let track = tracker.update(10f64.powi(i as i32), reading).unwrap();
        assert!(track.touching().is_finite());
        for tracked in track.contacts {
            assert!(likelihood.extent().contains(tracked.estimate().position), "{tracked:?}");
        }
    }
}

/// Compares the derivatives of a linearisation with differences, and its reading with the noise-free one.
pub(super) fn assert_linearised(likelihood: &dyn Likelihood, contact: Contact) {
    let at = likelihood.linearised(&[contact]);
    let forces = if likelihood.known_force_n().is_some() { 0.0 } else { 1.0 };
    let moved = |[x_m, y_m, force_n]: [f64; 3]| {
        let position = Position { x_m: contact.position.x_m + x_m, y_m: contact.position.y_m + y_m };
        likelihood.linearised(&[Contact { position, force_n: contact.force_n + force_n }]).reading
    };
    let sides = if likelihood.extent().width_m().is_some() { 1.0 } else { 0.0 };
    for (i, factor) in [1.0, sides, forces].into_iter().enumerate() {
        let step = 1e-6;
        let by = |sign: f64| std::array::from_fn(|j| if i == j { sign * step } else { 0.0 });
        let (more, less) = (moved(by(1.0)), moved(by(-1.0)));
        let size = at.derivatives[i].iter().fold(1.0, |size: f64, own| size.max(own.abs()));
        for ((more, less), own) in more.iter().zip(&less).zip(&at.derivatives[i]) {
            let difference = factor * (more - less) / (2.0 * step);
            assert!((difference - own).abs() < 1e-5 * size, "{i}: {difference} {own}");
        }
    }
    let signal: f64 = at.reading.iter().map(|own| own * own).sum();
    assert!((signal / likelihood.signal(contact) - 1.0).abs() < 1e-12);
}

#[test]
fn linearisations_are_those_of_differences() {
    let rig = rig();
    for force_n in [Some(3.0), None] {
        let contact = Contact { position: Position::along(0.1234), force_n: 3.0 };
        assert_linearised(&likelihood(&rig, force_n), contact);
    }
}

/// A shift of the baseline moves the drift, and no contact.
#[test]
fn a_baseline_that_moves_moves_no_contact() {
    let rig = rig();
    let config = TrackerConfig { drift: Some(Drift::default()), ..TrackerConfig::default() };
    let likelihood: Arc<dyn Likelihood> = Arc::new(likelihood(&rig, Some(3.0)));
    let (mut still, mut moving) =
        (Tracker::new(Arc::clone(&likelihood), config), Tracker::new(Arc::clone(&likelihood), config));
    let noise = rig.setup.layout().sensors()[0].channel.noise_sd;
    let mut moved = vec![0.0; rig.setup.layout().sensors().len()];
    for (i, (time_s, _, reading)) in readings(&rig, along_the_beam(), 2).iter().take(600).enumerate() {
        let by: Vec<f64> = (0..moved.len()).map(|c| 1e-3 * noise * ((i * (c + 1)) % 7) as f64).collect();
        moved.iter_mut().zip(&by).for_each(|(moved, by)| *moved += by);
        moving.move_baseline(&by);
        let tared: Vec<f64> = reading.iter().zip(&moved).map(|(reading, moved)| reading - moved).collect();
        let (still, moving) =
            (still.update(*time_s, reading).unwrap(), moving.update(*time_s, &tared).unwrap());
        assert_eq!(still.contacts.len(), moving.contacts.len(), "{i}");
        for (still, moving) in still.contacts.iter().zip(&moving.contacts) {
            assert!((still.x_m - moving.x_m).abs() < 1e-7, "{i}: {} {}", still.x_m, moving.x_m);
            assert!((still.sd[0] - moving.sd[0]).abs() < 1e-7, "{i}");
        }
    }
}

#[test]
fn a_new_baseline_restarts_creep_without_a_drift() {
    let rig = rig();
    let likelihood = likelihood(&rig, Some(3.0));
    let noise: Vec<f64> = rig.setup.layout().sensors().iter().map(|sensor| sensor.channel.noise_sd).collect();
    let creep = Creep { share: 0.2, time_s: 10.0 };
    let mut slow = SlowState::new(&likelihood, noise.len(), None, Some(creep));
    let corrected = |slow: &mut SlowState, time_s: f64, size: f64| {
        let (mut whitened, mut reading) = (vec![size; noise.len()], vec![0.0; noise.len()]);
        slow.subtract(time_s, Some(1.0), &mut whitened, &mut reading);
        whitened
    };
    for second in 0..60 {
        corrected(&mut slow, f64::from(second), 100.0);
    }
    let small: Vec<f64> = noise.iter().map(|noise| 0.1 * noise).collect();
    slow.move_baseline(&small);
    assert!(corrected(&mut slow, 60.0, 0.0).iter().all(|value| *value < -1.0));
    let large: Vec<f64> = noise.iter().map(|noise| 5.0 * noise).collect();
    slow.move_baseline(&large);
    assert!(corrected(&mut slow, 61.0, 0.0).iter().all(|value| *value == 0.0));
}

/// Beside an end, force and position of a constant contact trade off; they stay within the calibration's
/// uncertainty.
#[test]
fn force_error_of_a_constant_contact_is_within_the_calibration_variance() {
    let mut rig = crate::fixtures::paper(5e-6, 10);
    rig.training = rig.training.with_force(3.0);
    let setup = rig.setup.clone().unknown_force();
    let influence =
        Influence { source: crate::influence::InfluenceSource::Recording, ..Influence::default() };
    let sensors = CleanSensors::new(setup.surface().model().unwrap(), setup.layout());
    let errors = ChannelErrors::none(setup.layout());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    for x_m in [0.01, 0.02, 0.03, 0.04, 0.2] {
        let clean = sensors.reading(Contact { position: Position::along(x_m), force_n: 3.0 });
        let (mut place, mut force) = (0, 0);
        for seed in 0..20 {
            let recording = rig.simulate(seed);
            let locator = influence.fit_beam(FitTask::new(&setup, &recording)).unwrap();
            let likelihood = Arc::new(BeamLikelihood::new(&locator));
            let mut tracker = Tracker::new(likelihood, TrackerConfig::default());
            let mut found = None;
            for i in 0..200 {
                let reading = measure(setup.layout(), &clean, &errors, &mut rng);
                found = tracker.update(f64::from(i) * 0.01, &reading).unwrap().contacts.first().copied();
            }
            let Some(tracked) = found else { continue };
            place += usize::from((tracked.x_95_m.0..=tracked.x_95_m.1).contains(&x_m));
            let (least_n, most_n) = tracked.force_interval_95_n();
            force += usize::from((least_n..=most_n).contains(&3.0));
        }
        assert!(place >= 17 && force >= 17, "{x_m} m: place {place} of 20, force {force} of 20");
    }
}

/// Residue of a touch, in metres.
fn residue(rig: &Example, sd_m: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let normal = |_| -> f64 { StandardNormal.sample(rng) };
    (0..rig.setup.layout().len()).map(normal).map(|z| sd_m * z).collect()
}

#[test]
fn contacts_end_within_the_residue_of_untouched_rows() {
    const RESIDUE_SD_M: f64 = 40e-6;
    const RESTS: usize = 20;
    const EACH: usize = 30;
    let rig = rig();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    // An untouched row after each press, with a residue of many times the noise.
    let mut recording = rig.simulate(1);
    let presses = std::mem::take(&mut recording.rows);
    for (i, press) in presses.into_iter().enumerate() {
        let untouched =
            Row { force_n: Some(0.0), reading: residue(&rig, RESIDUE_SD_M, &mut rng), ..press.clone() };
        recording.rows.push(press);
        if i < 40 {
            recording.rows.push(untouched);
        }
    }
    let setup = rig.setup.clone().with_force(None).unwrap();
    let locator = Influence::default().fit(&setup, &recording).unwrap().into_locator();
    assert!(locator.untouched_scatter.is_some());
    let layout = rig.setup.layout();
    let touching = |locator: &Locator| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        let config = TrackerConfig::default();
        let mut tracker = Tracker::new(locator.tracking(&config).unwrap().likelihood(), config);
        let sensors = CleanSensors::new(rig.setup.surface().model().unwrap(), layout);
        let errors = ChannelErrors::none(layout);
        let (mut count, mut touched, mut at_rest) = (0, 0, 0);
        for _ in 0..RESTS {
            let contact = Contact { position: Position::along(0.15), force_n: 3.0 };
            let pressed = sensors.reading(contact);
            let rest = residue(&rig, RESIDUE_SD_M, &mut rng);
            for (clean, counter) in [(&pressed, &mut touched), (&rest, &mut at_rest)] {
                for _ in 0..EACH {
                    let reading = measure(layout, clean, &errors, &mut rng);
                    let track = tracker.update(f64::from(count) / RATE_HZ, &reading).unwrap();
                    count += 1;
                    *counter += usize::from(!track.contacts.is_empty());
                }
            }
        }
        [touched, at_rest]
    };
    let all = RESTS * EACH;
    let [touched, at_rest] = touching(&locator);
    assert!(touched > all * 95 / 100 && at_rest < all / 100, "{touched} {at_rest} of {all}");
    let [_, by_noise] = touching(&Locator { untouched_scatter: None, ..locator });
    assert!(by_noise > all / 4, "{by_noise} of {all}");
}

/// The interval check widens the intervals of filter and smoother as it widens those of the locator.
#[test]
fn the_check_of_the_locators_intervals_widens_tracks() {
    let rig = rig();
    let check: IntervalCheck = serde_json::from_str(
        r#"{"places": 19, "presses": 19, "outside_model": 0,
            "position": {"before_percent": 60.0, "after_percent": 95.0, "added_sd": 0.002, "factor": 1.5},
            "force": {"before_percent": 60.0, "after_percent": 95.0, "factor": 2.0}}"#,
    )
    .unwrap();
    let readings = readings(&rig, along_the_beam(), 2);
    let tracks = |check: Option<IntervalCheck>| {
        let likelihood = likelihood(&rig, None).with_checks(LocatorChecks::default().with_intervals(check));
        let mut tracker = SmoothTracker::new(Arc::new(likelihood), TrackerConfig::default());
        for (time_s, _, reading) in readings.iter().take(150) {
            tracker.update(*time_s, reading).unwrap();
        }
        [tracker.filtered().to_vec(), tracker.smoothed(Watch::NONE).unwrap()]
            .map(|tracks| tracks[140].contacts[0])
    };
    for (own, wider) in tracks(None).into_iter().zip(tracks(Some(check))) {
        assert_eq!((own.x_m, own.force_n), (wider.x_m, wider.force_n));
        assert!((wider.sd[0] / (1.5 * own.sd[0].hypot(0.002)) - 1.0).abs() < 1e-9, "{own:?} {wider:?}");
        assert!((wider.sd[2] / (2.0 * own.sd[2]) - 1.0).abs() < 1e-9, "{own:?} {wider:?}");
        assert!(wider.x_95_m.0 < own.x_95_m.0 && wider.x_95_m.1 > own.x_95_m.1);
    }
}
