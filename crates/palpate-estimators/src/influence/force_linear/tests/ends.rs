//! Coverage of contacts by their distance from the end of a beam of which nothing but presses is known.

use super::*;
use crate::fixtures::{force_95_n, paper, readings};
use crate::simulate::clean_reading;
use palpate_mechanics::contact::Contact;

const BEAM_M: f64 = 0.4;
/// Distances from the left end, in millimetres.
const PLACES_MM: [f64; 9] = [1.0, 3.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 200.0];
/// Readings at each place; docs/measured.md has the tables of 400: PALPATE_READINGS=400.
const READINGS: usize = 100;
/// Readings at each place by one beam.
const OF_A_BEAM: usize = 10;
const MOST_BEAMS: usize = 20;

/// The forces of the presses.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pressed {
    /// 3 N each, and untouched rows between them.
    Alike,
    /// 0.5 to 5 N.
    Variously,
}

/// The paper's beam as raw channels with a count of noise each, that of 5 µm; pressed so often at each of so many even places between two, in
/// millimetres.
fn beam(seed: u64, (places, times): (usize, usize), (from_mm, to_mm): (f64, f64), pressed: Pressed) -> Bench {
    const NOISE_M: f64 = 5e-6;
    let setup = paper(NOISE_M, 1).setup;
    let channels = setup.layout().len();
    let influences: Influences = Box::new(move |position| {
        let contact = Contact { position, force_n: 1.0 };
        let clean = clean_reading(setup.surface().model().unwrap(), setup.layout(), contact);
        clean.into_iter().map(|value| value / NOISE_M).collect()
    });
    let at = |i: usize| {
        let share = (i % places) as f64 / (places - 1) as f64;
        Position::along(1e-3 * (from_mm + share * (to_mm - from_mm)))
    };
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let all = (0..times * places).map(at).collect();
    let mut bench = Bench::new(Extent::line(BEAM_M).unwrap(), channels, influences, all, rng);
    if pressed == Pressed::Alike {
        let positions: Vec<Position> = bench.presses.iter().map(|row| row.position).collect();
        let forces_n = positions.into_iter().flat_map(|position| [(position, 3.0), (position, 0.0)]);
        bench.presses = forces_n.map(|(position, force_n)| bench.row(position, force_n)).collect();
    }
    bench
}

/// Beams that are pressed, by their seeds.
fn beams() -> u64 {
    (readings(READINGS) / OF_A_BEAM).min(MOST_BEAMS) as u64
}

/// Counts of readings of contacts at one place.
#[derive(Debug, Default)]
struct Covered {
    told: usize,
    place: usize,
    force: usize,
    /// The estimate is outside its own interval.
    outside: usize,
    not_explained: usize,
    width_mm: f64,
    error_mm: f64,
}

fn covered(beams: &mut [(Bench, ForceLinearLocator)], x_m: f64, force_n: f64) -> Covered {
    let mut row = Covered::default();
    let count = beams.len();
    for i in 0..readings(READINGS) {
        let (bench, locator) = &mut beams[i % count];
        let reading = bench.counts(Position::along(x_m), force_n);
        let estimate = locator.locate(&reading);
        if estimate.status == Status::NoContact {
            continue;
        }
        let found = estimate.contact;
        let (low_m, high_m) = found.uncertainty.unwrap().x_95_m;
        let (least_n, most_n) = force_95_n(&found);
        row.told += 1;
        row.place += usize::from((low_m..=high_m).contains(&x_m));
        row.force += usize::from((least_n..=most_n).contains(&force_n));
        row.outside += usize::from(
            !(low_m..=high_m).contains(&found.position.x_m)
                || !(least_n..=most_n).contains(&found.force_n.unwrap()),
        );
        row.not_explained += usize::from(estimate.status == Status::OutsideModel);
        row.width_mm += 1e3 * (high_m - low_m);
        row.error_mm += 1e3 * (found.position.x_m - x_m).abs();
    }
    row
}

#[test]
fn contacts_beyond_the_outermost_press_are_in_their_intervals() {
    let mut wrong = Vec::new();
    for (presses, span_mm, pressed) in [
        ((12, 3), (16.7, 383.3), Pressed::Alike),
        ((12, 3), (16.7, 383.3), Pressed::Variously),
        ((9, 3), (60.0, 340.0), Pressed::Variously),
        ((20, 3), (20.0, 380.0), Pressed::Variously),
        ((12, 1), (16.7, 383.3), Pressed::Variously),
    ]
    .into_iter()
    // The last two take long: the last as each of a few presses is left out in turn.
    .take(if readings(READINGS) > READINGS { 5 } else { 3 })
    {
        let (places, times) = presses;
        let beam = |seed: u64| {
            let bench = beam(seed, presses, span_mm, pressed);
            let locator = bench.fit(Structure::ForceLinear).unwrap();
            (bench, locator)
        };
        let mut beams: Vec<_> = (0..beams()).map(beam).collect();
        for force_n in [1.0, 3.0] {
            eprintln!(
                "{places} places × {times} from {} mm, pressed {pressed:?}; {force_n} N\n| from the end | contact found | place covered | force covered | mean width | mean error | outside_model |\n|---|---|---|---|---|---|---|",
                span_mm.0
            );
            for place_mm in PLACES_MM {
                let row = covered(&mut beams, 1e-3 * place_mm, force_n);
                let percent = |count: usize| 100.0 * count as f64 / row.told as f64;
                let mean = |sum: f64| sum / row.told as f64;
                eprintln!(
                    "| {place_mm} mm | {:.1} % | {:.1} % | {:.1} % | {:.1} mm | {:.1} mm | {:.1} % |",
                    100.0 * row.told as f64 / readings(READINGS) as f64,
                    percent(row.place),
                    percent(row.force),
                    mean(row.width_mm),
                    mean(row.error_mm),
                    percent(row.not_explained)
                );
                let is_held = percent(row.place) >= 85.0 && percent(row.force) >= 85.0;
                if !is_held || row.outside > 0 {
                    wrong.push(format!("{places} places × {times}, {force_n} N at {place_mm} mm: {row:?}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn contacts_of_known_force_beyond_the_outermost_press_are_in_their_intervals() {
    const FORCE_N: f64 = 3.0;
    let mut wrong = Vec::new();
    // The last takes long.
    let boards = [((12, 3), (16.7, 383.3)), ((9, 3), (60.0, 340.0)), ((20, 3), (20.0, 380.0))];
    let tried = if readings(READINGS) > READINGS { 3 } else { 2 };
    for (presses, span_mm) in boards.into_iter().take(tried) {
        let beam = |seed: u64| {
            let bench = beam(seed, presses, span_mm, Pressed::Alike);
            let setup = bench.setup().known_force(FORCE_N).unwrap();
            let recording = bench.recording();
            let locator = fit(FitTask::new(&setup, &recording), Structure::ForceLinear).unwrap().unwrap();
            (bench, locator)
        };
        let mut beams: Vec<_> = (0..beams()).map(beam).collect();
        eprintln!(
            "{} places × {} from {} mm, {FORCE_N} N known\n| from the end | place covered | mean width | mean error | outside_model |\n|---|---|---|---|---|",
            presses.0, presses.1, span_mm.0
        );
        for place_mm in PLACES_MM {
            let row = covered(&mut beams, 1e-3 * place_mm, FORCE_N);
            let percent = |count: usize| 100.0 * count as f64 / row.told as f64;
            let mean = |sum: f64| sum / row.told as f64;
            eprintln!(
                "| {place_mm} mm | {:.1} % | {:.2} mm | {:.2} mm | {:.1} % |",
                percent(row.place),
                mean(row.width_mm),
                mean(row.error_mm),
                percent(row.not_explained)
            );
            if percent(row.place) < 85.0 || row.outside > 0 {
                wrong.push(format!("{presses:?}, {place_mm} mm: {row:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
