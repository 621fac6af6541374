//! Errors and estimates along the surface.

use maud::{Markup, html};

use super::EvaluationReport;
use crate::limit_line::{limit_in_words, limit_line};
use crate::numbers::mm;
use crate::page::Figure;
use crate::{Axis, BandPoint, Chart, Mark, Marker, Series, SeriesKind, Stroke, chart_to_svg};
use palpate_estimators::evaluation::{ErrorSummary, Evaluation, Located, Spread};

/// More positions than this are drawn as a line: markers would hide each other.
const MOST_MARKERS: usize = 80;

/// A coordinate of a contact: where it was and where it was seen, in metres.
type Coordinate = fn(&Located) -> (f64, f64);

pub(super) fn error_figure(report: &EvaluationReport) -> Figure {
    let by_position = report.evaluation.by_position();
    let several = by_position.iter().any(|(_, summary)| summary.count > 1);
    let drawn = |label: &str, colour, marker, figure: fn(&ErrorSummary) -> f64| {
        let points =
            by_position.iter().map(|(position, summary)| (position.x_m * 1e3, figure(summary) * 1e3));
        Series { label: label.to_owned(), colour, kind: line_or_markers(points.collect(), marker) }
    };
    let label = if several { "average of the readings there" } else { "error of the reading there" };
    let mut series = vec![drawn(label, 0, Marker::Circle, |summary| summary.average_m)];
    if several {
        series.push(drawn("largest of the readings there", 1, Marker::Triangle, |summary| summary.largest_m));
    }
    series.extend(limit_line(report.bench()));
    let chart = Chart {
        title: "Location error along the surface".to_owned(),
        x: along_surface(report.evaluation, "contact position, mm"),
        y: Axis::log10("location error, mm"),
        series,
        marks: vec![Mark::HorizontalLine {
            y: report.tolerance_m * 1e3,
            label: format!("tolerance, {} mm", mm(report.tolerance_m)),
        }],
        ..Chart::default()
    };
    let caption = html! {
        "Location error at each contact position, on a logarithmic axis."
        (limit_in_words(&chart))
    };
    figure(1, &chart, caption)
}

pub(super) fn estimate_figure(report: &EvaluationReport) -> Figure {
    let length_mm = report.evaluation.length_m * 1e3;
    let identity =
        SeriesKind::Line { points: vec![(0.0, 0.0), (length_mm, length_mm)], stroke: Stroke::Dashed };
    let mut series = vec![Series { label: "estimated = true".to_owned(), colour: 6, kind: identity }];
    let across = report.bench().surface.extent().width_m.is_some();
    let label = if across { "along the surface" } else { "estimated" };
    series
        .extend(estimates(report.evaluation, label, 0, |located| (located.truth.x_m, located.estimate.x_m)));
    if across {
        let coordinate: Coordinate = |located| (located.truth.y_m, located.estimate.y_m);
        series.extend(estimates(report.evaluation, "across the surface", 1, coordinate));
    }
    let banded = series.iter().any(|series| matches!(series.kind, SeriesKind::Band { .. }));
    let chart = Chart {
        title: "Estimated against true position".to_owned(),
        x: along_surface(report.evaluation, "true position, mm"),
        y: Axis::linear("estimated position, mm"),
        series,
        height_px: 560,
        ..Chart::default()
    };
    let caption = html! {
        "Where the contact was seen, against where it was. On the dashes both are the same."
        @if banded { " Line: median of the readings at a position; band: 5–95 % of them." }
    };
    figure(2, &chart, caption)
}

/// A marker a reading; where that would be too many, the median of the readings at a position and their band.
fn estimates(evaluation: &Evaluation, label: &str, colour: usize, coordinate: Coordinate) -> Vec<Series> {
    let mut pairs: Vec<(f64, f64)> = evaluation.located.iter().map(coordinate).collect();
    pairs.iter_mut().for_each(|(truth, seen)| (*truth, *seen) = (*truth * 1e3, *seen * 1e3));
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let series = |label: &str, kind| Series { label: label.to_owned(), colour, kind };
    if pairs.len() <= MOST_MARKERS {
        return vec![series(label, SeriesKind::Points { points: pairs, marker: Marker::Circle })];
    }
    let places: Vec<(f64, Spread)> = pairs
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|place| Some((place[0].0, Spread::of(place.iter().map(|pair| pair.1).collect())?)))
        .collect();
    let line = places.iter().map(|&(x, spread)| (x, spread.median)).collect();
    let line = series(label, SeriesKind::Line { points: line, stroke: Stroke::Solid });
    if places.len() == pairs.len() {
        return vec![line];
    }
    let band = places.iter().map(|&(x, spread)| BandPoint { x, low: spread.p05, high: spread.p95 }).collect();
    vec![series("", SeriesKind::Band { points: band }), line]
}

fn line_or_markers(points: Vec<(f64, f64)>, marker: Marker) -> SeriesKind {
    if points.len() > MOST_MARKERS {
        SeriesKind::Line { points, stroke: Stroke::Solid }
    } else {
        SeriesKind::Points { points, marker }
    }
}

fn along_surface(evaluation: &Evaluation, label: &str) -> Axis {
    Axis::linear(label).from_to(0.0, evaluation.length_m * 1e3)
}

fn figure(number: usize, chart: &Chart, caption: Markup) -> Figure {
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(chart), caption }
}
