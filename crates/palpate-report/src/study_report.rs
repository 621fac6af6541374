//! The report of any study: its arms side by side, their layouts, and how far off they are along the surface.

use maud::{Markup, html};

use super::bench_figures::{row_axis, row_height, sites_chart};
use super::error_lines::{limit_in_words, limit_line_of_arm};
use super::numbers::{counted, listed, mm, number, stretch};
use super::page::{Figure, Page, ReportFile, Section, Table, text, wide};
use super::study_parts::{
    ArmLine, arms_table, chart_of_errors, error_chart, errors, glossary, run_table, source,
};
use super::{Axis, Chart, Marker, Series};
use palpate_estimators::evaluation::Quantiles;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_studies::{Arm, ArmOutcome, ArmResults, PreparedStudy, RunFacts, StudyResults};

/// So many arms are told apart in a table; more are also drawn side by side.
const FEW_ARMS: usize = 3;
/// So many bands may lie over each other in a figure.
const MOST_BANDS: usize = 2;
/// Markers of an arm stand this far beside each other, in rows.
const BESIDE: f64 = 0.22;

/// What a study's report is made from.
#[derive(Clone, Copy, Debug)]
pub struct StudyReport<'a> {
    /// The study.
    pub study: &'a PreparedStudy,
    /// Every fit, by arm; arms may be missing.
    pub outcomes: &'a [ArmOutcome],
    /// The figures of those outcomes.
    pub results: &'a StudyResults,
    /// How the study was run.
    pub run: &'a RunFacts,
}

/// Reports any study: `report.html`, one self-contained page, and its figures as SVG files.
pub fn study_report(report: &StudyReport) -> Vec<ReportFile> {
    let layouts = layouts(report);
    let mut sections =
        vec![Section::new("arms", "All arms").figures(overview(report)).table(arms_table(report))];
    if layouts.len() > 1 {
        let section = Section::new("layouts", "The layouts").figure(layouts_figure(report, &layouts));
        sections.push(section.table(layouts_table(&layouts, Extent::Line { length_m: report.length_m() })));
    }
    sections.extend([
        Section::new("errors", "Errors along the surface").figures(along_the_surface(report)),
        Section::new("words", "What the words mean").text(glossary(report)),
        Section::new("run", "The run").table(run_table(report)),
    ]);
    Page::new(format!("Study {}", report.run.study), summary(report), sections)
        .with_source(source(report))
        .files()
}

fn summary(report: &StudyReport) -> Markup {
    let arms = report.results.arms.len();
    let positions = report.study.judging().positions.len();
    let [one, many] = report.noun();
    html! {
        li {
            (counted(report.networks(), one, many)) (if one == "network" { " trained: " } else { " fitted: " })
            (counted(arms, "arm", "arms")) ", " (report.seeds_in_words()) " each. Every " (one) " was asked for "
            (counted(positions, "contact position", "contact positions")) "."
        }
        @if let Some(sentence) = report.not_converged() { li { (sentence) } }
        @if let Some(best) = least_error(report) { li { (best) } }
        @if let Some(best) = longest(report) { li { (best) } }
    }
}

/// The arm with the smallest average error, in words.
pub(super) fn least_error(report: &StudyReport) -> Option<Markup> {
    let median = |arm: &&ArmResults| arm.error_percent.median;
    let best = report.results.arms.iter().min_by(|a, b| median(a).total_cmp(&median(b)))?;
    let percent = median(&best);
    let error_mm = number(percent / 100.0 * report.length_m() * 1e3);
    Some(html! {
        "Smallest average error: " b { (best.name) } ", " (number(percent)) " % of the length, or "
        (error_mm) " mm (median)."
    })
}

/// The arm with the largest effective length, in words.
pub(super) fn longest(report: &StudyReport) -> Option<Markup> {
    let median = |arm: &&ArmResults| arm.effective_length_percent.median;
    let best = report.results.arms.iter().max_by(|a, b| median(a).total_cmp(&median(b)))?;
    let tolerance = mm(report.study.judging().tolerance_m);
    Some(html! {
        "Largest effective length: " b { (best.name) } ", which is within " (tolerance) " mm on "
        (number(median(&best))) " % of the surface (median)."
    })
}

/// The average errors of all arms, a row each, where there are more than a few.
fn overview(report: &StudyReport) -> Option<Figure> {
    let arms = &report.results.arms;
    if arms.len() <= FEW_ARMS {
        return None;
    }
    let mut series = Vec::new();
    for (k, figure) in compared(report).into_iter().enumerate() {
        let y = |i: usize| row_height(arms.len(), i) + BESIDE * (0.5 - k as f64);
        let spreads = || arms.iter().enumerate().filter_map(|(i, arm)| Some((i, (figure.error)(arm)?)));
        // A range over the seeds is a line of its own, without an entry in the legend.
        series.extend(
            spreads().map(|(i, spread)| Series::line("", k, vec![(spread.p05, y(i)), (spread.p95, y(i))])),
        );
        let medians = spreads().map(|(i, spread)| (spread.median, y(i))).collect();
        let marker = [Marker::Circle, Marker::Square][k % 2];
        series.push(Series::markers(&figure.label, k, medians, marker));
        let limits: Vec<(f64, f64)> =
            arms.iter().enumerate().filter_map(|(i, arm)| Some(((figure.limit)(arm)?, y(i)))).collect();
        if !limits.is_empty() {
            series.push(Series::markers(format!("limit, {}", figure.label), k, limits, Marker::Cross));
        }
    }
    let names: Vec<&str> = arms.iter().map(|arm| arm.name.as_str()).collect();
    let x = Axis::log10("average error, % of the length");
    let chart = Chart::new("Average errors of all arms", x, row_axis(&names), series)
        .with_height((170 + 30 * arms.len()) as u32);
    let limited = arms.iter().any(|arm| arm.limit.is_some());
    let caption = html! {
        "The average error of every arm: median over the seeds, and the range from the 5th to the 95th percentile as a bar."
        @if limited { " Crosses: the same of an estimator at the limit." }
    };
    Some(Figure::chart(&chart, caption))
}

/// A figure that arms are compared by.
struct Compared {
    label: String,
    error: fn(&ArmResults) -> Option<Quantiles>,
    limit: fn(&ArmResults) -> Option<f64>,
}

/// The error over all positions and in the first portion; or, where a study tells them apart, between training positions and
/// beyond them.
fn compared(report: &StudyReport) -> Vec<Compared> {
    if report.study.judging().training_span {
        let span = |label: &str, error: fn(&ArmResults) -> Option<Quantiles>| Compared {
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
    let all = report.judged_portion().map(|portion| Compared {
        label: stretch(portion),
        error: |arm| Some(arm.error_percent),
        limit: |arm| Some(arm.limit.as_ref()?.limit_error_percent),
    });
    let first = report.study.judging().portions.first().map(|portion| Compared {
        label: stretch(*portion),
        error: |arm| Some(arm.portions.first()?.error_percent),
        limit: |arm| arm.portions.first()?.limit_error_percent,
    });
    all.into_iter().chain(first).collect()
}

/// The layouts of all arms, each once, with the arms that have it.
fn layouts<'a>(report: &StudyReport<'a>) -> Vec<(Vec<&'a str>, &'a Layout)> {
    let mut layouts: Vec<(Vec<&str>, &Layout)> = Vec::new();
    let places = |layout: &Layout| -> Vec<_> {
        layout.sensors().iter().map(|sensor| (sensor.kind, sensor.position)).collect()
    };
    for arm in &report.study.study.arms {
        let layout = &arm.rig.setup.layout;
        match layouts.iter_mut().find(|(_, other)| places(other) == places(layout)) {
            Some((arms, _)) => arms.push(&arm.name),
            None => layouts.push((vec![&arm.name], layout)),
        }
    }
    layouts
}

/// Where the layouts have their sensors.
fn layouts_figure(report: &StudyReport, layouts: &[(Vec<&str>, &Layout)]) -> Figure {
    let row = |arms: &[&str]| match arms {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [first, others @ ..] => format!("{first} + {}", others.len()),
    };
    let rows: Vec<(String, &Layout)> = layouts.iter().map(|(arms, layout)| (row(arms), *layout)).collect();
    let caption = html! { "The sensors of every layout, a row each; “+ 2” are two more arms with the same." };
    Figure::chart(&sites_chart(&rows, report.length_m(), Vec::new()), caption)
}

/// Which arms have which layout.
fn layouts_table(layouts: &[(Vec<&str>, &Layout)], extent: Extent) -> Table {
    let rows = layouts
        .iter()
        .map(|(arms, layout)| vec![text(arms.join(", ")), text(layout.places_in_words(extent))]);
    Table::new([wide("arms"), wide("sensors")], rows, html! { "Where the sensors of every arm sit." })
}

/// Errors along the surface: a figure for the arms that share a title, and one for each that has none.
fn along_the_surface(report: &StudyReport) -> Vec<Figure> {
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
    drawn.collect()
}

fn single(report: &StudyReport, arm: &Arm, colour: usize) -> Option<Figure> {
    let seeds = report.outcome(&arm.name)?.fits.len();
    let title = format!("Location error of {}", arm.name);
    let label = if seeds == 1 { "its seed" } else { "median, and 5–95 % of the seeds" };
    let line = ArmLine { arm: &arm.name, label, colour };
    let (chart, limit) = if arm.rig.setup.force_n.is_some() {
        let chart = error_chart(report, &title, &[line])?;
        let words = limit_in_words(&chart);
        (chart, words)
    } else {
        let limit = limit_of(arm, 6, "limit: what physics allows");
        let words = limit.as_ref().map_or("", |_| " Black dashes: the limit for a force that is not known.");
        let series = errors(report, &line, true).into_iter().chain(limit).collect();
        (chart_of_errors(report, &title, series), words.to_owned())
    };
    let caption = html! {
        "Location error of " b { (arm.name) } " by load position, over " (counted(seeds, "seed", "seeds")) "." (limit)
    };
    Some(Figure::chart(&chart, caption))
}

fn shared(report: &StudyReport, title: &str, arms: &[&Arm]) -> Option<Figure> {
    let bands = arms.len() <= MOST_BANDS;
    let drawn = |(colour, arm): (usize, &&Arm)| {
        errors(report, &ArmLine { arm: &arm.name, label: &arm.name, colour }, bands)
    };
    let mut series: Vec<Series> = arms.iter().enumerate().flat_map(drawn).collect();
    let errors = series.len();
    series.extend(arms.iter().enumerate().filter_map(|(colour, arm)| limit_of(arm, colour, "")));
    if series.is_empty() {
        return None;
    }
    let limited = series.len() > errors;
    let names: Vec<&str> = arms.iter().map(|arm| arm.name.as_str()).collect();
    let caption = html! {
        "Location error by load position of " (listed(&names)) ": medians over the seeds"
        @if bands { ", and the range from the 5th to the 95th percentile" }
        "."
        @if limited { " Dashes: the limit of each." }
    };
    Some(Figure::chart(&chart_of_errors(report, title, series).with_height(480), caption))
}

fn limit_of(arm: &Arm, colour: usize, label: &str) -> Option<Series> {
    let setup = &arm.rig.setup;
    limit_line_of_arm(setup, setup.force_n.or(arm.rig.pressed_setup().force_n)?, colour, label)
}
