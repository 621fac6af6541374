//! Errors of answers that are known by hand.

use super::*;

/// Ten contacts along 100 mm, the k-th located k/2 mm too far right.
fn evaluation() -> Evaluation {
    let located = (1..=10).map(|k| {
        let truth = Position::along(f64::from(k) * 0.01 - 0.005);
        let estimate = Position::along(truth.x_m + f64::from(k) * 0.5e-3);
        Located { truth, force_n: None, estimate, covered: None }
    });
    Evaluation { length_m: 0.1, located: located.collect() }
}

fn close(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-12, "{value}, not {expected}");
}

#[test]
fn the_summary_is_what_a_hand_finds() {
    let summary = evaluation().summary(None).unwrap();
    assert_eq!(summary.count, 10);
    close(summary.average_m, 2.75e-3);
    close(summary.median_m, 2.75e-3);
    close(summary.largest_m, 5e-3);
    close(summary.p95_m, 4.775e-3);
    close(summary.rmse_m, 0.5e-3 * 38.5_f64.sqrt());
    close(percentage_error(summary.average_m, 0.1), 2.75);
}

#[test]
fn portions_hold_their_ends() {
    let portion = Portion { from_m: 0.015, to_m: 0.035 };
    let summary = evaluation().summary(Some(portion)).unwrap();
    assert_eq!(summary.count, 3);
    close(summary.average_m, 1.5e-3);
    assert_eq!(evaluation().summary(Some(Portion { from_m: 0.2, to_m: 0.3 })), None);
}

#[test]
fn the_effective_length_counts_what_is_near_enough() {
    close(evaluation().effective_percent(2.0e-3 + 1e-12), 40.0);
    close(evaluation().effective_percent(1e-4), 0.0);
    close(evaluation().effective_percent(1.0), 100.0);
}

#[test]
fn positions_gather_their_repeats() {
    let mut twice = evaluation();
    twice.located.extend(evaluation().located);
    let by_position = twice.by_position();
    assert_eq!(by_position.len(), 10);
    assert!(by_position.iter().all(|(_, summary)| summary.count == 2));
    assert!(by_position.windows(2).all(|pair| pair[0].0.x_m < pair[1].0.x_m));
}
