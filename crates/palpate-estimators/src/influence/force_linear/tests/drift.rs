//! Strips whose gauges drift while they are calibrated, and touches that have the drift of its end: a sample of the experiment `drifting-strips`.

use super::*;

/// Course of the drift of a gauge from 0 at the recording's first row to 1 at its last, up to its amount.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    /// As the temperature of a room that is being heated.
    Ramp,
    /// As a board that warms up after it was switched on: fast at first.
    Settling,
    /// A random walk, whose end has the amount as its standard deviation.
    Walk,
}

/// Times of the presses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pace {
    /// One after the other at the same pace; the recording has no times.
    Even,
    /// With a pause of two thirds of all the time somewhere; the recording has a column of times.
    WithPause,
}

/// Least and greatest drift over a recording, in counts.
const AMOUNTS: std::ops::Range<f64> = 6.0..19.0;

/// A drift of every gauge in the course of the presses; gives those readings less the drift, and where each gauge ends.
fn drift(bench: &mut Bench, course: Course, pace: Pace) -> (Vec<Row>, Vec<f64>) {
    let still = bench.presses.clone();
    let rows = still.len();
    let pause = match pace {
        Pace::Even => None,
        Pace::WithPause => Some(bench.rng.random_range(rows / 5..rows * 4 / 5)),
    };
    let mut times = vec![0.0];
    for row in 1..rows {
        let step = match pace {
            Pace::Even => 1.0,
            Pace::WithPause => bench.rng.random_range(0.3..1.7),
        };
        let pause = if pause == Some(row) { 2.0 * rows as f64 } else { 0.0 };
        times.push(times[row - 1] + step + pause);
    }
    let end = times[rows - 1];
    let mut ends = Vec::new();
    for c in 0..bench.offsets.len() {
        let sign = if bench.rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let amount = sign * bench.rng.random_range(AMOUNTS);
        let (mut drift, mut walk, mut last) = (0.0, 0.0, 0.0);
        for (row, time) in bench.presses.iter_mut().zip(&times) {
            let share: f64 = time / end;
            let normal: f64 = StandardNormal.sample(&mut bench.rng);
            walk += normal * (share - last).sqrt();
            last = share;
            drift = amount
                * match course {
                    Course::Ramp => share,
                    Course::Settling => (1.0 - (-4.0 * share).exp()) / (1.0 - (-4f64).exp()),
                    Course::Walk => walk,
                };
            row.reading[c] += drift;
        }
        ends.push(drift);
    }
    if pace == Pace::WithPause {
        bench.presses.iter_mut().zip(&times).for_each(|(row, time)| row.time_s = Some(4.0 * time));
    }
    (still, ends)
}

fn moved(rows: &[Row], by: &[f64]) -> Vec<Row> {
    let mut rows = rows.to_vec();
    for row in &mut rows {
        row.reading.iter_mut().zip(by).for_each(|(value, by)| *value += by);
    }
    rows
}

#[test]
fn drifting_strips_are_located_better_than_by_a_spline() {
    // A random walk is the course that a linear drift models worst.
    for (course, pace) in
        [(Course::Ramp, Pace::Even), (Course::Settling, Pace::WithPause), (Course::Walk, Pace::Even)]
    {
        let (presses, places) = (25, 9);
        let mut bench = Bench::strip(0, presses, places);
        let touches = bench.touches(100);
        let (still, ends) = drift(&mut bench, course, pace);
        let locator = bench.fit_as(Structure::Auto);
        let later = moved(&touches, &ends);
        let (own_mm, covered) = errors_mm(&locator, &later);
        let spline = Regression::spline(places);
        let [drifting_mm, linear_mm, still_mm] = [
            spline.errors_mm(&bench.presses, &later),
            spline.with_linear_drift().errors_mm(&bench.presses, &later),
            spline.errors_mm(&still, &touches),
        ]
        .map(mean);
        let own_mm = mean(own_mm);
        assert!(
            own_mm < drifting_mm && own_mm < linear_mm,
            "{course:?}: {own_mm}, {drifting_mm}, {linear_mm}"
        );
        // The spline without the drift, which is better on up to 22 of 100 strips with random walks, knows more than there is to know.
        assert!(own_mm < still_mm || course == Course::Walk, "{course:?}: {own_mm} mm, {still_mm} mm");
        // Four standard deviations of 100 touches below 95 %.
        assert!(covered >= 0.86, "{course:?}: {covered}");
    }
}

#[test]
fn drift_is_found_where_there_is_any() {
    let mut bench = Bench::strip(0, 60, 15);
    assert_eq!(bench.fit(Structure::Auto).unwrap().drifts(), []);
    let (_, ends) = drift(&mut bench, Course::Walk, Pace::Even);
    let locator = bench.fit(Structure::Auto).unwrap();
    let drifts = locator.drifts();
    assert_eq!(drifts.len(), GAUGES);
    // The estimate at the first row, as at the last, errs by several counts.
    for ((_, counts), end) in drifts.iter().zip(&ends) {
        assert!((counts - end).abs() < 12.0, "{drifts:?} {ends:?}");
    }
    for ((c, offset, _), end) in locator.channels().zip(&ends) {
        assert!((offset - bench.offsets[c] - end).abs() < 6.0, "gauge {c}: {offset}");
    }
}

/// Mean error in millimetres, and share of the 95 % intervals that cover the contact, of strips of so many presses that drift: of locators
/// from all presses, and from half as many in their place.
fn condensed_under_drift(strips: u64, presses: usize, course: Course, places: usize) -> [[f64; 2]; 2] {
    let mut sums = [[0.0; 2]; 2];
    for seed in 0..strips {
        let mut bench = Bench::strip(seed, presses, places);
        let touches = bench.touches(200);
        let (_, ends) = drift(&mut bench, course, Pace::Even);
        let (setup, recording) = (bench.setup(), bench.recording());
        let later = moved(&touches, &ends);
        for (most, sums) in [usize::MAX, presses / 2].into_iter().zip(&mut sums) {
            let task = FitTask::new(&setup, &recording);
            let locator = fit_condensed(task, Structure::ForceLinear, most).unwrap().unwrap();
            assert_eq!(locator.drifts().len(), GAUGES);
            let (errors, covered) = errors_mm(&locator, &later);
            sums[0] += mean(errors) / strips as f64;
            sums[1] += covered / strips as f64;
        }
    }
    let [[all_mm, all_covered], [few_mm, few_covered]] = sums;
    eprintln!(
        "strip, {presses} presses at {places} places, {course:?}: mean {all_mm:.3} mm, {:.1} % covered; {few_mm:.3} mm, {:.1} % from half of them",
        100.0 * all_covered,
        100.0 * few_covered
    );
    sums
}

/// The largest loss is with a random walk and one pass along the strip, where a drift looks like a change of the offset with the position: 2.58 instead of
/// 2.19 mm with 400 presses.
#[test]
fn many_presses_under_drift_are_condensed_with_hardly_a_loss() {
    for (course, places) in [(Course::Walk, 160), (Course::Ramp, 10)] {
        let [[all_mm, all_covered], [few_mm, few_covered]] = condensed_under_drift(1, 160, course, places);
        assert!(few_mm < 1.25 * all_mm, "{course:?}: {few_mm} mm, {all_mm} mm");
        assert!(few_covered > all_covered - 0.04, "{course:?}: {few_covered}, {all_covered}");
    }
}

#[test]
#[ignore = "fits of 400 presses on six strips in six cases take minutes"]
fn four_hundred_presses_under_drift_are_condensed_with_hardly_a_loss() {
    let mut sums = [[0.0; 2]; 2];
    for course in [Course::Ramp, Course::Settling, Course::Walk] {
        // One way along the strip, and many times.
        for places in [400, 10] {
            let found = condensed_under_drift(6, 400, course, places);
            sums.iter_mut()
                .flatten()
                .zip(found.iter().flatten())
                .for_each(|(sum, value)| *sum += value / 6.0);
        }
    }
    let [[all_mm, all_covered], [few_mm, few_covered]] = sums;
    assert!(few_mm < 1.12 * all_mm, "{few_mm} mm, {all_mm} mm");
    assert!(few_covered > all_covered - 0.02, "{few_covered}, {all_covered}");
}

/// Places that a weight is put on, and times at each.
const PLACES: usize = 8;
const TIMES: usize = 3;

/// A strip on two supports over gauges of its bending moment, pressed with 3 N at the places of this order, then ten times untouched; and what a gauge
/// drifts over the presses, in counts.
fn weighed(seed: u64, order: impl Fn(usize) -> usize, drift: f64) -> (Bench, ForceLinearLocator) {
    const LENGTH_M: f64 = 0.4;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let gauges: Vec<f64> = (0..GAUGES).map(|_| rng.random_range(0.02..LENGTH_M - 0.02)).collect();
    let influences: Influences = Box::new(move |at| {
        let moment = |gauge: &f64| gauge.min(at.x_m) * (LENGTH_M - gauge.max(at.x_m)) / LENGTH_M;
        gauges.iter().map(|gauge| 2000.0 * moment(gauge)).collect()
    });
    let mut bench = Bench::new(Extent::line(LENGTH_M).unwrap(), GAUGES, influences, Vec::new(), rng);
    let place = |i: usize| Position::along(0.03 + 0.34 * i as f64 / (PLACES - 1) as f64);
    let presses = (0..PLACES * TIMES).map(|i| (place(order(i)), 3.0));
    let untouched = (0..10).map(|_| (Position::default(), 0.0));
    bench.presses = presses.chain(untouched).map(|(at, force_n)| bench.row(at, force_n)).collect();
    for (i, row) in bench.presses.iter_mut().enumerate() {
        let drifted = drift * i.min(PLACES * TIMES) as f64 / (PLACES * TIMES) as f64;
        row.reading.iter_mut().for_each(|value| *value += drifted);
    }
    let setup = bench.setup().known_force(3.0).unwrap();
    let recording = bench.recording();
    let locator = fit(FitTask::new(&setup, &recording), Structure::ForceLinear).unwrap().unwrap();
    (bench, locator)
}

/// Of these boards seven were told a drift, and located nothing right.
#[test]
fn presses_of_one_force_in_order_along_a_strip_tell_no_drift() {
    let (mut held, mut count) = (0, 0);
    for seed in 20..60 {
        let (mut bench, locator) = weighed(seed, |i| i / TIMES, 0.0);
        assert_eq!(locator.drift_course(), None, "board {seed}");
        for _ in 0..10 {
            let x_m = bench.rng.random_range(0.04..0.36);
            let reading = bench.counts(Position::along(x_m), 3.0);
            let (low_m, high_m) = locator.locate(&reading).contact.uncertainty.unwrap().x_95_m;
            held += usize::from((low_m..=high_m).contains(&x_m));
            count += 1;
        }
    }
    eprintln!("{held} of {count} covered");
    assert!(10 * held >= 9 * count, "{held} of {count}");
}

#[test]
fn presses_of_one_force_that_come_to_their_places_again_tell_a_drift() {
    for seed in 20..30 {
        let (_, locator) = weighed(seed, |i| i % PLACES, 40.0);
        assert!(locator.drift_course().is_some(), "board {seed}");
    }
}
