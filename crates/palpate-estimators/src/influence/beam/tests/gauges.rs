//! Contacts beside strain gauges, where influence functions have kinks. Beyond the outermost gauge, place and
//! force are confounded.

use super::*;
use palpate_mechanics::sensing::SensorKind::Strain;
use palpate_mechanics::surface::InfluenceFunction;
use palpate_mechanics::units::{microstrain, mm, newtons};

const GAUGES_MM: [f64; 4] = [50.0, 150.0, 250.0, 350.0];
const FORCES_N: [f64; 3] = [1.0, 3.0, 10.0];

fn gauges() -> (Setup, BeamLocator) {
    let setup = Setup::new(crate::fixtures::beam());
    let setup = setup.sensors(Strain.at_x(GAUGES_MM.map(mm)).noise(microstrain(0.5))).unwrap();
    let pressed = setup.clone().known_force(newtons(3.0)).unwrap();
    let recording = pressed.simulate(&crate::arrangement::Training::even(10), 1).unwrap();
    let mechanics = Influence { source: InfluenceSource::Mechanics, ..Influence::default() };
    let locator = fit(mechanics, &setup, &recording);
    (setup, locator)
}

fn touches_mm() -> impl Iterator<Item = f64> {
    GAUGES_MM.into_iter().flat_map(|gauge| (-20..=20).map(move |step| gauge + 0.31 * f64::from(step)))
}

#[test]
fn variances_include_the_interpolation_errors_of_kinks() {
    let (setup, locator) = gauges();
    let surface = setup.surface().model().unwrap();
    for (s, sensor) in setup.layout().sensors().iter().enumerate() {
        let exact = surface.influence_function(Strain, sensor.position);
        for at in touches_mm().map(|x_mm| Position::along(1e-3 * x_mm)) {
            let table = locator.table();
            let variance = table.variances_near(at.x_m)[s];
            let error = table.function(s).at(at) - exact.at(at);
            assert!(error * error <= 4.0 * variance + 1e-24, "{at:?}: {error}, {variance}");
        }
    }
}

#[test]
fn contacts_beside_gauges_are_found() {
    let (setup, locator) = gauges();
    for force_n in FORCES_N {
        for x_mm in touches_mm() {
            let estimate = locator.locate(&clean(&setup, &[(1e-3 * x_mm, force_n)]));
            let (low_m, high_m) = estimate.contact.uncertainty.unwrap().x_95_m;
            assert_ne!(estimate.status, Status::OutsideModel, "{x_mm} mm, {force_n} N");
            assert!((low_m..=high_m).contains(&(1e-3 * x_mm)), "{x_mm} mm, {force_n} N: {low_m}, {high_m}");
        }
    }
}

#[test]
fn intervals_beside_the_outermost_gauge_include_the_confounded_places() {
    let (setup, locator) = gauges();
    let noise = setup.layout().sensors()[0].channel.noise_sd;
    let mut reading = clean(&setup, &[(0.04, 3.0)]);
    reading[0] -= noise;
    let estimate = locator.locate(&reading);
    let (low_m, high_m) = estimate.contact.uncertainty.unwrap().x_95_m;
    assert!(low_m < 0.02 && high_m > 0.05, "{low_m}, {high_m}");
}
