//! Coverage of contacts by their distance from an edge of a plate of which nothing but presses is known: a sample of the experiment `measured-plate-edges`.

use super::*;

const SIDE_M: f64 = 0.3;
/// Presses at each place.
const TIMES: usize = 3;
/// Force of contacts, in newtons.
const FORCE_N: f64 = 5.0;
/// Readings at each place.
const READINGS: usize = 40;
/// Four standard deviations of 40 readings below 95 %, as the readings of a plate share its errors.
const LEAST_PERCENT: f64 = 80.0;

/// The plate of `examples/plate.toml` as raw channels with a count of noise each, that of 5 µm, pressed with 0.5 to 5 N at so many places each
/// way, in the middles of equal parts.
fn bench(places: usize, seed: u64) -> Bench {
    const NOISE_M: f64 = 5e-6;
    const SENSORS: usize = 9;
    let plate = Plate::simply_supported((SIDE_M, SIDE_M), 0.8e-3, 200e9, 0.3).unwrap();
    let quarter = |i: usize| SIDE_M * (i + 1) as f64 / 4.0;
    let sensor = |i: usize| Position { x_m: quarter(i % 3), y_m: quarter(i / 3) };
    let sensors: Vec<Position> = (0..SENSORS).map(sensor).collect();
    let influences: Influences = Box::new(move |at| {
        let reads = |sensor: &Position| plate.influence_function(SensorKind::Deflection, *sensor).at(at);
        sensors.iter().map(|sensor| reads(sensor) / NOISE_M).collect()
    });
    let at = |i: usize| SIDE_M * (i as f64 + 0.5) / places as f64;
    let place = |i: usize| Position { x_m: at(i % places), y_m: at(i / places % places) };
    let all = (0..TIMES * places * places).map(place).collect();
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    Bench::new(Extent::plane(SIDE_M, SIDE_M).unwrap(), SENSORS, influences, all, rng)
}

/// A plate that is pressed, with a locator that knows the force of contacts, or does not.
fn plate(places: usize, known_force_n: Option<f64>) -> [(Bench, ForceLinearLocator); 1] {
    let bench = bench(places, 0);
    let setup = bench.setup();
    let setup = known_force_n.map_or(setup.clone(), |force_n| setup.known_force(force_n).unwrap());
    let recording = bench.recording();
    let locator = fit(FitTask::new(&setup, &recording), Structure::ForceLinear).unwrap().unwrap();
    [(bench, locator)]
}

/// Asserts the coverage of contacts at these distances from the left edge, in millimetres, 60 mm or more from the others.
fn check(mut plate: [(Bench, ForceLinearLocator); 1], places_mm: &[f64]) {
    for place_mm in places_mm {
        let row = covered(&mut plate, READINGS, |rng| {
            let position = Position { x_m: 1e-3 * place_mm, y_m: rng.random_range(0.06..SIDE_M - 0.06) };
            Contact { position, force_n: FORCE_N }
        });
        let least = row.percent(row.x_covered).min(row.percent(row.y_covered)).min(row.percent(row.force));
        assert!(least >= LEAST_PERCENT && row.outside == 0, "{place_mm} mm: {row:?}");
    }
}

/// The outermost of 6 × 6 places are 25 mm from the edges.
#[test]
fn contacts_near_an_edge_are_in_their_intervals() {
    check(plate(6, None), &[5.0, 15.0, 30.0, 150.0]);
}

#[test]
fn contacts_of_known_force_near_an_edge_are_in_their_intervals() {
    check(plate(6, Some(FORCE_N)), &[5.0, 15.0, 30.0, 150.0]);
}

#[test]
fn contacts_between_few_places_of_a_plate_are_in_their_intervals() {
    check(plate(4, None), &[10.0, 60.0, 150.0]);
}
