//! The report of any study: its arms, and how far off they are along the surface.

use maud::{Markup, html};

use super::limit_line::limit_in_words;
use super::numbers::{counted, mm, number};
use super::page::{Figure, Figures, Page, Section};
use super::study_parts::{Drawn, arms_table, error_chart, footer, glossary, run_table};
use super::{ReportError, ReportFile, chart_to_svg};
use crate::study::{ArmOutcome, ArmResults, PreparedStudy, RunFacts, StudyResults};

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
    let figures = Figures(figures(report));
    let section = |id, heading, body| Section { id, heading, body };
    let page = Page {
        title: format!("Study {}", report.run.study),
        opening: summary(report),
        sections: vec![
            section("arms", "All arms", arms_table(report, 1)),
            section("errors", "Errors along the surface", figures.show_all()),
            section("words", "What the words mean", glossary(report)),
            section("run", "The run", run_table(report, 2)),
        ],
        footer: footer(report),
    };
    page.into_files(figures)
}

fn figures(report: &StudyReport) -> Vec<Figure> {
    let drawn = report.results.arms.iter().enumerate().filter_map(|(i, arm)| {
        let title = format!("Location error of {}", arm.name);
        let label = if arm.seeds == 1 { "its seed" } else { "median, and 5–95 % of the seeds" };
        let chart = error_chart(report, &title, &[Drawn { arm: &arm.name, label, colour: i }])?;
        let caption = html! {
            "Location error of " b { (arm.name) } " by load position, over "
            (counted(arm.seeds, "seed", "seeds")) "." (limit_in_words(&chart))
        };
        Some(Figure { number: i + 1, alternative: title, svg: chart_to_svg(&chart), caption })
    });
    drawn.collect()
}

fn summary(report: &StudyReport) -> Markup {
    let arms = report.results.arms.len();
    let positions = report.study.judging().positions.len();
    html! {
        div.summary {
            ul {
                li {
                    (counted(report.networks(), "network", "networks")) " trained: "
                    (counted(arms, "arm", "arms")) ", " (report.seeds_in_words()) " each. Every network was asked for "
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
