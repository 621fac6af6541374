//! A beam on its bench, from its mechanics.

use super::numbers::stated;
use super::{BenchDrawing, BenchDrawingError, BenchSupport, BenchSupportKind, bench_to_svg};
use crate::contact::Position;
use crate::mechanics::{Beam, Surface};
use crate::sensing::{Layout, SensorKind};

/// Where the drawn load acts, as a share of the length: off the middle, so that the shape is seen to be askew.
const DRAWN_LOAD: f64 = 0.35;
/// Points of the drawn shape.
const SHAPE_STEPS: u32 = 200;

/// The beam bent by `force_n` newtons, its supports and sensors, as SVG; and where the force is drawn.
pub(super) fn beam_drawing(
    beam: &Beam,
    layout: &Layout,
    force_n: f64,
) -> Result<(String, Position), BenchDrawingError> {
    let length_mm = beam.length_m * 1e3;
    let load = Position::along(DRAWN_LOAD * beam.length_m);
    let deflection_mm = (0..=SHAPE_STEPS).map(|i| {
        let at = Position::along(f64::from(i) / f64::from(SHAPE_STEPS) * beam.length_m);
        (at.x_m * 1e3, force_n * beam.influence(SensorKind::Deflection, at, load) * 1e3)
    });
    let wedge = |position_mm| BenchSupport { position_mm, kind: BenchSupportKind::Simple };
    let svg = bench_to_svg(&BenchDrawing {
        length_mm,
        supports: vec![wedge(0.0), wedge(length_mm)],
        sensors_mm: layout.sensors.iter().map(|sensor| sensor.position.x_m * 1e3).collect(),
        load_mm: load.x_m * 1e3,
        load_label: format!("{} N", stated(force_n)),
        deflection_mm: deflection_mm.collect(),
        width_px: 760,
    })?;
    Ok((svg, load))
}
