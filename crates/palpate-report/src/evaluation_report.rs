use maud::{Markup, html};

use super::error_lines::{banded, in_milli, limit_in_words, limit_line, tolerance_mark};
use super::maps::error_map;
use super::numbers::{counted, listed, mm, number, stretch, whole};
use super::page::{Figure, Page, ReportFile, Section, Table, text};
use super::{Axis, Chart, Marker, Series};
use palpate_estimators::description;
use palpate_estimators::estimator::Locator;
use palpate_estimators::evaluation::{
    ErrorSummary, EvaluatedContact, Evaluation, Portion, Quantiles, percentage_error,
};
use palpate_estimators::recording::Provenance;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, SurfaceSpec};
use palpate_rig::Rig;

/// More positions are drawn as a line.
const MOST_MARKERS: usize = 80;

/// Contents of the report.
#[derive(Clone, Copy, Debug)]
pub struct EvaluationReport<'a> {
    /// Page title.
    pub title: &'a str,
    /// Origin of the estimates.
    pub origin: EstimateOrigin<'a>,
    /// Estimates.
    pub evaluation: &'a Evaluation,
    /// Origin of the located readings.
    pub recording: &'a Provenance,
    /// Portions with errors of their own.
    pub portions: &'a [Portion],
    /// Largest error in metres for the effective length.
    pub tolerance_m: f64,
}

/// Origin of the estimates.
#[derive(Clone, Copy, Debug)]
pub enum EstimateOrigin<'a> {
    /// One locator.
    Locator(&'a Locator),
    /// Locators of one rig, each fitted without the positions that it located.
    CrossValidated {
        /// Rig.
        rig: &'a Rig,
        /// Number of locators.
        folds: usize,
        /// Seed of the fits.
        seed: u64,
    },
}

/// `report.html` and SVG figures.
pub fn evaluation_report(report: &EvaluationReport) -> Vec<ReportFile> {
    let (heading, errors) = match report.extent() {
        Extent::Line { .. } => ("Errors along the surface", report.error_figure()),
        Extent::Plane { .. } => {
            let evaluations = [("the locator", report.evaluation)];
            let title = "Median location error over the surface";
            let map = error_map(report.setup(), title, "Median of the location errors", &evaluations);
            ("Errors over the surface", map)
        }
    };
    let sections = vec![
        Section::new("errors", heading).figure(errors).figure(report.estimate_figure()),
        Section::new("table", "Errors in numbers").table(report.errors_table()),
        Section::new("judged", report.origin_heading()).table(report.facts_table()),
    ];
    Page::new(report.title, report.summary(), sections).with_source(report.source_in_words()).files()
}

impl EvaluationReport<'_> {
    fn summary(&self) -> Markup {
        let effective = self.evaluation.effective_percent(self.tolerance_m);
        html! {
            li {
                (counted(self.evaluation.located.len(), "reading", "readings")) " of " b { (self.recording.source) }
                ", at " (counted(self.evaluation.by_position().len(), "position", "positions")) ", located and compared \
                 with where the contact was."
            }
            li { (self.origin_text()) }
            @if let Some(summary) = self.evaluation.summary(None) {
                li {
                    "Average error " b { (number(summary.average_m * 1e3)) " mm" } ", "
                    (number(percentage_error(summary.average_m, self.evaluation.extent.length_m()))) " % of the length; largest "
                    (number(summary.largest_m * 1e3)) " mm."
                }
                li { "Within " (mm(self.tolerance_m)) " mm: " b { (number(effective)) " %" } " of the readings." }
            }
            @if let (Some(percent), Some(score_m)) =
                (self.evaluation.coverage_percent(), self.evaluation.interval_score_m())
            {
                li {
                    "95 % intervals: " b { (number(percent)) " %" } " of the contacts in them, mean interval score "
                    (number(score_m * 1e3)) " mm."
                }
            }
            @if let Some(forces) = self.evaluation.force_summary() {
                li {
                    "Force: average error " b { (number(forces.average_n)) " N" } ", largest " (number(forces.largest_n)) " N; "
                    (number(forces.coverage_percent)) " % in their 95 % intervals."
                }
            }
            @if let Some(statuses) = self.evaluation.status_percents() {
                li {
                    "Statuses: "
                    (statuses.iter().filter(|(_, percent)| *percent > 0.0)
                        .map(|(status, percent)| format!("{} % {}", number(*percent), status.name()))
                        .collect::<Vec<_>>()
                        .join(", "))
                    "."
                }
            }
        }
    }

    fn origin_text(&self) -> String {
        match self.origin {
            EstimateOrigin::CrossValidated { folds, .. } => format!(
                "Cross-validated by position in {}: each position was located by a locator that had not seen it.",
                counted(folds, "fold", "folds")
            ),
            EstimateOrigin::Locator(locator) if *self.recording == locator.provenance.recording => {
                "The locator was fitted to this recording, so these are training errors; errors at other positions are larger."
                    .to_owned()
            }
            EstimateOrigin::Locator(_) => "The locator was fitted to another recording.".to_owned(),
        }
    }

    fn setup(&self) -> &Setup {
        match self.origin {
            EstimateOrigin::Locator(locator) => &locator.setup,
            EstimateOrigin::CrossValidated { rig, .. } => &rig.setup,
        }
    }

    fn extent(&self) -> Extent {
        self.setup().surface().extent()
    }

    fn origin_heading(&self) -> &'static str {
        match self.origin {
            EstimateOrigin::Locator(_) => "The locator",
            EstimateOrigin::CrossValidated { .. } => "The rig",
        }
    }

    fn error_figure(&self) -> Figure {
        let by_position: Vec<(Position, ErrorSummary)> = self
            .evaluation
            .by_position()
            .iter()
            .filter_map(|(at, answers)| Some((*at, answers.summary(None)?)))
            .collect();
        let several = by_position.iter().any(|(_, summary)| summary.count > 1);
        let drawn = |label, colour, marker, figure: fn(&ErrorSummary) -> f64| {
            let points: Vec<(f64, f64)> =
                by_position.iter().map(|(at, summary)| (at.x_m * 1e3, figure(summary) * 1e3)).collect();
            if points.len() > MOST_MARKERS {
                Series::line(label, colour, points)
            } else {
                Series::markers(label, colour, points, marker)
            }
        };
        let label = if several { "average of the readings there" } else { "error of the reading there" };
        let mut series = vec![drawn(label, 0, Marker::Circle, |summary| summary.average_m)];
        if several {
            let largest = |summary: &ErrorSummary| summary.largest_m;
            series.push(drawn("largest of the readings there", 1, Marker::Triangle, largest));
        }
        series.extend(limit_line(self.setup()));
        let (x, y) = (self.axis("contact position, mm"), Axis::log10("location error, mm"));
        let chart = Chart::new("Location error along the surface", x, y, series)
            .with_marks(vec![tolerance_mark(self.tolerance_m)]);
        let caption = html! {
            "Location error at each contact position, on a logarithmic axis."
            (limit_in_words(&chart))
        };
        Figure::chart(&chart, caption)
    }

    fn estimate_figure(&self) -> Figure {
        let length_mm = self.evaluation.extent.length_m() * 1e3;
        let identity = vec![(0.0, 0.0), (length_mm, length_mm)];
        let mut series = vec![Series::dashes("estimated = true", 6, identity)];
        let along = |located: &EvaluatedContact| (located.truth.x_m, located.estimate.x_m);
        let across = |located: &EvaluatedContact| (located.truth.y_m, located.estimate.y_m);
        match self.extent() {
            Extent::Line { .. } => series.extend(self.estimates("estimated", 0, along)),
            Extent::Plane { .. } => {
                series.extend(self.estimates("along the surface", 0, along));
                series.extend(self.estimates("across the surface", 1, across));
            }
        }
        let banded = series.iter().any(Series::is_band);
        let (x, y) = (self.axis("true position, mm"), Axis::linear("estimated position, mm"));
        let chart = Chart::new("Estimated against true position", x, y, series).with_height(560);
        let caption = html! {
            "Where the contact was seen, against where it was. On the dashes both are the same."
            @if banded { " Line: median of the readings at a position; band: 5–95 % of them." }
        };
        Figure::chart(&chart, caption)
    }

    fn axis(&self, label: &str) -> Axis {
        Axis::linear(label).from_to(0.0, self.evaluation.extent.length_m() * 1e3)
    }

    /// Marker per reading; for many readings medians with a band.
    fn estimates(
        &self,
        label: &str,
        colour: usize,
        coordinate: impl Fn(&EvaluatedContact) -> (f64, f64),
    ) -> Vec<Series> {
        let mut pairs = in_milli(self.evaluation.located.iter().map(coordinate).collect());
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        if pairs.len() <= MOST_MARKERS {
            return vec![Series::markers(label, colour, pairs, Marker::Circle)];
        }
        let spread = |place: &[(f64, f64)]| Quantiles::from_values(place.iter().map(|pair| pair.1).collect());
        let places: Vec<(f64, Quantiles)> = pairs
            .chunk_by(|a, b| a.0 == b.0)
            .filter_map(|place| Some((place[0].0, spread(place)?)))
            .collect();
        banded(label, colour, &places, places.len() < pairs.len())
    }

    fn errors_table(&self) -> Table {
        let everywhere = std::iter::once(("everywhere".to_owned(), None));
        let portions = self.portions.iter().map(|portion| (stretch(*portion), Some(*portion)));
        let rows = everywhere.chain(portions).filter_map(|(name, portion)| {
            let inside =
                |located: &&EvaluatedContact| portion.is_none_or(|portion| portion.contains(located.truth));
            let located = self.evaluation.located.iter().filter(inside).copied().collect();
            let part = Evaluation { extent: self.evaluation.extent, located };
            Some((name, part, self.evaluation.summary(portion)?))
        });
        let both = |error_m: f64| {
            let percent = percentage_error(error_m, self.evaluation.extent.length_m());
            format!("{} ({})", number(error_m * 1e3), number(percent))
        };
        let effective = match self.extent() {
            Extent::Line { .. } => "length",
            Extent::Plane { .. } => "area",
        };
        let caption = html! {
            "Location errors in mm, and in brackets in % of the surface's length. With contacts evenly over the surface, the \
             share within the tolerance is the effective " (effective) "."
        };
        Table::from_rows(rows)
            .short("portion", |(name, ..)| name.clone())
            .numeric("readings", |(.., summary)| whole(summary.count as f64))
            .numeric("average, mm (%)", |(.., summary)| both(summary.average_m))
            .numeric("median, mm (%)", |(.., summary)| both(summary.median_m))
            .numeric("95th percentile, mm (%)", |(.., summary)| both(summary.p95_m))
            .numeric("largest, mm (%)", |(.., summary)| both(summary.largest_m))
            .numeric("root mean square, mm (%)", |(.., summary)| both(summary.rmse_m))
            .number(format!("within {} mm, %", mm(self.tolerance_m)), |(_, part, _)| {
                part.effective_percent(self.tolerance_m)
            })
            .caption(caption)
    }

    fn facts_table(&self) -> Table {
        let force = self.setup().force_n();
        let force = force.map_or("unknown".to_owned(), |force_n| format!("{} N", number(force_n)));
        let mut facts = vec![
            ("surface", text(self.surface_in_words())),
            ("sensors", text(self.sensors_in_words())),
            ("contact force", text(force)),
        ];
        facts.extend(match self.origin {
            EstimateOrigin::Locator(locator) => locator_facts(locator),
            EstimateOrigin::CrossValidated { rig, folds, seed } => rig_facts(rig, folds, seed),
        });
        Table::from_rows(facts)
            .short("fact", |(name, _)| *name)
            .column("text", "value", |(_, value)| value.clone())
            .caption(html! { "Subject of the evaluation, and its origin." })
    }

    fn surface_in_words(&self) -> String {
        let extent = self.setup().surface().extent();
        let kind = match &self.setup().surface() {
            SurfaceSpec::Beam(_) => "beam".to_owned(),
            SurfaceSpec::SupportedBeam(beam) => format!("beam, {}", beam.spec().supports_in_words()),
            SurfaceSpec::Plate(_) => "plate".to_owned(),
            SurfaceSpec::Digit(_) => "flexible digit".to_owned(),
            SurfaceSpec::Measured(_) => "measured, without a model".to_owned(),
        };
        let width = extent.width_m().map_or(String::new(), |width_m| format!(" × {} mm", mm(width_m)));
        format!("{kind}, {} mm{width}", mm(extent.length_m()))
    }

    fn sensors_in_words(&self) -> String {
        let names = self.setup().layout().names();
        let mut kinds: Vec<&str> =
            self.setup().layout().kinds().into_iter().map(|kind| kind.name()).collect();
        kinds.dedup();
        format!("{}, {}: {}", names.len(), listed(&kinds), names.join(", "))
    }

    fn source_in_words(&self) -> Markup {
        let seed = match self.origin {
            EstimateOrigin::Locator(locator) => locator.provenance.seed,
            EstimateOrigin::CrossValidated { seed, .. } => seed,
        };
        html! { " from " (self.recording.source) (digests(self.recording)) "; fitted from seed " (seed) }
    }
}

fn locator_facts(locator: &Locator) -> Vec<(&'static str, Markup)> {
    let training = locator.training_outcome().map(|outcome| {
        ("training", text(format!("{} after {} epochs", outcome.status, whole(f64::from(outcome.epochs)))))
    });
    let fitted_to = &locator.provenance.recording;
    let mut facts = vec![("estimator", text(locator.kind()))];
    facts.extend(description::choice(&locator.provenance.choice).map(|words| ("choice", text(words))));
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
    facts.extend(
        rig.estimator.settings(&rig.setup).into_iter().map(|setting| (setting.name, text(setting.value))),
    );
    facts
}

fn digests(recording: &Provenance) -> Markup {
    html! { @for digest in &recording.digests { ", SHA-256 " code { (digest) } } }
}
