//! The report of any study: its arms, and how far off they are along the surface.

use maud::{Markup, html};

use super::numbers::{counted, mm, number};
use super::page::{Figure, Figures, Page, Section, Table, text, wide};
use super::study_figures::{along_the_surface, layouts, layouts_figure, overview};
use super::study_parts::{arms_table, footer, glossary, run_table};
use super::{ReportError, ReportFile};
use palpate_studies::{ArmOutcome, ArmResults, PreparedStudy, RunFacts, StudyResults};

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

/// Reports any study: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn study_report(report: &StudyReport) -> Result<Vec<ReportFile>, ReportError> {
    let overview = overview(report, 1);
    let layouts_drawn = layouts_figure(report, 1 + usize::from(overview.is_some()));
    let before = usize::from(overview.is_some()) + usize::from(layouts_drawn.is_some());
    let mut figures: Vec<Figure> = overview.into_iter().chain(layouts_drawn).collect();
    figures.extend(along_the_surface(report, before + 1));
    let figures = Figures(figures);
    let section = |id, heading, body| Section { id, heading, body };
    let has_layouts = layouts(report).len() > 1;
    let overview_number = if has_layouts { before - 1 } else { before };
    let mut sections =
        vec![section("arms", "All arms", html! { (figures.show(overview_number)) (arms_table(report, 1)) })];
    if has_layouts {
        let body = html! { (figures.show(before)) (layouts_table(report, 2)) };
        sections.push(section("layouts", "The layouts", body));
    }
    let errors = html! { @for i in before + 1..=figures.0.len() { (figures.show(i)) } };
    let tables = if has_layouts { 3 } else { 2 };
    sections.push(section("errors", "Errors along the surface", errors));
    sections.push(section("words", "What the words mean", glossary(report)));
    sections.push(section("run", "The run", run_table(report, tables)));
    let page = Page {
        title: format!("Study {}", report.run.study),
        opening: summary(report),
        sections,
        footer: footer(report),
    };
    page.into_files(figures)
}

/// Which arms have which layout.
fn layouts_table(report: &StudyReport, table: usize) -> Markup {
    let rows = layouts(report)
        .into_iter()
        .map(|(arms, layout)| vec![text(arms.join(", ")), text(layout.places_in_words(false))]);
    Table {
        number: table,
        caption: html! { "Where the sensors of every arm sit." },
        columns: vec![wide("arms"), wide("sensors")],
        rows: rows.collect(),
    }
    .markup()
}

fn summary(report: &StudyReport) -> Markup {
    let arms = report.results.arms.len();
    let positions = report.study.judging().positions.len();
    let [one, many] = report.noun();
    html! {
        div.summary {
            ul {
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
