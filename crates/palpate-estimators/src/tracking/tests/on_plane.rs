//! A plate in balance under a contact that slides over it, lets go and comes down again.

use crate::fit::{Fit, FitTask};
use crate::fixtures::{Example, moving_plate, over_the_plate};
use crate::influence::{Influence, InfluenceLocator, InfluenceSource, PlateLikelihood};
use crate::likelihood::{CalibrationVariance, Likelihood, PlaneLikelihood};
use crate::tracking::tests::{
    Timed, assert_closer_than_readings, assert_linearised, assert_numbers_after_absurd_readings,
    assert_scores_are_slopes, timed_readings, wrongly_touching,
};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Motion;

fn rig() -> Example {
    moving_plate()
}

fn likelihood(rig: &Example, force_n: Option<f64>) -> PlateLikelihood {
    likelihood_from(Influence::default().source, rig, force_n)
}

fn likelihood_from(source: InfluenceSource, rig: &Example, force_n: Option<f64>) -> PlateLikelihood {
    let recording = rig.simulate(1);
    let setup = rig.setup.clone().with_force(force_n).unwrap();
    let task = FitTask::new(&setup, &recording);
    let config = Influence { source, ..Influence::default() };
    match config.fit_method(task).unwrap() {
        InfluenceLocator::Plane(plane) => PlateLikelihood::new(&plane),
        other => panic!("{other:?}"),
    }
}

fn readings(rig: &Example, motion: Motion, seed: u64) -> Vec<Timed> {
    timed_readings(rig, motion, 5.0, seed)
}

#[test]
fn a_track_on_a_plane_is_several_times_closer_than_its_readings() {
    let rig = rig();
    let motion = over_the_plate().with_speed(0.3).unwrap().with_passes(2).unwrap();
    let readings = readings(&rig, motion, 2);
    for force_n in [Some(5.0), None] {
        let covered = assert_closer_than_readings(likelihood(&rig, force_n), &readings, [2.5, 4.0]);
        assert!(covered < 1.0, "{covered}");
    }
}

#[test]
fn a_contact_on_a_plane_that_lets_go_is_lost_and_found_again() {
    let rig = rig();
    let motion = over_the_plate().with_speed(1.0).unwrap().with_passes(2).unwrap();
    let motion = motion.with_lifts(0.2, 0.02).unwrap();
    let wrong = wrongly_touching(likelihood(&rig, None), &readings(&rig, motion, 3));
    // Only while the force is too small to be distinguished from noise.
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
    assert_scores_are_slopes(fit, unknowns, [1e-7, 1e-7, 1e-4]);
}

#[test]
fn calibration_variance_falls_with_repeats() {
    let rig = rig();
    let contact = Contact { position: Position { x_m: 0.12, y_m: 0.17 }, force_n: 5.0 };
    let left_m2 = |repeats: usize| {
        let mut rig = rig.clone();
        rig.training.repeats = repeats;
        // Exact mechanics leaves no uncertainty; a recording alone does.
        let likelihood = likelihood_from(InfluenceSource::Recording, &rig, Some(5.0));
        let [first, second] = likelihood.calibration_variance(&[contact]);
        let [xx, xy, yy] = first.position_m2;
        assert!(xx > 0.0 && yy > 0.0 && xy * xy < xx * yy && first.force_n2 == 0.0);
        assert_eq!(second, CalibrationVariance::default());
        xx + yy
    };
    let (few, many) = (left_m2(5), left_m2(50));
    assert!(few > 2.0 * many, "{few} {many}");
}

#[test]
fn absurd_readings_and_gaps_on_a_plane_leave_numbers_behind() {
    let rig = rig();
    let likelihood = likelihood(&rig, None);
    assert_numbers_after_absurd_readings(
        likelihood,
        [[0.0; 9], [1e9; 9], [-1e150; 9], [1e-3; 9], [-3e-4; 9]],
    );
}

#[test]
fn linearisations_on_a_plane_are_those_of_differences() {
    let rig = rig();
    for force_n in [Some(5.0), None] {
        let position = Position { x_m: 0.1234, y_m: 0.0876 };
        assert_linearised(&likelihood(&rig, force_n), Contact { position, force_n: 5.0 });
    }
}
