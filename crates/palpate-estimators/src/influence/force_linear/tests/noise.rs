//! Surfaces whose noise differs by place.

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

/// A steady rise from one end to the other.
fn rising(at: Position) -> f64 {
    (4f64.ln() * at.x_m / STRIP_M).exp()
}

/// Errors and coverage of touches on the quiet and the noisy half.
#[derive(Default)]
struct Halves {
    errors_mm: [Vec<f64>; 2],
    /// Number of touches in their intervals.
    covered: [f64; 2],
    found: usize,
    /// Greatest over least standard deviation of the noise, where it was found to differ.
    ratios: Vec<f64>,
}

impl Halves {
    fn add(&mut self, locator: &ForceLinearLocator, touches: &[Row], middle_m: f64) {
        self.found += usize::from(locator.noise_by_place().is_some());
        self.ratios.extend(locator.noise_by_place().map(|[(least, _), (most, _)]| most / least));
        for side in [0, 1] {
            let own: Vec<Row> =
                touches.iter().filter(|row| (row.position.x_m > middle_m) == (side == 1)).cloned().collect();
            let (errors, covered) = errors_mm(locator, &own);
            self.errors_mm[side].extend(errors);
            self.covered[side] += covered * own.len() as f64;
        }
    }

    fn summary(&self) -> [(f64, f64); 2] {
        [0, 1].map(|side| {
            let errors = &self.errors_mm[side];
            (mean(errors.iter().copied()), 100.0 * self.covered[side] / errors.len() as f64)
        })
    }
}

/// Noise at places of benches: halves by their locators, and by the same without the noise by place, from so many touches each.
fn halves_with_and_without(
    (count, touches): (u64, usize),
    bench_of: impl Fn(u64) -> Bench,
    middle_m: f64,
    noise: NoiseAt,
) -> [Halves; 2] {
    let mut halves = [Halves::default(), Halves::default()];
    for seed in 0..count {
        let mut bench = bench_of(seed);
        let mut pressed = bench.presses.clone();
        let mut touches = bench.touches(touches);
        make_noisy(&mut bench, &mut pressed, noise);
        make_noisy(&mut bench, &mut touches, noise);
        bench.presses = pressed;
        let locator = bench.fit(Structure::Auto).unwrap();
        halves[0].add(&locator, &touches, middle_m);
        let mut stored = Stored::from(locator);
        stored.prior.noise_by_place = None;
        halves[1].add(&stored.into_locator(), &touches, middle_m);
    }
    halves
}

/// Prints a case; the coverage of either half in percent, and the mean ratio of the greatest to the least noise.
fn print_case(what: &str, count: u64, [with, without]: &[Halves; 2]) -> ([f64; 2], f64) {
    let (halves, ratio) = (with.summary(), mean(with.ratios.iter().copied()));
    eprintln!(
        "{what}: found on {} of {count}, ratio {ratio:.1}; quiet {:.2?}, noisy {:.2?}; without {:.2?}",
        with.found,
        halves[0],
        halves[1],
        without.summary(),
    );
    (halves.map(|(_, covered)| covered), ratio)
}

#[test]
fn noise_by_place_is_found_and_intervals_follow_it() {
    let cases: [(&str, NoiseAt, bool); 3] =
        [("even", |_| 1.0, false), ("half", half, true), ("rising", rising, true)];
    let sizes: &[(usize, usize)] =
        if benches(0) == 0 { &[(120, 30)] } else { &[(25, 9), (60, 15), (120, 30)] };
    for (presses, places) in sizes.iter().copied() {
        for (name, noise, differs) in cases {
            // Fits take the time: of few strips, many touches tell the coverage.
            let (count, touches) =
                if benches(0) == 0 { (if name == "half" { 2 } else { 1 }, 500) } else { (benches(0), 200) };
            let strip = |seed| Bench::strip(seed, presses, places);
            let halves = halves_with_and_without((count, touches), strip, 0.5 * STRIP_M, noise);
            let what = format!("strip, {presses} presses at {places} places, {name}");
            let (covered, ratio) = print_case(&what, count, &halves);
            if presses == 120 {
                assert_eq!(halves[0].found as u64, if differs { count } else { 0 });
                assert!(covered.iter().all(|covered| (91.0..98.0).contains(covered)), "{covered:?}");
                assert!(!differs || (2.0..6.0).contains(&ratio), "{ratio}");
            }
        }
    }
}

#[test]
fn noise_by_place_is_found_on_a_plate() {
    let half: NoiseAt = |at| if at.x_m > 0.5 * PLATE_M[0] { 4.0 } else { 1.0 };
    let count = benches(1);
    let halves = halves_with_and_without((count, 200), Bench::plate, 0.5 * PLATE_M[0], half);
    let (covered, ratio) = print_case("plate, 160 presses at 80 places, half", count, &halves);
    assert_eq!(halves[0].found as u64, count);
    assert!(covered.iter().all(|covered| (90.0..99.5).contains(covered)), "{covered:?}");
    assert!((2.0..6.0).contains(&ratio), "{ratio}");
}

#[test]
fn an_untouched_board_is_no_contact_where_touches_are_noisy() {
    let mut bench = Bench::strip(1, 120, 30);
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
