//! The report of a sensor design: layouts by several methods, judged alike.

mod figures;
mod plane;

use maud::{Markup, html};

use super::numbers::{counted, mm, number, quantity, stated};
use super::page::{Figures, Page, Section, Table, numeric, short, text, wide};
use super::{ReportError, ReportFile};
use palpate_design::sensors::{
    CountPoint, Designed, Method, SensorProblem, Verification, best_design, enough,
};
use palpate_design::sensors::{DesignCriterion, Symmetry};
use palpate_estimators::setup::Bench;

/// What a sensor design's report is made from.
#[derive(Clone, Copy)]
pub struct SensorDesignReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The surface, with the rig's own sensors.
    pub bench: &'a Bench,
    /// What was designed.
    pub problem: &'a SensorProblem<'a>,
    /// The layouts.
    pub designed: &'a [Designed],
    /// What simulated calibrations say of some of them.
    pub verified: &'a [(Method, Verification)],
    /// Layouts of other numbers of sensors; empty where none were asked for.
    pub counts: &'a [CountPoint],
    /// The seed of searches and simulations.
    pub seed: u64,
}

/// Reports a design: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when the bench cannot be drawn or a figure does not become a picture.
pub fn sensor_design_report(report: &SensorDesignReport) -> Result<Vec<ReportFile>, ReportError> {
    let mut figures = Vec::new();
    // Numbered as they come: the layouts' sites along a line, the limit with the best of them, the counts.
    let limits = if let Some(width_m) = report.bench.surface.extent().width_m {
        figures.extend(plane::limit_maps(report, width_m, 1));
        1..3
    } else {
        figures.push(figures::sites_figure(report, 1));
        figures.extend(figures::bench_figure(report, 2)?);
        figures.extend(figures::limit_figure(report, 3));
        2..4
    };
    let sites = 1..limits.start;
    let counted = figures::counts_figure(report, limits.end);
    let has_counts = counted.is_some();
    let counts = limits.end;
    figures.extend(counted);
    let figures = Figures(figures);
    let shown = |numbers: std::ops::Range<usize>| html! { @for number in numbers { (figures.show(number)) } };
    let section = |id, heading, body| Section { id, heading, body };
    let mut sections = vec![
        section("layouts", "The layouts", html! { (report.table(1)) (report.places(2)) (shown(sites)) }),
        section("limit", "The limit with the best of them", shown(limits)),
    ];
    if has_counts {
        sections.push(section(
            "counts",
            "How many sensors are enough",
            html! { (report.counts_in_words()) (figures.show(counts)) },
        ));
    }
    sections.push(section("given", "What was given", report.given()));
    sections.push(section("meaning", "How layouts are found and judged", meaning()));
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections,
        footer: html! { p { "Made by palpate " (env!("CARGO_PKG_VERSION")) ", seed " (report.seed) "." } },
    };
    page.into_files(figures)
}

impl<'a> SensorDesignReport<'a> {
    fn even(&self) -> Option<&'a Designed> {
        self.designed.iter().find(|designed| designed.method == Method::Even)
    }

    fn best(&self) -> Option<&'a Designed> {
        best_design(self.designed)
    }

    fn verification(&self, method: Method) -> Option<&'a Verification> {
        self.verified.iter().find(|(of, _)| *of == method).map(|(_, verification)| verification)
    }

    fn summary(&self) -> Markup {
        let Some(best) = self.best() else { return html! {} };
        let limit = |designed: &Designed| designed.assessment.mean_limit_m.map_or(f64::NAN, |m| m * 1e3);
        let error =
            |designed: &Designed| self.verification(designed.method).map(|told| told.mean_error_m * 1e3);
        let compared = |even: f64, best: f64| {
            let percent = 100.0 * (1.0 - best / even);
            let word = if percent >= 0.0 { "below" } else { "above" };
            if percent.is_finite() {
                format!(", {} % {word} the even layout's {} mm", number(percent.abs()), number(even))
            } else {
                String::new()
            }
        };
        let even = self.even();
        html! {
            div.summary {
                ul {
                    li {
                        "Best of " (counted(self.designed.len(), "layout", "layouts")) " of "
                        (counted(best.layout.len(), "sensor", "sensors")) ": " b { (best.method.name()) } ", "
                        (best.layout.places_in_words(self.problem.is_plane())) "."
                    }
                    li {
                        "Its mean limit is " b { (number(limit(best))) " mm" }
                        @if let Some(even) = even { (compared(limit(even), limit(best))) }
                        "; force " (self.problem.force().name()) "."
                    }
                    @if let (Some(told), Some(even)) = (error(best), even.and_then(error)) {
                        li {
                            "Calibrated and asked in simulation, its locator is off by " b { (number(told)) " mm" } " on average"
                            (compared(even, told)) "."
                        }
                    }
                }
            }
        }
    }

    fn table(&self, table: usize) -> Markup {
        let design = self.problem.design();
        let scale = design.criterion.score_scale();
        let mm = |length_m: Option<f64>| text(number(length_m.map_or(f64::NAN, |length_m| length_m * 1e3)));
        let rows = self.designed.iter().map(|designed| {
            let worth = &designed.assessment;
            let star = if worth.keeps_constraints { "" } else { " *" };
            let told = self.verification(designed.method);
            let error = told.map_or("–".to_owned(), |told| {
                format!("{:.3} ± {:.3}", told.mean_error_m * 1e3, told.standard_error_m * 1e3)
            });
            let mut cells = vec![
                text(format!("{}{star}", designed.method.name())),
                text(number(worth.score * scale)),
                mm(worth.mean_limit_m),
                mm(worth.worst_limit_m),
                text(number(worth.within_tolerance_percent)),
                text(number(worth.score_one_dead.map_or(f64::NAN, |score| score * scale))),
                mm(worth.mean_error_m),
                text(error),
            ];
            if design.has_costs() {
                cells.push(text(stated(worth.cost)));
            }
            cells
        });
        let mut columns = vec![
            short("layout"),
            numeric("score"),
            numeric("mean limit, mm"),
            numeric("largest, mm"),
            numeric(format!("within {} mm, %", self::mm(design.tolerance_m))),
            numeric("one dead: score"),
            numeric("expected error, mm"),
            numeric("simulated error, mm"),
        ];
        if design.has_costs() {
            columns.push(numeric("cost"));
        }
        let broken = self.designed.iter().any(|designed| !designed.assessment.keeps_constraints);
        Table {
            number: table,
            caption: html! {
                "The layouts. Score: " (score_in_words(design.criterion)) ", the smaller the better. One dead: the worst score when \
                 any one sensor dies. Expected: the mean error of an estimator at the limit; simulated: that of a locator, \
                 calibrated with noise and asked. A dash: the readings do not tell some contact, or the layout was not simulated."
                @if broken { " *: breaks a constraint." }
            },
            columns,
            rows: rows.collect(),
        }
        .markup()
    }

    fn places(&self, table: usize) -> Markup {
        let plane = self.problem.is_plane();
        let rows = self
            .designed
            .iter()
            .map(|designed| vec![text(designed.method.name()), text(designed.layout.places_in_words(plane))]);
        Table {
            number: table,
            caption: html! { "Where their sensors sit." },
            columns: vec![short("layout"), wide("sensors")],
            rows: rows.collect(),
        }
        .markup()
    }

    fn counts_in_words(&self) -> Markup {
        html! {
            @if let (Some(count), Some(last)) = (enough(self.counts), self.counts.last()) {
                p {
                    (counted(count, "sensor comes", "sensors come")) " within 10 % of the score that "
                    (counted(last.count, "sensor has", "sensors have")) "."
                }
            }
        }
    }

    fn given(&self) -> Markup {
        let design = self.problem.design();
        let plane = self.problem.is_plane();
        let zone = |from: palpate_mechanics::contact::Position, to: palpate_mechanics::contact::Position| {
            if plane {
                format!("{}–{} × {}–{} mm", mm(from.x_m), mm(to.x_m), mm(from.y_m), mm(to.y_m))
            } else {
                format!("{}–{} mm", mm(from.x_m), mm(to.x_m))
            }
        };
        let kinds: Vec<String> = design
            .offers
            .iter()
            .map(|offer| {
                let channel = &offer.channel;
                let told = |value| quantity(value, offer.kind.dimension());
                let mut words = format!("{}, noise {}", offer.kind, told(channel.noise_sd));
                if channel.resolution > 0.0 {
                    words += &format!(", resolution {}", told(channel.resolution));
                }
                if design.has_costs() {
                    words += &format!(", cost {}", stated(offer.cost));
                }
                words
            })
            .collect();
        html! {
            ul {
                li { (counted(design.count, "sensor", "sensors")) " out of " (counted(self.problem.candidates(), "candidate", "candidates")) ": " (kinds.join("; ")) "." }
                li {
                    (counted(self.problem.contacts().len(), "contact", "contacts")) " over " (zone(design.contacts.from, design.contacts.to))
                    ", " (stated(self.problem.force_n())) " N, force " (self.problem.force().name())
                    @if !design.contacts.weights.is_empty() { ", some stretches touched more often than others" }
                    "."
                }
                @if design.spacing_m > 0.0 { li { "Sensors are at least " (mm(design.spacing_m)) " mm apart." } }
                @for kept in &design.keep_out { li { "Nothing sits within " (zone(kept.from, kept.to)) "." } }
                @if !design.must_have.is_empty() { li { (counted(design.must_have.len(), "sensor is", "sensors are")) " part of every layout." } }
                @if let Some(budget) = design.budget { li { "All together cost at most " (stated(budget)) "." } }
                @if design.symmetry == Symmetry::Wanted { li { "Layouts mirror themselves." } }
                @if design.symmetry == Symmetry::Forbidden { li { "No sensor mirrors another." } }
            }
        }
    }
}

fn score_in_words(criterion: DesignCriterion) -> &'static str {
    match criterion {
        DesignCriterion::MeanLimit => {
            "the mean limit in mm, each contact's combined with what the surface's size tells"
        }
        DesignCriterion::WorstLimit => "the largest limit in mm, combined with what the surface's size tells",
        DesignCriterion::WithinTolerance => "the share of contacts whose limit exceeds the tolerance, in %",
        DesignCriterion::DOptimality => "the mean of ½·ln det of a contact's least covariance",
    }
}

fn meaning() -> Markup {
    html! {
        p {
            "A layout is judged by the limit, the least standard deviation with which any estimator that is right on average \
             can locate a contact, over the contacts that are expected. Where the readings do not tell a contact, the limit is \
             boundless; the score combines it with what is known without any reading: that the contact is on the surface."
        }
        p {
            b { "greedy-exchange" } " adds the sensor that helps most until all are placed, then exchanges one after the other for \
             a better one until none is found, from several starts. " b { "exhaustive" } " tries every layout, where they are few. "
            b { "genetic" } " breeds layouts. " b { "refined" } " moves the best of these off the candidate sites. "
            b { "d-optimal" } " has the most information about position and force together, " b { "principal-components" }
            " reconstructs the readings at all sites best, " b { "qr-pivoting" } " takes the sites by which the strongest \
             components of the readings are told apart; these three do not look at the location error."
        }
    }
}
