//! The report of one locator's errors.

use maud::{Markup, html};

use super::numbers::{counted, listed, mm, number, whole};
use super::page::{Column, Figure, Figures, Page, Section, Table, numeric, short, text, words};
use super::study_parts::portion_in_words;
use super::{Axis, Chart, Mark, Marker, ReportError, ReportFile, Series, SeriesKind, Stroke, chart_to_svg};
use crate::estimator::Locator;
use crate::evaluation::{ErrorSummary, Evaluation, Located, Portion, percentage_error};
use crate::mechanics::SurfaceSpec;
use crate::recording::Provenance;

/// What an evaluation's report is made from.
#[derive(Clone, Copy, Debug)]
pub struct EvaluationReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The locator, or, where folds were held out, the one fitted to the whole recording.
    pub locator: &'a Locator,
    /// Its answers.
    pub evaluation: &'a Evaluation,
    /// The recording that was located.
    pub recording: &'a Provenance,
    /// Whose answers they are.
    pub answers: Answers,
    /// Portions of the surface that are also judged by themselves.
    pub portions: &'a [Portion],
    /// An error up to this, in metres, is good enough for the effective length.
    pub tolerance_m: f64,
}

/// Whose answers an evaluation holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answers {
    /// The locator's own.
    OfTheLocator,
    /// Those of locators that were each fitted without the positions that they were asked for.
    HeldOut {
        /// How many locators.
        folds: usize,
    },
}

/// Reports an evaluation: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn evaluation_report(report: &EvaluationReport) -> Result<Vec<ReportFile>, ReportError> {
    let figures = Figures(vec![report.error_figure(), report.estimate_figure()]);
    let section = |id, heading, body| Section { id, heading, body };
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections: vec![
            section("errors", "Errors along the surface", html! { (figures.show(1)) (figures.show(2)) }),
            section("table", "Errors in numbers", report.errors_table(1)),
            section("locator", "The locator", report.facts_table(2)),
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
        match self.answers {
            Answers::HeldOut { folds } => format!(
                "Cross-validated by position in {}: each position was located by a locator that had not seen it.",
                counted(folds, "fold", "folds")
            ),
            Answers::OfTheLocator if self.is_fitted_recording() => {
                "The locator was fitted to this very recording, so the errors tell how well it remembers, not how well it \
                 would locate elsewhere."
                    .to_owned()
            }
            Answers::OfTheLocator => "The locator was fitted to another recording.".to_owned(),
        }
    }

    fn is_fitted_recording(&self) -> bool {
        *self.recording == self.locator.provenance.recording
    }

    fn error_figure(&self) -> Figure {
        let title = "Location error along the surface";
        let by_position = self.evaluation.by_position();
        let points = |figure: fn(&ErrorSummary) -> f64| {
            by_position
                .iter()
                .map(|(position, summary)| (position.x_m * 1e3, figure(summary) * 1e3))
                .collect()
        };
        let several = by_position.iter().any(|(_, summary)| summary.count > 1);
        let mut series = vec![series(
            if several { "average of the readings there" } else { "error of the reading there" },
            0,
            SeriesKind::Points { points: points(|summary| summary.average_m), marker: Marker::Circle },
        )];
        if several {
            let kind =
                SeriesKind::Points { points: points(|summary| summary.largest_m), marker: Marker::Triangle };
            series.push(self::series("largest of the readings there", 1, kind));
        }
        let label = format!("tolerance, {} mm", mm(self.tolerance_m));
        let chart = Chart {
            title: title.to_owned(),
            x: self.along_surface("contact position, mm"),
            y: Axis::log10("location error, mm"),
            series,
            marks: vec![Mark::HorizontalLine { y: self.tolerance_m * 1e3, label }],
            ..Chart::default()
        };
        figure(1, &chart, html! { "Location error at each contact position, on a logarithmic axis." })
    }

    fn estimate_figure(&self) -> Figure {
        let to_mm = |pick: fn(&Located) -> (f64, f64)| {
            self.evaluation.located.iter().map(pick).map(|(truth, seen)| (truth * 1e3, seen * 1e3)).collect()
        };
        let length_mm = self.evaluation.length_m * 1e3;
        let identity = vec![(0.0, 0.0), (length_mm, length_mm)];
        let along = to_mm(|located| (located.truth.x_m, located.estimate.x_m));
        let mut drawn = vec![
            series("estimated = true", 6, SeriesKind::Line { points: identity, stroke: Stroke::Dashed }),
            series("along the surface", 0, SeriesKind::Points { points: along, marker: Marker::Circle }),
        ];
        if self.locator.bench.surface.extent().width_m.is_some() {
            let points = to_mm(|located| (located.truth.y_m, located.estimate.y_m));
            drawn.push(series(
                "across the surface",
                1,
                SeriesKind::Points { points, marker: Marker::Triangle },
            ));
        }
        let chart = Chart {
            title: "Estimated against true position".to_owned(),
            x: self.along_surface("true position, mm"),
            y: Axis::linear("estimated position, mm"),
            series: drawn,
            height_px: 560,
            ..Chart::default()
        };
        figure(
            2,
            &chart,
            html! { "Where the contact was seen, against where it was. On the dashes both are the same." },
        )
    }

    fn along_surface(&self, label: &str) -> Axis {
        Axis::linear(label).from_to(0.0, self.evaluation.length_m * 1e3)
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
                "Location errors in mm, and in brackets in % of the surface's length. With contacts evenly along the surface, the \
                 share within the tolerance is the effective length."
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
        let locator = self.locator;
        let outcome = locator.training_outcome();
        let ended = format!("{} after {} epochs", outcome.status, whole(f64::from(outcome.epochs)));
        let force =
            locator.bench.force_n.map_or("unknown".to_owned(), |force_n| format!("{} N", number(force_n)));
        let fitted_to = &locator.provenance.recording;
        let facts = [
            ("estimator", text(locator.kind())),
            ("training", text(ended)),
            ("surface", text(self.surface_in_words())),
            ("sensors", text(self.sensors_in_words())),
            ("contact force", text(force)),
            (
                "fitted to",
                html! { (fitted_to.source) ", " (counted(fitted_to.rows, "row", "rows")) (digests(fitted_to)) },
            ),
            ("fitted from seed", text(locator.provenance.seed.to_string())),
            ("fitted by palpate", text(&locator.provenance.palpate)),
        ];
        Table {
            number: table,
            caption: html! { "What the locator is and where it comes from." },
            columns: vec![short("fact"), words("value")],
            rows: facts.into_iter().map(|(name, value)| vec![text(name), value]).collect(),
        }
        .markup()
    }

    fn surface_in_words(&self) -> String {
        let extent = self.locator.bench.surface.extent();
        let kind = match self.locator.bench.surface {
            SurfaceSpec::Beam(_) => "beam",
            SurfaceSpec::Measured(_) => "measured, without a model",
        };
        let width = extent.width_m.map_or(String::new(), |width_m| format!(" × {} mm", mm(width_m)));
        format!("{kind}, {} mm{width}", mm(extent.length_m))
    }

    fn sensors_in_words(&self) -> String {
        let names = self.locator.bench.layout.names();
        let mut kinds: Vec<&str> =
            self.locator.bench.layout.kinds().into_iter().map(|kind| kind.name()).collect();
        kinds.dedup();
        format!("{}, {}: {}", names.len(), listed(&kinds), names.join(", "))
    }

    fn footer(&self) -> Markup {
        html! {
            p {
                "Made by palpate " (env!("CARGO_PKG_VERSION")) " from " (self.recording.source)
                (digests(self.recording)) "; the locator was fitted from seed " (self.locator.provenance.seed) "."
            }
        }
    }
}

fn digests(recording: &Provenance) -> Markup {
    html! { @for digest in &recording.digests { ", SHA-256 " code { (digest) } } }
}

fn series(label: &str, colour: usize, kind: SeriesKind) -> Series {
    Series { label: label.to_owned(), colour, kind }
}

fn figure(number: usize, chart: &Chart, caption: Markup) -> Figure {
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(chart), caption }
}
