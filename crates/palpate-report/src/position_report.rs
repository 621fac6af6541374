//! The report of a design of training positions: arrangements by several rules and searches, judged alike.

use maud::{Markup, html};

use super::extremes::Extremes;
use super::numbers::{counted, mm, number};
use super::page::{Figure, Figures, Page, Section, Table, numeric, short, text, wide};
use super::{
    Axis, Chart, HeatMap, HeatPanel, Marker, ReportError, ReportFile, Series, SeriesKind, Stroke,
    chart_to_svg, heat_map_to_svg,
};
use palpate_design::positions::{Placed, Placement, PositionProblem, best_placed};
use palpate_estimators::setup::Bench;
use palpate_mechanics::contact::in_words;

/// What a report of training positions is made from.
#[derive(Clone, Copy)]
pub struct PositionDesignReport<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The surface with its sensors.
    pub bench: &'a Bench,
    /// The estimator's kind.
    pub estimator: &'a str,
    /// What was designed.
    pub problem: &'a PositionProblem<'a>,
    /// The arrangements.
    pub placed: &'a [Placed],
}

/// Reports training positions: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn position_design_report(report: &PositionDesignReport) -> Result<Vec<ReportFile>, ReportError> {
    let figures = match report.bench.surface.extent().width_m {
        Some(width_m) => report.maps(width_m),
        None => vec![report.rows_figure(1), report.errors_figure(2)],
    };
    let shown = Figures(figures);
    let (positions, errors) = if report.problem.is_plane() {
        (html! {}, html! { (shown.show(1)) (shown.show(2)) })
    } else {
        (shown.show(1), shown.show(2))
    };
    let sections = vec![
        Section {
            id: "positions",
            heading: "The arrangements",
            body: html! { (report.table(1)) (positions) (report.places(2)) },
        },
        Section { id: "errors", heading: "Where the locator is off", body: errors },
        Section { id: "meaning", heading: "How positions are found and judged", body: report.meaning() },
    ];
    let page = Page {
        title: report.title.to_owned(),
        opening: report.summary(),
        sections,
        footer: html! {
            p { "Made by palpate " (env!("CARGO_PKG_VERSION")) ", seed " (report.problem.budget().seed) "." }
        },
    };
    page.into_files(shown)
}

impl<'a> PositionDesignReport<'a> {
    fn even(&self) -> Option<&'a Placed> {
        self.placed.iter().find(|placed| placed.placement == Placement::Even)
    }

    fn best(&self) -> Option<&'a Placed> {
        best_placed(self.placed)
    }

    /// The even arrangement and the best, where that is another.
    fn compared(&self) -> Vec<&'a Placed> {
        let best = self.best().filter(|best| best.placement != Placement::Even);
        self.even().into_iter().chain(best).collect()
    }

    fn summary(&self) -> Markup {
        let Some(best) = self.best() else { return html! {} };
        let budget = self.problem.budget();
        let median = |placed: &Placed| placed.verification.median_error_m * 1e3;
        html! {
            div.summary {
                ul {
                    li {
                        "Best of " (counted(self.placed.len(), "arrangement", "arrangements")) " of "
                        (counted(budget.count, "training position", "training positions")) ", "
                        (counted(budget.repeats, "press", "presses")) " each: " b { (best.placement.name()) } "."
                    }
                    li {
                        "Calibrated so, the locator (" (self.estimator) ") is off by " b { (number(median(best))) " mm" }
                        @if let Some(even) = self.even().filter(|even| even.placement != best.placement) {
                            ", " (number(100.0 * (1.0 - median(best) / median(even)))) " % below the even arrangement's "
                            (number(median(even))) " mm"
                        }
                        "; medians of " (counted(budget.verifications, "calibration", "calibrations")) ", force "
                        (self.problem.force().name()) "."
                    }
                }
            }
        }
    }

    fn table(&self, table: usize) -> Markup {
        let mm = |length_m: f64| text(number(length_m * 1e3));
        let rows = self.placed.iter().map(|placed| {
            let told = &placed.verification;
            vec![
                text(placed.placement.name()),
                mm(told.median_error_m),
                mm(told.mean_error_m),
                mm(told.standard_error_m),
                text(number(told.within_tolerance_percent)),
            ]
        });
        Table {
            number: table,
            caption: html! {
                "Errors after calibrating, averaged over " (counted(self.problem.contacts().len(), "contact", "contacts"))
                ": the median and the mean of the calibrations, and the standard error of the mean."
            },
            columns: vec![
                short("positions"),
                numeric("median error, mm"),
                numeric("mean error, mm"),
                numeric("±, mm"),
                numeric(format!("within {} mm, %", self::mm(self.problem.tolerance_m()))),
            ],
            rows: rows.collect(),
        }
        .markup()
    }

    fn places(&self, table: usize) -> Markup {
        let plane = self.problem.is_plane();
        let rows = self
            .placed
            .iter()
            .map(|placed| vec![text(placed.placement.name()), text(in_words(&placed.positions, plane))]);
        Table {
            number: table,
            caption: html! { "Where to press." },
            columns: vec![short("positions"), wide("where")],
            rows: rows.collect(),
        }
        .markup()
    }

    /// Every arrangement a row, the first uppermost.
    fn rows_figure(&self, number: usize) -> Figure {
        let rows = self.placed.len();
        let y = |row: usize| (rows - row) as f64;
        let series = self.placed.iter().enumerate().map(|(row, placed)| Series {
            label: String::new(),
            colour: row,
            kind: SeriesKind::Points {
                points: placed.positions.iter().map(|at| (at.x_m * 1e3, y(row))).collect(),
                marker: Marker::Circle,
            },
        });
        let names = self.placed.iter().enumerate();
        let names = names.map(|(row, placed)| (y(row), placed.placement.name().to_owned()));
        let chart = Chart {
            title: "Where to press".to_owned(),
            x: Axis::linear("training position, mm").from_to(0.0, self.length_mm()),
            y: Axis::default().from_to(0.4, rows as f64 + 0.6).named(names.collect()),
            series: series.collect(),
            height_px: (150 + 34 * rows) as u32,
            ..Chart::default()
        };
        let caption = html! { "The training positions of every arrangement, a row each." };
        Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    /// The mean error at each contact, of the even arrangement and the best.
    fn errors_figure(&self, number: usize) -> Figure {
        let contacts = &self.problem.contacts().positions;
        let strokes = [(6, Stroke::Dashed), (0, Stroke::Solid)];
        let series: Vec<Series> = self
            .compared()
            .into_iter()
            .zip(strokes)
            .map(|(placed, (colour, stroke))| Series {
                label: placed.placement.name().to_owned(),
                colour,
                kind: SeriesKind::Line {
                    points: contacts
                        .iter()
                        .zip(&placed.errors_m)
                        .map(|(at, error_m)| (at.x_m * 1e3, error_m * 1e3))
                        .collect(),
                    stroke,
                },
            })
            .collect();
        let label = "mean error, mm";
        let wide = Extremes::of_lines(&series).are_far_apart();
        let y = if wide { Axis::log10(label) } else { Axis::linear(label) };
        let chart = Chart {
            title: "Error by contact position".to_owned(),
            x: Axis::linear("contact position, mm").from_to(0.0, self.length_mm()),
            y,
            series,
            height_px: 440,
            ..Chart::default()
        };
        let caption = html! { "The mean error at each contact over all verifying calibrations." };
        Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(&chart), caption }
    }

    /// On a plane, the error with the even arrangement and with the best, side by side in one scale, with the positions.
    fn maps(&self, width_m: f64) -> Vec<Figure> {
        let contacts = &self.problem.contacts().positions;
        let columns = contacts.iter().take_while(|at| at.y_m == contacts[0].y_m).count();
        let mut errors: Vec<f64> =
            self.compared().into_iter().flat_map(|placed| placed.errors_m.clone()).collect();
        errors.sort_by(f64::total_cmp);
        let most = errors.get(errors.len() * 95 / 100).copied().unwrap_or(1.0) * 1e3;
        let figure = |(i, placed): (usize, &Placed)| {
            let name = placed.placement.name();
            let map = HeatMap {
                title: format!("Mean error, {name} positions"),
                length_mm: self.length_mm(),
                width_mm: width_m * 1e3,
                columns,
                rows: contacts.len() / columns.max(1),
                panels: vec![HeatPanel {
                    name: String::new(),
                    values: placed.errors_m.iter().map(|error_m| error_m * 1e3).collect(),
                }],
                sensors_mm: placed.positions.iter().map(|at| (at.x_m * 1e3, at.y_m * 1e3)).collect(),
                label: "error, mm".to_owned(),
                most,
                width_px: 640,
            };
            let caption = html! {
                "The mean error at each contact after pressing at the " (name) " positions, which are the dots. Errors above "
                (number(most)) " mm have its colour."
            };
            Figure { number: i + 1, alternative: map.title.clone(), svg: heat_map_to_svg(&map), caption }
        };
        self.compared().into_iter().enumerate().map(figure).collect()
    }

    fn length_mm(&self) -> f64 {
        self.bench.surface.extent().length_m * 1e3
    }

    fn meaning(&self) -> Markup {
        let budget = self.problem.budget();
        html! {
            p {
                "Every arrangement is judged by the same calibrations: presses are simulated with noise, the estimator is fitted, and \
                 readings of the contacts are located. The search judged by " (counted(budget.calibrations, "calibration", "calibrations"))
                "; the figures here are of " (counted(budget.verifications, "other one", "other ones")) ", with noise that no search has seen."
            }
            p {
                b { "even" } " and " b { "edge-dense" } " are the founding paper's, " b { "chebyshev" } " are the nodes that polynomials are best \
                 interpolated from, " b { "variance-optimal" } " leaves influence functions, learnt from the presses alone, the least variance, and "
                b { "optimal" } " is the best of these and of some between, with its positions moved about while simulated calibrations get better."
            }
        }
    }
}
