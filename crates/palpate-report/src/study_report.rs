//! Report of any study; parts are shared with the paper's report.

use maud::{Markup, html};

use super::bench_figures::{row_axis, row_height, sites_chart};
use super::error_lines::{banded, limit_in_words, limit_line_of_arm, limit_line_or_assumed, tolerance_mark};
use super::numbers::{NOTHING, counted, listed, mm, number, stretch, whole};
use super::page::{Figure, Page, ReportFile, Section, Table, text};
use super::{Axis, Chart, Marker, Series};
use palpate_estimators::evaluation::{EvaluatedContact, Portion, Quantiles};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_studies::{Arm, ArmOutcome, ArmResults, PreparedStudy, RunFacts, StudyResults};

/// Arms that a table alone distinguishes.
const FEW_ARMS: usize = 3;
const MOST_BANDS: usize = 2;
/// In rows.
const BESIDE: f64 = 0.22;

/// Contents of the report.
#[derive(Clone, Copy, Debug)]
pub struct StudyReport<'a> {
    /// Study.
    pub study: &'a PreparedStudy,
    /// Fits by arm; arms may be missing.
    pub outcomes: &'a [ArmOutcome],
    /// Results of these outcomes.
    pub results: &'a StudyResults,
    /// Facts of the run.
    pub run: &'a RunFacts,
}

/// `report.html` and SVG figures.
pub fn study_report(report: &StudyReport) -> Vec<ReportFile> {
    let layouts = layouts(report);
    let mut sections =
        vec![Section::new("arms", "All arms").figures(overview(report)).table(arms_table(report))];
    if let (Some(extent), [_, _, ..]) = (report.extent(), layouts.as_slice()) {
        let section = Section::new("layouts", "The layouts").figure(layouts_figure(report, &layouts));
        sections.push(section.table(layouts_table(&layouts, extent)));
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
    let positions = report.study.evaluation_settings().positions.len();
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

pub(super) fn longest(report: &StudyReport) -> Option<Markup> {
    let median = |arm: &&ArmResults| arm.effective_length_percent.median;
    let best = report.results.arms.iter().max_by(|a, b| median(a).total_cmp(&median(b)))?;
    let tolerance = mm(report.study.evaluation_settings().tolerance_m);
    Some(html! {
        "Largest effective length: " b { (best.name) } ", which is within " (tolerance) " mm on "
        (number(median(&best))) " % of the surface (median)."
    })
}

/// Average errors of the arms; `None` for a few arms.
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

struct ComparisonRow {
    label: String,
    error: fn(&ArmResults) -> Option<Quantiles>,
    limit: fn(&ArmResults) -> Option<f64>,
}

/// Over all positions and in the first portion, or between and beyond training positions.
fn compared(report: &StudyReport) -> Vec<ComparisonRow> {
    if report.study.evaluation_settings().training_span {
        let span = |label: &str, error: fn(&ArmResults) -> Option<Quantiles>| ComparisonRow {
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
    let all = report.evaluated_portion().map(|portion| ComparisonRow {
        label: stretch(portion),
        error: |arm| Some(arm.error_percent),
        limit: |arm| Some(arm.limit.as_ref()?.limit_error_percent),
    });
    let first = report.study.evaluation_settings().portions.first().map(|portion| ComparisonRow {
        label: stretch(*portion),
        error: |arm| Some(arm.portions.first()?.error_percent),
        limit: |arm| arm.portions.first()?.limit_error_percent,
    });
    all.into_iter().chain(first).collect()
}

fn layouts<'a>(report: &StudyReport<'a>) -> Vec<(Vec<&'a str>, &'a Layout)> {
    let mut layouts: Vec<(Vec<&str>, &Layout)> = Vec::new();
    let places = |layout: &Layout| -> Vec<_> {
        layout.sensors().iter().map(|sensor| (sensor.kind, sensor.position)).collect()
    };
    for arm in &report.study.study.arms {
        let layout = arm.rig.setup.layout();
        match layouts.iter_mut().find(|(_, other)| places(other) == places(layout)) {
            Some((arms, _)) => arms.push(&arm.name),
            None => layouts.push((vec![&arm.name], layout)),
        }
    }
    layouts
}

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

fn layouts_table(layouts: &[(Vec<&str>, &Layout)], extent: Extent) -> Table {
    Table::from_rows(layouts)
        .wide("arms", |(arms, _)| arms.join(", "))
        .wide("sensors", |(_, layout)| layout.places_in_words(extent))
        .caption(html! { "Where the sensors of every arm sit." })
}

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
    let (chart, limit) = if arm.rig.setup.force_n().is_some() {
        let chart = error_chart(report, &title, &[line])?;
        let words = limit_in_words(&chart);
        (chart, words)
    } else {
        let limit = limit_of(arm, 6, "limit: what physics allows");
        let words = limit
            .as_ref()
            .map_or("", |_| " Dashes without a colour: the limit for a force that is not known.");
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
    limit_line_of_arm(setup, setup.force_n().or(arm.rig.training_setup().ok()?.force_n())?, colour, label)
}

#[derive(Clone, Copy)]
pub(crate) struct ArmLine<'a> {
    pub arm: &'a str,
    pub label: &'a str,
    pub colour: usize,
}

impl<'a> StudyReport<'a> {
    pub(crate) fn outcome(&self, arm: &str) -> Option<&'a ArmOutcome> {
        self.outcomes.iter().find(|outcome| outcome.name == arm && !outcome.fits.is_empty())
    }

    pub(crate) fn arm(&self, name: &str) -> Option<&'a Arm> {
        self.study.study.arms.iter().find(|arm| arm.name == name)
    }

    /// Networks, or locators if some arm has another estimator; singular and plural.
    pub(crate) fn noun(&self) -> [&'static str; 2] {
        let trained = self.results.arms.iter().all(|arm| arm.epochs.is_some());
        if trained { ["network", "networks"] } else { ["locator", "locators"] }
    }

    pub(crate) fn networks(&self) -> usize {
        self.results.arms.iter().map(|arm| arm.seeds).sum()
    }

    /// "25 seeds", or "3 to 25 seeds" if the arms differ.
    pub(crate) fn seeds_in_words(&self) -> String {
        let seeds = self.results.arms.iter().map(|arm| arm.seeds);
        match (seeds.clone().min(), seeds.max()) {
            (Some(fewest), Some(most)) if fewest < most => {
                format!("{} to {}", whole(fewest as f64), counted(most, "seed", "seeds"))
            }
            (_, most) => counted(most.unwrap_or(0), "seed", "seeds"),
        }
    }

    pub(crate) fn evaluated_portion(&self) -> Option<Portion> {
        let positions = &self.study.evaluation_settings().positions;
        Some(Portion { from_m: positions.first()?.x_m, to_m: positions.last()?.x_m })
    }

    fn extent(&self) -> Option<Extent> {
        Some(self.study.study.arms.first()?.rig.setup.surface().extent().along_x())
    }

    pub(crate) fn length_m(&self) -> f64 {
        self.extent().map_or(f64::NAN, |extent| extent.length_m())
    }

    pub(crate) fn not_converged(&self) -> Option<String> {
        let trained = || self.results.arms.iter().filter(|arm| arm.converged.is_some());
        let left: usize = trained().map(|arm| arm.seeds - arm.converged.unwrap_or(arm.seeds)).sum();
        let networks: usize = trained().map(|arm| arm.seeds).sum();
        (left > 0).then(|| {
            format!(
                "{} of {} did not converge; their figures are counted with the others.",
                whole(left as f64),
                counted(networks, "network", "networks")
            )
        })
    }
}

/// Over an arm's seeds, by position in mm.
pub(crate) fn quantiles_by_position(
    outcome: &ArmOutcome,
    figure: impl Fn(&EvaluatedContact) -> f64,
) -> Vec<(f64, Quantiles)> {
    outcome.by_position(figure).into_iter().map(|(x_m, spread)| (x_m * 1e3, spread)).collect()
}

/// In mm; empty without a fit.
pub(crate) fn errors(report: &StudyReport, line: &ArmLine, with_band: bool) -> Vec<Series> {
    let Some(outcome) = report.outcome(line.arm) else { return Vec::new() };
    let along = quantiles_by_position(outcome, |located| located.error_m() * 1e3);
    banded(line.label, line.colour, &along, with_band && outcome.fits.len() > 1)
}

/// In mm, with the limit of the first arm; `None` without a fit.
pub(crate) fn error_chart(report: &StudyReport, title: &str, arms: &[ArmLine]) -> Option<Chart> {
    let mut series: Vec<Series> = arms.iter().flat_map(|line| errors(report, line, true)).collect();
    if series.is_empty() {
        return None;
    }
    series.extend(arms.iter().find_map(|line| limit_line_or_assumed(&report.arm(line.arm)?.rig.setup)));
    Some(chart_of_errors(report, title, series))
}

pub(crate) fn chart_of_errors(report: &StudyReport, title: &str, series: Vec<Series>) -> Chart {
    let length_mm = report.length_m() * 1e3;
    let x = Axis::linear("load position, mm").from_to(0.0, length_mm);
    let y = Axis::log10("location error, mm").from_to(LEAST_ERROR_MM, length_mm);
    Chart::new(title, x, y, series)
        .with_marks(vec![tolerance_mark(report.study.evaluation_settings().tolerance_m)])
}

/// Errors cross zero, which a logarithmic axis cannot show.
const LEAST_ERROR_MM: f64 = 0.05;

/// Empty columns are omitted.
pub(crate) fn arms_table(report: &StudyReport) -> Table {
    let arms = &report.results.arms;
    let mut table = Table::from_rows(arms.iter().enumerate()).short("arm", |(_, arm)| arm.name.clone());
    for ArmColumn { heading, cells } in arm_columns(report) {
        if cells.iter().any(Option::is_some) {
            let cell = |i: usize| cells[i].clone().unwrap_or_else(|| text(NOTHING));
            table = table.column("number", heading, |(i, _)| cell(*i));
        }
    }
    table.caption(html! {
        "Every arm: median over the seeds, and beneath it the range from the 5th to the 95th percentile. Errors are in % \
         of the surface's length."
    })
}

struct ArmColumn {
    heading: String,
    cells: Vec<Option<Markup>>,
}

fn arm_columns(report: &StudyReport) -> Vec<ArmColumn> {
    let column = |heading: &str, cell: &dyn Fn(&ArmResults) -> Option<Markup>| ArmColumn {
        heading: heading.to_owned(),
        cells: report.results.arms.iter().map(cell).collect(),
    };
    let spread = |heading: &str, of: &dyn Fn(&ArmResults) -> Option<Quantiles>| {
        column(heading, &|arm| Some(stacked(of(arm)?, number)))
    };
    let judging = report.study.evaluation_settings();
    let in_words = |portion: &Portion| without_line_breaks(&stretch(*portion));
    let all = report.evaluated_portion().map(|portion| in_words(&portion));
    let portions: Vec<String> = judging.portions.iter().map(in_words).collect();

    let mut columns = vec![
        column("seeds converged", &|arm| {
            let converged = whole(arm.converged? as f64);
            Some(text(format!("{converged} of {}", whole(arm.seeds as f64))))
        }),
        column("iterations", &|arm| Some(stacked(arm.epochs?, whole))),
    ];
    columns.extend(
        all.iter().map(|all| spread(&format!("average error, {all}, %"), &|arm| Some(arm.error_percent))),
    );
    columns.extend(portions.iter().enumerate().map(|(i, portion)| {
        let heading = format!("average error, {portion}, %");
        spread(&heading, &|arm| Some(arm.portions.get(i)?.error_percent))
    }));
    columns.extend([
        column("training positions, mm", &|arm| {
            let span = stretch(arm.training_span.as_ref()?.training_span);
            Some(text(without_line_breaks(span.trim_end_matches(" mm"))))
        }),
        spread("average error between them, %", &|arm| {
            arm.training_span.as_ref()?.error_percent_within_training
        }),
        spread("beyond them, %", &|arm| arm.training_span.as_ref()?.error_percent_beyond_training),
        spread("largest error, %", &|arm| Some(arm.max_error_percent)),
        spread(&format!("effective length, {} mm, %", mm(judging.tolerance_m)), &|arm| {
            Some(arm.effective_length_percent)
        }),
    ]);
    columns.extend(all.iter().map(|all| {
        let heading = format!("limit's average error, {all}, %");
        column(&heading, &|arm| Some(text(number(arm.limit.as_ref()?.limit_error_percent))))
    }));
    columns.extend(portions.iter().enumerate().map(|(i, portion)| {
        let heading = format!("limit's, {portion}, %");
        column(&heading, &|arm| Some(text(number(arm.portions.get(i)?.limit_error_percent?))))
    }));
    columns.extend([
        spread("error over the limit's", &|arm| arm.limit.as_ref()?.error_over_limit),
        spread("coverage of 95 % intervals, %", &|arm| arm.coverage_percent),
    ]);
    columns
}

/// Median above its range.
fn stacked(spread: Quantiles, shown: fn(f64) -> String) -> Markup {
    let [median, low, high] = [spread.median, spread.p05, spread.p95].map(shown);
    html! { (median) @if low != median || high != median { span.range { (low) "–" (high) } } }
}

fn without_line_breaks(text: &str) -> String {
    text.replace(' ', "\u{a0}").replace('–', "\u{2060}–\u{2060}")
}

pub(crate) fn run_table(report: &StudyReport) -> Table {
    let run = report.run;
    let mut facts = vec![
        ("palpate", run.palpate.to_owned()),
        ("study", run.study.clone()),
        ("seeds of each arm", counted_seeds(run.seeds)),
        ("threads", whole(run.threads as f64)),
        ("width of the numbers", format!("{:?}", run.precision).to_lowercase()),
        ("arithmetic", run.arithmetic.clone()),
        ("time of the fits", format!("{} s", number(run.seconds))),
    ];
    if let Some(shards) = run.shards {
        facts.insert(3, ("shards", format!("{}; threads are of each, times are sums", whole(shards as f64))));
    }
    if run.presentations > 0 {
        facts.push(("patterns presented in this run", whole(run.presentations as f64)));
        facts.push(("patterns presented per second", whole(run.presentations_per_second)));
    }
    Table::from_rows(facts)
        .words("fact", |(name, _)| *name)
        .words("value", |(_, value)| value.clone())
        .caption(
            html! { "The run. Networks that an earlier run had left are not among the patterns presented." },
        )
}

fn counted_seeds(seeds: u64) -> String {
    match seeds {
        0 | 1 => whole(seeds as f64),
        _ => format!("{}, numbered 0 to {}", whole(seeds as f64), whole((seeds - 1) as f64)),
    }
}

pub(crate) fn source(report: &StudyReport) -> Markup {
    let run = report.run;
    html! {
        " from the study " code { (run.study) } ", SHA-256 " code { (run.study_sha256) } ", " (report.seeds_in_words())
        " of each arm, seeds from 0"
    }
}

pub(crate) fn glossary(report: &StudyReport) -> Markup {
    let tolerance = mm(report.study.evaluation_settings().tolerance_m);
    html! {
        dl {
            dt { "Training positions" }
            dd {
                "The contact positions of the readings that a "
                (report.noun()[0]) " is " (if report.noun()[0] == "network" { "trained on" } else { "fitted to" }) "."
            }
            dt { "Percentage error" }
            dd { "The distance between the true and the estimated position, in % of the surface's length." }
            dt { "Effective length" }
            dd { "The share of the surface where the estimate is within " (tolerance) " mm of the truth." }
            @if report.results.arms.iter().any(|arm| arm.epochs.is_some()) {
                dt { "Iteration" }
                dd { "One epoch: every training position shown to the network once." }
            }
            @if report.results.arms.iter().any(|arm| arm.limit.is_some()) {
                dt { "Limit" }
                dd {
                    "The mean error of the best unbiased estimator for the noise of these readings (Cramér–Rao bound). Where \
                     readings hardly determine the position, the contact is still known to lie on the surface; the limit's \
                     average includes this. Error over the limit's: at contacts with a limit of at most 1/200 of the length, \
                     not at the very ends."
                }
            }
            @if report.results.arms.iter().any(|arm| arm.coverage_percent.is_some()) {
                dt { "Coverage of 95 % intervals" }
                dd {
                    "The share of 95 % intervals that contain the true position: 95 % if the estimator's uncertainty is correct."
                }
            }
            dt { "Seed" }
            dd {
                @if report.results.arms.iter().any(|arm| arm.limit.is_some()) {
                    "The number from which the noise of an arm's recording follows, and a network's random start; "
                } @else {
                    "The number from which a network's random start follows. Networks that differ only in it give different \
                     results, so "
                }
                "each figure here is the median over the seeds of its arm, with the range in which all but the \
                 lowest and the highest twentieth of them lie (5–95 %)."
            }
        }
    }
}
