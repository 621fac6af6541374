//! Surfaces whose noise differs by place: a sample of the experiment `noise-by-place`.

use super::*;

/// Noise of touches over that of an untouched board, as a function of the place.
type NoiseAt = fn(Position) -> f64;

/// Multiplies the noise of some rows by what it is at their places.
fn make_noisy(bench: &mut Bench, rows: &mut [Row], noise: NoiseAt) {
    for row in rows {
        let force_n = row.force_n.unwrap();
        let clean: Vec<f64> = (bench.influences)(row.position);
        for ((value, f), offset) in row.reading.iter_mut().zip(clean).zip(&bench.offsets) {
            let clean = offset + force_n * f;
            *value = clean + noise(row.position) * (*value - clean);
        }
    }
}

/// A step in the middle.
fn half(at: Position) -> f64 {
    if at.x_m > 0.5 * STRIP_M { 4.0 } else { 1.0 }
}

/// Ratio of the greatest to the least noise, where it is found to differ by place, and coverage of touches on the quiet and the noisy half in percent.
fn fitted(mut bench: Bench, middle_m: f64, noise: NoiseAt) -> (Option<f64>, [f64; 2]) {
    const TOUCHES: usize = 500;
    let mut pressed = bench.presses.clone();
    let mut touches = bench.touches(TOUCHES);
    make_noisy(&mut bench, &mut pressed, noise);
    make_noisy(&mut bench, &mut touches, noise);
    bench.presses = pressed;
    let locator = bench.fit(Structure::Auto).unwrap();
    let (noisy, quiet): (Vec<Row>, Vec<Row>) =
        touches.into_iter().partition(|row| row.position.x_m > middle_m);
    let covered = [quiet, noisy].map(|own| 100.0 * errors_mm(&locator, &own).1);
    (locator.noise_by_place().map(|[(least, _), (most, _)]| most / least), covered)
}

/// Four standard deviations of 250 touches below the 93 % of the experiment's noisy halves.
const LEAST_PERCENT: f64 = 86.5;

#[test]
fn noise_by_place_is_found_and_intervals_follow_it() {
    let cases: [(&str, NoiseAt, bool); 2] = [("even", |_| 1.0, false), ("half", half, true)];
    for (name, noise, differs) in cases {
        // Touches of one strip share its calibration errors.
        let strips = (0..3).map(|seed| fitted(Bench::strip(seed, 60, 15), 0.5 * STRIP_M, noise));
        let strips: Vec<_> = strips.collect();
        for (ratio, _) in &strips {
            assert_eq!(ratio.is_some(), differs, "{name}: {ratio:?}");
            assert!(ratio.is_none_or(|ratio| (2.0..6.0).contains(&ratio)), "{name}: {ratio:?}");
        }
        // Without the noise by place, 51 % of the noisy half are covered.
        let covered = [0, 1].map(|half| mean(strips.iter().map(|(_, covered)| covered[half])));
        assert!(covered.iter().all(|covered| *covered >= LEAST_PERCENT), "{name}: {covered:?}");
    }
}

#[test]
fn noise_by_place_is_found_on_a_plate() {
    let half: NoiseAt = |at| if at.x_m > 0.5 * PLATE_M[0] { 4.0 } else { 1.0 };
    let (ratio, covered) = fitted(Bench::plate(0), 0.5 * PLATE_M[0], half);
    assert!(ratio.is_some_and(|ratio| (2.0..6.0).contains(&ratio)), "{ratio:?}");
    assert!(covered.iter().all(|covered| *covered >= LEAST_PERCENT), "{covered:?}");
}

#[test]
fn an_untouched_board_is_no_contact_where_touches_are_noisy() {
    let mut bench = Bench::strip(1, 60, 15);
    let mut pressed = bench.presses.clone();
    make_noisy(&mut bench, &mut pressed, half);
    bench.presses = pressed;
    let locator = bench.fit(Structure::Auto).unwrap();
    assert!(locator.noise_by_place().is_some());
    let file: ForceLinearLocator = serde_json::from_str(&serde_json::to_string(&locator).unwrap()).unwrap();
    assert_eq!(file, locator);
    const COUNT: usize = 2000;
    let untouched = (0..COUNT)
        .filter(|_| locator.locate(&bench.counts(Position::along(0.15), 0.0)).status == Status::NoContact);
    let untouched = untouched.count();
    assert!(untouched >= COUNT * 997 / 1000, "{untouched} of {COUNT}");
}
