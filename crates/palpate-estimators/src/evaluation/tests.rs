use super::*;
use crate::fit::Fit;
use palpate_core::{ContactEstimate, Uncertainty};
use palpate_numerics::watch::Cancelled;

/// Ten contacts along 100 mm; the error of the k-th is k/2 mm to the right.
fn evaluation() -> Evaluation {
    let located = (1..=10).map(|k| {
        let truth = Position::along(f64::from(k) * 0.01 - 0.005);
        let estimate = Position::along(truth.x_m + f64::from(k) * 0.5e-3);
        EvaluatedContact {
            truth,
            force_n: None,
            estimate,
            covered: None,
            interval_score_m: None,
            status: None,
            force: None,
        }
    });
    Evaluation { extent: Extent::line(0.1).unwrap(), located: located.collect() }
}

fn close(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-12, "{value}, not {expected}");
}

#[test]
fn summary_equals_hand_computation() {
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
fn effective_length_counts_errors_within_tolerance() {
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
    assert!(by_position.iter().all(|(at, part)| part.located.len() == 2 && part.located[1].truth == *at));
    assert!(by_position.windows(2).all(|pair| pair[0].0.x_m < pair[1].0.x_m));
}

#[test]
fn errors_are_summed_up_by_cells_stretches_and_shares() {
    let evaluation = evaluation();
    let extent = Extent::plane(0.1, 0.05).unwrap();
    let medians = evaluation.median_by_cell_m(&Cells { extent, columns: 5, rows: 2 });
    assert_eq!(medians.len(), 10);
    for (cell, median) in medians.iter().enumerate() {
        // All contacts lie at y = 0, two in each column of cells.
        if cell < 5 { close(*median, 0.75e-3 + 1e-3 * cell as f64) } else { assert!(median.is_nan()) }
    }
    let stretches = evaluation.median_by_stretch_m(2);
    assert_eq!(stretches.len(), 2);
    close(stretches[0].0, 0.025);
    close(stretches[0].1, 1.5e-3);
    close(stretches[1].1, 4e-3);
    let percentiles = evaluation.percentiles_m();
    assert_eq!((percentiles.len(), percentiles[49].0, percentiles[99].0), (100, 50, 100));
    close(percentiles[49].1, 2.75e-3);
    close(percentiles[99].1, 5e-3);
}

#[test]
fn a_spread_does_not_mind_the_order() {
    let spread = Quantiles::from_values((0..=100).rev().map(f64::from).collect()).unwrap();
    assert_eq!(spread, Quantiles { median: 50.0, p05: 5.0, p95: 95.0 });
    assert_eq!(Quantiles::from_values(vec![]), None);
}

#[test]
fn interval_score_is_width_plus_forty_times_the_miss() {
    close(score_of_interval((1e-3, 3e-3), 2e-3), 2e-3);
    close(score_of_interval((1e-3, 3e-3), 3.5e-3), 2e-3 + 40.0 * 0.5e-3);
    close(score_of_interval((1e-3, 3e-3), 0.0), 2e-3 + 40.0 * 1e-3);
    let mut told = evaluation();
    for (i, located) in told.located.iter_mut().enumerate() {
        located.interval_score_m = Some(1e-3 * i as f64);
    }
    close(told.interval_score_m().unwrap(), 4.5e-3);
    // Without intervals the width is constant: the 95th percentile, 4.775 mm, is 0.225 mm below the last
    // error.
    close(evaluation().interval_score_m().unwrap(), 2.0 * 4.775e-3 + 40.0 * 0.225e-3 / 10.0);
}

#[test]
fn a_watched_evaluation_is_the_same_and_can_be_stopped() {
    let example = crate::fixtures::paper(5e-6, 2);
    let mut presses = example.simulate(1);
    let untouched =
        crate::recording::Row { force_n: Some(0.0), reading: vec![0.0; 8], ..presses.rows[0].clone() };
    presses.rows.insert(7, untouched);
    let locator = crate::influence::Influence::default().fit(&example.setup, &presses).unwrap();
    let evaluation = Evaluation::new(&locator, &presses).unwrap();
    assert_eq!(evaluation.located.len(), 20);
    assert_eq!(Evaluation::new_watched(&locator, &presses, Watch::NONE), Ok(evaluation));
    let stop = |_| false;
    let stopped = Evaluation::new_watched(&locator, &presses, Watch::new(&stop));
    assert_eq!(stopped, Err(Cancelled.into()));
    presses.rows[3].reading.pop();
    let error = Evaluation::new_watched(&locator, &presses, Watch::NONE).unwrap_err();
    assert_eq!(error.to_string(), "reading 4: the reading has 7 channels; the locator has 8");
}

#[test]
fn positions_that_count_from_the_other_end_or_along_other_axes_are_recognised() {
    let mapped = |extent: Extent, recorded: &dyn Fn(Position) -> Position| {
        let places = (0..5).flat_map(|x| (0..3).map(move |y| (x, y)));
        let located = places.map(|(x, y)| {
            let y_m = if extent.width_m().is_some() { 0.005 + 0.02 * f64::from(y) } else { 0.0 };
            let estimate = Position { x_m: 0.02 * f64::from(x) + 0.004 * f64::from(y) + 0.001, y_m };
            EvaluatedContact { truth: recorded(estimate), estimate, ..evaluation().located[0] }
        });
        let evaluation = Evaluation { extent, located: located.collect() };
        evaluation.mapped_positions().map(|found| (found.map, found.mapped_m < 1e-12))
    };
    let (line, plane) = (Extent::line(0.1).unwrap(), Extent::plane(0.1, 0.06).unwrap());
    let other_end = |at: Position| Position { x_m: 0.1 - at.x_m, ..at };
    let other_side = |at: Position| Position { y_m: 0.06 - at.y_m, ..at };
    assert_eq!(mapped(line, &|at| at), None);
    assert_eq!(mapped(plane, &|at| at), None);
    // Random errors show no map.
    assert_eq!(mapped(line, &|at| Position::along((at.x_m * 7.0) % 0.1)), None);
    assert_eq!(mapped(line, &other_end), Some((SurfaceMap::MirroredX, true)));
    assert_eq!(mapped(plane, &other_end), Some((SurfaceMap::MirroredX, true)));
    assert_eq!(mapped(plane, &other_side), Some((SurfaceMap::MirroredY, true)));
    assert_eq!(mapped(plane, &|at| other_side(other_end(at))), Some((SurfaceMap::Turned, true)));
    let exchanged = |at: Position| Position { x_m: at.y_m, y_m: at.x_m };
    assert_eq!(mapped(plane, &exchanged), Some((SurfaceMap::Exchanged, true)));
}

#[test]
fn coverage_on_a_plane_is_the_mean_of_both_coordinates() {
    let extent = Extent::plane(0.3, 0.2).unwrap();
    let estimate = Estimate::of_contact(
        ContactEstimate {
            position: Position { x_m: 0.1, y_m: 0.1 },
            force_n: None,
            uncertainty: Some(Uncertainty {
                covariance: [2.6e-5, 2.5e-5, 0.0, 2.6e-5, 0.0, 0.0],
                x_95_m: (0.09, 0.11),
                y_95_m: (0.09, 0.11),
                force_95_n: None,
            }),
        },
        Status::Located,
    );
    let covered =
        |x_m: f64, y_m: f64| EvaluatedContact::of_contact(Position { x_m, y_m }, None, &estimate, extent);
    // The second place is far outside the ellipse of these correlated errors.
    let located = vec![covered(0.1, 0.1), covered(0.109, 0.091), covered(0.12, 0.1), covered(0.2, 0.2)];
    let shares: Vec<f64> =
        located.iter().filter_map(|at| at.covered.map(CoveredCoordinates::share)).collect();
    assert_eq!(shares, [1.0, 1.0, 0.5, 0.0]);
    assert_eq!(Evaluation { extent, located }.coverage_percent(), Some(62.5));
}
