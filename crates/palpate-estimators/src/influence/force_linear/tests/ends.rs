//! Coverage of contacts by their distance from the end of a beam of which nothing but presses is known: a sample of the experiment `measured-beam-ends`.

use super::*;
use crate::fixtures::paper;
use crate::simulate::clean_reading;
use palpate_numerics::binomial_tail;

const BEAM_M: f64 = 0.4;
/// Distances from the left end, in millimetres.
const PLACES_MM: [f64; 4] = [3.0, 15.0, 50.0, 200.0];
/// Readings at each place by two beams in turn.
const READINGS: usize = 40;
const BEAMS: u64 = 2;

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

/// Coverage of so many contacts at one place.
fn covered_at(
    beams: &mut [(Bench, ForceLinearLocator)],
    readings: usize,
    place_mm: f64,
    force_n: f64,
) -> CoverageTally {
    let contact = Contact { position: Position::along(1e-3 * place_mm), force_n };
    covered(beams, readings, |_| contact)
}

/// False where so few contacts of a row are in their intervals that a coverage of 90 % gives fewer in one sample of a thousand.
fn is_covered(row: &CoverageTally, covered: usize) -> bool {
    binomial_tail(row.detected, row.detected - covered, 0.1) > 1e-3
}

#[test]
fn contacts_beyond_the_outermost_press_are_in_their_intervals() {
    let mut wrong = Vec::new();
    for (presses, span_mm, pressed) in [
        ((12, 3), (16.7, 383.3), Pressed::Alike),
        ((12, 3), (16.7, 383.3), Pressed::Variously),
        ((9, 3), (60.0, 340.0), Pressed::Variously),
    ] {
        let beam = |seed: u64| {
            let bench = beam(seed, presses, span_mm, pressed);
            let locator = bench.fit(Structure::ForceLinear).unwrap();
            (bench, locator)
        };
        let mut beams: Vec<_> = (0..BEAMS).map(beam).collect();
        for place_mm in PLACES_MM {
            let row = covered_at(&mut beams, READINGS, place_mm, 3.0);
            if !is_covered(&row, row.x_covered) || !is_covered(&row, row.force) || row.outside > 0 {
                wrong.push(format!("{presses:?} {pressed:?}, {place_mm} mm: {row:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn contacts_of_known_force_beyond_the_outermost_press_are_in_their_intervals() {
    const FORCE_N: f64 = 3.0;
    let mut wrong = Vec::new();
    let (presses, span_mm) = ((12, 3), (16.7, 383.3));
    let beam = |seed: u64| {
        let bench = beam(seed, presses, span_mm, Pressed::Alike);
        let setup = bench.setup().known_force(FORCE_N).unwrap();
        let recording = bench.recording();
        let locator = fit(FitTask::new(&setup, &recording), Structure::ForceLinear).unwrap().unwrap();
        (bench, locator)
    };
    let mut beams: Vec<_> = (0..BEAMS).map(beam).collect();
    for place_mm in PLACES_MM {
        let row = covered_at(&mut beams, READINGS, place_mm, FORCE_N);
        if !is_covered(&row, row.x_covered) || row.outside > 0 {
            wrong.push(format!("{place_mm} mm: {row:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    // The grid reaches both ends, so that neither is confused with the other.
    for (bench, locator) in &mut beams {
        for x_m in [0.01, BEAM_M - 0.01] {
            let (low_m, high_m) = locator
                .locate(&bench.counts(Position::along(x_m), FORCE_N))
                .contact
                .uncertainty
                .unwrap()
                .x_95_m;
            assert!(low_m <= x_m && x_m <= high_m && high_m - low_m < 0.02, "{x_m}: {low_m} to {high_m}");
        }
    }
}

/// A beam that is pressed so often at each of six places, the outermost 40 mm from the ends.
pub(super) fn six_places(seed: u64, times: usize) -> Bench {
    beam(seed, (6, times), (40.0, 360.0), Pressed::Variously)
}

/// With errors of each channel by itself, six presses cover 53 % at 60 mm from the end. The readings of a beam share its errors, so that a tenth of them is
/// covered together: the bounds are a fifth below the 90 % of 20 beams.
#[test]
fn contacts_between_few_places_of_a_beam_are_in_their_intervals() {
    for times in [1, 3] {
        let beam = |seed: u64| {
            let bench = six_places(seed, times);
            let locator = bench.fit(Structure::ForceLinear).unwrap();
            (bench, locator)
        };
        let mut beams: Vec<_> = (0..10).map(beam).collect();
        assert!(
            beams.iter().all(|(bench, locator)| locator.stored.shared_errors.len() == bench.offsets.len())
        );
        for place_mm in [20.0, 45.0, 60.0, 75.0, 120.0, 200.0] {
            let row = covered_at(&mut beams, 100, place_mm, 3.0);
            let is_held = row.percent(row.x_covered) >= 75.0 && row.percent(row.force) >= 70.0;
            assert!(is_held && row.outside == 0 && row.detected == row.readings, "{place_mm} mm: {row:?}");
        }
    }
}
