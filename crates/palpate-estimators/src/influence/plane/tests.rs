//! The estimator on the plate of `examples/plate.toml`, relative to the Cramér–Rao bound.

use super::*;
use crate::arrangement::cells;
use crate::fit::{Fit, FitTask, Locate};
use crate::fixtures::{Example, plate};
use crate::influence::{ForceBelief, Influence, InfluenceFitError, InfluenceSource};
use crate::load_profile::{LoadChannel, LoadSensors};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::simulate::CleanSensors;
use palpate_core::Status;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::{ChannelErrors, ChannelModel, Sensor, measure};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::surface::plate::PlateSpec;
use palpate_numerics::mean;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

fn rig() -> Example {
    plate(PlateSpec::DEFAULT_ELEMENTS, NOISE)
}

const NOISE: ChannelModel = ChannelModel {
    noise_sd: 5e-6,
    resolution: 0.0,
    gain_error: 0.0,
    offset_error: 0.0,
    position_error_m: 0.0,
    range: None,
    disabled: false,
};

fn fit(config: Influence, setup: &Setup, recording: &Recording) -> PlaneLocator {
    config.fit_plane(FitTask::new(setup, recording)).unwrap()
}

fn sensors(setup: &Setup) -> CleanSensors<'_> {
    CleanSensors::new(setup.surface().model().unwrap(), setup.layout())
}

/// Middles of `side` × `side` cells of the concentric rectangle with 90 % of the area.
fn inner_positions(extent: Extent, side: usize) -> Vec<Position> {
    let share = 0.9f64.sqrt();
    let width_m = extent.width_m().unwrap();
    let inner = Extent::plane(share * extent.length_m(), share * width_m).unwrap();
    let margin = |size_m: f64| 0.5 * (1.0 - share) * size_m;
    let moved =
        |at: Position| Position { x_m: at.x_m + margin(extent.length_m()), y_m: at.y_m + margin(width_m) };
    cells(inner, side, side).into_iter().map(moved).collect()
}

/// Calibrations, and cells per side of the inner 90 %.
const CALIBRATIONS: u64 = 1;
const SIDE: usize = 16;

fn calibrated(rig: &Example, source: InfluenceSource) -> Vec<PlaneLocator> {
    let config = Influence { source, ..Influence::default() };
    (0..CALIBRATIONS).map(|seed| fit(config, &rig.setup, &rig.simulate(seed))).collect()
}

/// Replaces the known force by an unknown one.
fn without_force(locator: &PlaneLocator) -> PlaneLocator {
    let json = serde_json::to_string(locator).unwrap().replace("{\"known\":5.0}", "\"unknown\"");
    let changed: PlaneLocator = serde_json::from_str(&json).unwrap();
    assert_eq!(changed.force(), ForceBelief::Unknown);
    changed
}

#[derive(Clone, Copy, Debug)]
struct Touch {
    error_m: f64,
    /// Cramér–Rao bound: standard deviation, and mean error.
    limit_m: [f64; 2],
    /// Coverage by the 95 % ellipse; `None` without detection.
    is_covered: Option<bool>,
}

/// Contacts of 5 N over the inner 90 % of the plate.
fn touches(rig: &Example, locators: &[PlaneLocator], force: Force) -> Vec<Touch> {
    let limit = rig.setup.cramer_rao_bound().unwrap();
    let (clean, errors) = (sensors(&rig.setup), ChannelErrors::none(rig.setup.layout()));
    let mut scratch = PlaneScratch::default();
    let mut touches = Vec::new();
    for (locator, seed) in locators.iter().zip(1000..) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        for position in inner_positions(rig.setup.surface().extent(), SIDE) {
            let contact = Contact { position, force_n: 5.0 };
            let reading = measure(rig.setup.layout(), &clean.reading(contact), &errors, &mut rng);
            let Some(bound) = limit.bound_at(contact, force) else { continue };
            let found = locator.locate_with(&reading, &mut scratch).contact;
            let (dx, dy) = (found.position.x_m - position.x_m, found.position.y_m - position.y_m);
            let is_covered = found.uncertainty.map(|uncertainty| {
                let [xx, xy, _, yy, ..] = uncertainty.covariance;
                let square = dx * dx * yy - 2.0 * dx * dy * xy + dy * dy * xx;
                square <= palpate_numerics::ELLIPSE_95 * (xx * yy - xy * xy)
            });
            let limit_m = [bound.sd_position_m, bound.mean_error_m()];
            touches.push(Touch { error_m: dx.hypot(dy), limit_m, is_covered });
        }
    }
    touches
}

/// Mean error relative to the limit, and coverage, of contacts with a limit in `range_mm`.
fn summed(touches: &[Touch], range_mm: std::ops::Range<f64>) -> (f64, f64) {
    let inside = || touches.iter().filter(|touch| range_mm.contains(&(touch.limit_m[0] * 1e3)));
    let (error_m, limit_m) = (
        inside().map(|touch| touch.error_m).sum::<f64>(),
        inside().map(|touch| touch.limit_m[1]).sum::<f64>(),
    );
    let told = inside().filter_map(|touch| touch.is_covered).count().max(1) as f64;
    let covered = inside().filter(|touch| touch.is_covered == Some(true)).count() as f64 / told;
    (error_m / limit_m, covered)
}

const SOURCES: [InfluenceSource; 3] =
    [InfluenceSource::Corrected, InfluenceSource::Mechanics, InfluenceSource::Recording];

/// A sample of the experiment `plate-limit`.
#[test]
fn the_plate_is_located_at_the_limit_and_ellipses_hold_what_they_say() {
    let rig = rig();
    for source in SOURCES {
        let known = calibrated(&rig, source);
        let unknown: Vec<PlaneLocator> = known.iter().map(without_force).collect();
        for (force, locators) in [(Force::Known, known), (Force::Unknown, unknown)] {
            let touches = touches(&rig, &locators, force);
            // Where the limit exceeds the plate, errors are far below it. The ratio is therefore also
            // asserted for limits below 10 mm: 1.05 to 1.15 in the experiment. The mean of a hundred errors
            // has a standard deviation of 6 %.
            let (everywhere, covered) = summed(&touches, 0.0..f64::INFINITY);
            let (where_it_binds, _) = summed(&touches, 0.0..10.0);
            assert!(everywhere <= 1.2 && where_it_binds <= 1.35, "{source:?}, {force:?}: {where_it_binds}");
            // Four standard deviations of 256 contacts below the 92 % of influence functions from the
            // recording.
            assert!(covered >= 0.85, "{source:?}, {force:?}: {covered}");
        }
    }
}

/// Readings of contacts (mm, mm, N) with the bench's noise.
fn noisy(
    setup: &Setup,
    clean: &CleanSensors,
    contacts: &[(f64, f64, f64)],
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<f64> {
    let mut sum = vec![0.0; setup.layout().len()];
    for &(x_mm, y_mm, force_n) in contacts {
        let position = Position { x_m: x_mm * 1e-3, y_m: y_mm * 1e-3 };
        let reading = clean.reading(Contact { position, force_n });
        sum.iter_mut().zip(reading).for_each(|(sum, value)| *sum += value);
    }
    measure(setup.layout(), &sum, &ChannelErrors::none(setup.layout()), rng)
}

#[test]
fn no_contact_and_two_contacts_are_no_single_contact() {
    let rig = rig();
    let recording = rig.simulate(3);
    let clean = sensors(&rig.setup);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    for force_n in [Some(5.0), None] {
        let setup = rig.setup.clone().with_force(force_n).unwrap();
        let locator = fit(Influence::default(), &setup, &recording);
        let mut false_alarms = 0;
        for _ in 0..50 {
            let nothing = locator.locate(&noisy(&rig.setup, &clean, &[], &mut rng));
            false_alarms += usize::from(nothing.status != Status::NoContact);
            let two = locator.locate(&noisy(
                &rig.setup,
                &clean,
                &[(80.0, 90.0, 5.0), (220.0, 200.0, 5.0)],
                &mut rng,
            ));
            assert_eq!(two.status, Status::OutsideModel, "{force_n:?}: {two:?}");
            let one = locator.locate(&noisy(&rig.setup, &clean, &[(80.0, 90.0, 5.0)], &mut rng));
            assert_eq!(one.status, Status::Located);
            assert!((one.contact.force_n.unwrap() - 5.0).abs() < 0.5, "{force_n:?}: {one:?}");
        }
        // At a false-alarm rate of 0.001, more than one of fifty occurs in one of a thousand tests.
        assert!(false_alarms <= 1, "{force_n:?}: {false_alarms} of 50");
    }
}

#[test]
fn one_sensor_in_the_middle_cannot_tell_the_four_quarters() {
    let mut rig = rig();
    rig.setup.edit_sensors(|sensors| sensors.truncate(2)).unwrap();
    let mut places = [0.15, 0.075].map(|y_m| Position { x_m: 0.15, y_m }).into_iter();
    rig.setup
        .edit_sensors(|sensors| {
            sensors.iter_mut().for_each(|sensor| sensor.position = places.next().unwrap());
        })
        .unwrap();
    let locator = fit(Influence::default(), &rig.setup, &rig.simulate(1));
    let clean = sensors(&rig.setup);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    for _ in 0..20 {
        let estimate = locator.locate(&noisy(&rig.setup, &clean, &[(60.0, 90.0, 5.0)], &mut rng));
        assert_eq!(estimate.status, Status::Ambiguous, "{estimate:?}");
        let all = estimate.modes.as_slice().iter().map(|mode| mode.contact).chain([estimate.contact]);
        let xs: Vec<f64> = all.map(|contact| contact.position.x_m).collect();
        assert!(xs.iter().any(|x_m| *x_m < 0.15) && xs.iter().any(|x_m| *x_m > 0.15), "{xs:?}");
        let total: f64 = estimate.modes.as_slice().iter().map(|mode| mode.probability).sum();
        assert!(total < 1.0, "{estimate:?}");
    }
}

#[test]
fn absurd_readings_are_outside_the_model() {
    let rig = rig();
    let known = fit(Influence::default(), &rig.setup, &rig.simulate(0));
    for locator in [&known, &without_force(&known)] {
        for loud in [1e3, 1e9, -1e150, 1e300, f64::MAX, -f64::MAX] {
            let mut one = [0.0; 9];
            one[4] = loud;
            for reading in [[loud; 9], one] {
                let estimate = locator.locate(&reading);
                assert_eq!(estimate.status, Status::OutsideModel, "{reading:?}: {estimate:?}");
                let Position { x_m, y_m } = estimate.contact.position;
                assert!(
                    (0.0..=0.3).contains(&x_m) && (0.0..=0.3).contains(&y_m),
                    "{reading:?}: {estimate:?}"
                );
                let uncertainty = estimate.contact.uncertainty.unwrap();
                assert!(uncertainty.covariance.iter().all(|value| value.is_finite()), "{estimate:?}");
                assert!(estimate.contact.force_n.unwrap().is_finite());
            }
        }
    }
}

#[test]
fn absurd_readings_of_random_signs_are_outside_the_model_at_unknown_force() {
    let rig = rig();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(23);
    for seed in 0..5 {
        let locator = without_force(&fit(Influence::default(), &rig.setup, &rig.simulate(seed)));
        for size in [1e-2, 1.0, 1e9, 1e300] {
            for _ in 0..25 {
                let reading = [(); 9].map(|()| size * rng.random_range(-1.0..1.0));
                let estimate = locator.locate(&reading);
                assert_eq!(estimate.status, Status::OutsideModel, "{reading:?}: {estimate:?}");
                assert!(estimate.contact.force_n.unwrap() <= 50.0, "{estimate:?}");
            }
        }
    }
}

#[test]
fn a_greatest_force_that_is_said_bounds_estimates_on_a_plane() {
    let rig = rig();
    let setup = rig.setup.clone().unknown_force().with_greatest_force(Some(6.0)).unwrap();
    let locator = fit(Influence::default(), &setup, &rig.simulate(2));
    let clean = sensors(&rig.setup);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(29);
    for (x_mm, y_mm, force_n) in [(8.0, 120.0, 5.0), (20.0, 25.0, 5.9), (150.0, 150.0, 5.99)] {
        for _ in 0..30 {
            let estimate = locator.locate(&noisy(&rig.setup, &clean, &[(x_mm, y_mm, force_n)], &mut rng));
            let told = estimate.contact.uncertainty.and_then(|uncertainty| uncertainty.force_95_n);
            let forces = [estimate.contact.force_n, told.map(|(_, most_n)| most_n)];
            assert!(forces.into_iter().flatten().all(|force_n| force_n <= 6.0), "{estimate:?}");
        }
    }
    let harder = locator.locate(&noisy(&rig.setup, &clean, &[(150.0, 150.0, 9.0)], &mut rng));
    assert_eq!(harder.status, Status::OutsideModel, "{harder:?}");
}

#[test]
fn a_dead_channel_is_left_out_and_the_last_is_kept() {
    let rig = rig();
    let mut locator = fit(Influence::default(), &rig.setup, &rig.simulate(1));
    let clean = sensors(&rig.setup);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    assert!(locator.leave_out(4));
    let mut reading = noisy(&rig.setup, &clean, &[(100.0, 170.0, 5.0)], &mut rng);
    reading[4] = 0.0;
    let estimate = locator.locate(&reading);
    assert_eq!(estimate.status, Status::Located);
    assert!(estimate.contact.position.distance_m(Position { x_m: 0.1, y_m: 0.17 }) < 5e-3, "{estimate:?}");
    assert!((0..9).filter(|channel| locator.leave_out(*channel)).count() == 8);
}

#[test]
fn faults_that_a_calibration_shows_are_corrected() {
    let mut rig =
        plate(PlateSpec::DEFAULT_ELEMENTS, ChannelModel { gain_error: 0.05, offset_error: 20e-6, ..NOISE });
    let told = rig.setup.clone();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(17);
    let mut off_m = || 1e-3 * rng.random_range(-1.0..=1.0);
    let beside = |sensor: &Sensor| {
        let Position { x_m, y_m } = sensor.position;
        Position { x_m: x_m + off_m(), y_m: y_m + off_m() }
    };
    let moved = rig.setup.layout().clone().with_positions(beside);
    rig.setup = rig.setup.with_layout(moved).unwrap();
    let limit = told.cramer_rao_bound().unwrap();
    let errors = ChannelErrors::draw(rig.setup.layout(), &mut rng);
    let clean = sensors(&rig.setup);
    let mut recording = rig.simulate(0);
    for row in &mut recording.rows {
        let reading = clean.reading(Contact { position: row.position, force_n: 5.0 });
        row.reading = measure(rig.setup.layout(), &reading, &errors, &mut rng);
    }
    let locator = fit(Influence::default(), &told, &recording);
    let (mut error_m, mut limit_m) = (0.0, 0.0);
    for position in inner_positions(told.surface().extent(), 12) {
        let contact = Contact { position, force_n: 5.0 };
        let Some(bound) = limit.bound_at(contact, Force::Known).filter(|bound| bound.sd_position_m < 5e-3)
        else {
            continue;
        };
        for _ in 0..5 {
            let reading = measure(rig.setup.layout(), &clean.reading(contact), &errors, &mut rng);
            error_m += locator.locate(&reading).contact.position.distance_m(position);
            limit_m += bound.mean_error_m();
        }
    }
    eprintln!("gains, offsets and places off: {:.3} × limit", error_m / limit_m);
    assert!(error_m < 1.3 * limit_m, "{:.3} × limit", error_m / limit_m);
}

/// Gains and offsets that the mechanics do not know.
#[test]
fn spread_loads_have_learnt_influence_functions_with_their_gains() {
    let rig = plate(24, ChannelModel { gain_error: 0.1, offset_error: 100e-6, ..NOISE });
    let recording = rig.simulate(3);
    let locator = Influence::default().fit(&rig.setup, &recording).unwrap().into_locator();
    let sensors = locator.load_sensors().unwrap();
    let mechanics = LoadSensors::from_setup(&rig.setup).unwrap();
    let misfits = [sensors, mechanics].map(|sensors| {
        let squares = recording.rows.iter().flat_map(|row| {
            let channels = row.reading.iter().zip(sensors.channels.iter().flatten());
            let misfit = |(value, channel): (&f64, &LoadChannel)| {
                (value - channel.offset - 5.0 * channel.influence.at(row.position)) / channel.noise_sd
            };
            channels.map(misfit).map(|misfit| misfit * misfit).collect::<Vec<f64>>()
        });
        mean(squares).sqrt()
    });
    assert!((0.8..1.2).contains(&misfits[0]) && misfits[1] > 5.0, "{misfits:?}");
}

#[test]
fn gradients_of_learnt_influence_functions_are_their_slopes() {
    let rig = plate(24, NOISE);
    let locator = fit(Influence::default(), &rig.setup, &rig.simulate(1));
    let step_m = 1e-6;
    for channel in locator.influences().into_iter().flatten() {
        let at = |x_m: f64, y_m: f64| channel.influence.at(Position { x_m, y_m });
        let gradient = channel.influence.gradient(Position { x_m: 0.0731, y_m: 0.2117 });
        let along = (at(0.0731 + step_m, 0.2117) - at(0.0731 - step_m, 0.2117)) / (2.0 * step_m);
        let across = (at(0.0731, 0.2117 + step_m) - at(0.0731, 0.2117 - step_m)) / (2.0 * step_m);
        let size = along.abs().max(across.abs());
        assert!((gradient[0] - along).abs() < 1e-5 * size && (gradient[1] - across).abs() < 1e-5 * size);
    }
}

#[test]
fn a_locator_file_gives_the_same_locator_and_bad_numbers_are_refused() {
    let rig = rig();
    let locator = fit(Influence::default(), &rig.setup, &rig.simulate(1));
    let json = serde_json::to_string(&locator).unwrap();
    assert_eq!(serde_json::from_str::<PlaneLocator>(&json).unwrap(), locator);
    let replaced = [
        ("\"columns\":49", "\"columns\":48"),
        ("\"sensors\":9", "\"sensors\":8"),
        ("\"width_m\":0.3", "\"width_m\":-0.3"),
        ("{\"known\":5.0}", "{\"known\":-5.0}"),
    ];
    for (good, bad) in replaced {
        assert!(json.contains(good), "{good}");
        assert!(serde_json::from_str::<PlaneLocator>(&json.replace(good, bad)).is_err(), "{bad}");
    }
}

#[test]
fn what_a_plane_cannot_do_is_refused_in_words() {
    let rig = rig();
    let mut recording = rig.simulate(1);
    let refuse = |config: Influence, recording: &Recording| {
        let task = FitTask::new(&rig.setup, recording);
        config.fit_plane(task).unwrap_err()
    };
    let several = refuse(Influence { contacts: 2, ..Influence::default() }, &recording);
    assert_eq!(
        several.to_string(),
        "the surface is a plane: locating several contacts works on a line, such as a beam, only"
    );
    recording.rows.truncate(25);
    let source = InfluenceSource::Recording;
    let few = refuse(Influence { source, ..Influence::default() }, &recording);
    assert_eq!(few, InfluenceFitError::TooFewPositions { needed: 6, found: 5 });
}

#[test]
fn influences_at_the_nodes_are_those_of_the_plate() {
    let rig = plate(16, NOISE);
    let learnt = fit(Influence::default(), &rig.setup, &rig.simulate(1)).influences_at_nodes();
    let sensors = sensors(&rig.setup);
    let full_scale = learnt.values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    for (node, position) in learnt.positions.iter().enumerate().step_by(101) {
        let clean = sensors.reading(Contact { position: *position, force_n: 1.0 });
        for (k, truth) in clean.iter().enumerate() {
            let off = learnt.values[9 * node + k] - truth;
            assert!(off.abs() < 5.0 * learnt.sd[9 * node + k] + 1e-3 * full_scale, "{node}, {k}: {off}");
        }
    }
}
