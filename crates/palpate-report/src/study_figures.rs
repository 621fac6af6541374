//! The figures of any study: arms side by side, their layouts, and errors along the surface.

use maud::html;

use super::limit_line::{limit_in_words, limit_line_of_arm};
use super::numbers::{counted, listed};
use super::page::Figure;
use super::sites::sites_chart;
use super::study_parts::{Drawn, along, banded, error_chart, error_chart_of, portion_in_words};
use super::{Axis, Chart, Marker, Series, SeriesKind, Stroke, StudyReport, chart_to_svg};
use palpate_estimators::evaluation::Spread;
use palpate_mechanics::sensing::Layout;
use palpate_studies::{Arm, ArmResults};

/// So many arms are told apart in a table; more are also drawn side by side.
const FEW_ARMS: usize = 3;
/// So many bands may lie over each other in a figure.
const MOST_BANDS: usize = 2;
/// Markers of an arm stand this far beside each other, in rows.
const BESIDE: f64 = 0.22;

/// The average errors of all arms, a row each, where there are more than a few.
pub(super) fn overview(report: &StudyReport, number: usize) -> Option<Figure> {
    let arms = &report.results.arms;
    if arms.len() <= FEW_ARMS {
        return None;
    }
    let row = |i: usize| (arms.len() - i) as f64;
    let mut series = Vec::new();
    for (k, shown) in shown(report).into_iter().enumerate() {
        let y = |i: usize| row(i) + BESIDE * (0.5 - k as f64);
        let spreads = || arms.iter().enumerate().filter_map(|(i, arm)| Some((i, (shown.error)(arm)?)));
        // A range over the seeds is a line of its own, without an entry in the legend.
        series.extend(spreads().map(|(i, spread)| Series {
            label: String::new(),
            colour: k,
            kind: SeriesKind::Line {
                points: vec![(spread.p05, y(i)), (spread.p95, y(i))],
                stroke: Stroke::Solid,
            },
        }));
        let medians = spreads().map(|(i, spread)| (spread.median, y(i))).collect();
        series.push(points(shown.label.clone(), k, medians, [Marker::Circle, Marker::Square][k % 2]));
        let limits: Vec<(f64, f64)> =
            arms.iter().enumerate().filter_map(|(i, arm)| Some(((shown.limit)(arm)?, y(i)))).collect();
        if !limits.is_empty() {
            series.push(points(format!("limit, {}", shown.label), k, limits, Marker::Cross));
        }
    }
    let names = arms.iter().enumerate().map(|(i, arm)| (row(i), arm.name.clone())).collect();
    let chart = Chart {
        title: "Average errors of all arms".to_owned(),
        x: Axis::log10("average error, % of the length"),
        y: Axis::default().from_to(0.4, arms.len() as f64 + 0.6).named(names),
        series,
        height_px: (170 + 30 * arms.len()) as u32,
        ..Chart::default()
    };
    let limited = arms.iter().any(|arm| arm.limit.is_some());
    let caption = html! {
        "The average error of every arm: median over the seeds, and the range from the 5th to the 95th percentile as a bar."
        @if limited { " Crosses: the same of an estimator at the limit." }
    };
    Some(figure(number, &chart, caption))
}

/// One of the figures that arms are compared by.
struct Shown {
    label: String,
    error: fn(&ArmResults) -> Option<Spread>,
    limit: fn(&ArmResults) -> Option<f64>,
}

/// The error over all positions and in the first portion; or, where a study tells them apart, between training positions and
/// beyond them.
fn shown(report: &StudyReport) -> Vec<Shown> {
    if report.study.judging().training_span {
        let span = |label: &str, error: fn(&ArmResults) -> Option<Spread>| Shown {
            label: label.to_owned(),
            error,
            limit: |_| None,
        };
        return vec![
            span("between the training positions", |arm| {
                arm.training_span.as_ref()?.error_percent_within_training
            }),
            span("beyond them", |arm| arm.training_span.as_ref()?.error_percent_beyond_training),
        ];
    }
    let all = report.judged_portion().map(|portion| Shown {
        label: portion_in_words(portion),
        error: |arm| Some(arm.error_percent),
        limit: |arm| Some(arm.limit.as_ref()?.limit_error_percent),
    });
    let first = report.study.judging().portions.first().map(|portion| Shown {
        label: portion_in_words(*portion),
        error: |arm| Some(arm.portions.first()?.error_percent),
        limit: |arm| arm.portions.first()?.limit_error_percent,
    });
    all.into_iter().chain(first).collect()
}

fn points(label: String, colour: usize, points: Vec<(f64, f64)>, marker: Marker) -> Series {
    Series { label, colour, kind: SeriesKind::Points { points, marker } }
}

/// The layouts of all arms, each once, with the arms that have it.
pub(super) fn layouts<'a>(report: &StudyReport<'a>) -> Vec<(Vec<&'a str>, &'a Layout)> {
    let mut layouts: Vec<(Vec<&str>, &Layout)> = Vec::new();
    let places = |layout: &Layout| -> Vec<_> {
        layout.sensors.iter().map(|sensor| (sensor.kind, sensor.position)).collect()
    };
    for arm in &report.study.study.arms {
        let layout = &arm.rig.bench.layout;
        match layouts.iter_mut().find(|(_, other)| places(other) == places(layout)) {
            Some((arms, _)) => arms.push(&arm.name),
            None => layouts.push((vec![&arm.name], layout)),
        }
    }
    layouts
}

/// Where the layouts have their sensors; nothing where all arms have one layout.
pub(super) fn layouts_figure(report: &StudyReport, number: usize) -> Option<Figure> {
    let layouts = layouts(report);
    let row = |arms: &[&str]| match arms {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [first, others @ ..] => format!("{first} + {}", others.len()),
    };
    let rows: Vec<(String, &Layout)> = layouts.iter().map(|(arms, layout)| (row(arms), *layout)).collect();
    (rows.len() > 1).then(|| {
        let chart = sites_chart(&rows, report.length_m(), Vec::new());
        let caption =
            html! { "The sensors of every layout, a row each; “+ 2” are two more arms with the same." };
        figure(number, &chart, caption)
    })
}

/// Errors along the surface: a figure for the arms that share a title, and one for each that has none.
pub(super) fn along_the_surface(report: &StudyReport, first_number: usize) -> Vec<Figure> {
    let mut groups: Vec<(Option<&str>, Vec<&Arm>)> = Vec::new();
    let run = report.results.arms.iter().filter_map(|arm| report.arm(&arm.name));
    for arm in run {
        let title = arm.figure.as_deref();
        match groups.iter_mut().find(|(other, _)| title.is_some() && *other == title) {
            Some((_, arms)) => arms.push(arm),
            None => groups.push((title, vec![arm])),
        }
    }
    let drawn = groups.iter().enumerate().filter_map(|(colour, (title, arms))| match (title, &arms[..]) {
        (None, [arm]) => single(report, arm, colour),
        (title, arms) => shared(report, title.unwrap_or_default(), arms),
    });
    drawn.enumerate().map(|(i, (chart, caption))| figure(first_number + i, &chart, caption)).collect()
}

fn single(report: &StudyReport, arm: &Arm, colour: usize) -> Option<(Chart, maud::Markup)> {
    let outcome = report.outcome(&arm.name)?;
    let seeds = outcome.fits.len();
    let title = format!("Location error of {}", arm.name);
    let label = if seeds == 1 { "its seed" } else { "median, and 5–95 % of the seeds" };
    let drawn = Drawn { arm: &arm.name, label, colour };
    let (chart, limit) = if arm.rig.bench.force_n.is_some() {
        let chart = error_chart(report, &title, &[drawn])?;
        let words = limit_in_words(&chart);
        (chart, words)
    } else {
        let limit = limit_of(arm, 6, "limit: what physics allows");
        let words = limit.as_ref().map_or("", |_| " Black dashes: the limit for a force that is not known.");
        let series = errors(report, drawn, true).into_iter().chain(limit).collect();
        (error_chart_of(report, &title, series), words.to_owned())
    };
    let caption = html! {
        "Location error of " b { (arm.name) } " by load position, over " (counted(seeds, "seed", "seeds")) "." (limit)
    };
    Some((chart, caption))
}

fn shared(report: &StudyReport, title: &str, arms: &[&Arm]) -> Option<(Chart, maud::Markup)> {
    let bands = arms.len() <= MOST_BANDS;
    let mut series: Vec<Series> = arms
        .iter()
        .enumerate()
        .flat_map(|(colour, arm)| errors(report, Drawn { arm: &arm.name, label: &arm.name, colour }, bands))
        .collect();
    let limits: Vec<Series> =
        arms.iter().enumerate().filter_map(|(colour, arm)| limit_of(arm, colour, "")).collect();
    let limited = !limits.is_empty();
    series.extend(limits);
    if series.is_empty() {
        return None;
    }
    let names: Vec<&str> = arms.iter().map(|arm| arm.name.as_str()).collect();
    let caption = html! {
        "Location error by load position of " (listed(&names)) ": medians over the seeds"
        @if bands { ", and the range from the 5th to the 95th percentile" }
        "."
        @if limited { " Dashes: the limit of each." }
    };
    Some((Chart { height_px: 480, ..error_chart_of(report, title, series) }, caption))
}

fn errors(report: &StudyReport, drawn: Drawn, bands: bool) -> Vec<Series> {
    let Some(outcome) = report.outcome(drawn.arm) else { return Vec::new() };
    let along = along(outcome, |located| located.error_m() * 1e3);
    banded(drawn, &along, if bands { outcome.fits.len() } else { 1 })
}

fn limit_of(arm: &Arm, colour: usize, label: &str) -> Option<Series> {
    let bench = &arm.rig.bench;
    let force_n = bench.force_n.or(arm.rig.pressed_bench().force_n)?;
    limit_line_of_arm(bench, force_n, colour, label.to_owned())
}

fn figure(number: usize, chart: &Chart, caption: maud::Markup) -> Figure {
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(chart), caption }
}
