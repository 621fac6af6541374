//! The report of a comparison: every estimator's errors beside each other, and the limit.

use maud::{Markup, html};

use super::limit_line::{limit_in_words, limit_line};
use super::numbers::{counted, number};
use super::page::{Figure, Figures, Page, Section, Table, numeric, short, text};
use super::plane_figures::{ErrorGrid, LIMIT_IN_WORDS};
use super::{
    Axis, Chart, HeatPanel, ReportError, ReportFile, Series, SeriesKind, Stroke, chart_to_svg,
    heat_map_to_svg,
};
use palpate_estimators::estimator::Comparison;
use palpate_estimators::evaluation::{Located, limit_ratio, percentage_error, percentile};
use palpate_estimators::setup::Bench;

/// What a comparison's report is made from.
#[derive(Clone, Copy)]
pub struct ComparisonReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The surface and its sensors.
    pub bench: &'a Bench,
    /// What the estimators were tried on, in words.
    pub trials: &'a str,
    /// The estimators, best first.
    pub comparisons: &'a [Comparison],
    /// Kinds that do not suit the rig or the recording, and why.
    pub left_out: &'a [(&'static str, String)],
    /// Errors up to this are good enough for the effective length, in metres.
    pub tolerance_m: f64,
    /// Seed of simulation and fits.
    pub seed: u64,
}

/// Reports a comparison: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn comparison_report(report: &ComparisonReport) -> Result<Vec<ReportFile>, ReportError> {
    let extent = report.bench.surface.extent();
    let (heading, errors) = match extent.width_m {
        Some(width_m) => ("Errors over the surface", errors_map(report, width_m)),
        None => ("Errors along the surface", along_figure(report)),
    };
    let figures = Figures(vec![errors, share_figure(report)]);
    let section = |id, heading, body| Section { id, heading, body };
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections: vec![
            section("table", "The estimators", html! { (report.table(1)) (report.left_out_in_words()) }),
            section("along", heading, figures.show(1)),
            section("share", "How many readings are how good", figures.show(2)),
        ],
        footer: html! {
            p {
                "Made by palpate " (env!("CARGO_PKG_VERSION")) " from " (report.trials) "; seed " (report.seed)
                ". Times are of this machine and this run."
            }
        },
    };
    page.into_files(figures)
}

impl ComparisonReport<'_> {
    fn summary(&self) -> Markup {
        let best = self.comparisons.first();
        let mean = best.and_then(|best| best.evaluation.summary(None));
        html! {
            div.summary {
                ul {
                    li { (counted(self.comparisons.len(), "estimator", "estimators")) " on " (self.trials) "." }
                    @if let (Some(best), Some(mean)) = (best, mean) {
                        li {
                            "The least mean error is that of " b { (best.estimator.kind()) } ": "
                            (number(mean.average_m * 1e3)) " mm, median " (number(mean.median_m * 1e3)) " mm."
                        }
                        @if let Some(ratio) = limit_ratio(self.bench, &best.evaluation) {
                            li { "That is " (number(ratio)) " times what physics allows where the limit is small." }
                        }
                    }
                }
            }
        }
    }

    fn table(&self, table: usize) -> Markup {
        let rows = self.comparisons.iter().filter_map(|comparison| {
            let evaluation = &comparison.tried.evaluation;
            let summary = evaluation.summary(None)?;
            let cell = |value: Option<f64>| text(number(value.unwrap_or(f64::NAN)));
            Some(vec![
                text(comparison.estimator.kind()),
                cell(Some(summary.average_m * 1e3)),
                cell(Some(percentage_error(summary.average_m, evaluation.length_m))),
                cell(Some(summary.median_m * 1e3)),
                cell(Some(summary.p95_m * 1e3)),
                cell(Some(summary.rmse_m * 1e3)),
                cell(Some(evaluation.effective_percent(self.tolerance_m))),
                cell(evaluation.coverage_percent()),
                cell(limit_ratio(self.bench, evaluation)),
                cell(Some(comparison.tried.fit_seconds * 1e3)),
                cell(Some(comparison.tried.locate_ns * 1e-3)),
            ])
        });
        Table {
            number: table,
            caption: html! {
                "Location errors in mm, best mean first; 95th percentile and root mean square (RMS). Effective: share of the readings within "
                (number(self.tolerance_m * 1e3)) " mm. Covered: share of the 95 % intervals that hold the contact. × limit: mean \
                 error over what physics allows, where the limit is at most " (if self.bench.surface.extent().is_plane() { "1/20" } else { "1/200" })
                " of the length, 1/80 of it away from the ends. A dash: the estimator or the bench has none."
            },
            columns: vec![
                short("estimator"),
                numeric("mean"),
                numeric("% of length"),
                numeric("median"),
                numeric("95th"),
                numeric("RMS"),
                numeric("effective, %"),
                numeric("covered, %"),
                numeric("× limit"),
                numeric("fit, ms"),
                numeric("a reading, µs"),
            ],
            rows: rows.collect(),
        }
        .markup()
    }

    fn left_out_in_words(&self) -> Markup {
        html! {
            @if !self.left_out.is_empty() {
                p { "Left out:" }
                ul {
                    @for (kind, why) in self.left_out {
                        li { b { (*kind) } ": " (why) "." }
                    }
                }
            }
        }
    }

    /// A line an estimator.
    fn series(&self, points: impl Fn(&[Located]) -> Vec<(f64, f64)>) -> Vec<Series> {
        // The last colour is black, which the limit has.
        const COLOURS: usize = 6;
        let series = |(i, comparison): (usize, &Comparison)| Series {
            label: comparison.estimator.kind().to_owned(),
            colour: i % COLOURS,
            kind: SeriesKind::Line {
                points: points(&comparison.tried.evaluation.located),
                stroke: if i < COLOURS { Stroke::Solid } else { Stroke::Dashed },
            },
        };
        self.comparisons.iter().enumerate().map(series).collect()
    }
}

/// Stretches of the surface over which errors are summed up.
const STRETCHES: usize = 40;

/// Maps that fit beside each other; estimators beyond them are in the table alone.
const MOST_MAPS: usize = 9;

fn errors_map(report: &ComparisonReport, width_m: f64) -> Figure {
    let length_m = report.bench.surface.extent().length_m;
    let grid = ErrorGrid::of(report.comparisons.iter().map(|c| &c.tried.evaluation), length_m, width_m);
    let shown = &report.comparisons[..report.comparisons.len().min(MOST_MAPS)];
    let panel = |comparison: &Comparison| HeatPanel {
        name: comparison.estimator.kind().to_owned(),
        values: grid.medians_mm(&comparison.tried.evaluation.located),
    };
    let panels: Vec<HeatPanel> = shown.iter().map(panel).collect();
    let map = grid.map(report.bench, "Median error over the surface", panels);
    let with_limit = map.panels.len() > shown.len();
    let caption = html! {
        "Median error of each estimator, from the best mean to the worst, by cells of " (number(grid.cell_m()[0] * 1e3)) " × "
        (number(grid.cell_m()[1] * 1e3)) " mm, all on one scale. Dots: the sensors. Grey: no contact was tried."
        @if with_limit { (LIMIT_IN_WORDS) }
    };
    Figure { number: 1, alternative: map.title.clone(), svg: heat_map_to_svg(&map), caption }
}

fn along_figure(report: &ComparisonReport) -> Figure {
    let length_m = report.bench.surface.extent().length_m;
    let mut series = report.series(|located| medians(located, length_m));
    series.extend(limit_line(report.bench));
    let chart = Chart {
        title: "Median error along the surface".to_owned(),
        x: Axis::linear("contact position, mm").from_to(0.0, length_m * 1e3),
        y: Axis::log10("location error, mm"),
        series,
        height_px: 480,
        ..Chart::default()
    };
    let limit = limit_in_words(&chart);
    let caption = html! {
        "Median error of each estimator over stretches of " (number(length_m * 1e3 / STRETCHES as f64)) " mm."
        (limit)
        @if !limit.is_empty() { " The median of normal errors is 0.85 times their mean: the best estimators lie that far below." }
    };
    Figure { number: 1, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
}

/// The median error in mm of each stretch that has a contact, at the mean of its contacts.
fn medians(located: &[Located], length_m: f64) -> Vec<(f64, f64)> {
    let mut stretches: Vec<Vec<(f64, f64)>> = vec![Vec::new(); STRETCHES];
    for located in located {
        let share = located.truth.x_m / length_m * STRETCHES as f64;
        let stretch = (share as usize).min(STRETCHES - 1);
        stretches[stretch].push((located.truth.x_m * 1e3, located.error_m() * 1e3));
    }
    let point = |stretch: Vec<(f64, f64)>| {
        let mean = stretch.iter().map(|(x, _)| x).sum::<f64>() / stretch.len().max(1) as f64;
        let mut errors: Vec<f64> = stretch.into_iter().map(|(_, error)| error).collect();
        errors.sort_by(f64::total_cmp);
        percentile(&errors, 50.0).map(|median| (mean, median))
    };
    stretches.into_iter().filter_map(point).collect()
}

fn share_figure(report: &ComparisonReport) -> Figure {
    let chart = Chart {
        title: "Share of the readings within an error".to_owned(),
        x: Axis::log10("location error, mm"),
        y: Axis::linear("share of the readings, %").from_to(0.0, 100.0),
        series: report.series(shares),
        height_px: 480,
        ..Chart::default()
    };
    let caption = html! { "How many of an estimator's readings are located within an error: the further left, the better." };
    Figure { number: 2, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
}

/// Error in mm and share in %, from the 1st to the 100th percentile.
fn shares(located: &[Located]) -> Vec<(f64, f64)> {
    let mut errors: Vec<f64> = located.iter().map(|located| located.error_m() * 1e3).collect();
    errors.sort_by(f64::total_cmp);
    let share =
        |percent: u32| percentile(&errors, f64::from(percent)).map(|error| (error, f64::from(percent)));
    (1..=100).filter_map(share).filter(|(error, _)| *error > 0.0).collect()
}
