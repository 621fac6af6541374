use std::path::PathBuf;

use super::*;
use crate::network::{InputScale, NetworkConfig, OutputCoding};
use crate::recording::{Column, PositionColumns};
use crate::sensing::SensorKind;

const PAPER: &str = include_str!("../../../../examples/paper.toml");
const FSI_WATER: &str = include_str!("../../../../examples/fsi-water.toml");

#[test]
fn the_papers_bench_is_what_the_paper_says() {
    let rig = Rig::from_toml(PAPER).unwrap();
    let beam = Beam { length_m: 0.4, width_m: 0.04, thickness_m: 0.0012, youngs_modulus_pa: 200e9 };
    assert_eq!(rig.surface, SurfaceSpec::Beam(beam));
    assert_eq!(rig.layout, Layout::even(SensorKind::Deflection, 8, 0.4));
    assert_eq!(rig.force_n, Some(3.0));
    assert_eq!(rig.training, Some(Training { arrangement: Arrangement::Even, count: 10, repeats: 1 }));
    assert_eq!(rig.estimator, EstimatorConfig::Network(NetworkConfig::default()));
    assert_eq!(rig.columns, None);
}

#[test]
fn the_water_strip_maps_foreign_columns() {
    let rig = Rig::from_toml(FSI_WATER).unwrap();
    assert_eq!(rig.surface, SurfaceSpec::Measured(Extent { length_m: 0.1, width_m: None }));
    assert_eq!(rig.layout.names(), ["Pl", "Pr"]);
    let EstimatorConfig::Network(network) = &rig.estimator;
    assert_eq!((network.output, network.input_scale), (OutputCoding::Normalized, InputScale::Standardized));
    let columns = rig.columns.unwrap();
    assert_eq!(columns.position, PositionColumns::Along(Column::Name("X".to_owned())));
    assert_eq!(columns.position_unit.symbol(), "mm");
}

/// The folder of other people's recordings, or `None` where it is absent and may be.
fn data(file: &str) -> Option<PathBuf> {
    let workspace = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = std::env::var_os("PALPATE_DATA").map_or(workspace.join("../shared/data"), PathBuf::from);
    let path = folder.join(file);
    if path.exists() {
        return Some(path);
    }
    assert!(std::env::var_os("PALPATE_STRICT").is_none_or(|v| v != "1"), "{} is not there", path.display());
    eprintln!("skipped: {} is not there (set PALPATE_DATA)", path.display());
    None
}

#[test]
fn the_water_strips_recording_is_read() {
    let Some(path) = data("tactile-fsi/1d-water-1.5mm.csv") else { return };
    let rig = Rig::from_toml(FSI_WATER).unwrap();
    let recording = rig.read_recording("water", std::fs::File::open(path).unwrap()).unwrap();
    assert_eq!(recording.rows.len(), 779);
    assert_eq!(recording.distinct_positions().len(), 41);
    assert_eq!(recording.rows[0].reading, [2.04354199724436, 1.42585650614297]);
    assert_eq!(recording.rows[0].force_n, Some(2.21296444140415));
    let folds = recording.folds(5).unwrap();
    let held_out: Vec<usize> = folds.iter().map(|fold| fold.held_out.len()).collect();
    assert_eq!(held_out, [9 * 19, 8 * 19, 8 * 19, 8 * 19, 8 * 19]);
}
