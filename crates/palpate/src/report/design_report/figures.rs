//! The chosen layout on its bench, the limit along it, the sites of all layouts, and the count of sensors.

use maud::html;

use super::SensorDesignReport;
use crate::bench::Bench;
use crate::design::sensors::{Assessment, CountPoint, Designed};
use crate::limit::{Limit, LimitCurve};
use crate::mechanics::SurfaceSpec;
use crate::report::beam_drawing::{beam_drawing, supported_beam_drawing};
use crate::report::digit_figures::shapes_figure;
use crate::report::limit_line::along;
use crate::report::numbers::{counted, mm, stated};
use crate::report::page::Figure;
use crate::report::sites::sites_chart;
use crate::report::{Axis, Chart, Mark, Marker, ReportError, Series, SeriesKind, Stroke, chart_to_svg};

/// Values whose largest is this many times the smallest are drawn on a logarithmic axis.
const LOGARITHMIC_FROM: f64 = 10.0;

/// The bench with the best layout, where it can be drawn.
pub(super) fn bench_figure(
    report: &SensorDesignReport,
    number: usize,
) -> Result<Option<Figure>, ReportError> {
    let Some(best) = report.best() else { return Ok(None) };
    let force_n = report.problem.force_n();
    let drawn = match &report.bench.surface {
        SurfaceSpec::Beam(beam) => beam_drawing(beam, &best.layout, force_n)?,
        SurfaceSpec::SupportedBeam(beam) => supported_beam_drawing(beam, &best.layout, force_n)?,
        SurfaceSpec::Digit(digit) => {
            return Ok(Some(Figure { number, ..shapes_figure(digit, &best.layout, force_n) }));
        }
        SurfaceSpec::Plate(_) | SurfaceSpec::Measured(_) => return Ok(None),
    };
    let (svg, load) = drawn;
    let caption = html! {
        "The bench with the best layout: " (counted(best.layout.len(), "sensor", "sensors")) ", with " (stated(force_n))
        " N at " (mm(load.x_m)) " mm. Blue: the bent beam."
    };
    let alternative = "The bench with the best layout".to_owned();
    Ok(Some(Figure { number, alternative, svg, caption }))
}

/// The limit of a layout at the contacts of the design.
pub(super) fn limit_of(report: &SensorDesignReport, designed: &Designed) -> Option<LimitCurve> {
    let bench = Bench { layout: designed.layout.clone(), ..report.bench.clone() };
    let limit = Limit::of(&bench).ok()?;
    let (problem, positions) = (report.problem, &report.problem.contacts().positions);
    LimitCurve::at(&limit, problem.force_n(), problem.force(), positions).ok()
}

/// The limit along the surface, even and best, and where their sensors are.
pub(super) fn limit_figure(report: &SensorDesignReport, number: usize) -> Option<Figure> {
    let drawn = |designed: &Designed, colour, stroke| {
        let curve = limit_of(report, designed)?;
        let points = along(&curve, |bound| bound.sd_position_m * 1e3);
        let label = format!("limit, {} layout", designed.method.name());
        Some(Series { label, colour, kind: SeriesKind::Line { points, stroke } })
    };
    let (even, best) = (report.even(), report.best()?);
    let lines: Vec<Series> = even
        .and_then(|even| drawn(even, 6, Stroke::Dashed))
        .into_iter()
        .chain(drawn(best, 0, Stroke::Solid))
        .collect();
    let values = lines.iter().flat_map(|line| match &line.kind {
        SeriesKind::Line { points, .. } => points.iter().map(|point| point.1).collect(),
        _ => Vec::new(),
    });
    let finite: Vec<f64> = values.filter(|value| value.is_finite() && *value > 0.0).collect();
    let (low, high) =
        (finite.iter().copied().fold(f64::INFINITY, f64::min), finite.iter().copied().fold(0.0, f64::max));
    let logarithmic = high > LOGARITHMIC_FROM * low;
    // Sensors stand in two rows beneath the curves.
    let (axis, rows) = if logarithmic {
        (Axis::log10("limit, mm").from_to(0.35 * low, 1.4 * high), [0.6 * low, 0.45 * low])
    } else {
        (Axis::linear("limit, mm").from_to(0.0, 1.1 * high), [0.1 * high, 0.04 * high])
    };
    let sites = |designed: &Designed, colour, y, marker| Series {
        label: format!("sensors, {} layout", designed.method.name()),
        colour,
        kind: SeriesKind::Points {
            points: designed.layout.sensors.iter().map(|sensor| (sensor.position.x_m * 1e3, y)).collect(),
            marker,
        },
    };
    let mut series = lines;
    series.extend(even.map(|even| sites(even, 6, rows[0], Marker::Square)));
    series.push(sites(best, 0, rows[1], Marker::Triangle));
    let chart = Chart {
        title: "The least standard deviation of a located contact".to_owned(),
        x: Axis::linear("contact position, mm").from_to(0.0, report.bench.surface.extent().length_m * 1e3),
        y: axis,
        series,
        marks: kept_out(report),
        height_px: 500,
        ..Chart::default()
    };
    let caption = html! {
        "The limit at the contacts of the design, for " (stated(report.problem.force_n())) " N, force "
        (report.problem.force().name()) ", with the sensors of either layout beneath."
        @if !report.problem.design().keep_out.is_empty() { " Shaded: where no sensor may sit." }
    };
    Some(Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption })
}

fn kept_out(report: &SensorDesignReport) -> Vec<Mark> {
    let mark = |zone: &crate::rig::KeepOut| Mark::Span {
        low: zone.from.x_m * 1e3,
        high: zone.to.x_m * 1e3,
        label: "kept out".to_owned(),
    };
    report.problem.design().keep_out.iter().map(mark).collect()
}

/// Every layout a row.
pub(super) fn sites_figure(report: &SensorDesignReport, number: usize) -> Figure {
    let row = |designed: &'_ Designed| designed.method.name().to_owned();
    let rows: Vec<_> = report.designed.iter().map(|designed| (row(designed), &designed.layout)).collect();
    let chart = sites_chart(&rows, report.bench.surface.extent().length_m, kept_out(report));
    let caption = html! { "The sensors of every layout, a row each." };
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
}

/// The mean limit against the number of sensors.
pub(super) fn counts_figure(report: &SensorDesignReport, number: usize) -> Option<Figure> {
    let (first, last) = (report.counts.first()?, report.counts.last()?);
    let line = |label: &str, colour, stroke, of: &dyn Fn(&CountPoint) -> Option<Assessment>| {
        let limit = |point: &CountPoint| of(point).and_then(|worth| worth.mean_limit_m);
        let points = report
            .counts
            .iter()
            .map(|point| (point.count as f64, limit(point).map_or(f64::NAN, |m| m * 1e3)));
        Series {
            label: label.to_owned(),
            colour,
            kind: SeriesKind::Line { points: points.collect(), stroke },
        }
    };
    let series = vec![
        line("even", 6, Stroke::Dashed, &|point| point.even),
        line("designed", 0, Stroke::Solid, &|point| Some(point.designed)),
    ];
    let dots: Vec<Series> = series
        .iter()
        .map(|series| {
            let points = match &series.kind {
                SeriesKind::Line { points, .. } => points.clone(),
                _ => Vec::new(),
            };
            let kind = SeriesKind::Points { points, marker: Marker::Circle };
            Series { label: String::new(), colour: series.colour, kind }
        })
        .collect();
    let values: Vec<f64> = dots
        .iter()
        .flat_map(|series| match &series.kind {
            SeriesKind::Points { points, .. } => points.iter().map(|point| point.1).collect(),
            _ => Vec::new(),
        })
        .filter(|value| value.is_finite())
        .collect();
    let (low, high) =
        (values.iter().copied().fold(f64::INFINITY, f64::min), values.iter().copied().fold(0.0, f64::max));
    let label = "mean limit, mm";
    let y = if high > LOGARITHMIC_FROM * low {
        Axis::log10(label)
    } else {
        Axis::linear(label).from_to(0.0, 1.1 * high)
    };
    let step = (report.counts.len() / 12 + 1).max(1);
    let ticks: Vec<f64> = report.counts.iter().step_by(step).map(|point| point.count as f64).collect();
    let chart = Chart {
        title: "How the limit falls with the number of sensors".to_owned(),
        x: Axis::linear("sensors").from_to(first.count as f64 - 0.5, last.count as f64 + 0.5).ticks_at(ticks),
        y,
        series: series.into_iter().chain(dots).collect(),
        ..Chart::default()
    };
    let caption = html! {
        "The mean limit of the even layout and of the layout by greedy choice and exchange. Where a curve is missing, the readings \
         of so few sensors do not tell some contact."
    };
    Some(Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption })
}
