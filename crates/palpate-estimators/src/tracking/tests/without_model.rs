//! Contacts on a line and on a plane of raw channels, without a model.

use super::*;
use crate::estimator::Estimator;
use crate::fixtures::{moving_plate, over_the_plate, raw_recording, raw_setup};
use crate::influence::{ForceLinearLikelihood, ForceLinearLocator, InfluenceLocator, Structure};
use crate::likelihood::{CalibrationVariance, PlaneLikelihood};
use crate::recording::Recording;
use crate::setup::Setup;
use rand::RngExt;

/// Presses at the middles of cells, by forces from 1 N to 6 N.
fn presses(rig: &Example, cells: [usize; 2], seed: u64) -> Vec<Row> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (extent, layout) = (rig.setup.surface().extent(), rig.setup.layout());
    let sensors = CleanSensors::new(rig.setup.surface().model().unwrap(), layout);
    let middle = |i: usize, count: usize, side_m: f64| (i as f64 + 0.5) / count as f64 * side_m;
    let press = |i: usize| {
        let position = Position {
            x_m: middle(i % cells[0], cells[0], extent.length_m()),
            y_m: middle(i / cells[0], cells[1], extent.width_m().unwrap_or(0.0)),
        };
        let force_n = rng.random_range(1.0..6.0);
        let clean = sensors.reading(Contact { position, force_n });
        let reading = measure(layout, &clean, &ChannelErrors::none(layout), &mut rng);
        Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading }
    };
    (0..cells[0] * cells[1]).map(press).collect()
}

fn locator(rig: &Example, cells: [usize; 2], force_n: Option<f64>) -> ForceLinearLocator {
    let setup = raw_setup(rig.setup.surface().extent(), rig.setup.layout().len(), force_n);
    let recording = raw_recording(presses(rig, cells, 1));
    let influence = Influence { structure: Structure::ForceLinear, ..Influence::default() };
    match influence.fit_method(FitTask::new(&setup, &recording)).unwrap() {
        InfluenceLocator::ForceLinear(linear) => *linear,
        other => panic!("{other:?}"),
    }
}

fn fitted(setup: &Setup, recording: &Recording, structure: Structure) -> Locator {
    let estimator = Estimator::Influence(Influence { structure, ..Influence::default() });
    estimator.fit_without_interval_check(FitTask::new(setup, recording)).unwrap()
}

fn likelihood(rig: &Example, cells: [usize; 2], force_n: Option<f64>) -> ForceLinearLikelihood {
    ForceLinearLikelihood::new(&locator(rig, cells, force_n)).unwrap()
}

/// The likelihood with a table without posterior variances.
fn certain(locator: &ForceLinearLocator) -> ForceLinearLikelihood {
    let mut file = serde_json::to_value(locator).unwrap();
    for name in ["offset_variances", "variances", "covariances"] {
        let list = file["functions"][name].as_array_mut().unwrap();
        list.iter_mut().for_each(|value| *value = 0.0.into());
    }
    ForceLinearLikelihood::new(&serde_json::from_value(file).unwrap()).unwrap()
}

const LINE: [usize; 2] = [40, 1];
const PLANE: [usize; 2] = [10, 10];

/// The readings of one calibration share its error: the experiment `moving-contacts-without-model` has the
/// coverage of many.
#[test]
fn a_track_on_a_line_without_a_model_is_several_times_closer_than_its_readings() {
    let rig = rig();
    let motion = along_the_beam().with_speed(0.2).unwrap().with_passes(2).unwrap();
    let readings = readings(&rig, motion, 2);
    for force_n in [Some(3.0), None] {
        assert_closer_than_readings(likelihood(&rig, LINE, force_n), &readings, [2.0, 2.5]);
    }
}

/// Calibration errors are about as large as those of a reading.
#[test]
fn a_track_on_a_plane_without_a_model_is_closer_than_its_readings() {
    let rig = moving_plate();
    let motion = over_the_plate().with_speed(0.3).unwrap().with_passes(2).unwrap();
    let readings = timed_readings(&rig, motion, 5.0, 2);
    assert_closer_than_readings(likelihood(&rig, PLANE, None), &readings, [1.3, 1.3]);
}

#[test]
fn a_contact_without_a_model_that_lets_go_is_lost_and_found_again() {
    let rig = rig();
    let motion = along_the_beam().with_speed(1.0).unwrap().with_passes(2).unwrap();
    let motion = motion.with_lifts(0.2, 0.02).unwrap();
    let wrong = wrongly_touching(likelihood(&rig, LINE, None), &readings(&rig, motion, 3));
    // Only while the force is too small to be distinguished from noise.
    assert!(wrong <= 15, "{wrong}");
}

#[test]
fn scores_of_certain_influence_functions_are_the_slopes_of_the_misfit() {
    let rig = rig();
    let line = certain(&locator(&rig, LINE, None));
    let whitened: Vec<f64> = (0..8).map(|i| f64::from(i % 4) * -5.0).collect();
    let fit = |[x_m, force_n]: [f64; 2]| {
        let contact = Contact { position: Position::along(x_m), force_n };
        let ContactFit { misfit, score: [_, x, force], .. } = line.fit_one(&whitened, contact, None);
        ContactFit { misfit, score: [x, force], information: [[0.0; 2]; 2] }
    };
    assert_scores_are_slopes(fit, [0.1013, 4.0], [1e-7, 1e-4]);
    let plate = certain(&locator(&moving_plate(), PLANE, None));
    let whitened: Vec<f64> = (0..9).map(|i| f64::from(i % 4) * -5.0).collect();
    let fit = |[x_m, y_m, force_n]: [f64; 3]| {
        plate.fit_on_plane(&whitened, Contact { position: Position { x_m, y_m }, force_n })
    };
    assert_scores_are_slopes(fit, [0.1013, 0.2021, 4.0], [1e-7, 1e-7, 1e-4]);
}

#[test]
fn linearisations_without_a_model_are_those_of_differences() {
    let rig = rig();
    for force_n in [Some(3.0), None] {
        let contact = Contact { position: Position::along(0.1234), force_n: 3.0 };
        assert_linearised(&likelihood(&rig, LINE, force_n), contact);
    }
    let position = Position { x_m: 0.1234, y_m: 0.0876 };
    assert_linearised(&likelihood(&moving_plate(), PLANE, None), Contact { position, force_n: 5.0 });
}

#[test]
fn calibration_variance_without_a_model_falls_with_the_presses() {
    let rig = rig();
    let contact = Contact { position: Position::along(0.16), force_n: 3.0 };
    let variance_m2 = |places: usize| {
        let likelihood = likelihood(&rig, [places, 1], None);
        let [first, second] = likelihood.calibration_variance(&[contact]);
        assert!(first.position_m2[0] > 0.0 && first.force_n2 > 0.0);
        assert_eq!((first.position_m2[1..].to_vec(), second), (vec![0.0; 2], CalibrationVariance::default()));
        first.position_m2[0]
    };
    let (few, many) = (variance_m2(20), variance_m2(160));
    assert!(few > 2.0 * many, "{few} {many}");
}

#[test]
fn absurd_readings_without_a_model_leave_numbers_behind() {
    let absurd = [[0.0; 8], [1e9; 8], [-1e150; 8], [1e-3; 8], [-3e-4; 8]];
    assert_numbers_after_absurd_readings(likelihood(&rig(), LINE, None), absurd);
    let absurd = [[0.0; 9], [1e9; 9], [-1e150; 9], [1e-3; 9], [-3e-4; 9]];
    assert_numbers_after_absurd_readings(likelihood(&moving_plate(), PLANE, None), absurd);
}

/// Presses over the middle half of the beam alone.
#[test]
fn tracks_stay_where_influence_functions_are_known() {
    let rig = rig();
    let setup = raw_setup(rig.setup.surface().extent(), 8, None);
    let inner = presses(&rig, [80, 1], 1).into_iter().filter(|row| (0.1..0.3).contains(&row.position.x_m));
    let locator = fitted(&setup, &raw_recording(inner.collect()), Structure::ForceLinear);
    let config = TrackerConfig::default();
    let likelihood = locator.tracking(&config).unwrap().likelihood();
    let (first_m, last_m) = likelihood.position_ranges_m()[0];
    assert!((0.08..0.11).contains(&first_m) && (0.29..0.32).contains(&last_m), "{first_m} {last_m}");
    let mut tracker = Tracker::new(likelihood, config);
    for (time_s, _, reading) in readings(&rig, along_the_beam(), 2) {
        for contact in tracker.update(time_s, &reading).unwrap().contacts {
            assert!((first_m - 1e-9..=last_m + 1e-9).contains(&contact.x_m), "{contact:?}");
        }
    }
}

#[test]
fn refusals_name_what_is_missing() {
    let rig = rig();
    let setup = raw_setup(rig.setup.surface().extent(), 8, None);
    let recording = raw_recording(presses(&rig, LINE, 1));
    let refusal = |structure: Structure, config: TrackerConfig| {
        let locator = fitted(&setup, &recording, structure);
        locator.tracking(&config).err().map(|error| error.to_string())
    };
    let free = refusal(Structure::Free, TrackerConfig::default()).unwrap();
    assert!(free.contains("`free`"), "{free}");
    let swing = Some(Swing { frequency_hz: 20.0, damping_ratio: 0.01 });
    let mode = refusal(Structure::ForceLinear, TrackerConfig { swing, ..TrackerConfig::default() }).unwrap();
    assert!(mode.contains("two simple supports"), "{mode}");
    assert_eq!(refusal(Structure::ForceMonotone, TrackerConfig::default()), None);
}
