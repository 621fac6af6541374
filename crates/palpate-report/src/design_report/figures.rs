//! The chosen layout on its bench, the limit along it, the sites of all layouts, and the count of sensors.

use maud::html;

use super::SensorDesignReport;
use crate::beam_drawing::{beam_drawing, supported_beam_drawing};
use crate::digit_figures::shapes_figure;
use crate::extremes::Extremes;
use crate::limit_line::along;
use crate::numbers::{counted, mm, stated};
use crate::page::Figure;
use crate::sites::sites_chart;
use crate::{Axis, Chart, Mark, Marker, ReportError, Series, SeriesKind, Stroke, chart_to_svg};
use palpate_design::sensors::{Assessment, CountPoint, Designed};
use palpate_estimators::setup::Bench;
use palpate_mechanics::limit::LimitCurve;
use palpate_mechanics::surface::SurfaceSpec;

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
    let limit = bench.cramer_rao_bound().ok()?;
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
    let extremes = Extremes::of_lines(&lines);
    let Extremes { least, greatest } = extremes;
    // Sensors stand in two rows beneath the curves.
    let (axis, rows) = if extremes.are_far_apart() {
        (Axis::log10("limit, mm").from_to(0.35 * least, 1.4 * greatest), [0.6 * least, 0.45 * least])
    } else {
        (Axis::linear("limit, mm").from_to(0.0, 1.1 * greatest), [0.1 * greatest, 0.04 * greatest])
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
    let mark = |zone: &palpate_design::sensors::KeepOut| Mark::Span {
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
    let curve = |of: fn(&CountPoint) -> Option<Assessment>| -> Vec<(f64, f64)> {
        let limit_m = |point| of(point).and_then(|worth| worth.mean_limit_m).unwrap_or(f64::NAN);
        report.counts.iter().map(|point| (point.count as f64, limit_m(point) * 1e3)).collect()
    };
    let curves = [
        ("even", 6, Stroke::Dashed, curve(|point| point.even)),
        ("designed", 0, Stroke::Solid, curve(|point| Some(point.designed))),
    ];
    let with_dots = |(label, colour, stroke, points): (&str, usize, Stroke, Vec<(f64, f64)>)| {
        let dots = SeriesKind::Points { points: points.clone(), marker: Marker::Circle };
        let line = SeriesKind::Line { points, stroke };
        [(label, line), ("", dots)].map(|(label, kind)| Series { label: label.to_owned(), colour, kind })
    };
    let series: Vec<Series> = curves.into_iter().flat_map(with_dots).collect();
    let extremes = Extremes::of_lines(&series);
    let y = if extremes.are_far_apart() {
        Axis::log10("mean limit, mm")
    } else {
        Axis::linear("mean limit, mm").from_to(0.0, 1.1 * extremes.greatest)
    };
    let step = (report.counts.len() / 12 + 1).max(1);
    let ticks: Vec<f64> = report.counts.iter().step_by(step).map(|point| point.count as f64).collect();
    let chart = Chart {
        title: "How the limit falls with the number of sensors".to_owned(),
        x: Axis::linear("sensors").from_to(first.count as f64 - 0.5, last.count as f64 + 0.5).ticks_at(ticks),
        y,
        series,
        ..Chart::default()
    };
    let caption = html! {
        "The mean limit of the even layout and of the layout by greedy choice and exchange. Where a curve is missing, the readings \
         of so few sensors do not tell some contact."
    };
    Some(Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption })
}
