//! A beam on its bench, from its mechanics.

use super::numbers::stated;
use super::{BenchDrawing, BenchDrawingError, BenchStep, BenchSupport, BenchSupportKind, bench_to_svg};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{Beam, BeamSupportKind, SupportedBeam, Surface};

/// Where the drawn load acts, as a share of the length: off the middle, so that the shape is seen to be askew.
const DRAWN_LOAD: f64 = 0.35;
/// Where it may act on a beam on any supports: there, of these, where it bends the beam most.
const DRAWN_LOADS: [f64; 5] = [DRAWN_LOAD, 0.2, 0.5, 0.65, 0.8];
/// Points of the drawn shape.
const SHAPE_STEPS: u32 = 200;

/// The beam bent by `force_n` newtons, its supports and sensors, as SVG; and where the force is drawn.
pub(super) fn beam_drawing(
    beam: &Beam,
    layout: &Layout,
    force_n: f64,
) -> Result<(String, Position), BenchDrawingError> {
    let wedge = |position_mm| BenchSupport { position_mm, kind: BenchSupportKind::Simple };
    let supports = vec![wedge(0.0), wedge(beam.length_m * 1e3)];
    let load = Position::along(DRAWN_LOAD * beam.length_m);
    Ok((drawing(beam, supports, Vec::new(), layout, (load, force_n))?, load))
}

/// The same of a beam on any supports.
pub(super) fn supported_beam_drawing(
    beam: &SupportedBeam,
    layout: &Layout,
    force_n: f64,
) -> Result<(String, Position), BenchDrawingError> {
    let kind = |kind| match kind {
        BeamSupportKind::Simple => Some(BenchSupportKind::Simple),
        BeamSupportKind::Clamped => Some(BenchSupportKind::Clamped),
        BeamSupportKind::Guided => Some(BenchSupportKind::Guided),
        BeamSupportKind::Elastic { .. } => Some(BenchSupportKind::Elastic),
        BeamSupportKind::Free => None,
    };
    let spec = beam.spec();
    // Places are forgiven a rounding error where they are read, but not where they are drawn.
    let on_beam_mm = |x_m: f64| x_m.clamp(0.0, spec.length_m) * 1e3;
    let supports = spec.supports.iter().filter_map(|support| {
        Some(BenchSupport { position_mm: on_beam_mm(support.at_m), kind: kind(support.kind)? })
    });
    let step = |section: &palpate_mechanics::surface::BeamSection| BenchStep {
        to_mm: on_beam_mm(section.to_m),
        thickness_mm: section.thickness_m * 1e3,
    };
    let steps = spec.sections.iter().map(step).collect();
    let loads = DRAWN_LOADS.map(|share| Position::along(share * spec.length_m));
    let own = |at: &Position| beam.influence(SensorKind::Deflection, *at, *at).abs();
    let load = loads.into_iter().max_by(|a, b| own(a).total_cmp(&own(b))).unwrap_or(loads[0]);
    Ok((drawing(beam, supports.collect(), steps, layout, (load, force_n))?, load))
}

fn drawing(
    beam: &dyn Surface,
    supports: Vec<BenchSupport>,
    steps: Vec<BenchStep>,
    layout: &Layout,
    (load, force_n): (Position, f64),
) -> Result<String, BenchDrawingError> {
    let length_m = beam.length_m();
    // By reciprocity the bent shape is the influence function of the deflection under the load.
    let bent = beam.influence_function(SensorKind::Deflection, load);
    let deflection_mm = (0..=SHAPE_STEPS).map(|i| {
        let at = Position::along(f64::from(i) / f64::from(SHAPE_STEPS) * length_m);
        (at.x_m * 1e3, force_n * bent.at(at) * 1e3)
    });
    bench_to_svg(&BenchDrawing {
        length_mm: length_m * 1e3,
        supports,
        steps,
        sensors_mm: layout.sensors.iter().map(|sensor| sensor.position.x_m * 1e3).collect(),
        load_mm: load.x_m * 1e3,
        load_label: format!("{} N", stated(force_n)),
        deflection_mm: deflection_mm.collect(),
        width_px: 760,
    })
}
