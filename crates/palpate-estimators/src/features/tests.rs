use palpate_core::Estimate;

use super::{FeatureKind, FeatureSource, Features, NoFeatures};
use crate::arrangement::Training;
use crate::fit::{Fit, FitTask};
use crate::fixtures::{Example, paper};
use crate::gaussian_process::GaussianProcessEstimator;
use crate::neighbours::Neighbours;
use crate::recording::{Provenance, Recording, Row};
use crate::simulate::simulate_at;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;

/// Readings of forces from 1 to 3 at ten positions: two lever reactions, a disabled channel and a deflection.
fn recording() -> Recording {
    let rows = (0..30).map(|i| row(f64::from(i % 10) / 9.0, 1.0 + f64::from(i / 10)));
    recording_of(rows.collect())
}

fn row(at: f64, force_n: f64) -> Row {
    let reading = vec![force_n * (1.0 - at), force_n * at, 7.0, -1e-3 * force_n * at * (1.0 - at)];
    Row { position: Position::along(at), force_n: None, nuisances: Vec::new(), time_s: None, reading }
}

fn recording_of(rows: Vec<Row>) -> Recording {
    use SensorKind::{Deflection, Reaction};
    Recording {
        channels: ["left", "right", "dead", "middle"].map(String::from).to_vec(),
        kinds: vec![Reaction, Reaction, Reaction, Deflection],
        provenance: Provenance {
            source: "test".into(),
            rows: rows.len(),
            digests: vec![],
            dialects: vec![],
            repeats: None,
            seed: None,
            placement_sd_m: None,
            bench: None,
        },
        rows,
    }
}

#[test]
fn features_are_standardized_without_disabled_channels() {
    let recording = recording();
    for (kind, count) in [(FeatureKind::Readings, 3), (FeatureKind::LoadInvariant, 4)] {
        let features = Features::fit(kind, &recording).unwrap();
        assert_eq!(features.len(), count);
        assert_eq!(features.check(4), Ok(()));
        for f in 0..count {
            let values: Vec<f64> = recording.rows.iter().map(|row| features.apply(&row.reading)[f]).collect();
            let mean = values.iter().sum::<f64>() / 30.0;
            let square = values.iter().map(|v| v * v).sum::<f64>() / 30.0;
            assert!(mean.abs() < 1e-12 && (square - 1.0).abs() < 1e-12, "{mean} {square}");
        }
    }
}

#[test]
fn only_the_log_norm_depends_on_the_load() {
    let features = Features::fit(FeatureKind::LoadInvariant, &recording()).unwrap();
    let (light, heavy) = (row(0.3, 1.0).reading, row(0.3, 2.5).reading);
    let (light, heavy) = (features.apply(&light), features.apply(&heavy));
    for (i, feature) in features.features.iter().enumerate() {
        let difference = heavy[i] - light[i];
        let expected = if feature.source == FeatureSource::LogNorm {
            2.5_f64.ln() / feature.standard_deviation
        } else {
            0.0
        };
        assert!((difference - expected).abs() < 1e-12, "{difference} {expected}");
    }
    assert!(features.apply(&[0.0; 4]).iter().all(|value| value.is_finite()));
}

#[test]
fn readings_that_never_change_have_no_features() {
    let still = recording_of(vec![row(0.5, 1.0), row(0.5, 1.0)]);
    for kind in [FeatureKind::Readings, FeatureKind::LoadInvariant] {
        assert_eq!(Features::fit(kind, &still), Err(NoFeatures { channels: 4, rows: 2 }));
    }
    assert_eq!(
        Features::fit(FeatureKind::Readings, &recording_of(vec![])),
        Err(NoFeatures { channels: 4, rows: 0 })
    );
}

#[test]
fn a_damaged_file_is_refused() {
    let good = Features::fit(FeatureKind::LoadInvariant, &recording()).unwrap();
    let text = serde_json::to_string(&good).unwrap();
    assert_eq!(serde_json::from_str::<Features>(&text).unwrap().check(4), Ok(()));
    let damage: [fn(&mut Features); 5] = [
        |f| f.channels[1].channel = 4,
        |f| f.channels[0].divisor = 0.0,
        |f| f.features[0].source = FeatureSource::Channel(3),
        |f| f.features[2].standard_deviation = f64::NAN,
        |f| f.features.clear(),
    ];
    for damage in damage {
        let mut features = good.clone();
        damage(&mut features);
        assert!(features.check(4).is_err(), "{features:?}");
    }
}

/// Near both supports of a beam readings are almost 0; only proportions distinguish the ends.
#[test]
fn ends_of_a_beam_are_distinguished_for_a_known_force() {
    let Example { setup, training } = paper(5e-6, 5);
    let presses = setup.simulate(&Training { count: 20, ..training }, 0).unwrap();
    let positions: Vec<Position> = (2..=38).map(|cm| Position::along(f64::from(cm) * 0.01)).collect();
    let asked = simulate_at(&setup, &positions, 1, 1).unwrap();
    let process = GaussianProcessEstimator::default()
        .fit_without_interval_check(FitTask::new(&setup, &presses))
        .unwrap();
    let neighbours =
        Neighbours::default().fit_without_interval_check(FitTask::new(&setup, &presses)).unwrap();
    let error_m = |estimate: Estimate, row: &Row| (estimate.contact.position.x_m - row.position.x_m).abs();
    for row in &asked.rows {
        assert!(error_m(process.locate(&row.reading).unwrap(), row) < 0.01, "{}", row.position.x_m);
        assert!(error_m(neighbours.locate(&row.reading).unwrap(), row) < 0.02, "{}", row.position.x_m);
    }
}
