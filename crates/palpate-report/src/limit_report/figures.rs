//! The bench, and the limit along it.

use maud::{Markup, html};

use super::LimitReport;
use crate::beam_drawing::{beam_drawing, supported_beam_drawing};
use crate::digit_figures::{force_limit_figure, linear_theory_figures, shapes_figure};
use crate::extremes::Extremes;
use crate::limit_line::along;
use crate::numbers::{counted, mm, stated};
use crate::page::Figure;
use crate::{Axis, Chart, Mark, ReportError, Series, SeriesKind, Stroke, chart_to_svg};
use palpate_mechanics::limit::{Bound, LimitCurve, LimitWarning};
use palpate_mechanics::surface::SurfaceSpec;

/// Where the surface ends, errors do: limits beyond this many lengths are cut off.
const MOST_LENGTHS: f64 = 10.0;

pub(super) fn bench_figure(report: &LimitReport) -> Result<Option<Figure>, ReportError> {
    let (layout, force_n) = (&report.bench.layout, report.known.force_n);
    let (drawn, beam, solution) = match &report.bench.surface {
        SurfaceSpec::Beam(beam) => {
            (beam_drawing(beam, layout, force_n), "a beam on two wedges".to_owned(), "in closed form")
        }
        SurfaceSpec::SupportedBeam(beam) => {
            let words = format!("a beam, {},", beam.spec().supports_in_words());
            (supported_beam_drawing(beam, layout, force_n), words, "as beam theory has it exactly")
        }
        SurfaceSpec::Digit(digit) => return Ok(Some(shapes_figure(digit, layout, force_n))),
        SurfaceSpec::Plate(_) | SurfaceSpec::Measured(_) => return Ok(None),
    };
    let (svg, load) = drawn?;
    let caption = html! {
        "The bench: " (beam) " and " (counted(layout.len(), "sensor", "sensors")) ", with "
        (stated(force_n)) " N at " (mm(load.x_m)) " mm. Blue: the bent beam, " (solution) "."
    };
    let alternative = "The bench: beam, supports, sensors and load".to_owned();
    Ok(Some(Figure { number: 1, alternative, svg, caption }))
}

pub(super) fn limit_figure(report: &LimitReport) -> Figure {
    let length_mm = report.known.extent.length_m * 1e3;
    let drawn = |curve: &LimitCurve, label: &str, colour| {
        let points = along(curve, |bound: &Bound| bound.sd_position_m * 1e3);
        Series { label: label.to_owned(), colour, kind: SeriesKind::Line { points, stroke: Stroke::Solid } }
    };
    let series = vec![
        drawn(report.known, "force known", 0),
        drawn(report.unknown, "force unknown, estimated along", 1),
    ];
    let chart = Chart {
        title: "The least standard deviation of a located contact".to_owned(),
        x: Axis::linear("contact position, mm").from_to(0.0, length_mm),
        y: axis(&series, length_mm),
        series,
        marks: marks(report, length_mm),
        height_px: 480,
        ..Chart::default()
    };
    let caption: Markup = html! {
        "The limit at each contact position, for " (stated(report.known.force_n)) " N. No unbiased estimator has a smaller \
         standard deviation; where its errors are Gaussian, its mean error is √(2/π) ≈ 0.8 of it on a line."
        @if !report.warnings.is_empty() { " Shaded: what the warnings are about." }
        @if cut_off(report, length_mm) {
            " Limits above " (stated(MOST_LENGTHS)) " lengths are not shown: contacts there cannot be located."
        }
    };
    Figure { number: 2, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
}

/// What only a digit has: the limit of the force, and how far the linear theory goes.
pub(super) fn digit_figures(report: &LimitReport) -> Vec<Figure> {
    let SurfaceSpec::Digit(digit) = &report.bench.surface else { return Vec::new() };
    let mut figures = vec![force_limit_figure(report.unknown, 3)];
    figures.extend(linear_theory_figures(report.bench, report.limit, digit, 4));
    figures
}

fn axis(series: &[Series], length_mm: f64) -> Axis {
    let extremes = Extremes::of_lines(series);
    let Extremes { least, greatest } = extremes;
    let label = "limit, mm";
    if extremes.are_far_apart() {
        let top = greatest.min(MOST_LENGTHS * length_mm);
        Axis::log10(label).from_to(0.7 * least, (1.4 * top).max(2.0 * least))
    } else if greatest > 0.0 {
        Axis::linear(label).from_to(0.0, 1.1 * greatest)
    } else {
        Axis::linear(label)
    }
}

fn cut_off(report: &LimitReport, length_mm: f64) -> bool {
    let beyond = |curve: &LimitCurve| {
        along(curve, |bound| bound.sd_position_m * 1e3).iter().any(|point| point.1 > MOST_LENGTHS * length_mm)
    };
    beyond(report.known) || beyond(report.unknown)
}

/// The length of the surface, beyond which a limit means "anywhere", and the zones of the warnings.
fn marks(report: &LimitReport, length_mm: f64) -> Vec<Mark> {
    let mut marks = Vec::new();
    let beyond = [report.known, report.unknown]
        .iter()
        .any(|curve| along(curve, |bound| bound.sd_position_m * 1e3).iter().any(|point| point.1 > length_mm));
    if beyond {
        let label = format!("length of the surface, {} mm", mm(length_mm * 1e-3));
        marks.push(Mark::HorizontalLine { y: length_mm, label });
    }
    for warning in report.warnings {
        let zone = warning.zone();
        let (low, high) = (zone.from.x_m * 1e3, zone.to.x_m * 1e3);
        let label = match warning {
            LimitWarning::Blind { .. } => "blind",
            LimitWarning::Mirror { .. } => "ambiguous",
            LimitWarning::Faint { .. } => "faint",
        }
        .to_owned();
        match warning {
            LimitWarning::Blind { .. } | LimitWarning::Faint { .. } => {
                marks.push(Mark::Span { low, high, label });
            }
            LimitWarning::Mirror { twins, .. } => {
                let place = |low: f64, high: f64| Mark::Span { low, high, label: label.clone() };
                marks.push(place(low, high));
                marks.push(place(twins.from.x_m * 1e3, twins.to.x_m * 1e3));
            }
        }
    }
    marks
}
