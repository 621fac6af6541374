use maud::{Markup, html};

use super::error_lines::{in_milli, limit_in_words, limit_line};
use super::maps::error_map;
use super::numbers::{counted, number};
use super::page::{Figure, Page, ReportFile, Section, Table};
use super::{Axis, Chart, Series};
use palpate_estimators::estimator::{Comparison, Status};
use palpate_estimators::evaluation::{ErrorSummary, Evaluation, limit_ratio, percentage_error};
use palpate_estimators::setup::Setup;
use palpate_mechanics::surface::Extent;

/// Stretches over which errors are averaged.
const STRETCHES: usize = 40;
/// Further estimators are only in the table.
const MOST_MAPS: usize = 9;

/// Contents of the report.
#[derive(Clone, Copy)]
pub struct ComparisonReport<'a> {
    /// Page title.
    pub title: &'a str,
    /// Surface and sensors.
    pub setup: &'a Setup,
    /// Description of the trials.
    pub trials: &'a str,
    /// Estimators, best first.
    pub comparisons: &'a [Comparison],
    /// Unsuitable estimators, with reasons.
    pub omitted: &'a [(&'static str, String)],
    /// Largest error in metres for the effective length.
    pub tolerance_m: f64,
    /// Seed of simulation and fits.
    pub seed: u64,
}

/// `report.html` and SVG figures.
pub fn comparison_report(report: &ComparisonReport) -> Vec<ReportFile> {
    let (heading, errors) = match report.extent() {
        Extent::Line { .. } => ("Errors along the surface", report.along_figure()),
        Extent::Plane { .. } => ("Errors over the surface", report.errors_map()),
    };
    let sections = vec![
        Section::new("table", "The estimators")
            .table(report.errors_table())
            .table(report.intervals_table())
            .text(report.omitted_estimators_text()),
        Section::new("along", heading).figure(errors),
        Section::new("share", "How many readings are how good").figure(report.share_figure()),
    ];
    Page::new(report.title, report.summary(), sections).with_source(html! { " from " (report.trials) "; seed " (report.seed) ". Times are of this machine and this run" }).files()
}

impl ComparisonReport<'_> {
    fn extent(&self) -> Extent {
        self.setup.surface().extent()
    }

    fn summary(&self) -> Markup {
        let best = self.comparisons.first();
        let mean = best.and_then(|best| best.timed.evaluation.summary(None));
        html! {
            li { (counted(self.comparisons.len(), "estimator", "estimators")) " on " (self.trials) "." }
            @if let (Some(best), Some(mean)) = (best, mean) {
                li {
                    "The least mean error is that of " b { (best.estimator.name()) } ": "
                    (number(mean.average_m * 1e3)) " mm, median " (number(mean.median_m * 1e3)) " mm."
                }
                @if let Some(ratio) = limit_ratio(self.setup, &best.timed.evaluation) {
                    li { "That is " (number(ratio)) " times what physics allows where the limit is small." }
                }
            }
        }
    }

    fn successful(&self) -> impl Iterator<Item = (&Comparison, &Evaluation, ErrorSummary)> {
        self.comparisons.iter().filter_map(|comparison| {
            let evaluation = &comparison.timed.evaluation;
            Some((comparison, evaluation, evaluation.summary(None)?))
        })
    }

    fn errors_table(&self) -> Table {
        let small = match self.extent() {
            Extent::Line { .. } => "1/200",
            Extent::Plane { .. } => "1/20",
        };
        let caption = html! {
            "Location errors in mm, best mean first, and times; 95th percentile and root mean square (RMS). Effective: share of the readings within "
            (number(self.tolerance_m * 1e3)) " mm. × limit: mean error over what physics allows, where the limit is at most " (small)
            " of the length, 1/80 of it away from the ends. A dash: the bench has no limit."
        };
        Table::from_rows(self.successful())
            .short("estimator", |(comparison, ..)| comparison.estimator.name())
            .mm("mean", |(.., summary)| summary.average_m)
            .number("% of length", |(_, of, summary)| {
                percentage_error(summary.average_m, of.extent.length_m())
            })
            .mm("median", |(.., summary)| summary.median_m)
            .mm("95th", |(.., summary)| summary.p95_m)
            .mm("RMS", |(.., summary)| summary.rmse_m)
            .number("effective, %", |(_, evaluation, _)| evaluation.effective_percent(self.tolerance_m))
            .number("× limit", |(_, evaluation, _)| limit_ratio(self.setup, evaluation))
            .number("fit, ms", |(comparison, ..)| comparison.timed.fit_seconds * 1e3)
            .number("a reading, µs", |(comparison, ..)| comparison.timed.locate_ns * 1e-3)
            .caption(caption)
    }

    fn intervals_table(&self) -> Table {
        let caption = html! {
            "Intervals and statuses. Covered: share of the 95 % intervals that contain the contact, and its force. Score: mean interval score, \
             small where narrow intervals contain the contact. Force: mean error of the force. A dash: the estimator has none."
        };
        let status = |evaluation: &Evaluation, status: Status| {
            evaluation
                .status_percents()?
                .into_iter()
                .find(|(of, _)| *of == status)
                .map(|(_, percent)| percent)
        };
        Table::from_rows(self.successful())
            .short("estimator", |(comparison, ..)| comparison.estimator.name())
            .number("covered, %", |(_, evaluation, _)| evaluation.coverage_percent())
            .mm("score, mm", |(_, evaluation, _)| evaluation.interval_score_m())
            .number("force, N", |(_, of, _)| of.force_summary().map(|forces| forces.average_n))
            .number("force covered, %", |(_, of, _)| of.force_summary().map(|forces| forces.coverage_percent))
            .number("located, %", |(_, evaluation, _)| status(evaluation, Status::Located))
            .number("outside model, %", |(_, evaluation, _)| status(evaluation, Status::OutsideModel))
            .caption(caption)
    }

    fn omitted_estimators_text(&self) -> Markup {
        html! {
            @if !self.omitted.is_empty() {
                p { "Left out:" }
                ul {
                    @for (kind, why) in self.omitted {
                        li { b { (*kind) } ": " (why) "." }
                    }
                }
            }
        }
    }

    fn series(&self, points: impl Fn(&Evaluation) -> Vec<(f64, f64)>) -> Vec<Series> {
        // The seventh colour, black, is that of the limit.
        const COLOURS: usize = 6;
        let series = |(i, comparison): (usize, &Comparison)| {
            let (label, points) = (comparison.estimator.name(), points(&comparison.timed.evaluation));
            let drawn = if i < COLOURS { Series::line } else { Series::dashes };
            drawn(label, i % COLOURS, points)
        };
        self.comparisons.iter().enumerate().map(series).collect()
    }

    fn errors_map(&self) -> Figure {
        let shown = self.comparisons.iter().take(MOST_MAPS);
        let evaluations: Vec<(&str, &Evaluation)> =
            shown.map(|comparison| (comparison.estimator.name(), &comparison.timed.evaluation)).collect();
        let what = "Median error of each estimator, from the best mean to the worst and all on one scale";
        error_map(self.setup, "Median error over the surface", what, &evaluations)
    }

    fn along_figure(&self) -> Figure {
        let length_mm = self.setup.surface().extent().length_m() * 1e3;
        let mut series = self.series(|evaluation| in_milli(evaluation.median_by_stretch_m(STRETCHES)));
        series.extend(limit_line(self.setup));
        let x = Axis::linear("contact position, mm").from_to(0.0, length_mm);
        let y = Axis::log10("location error, mm");
        let chart = Chart::new("Median error along the surface", x, y, series).with_height(480);
        let limit = limit_in_words(&chart);
        let caption = html! {
            "Median error of each estimator over stretches of " (number(length_mm / STRETCHES as f64)) " mm."
            (limit)
            @if !limit.is_empty() { " The median of normal errors is 0.85 times their mean: the best estimators lie that far below." }
        };
        Figure::chart(&chart, caption)
    }

    fn share_figure(&self) -> Figure {
        let shares = |evaluation: &Evaluation| {
            let points = evaluation.percentiles_m().into_iter();
            let points = points.map(|(percent, error_m)| (error_m * 1e3, f64::from(percent)));
            points.filter(|(error_mm, _)| *error_mm > 0.0).collect()
        };
        let x = Axis::log10("location error, mm");
        let y = Axis::linear("share of the readings, %").from_to(0.0, 100.0);
        let chart = Chart::new("Share of the readings within an error", x, y, self.series(shares));
        let caption = html! { "How many of an estimator's readings are located within an error: the further left, the better." };
        Figure::chart(&chart.with_height(480), caption)
    }
}
