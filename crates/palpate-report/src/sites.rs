//! Where layouts have their sensors, a row each.

use super::{Axis, Chart, Mark, Marker, Series, SeriesKind};
use palpate_mechanics::sensing::{Layout, SensorKind};

/// Every layout a named row, the first uppermost; a marker a kind.
pub(super) fn sites_chart(layouts: &[(String, &Layout)], length_m: f64, marks: Vec<Mark>) -> Chart {
    let rows = layouts.len();
    let y = |row: usize| (rows - row) as f64;
    let kinds = SensorKind::ALL.into_iter().enumerate().filter_map(|(colour, kind)| {
        let points: Vec<(f64, f64)> = layouts
            .iter()
            .enumerate()
            .flat_map(|(row, (_, layout))| {
                let sensors = layout.sensors.iter().filter(move |sensor| sensor.kind == kind);
                sensors.map(move |sensor| (sensor.position.x_m * 1e3, y(row)))
            })
            .collect();
        let drawn = SeriesKind::Points { points: points.clone(), marker: marker(kind) };
        (!points.is_empty()).then(|| Series { label: kind.name().to_owned(), colour, kind: drawn })
    });
    let names = layouts.iter().enumerate().map(|(row, (name, _))| (y(row), name.clone()));
    Chart {
        title: "Where the layouts have their sensors".to_owned(),
        x: Axis::linear("position, mm").from_to(0.0, length_m * 1e3),
        y: Axis::default().from_to(0.4, rows as f64 + 0.6).named(names.collect()),
        series: kinds.collect(),
        marks,
        height_px: (150 + 32 * rows) as u32,
        ..Chart::default()
    }
}

fn marker(kind: SensorKind) -> Marker {
    match kind {
        SensorKind::Deflection | SensorKind::Raw => Marker::Circle,
        SensorKind::Slope => Marker::Triangle,
        SensorKind::Strain => Marker::Square,
        SensorKind::Reaction => Marker::Cross,
    }
}
