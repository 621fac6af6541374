//! The report of one locator's errors.

mod figures;
mod plane;

use maud::{Markup, html};

use super::numbers::{counted, listed, mm, number, whole};
use super::page::{Column, Figures, Page, Section, Table, numeric, short, text, words};
use super::study_parts::portion_in_words;
use super::{ReportError, ReportFile};
use palpate_estimators::estimator::Locator;
use palpate_estimators::evaluation::{ErrorSummary, Evaluation, Located, Portion, percentage_error};
use palpate_estimators::recording::Provenance;
use palpate_estimators::setup::Bench;
use palpate_mechanics::surface::SurfaceSpec;
use palpate_rig::Rig;

/// What an evaluation's report is made from.
#[derive(Clone, Copy, Debug)]
pub struct EvaluationReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// Whose answers are judged.
    pub judged: Judged<'a>,
    /// The answers.
    pub evaluation: &'a Evaluation,
    /// The recording that was located.
    pub recording: &'a Provenance,
    /// Portions of the surface that are also judged by themselves.
    pub portions: &'a [Portion],
    /// An error up to this, in metres, is good enough for the effective length.
    pub tolerance_m: f64,
}

/// Whose answers an evaluation holds.
#[derive(Clone, Copy, Debug)]
pub enum Judged<'a> {
    /// Those of a locator.
    Locator(&'a Locator),
    /// Those of locators of one rig, each fitted without the positions that it was asked for.
    CrossValidated {
        /// The rig.
        rig: &'a Rig,
        /// How many locators.
        folds: usize,
        /// The seed of their fits.
        seed: u64,
    },
}

/// Reports an evaluation: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn evaluation_report(report: &EvaluationReport) -> Result<Vec<ReportFile>, ReportError> {
    let (heading, errors) = match report.bench().surface.extent().width_m {
        Some(width_m) => ("Errors over the surface", plane::error_map(report, width_m)),
        None => ("Errors along the surface", figures::error_figure(report)),
    };
    let figures = Figures(vec![errors, figures::estimate_figure(report)]);
    let section = |id, heading, body| Section { id, heading, body };
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections: vec![
            section("errors", heading, html! { (figures.show(1)) (figures.show(2)) }),
            section("table", "Errors in numbers", report.errors_table(1)),
            section("judged", report.judged_heading(), report.facts_table(2)),
        ],
        footer: report.footer(),
    };
    page.into_files(figures)
}

impl EvaluationReport<'_> {
    fn summary(&self) -> Markup {
        let tolerance = mm(self.tolerance_m);
        let effective = self.evaluation.effective_percent(self.tolerance_m);
        html! {
            div.summary {
                ul {
                    li {
                        (counted(self.evaluation.located.len(), "reading", "readings")) " of " b { (self.recording.source) }
                        ", at " (counted(self.evaluation.by_position().len(), "position", "positions")) ", located and compared \
                         with where the contact was."
                    }
                    li { (self.whose_answers()) }
                    @if let Some(summary) = self.evaluation.summary(None) {
                        li {
                            "Average error " b { (number(summary.average_m * 1e3)) " mm" } ", "
                            (number(percentage_error(summary.average_m, self.evaluation.length_m))) " % of the length; largest "
                            (number(summary.largest_m * 1e3)) " mm."
                        }
                        li { "Within " (tolerance) " mm: " b { (number(effective)) " %" } " of the readings." }
                    }
                }
            }
        }
    }

    fn whose_answers(&self) -> String {
        match self.judged {
            Judged::CrossValidated { folds, .. } => format!(
                "Cross-validated by position in {}: each position was located by a locator that had not seen it.",
                counted(folds, "fold", "folds")
            ),
            Judged::Locator(locator) if *self.recording == locator.provenance.recording => {
                "The locator was fitted to this very recording, so the errors tell how well it remembers, not how well it \
                 would locate elsewhere."
                    .to_owned()
            }
            Judged::Locator(_) => "The locator was fitted to another recording.".to_owned(),
        }
    }

    fn bench(&self) -> &Bench {
        match self.judged {
            Judged::Locator(locator) => &locator.bench,
            Judged::CrossValidated { rig, .. } => &rig.bench,
        }
    }

    /// What the share within the tolerance is of.
    fn effective(&self) -> &'static str {
        if self.bench().surface.extent().is_plane() { "area" } else { "length" }
    }

    fn judged_heading(&self) -> &'static str {
        match self.judged {
            Judged::Locator(_) => "The locator",
            Judged::CrossValidated { .. } => "The rig",
        }
    }

    fn errors_table(&self, table: usize) -> Markup {
        let everywhere = std::iter::once(("everywhere".to_owned(), None));
        let portions = self.portions.iter().map(|portion| (portion_in_words(*portion), Some(*portion)));
        let rows = everywhere.chain(portions).filter_map(|(name, portion)| {
            Some(self.error_row(&name, portion, self.evaluation.summary(portion)?))
        });
        let in_units = |name: &str| numeric(format!("{name}, mm (%)"));
        let columns: Vec<Column> = [short("portion"), numeric("readings")]
            .into_iter()
            .chain(["average", "median", "95th percentile", "largest", "root mean square"].map(in_units))
            .chain([numeric(format!("within {} mm, %", mm(self.tolerance_m)))])
            .collect();
        Table {
            number: table,
            caption: html! {
                "Location errors in mm, and in brackets in % of the surface's length. With contacts evenly over the surface, the \
                 share within the tolerance is the effective " (self.effective()) "."
            },
            columns,
            rows: rows.collect(),
        }
        .markup()
    }

    fn error_row(&self, name: &str, portion: Option<Portion>, summary: ErrorSummary) -> Vec<Markup> {
        let both = |error_m: f64| {
            let percent = percentage_error(error_m, self.evaluation.length_m);
            format!("{} ({})", number(error_m * 1e3), number(percent))
        };
        let inside = |located: &&Located| portion.is_none_or(|portion| portion.contains(located.truth));
        let located = self.evaluation.located.iter().filter(inside).copied().collect();
        let part = Evaluation { length_m: self.evaluation.length_m, located };
        let ErrorSummary { count, average_m, median_m, p95_m, largest_m, rmse_m } = summary;
        let mut cells = vec![name.to_owned(), whole(count as f64)];
        cells.extend([average_m, median_m, p95_m, largest_m, rmse_m].map(both));
        cells.push(number(part.effective_percent(self.tolerance_m)));
        cells.iter().map(text).collect()
    }

    fn facts_table(&self, table: usize) -> Markup {
        let force = self.bench().force_n;
        let force = force.map_or("unknown".to_owned(), |force_n| format!("{} N", number(force_n)));
        let mut facts = vec![
            ("surface", text(self.surface_in_words())),
            ("sensors", text(self.sensors_in_words())),
            ("contact force", text(force)),
        ];
        facts.extend(match self.judged {
            Judged::Locator(locator) => locator_facts(locator),
            Judged::CrossValidated { rig, folds, seed } => rig_facts(rig, folds, seed),
        });
        Table {
            number: table,
            caption: html! { "What was judged, and where it comes from." },
            columns: vec![short("fact"), words("value")],
            rows: facts.into_iter().map(|(name, value)| vec![text(name), value]).collect(),
        }
        .markup()
    }

    fn surface_in_words(&self) -> String {
        let extent = self.bench().surface.extent();
        let kind = match &self.bench().surface {
            SurfaceSpec::Beam(_) => "beam".to_owned(),
            SurfaceSpec::SupportedBeam(beam) => format!("beam, {}", beam.spec().supports_in_words()),
            SurfaceSpec::Plate(_) => "plate".to_owned(),
            SurfaceSpec::Digit(_) => "flexible digit".to_owned(),
            SurfaceSpec::Measured(_) => "measured, without a model".to_owned(),
        };
        let width = extent.width_m.map_or(String::new(), |width_m| format!(" × {} mm", mm(width_m)));
        format!("{kind}, {} mm{width}", mm(extent.length_m))
    }

    fn sensors_in_words(&self) -> String {
        let names = self.bench().layout.names();
        let mut kinds: Vec<&str> = self.bench().layout.kinds().into_iter().map(|kind| kind.name()).collect();
        kinds.dedup();
        format!("{}, {}: {}", names.len(), listed(&kinds), names.join(", "))
    }

    fn footer(&self) -> Markup {
        let seed = match self.judged {
            Judged::Locator(locator) => locator.provenance.seed,
            Judged::CrossValidated { seed, .. } => seed,
        };
        html! {
            p {
                "Made by palpate " (env!("CARGO_PKG_VERSION")) " from " (self.recording.source)
                (digests(self.recording)) "; fitted from seed " (seed) "."
            }
        }
    }
}

fn locator_facts(locator: &Locator) -> Vec<(&'static str, Markup)> {
    let training = locator.training_outcome().map(|outcome| {
        ("training", text(format!("{} after {} epochs", outcome.status, whole(f64::from(outcome.epochs)))))
    });
    let fitted_to = &locator.provenance.recording;
    let mut facts = vec![("estimator", text(locator.kind()))];
    facts.extend(training);
    facts.extend([
        (
            "fitted to",
            html! { (fitted_to.source) ", " (counted(fitted_to.rows, "row", "rows")) (digests(fitted_to)) },
        ),
        ("fitted from seed", text(locator.provenance.seed.to_string())),
        ("fitted by palpate", text(&locator.provenance.palpate)),
    ]);
    facts
}

fn rig_facts(rig: &Rig, folds: usize, seed: u64) -> Vec<(&'static str, Markup)> {
    let mut facts = vec![
        ("folds", text(whole(folds as f64))),
        ("fitted from seed", text(seed.to_string())),
        ("estimator", text(rig.estimator.kind())),
    ];
    facts.extend(rig.estimator.settings().into_iter().map(|setting| (setting.name, text(setting.value))));
    facts
}

fn digests(recording: &Provenance) -> Markup {
    html! { @for digest in &recording.digests { ", SHA-256 " code { (digest) } } }
}
