use std::sync::LazyLock;

use super::search::is_mirror_symmetric;
use super::variance::{ExpectedError, Posterior};
use super::*;
use crate::contacts::ContactPrior;
use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::Auto;
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::simulate::simulate_at;
use palpate_mechanics::sensing::{Sensor, SensorKind};
use palpate_mechanics::surface::plate::PlateSpec;
use palpate_numerics::watch::{Cancelled, Progress};

use crate::fixtures::{Example, noisy, paper, plate};

fn short(design: PositionDesign, count: usize) -> PositionDesign {
    PositionDesign { count, repeats: 1, calibrations: 2, trials: 20, verifications: 4, ..design }
}

fn problem(example: Example, count: usize) -> Result<PositionProblem, PositionError> {
    PositionProblem::new(&example.setup, &short(example.design, count))
}

/// Score: distances of the positions from their wanted places.
fn off(wanted_m: &[f64]) -> impl Fn(&[Position], f64) -> Result<f64, PositionError> + Sync {
    move |positions, _| {
        Ok(positions.iter().zip(wanted_m).map(|(at, wanted_m)| (at.x_m - wanted_m).powi(2)).sum())
    }
}

static BEAM: LazyLock<Extent> = LazyLock::new(|| Extent::line(0.4).unwrap());

#[test]
fn positions_move_to_where_the_score_is_least() {
    let wanted_m = [0.01, 0.08, 0.23, 0.39];
    let search = PatternSearch { extent: *BEAM, mirrored: false, most_trials: 10_000 };
    let score = off(&wanted_m);
    let found = search.run(&score, cells(*BEAM, 4, 1), f64::INFINITY).unwrap();
    for (at, wanted_m) in found.iter().zip(wanted_m) {
        assert!((at.x_m - wanted_m).abs() < 2e-3, "{found:?}");
    }
}

#[test]
fn mirrored_positions_stay_mirrored() {
    let search = PatternSearch { extent: *BEAM, mirrored: true, most_trials: 10_000 };
    let score = off(&[0.03, 0.1, 0.2, 0.3, 0.35]);
    let found = search.run(&score, cells(*BEAM, 5, 1), f64::INFINITY).unwrap();
    for (a, b) in found.iter().zip(found.iter().rev()) {
        assert!((a.x_m + b.x_m - 0.4).abs() < 1e-12, "{found:?}");
    }
    // Between the wanted places of the two in a pair.
    assert!((found[0].x_m - 0.04).abs() < 2e-3, "{found:?}");
}

#[test]
fn a_search_keeps_to_its_trials() {
    let asked = std::sync::atomic::AtomicUsize::new(0);
    let score = |positions: &[Position], _: f64| {
        asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        off(&[0.0; 4])(positions, 0.0)
    };
    let search = PatternSearch { extent: *BEAM, mirrored: false, most_trials: 7 };
    search.run(&score, cells(*BEAM, 4, 1), f64::INFINITY).unwrap();
    assert!(asked.into_inner() <= 7);
}

#[test]
fn a_bench_is_mirrored_or_not() {
    let setup = paper().setup;
    let surface = setup.surface().model().unwrap();
    assert!(is_mirror_symmetric(surface, setup.layout(), 3.0));
    let mut moved = setup.layout().clone();
    moved.edit(|sensors| sensors[0].position.x_m += 1e-3).unwrap();
    assert!(!is_mirror_symmetric(surface, &moved, 3.0));
}

fn forward(setup: &Setup) -> ForwardModel {
    ForwardModel::from_mechanics(setup, Force::Known, Watch::NONE).unwrap()
}

#[test]
fn presses_at_one_place_lower_variance_there_and_nearby() {
    let forward = forward(&noisy().setup);
    let places: Vec<Position> = [0.1, 0.12, 0.3].map(Position::along).into();
    let before = Posterior::prior(&forward, &places);
    let (mut twice, mut once) = (before.clone(), before.clone());
    twice.condition(0, 1.0);
    twice.condition(0, 1.0);
    once.condition(0, 0.5);
    for place in 0..3 {
        // The result is the small difference of large numbers.
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-6 * before.variance(place);
        let (a, b) = (twice.variance(place), once.variance(place));
        assert!(close(a, b), "{a} {b}");
        assert!(close(before.variance_after(place, 0, 0.5), b));
    }
    assert!(once.variance(0) < once.variance(1) && once.variance(1) < once.variance(2));
    assert!(once.variance(2) < before.variance(2));
}

#[test]
fn the_limit_by_learnt_slopes_is_the_limit_by_mechanics() {
    let setup = noisy().setup;
    let forward = forward(&setup);
    let limit = setup.cramer_rao_bound().unwrap();
    for x_m in [0.05, 0.13, 0.25, 0.33] {
        let contact = palpate_mechanics::contact::Contact { position: Position::along(x_m), force_n: 3.0 };
        let (ours, theirs) = (
            forward.information(contact.position).sd_m(1.0, *BEAM),
            limit.bound_at(contact, Force::Known).unwrap().sd_position_m,
        );
        assert!((ours / theirs - 1.0).abs() < 0.02, "{x_m}: {ours} {theirs}");
    }
}

#[test]
fn the_least_variance_is_less_than_the_even_positions() {
    for (setup, count) in [(noisy().setup, 8), (plate(PlateSpec::DEFAULT_ELEMENTS).setup, 9)] {
        let forward = forward(&setup);
        let extent = setup.surface().extent();
        let contacts = WeightedContacts::from_prior(&ContactPrior::over_surface(extent), extent).unwrap();
        let found = variance::least(
            &forward,
            &contacts,
            extent,
            &short(PositionDesign::default(), count),
            Watch::NONE,
        )
        .unwrap();
        let error_m = |positions: &[Position]| {
            let mut expected = ExpectedError::new(&forward, &contacts, extent);
            let first = expected.places.len();
            expected.places.extend(positions);
            let mut posterior = Posterior::prior(&forward, &expected.places);
            (first..first + positions.len()).for_each(|place| posterior.condition(place, 1.0));
            expected.error_m(|place| posterior.variance(place))
        };
        let (columns, rows) = squarest(extent, count);
        assert!(error_m(&found) < error_m(&cells(extent, columns, rows)), "{found:?}");
    }
}

#[test]
fn the_papers_network_is_better_calibrated_near_the_ends() {
    let problem = problem(paper(), 10).unwrap();
    let error = |placement: Placement| {
        let (_, positions) = problem.by_rule().unwrap().into_iter().find(|(of, _)| *of == placement).unwrap();
        let placed = problem.verified(placement, positions, Watch::NONE).unwrap();
        placed.verification.mean_error_m
    };
    assert!(error(Placement::Chebyshev) < 0.7 * error(Placement::Even));
}

#[test]
fn an_interrupted_design_is_cancelled() {
    let problem = problem(noisy(), 4).unwrap();
    let is_searching = |progress| matches!(progress, Progress::Stage { name, .. } if name == SEARCHING);
    for watch in [Watch::new(&|progress| !is_searching(progress)), Watch::new(&|_| false)] {
        let stopped = problem.all(watch).unwrap_err();
        assert!(Cancelled::caused(&stopped), "{stopped}");
    }
}

#[test]
fn a_design_has_every_arrangement_once_and_is_the_same_again() {
    let problem = problem(noisy(), 6).unwrap();
    let placed = problem.all(Watch::NONE).unwrap();
    let names: Vec<&str> = placed.iter().map(|placed| placed.placement.name()).collect();
    assert_eq!(names, ["even", "edge-dense", "chebyshev", "variance-optimal", "optimal"]);
    assert!(placed.iter().all(|placed| placed.positions.len() == 6));
    assert_eq!(problem.all(Watch::NONE).unwrap(), placed);
}

#[test]
fn invalid_design_is_refused() {
    let refusal =
        |example: Example, count: usize| problem(example, count).map(|_| ()).unwrap_err().to_string();
    let network = "an estimator of kind `network` needs at least 2";
    assert_eq!(refusal(paper(), 1), format!("1 training position(s); {network}"));
    assert!(refusal(noisy(), 0).contains("the number of training positions is 0"));
    let auto = PositionDesign::default().estimator(Estimator::Auto(Auto::default()));
    assert!(refusal(Example { design: auto, ..noisy() }, 5).contains("designed for one estimator"));
    let mut unknown = noisy();
    unknown.setup = unknown.setup.unknown_force();
    assert!(refusal(unknown, 5).contains("the force of the presses is not known"));
    let measured = Example { setup: Setup::measured(0.1, &["left", "right"]).unwrap(), ..noisy() };
    assert!(refusal(measured, 5).contains("has no model"));
}

fn begun(positions_m: &[f64], repeats: usize) -> (Setup, Recording) {
    let setup = noisy().setup;
    let positions: Vec<Position> = positions_m.iter().map(|x_m| Position::along(*x_m)).collect();
    let recording = simulate_at(&setup, &positions, repeats, 3).unwrap();
    (setup, recording)
}

fn advised(positions_m: &[f64], repeats: usize) -> Advice {
    let (setup, recording) = begun(positions_m, repeats);
    next_press(&setup, &recording, &PositionDesign::default(), Watch::NONE).unwrap()
}

#[test]
fn next_press_is_at_a_new_position_and_lowers_the_error() {
    let advice = advised(&[0.02, 0.06, 0.1, 0.14, 0.18, 0.22], 5);
    assert!(!advice.is_enough());
    let first = advice.next[0];
    assert!(first.position.x_m > 0.25, "{first:?}");
    assert!(first.error_m < 0.5 * advice.error_m);
    assert!(advice.next.windows(2).all(|pair| pair[1].error_m < pair[0].error_m));
    assert!(advice.endless_error_m < advice.next.last().unwrap().error_m);
}

#[test]
fn expected_error_is_at_most_that_of_the_prior() {
    let guess_m = 0.4 / 12f64.sqrt();
    // Presses in the middle carry almost no information on the readings near the ends.
    let advice = advised(&[0.175, 0.1875, 0.2, 0.2125, 0.225], 5);
    assert!(advice.error_m < guess_m && advice.error_m > 0.3 * guess_m, "{} {guess_m}", advice.error_m);
    let forward = forward(&noisy().setup);
    let contacts = WeightedContacts::from_prior(&ContactPrior::over_surface(*BEAM), *BEAM).unwrap();
    let expected = ExpectedError::new(&forward, &contacts, *BEAM);
    let prior_m = expected.error_m(|_| f64::MAX / 2.0);
    assert!((prior_m / guess_m - 1.0).abs() < 1e-6, "{prior_m} {guess_m}");
}

const TEN_M: [f64; 10] = [0.02, 0.06, 0.1, 0.14, 0.18, 0.22, 0.26, 0.3, 0.34, 0.38];

/// Presses of 1, 2 and 4 N on channels of counts with an offset of 5,000.
fn in_counts(positions_m: &[f64], untouched: usize) -> (Setup, Recording) {
    let (setup, mut recording) = begun(positions_m, 3);
    for (row, force_n) in recording.rows.iter_mut().zip([1.0, 2.0, 4.0].into_iter().cycle()) {
        // The simulated presses have 3 N. Their noise stays, so the scale of a count differs little from press to press.
        row.reading.iter_mut().for_each(|value| *value = 5e3 + 1e6 * *value * force_n / 3.0);
        row.force_n = Some(force_n);
    }
    let nothing =
        Row { force_n: Some(0.0), reading: vec![5e3; recording.channels.len()], ..recording.rows[0].clone() };
    recording.rows.extend(std::iter::repeat_n(nothing, untouched));
    (setup, recording)
}

#[test]
fn offsets_and_untouched_rows_do_not_count_as_noise() {
    let plain = advised(&TEN_M, 3);
    for untouched in [0, 12] {
        let (setup, recording) = in_counts(&TEN_M, untouched);
        let advice = next_press(&setup, &recording, &PositionDesign::default(), Watch::NONE).unwrap();
        assert_eq!((advice.presses, advice.positions), (30, 10));
        let beside_plain = advice.error_m / plain.error_m;
        assert!((0.8..1.25).contains(&beside_plain), "{untouched} untouched: {advice:?} beside {plain:?}");
    }
}

#[test]
fn how_hard_presses_were_does_not_count_as_noise_where_the_force_is_unknown() {
    let advice = |recording: &Recording| {
        let setup = noisy().setup.unknown_force();
        next_press(&setup, recording, &PositionDesign::default(), Watch::NONE).unwrap()
    };
    let (_, plain) = begun(&TEN_M, 6);
    let mut by_hand = plain.clone();
    for (row, share) in by_hand.rows.iter_mut().zip([0.7, 0.85, 0.95, 1.05, 1.15, 1.3].into_iter().cycle()) {
        row.reading.iter_mut().for_each(|value| *value *= share);
        row.force_n = None;
    }
    let (plain, by_hand) = (advice(&plain), advice(&by_hand));
    let [error, endless] = [by_hand.error_m / plain.error_m, by_hand.endless_error_m / plain.endless_error_m];
    assert!((0.8..1.25).contains(&error) && (0.8..1.25).contains(&endless), "{by_hand:?} beside {plain:?}");
}

#[test]
fn presses_that_are_means_of_readings_promise_no_better_readings() {
    let plain = advised(&TEN_M, 40);
    let (setup, mut means) = begun(&TEN_M, 40);
    // Means of twenty readings each.
    means.rows = means
        .rows
        .chunks(20)
        .map(|rows| {
            let reading =
                (0..8).map(|c| palpate_numerics::mean(rows.iter().map(|row| row.reading[c]))).collect();
            Row { reading, ..rows[0].clone() }
        })
        .collect();
    let advice = next_press(&setup, &means, &PositionDesign::default(), Watch::NONE).unwrap();
    assert_eq!(advice.presses, 20);
    let ratio = advice.error_m / plain.error_m;
    assert!((0.9..1.1).contains(&ratio), "{advice:?} beside {plain:?}");
}

/// A beam's readings are smoother than the roughest candidate functions, so a few places determine the rest.
#[test]
fn smooth_readings_leave_little_to_gain_after_few_presses() {
    let advice = advised(&[0.04, 0.12, 0.2, 0.28, 0.36], 3);
    let gain_percent = advice.remaining_gain_percent();
    assert!((5.0..40.0).contains(&gain_percent), "{gain_percent} %: {advice:?}");
}

#[test]
fn design_stops_when_the_gain_is_small() {
    let all: Vec<f64> = (0..40).map(|i| 0.005 + 0.01 * f64::from(i)).collect();
    let advice = advised(&all, 10);
    assert!(advice.is_enough() && advice.reaches_goal() && advice.next.is_empty(), "{advice:?}");
    assert!(advice.remaining_gain_percent() < 5.0);
}

#[test]
fn recording_with_too_little_information_is_refused() {
    let (setup, recording) = begun(&[0.1, 0.2, 0.3], 2);
    let refused = |setup: &Setup, recording: &Recording| {
        next_press(setup, recording, &PositionDesign::default(), Watch::NONE).unwrap_err().to_string()
    };
    assert!(refused(&setup, &recording).contains("3 distinct positions; at least 4"));
    let (mut setup, recording) = begun(&[0.1, 0.2, 0.3, 0.35], 1);
    let perfect = |sensor: &mut Sensor| sensor.channel = ChannelModel::default();
    setup.edit_sensors(|sensors| sensors.iter_mut().for_each(perfect)).unwrap();
    assert!(refused(&setup, &recording).contains("the noise of channel 1 is unknown"));
    setup.edit_sensors(|sensors| drop(sensors.pop())).unwrap();
    assert!(refused(&setup, &recording).contains("8 channels; the setup has 7"));
    assert_eq!(setup.layout().kinds()[0], SensorKind::Deflection);
}

#[test]
fn forces_that_differ_need_a_reading_without_contact() {
    let positions_m: Vec<f64> = (0..12).map(|i| 0.02 + 0.03 * f64::from(i)).collect();
    let (_, mut recording) = in_counts(&positions_m, 0);
    // One press at each position, of 1, 2 and 4 N in turn.
    let rows = recording.rows.into_iter().enumerate();
    recording.rows = rows.filter(|(i, _)| i % 3 == i / 3 % 3).map(|(_, row)| row).collect();
    let setup = Setup::measured(0.4, &["1", "2", "3", "4", "5", "6", "7", "8"]).unwrap();
    let refused = next_press(&setup, &recording, &PositionDesign::default(), Watch::NONE).unwrap_err();
    assert!(matches!(refused, PositionError::NoOffset), "{refused}");
}

#[test]
fn presses_that_do_not_distinguish_places_are_refused() {
    let refused = |setup: &Setup, recording: &Recording| {
        next_press(setup, recording, &PositionDesign::default(), Watch::NONE).unwrap_err()
    };
    let (setup, near) = begun(&[0.2, 0.201, 0.202, 0.203], 3);
    let error = refused(&setup, &near);
    assert!(matches!(error, PositionError::SmallPart { axis: 'x', .. }), "{error}");
    assert!(error.to_string().contains("cover 3.0 mm of 400.0 mm"), "{error}");
    // Noise alone, in three draws.
    for seed in 0..3 {
        let positions: Vec<Position> = TEN_M.map(Position::along).to_vec();
        let setup = noisy().setup.with_force(Some(1e-9)).unwrap();
        let recording = simulate_at(&setup, &positions, 3, seed).unwrap();
        let error = refused(&setup, &recording);
        assert!(matches!(error, PositionError::NothingTold), "{error}");
    }
    let (setup, mut still) = begun(&TEN_M, 3);
    still.rows.iter_mut().for_each(|row| row.reading.fill(5.0));
    assert!(matches!(refused(&setup, &still), PositionError::NothingTold));
}

#[test]
fn constant_channel_is_excluded() {
    let (setup, mut recording) = begun(&TEN_M, 3);
    let advice = |setup: &Setup, recording: &Recording| {
        next_press(setup, recording, &PositionDesign::default(), Watch::NONE).unwrap()
    };
    recording.rows.iter_mut().for_each(|row| row.reading[2] = 7.0);
    let mut dead = setup.clone();
    dead.edit_sensors(|sensors| sensors[2].channel.disabled = true).unwrap();
    assert_eq!(advice(&setup, &recording), advice(&dead, &recording));
}

/// Presses of ten places with a placement error of 2 mm (root mean square), recorded under the intended places.
fn beside_the_places(repeats: usize) -> (Setup, Recording) {
    let beside_m = [2.4e-3, -1.5e-3, -2.4e-3, 1.5e-3];
    let asked = TEN_M.iter().flat_map(|x_m| std::iter::repeat_n(Position::along(*x_m), repeats));
    let pressed = asked.clone().zip(beside_m.into_iter().cycle());
    let pressed: Vec<Position> = pressed.map(|(at, off_m)| Position::along(at.x_m + off_m)).collect();
    let setup = noisy().setup;
    let mut recording = simulate_at(&setup, &pressed, 1, 3).unwrap();
    recording.rows.iter_mut().zip(asked).for_each(|(row, asked)| row.position = asked);
    (setup, recording)
}

#[test]
fn stated_placement_is_taken_out_of_the_noise_of_repeats() {
    let ideal = advised(&TEN_M, 8);
    let (setup, mut recording) = beside_the_places(8);
    let advice = |recording: &Recording| {
        next_press(&setup, recording, &PositionDesign::default(), Watch::NONE).unwrap()
    };
    let unstated = advice(&recording);
    recording.provenance.placement_sd_m = Some(2e-3);
    let stated = advice(&recording);
    // Without the stated error, the scatter of the places counts as noise of the readings: the limit is then that of a hand.
    assert!(unstated.endless_error_m > 3.0 * ideal.endless_error_m, "{unstated:?} beside {ideal:?}");
    let limit = stated.endless_error_m / ideal.endless_error_m;
    assert!((0.7..1.8).contains(&limit), "{stated:?} beside {ideal:?}");
    assert!(stated.error_m > 1.2 * stated.endless_error_m && !stated.is_enough(), "{stated:?}");
}

#[test]
fn placement_of_single_presses_is_added_to_their_noise() {
    let (setup, recording) = begun(&TEN_M, 1);
    let errors_m = [None, Some(1e-3), Some(4e-3)].map(|placement_sd_m| {
        let existing = Training { placement_sd_m, ..Training::even(10) };
        let advice =
            next_press(&setup, &recording, &PositionDesign::for_training(&existing), Watch::NONE).unwrap();
        advice.error_m
    });
    assert!(errors_m[0] < errors_m[1] && errors_m[1] < errors_m[2], "{errors_m:?}");
    // Ten places with a placement error of 4 mm cannot locate a contact much better than a third of that.
    assert!(errors_m[2] > 4e-3 / 10f64.sqrt() * 0.5, "{errors_m:?}");
}
