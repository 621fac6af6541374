//! A plate in balance under a contact that slides over it, lets go and comes down again.

use crate::fit::{Fit, FitTask};
use crate::fixtures::{Example, moving_plate, over_the_plate};
use crate::influence::{Influence, InfluenceLocator, InfluenceSource, PlateLikelihood};
use crate::likelihood::{Likelihood, PlaneLikelihood};
use crate::setup::Setup;
use crate::tracking::tests::{Timed, timed_readings, wrongly_touching};
use crate::tracking::{SmoothTracker, Tracker, TrackerConfig};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Motion;

fn rig() -> Example {
    moving_plate()
}

fn likelihood(rig: &Example, force_n: Option<f64>) -> PlateLikelihood {
    likelihood_from(Influence::default().from, rig, force_n)
}

fn likelihood_from(from: InfluenceSource, rig: &Example, force_n: Option<f64>) -> PlateLikelihood {
    let recording = rig.simulate(1);
    let setup = Setup { force_n, ..rig.setup.clone() };
    let task = FitTask::new(&setup, &recording);
    let config = Influence { from, ..Influence::default() };
    match config.fit_method(task).unwrap() {
        InfluenceLocator::Plane(plane) => PlateLikelihood::new(&plane),
        other => panic!("{other:?}"),
    }
}

fn readings(rig: &Example, motion: Motion, seed: u64) -> Vec<Timed> {
    timed_readings(rig, motion, 5.0, seed)
}

/// Mean errors of single readings, of the filter and of the smoother, and the shares that the ellipses of the latter two hold.
fn errors(likelihood: &PlateLikelihood, readings: &[Timed]) -> ([f64; 3], [f64; 2]) {
    let mut tracker = SmoothTracker::new(likelihood, TrackerConfig::default());
    for (time_s, _, reading) in readings {
        tracker.follow(*time_s, reading).unwrap();
    }
    let (mut errors, mut covered) = ([0.0; 3], [0.0; 2]);
    let smoothed = tracker.smoothed();
    for ((track, smooth), (_, truth, _)) in tracker.filtered().iter().zip(&smoothed).zip(readings) {
        errors[0] += track.alone.contact.position.distance_m(truth.position);
        for (i, tracked) in [track.contacts[0], smooth.contacts[0]].into_iter().enumerate() {
            let contact = tracked.estimate();
            let [xx, xy, _, yy, ..] = contact.uncertainty.unwrap().covariance;
            let (dx, dy) =
                (contact.position.x_m - truth.position.x_m, contact.position.y_m - truth.position.y_m);
            let square = (dx * dx * yy - 2.0 * dx * dy * xy + dy * dy * xx) / (xx * yy - xy * xy);
            errors[i + 1] += dx.hypot(dy);
            covered[i] += f64::from(u8::from(square <= 5.991));
        }
    }
    let count = readings.len() as f64;
    (errors.map(|sum| sum / count), covered.map(|sum| sum / count))
}

#[test]
fn a_track_on_a_plane_is_several_times_closer_than_its_readings() {
    let rig = rig();
    let motion = over_the_plate().with_speed(0.3).unwrap().with_passes(2).unwrap();
    let readings = readings(&rig, motion, 2);
    for (force_n, filter, smoother) in [(Some(5.0), 2.5, 4.0), (None, 2.5, 4.0)] {
        let ([single, filtered, smoothed], [covered, _]) = errors(&likelihood(&rig, force_n), &readings);
        assert!(single / filtered > filter, "{force_n:?}: {single} {filtered}");
        assert!(single / smoothed > smoother, "{force_n:?}: {single} {smoothed}");
        assert!((0.88..1.0).contains(&covered), "{force_n:?}: {covered}");
    }
}

#[test]
fn a_contact_on_a_plane_that_lets_go_is_lost_and_found_again() {
    let rig = rig();
    let motion = over_the_plate().with_speed(1.0).unwrap().with_passes(2).unwrap();
    let motion = motion.with_lifts(0.2, 0.02).unwrap();
    let wrong = wrongly_touching(&likelihood(&rig, None), &readings(&rig, motion, 3));
    // Only while the force is too small to be told from noise.
    assert!(wrong <= 15, "{wrong}");
}

#[test]
fn the_scores_of_a_fit_on_a_plane_are_the_slopes_of_its_misfit() {
    let rig = rig();
    let likelihood = likelihood(&rig, None);
    let whitened: Vec<f64> = (0..9).map(|i| f64::from(i % 4) * -5.0).collect();
    let unknowns = [0.1013, 0.2021, 4.0];
    let fit = |[x_m, y_m, force_n]: [f64; 3]| {
        likelihood.fit_on_plane(&whitened, Contact { position: Position { x_m, y_m }, force_n })
    };
    for (k, step) in [1e-7, 1e-7, 1e-4].into_iter().enumerate() {
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

#[test]
fn what_calibration_leaves_falls_with_its_repeats() {
    let rig = rig();
    let contact = Contact { position: Position { x_m: 0.12, y_m: 0.17 }, force_n: 5.0 };
    let left_m2 = |repeats: usize| {
        let mut rig = rig.clone();
        rig.training.repeats = repeats;
        // Mechanics that is right leaves nothing uncertain; a recording alone does.
        let likelihood = likelihood_from(InfluenceSource::Recording, &rig, Some(5.0));
        let [[xx, xy, yy], second] = likelihood.calibration_m2(&[contact]);
        assert!(xx > 0.0 && yy > 0.0 && xy * xy < xx * yy && second == [0.0; 3]);
        xx + yy
    };
    let (few, many) = (left_m2(5), left_m2(50));
    assert!(few > 2.0 * many, "{few} {many}");
}

#[test]
fn absurd_readings_and_gaps_on_a_plane_leave_numbers_behind() {
    let rig = rig();
    let likelihood = likelihood(&rig, None);
    let mut tracker = Tracker::new(&likelihood, TrackerConfig::default());
    let absurd = [[0.0; 9], [1e9; 9], [-1e150; 9], [1e-3; 9], [-3e-4; 9]];
    for (i, reading) in absurd.iter().chain(&absurd).enumerate() {
        let track = tracker.follow(10f64.powi(i as i32), reading).unwrap();
        assert!(track.touching().is_finite());
        for tracked in track.contacts {
            let Position { x_m, y_m } = tracked.estimate().position;
            assert!((0.0..=0.3).contains(&x_m) && (0.0..=0.3).contains(&y_m), "{tracked:?}");
        }
    }
}
