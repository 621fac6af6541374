use super::*;
use crate::arrangement::Training;
use crate::fixtures;
use crate::recording::Row;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Beam;
use palpate_mechanics::units::{gpa, mm, newtons, um};

/// The paper's beam with eight sensors of 5 µm, pressed five times at each of ten places by 3 N.
fn paper() -> (Setup, Recording) {
    let setup = fixtures::paper(um(5.0), 1).setup;
    let recording = setup.simulate(&Training::even(10).repeated(5), 7).unwrap();
    (setup, recording)
}

/// A beam with sensors at unequal distances from both ends, and with unknown force.
fn lopsided() -> (Setup, Recording) {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    let sensors = SensorKind::Strain.at_x([50.0, 110.0, 190.0, 230.0, 320.0].map(mm)).noise(1e-6);
    let setup = Setup::new(beam).sensors(sensors).unwrap();
    let known = setup.clone().known_force(newtons(3.0)).unwrap();
    (setup, known.simulate(&Training::even(12).repeated(3), 3).unwrap())
}

fn changed(recording: &Recording, change: impl Fn(&mut Row)) -> Recording {
    let mut recording = recording.clone();
    recording.rows.iter_mut().for_each(change);
    recording
}

fn lines(setup: &Setup, recording: &Recording) -> Vec<String> {
    check_recording(setup, recording).iter().map(ToString::to_string).collect()
}

#[test]
fn a_recording_of_the_setup_has_no_mismatch() {
    for (setup, recording) in [paper(), lopsided()] {
        for seed in 0..10 {
            let again = setup.clone().with_force(Some(3.0)).unwrap();
            let again = again.simulate(&Training::even(6).repeated(2), seed).unwrap();
            assert_eq!(check_recording(&setup, &again), [], "seed {seed}");
        }
        assert_eq!(check_recording(&setup, &recording), []);
        // An inaccurate stiffness, and gains of the channels.
        let soft = changed(&recording, |row| row.reading.iter_mut().for_each(|value| *value *= 1.4));
        let mismatches = check_recording(&setup, &soft);
        assert!(
            mismatches.iter().all(|mismatch| matches!(mismatch, Mismatch::Noise { .. })),
            "{mismatches:?}"
        );
    }
}

#[test]
fn every_mismatch_is_one_line_with_a_remedy() {
    let (paper, presses) = paper();
    let (lopsided, others) = lopsided();
    let scaled = |factor: f64| changed(&presses, |row| row.position.x_m *= factor);
    let weighed =
        |factor: f64| changed(&presses, |row| row.force_n = row.force_n.map(|force_n| force_n * factor));
    let channel = |c: usize, factor: f64| changed(&presses, |row| row.reading[c] *= factor);
    let mirrored = |x_m: f64| Position::along(mm(400.0) - x_m);
    let cases = [
        ("metres read as mm", lines(&paper, &scaled(1e-3))),
        ("centimetres read as mm", lines(&paper, &scaled(0.1))),
        ("grams read as N", lines(&paper, &weighed(1e3 / GRAVITY))),
        ("kilograms read as N", lines(&paper, &weighed(1.0 / GRAVITY))),
        ("millinewtons read as N", lines(&paper, &weighed(1e3))),
        ("another force", lines(&paper, &weighed(2.5))),
        ("grams, unknown force", lines(&paper.clone().unknown_force(), &weighed(1e3 / GRAVITY))),
        (
            "grams, greatest force",
            lines(
                &lopsided.clone().with_greatest_force(Some(5.0)).unwrap(),
                &changed(&others, |row| {
                    row.force_n = row.force_n.map(|force_n| force_n * 102.0);
                }),
            ),
        ),
        ("mirrored", lines(&paper, &changed(&presses, |row| row.position = mirrored(row.position.x_m)))),
        (
            "mirrored, lopsided",
            lines(&lopsided, &changed(&others, |row| row.position = mirrored(row.position.x_m))),
        ),
        ("channels swapped", lines(&paper, &changed(&presses, |row| row.reading.swap(1, 4)))),
        ("channels rotated", lines(&lopsided, &changed(&others, |row| row.reading.rotate_left(1)))),
        ("one sign", lines(&paper, &channel(2, -1.0))),
        (
            "all signs",
            lines(&paper, &changed(&presses, |row| row.reading.iter_mut().for_each(|value| *value *= -1.0))),
        ),
        ("one in µm", lines(&paper, &channel(5, 1e3))),
        (
            "all in µm",
            lines(&paper, &changed(&presses, |row| row.reading.iter_mut().for_each(|value| *value *= 1e3))),
        ),
    ];
    let text = cases.iter().map(|(case, lines)| format!("{case}:\n  {}", lines.join("\n  ")));
    insta::assert_snapshot!(text.collect::<Vec<_>>().join("\n"));
}

#[test]
fn repeats_are_compared_with_the_noise_by_a_chi_squared_test() {
    let (setup, _) = paper();
    let noisy = |noise_m: f64, repeats: usize, seed: u64| {
        let bench =
            setup.clone().with_noise(Quantity { value: noise_m, dimension: Dimension::Length }).unwrap();
        let recording = bench.simulate(&Training::even(5).repeated(repeats), seed).unwrap();
        check_recording(&setup, &recording)
    };
    for seed in 0..6 {
        assert!(matches!(noisy(um(15.0), 10, seed)[..], [Mismatch::Noise { .. }]));
        assert!(matches!(noisy(um(1.7), 10, seed)[..], [Mismatch::Noise { .. }]));
        // Two repeats vary by a factor of 2 by chance.
        assert_eq!(noisy(um(5.0), 2, seed), []);
        assert_eq!(noisy(um(6.5), 10, seed), []);
    }
    let line = noisy(um(15.0), 10, 0)[0].to_string();
    insta::assert_snapshot!(line);
}
