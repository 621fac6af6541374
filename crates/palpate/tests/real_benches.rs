//! The benches with imperfections simulate, and show the number that each is about.

use palpate::prelude::*;

/// The recording of a calibration, and the largest deviation of each channel from the untouched row before a press.
fn calibrated(text: &str) -> (Rig, Recording, Vec<f64>) {
    let rig = Rig::from_toml(text).unwrap();
    let recording = rig.simulate(0).unwrap();
    let mut ranges = vec![0.0_f64; recording.channels.len()];
    for pair in recording.rows.windows(2).filter(|pair| !pair[0].touches() && pair[1].touches()) {
        let deviations =
            pair[1].reading.iter().zip(&pair[0].reading).map(|(press, rest)| (press - rest).abs());
        ranges.iter_mut().zip(deviations).for_each(|(range, deviation)| *range = range.max(deviation));
    }
    (rig, recording, ranges)
}

/// Largest change of the untouched readings over a calibration, as a share of the largest deviation of the channel.
fn wander(recording: &Recording, ranges: &[f64]) -> f64 {
    let untouched: Vec<&Row> = recording.rows.iter().filter(|row| !row.touches()).collect();
    let change = |c: usize| {
        let values = untouched.iter().map(|row| row.reading[c]);
        let (low, high) =
            values.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
        (high - low) / ranges[c]
    };
    (0..ranges.len()).map(change).fold(0.0, f64::max)
}

#[test]
fn a_strip_repeats_readings_and_hides_its_bridges_offsets() {
    let (rig, recording, ranges) = calibrated(include_str!("../../../examples/real-strip.toml"));
    assert_eq!(recording.rows.len(), 19 * (5 + 1) + 1);
    let largest_ue = 1e6 * ranges.iter().fold(0.0, |a: f64, b| a.max(*b));
    assert!((largest_ue - 163.0).abs() < 8.0, "{largest_ue}");
    let repeated = recording.rows.windows(2).filter(|pair| pair[0].reading == pair[1].reading).count();
    assert_eq!(repeated, 19 * 2);
    assert_eq!(rig.setup.imperfections().map(|imperfections| imperfections.schedule.pause_s), Some(600.0));
}

#[test]
fn a_finger_keeps_half_its_hysteresis_after_a_touch() {
    let (_, recording, ranges) = calibrated(include_str!("../../../examples/real-finger.toml"));
    let share = wander(&recording, &ranges);
    assert!((0.005..0.03).contains(&share), "{share}");
}

#[test]
fn a_skin_saturates_by_its_share() {
    let text = include_str!("../../../examples/real-skin.toml");
    let (_, _, ranges) = calibrated(text);
    let (_, _, linear) = calibrated(&text.replace("saturation = \"15 %\"", "saturation = \"0 %\""));
    let shares: Vec<f64> = ranges.iter().zip(&linear).map(|(range, linear)| 1.0 - range / linear).collect();
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    // Presses do not reach the range, which is under a point contact straight over the sensor.
    assert!((0.10..0.15).contains(&mean), "{shares:?}");
}

#[test]
fn a_floors_cells_carry_the_weight_within_their_gains() {
    let (_, recording, _) = calibrated(include_str!("../../../examples/real-floor.toml"));
    let total = |row: &Row| row.reading.iter().sum::<f64>();
    let mut rows = recording.rows.iter();
    let rest = rows.next().map(total).unwrap();
    let press = rows.next().map(total).unwrap();
    assert!(((press - rest) / 200.0 - 1.0).abs() < 0.02, "{press} {rest}");
}
