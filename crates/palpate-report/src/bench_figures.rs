use maud::html;

use super::beam_drawing::{beam_drawing, supported_beam_drawing};
use super::digit_figures::shapes_figure;
use super::numbers::{counted, mm, rig_number};
use super::page::Figure;
use super::{Axis, Chart, Mark, Marker, Series};
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::SurfaceSpec;

/// Surface bent by `force_n`, if drawable.
pub(super) fn bench_figure(
    what: &str,
    surface: &SurfaceSpec,
    layout: &Layout,
    force_n: f64,
) -> Option<Figure> {
    let ((drawing, load), held, solution) = match surface {
        SurfaceSpec::Beam(beam) => {
            (beam_drawing(beam, layout, force_n), " on two wedges".to_owned(), "in closed form")
        }
        SurfaceSpec::SupportedBeam(beam) => {
            let drawing = supported_beam_drawing(beam, layout, force_n);
            (drawing, format!(", {},", beam.spec().supports_in_words()), "as beam theory has it exactly")
        }
        SurfaceSpec::Digit(digit) => return Some(shapes_figure(what, digit, layout, force_n)),
        SurfaceSpec::Plate(_) | SurfaceSpec::Measured(_) => return None,
    };
    let caption = html! {
        (what) ": a beam" (held) " and " (counted(layout.len(), "sensor", "sensors")) ", with " (rig_number(force_n)) " N at "
        (mm(load.x_m)) " mm. Blue: the bent beam, " (solution) "."
    };
    Some(Figure::beam(format!("{what}: beam, supports, sensors and load"), &drawing, caption))
}

pub(super) fn sites_chart(layouts: &[(String, &Layout)], length_m: f64, marks: Vec<Mark>) -> Chart {
    let kinds = SensorKind::ALL.into_iter().enumerate().filter_map(|(colour, kind)| {
        let of_row = |(row, (_, layout)): (usize, &(String, &Layout))| -> Vec<(f64, f64)> {
            let sensors = layout.sensors().iter().filter(|sensor| sensor.kind == kind);
            sensors.map(|sensor| (sensor.position.x_m * 1e3, row_height(layouts.len(), row))).collect()
        };
        let points: Vec<(f64, f64)> = layouts.iter().enumerate().flat_map(of_row).collect();
        (!points.is_empty()).then(|| Series::markers(kind.name(), colour, points, marker(kind)))
    });
    let names: Vec<&str> = layouts.iter().map(|(name, _)| name.as_str()).collect();
    let x = Axis::linear("position, mm").from_to(0.0, length_m * 1e3);
    Chart::new("Where the layouts have their sensors", x, row_axis(&names), kinds.collect())
        .with_height((150 + 32 * layouts.len()) as u32)
        .with_marks(marks)
}

pub(super) fn row_axis(names: &[&str]) -> Axis {
    let rows = names.len();
    let named = names.iter().enumerate().map(|(row, name)| (row_height(rows, row), (*name).to_owned()));
    Axis::default().from_to(0.4, rows as f64 + 0.6).named(named.collect())
}

pub(super) fn row_height(rows: usize, row: usize) -> f64 {
    (rows - row) as f64
}

fn marker(kind: SensorKind) -> Marker {
    match kind {
        SensorKind::Deflection | SensorKind::Raw => Marker::Circle,
        SensorKind::Slope => Marker::Triangle,
        SensorKind::Strain => Marker::Square,
        SensorKind::Reaction => Marker::Cross,
    }
}
