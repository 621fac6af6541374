//! Coverage of contacts by their distance from the end of the paper's beam.

use crate::arrangement::Training;
use crate::closed_form::ClosedForm;
use crate::fit::{Fit, FitTask, Locate, NoCheck};
use crate::fixtures::{Covered, Example, paper, readings};
use crate::force_prior::DECADE;
use crate::influence::{Influence, InfluenceSource};
use crate::simulate::clean_reading;
use palpate_core::Status;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{ChannelErrors, measure};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::RangeInclusive;

/// Distances from the left end, in millimetres.
const PLACES_MM: [f64; 11] = [0.5, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0, 22.0, 25.0, 40.0, 100.0];

/// Readings at each place; docs/validation/tables/at-the-limit.md has the tables of 4,000: PALPATE_READINGS=4000.
const READINGS: usize = 1800;

/// The paper's beam, pressed with its known force.
fn bench(force_is_known: bool) -> Example {
    let mut bench = paper(5e-6, 10);
    if !force_is_known {
        bench.training = bench.training.with_force(3.0);
        bench.setup = bench.setup.unknown_force();
    }
    bench
}

/// Coverage of contacts at one place, by locators in turn.
fn covered(
    bench: &Example,
    locators: &[Box<dyn Locate<Check = NoCheck>>],
    x_m: f64,
    force_n: f64,
    rng: &mut Xoshiro256PlusPlus,
) -> Covered {
    let mut row = Covered::default();
    let surface = bench.setup.surface().model().unwrap();
    let contact = Contact { position: Position::along(x_m), force_n };
    let truth = clean_reading(surface, bench.setup.layout(), contact);
    let errors = ChannelErrors::none(bench.setup.layout());
    for i in 0..readings(READINGS) {
        let reading = measure(bench.setup.layout(), &truth, &errors, rng);
        row.add(&locators[i % locators.len()].locate(&reading), contact);
    }
    row
}

fn print_and_check(
    title: &str,
    bench: &Example,
    locators: &[Box<dyn Locate<Check = NoCheck>>],
    forces_n: &[f64],
    allowed_percent: RangeInclusive<f64>,
) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(15);
    let mut wrong = Vec::new();
    for force_n in forces_n {
        eprintln!(
            "{title}, {force_n} N\n| from the end | contact found | place covered | force covered | mean width | mean error | greatest force | outside_model |\n|---|---|---|---|---|---|---|---|"
        );
        for place_mm in PLACES_MM {
            let row = covered(bench, locators, 1e-3 * place_mm, *force_n, &mut rng);
            let (place, force) = (row.percent(row.along), row.percent(row.force));
            eprintln!(
                "| {place_mm} mm | {:.1} % | {place:.1} % | {force:.1} % | {:.2} mm | {:.2} mm | {:.2} N | {:.2} % |",
                row.found_percent(),
                row.mean(row.width_mm),
                row.mean(row.error_mm),
                row.greatest_n,
                row.percent(row.doubted)
            );
            let good = |percent: f64| allowed_percent.contains(&percent) || row.found < row.readings;
            if !good(place)
                || force < *allowed_percent.start()
                || row.outside > 0
                || row.greatest_n > DECADE * 3.0
            {
                wrong.push(format!("{force_n} N at {place_mm} mm: {row:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{title}: {wrong:#?}");
}

fn influence(bench: &Example, calibrations: u64) -> Vec<Box<dyn Locate<Check = NoCheck>>> {
    influence_of(InfluenceSource::Corrected, bench, calibrations)
}

fn influence_of(
    source: InfluenceSource,
    bench: &Example,
    calibrations: u64,
) -> Vec<Box<dyn Locate<Check = NoCheck>>> {
    let influence = Influence { source, ..Influence::default() };
    let fit = |seed: u64| -> Box<dyn Locate<Check = NoCheck>> {
        let recording = bench.simulate(seed);
        Box::new(influence.fit_beam(FitTask::new(&bench.setup, &recording)).unwrap())
    };
    (0..calibrations).map(fit).collect()
}

fn closed_form(bench: &Example) -> Vec<Box<dyn Locate<Check = NoCheck>>> {
    let recording = bench.simulate(0);
    vec![Box::new(ClosedForm::default().fit_method(FitTask::new(&bench.setup, &recording)).unwrap())]
}

#[test]
fn a_greatest_force_that_is_said_bounds_estimates_and_intervals() {
    const GREATEST_N: f64 = 5.0;
    let mut bench = bench(false);
    bench.setup = bench.setup.with_greatest_force(Some(GREATEST_N)).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let surface = bench.setup.surface().model().unwrap();
    for locator in influence(&bench, 1).iter().chain(&closed_form(&bench)) {
        let mut hardest_n = 0.0f64;
        for (place_mm, force_n) in
            [3.0, 10.0, 30.0, 200.0, 395.0].into_iter().flat_map(|mm| [3.0, 4.95].map(|n| (mm, n)))
        {
            let contact = Contact { position: Position::along(1e-3 * place_mm), force_n };
            let truth = clean_reading(surface, bench.setup.layout(), contact);
            for _ in 0..50 {
                let errors = ChannelErrors::none(bench.setup.layout());
                let estimate = locator.locate(&measure(bench.setup.layout(), &truth, &errors, &mut rng));
                let told = estimate.contact.uncertainty.unwrap().force_95_n.map_or(0.0, |(_, most)| most);
                let found = [estimate.contact.force_n.unwrap(), told];
                hardest_n = found.into_iter().fold(hardest_n, f64::max);
                assert!(hardest_n <= GREATEST_N, "{place_mm} mm, {force_n} N: {estimate:?}");
            }
        }
        assert!(hardest_n > 0.99 * GREATEST_N, "{hardest_n}");
        let harder = Contact { position: Position::along(0.2), force_n: 7.0 };
        let estimate = locator.locate(&clean_reading(surface, bench.setup.layout(), harder));
        assert_eq!(estimate.status, Status::OutsideModel, "{estimate:?}");
        assert!(estimate.contact.force_n.unwrap() <= GREATEST_N);
    }
}

#[test]
fn influence_covers_unknown_forces_at_every_distance_from_the_end() {
    let bench = bench(false);
    print_and_check(
        "influence, force unknown",
        &bench,
        &influence(&bench, 200),
        &[1.0, 3.0, 6.0],
        93.0..=97.0,
    );
}

#[test]
fn the_closed_form_covers_unknown_forces_at_every_distance_from_the_end() {
    let bench = bench(false);
    print_and_check(
        "closed form, force unknown",
        &bench,
        &closed_form(&bench),
        &[1.0, 3.0, 6.0],
        93.0..=97.0,
    );
}

#[test]
fn influence_covers_a_known_force_at_every_distance_from_the_end() {
    let bench = bench(true);
    print_and_check("influence, force known", &bench, &influence(&bench, 200), &[3.0], 93.0..=97.0);
}

#[test]
fn the_closed_form_covers_a_known_force_at_every_distance_from_the_end() {
    let bench = bench(true);
    print_and_check("closed form, force known", &bench, &closed_form(&bench), &[3.0], 93.0..=97.0);
}

/// Without the logarithm of the determinant, 20 presses covered 68 to 88 % up to 40 mm from the end.
#[test]
fn influence_learnt_from_presses_alone_covers_unknown_forces_at_every_distance_from_the_end() {
    let mut bench = bench(false);
    for (count, repeats) in [(20, 1), (10, 10)] {
        bench.training = Training::even(count).repeated(repeats).with_force(3.0);
        let locators = influence_of(InfluenceSource::Recording, &bench, 200);
        print_and_check(
            &format!("influence from {count} places × {repeats}, force unknown"),
            &bench,
            &locators,
            &[3.0, 6.0],
            90.0..=99.0,
        );
    }
}
