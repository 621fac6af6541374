//! The profile, what the layout resolves, and the residuals.

mod plane;

use maud::html;

use super::ProfileReport;
use crate::numbers::mm;
use crate::page::Figure;
use crate::{Axis, BandPoint, Chart, Mark, Marker, Series, SeriesKind, Stroke, chart_to_svg};
use palpate_estimators::estimator::{LoadProfile, Resolution};

/// Places whose averaging kernels are drawn, as shares of the length.
const KERNEL_PLACES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

pub(super) fn figures(report: &ProfileReport) -> Vec<Figure> {
    if report.profile.cells.extent.is_plane() {
        return plane::figures(report);
    }
    let mut figures = vec![profile_figure(report)];
    if let Some(resolution) = report.resolution {
        figures.push(width_figure(report, resolution));
        figures.push(kernel_figure(report, resolution));
    }
    figures.push(residual_figure(report));
    figures
}

/// Positions of the cells of a line in mm, each with some figure of the cell.
fn along(profile: &LoadProfile, of: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
    let cells = profile.cells;
    (0..cells.len()).map(|cell| (cells.centre(cell).x_m * 1e3, of(cell))).collect()
}

fn profile_figure(report: &ProfileReport) -> Figure {
    let profile = report.profile;
    let per_mm = 1e-3;
    let low = along(profile, |cell| profile.density(cell).1.0 * per_mm);
    let high = along(profile, |cell| profile.density(cell).1.1 * per_mm);
    let band = low.iter().zip(&high).map(|((x, low), (_, high))| BandPoint { x: *x, low: *low, high: *high });
    let mut series = vec![
        Series {
            label: "95 % interval".to_owned(),
            colour: 0,
            kind: SeriesKind::Band { points: band.collect() },
        },
        line("load", 0, along(profile, |cell| profile.density(cell).0 * per_mm), Stroke::Solid),
    ];
    if !report.truth.is_empty() {
        series.push(line("true load", 1, truth(report), Stroke::Dashed));
    }
    let centre = profile.centre.map(|centre| Mark::VerticalLine {
        x: centre.position.x_m * 1e3,
        label: "centre of pressure".to_owned(),
    });
    let chart = Chart {
        title: "The load along the surface".to_owned(),
        x: surface_axis(profile, "position, mm"),
        y: Axis::linear("load, N/mm"),
        series,
        marks: centre.into_iter().collect(),
        ..Chart::default()
    };
    let caption = html! {
        "The load that the reading tells, with its 95 % interval cell by cell."
        @if !report.truth.is_empty() { " Dashes: the load that was simulated." }
        " Neighbouring cells share their uncertainty: where one is too high, the next is too low, and their sum is told better than \
         either."
    };
    figure(1, &chart, caption)
}

/// The simulated loads as a line that steps up and down.
fn truth(report: &ProfileReport) -> Vec<(f64, f64)> {
    let mut loads = report.truth.to_vec();
    loads.sort_by(|a, b| a.from.x_m.total_cmp(&b.from.x_m));
    let mut points = vec![(0.0, 0.0)];
    for load in &loads {
        let (from, to) = (load.from.x_m * 1e3, load.to.x_m * 1e3);
        let density = load.force_n / (to - from);
        points.extend([(from, 0.0), (from, density), (to, density), (to, 0.0)]);
    }
    points.push((report.profile.cells.extent.length_m * 1e3, 0.0));
    points
}

fn width_figure(report: &ProfileReport, resolution: &Resolution) -> Figure {
    let points = along(report.profile, |cell| resolution.widths_m[cell] * 1e3);
    let sensors = report.layout.sensors.iter().map(|sensor| sensor.position.x_m * 1e3);
    let most = points.iter().fold(0.0, |most: f64, point| most.max(point.1));
    let chart = Chart {
        title: "Width of the averaging kernels".to_owned(),
        x: surface_axis(report.profile, "position, mm"),
        y: Axis::linear("width at half height, mm").from_to(0.0, 1.1 * most),
        series: vec![
            line("width", 0, points, Stroke::Solid),
            Series {
                label: "sensors".to_owned(),
                colour: 2,
                kind: SeriesKind::Points {
                    points: sensors.map(|x| (x, 0.02 * most)).collect(),
                    marker: Marker::Triangle,
                },
            },
        ],
        ..Chart::default()
    };
    figure(
        2,
        &chart,
        html! { "Over how much of the surface the profile is a mean, at the smoothness of this reading." },
    )
}

fn kernel_figure(report: &ProfileReport, resolution: &Resolution) -> Figure {
    let cells = resolution.cells;
    let kernel = |(colour, share): (usize, &f64)| {
        let of = ((share * cells.columns as f64) as usize).min(cells.columns - 1);
        let row = resolution.kernels.row(of);
        let points = along(report.profile, |cell| row[cell]);
        line(&format!("of {} mm", mm(cells.centre(of).x_m)), colour, points, Stroke::Solid)
    };
    let chart = Chart {
        title: "Averaging kernels".to_owned(),
        x: surface_axis(report.profile, "position of the load, mm"),
        y: Axis::linear("share of a cell's load"),
        series: KERNEL_PLACES.iter().enumerate().map(kernel).collect(),
        ..Chart::default()
    };
    let caption = html! {
        "What load elsewhere adds to the profile at five places: the ideal is a spike at the place itself. Negative lobes take away."
    };
    figure(3, &chart, caption)
}

/// The residuals: along a line by place, on a plane by number.
fn residual_figure(report: &ProfileReport) -> Figure {
    let plane = report.profile.cells.extent.is_plane();
    let mut kinds: Vec<_> = report.layout.kinds();
    kinds.dedup();
    let of_kind = |(colour, kind): (usize, &palpate_mechanics::sensing::SensorKind)| {
        let sensors = report.layout.sensors.iter().enumerate().filter(|(_, sensor)| sensor.kind == *kind);
        let points = sensors.filter_map(|(i, sensor)| {
            let at = if plane { (i + 1) as f64 } else { sensor.position.x_m * 1e3 };
            Some((at, report.profile.residuals.get(i).copied().flatten()?))
        });
        let marker = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Cross][colour % 4];
        Series {
            label: kind.name().to_owned(),
            colour,
            kind: SeriesKind::Points { points: points.collect(), marker },
        }
    };
    let line_at = |y: f64, label: &str| Mark::HorizontalLine { y, label: label.to_owned() };
    let chart = Chart {
        title: "What the profile leaves of the reading".to_owned(),
        x: if plane {
            Axis::linear("sensor").from_to(0.0, report.layout.len() as f64 + 1.0)
        } else {
            surface_axis(report.profile, "sensor position, mm")
        },
        y: Axis::linear("residual, standard deviations of the noise"),
        series: kinds.iter().enumerate().map(of_kind).collect(),
        marks: vec![line_at(2.0, "two standard deviations"), line_at(-2.0, "")],
        height_px: 340,
        ..Chart::default()
    };
    figure(
        4,
        &chart,
        html! { "Reading less what the sensor would read of the profile, over the standard deviation of its noise." },
    )
}

fn line(label: &str, colour: usize, points: Vec<(f64, f64)>, stroke: Stroke) -> Series {
    Series { label: label.to_owned(), colour, kind: SeriesKind::Line { points, stroke } }
}

fn surface_axis(profile: &LoadProfile, label: &str) -> Axis {
    Axis::linear(label).from_to(0.0, profile.cells.extent.length_m * 1e3)
}

fn figure(number: usize, chart: &Chart, caption: maud::Markup) -> Figure {
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(chart), caption }
}
