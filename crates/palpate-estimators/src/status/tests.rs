//! Measured false-alarm rates of `no_contact` and `outside_model`.

use super::rule::{detection_cost, noise_bound};
use super::*;
use crate::closed_form::ClosedForm;
use crate::digit::{DigitEstimator, DigitTheory};
use crate::estimator::{Estimator, Locator};
use crate::fit::{Fit, FitTask, MethodLocator};
use crate::fixtures::{Example, beam, digit, paper, plate, raw_recording};
use crate::influence::{ForceLinearLocator, Influence, InfluenceLocator, Structure};
use crate::neighbours::Neighbours;
use crate::recording::Row;
use crate::setup::Setup;
use crate::simulate::{CleanSensors, clean_reading};
use ndarray::Array1;
use palpate_core::Uncertainty;
use palpate_mechanics::contact::Contact;
use palpate_mechanics::sensing::SensorKind::Deflection;
use palpate_mechanics::sensing::{ChannelErrors, ChannelModel, measure};
use palpate_mechanics::surface::ForceDirection;
use palpate_numerics::normal_cdf;
use palpate_testing::random_field::curvatures;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::{FRAC_PI_2, TAU};

#[test]
fn the_bound_is_the_quantile_of_chi_squared() {
    // For two degrees of freedom P(χ² > b) = e^(−b/2).
    assert!((chi_squared_bound(2) + 2.0 * OUTSIDE_MODEL_RATE.ln()).abs() < 1e-6);
    assert_eq!(chi_squared_bound(0), chi_squared_bound(1));
}

#[test]
fn learnt_bounds_see_every_place_of_a_recording_that_repeats_itself() {
    // 800 presses at twenty positions in turn, with errors of 30 at one position.
    let off_at_one = |i: usize| if i % 20 == 7 { 30.0 } else { 1.0 };
    let rows = (0..800).map(|i| Row {
        position: Position::along(0.01 * (i % 20) as f64),
        force_n: None,
        nuisances: Vec::new(),
        time_s: None,
        reading: vec![off_at_one(i)],
    });
    let recording = raw_recording(rows.collect());
    assert_eq!(recording_bounds([10.0, 100.0], &recording, |reading| [reading[0]; 2]), [60.0, 100.0]);
}

/// Estimator with known noise on a setup.
struct Case {
    name: &'static str,
    bench: Example,
    estimator: Estimator,
    /// Readings of noise, and as many of contacts.
    readings: usize,
    /// Bounds on the rate of `outside_model` contacts, over all tests.
    outside: (f64, f64),
}

/// Presses per position: learnt noise and influence functions are as good as those of the layout.
const REPEATS: usize = 1000;

fn influence() -> Estimator {
    Estimator::Influence(Influence::default())
}

fn cases() -> [Case; 4] {
    let mut plane = plate(24, ChannelModel { noise_sd: 5e-6, ..ChannelModel::default() });
    plane.training = plane.training.repeated(REPEATS);
    // At small deflections the linear theory equals the exact one, at a tenth of the time.
    let linear = Estimator::Digit(DigitEstimator::of_theory(DigitTheory::Linear));
    let case = |name, bench, estimator, readings| {
        // At least the greater rate, at most the sum of both.
        let outside = (OUTSIDE_MODEL_RATE.max(SPREAD_RATE), OUTSIDE_MODEL_RATE + SPREAD_RATE);
        Case { name, bench, estimator, readings, outside }
    };
    let of_digit = case("digit", digit(ForceDirection::Normal, 0.02), linear, 20_000);
    [
        case("influence, beam", paper(5e-6, REPEATS), influence(), 100_000),
        case("influence, plane", plane, influence(), 5_000),
        case("closed form", paper(5e-6, 1), Estimator::ClosedForm(ClosedForm::default()), 20_000),
        Case { outside: (OUTSIDE_MODEL_RATE, OUTSIDE_MODEL_RATE), ..of_digit },
    ]
}

/// Numbers of false alarms of a case.
#[derive(Clone, Copy, Debug, Default)]
struct FalseAlarms {
    /// Noise beyond its bound.
    beyond_noise: usize,
    /// Noise within its bound that a contact explains by more than its cost.
    like_contact: usize,
    /// Contacts that are `outside_model`.
    outside_model: usize,
}

fn false_alarms(case: &Case, setup: &Setup) -> FalseAlarms {
    let locator =
        case.estimator.fit_without_interval_check(FitTask::new(setup, &case.bench.simulate(0))).unwrap();
    let clean = CleanSensors::new(setup.surface().model().unwrap(), setup.layout());
    let (errors, extent) = (ChannelErrors::none(setup.layout()), setup.surface().extent());
    let bound = noise_bound(setup.layout().len(), FalseAlarmRate::DEFAULT);
    let silence = vec![0.0; setup.layout().len()];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let force_n = case.bench.training_setup().force_n().unwrap();
    let mut alarms = FalseAlarms::default();
    for _ in 0..case.readings {
        let noise = measure(setup.layout(), &silence, &errors, &mut rng);
        if locator.locate(&noise).unwrap().status != Status::NoContact {
            let whitened = whitened(setup, &noise);
            let is_beyond = whitened.dot(&whitened) > bound;
            *(if is_beyond { &mut alarms.beyond_noise } else { &mut alarms.like_contact }) += 1;
        }
        let x_m = rng.random_range(0.0..extent.length_m());
        let y_m = extent.width_m().map_or(0.0, |width_m| rng.random_range(0.0..width_m));
        let contact = Contact { position: Position { x_m, y_m }, force_n };
        let reading = measure(setup.layout(), &clean.reading(contact), &errors, &mut rng);
        let status = locator.locate(&reading).unwrap().status;
        alarms.outside_model += usize::from(status == Status::OutsideModel);
    }
    alarms
}

fn whitened(setup: &Setup, reading: &[f64]) -> Array1<f64> {
    setup
        .layout()
        .sensors()
        .iter()
        .zip(reading)
        .map(|(sensor, value)| value / sensor.channel.reading_sd())
        .collect()
}

/// Bounds on the number of false alarms, quantiles 1/10,000 of the binomial distribution.
fn binomial_bounds(count: usize, rate: f64) -> (usize, usize) {
    const MISSED: f64 = 1e-4;
    let n = count as f64;
    let mut probability = (n * (-rate).ln_1p()).exp();
    let (mut cumulative, mut least) = (probability, 0);
    for found in 0..count {
        if cumulative <= MISSED {
            least = found + 1;
        }
        if cumulative >= 1.0 - MISSED {
            return (least, found);
        }
        probability *= (n - found as f64) / (found as f64 + 1.0) * rate / (1.0 - rate);
        cumulative += probability;
    }
    (least, count)
}

/// Bound on the probability that a contact explains noise by more than `cost`: noise exceeds u = √cost along
/// some contact's unit reading. The expected Euler characteristic (Adler and Taylor, Random Fields and
/// Geometry, 2007, section 12.4) is Φ(−u) + (L₁/2π + L₂·u/(2π)^(3/2))·e^(−u²/2), with half the circumference
/// L₁ (on a line the length) and the area L₂ (0) of these readings.
fn chance_of_contact(setup: &Setup, cost: f64) -> f64 {
    const SIDE: usize = 60;
    let clean = CleanSensors::new(setup.surface().model().unwrap(), setup.layout());
    let extent = setup.surface().extent();
    let rows = if extent.width_m().is_some() { SIDE } else { 1 };
    let reading = |row: usize, column: usize| {
        let share = |i: usize| (i as f64 + 0.5) / SIDE as f64;
        let y_m = extent.width_m().map_or(0.0, |width_m| share(row) * width_m);
        let position = Position { x_m: share(column) * extent.length_m(), y_m };
        whitened(setup, &clean.reading(Contact { position, force_n: 1e-3 })).to_vec()
    };
    let [half, area] = curvatures(rows, SIDE, reading);
    let u = cost.sqrt();
    normal_cdf(-u) + (half / TAU + area * u / TAU.powf(1.5)) * (-0.5 * cost).exp()
}

/// Measures a case, and returns a row of the table.
fn check(case: &Case, force_n: Option<f64>) -> String {
    let setup = case.bench.setup.clone().with_force(force_n).unwrap();
    let coordinates = 1 + usize::from(setup.surface().extent().width_m().is_some());
    // A plane has more positions, so a contact on it has a greater cost.
    let cost = contact_cost(unknowns(coordinates, force_n), setup.layout().len(), LINE_PLACES);
    let chance = chance_of_contact(&setup, detection_cost(cost, FalseAlarmRate::DEFAULT));
    let FalseAlarms { beyond_noise, like_contact, outside_model } = false_alarms(case, &setup);
    let per_thousand = |count: usize| 1e3 * count as f64 / case.readings as f64;
    let row = format!(
        "| {} | {} | {} | {:.2} ‰ | {:.2} ‰ ({:.2} ‰) | {:.2} ‰ | {:.2} ‰ |",
        case.name,
        if force_n.is_some() { "known" } else { "unknown" },
        case.readings,
        per_thousand(beyond_noise),
        per_thousand(like_contact),
        1e3 * chance,
        per_thousand(beyond_noise + like_contact),
        per_thousand(outside_model),
    );
    let half = 0.5 * FalseAlarmRate::DEFAULT.share();
    for (alarms, (least, most)) in [(beyond_noise, (half, half)), (outside_model, case.outside)] {
        let (least, most) = (binomial_bounds(case.readings, least).0, binomial_bounds(case.readings, most).1);
        assert!((least..=most).contains(&alarms), "{row}: {alarms} not in {least}..={most}");
    }
    let (_, most) = binomial_bounds(case.readings, chance);
    assert!(like_contact <= most, "{row}: {like_contact}, at most {most}");
    let (_, most) = binomial_bounds(case.readings, 2e-3);
    assert!(beyond_noise + like_contact <= most, "{row}: noise is `no_contact` in 99.8 %");
    row
}

/// Printed with --nocapture.
#[test]
fn false_alarm_rate_equals_that_of_the_rule() {
    let cases = cases();
    let rows: Vec<String> = std::thread::scope(|scope| {
        let checks = cases.iter().flat_map(|case| {
            [case.bench.training_setup().force_n(), None]
                .map(|force_n| scope.spawn(move || check(case, force_n)))
        });
        let running: Vec<_> = checks.collect();
        running.into_iter().map(|check| check.join().unwrap()).collect()
    });
    println!(
        "| estimator | force | readings | beyond noise | like a contact (at most) | not `no_contact` | `outside_model` |"
    );
    println!("|---|---|---|---|---|---|---|\n{}", rows.join("\n"));
}

/// The beam's presses as raw channels; a seventh of the rows are untouched.
fn force_linear_locator() -> MethodLocator<ForceLinearLocator> {
    let bench = paper(5e-6, 100);
    let mut recording = bench.simulate(0);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let (layout, errors) = (bench.setup.layout(), ChannelErrors::none(bench.setup.layout()));
    let silence = vec![0.0; layout.len()];
    for row in recording.rows.iter_mut().step_by(7) {
        row.force_n = Some(0.0);
        row.reading = measure(layout, &silence, &errors, &mut rng);
    }
    let names = layout.names();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let setup = Setup::measured(bench.setup.surface().extent().length_m(), &names).unwrap();
    recording.kinds = setup.layout().kinds();
    let config = Influence { structure: Structure::ForceLinear, ..Influence::default() };
    config.fit_without_interval_check(FitTask::new(&setup, &recording)).unwrap().map(|method| match method {
        InfluenceLocator::ForceLinear(linear) => *linear,
        other => panic!("{other:?}"),
    })
}

#[test]
fn a_force_linear_surface_has_the_rate_that_is_set() {
    const LOCATED: usize = 500;
    let bench = paper(5e-6, 1);
    let (layout, errors) = (bench.setup.layout(), ChannelErrors::none(bench.setup.layout()));
    let silence = vec![0.0; layout.len()];
    let fitted = force_linear_locator();
    for (share, readings) in [(0.01, 5_000), (0.001, 20_000)] {
        let rate = FalseAlarmRate::new(share).unwrap();
        let mut locator = fitted.clone().map(|linear| linear.with_false_alarm_rate(rate));
        // The rule of the noise alone.
        locator.untouched_scatter = None;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let is_alarm = |reading: &usize| {
            let noise = measure(layout, &silence, &errors, &mut rng);
            // The position of a contact is searched in a few readings only.
            let is_noise = locator.method.is_noise(&noise);
            assert!(
                *reading >= LOCATED
                    || is_noise == (locator.locate(&noise).unwrap().status == Status::NoContact)
            );
            !is_noise
        };
        let alarms = (0..readings).filter(is_alarm).count();
        println!("force-linear at {share}: {alarms} of {readings}");
        // The bounds include the posterior variance of noise and offsets, and contacts are evaluated at grid
        // nodes only.
        let (least, _) = binomial_bounds(readings, 0.8 * share);
        let (_, most) = binomial_bounds(readings, 1.1 * share);
        assert!((least..=most).contains(&alarms), "{share}: {alarms} not in {least}..={most}");
    }
}

#[test]
fn surfaces_with_a_model_exceed_another_rate_no_more_than_the_default_one() {
    const READINGS: usize = 20_000;
    let rate = FalseAlarmRate::new(0.01).unwrap();
    let bench = paper(5e-6, REPEATS);
    let (layout, errors) = (bench.setup.layout(), ChannelErrors::none(bench.setup.layout()));
    let silence = vec![0.0; layout.len()];
    let estimators = [
        Estimator::Influence(Influence { false_alarm_rate: rate, ..Influence::default() }),
        Estimator::ClosedForm(ClosedForm { false_alarm_rate: rate }),
    ];
    for (estimator, force_n) in
        estimators.iter().flat_map(|estimator| [Some(3.0), None].map(|force_n| (estimator, force_n)))
    {
        let setup = bench.setup.clone().with_force(force_n).unwrap();
        let locator = estimator.fit_without_interval_check(FitTask::new(&setup, &bench.simulate(0))).unwrap();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let is_alarm = |_: &usize| {
            let noise = measure(layout, &silence, &errors, &mut rng);
            locator.locate(&noise).unwrap().status != Status::NoContact
        };
        let alarms = (0..READINGS).filter(is_alarm).count();
        println!("{} at {rate}, force {force_n:?}: {alarms} of {READINGS}", locator.kind());
        // At 0.1 % up to 1.3 times the rate (docs/validation/false-alarms.md).
        assert!((READINGS / 200..=3 * READINGS / 200).contains(&alarms), "{}: {alarms}", locator.kind());
    }
}

#[test]
fn the_bounds_of_noise_are_exceeded_at_the_rate() {
    const READINGS: usize = 60_000;
    // Directions along a quarter of a circle in five channels.
    let directions = Directions { length: FRAC_PI_2, area: 0.0 };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let normal = rand_distr::StandardNormal;
    let noise: Vec<[f64; 5]> = (0..READINGS).map(|_| std::array::from_fn(|_| rng.sample(normal))).collect();
    for share in [0.01, 0.001] {
        let bounds = NoiseBounds::new(5, directions, FalseAlarmRate::new(share).unwrap());
        let exceeds = |d: &&[f64; 5]| {
            // The largest component along (cos t, sin t) of the first two, t from 0 to a quarter turn.
            let angle = d[1].atan2(d[0]);
            let most = match (0.0..=FRAC_PI_2).contains(&angle) {
                true => d[0].hypot(d[1]),
                false => d[0].max(d[1]),
            };
            d.iter().map(|d| d * d).sum::<f64>() > bounds.square || most.max(0.0).powi(2) > bounds.taken
        };
        let alarms = noise.iter().filter(exceeds).count();
        let (least, most) = binomial_bounds(READINGS, share);
        assert!((least..=most).contains(&alarms), "{share}: {alarms} not in {least}..={most}");
    }
}

#[test]
fn as_many_readings_as_unknowns_can_be_outside_the_model() {
    let mut bench = paper(5e-6, REPEATS);
    let layout = Setup::new(beam()).sensors(Deflection.evenly(2).noise(5e-6)).unwrap().layout().clone();
    bench.setup = bench.setup.with_layout(layout).unwrap();
    let setup = bench.setup.clone().unknown_force();
    let pressed = Contact { position: Position::along(0.2), force_n: 3.0 };
    let lifted: Vec<f64> = clean_reading(&beam(), setup.layout(), pressed).iter().map(|r| -r).collect();
    for estimator in [influence(), Estimator::ClosedForm(ClosedForm::default())] {
        let locator = estimator.fit_without_interval_check(FitTask::new(&setup, &bench.simulate(0))).unwrap();
        assert_eq!(locator.locate(&lifted).unwrap().status, Status::OutsideModel);
        let outside = (0.0, OUTSIDE_MODEL_RATE);
        let case = Case { name: "two sensors", bench: bench.clone(), estimator, readings: 20_000, outside };
        let FalseAlarms { outside_model, .. } = false_alarms(&case, &setup);
        // A place and a force explain most contacts to the last bit.
        let (_, most) = binomial_bounds(case.readings, case.outside.1);
        assert!(outside_model <= most, "{}: {outside_model}", locator.kind());
    }
}

/// Counts contacts that are `located` or `ambiguous`, and those of them with the whole surface as interval.
fn undetermined_counts(locator: &Locator, bench: &Example, force_n: f64, contacts: usize) -> [usize; 2] {
    let (layout, extent) = (bench.setup.layout(), bench.setup.surface().extent());
    let clean = CleanSensors::new(bench.setup.surface().model().unwrap(), layout);
    let errors = ChannelErrors::none(layout);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut counts = [0; 2];
    for _ in 0..contacts {
        let x_m = rng.random_range(0.0..extent.length_m());
        let y_m = extent.width_m().map_or(0.0, |width_m| rng.random_range(0.0..width_m));
        let contact = Contact { position: Position { x_m, y_m }, force_n };
        let reading = measure(layout, &clean.reading(contact), &errors, &mut rng);
        let estimate = locator.locate(&reading).unwrap();
        let Some(uncertainty) = estimate.contact.uncertainty else { continue };
        let share = |(low, high): (f64, f64), side_m: f64| (high - low) / side_m;
        let shares = [
            share(uncertainty.x_95_m, extent.length_m()),
            extent.width_m().map_or(1.0, |width_m| share(uncertainty.y_95_m, width_m)),
        ];
        let is_told = matches!(estimate.status, Status::Located | Status::Ambiguous);
        let is_open = shares.iter().all(|share| *share >= UNDETERMINED_SHARE);
        assert!(
            !(is_open && estimate.status == Status::Located),
            "{}: located anywhere: {estimate:?}",
            locator.kind()
        );
        counts[0] += usize::from(is_told);
        counts[1] += usize::from(is_told && is_open);
    }
    counts
}

/// Printed with --nocapture.
#[test]
fn undetermined_contacts_are_not_located() {
    const CONTACTS: usize = 2_000;
    let plate = plate(24, ChannelModel { noise_sd: 5e-6, ..ChannelModel::default() });
    println!("| bench | force | told | of these with the place left open |\n|---|---|---|---|");
    for (name, bench, forces_n) in [("beam", paper(5e-6, 10), [1.0, 3.0]), ("plate", plate, [2.0, 5.0])] {
        let setup = bench.setup.clone().unknown_force();
        let presses = bench.simulate(0);
        for estimator in [influence(), Estimator::Neighbours(Neighbours::default())] {
            let locator = estimator.fit_without_interval_check(FitTask::new(&setup, &presses)).unwrap();
            let kind = locator.kind();
            for force_n in forces_n {
                let [told, open] = undetermined_counts(&locator, &bench, force_n, CONTACTS);
                let percent = 100.0 * open as f64 / told as f64;
                println!("| {name}, {kind} | {force_n} N | {told} of {CONTACTS} | {percent:.2} % |");
                // There are a few such contacts, near ends and edges.
                assert!(open > 0 && percent < 3.0, "{name}, {kind}, {force_n} N: {open} of {told}");
            }
        }
    }
}

#[test]
fn interval_of_a_whole_side_leaves_the_other_coordinate_determined() {
    let plane = Extent::plane(0.3, 0.2).unwrap();
    let of = |x_95_m, y_95_m, status| {
        let uncertainty = Uncertainty { x_95_m, y_95_m, ..Uncertainty::default() };
        let contact = ContactEstimate { uncertainty: Some(uncertainty), ..ContactEstimate::default() };
        mark_undetermined(Estimate::of_contact(contact, status), plane).status
    };
    let (whole_x, whole_y) = ((0.0, 0.29), (-0.1, 0.195));
    assert_eq!(of(whole_x, whole_y, Status::Located), Status::Ambiguous);
    assert_eq!(of(whole_x, (0.05, 0.195), Status::Located), Status::Located);
    assert_eq!(of((0.02, 0.3), whole_y, Status::Located), Status::Located);
    // Parts of an interval beyond the surface do not count.
    assert_eq!(of(whole_x, (-0.1, 0.1), Status::Located), Status::Located);
    for status in [Status::NoContact, Status::OutsideModel, Status::OutsideSurface] {
        assert_eq!(of(whole_x, whole_y, status), status);
    }
    let unknown = Estimate::of_position(Position::along(0.1), Status::Located);
    assert_eq!(mark_undetermined(unknown, plane).status, Status::Located);
}
