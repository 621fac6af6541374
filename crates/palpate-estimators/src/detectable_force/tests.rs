use super::*;
use crate::closed_form::ClosedForm;
use crate::estimator::{Estimator, Locator, Method};
use crate::fit::{Fit, FitTask};
use crate::fixtures::{Example, paper, plate};
use crate::influence::{Influence, InfluenceLocator, Structure};
use crate::recording::Row;
use crate::setup::Setup;
use crate::simulate::CleanSensors;
use crate::status::FalseAlarmRate;
use crate::untouched_scatter::UntouchedScatter;
use palpate_core::Status;
use palpate_mechanics::limit::{CramerRaoBound, Force};
use palpate_mechanics::sensing::{ChannelErrors, ChannelModel, measure};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const READINGS: usize = 400;

/// Detection probability of a contact.
fn detection_probability(bench: &Example, locator: &Locator, contact: Contact) -> f64 {
    let (surface, layout) = (bench.setup.surface().model().unwrap(), bench.setup.layout());
    let clean = CleanSensors::new(surface, layout).reading(contact);
    let errors = ChannelErrors::none(layout);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let is_found = |_: &usize| {
        let reading = measure(layout, &clean, &errors, &mut rng);
        locator.locate(&reading).unwrap().status != Status::NoContact
    };
    (0..READINGS).filter(is_found).count() as f64 / READINGS as f64
}

/// Checks that forces a tenth below are detected less often than the stated probability, and those a tenth
/// above more often.
fn check(name: &str, bench: &Example, locator: &Locator, touch: &DetectableForce, positions: &[Position]) {
    for position in positions {
        for (share, force_n) in DetectableForce::FOUND.into_iter().zip(touch.forces_at(*position)) {
            let force_n = force_n.unwrap();
            let [less, more] = [0.9, 1.1].map(|times| {
                detection_probability(
                    bench,
                    locator,
                    Contact { position: *position, force_n: times * force_n },
                )
            });
            println!("{name}, {position:?}: {force_n:.5} N is found in {share}: {less:.3} {more:.3}");
            assert!(less < share && share < more, "{name} {position:?} {share}: {less} {more}");
        }
    }
}

const ALONG: [f64; 4] = [0.02, 0.1, 0.17, 0.2];

#[test]
fn on_a_beam_it_is_true_within_a_tenth() {
    let bench = paper(5e-6, 300);
    let setup = bench.setup.clone().unknown_force();
    let positions = ALONG.map(Position::along);
    let limit = bench.setup.cramer_rao_bound().unwrap();
    for rate in [0.01, 0.001].map(|share| FalseAlarmRate::new(share).unwrap()) {
        let estimators = [
            Estimator::Influence(Influence { false_alarm_rate: rate, ..Influence::default() }),
            Estimator::ClosedForm(ClosedForm { false_alarm_rate: rate }),
        ];
        for estimator in estimators {
            let locator =
                estimator.fit_without_interval_check(FitTask::new(&setup, &bench.simulate(0))).unwrap();
            let touch = Influence { false_alarm_rate: rate, ..Influence::default() }.lightest_touch(&limit);
            check(&format!("{} at {rate}", locator.kind()), &bench, &locator, &touch, &positions);
        }
    }
}

#[test]
fn on_a_plate_it_is_true_within_a_tenth() {
    let mut bench = plate(24, ChannelModel { noise_sd: 5e-6, ..ChannelModel::default() });
    bench.training = bench.training.repeated(300);
    let setup = bench.setup.clone().unknown_force();
    let extent = bench.setup.surface().extent();
    let (length_m, width_m) = (extent.length_m(), extent.width_m().unwrap());
    let at = |x: f64, y: f64| Position { x_m: x * length_m, y_m: y * width_m };
    let limit = bench.setup.cramer_rao_bound().unwrap();
    let touch = Influence::default().lightest_touch(&limit);
    let locator = Influence::default()
        .fit_without_interval_check(FitTask::new(&setup, &bench.simulate(0)))
        .unwrap()
        .into_locator();
    check("plate", &bench, &locator, &touch, &[at(0.5, 0.5), at(0.2, 0.35)]);
}

#[test]
fn on_a_surface_without_a_model_it_is_true_within_a_tenth() {
    let bench = paper(5e-6, 20);
    let mut recording = bench.simulate(0);
    let names = bench.setup.layout().names();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let setup = Setup::measured(bench.setup.surface().extent().length_m(), &names).unwrap();
    recording.kinds = setup.layout().kinds();
    let (layout, errors) = (bench.setup.layout(), ChannelErrors::none(bench.setup.layout()));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    for _ in 0..60 {
        let reading = measure(layout, &vec![0.0; layout.len()], &errors, &mut rng);
        recording.rows.push(Row {
            position: Position::default(),
            force_n: Some(0.0),
            nuisances: Vec::new(),
            time_s: None,
            reading,
        });
    }
    let config = Influence { structure: Structure::ForceLinear, ..Influence::default() };
    let locator = config.fit_without_interval_check(FitTask::new(&setup, &recording)).unwrap().into_locator();
    let Method::Influence(InfluenceLocator::ForceLinear(linear)) = &locator.method else { panic!() };
    let positions = [0.1, 0.2].map(Position::along);
    check("force-linear", &bench, &locator, &linear.lightest_touch(), &positions);
    // The Cramér–Rao bound of the locator equals that of the mechanics, up to the error of learnt influences.
    let extent = setup.surface().extent();
    let (learnt, known) = (linear.cramer_rao_bound(extent), bench.setup.cramer_rao_bound().unwrap());
    for position in positions {
        let contact = Contact { position, force_n: 3.0 };
        let sd = |bound: &CramerRaoBound| bound.bound_at(contact, Force::Unknown).unwrap().sd_position_m;
        let ratio = sd(&learnt) / sd(&known);
        assert!((0.85..1.15).contains(&ratio), "{position:?}: {ratio}");
    }
}

#[test]
fn the_scatter_of_untouched_rows_hides_touches_that_noise_would_not() {
    let bench = paper(5e-6, 300);
    let setup = bench.setup.clone().unknown_force();
    let estimator = Estimator::Influence(Influence::default());
    let mut locator = estimator.fit_without_interval_check(FitTask::new(&setup, &bench.simulate(0))).unwrap();
    let limit = bench.setup.cramer_rao_bound().unwrap();
    let by_noise = || Influence::default().lightest_touch(&limit);
    let positions = ALONG.map(Position::along);
    let noise_alone = locator.add_scatter(by_noise());
    assert_eq!(noise_alone.forces_at(positions[1]), by_noise().forces_at(positions[1]));
    let (centre, sd) = (vec![0.0; 8], vec![5e-6; 8]);
    locator.untouched_scatter = Some(UntouchedScatter { centre, sd, bound: 100.0 });
    let touch = locator.add_scatter(by_noise());
    let [noise_n, scatter_n] =
        [by_noise(), locator.add_scatter(by_noise())].map(|touch| touch.forces_at(positions[1])[1].unwrap());
    assert!(scatter_n > 1.5 * noise_n, "{scatter_n} {noise_n}");
    check("scatter", &bench, &locator, &touch, &positions);
    // The force by the scatter does not depend on the assumed noise.
    let mut quiet = bench.setup.clone();
    quiet
        .edit_sensors(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 1e-6))
        .unwrap();
    let limit = quiet.cramer_rao_bound().unwrap();
    let supposed = locator.add_scatter(Influence::default().lightest_touch(&limit));
    let [_, supposed_n] = supposed.forces_at(positions[1]).map(Option::unwrap);
    assert!((supposed_n / scatter_n - 1.0).abs() < 1e-6, "{supposed_n} {scatter_n}");
}

#[test]
fn a_surface_that_does_not_notice_has_no_lightest_touch() {
    let detection = Detection { channels: 3, unknowns: 2, square: 16.0, taken: 11.0 };
    let noise_sds = vec![(0, 1.0), (1, 1.0), (2, 1.0)];
    let new = |change| DetectableForce::new(detection, FalseAlarmRate::default(), noise_sds.clone(), change);
    let touch = new(Box::new(|_| vec![0.0; 3]));
    assert_eq!(touch.forces_at(Position::along(0.1)), [None, None]);
    assert_eq!(touch.summaries(&[Position::along(0.1)]), [None, None]);
    // On a saturating surface contacts are detected below saturation.
    let saturating = |contact: Contact| vec![(4.0 * contact.force_n).min(8.0), 0.0, 0.0];
    let touch = new(Box::new(saturating));
    let [half_n, surely_n] = touch.forces_at(Position::along(0.1)).map(Option::unwrap);
    assert!(half_n < surely_n && 4.0 * surely_n < 8.0);
}

#[test]
fn one_channel_and_one_unknown_are_a_normal_variable() {
    // Detected above 3 or below −3, the roots of C = 9; the length bound of 25 never decides.
    let detection = Detection { channels: 1, unknowns: 1, square: 25.0, taken: 9.0 };
    for signal in [0.0, 1.5, 3.0, 5.0] {
        let expected =
            palpate_numerics::normal_cdf(signal - 3.0) + palpate_numerics::normal_cdf(-3.0 - signal);
        assert!((detection.probability(signal) - expected).abs() < 1e-5, "{signal}");
    }
    assert!((detection.signal(0.5) - 3.0).abs() < 1e-4);
}
