//! Coverage by distance from the end of the paper's beam: a sample of the experiment `beam-ends`.

use crate::arrangement::Training;
use crate::closed_form::ClosedForm;
use crate::fit::{Fit, FitTask, Locate, NoCheck};
use crate::fixtures::{CoverageTally, Example, paper};
use crate::force_prior::DECADE;
use crate::influence::{Influence, InfluenceSource};
use crate::simulate::clean_reading;
use palpate_core::Status;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{ChannelErrors, measure};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::RangeInclusive;

const PLACES_MM: [f64; 5] = [1.0, 4.0, 15.0, 40.0, 100.0];

/// Readings per place, with the locators of all calibrations in turn.
const READINGS: usize = 300;
const CALIBRATIONS: u64 = 20;

/// Four standard deviations of 300 readings (5 %), and 1.5 % between the experiment's coverage and 95 %.
const COVERED_PERCENT: RangeInclusive<f64> = 88.5..=100.0;

fn bench(force_is_known: bool) -> Example {
    let mut bench = paper(5e-6, 10);
    if !force_is_known {
        bench.training = bench.training.with_force(3.0);
        bench.setup = bench.setup.unknown_force();
    }
    bench
}

fn covered(
    bench: &Example,
    locators: &[Box<dyn Locate<Check = NoCheck>>],
    x_m: f64,
    force_n: f64,
    rng: &mut Xoshiro256PlusPlus,
) -> CoverageTally {
    let mut row = CoverageTally::default();
    let surface = bench.setup.surface().model().unwrap();
    let contact = Contact { position: Position::along(x_m), force_n };
    let truth = clean_reading(surface, bench.setup.layout(), contact);
    let errors = ChannelErrors::none(bench.setup.layout());
    for i in 0..READINGS {
        let reading = measure(bench.setup.layout(), &truth, &errors, rng);
        row.add(&locators[i % locators.len()].locate(&reading), contact);
    }
    row
}

fn check(title: &str, bench: &Example, locators: &[Box<dyn Locate<Check = NoCheck>>], forces_n: &[f64]) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(15);
    let mut wrong = Vec::new();
    for force_n in forces_n {
        for place_mm in PLACES_MM {
            let row = covered(bench, locators, 1e-3 * place_mm, *force_n, &mut rng);
            let (place, force) = (row.percent(row.x_covered), row.percent(row.force));
            let good = |percent: f64| COVERED_PERCENT.contains(&percent) || row.detected < row.readings;
            if !good(place)
                || force < *COVERED_PERCENT.start()
                || row.outside > 0
                || row.greatest_n > DECADE * 3.0
            {
                wrong.push(format!("{force_n} N at {place_mm} mm: {row:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{title}: {wrong:#?}");
}

fn influence(bench: &Example) -> Vec<Box<dyn Locate<Check = NoCheck>>> {
    influence_of(InfluenceSource::Corrected, bench, CALIBRATIONS)
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
    for locator in influence_of(InfluenceSource::Corrected, &bench, 1).iter().chain(&closed_form(&bench)) {
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
    check("influence, force unknown", &bench, &influence(&bench), &[1.0, 6.0]);
}

#[test]
fn the_closed_form_covers_unknown_forces_at_every_distance_from_the_end() {
    let bench = bench(false);
    check("closed form, force unknown", &bench, &closed_form(&bench), &[1.0, 6.0]);
}

#[test]
fn influence_covers_a_known_force_at_every_distance_from_the_end() {
    let bench = bench(true);
    check("influence, force known", &bench, &influence(&bench), &[3.0]);
}

#[test]
fn the_closed_form_covers_a_known_force_at_every_distance_from_the_end() {
    let bench = bench(true);
    check("closed form, force known", &bench, &closed_form(&bench), &[3.0]);
}

/// Without the log determinant, the coverage is 68 to 88 % up to 40 mm from the end.
#[test]
fn influence_learnt_from_presses_alone_covers_unknown_forces_at_every_distance_from_the_end() {
    let mut bench = bench(false);
    bench.training = Training::even(20).with_force(3.0);
    let locators = influence_of(InfluenceSource::Recording, &bench, CALIBRATIONS);
    check("influence from 20 places", &bench, &locators, &[3.0]);
}
