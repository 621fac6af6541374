use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::recording::Warning;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};

/// Logger of four channels.
#[derive(Clone, Copy)]
struct Logger {
    step: f64,
    noise: f64,
    /// Least and greatest number of repeated rows, per channel.
    runs: [[usize; 2]; 4],
    contacts: usize,
    rows_per_contact: usize,
}

const FINE: Logger = Logger { step: 1e-3, noise: 0.5, runs: [[1, 1]; 4], contacts: 16, rows_per_contact: 12 };

impl Logger {
    /// Contacts 5 mm apart, every fourth untouched; channels of different sensitivity.
    fn record(&self, seed: u64) -> Recording {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let shift: f64 = rng.random();
        let (mut rows, mut left, mut values) = (Vec::new(), [0; 4], vec![0.0; 4]);
        // Channels with equal runs repeat together, as on one sensor board.
        for i in 0..self.contacts * self.rows_per_contact {
            let contact = i / self.rows_per_contact;
            let touched = !contact.is_multiple_of(4);
            let mut board: Option<([usize; 2], usize)> = None;
            for c in 0..4 {
                if left[c] == 0 {
                    let press = if touched { (1 + c) as f64 * 1.377 * contact as f64 } else { 0.0 };
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    let clean = 100.0 * c as f64 + press + shift;
                    values[c] = ((clean + self.noise * noise) / self.step).round() * self.step;
                    let own = self.runs[c];
                    let run = match board {
                        Some((runs, run)) if runs == own => run,
                        _ => rng.random_range(own[0]..=own[1]),
                    };
                    board = Some((own, run));
                    left[c] = run;
                }
                left[c] -= 1;
            }
            rows.push(Row {
                position: Position::along(0.005 * contact as f64),
                force_n: Some(if touched { 1.0 + (contact % 3) as f64 } else { 0.0 }),
                nuisances: Vec::new(),
                time_s: None,
                reading: values.clone(),
            });
        }
        Recording::new(&Layout::even(SensorKind::Raw, 4, 0.1), "logger", rows)
    }

    fn treated(&self, seed: u64) -> Recording {
        self.record(seed).treat_repeated_readings(RepeatedReadings::Auto)
    }
}

#[test]
fn sample_and_hold_counts_each_reading_once() {
    for runs in [[2, 2], [2, 3], [1, 2], [10, 10], [5, 9]] {
        let held = Logger { runs: [runs; 4], contacts: 40, ..FINE };
        for seed in 0..6 {
            let treated = held.treated(seed);
            let repeats = treated.provenance.repeats.clone().unwrap();
            assert!(repeats.sample_and_hold && repeats.slow_channels.is_empty(), "{runs:?}: {repeats:?}");
            assert!(treated.rows.windows(2).all(|pair| pair[0].reading != pair[1].reading));
            assert_eq!(repeats.removed + treated.rows.len(), repeats.of);
            assert_eq!(treated.provenance.rows, treated.rows.len());
        }
    }
}

#[test]
fn coarse_sample_and_hold_is_found_by_coincidence() {
    // A converter of 10 Hz with 2 counts of noise, read at 80 Hz.
    let held = Logger { step: 1.0, noise: 0.8, runs: [[8, 8]; 4], rows_per_contact: 160, contacts: 8 };
    for seed in 0..6 {
        let repeats = held.treated(seed).provenance.repeats;
        assert!(repeats.is_some_and(|repeats| repeats.sample_and_hold), "seed {seed}");
    }
}

#[test]
fn coarse_converters_keep_their_rows() {
    for noise in [0.08, 0.15, 0.3, 0.5, 1.0, 2.0] {
        for (contacts, rows_per_contact) in [(4, 300), (16, 12), (40, 5)] {
            let coarse = Logger { step: 1.0, noise, contacts, rows_per_contact, ..FINE };
            for seed in 0..6 {
                let recording = coarse.record(seed);
                let treated = recording.clone().treat_repeated_readings(RepeatedReadings::Auto);
                let kept = (&treated.rows, treated.provenance.repeats.clone());
                assert_eq!(
                    kept,
                    (&recording.rows, None),
                    "noise {noise} {contacts} × {rows_per_contact} seed {seed}"
                );
            }
        }
    }
}

#[test]
fn fine_noise_and_few_repeats_stay() {
    let fine = FINE.treated(0);
    assert_eq!((fine.rows.len(), fine.provenance.repeats), (192, None));
    let mut copied = FINE.record(1);
    copied.rows.truncate(1);
    copied.rows.push(copied.rows[0].clone());
    assert_eq!(copied.treat_repeated_readings(RepeatedReadings::Auto).rows.len(), 2);
}

#[test]
fn repeats_without_any_change_count_once_for_each_contact() {
    let silent = Logger { noise: 0.0, ..FINE };
    let treated = silent.treated(3);
    let repeats = treated.provenance.repeats.clone().unwrap();
    assert_eq!((treated.rows.len(), repeats.sample_and_hold), (16, false));
}

#[test]
fn a_force_that_changes_under_a_held_reading_counts_once() {
    let held = Logger { runs: [[3, 3]; 4], contacts: 40, ..FINE };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut recording = held.record(5);
    for row in recording.rows.iter_mut().filter(|row| row.touches()) {
        let noise: f64 = StandardNormal.sample(&mut rng);
        row.force_n = row.force_n.map(|force_n| force_n + 0.01 * noise);
    }
    let first_force_n = recording.rows[12].force_n;
    let treated = recording.treat_repeated_readings(RepeatedReadings::Auto);
    assert_eq!(treated.rows.len(), 160);
    assert_eq!(treated.rows[4].force_n, first_force_n);
}

#[test]
fn slow_channels_are_named() {
    let mixed = Logger { runs: [[1, 1], [4, 4], [1, 1], [4, 4]], ..FINE };
    let treated = mixed.treated(0);
    let repeats = treated.provenance.repeats.clone().unwrap();
    assert_eq!((repeats.removed, repeats.slow_channels), (0, vec!["raw_2".to_owned(), "raw_4".to_owned()]));
    insta::assert_snapshot!(treated.warning_lines().join("\n"));
    // Two boards slower than the logger: rows that repeat both count once, others still repeat one of them.
    let both = Logger { runs: [[2, 2], [7, 7], [2, 2], [7, 7]], ..FINE };
    let treated = both.treated(0);
    let repeats = treated.provenance.repeats.unwrap();
    assert!(repeats.sample_and_hold && repeats.removed > 70, "{repeats:?}");
    assert_eq!(repeats.slow_channels, ["raw_1", "raw_2", "raw_3", "raw_4"]);
}

#[test]
fn clipped_channels_repeat_truly() {
    let mut recording = FINE.record(0);
    recording.rows.iter_mut().flat_map(|row| &mut row.reading).for_each(|value| *value -= 5.0);
    for row in &mut recording.rows {
        // Taxels that read 0 until they are pressed.
        row.reading
            .iter_mut()
            .enumerate()
            .for_each(|(c, value)| *value = (*value - 100.0 * c as f64).max(0.0));
    }
    let treated = recording.clone().treat_repeated_readings(RepeatedReadings::Auto);
    assert_eq!((treated.rows.len(), treated.provenance.repeats), (recording.rows.len(), None));
}

#[test]
fn the_key_decides() {
    let held = Logger { runs: [[3, 3]; 4], ..FINE }.record(0);
    let kept = held.clone().treat_repeated_readings(RepeatedReadings::Keep);
    assert_eq!((kept.rows.len(), kept.warnings()), (held.rows.len(), vec![]));
    assert!(
        matches!(held.warnings()[..], [Warning::RepeatsCounted { rows: 120..=128, of: 192 }]),
        "{:?}",
        held.warnings()
    );
    let coarse = Logger { step: 4.0, noise: 0.5, ..FINE }.record(0);
    let collapsed = coarse.treat_repeated_readings(RepeatedReadings::Collapse);
    assert!(
        collapsed.rows.len() < 192
            && collapsed.rows.windows(2).all(|pair| pair[0].reading != pair[1].reading)
    );
}
