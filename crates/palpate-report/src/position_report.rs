use maud::{Markup, html};

use super::bench_figures::{row_axis, row_height};
use super::drawing::chart::Extremes;
use super::maps::{DesignMap, compared_maps, in_mm};
use super::numbers::{counted, mm, number};
use super::page::{Figure, Page, ReportFile, Section, Table};
use super::{Axis, Chart, Marker, Series};
use palpate_design::positions::{Placement, PositionProblem, VerifiedPositions, best_placed};
use palpate_estimators::estimator::Cells;
use palpate_estimators::setup::Setup;
use palpate_mechanics::surface::Extent;

/// Contents of the report.
#[derive(Clone, Copy)]
pub struct PositionDesignReport<'a> {
    /// Page title.
    pub title: &'a str,
    /// Surface and sensors.
    pub setup: &'a Setup,
    /// Kind of the estimator.
    pub estimator: &'a str,
    /// Design problem.
    pub problem: &'a PositionProblem,
    /// Arrangements.
    pub placed: &'a [VerifiedPositions],
}

/// `report.html` and SVG figures.
pub fn position_design_report(report: &PositionDesignReport) -> Vec<ReportFile> {
    let positions = Section::new("positions", "The arrangements").table(report.table());
    let errors = Section::new("errors", "Where the locator is off");
    let (positions, errors) = match report.problem.extent() {
        Extent::Line { .. } => {
            (positions.figure(report.rows_figure()), errors.figure(report.errors_figure()))
        }
        Extent::Plane { .. } => (positions, errors.figures(report.maps())),
    };
    let meaning = Section::new("meaning", "How positions are searched and scored").text(report.meaning());
    let sections = vec![positions.table(report.places()), errors, meaning];
    Page::new(report.title, report.summary(), sections)
        .with_source(html! { ", seed " (report.problem.design().seed) })
        .files()
}

impl<'a> PositionDesignReport<'a> {
    fn even(&self) -> Option<&'a VerifiedPositions> {
        self.placed.iter().find(|placed| placed.placement == Placement::Even)
    }

    fn best(&self) -> Option<&'a VerifiedPositions> {
        best_placed(self.placed)
    }

    fn compared(&self) -> Vec<&'a VerifiedPositions> {
        let best = self.best().filter(|best| best.placement != Placement::Even);
        self.even().into_iter().chain(best).collect()
    }

    fn summary(&self) -> Markup {
        let Some(best) = self.best() else { return html! {} };
        let design = self.problem.design();
        let median = |placed: &VerifiedPositions| placed.verification.median_error_m * 1e3;
        html! {
            li {
                "Best of " (counted(self.placed.len(), "arrangement", "arrangements")) " of "
                (counted(design.count, "training position", "training positions")) ", "
                (counted(design.repeats, "press", "presses")) " each: " b { (best.placement.name()) } "."
            }
            li {
                "Calibrated so, the locator (" (self.estimator) ") is off by " b { (number(median(best))) " mm" }
                @if let Some(even) = self.even().filter(|even| even.placement != best.placement) {
                    ", " (number(100.0 * (1.0 - median(best) / median(even)))) " % below the even arrangement's "
                    (number(median(even))) " mm"
                }
                "; medians of " (counted(design.verifications, "calibration", "calibrations")) ", force "
                (self.problem.force().name()) "."
            }
        }
    }

    fn table(&self) -> Table {
        let caption = html! {
            "Errors after calibrating, averaged over " (counted(self.problem.contacts().len(), "contact", "contacts"))
            ": the median and the mean of the calibrations, and the standard error of the mean."
        };
        Table::from_rows(self.placed)
            .short("positions", |placed| placed.placement.name())
            .mm("median error, mm", |placed| placed.verification.median_error_m)
            .mm("mean error, mm", |placed| placed.verification.mean_error_m)
            .mm("±, mm", |placed| placed.verification.standard_error_m)
            .number(format!("within {} mm, %", mm(self.problem.design().tolerance_m)), |placed| {
                placed.verification.within_tolerance_percent
            })
            .caption(caption)
    }

    fn places(&self) -> Table {
        let extent = self.problem.extent();
        Table::from_rows(self.placed)
            .short("positions", |placed| placed.placement.name())
            .wide("where", |placed| extent.places_in_words(&placed.positions))
            .caption(html! { "Where to press." })
    }

    fn rows_figure(&self) -> Figure {
        let rows = self.placed.len();
        let series = self.placed.iter().enumerate().map(|(row, placed)| {
            let points = placed.positions.iter().map(|at| (at.x_m * 1e3, row_height(rows, row)));
            Series::markers("", row, points.collect(), Marker::Circle)
        });
        let names: Vec<&str> = self.placed.iter().map(|placed| placed.placement.name()).collect();
        let x = self.axis("training position, mm");
        let chart = Chart::new("Where to press", x, row_axis(&names), series.collect())
            .with_height((150 + 34 * rows) as u32);
        Figure::chart(&chart, html! { "The training positions of every arrangement, a row each." })
    }

    fn errors_figure(&self) -> Figure {
        let contacts = &self.problem.contacts().positions;
        let points = |placed: &VerifiedPositions| {
            let errors = contacts.iter().zip(&placed.errors_m);
            errors.map(|(at, error_m)| (at.x_m * 1e3, error_m * 1e3)).collect()
        };
        let line = |(i, placed): (usize, &VerifiedPositions)| {
            let name = placed.placement.name();
            if i == 0 {
                Series::dashes(name, 6, points(placed))
            } else {
                Series::line(name, 0, points(placed))
            }
        };
        let series: Vec<Series> = self.compared().into_iter().enumerate().map(line).collect();
        let y = Extremes::from_lines(&series).axis("mean error, mm");
        let chart = Chart::new("Error by contact position", self.axis("contact position, mm"), y, series);
        Figure::chart(&chart, html! { "The mean error at each contact over all verifying calibrations." })
    }

    fn maps(&self) -> Vec<Figure> {
        let contacts = &self.problem.contacts().positions;
        let columns = contacts.iter().take_while(|at| at.y_m == contacts[0].y_m).count().max(1);
        let cells = Cells { extent: self.setup.surface().extent(), columns, rows: contacts.len() / columns };
        let designed = |placed: &'a VerifiedPositions| DesignMap {
            name: placed.placement.name(),
            values: placed.errors_m.iter().map(|error_m| error_m * 1e3).collect(),
            dots_mm: placed.positions.iter().copied().map(in_mm).collect(),
        };
        let designs = self.compared().into_iter().map(designed).collect();
        let title = |name: &str| format!("Mean error, {name} positions");
        let caption = |name: &str, most: &str| {
            html! {
                "The mean error at each contact after pressing at the " (name) " positions, which are the dots. Errors above "
                (most) " mm have its colour."
            }
        };
        compared_maps(cells, "error, mm", designs, title, caption)
    }

    fn axis(&self, label: &str) -> Axis {
        Axis::linear(label).from_to(0.0, self.setup.surface().extent().length_m() * 1e3)
    }

    fn meaning(&self) -> Markup {
        let design = self.problem.design();
        html! {
            p {
                "Every arrangement is judged by the same calibrations: presses are simulated with noise, the estimator is fitted, and \
                 readings of the contacts are located. The search judged by " (counted(design.calibrations, "calibration", "calibrations"))
                "; the figures here are of " (counted(design.verifications, "other one", "other ones")) ", with noise that no search has seen."
            }
            p {
                b { "even" } " and " b { "edge-dense" } " are the founding paper's, " b { "chebyshev" } " are the nodes that polynomials are best \
                 interpolated from, " b { "variance-optimal" } " leaves influence functions, learnt from the presses alone, the least variance, and "
                b { "optimal" } " is the best of these and of some between, with its positions moved about while simulated calibrations get better."
            }
        }
    }
}
