//! Coverage of contacts by their distance from an edge of a plate of which nothing but presses is known.

use super::*;
use crate::fixtures::{force_95_n, readings};

const SIDE_M: f64 = 0.3;
/// Presses at each of 6 × 6 places, the outermost 25 mm from the edges.
const TIMES: usize = 3;
const PLACES: usize = 6;
/// Forces of contacts, in newtons; quick tests have the first alone.
const CONTACTS_N: [f64; 2] = [5.0, 2.0];
/// Distances from the left edge, in millimetres; 60 mm or more from the others.
const PLACES_MM: [f64; 8] = [3.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 150.0];
/// Readings at each place; docs/measured.md has the tables of 400: PALPATE_READINGS=400.
const READINGS: usize = 40;
/// Readings at each place by one plate.
const OF_A_PLATE: usize = 20;
const MOST_PLATES: usize = 10;

/// The plate of `examples/plate.toml` as raw channels with a count of noise each, that of 5 µm, pressed with 0.5 to 5 N.
fn bench(seed: u64) -> Bench {
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
    let at = |i: usize| SIDE_M * (i as f64 + 0.5) / PLACES as f64;
    let place = |i: usize| Position { x_m: at(i % PLACES), y_m: at(i / PLACES % PLACES) };
    let all = (0..TIMES * PLACES * PLACES).map(place).collect();
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    Bench::new(Extent::plane(SIDE_M, SIDE_M).unwrap(), SENSORS, influences, all, rng)
}

/// Plates that are pressed, with locators that know the force of contacts, or do not.
fn plates(known_force_n: Option<f64>) -> Vec<(Bench, ForceLinearLocator)> {
    let plate = |seed: usize| {
        let bench = bench(seed as u64);
        let setup = bench.setup();
        let setup = known_force_n.map_or(setup.clone(), |force_n| setup.known_force(force_n).unwrap());
        let recording = bench.recording();
        let locator = fit(FitTask::new(&setup, &recording), Structure::ForceLinear).unwrap().unwrap();
        (bench, locator)
    };
    (0..(readings(READINGS) / OF_A_PLATE).min(MOST_PLATES)).map(plate).collect()
}

/// Counts and sums over the readings of contacts at one place.
#[derive(Debug, Default)]
struct Row {
    found: usize,
    /// The place across and along the edge, and the force, are in their intervals.
    covered: [usize; 3],
    /// The estimate is outside its own intervals.
    outside: usize,
    width_mm: f64,
    error_mm: f64,
}

impl Row {
    fn of(plates: &mut [(Bench, ForceLinearLocator)], x_m: f64, force_n: f64) -> Self {
        let mut row = Self::default();
        let count = plates.len();
        for i in 0..readings(READINGS) {
            let (bench, locator) = &mut plates[i % count];
            let position = Position { x_m, y_m: bench.rng.random_range(0.06..SIDE_M - 0.06) };
            let estimate = locator.locate(&bench.counts(position, force_n));
            if estimate.status == Status::NoContact {
                continue;
            }
            let found = estimate.contact;
            let uncertainty = found.uncertainty.unwrap();
            let intervals = [uncertainty.x_95_m, uncertainty.y_95_m, force_95_n(&found)];
            let held = |values: [f64; 3]| {
                [0, 1, 2].map(|k| intervals[k].0 <= values[k] && values[k] <= intervals[k].1)
            };
            row.found += 1;
            let truth = held([x_m, position.y_m, force_n]);
            row.covered.iter_mut().zip(truth).for_each(|(count, held)| *count += usize::from(held));
            let own = held([found.position.x_m, found.position.y_m, found.force_n.unwrap()]);
            row.outside += usize::from(own.contains(&false));
            row.width_mm += 1e3 * (intervals[0].1 - intervals[0].0);
            row.error_mm += 1e3 * found.position.distance_m(position);
        }
        row
    }

    fn print(&self, name: &str, place_mm: f64) {
        let [across, along, force] = self.covered.map(|count| 100.0 * count as f64 / self.found as f64);
        let mean = |sum: f64| sum / self.found as f64;
        eprintln!(
            "| {name}, {place_mm} mm | {:.1} % | {across:.1} % | {along:.1} % | {force:.1} % | {:.1} mm | {:.1} mm |",
            100.0 * self.found as f64 / readings(READINGS) as f64,
            mean(self.width_mm),
            mean(self.error_mm),
        );
    }
}

#[test]
fn contacts_near_an_edge_are_in_their_intervals() {
    /// Contacts farther from the edge are between presses.
    const BEYOND_MM: f64 = 25.0;
    let mut wrong = Vec::new();
    eprintln!(
        "| contact, from the edge | found | across covered | along covered | force covered | mean width across | mean error |\n|---|---|---|---|---|---|---|"
    );
    let forces = if readings(READINGS) > READINGS { 2 } else { 1 };
    for force_n in CONTACTS_N.into_iter().take(forces) {
        for known_force_n in [None, Some(force_n)] {
            let mut plates = plates(known_force_n);
            let name = format!("{force_n} N{}", if known_force_n.is_some() { ", known" } else { "" });
            for place_mm in PLACES_MM {
                let row = Row::of(&mut plates, 1e-3 * place_mm, force_n);
                row.print(&name, place_mm);
                let [across, _, force] = row.covered.map(|count| count as f64 / row.found as f64);
                let is_held = across >= 0.85 && force >= 0.85 || place_mm > BEYOND_MM;
                if !is_held || row.outside > 0 {
                    wrong.push(format!("{name}, {place_mm} mm: {row:?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
