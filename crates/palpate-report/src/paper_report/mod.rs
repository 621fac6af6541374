//! The report of the founding paper's study, for readers who never saw the paper.

mod figures;
mod open_settings;
mod set_up;
mod tables;
mod verdicts;

use maud::{Markup, html};

use set_up::{arrangements, training};

use super::StudyReport;
use super::bench_figures::bench_figure;
use super::numbers::{counted, listed};
use super::page::{Page, ReportFile, Section};
use super::study_parts::{arms_table, glossary, run_table, source};
use super::study_report::{least_error, longest};
use palpate_estimators::evaluation::Quantiles;
use palpate_studies::paper::{Agreement, Claim, PublishedFigure, claims, published_figures};

const DOI: &str = "https://doi.org/10.5772/53567";

/// Reports the paper's study: `report.html`, one self-contained page, and its figures as SVG files.
///
/// Figures 2 to 6 and tables 1 to 3 have the paper's numbers. Arms that were not run leave out what needs them.
pub fn paper_report(report: &StudyReport) -> Vec<ReportFile> {
    let paper = Paper {
        report,
        published: published_figures(report.results),
        claims: claims(report.outcomes, report.study.judging()),
    };
    Page::new("A distributive tactile sensor, replicated", paper.summary(), paper.sections())
        .with_lead(lead())
        .with_source(source(report))
        .files()
}

/// The study with its verdicts.
struct Paper<'a> {
    report: &'a StudyReport<'a>,
    published: Vec<PublishedFigure>,
    claims: Vec<Claim>,
}

impl Paper<'_> {
    fn sections(&self) -> Vec<Section> {
        let setup = self.setup().and_then(|(rig, _, force_n)| {
            bench_figure("The bench", &rig.setup.surface, &rig.setup.layout, force_n)
        });
        vec![
            Section::new("sensor", "The sensor").text(self.sensor()).figure(setup),
            Section::new("training", "How it learns")
                .text(training())
                .table(self.even_table())
                .text(glossary(self.report)),
            Section::new("position-output", "The starting point: ten positions")
                .text(self.starting_point())
                .figure(self.predicted_against_actual())
                .table(self.portions_table()),
            Section::new("output-coding", "Two codings of the output")
                .figure(self.iterations_by_coding())
                .figure(self.error_by_coding()),
            Section::new("arrangements", "Where to press: three arrangements")
                .text(arrangements())
                .table(self.edge_dense_table())
                .figure(self.error_by_arrangement())
                .figure(self.effective_length_by_arrangement()),
            Section::new("errors", "Errors along the beam")
                .figure(self.errors_of_codings())
                .figure(self.errors_of_arrangements()),
            Section::new("published", "Published against replicated")
                .text(self.about_published())
                .table(self.published_table()),
            Section::new("claims", "The paper's claims").text(self.about_claims()).table(self.claims_table()),
            Section::new("not-replicated", "What does not replicate").text(self.not_replicated()),
            Section::new("open", "What the paper leaves open")
                .text(self.about_open())
                .table(self.open_table()),
            Section::new("arms", "All arms").table(arms_table(self.report)),
            Section::new("run", "The run").table(run_table(self.report)),
        ]
    }

    fn summary(&self) -> Markup {
        html! {
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

fn lead() -> Markup {
    html! {
        p.lead {
            "A bent beam can tell where it is touched. This page repeats, in simulation, the study with which P. \
             Tongpadungrod showed how to train a small neural network to do so, and sets every figure that the paper \
             prints beside the same figure found here: "
            cite { "Neural network training techniques for improving the performance of a distributive tactile sensor" }
            ", International Journal of Advanced Robotic Systems, " a href=(DOI) { "doi:10.5772/53567" } "."
        }
    }
}

/// Where our seeds lie.
fn ours(figure: &PublishedFigure) -> Quantiles {
    Quantiles { median: figure.median, p05: figure.p05, p95: figure.p95 }
}
