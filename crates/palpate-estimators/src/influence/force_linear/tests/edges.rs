//! Coverage of contacts by their distance from an edge of a plate of which nothing but presses is known.

use super::*;
use crate::fixtures::readings;

const SIDE_M: f64 = 0.3;
/// Presses at each place.
const TIMES: usize = 3;
/// Forces of contacts, in newtons; quick tests have the first alone.
const CONTACTS_N: [f64; 2] = [5.0, 2.0];
/// Distances from the left edge, in millimetres; 60 mm or more from the others.
const PLACES_MM: [f64; 8] = [3.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 150.0];
/// Readings at each place; docs/explanation/measured.md has the tables of 400: PALPATE_READINGS=400.
const READINGS: usize = 40;
/// Readings at each place by one plate.
const OF_A_PLATE: usize = 20;
const MOST_PLATES: usize = 10;

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

/// Plates that are pressed, with locators that know the force of contacts, or do not.
fn plates(places: usize, known_force_n: Option<f64>) -> Vec<(Bench, ForceLinearLocator)> {
    let plate = |seed: usize| {
        let bench = bench(places, seed as u64);
        let setup = bench.setup();
        let setup = known_force_n.map_or(setup.clone(), |force_n| setup.known_force(force_n).unwrap());
        let recording = bench.recording();
        let locator = fit(FitTask::new(&setup, &recording), Structure::ForceLinear).unwrap().unwrap();
        (bench, locator)
    };
    (0..(readings(READINGS) / OF_A_PLATE).min(MOST_PLATES)).map(plate).collect()
}

/// Coverage of contacts so far from the left edge.
fn covered_at(plates: &mut [(Bench, ForceLinearLocator)], x_m: f64, force_n: f64) -> Covered {
    covered(plates, readings(READINGS), |rng| {
        let position = Position { x_m, y_m: rng.random_range(0.06..SIDE_M - 0.06) };
        Contact { position, force_n }
    })
}

fn print(row: &Covered, name: &str, place_mm: f64) {
    eprintln!(
        "| {name}, {place_mm} mm | {} | {:.1} mm | {:.1} mm |",
        row.shares(),
        row.mean(row.width_mm),
        row.mean(row.error_mm),
    );
}

#[test]
fn contacts_near_an_edge_are_in_their_intervals() {
    /// Each way, the outermost 25 mm from the edges.
    const PLACES: usize = 6;
    let mut wrong = Vec::new();
    eprintln!(
        "| contact, from the edge | found | across covered | along covered | force covered | mean width across | mean error |\n|---|---|---|---|---|---|---|"
    );
    let forces = if readings(READINGS) > READINGS { 2 } else { 1 };
    for force_n in CONTACTS_N.into_iter().take(forces) {
        for known_force_n in [None, Some(force_n)] {
            let mut plates = plates(PLACES, known_force_n);
            let name = format!("{force_n} N{}", if known_force_n.is_some() { ", known" } else { "" });
            for place_mm in PLACES_MM {
                let row = covered_at(&mut plates, 1e-3 * place_mm, force_n);
                print(&row, &name, place_mm);
                let is_held = row.percent(row.along) >= 85.0 && row.percent(row.force) >= 85.0;
                if !is_held || row.outside > 0 {
                    wrong.push(format!("{name}, {place_mm} mm: {row:?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn contacts_between_few_places_of_a_plate_are_in_their_intervals() {
    const PLACES: usize = 4;
    const FORCE_N: f64 = 5.0;
    let mut plates = plates(PLACES, None);
    for place_mm in [10.0, 60.0, 100.0, 150.0] {
        let row = covered_at(&mut plates, 1e-3 * place_mm, FORCE_N);
        print(&row, &format!("{PLACES} × {PLACES} places, {FORCE_N} N"), place_mm);
        let is_held = row.percent(row.along).min(row.percent(row.across)).min(row.percent(row.force)) >= 85.0;
        assert!(is_held && row.outside == 0 && row.found == row.readings, "{place_mm} mm: {row:?}");
    }
}
