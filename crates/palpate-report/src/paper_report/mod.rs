//! The report of the founding paper's study, for readers who never saw the paper.

mod figures;
mod open_settings;
mod set_up;
mod tables;
mod verdicts;

use maud::{Markup, html};

use super::numbers::{counted, listed};
use super::page::{Figures, Page, Section};
use super::study_parts::{arms_table, footer, glossary, run_table};
use super::study_report::{least_error, longest};
use super::{ReportError, ReportFile, StudyReport};
use palpate_estimators::evaluation::Spread;
use palpate_studies::paper::{Agreement, Claim, PublishedFigure, claims, published_figures};

const DOI: &str = "https://doi.org/10.5772/53567";

/// Reports the paper's study: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// Figures 2 to 6 and tables 1 to 3 have the paper's numbers. Arms that were not run leave out what needs them.
///
/// # Errors
/// [`ReportError`] when the bench cannot be drawn or a figure does not become a picture.
pub fn paper_report(report: &StudyReport) -> Result<Vec<ReportFile>, ReportError> {
    let paper = Paper {
        report,
        published: published_figures(report.results),
        claims: claims(report.outcomes, report.study.judging()),
    };
    let figures = Figures(paper.figures()?);
    let page = Page {
        title: "A distributive tactile sensor, replicated".to_owned(),
        opening: paper.summary(),
        sections: paper.sections(&figures),
        footer: footer(report),
    };
    page.into_files(figures)
}

/// The study with its verdicts.
struct Paper<'a> {
    report: &'a StudyReport<'a>,
    published: Vec<PublishedFigure>,
    claims: Vec<Claim>,
}

impl Paper<'_> {
    fn sections(&self, figures: &Figures) -> Vec<Section> {
        let section = |id, heading, body| Section { id, heading, body };
        vec![
            section("sensor", "The sensor", self.sensor(figures)),
            section(
                "training",
                "How it learns",
                html! { (self.training()) (self.even_table(1)) (glossary(self.report)) },
            ),
            section(
                "position-output",
                "The starting point: ten positions",
                html! { (self.starting_point()) (figures.show(2)) (self.portions_table(2)) },
            ),
            section(
                "output-coding",
                "Two codings of the output",
                html! { (figures.show(3)) (figures.show(4)) },
            ),
            section(
                "arrangements",
                "Where to press: three arrangements",
                html! { (self.arrangements()) (self.edge_dense_table(3)) (figures.show(5)) (figures.show(6)) },
            ),
            section("errors", "Errors along the beam", html! { (figures.show(7)) (figures.show(8)) }),
            section("published", "Published against replicated", self.published_section(4)),
            section("claims", "The paper's claims", self.claims_section(5)),
            section("not-replicated", "What does not replicate", self.not_replicated()),
            section("open", "What the paper leaves open", self.open_section(6)),
            section("arms", "All arms", arms_table(self.report, 7)),
            section("run", "The run", run_table(self.report, 8)),
        ]
    }

    fn summary(&self) -> Markup {
        html! {
            p.lead {
                "A bent beam can tell where it is touched. This page repeats, in simulation, the study with which P. \
                 Tongpadungrod showed how to train a small neural network to do so, and sets every figure that the paper \
                 prints beside the same figure found here: "
                cite { "Neural network training techniques for improving the performance of a distributive tactile sensor" }
                ", International Journal of Advanced Robotic Systems, " a href=(DOI) { "doi:10.5772/53567" } "."
            }
            div.summary {
                ul {
                    li { (self.what_was_done()) }
                    li { (self.agreement()) }
                    li { (self.claims_in_short()) }
                    @if let Some(sentence) = self.report.not_converged() { li { (sentence) } }
                    @if let Some(best) = least_error(self.report) {
                        li { (best) @if let Some(pitch) = self.sensor_pitch_mm() { " The sensors stand " (pitch) " mm apart." } }
                    }
                    @if let Some(best) = longest(self.report) { li { (best) } }
                }
            }
        }
    }

    fn what_was_done(&self) -> Markup {
        let arms = self.report.results.arms.len();
        let positions = self.report.study.judging().positions.len();
        html! {
            (counted(self.report.networks(), "network", "networks")) " trained: " (counted(arms, "arm", "arms"))
            " that differ in training positions or output coding, " (self.report.seeds_in_words())
            " each. Every network was then asked for " (counted(positions, "contact position", "contact positions")) "."
        }
    }

    fn agreement(&self) -> Markup {
        let Agreement { agreeing, of } = Agreement::among(&self.published);
        html! {
            @if of == 0 {
                "No arm with a published figure was run, so nothing is compared."
            } @else if agreeing == of {
                "All of the " a href="#published" { (counted(of, "published figure", "published figures")) }
                " with an arm here agree with the medians found here."
            } @else {
                b { (agreeing) " of " (counted(of, "published figure", "published figures")) } " "
                a href="#published" { "agree with the medians found here" } "; "
                a href="#not-replicated" { "those that do not are listed" } "."
            }
        }
    }

    fn claims_in_short(&self) -> Markup {
        let ids = |holds| {
            self.claims.iter().filter(|claim| claim.holds == holds).map(|claim| claim.id).collect::<Vec<_>>()
        };
        let (held, failed) = (ids(true), ids(false));
        html! {
            @if self.claims.is_empty() {
                "The arms that the paper's claims are about were not all run, so no claim is judged."
            } @else if failed.is_empty() {
                "Every " a href="#claims" { "claim that could be judged" } " holds in the medians: " (listed(&held)) "."
            } @else if held.is_empty() {
                "No " a href="#claims" { "claim that could be judged" } " holds in the medians as it is worded: "
                (listed(&failed)) "."
            } @else {
                "Of the paper's " a href="#claims" { "claims" } ", " (listed(&held))
                @if held.len() == 1 { " holds" } @else { " hold" } " in the medians and " (listed(&failed))
                @if failed.len() == 1 { " does" } @else { " do" } " not in every part."
            }
        }
    }

    /// The published figure of an arm with the key, beside ours.
    fn published(&self, arm: &str, key: &str) -> Option<&PublishedFigure> {
        let id = format!("{arm}.{key}");
        self.published.iter().find(|figure| figure.id == id)
    }
}

/// Where our seeds lie.
fn ours(figure: &PublishedFigure) -> Spread {
    Spread { median: figure.median, p05: figure.p05, p95: figure.p95 }
}
