//! Dead areas of a centroid and of the influence estimator.

use super::*;
use palpate_estimators::evaluation::{EvaluatedContact, Evaluation};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};

fn study(counts: &[usize]) -> DeadAreaResults {
    let study = DeadAreas {
        rig: Rig::from_toml(RIG_TOML).unwrap(),
        counts: counts.to_vec(),
        calibrations: 1,
        tolerance_m: 2e-3,
        excluded: vec!["network", "network-lm", "gaussian-process", "neighbours"],
        seed: 0,
    };
    study.run(Watch::NONE).unwrap()
}

#[test]
fn dead_areas_are_the_interpretations_and_not_the_counts() {
    let found = study(&[4, 16]);
    let row = |sensing: &str, estimator: &str, sensors: usize| {
        let mut rows = found.rows.iter();
        rows.find(|row| {
            row.sensing.starts_with(sensing) && row.estimator == estimator && row.sensors == sensors
        })
        .unwrap()
    };
    // Sensors under one surface, with a suitable estimator: no dead area, neither with few sensors nor with many.
    for sensors in [4, 16] {
        let row = row("distributive", "influence", sensors);
        assert!(row.effective_percent > 97.0 && row.folded.dead_percent < 3.0, "{row:?}");
        assert!(row.folded.between_m < 2.0 * row.folded.at_sensors_m, "{row:?}");
    }
    // With the estimator of an array, these sensors have dead areas.
    assert!(row("distributive", "centroid", 16).effective_percent < 60.0);
    // An array with a point spread of 10 mm: dead areas between four sensors, few between sixteen.
    let sparse = row("array, spread 10 mm", "centroid", 4);
    assert!(sparse.folded.dead_percent > 60.0, "{sparse:?}");
    let dense = row("array, spread 10 mm", "centroid", 16);
    assert!(dense.folded.dead_percent < 0.5 * sparse.folded.dead_percent, "{dense:?}");
}

#[test]
fn errors_are_folded_over_the_gaps() {
    let layout = Layout::even(SensorKind::Deflection, 3, 0.4);
    let off = |x_m: f64, error_m: f64| EvaluatedContact {
        truth: Position::along(x_m),
        force_n: None,
        estimate: Position::along(x_m + error_m),
        covered: None,
        interval_score_m: None,
        status: None,
        force: None,
    };
    // Over a sensor, in the middle of a gap, and beyond the outermost sensor.
    let located = vec![off(0.1, 1e-3), off(0.2, 3e-3), off(0.25, 8e-3), off(0.05, 1.0)];
    let folded =
        FoldedErrors::new(&Evaluation { extent: Extent::line(0.4).unwrap(), located }, &layout, 2e-3);
    assert!((folded.at_sensors_m - 2e-3).abs() < 1e-12 && (folded.between_m - 8e-3).abs() < 1e-12);
    assert!((folded.dead_percent - 200.0 / 3.0).abs() < 1e-9);
    assert_eq!(folded.folds.iter().map(|fold| fold.contacts).collect::<Vec<_>>(), [2, 1]);
}

#[test]
fn stopped_study_has_no_results() {
    let study = DeadAreas {
        rig: Rig::from_toml(RIG_TOML).unwrap(),
        counts: vec![2],
        calibrations: 1,
        tolerance_m: 2e-3,
        excluded: vec!["influence", "gaussian-process", "closed-form", "neighbours", "network", "network-lm"],
        seed: 0,
    };
    let stopped = study.run(Watch::new(&|_| false)).unwrap_err();
    assert!(Cancelled::caused(&stopped), "{stopped}");
}
