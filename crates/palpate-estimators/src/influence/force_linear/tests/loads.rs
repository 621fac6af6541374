//! Loads over a length of a strip or an area of a plate.

use super::*;
use crate::estimator::{Estimator, Locator, Method};
use crate::load_profile::{LoadProfile, LoadSensorsError, Profiler};
use palpate_mechanics::surface::InfluenceFunction;

fn locator(bench: &Bench) -> Locator {
    let estimator =
        Estimator::Influence(Influence { structure: Structure::ForceLinear, ..Influence::default() });
    let (setup, recording) = (bench.setup(), bench.recording());
    estimator.fit_without_interval_check(FitTask::new(&setup, &recording)).unwrap()
}

/// Profile of the noisy reading of a load that is spread evenly over a rectangle.
fn profile(bench: &mut Bench, [from, to]: [Position; 2], force_n: f64) -> LoadProfile {
    const POINTS: usize = 6;
    let point = |i: usize| {
        let (u, v) = ((i % POINTS) as f64 + 0.5, (i / POINTS) as f64 + 0.5);
        let between = |from: f64, to: f64, share: f64| from + share * (to - from) / POINTS as f64;
        Position { x_m: between(from.x_m, to.x_m, u), y_m: between(from.y_m, to.y_m, v) }
    };
    let points: Vec<Vec<f64>> = (0..POINTS * POINTS).map(|i| (bench.influences)(point(i))).collect();
    let reading = (0..bench.offsets.len()).map(|c| {
        let noise: f64 = StandardNormal.sample(&mut bench.rng);
        bench.offsets[c] + force_n * mean(points.iter().map(|f| f[c])) + noise
    });
    let reading: Vec<f64> = reading.collect();
    Profiler::new(locator(bench).load_sensors().unwrap()).profile(&reading).unwrap()
}

#[test]
fn total_and_centre_of_a_spread_load_are_found_without_a_model() {
    let mut strip = Bench::strip(2, 75, 25);
    let found = profile(&mut strip, [Position::along(0.12), Position::along(0.16)], 3.0);
    let centre = found.centre.unwrap();
    assert!((found.total_n / 3.0 - 1.0).abs() < 0.05, "{}", found.total_n);
    assert!((centre.position.x_m - 0.14).abs() < 3e-3, "{centre:?}");
    let mut plate = Bench::plate(2);
    let rectangle = [Position { x_m: 0.06, y_m: 0.05 }, Position { x_m: 0.10, y_m: 0.09 }];
    let found = profile(&mut plate, rectangle, 3.0);
    let centre = found.centre.unwrap().position;
    assert!((found.total_n / 3.0 - 1.0).abs() < 0.1, "{}", found.total_n);
    assert!(centre.distance_m(Position { x_m: 0.08, y_m: 0.07 }) < 8e-3, "{centre:?}");
}

#[test]
fn influence_functions_are_those_of_the_table_with_their_slopes() {
    let locator = Bench::plate(1).fit(Structure::ForceLinear).unwrap();
    let table = locator.influences_at_nodes();
    let channels = locator.influences().unwrap();
    for (k, channel) in channels.iter().flatten().enumerate() {
        let at = |i: usize| channel.influence.at(table.positions[i]);
        let value = |i: usize| table.values[i * channels.len() + k];
        assert!((0..table.positions.len()).all(|i| (at(i) - value(i)).abs() < 1e-9));
        assert_eq!(channel.offset, table.offsets[k]);
        assert_slopes(&*channel.influence, Position { x_m: 0.0812, y_m: 0.0433 }, table.positions[1].y_m);
    }
}

fn assert_slopes(function: &dyn InfluenceFunction, at: Position, node_m: f64) {
    let step_m = 1e-4 * node_m.max(1e-3);
    let moved = |x: f64, y: f64| function.at(Position { x_m: at.x_m + x * step_m, y_m: at.y_m + y * step_m });
    let slopes = [moved(1.0, 0.0) - moved(-1.0, 0.0), moved(0.0, 1.0) - moved(0.0, -1.0)];
    let size = slopes[0].abs().max(slopes[1].abs()) / (2.0 * step_m);
    for (found, difference) in function.gradient(at).into_iter().zip(slopes) {
        assert!((found - difference / (2.0 * step_m)).abs() < 1e-4 * size, "{found} {slopes:?}");
    }
}

#[test]
fn readings_that_are_not_proportional_to_the_force_have_no_load_profile() {
    let mut locator = locator(&Bench::strip(2, 75, 25));
    let Method::Influence(InfluenceLocator::ForceLinear(linear)) = &mut locator.method else {
        panic!("{:?}", locator.method)
    };
    linear.stored.prior.response = 1.2;
    let Err(error) = locator.load_sensors() else { panic!("the readings are not proportional") };
    assert!(matches!(error, LoadSensorsError::NotProportional(_)), "{error:?}");
    assert!(error.to_string().ends_with("grow with its power 1.20"), "{error}");
}
