use maud::{Markup, html};

use super::error_lines::tolerance_mark;
use super::numbers::{mm, number};
use super::page::{Columns, Figure, Page, ReportFile, Section, Table};
use super::{Axis, Chart, Series};
use palpate_studies::dead_areas::{DeadAreaResults, DeadAreaRow, DeadAreas};

/// `report.html` and SVG figures.
pub fn dead_areas_report(study: &DeadAreas, findings: &DeadAreaResults) -> Vec<ReportFile> {
    let report = DeadAreasReport { study, findings };
    let folded = study.counts.iter().map(|count| report.folded_figure(*count));
    let sections = vec![
        Section::new("counts", "How much is located, by the number of sensors")
            .figure(report.effective_figure())
            .table(report.effective_table()),
        Section::new("between", "Errors between sensors").figures(folded).table(report.folded_table()),
        Section::new("how", "How it was done").text(report.how()),
    ];
    Page::new("Dead areas between sensors", report.summary(), sections)
        .with_lead(report.introduction())
        .with_source(html! { ", seed " (study.seed) })
        .files()
}

struct DeadAreasReport<'a> {
    study: &'a DeadAreas,
    findings: &'a DeadAreaResults,
}

impl DeadAreasReport<'_> {
    fn arms(&self) -> Vec<(&str, &'static str)> {
        let mut arms: Vec<(&str, &'static str)> = Vec::new();
        for row in &self.findings.rows {
            let arm = (row.sensing.as_str(), row.estimator);
            if !arms.contains(&arm) {
                arms.push(arm);
            }
        }
        arms
    }

    fn row(&self, (sensing, estimator): (&str, &str), sensors: usize) -> Option<&DeadAreaRow> {
        let mut rows = self.findings.rows.iter();
        rows.find(|row| row.sensing == sensing && row.estimator == estimator && row.sensors == sensors)
    }

    fn introduction(&self) -> Markup {
        let counts: Vec<String> = self.study.counts.iter().map(usize::to_string).collect();
        let tolerance = mm(self.study.tolerance_m);
        html! { p { "Effective length (errors within " (tolerance) " mm) over " (counts.join(", ")) " sensors:" } }
    }

    fn summary(&self) -> Markup {
        let range = |arm: (&str, &str)| {
            let shares = self.study.counts.iter().filter_map(|count| self.row(arm, *count));
            let shares: Vec<f64> = shares.map(|row| row.effective_percent).collect();
            let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
            let most = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{}–{} %", number(least), number(most))
        };
        html! { @for arm in self.arms() { li { (name(arm)) ": " b { (range(arm)) } } } }
    }

    fn effective_figure(&self) -> Figure {
        let line = |(i, arm): (usize, (&str, &'static str))| {
            let counts = self.study.counts.iter();
            let points =
                counts.filter_map(|count| Some((*count as f64, self.row(arm, *count)?.effective_percent)));
            series(i, arm, points.collect())
        };
        let counts: Vec<f64> = self.study.counts.iter().map(|count| *count as f64).collect();
        let x = Axis::log10("sensors").ticks_at(counts);
        let y = Axis::linear("effective length, %").from_to(0.0, 100.0);
        let lines = self.arms().into_iter().enumerate().map(line).collect();
        let chart = Chart::new("Effective length by the number of sensors", x, y, lines).with_height(560);
        let caption = html! {
            "Share of the contacts, every 1/400 of the length, that are located within " (mm(self.study.tolerance_m))
            " mm. Solid: sensors under one surface; dashed: an array of sensors, each sensitive only to nearby contacts."
        };
        Figure::chart(&chart, caption)
    }

    fn folded_figure(&self, count: usize) -> Figure {
        let line = |(i, arm): (usize, (&str, &'static str))| {
            let row = self.row(arm, count)?;
            let points = row.folded.folds.iter().map(|fold| (fold.pitches, fold.mean_error_m * 1e3));
            Some(series(i, arm, points.collect()))
        };
        let x = Axis::linear("distance from the nearest sensor, in pitches").from_to(0.0, 0.5);
        let lines = self.arms().into_iter().enumerate().filter_map(line).collect();
        let title = format!("Errors between {count} sensors");
        let chart = Chart::new(title, x, Axis::log10("mean error, mm"), lines)
            .with_marks(vec![tolerance_mark(self.study.tolerance_m)])
            .with_height(560);
        let caption = html! {
            "Mean error from over a sensor (left) to half-way between two (right), folded over all gaps between " (count)
            " sensors. A dead area is a line that rises to the right."
        };
        Figure::chart(&chart, caption)
    }

    fn effective_table(&self) -> Table {
        let table = Table::from_rows(self.arms()).short("sensing, estimator", |arm| name(*arm));
        let add = |table: Columns<_>, count: &usize| {
            table.number(format!("{count} sensors"), |arm| Some(self.row(*arm, *count)?.effective_percent))
        };
        let caption = html! { "Effective length in %. A dash: the estimator could not be fitted." };
        self.study.counts.iter().fold(table, add).caption(caption)
    }

    fn folded_table(&self) -> Table {
        let caption = html! {
            "Mean errors within a tenth of a pitch from a sensor and from the middle of a gap, their ratio, and the share of the \
             contacts between the outermost sensors that are off by more than the tolerance."
        };
        Table::from_rows(&self.findings.rows)
            .short("sensing, estimator", |row| name((&row.sensing, row.estimator)))
            .numeric("sensors", |row| row.sensors.to_string())
            .mm("over sensors, mm", |row| row.folded.at_sensors_m)
            .mm("between, mm", |row| row.folded.between_m)
            .number("ratio", |row| row.folded.between_m / row.folded.at_sensors_m)
            .number("dead, %", |row| row.folded.dead_percent)
            .caption(caption)
    }

    fn how(&self) -> Markup {
        html! {
            p {
                "The surface is the rig's; its sensors are spread evenly, at i/(n + 1) of the length, and every estimator is calibrated at \
                 the rig's training positions, " (self.study.calibrations) " times with noise of its own. An array's sensors sit at \
                 (i + ½)/n of the length; each reads exp(−d²/(2·s²)) of a contact at the distance d, with noise of the same share of its \
                 full scale, and its centroid is calibrated by the same presses. Networks trained by back-propagation stop after two \
                 million presentations."
            }
            @for (sensing, estimator, sensors, why) in &self.findings.omitted {
                p { (sensing) ", " (estimator) ", " (sensors) " sensors: left out, as " (why) "." }
            }
        }
    }
}

fn name((sensing, estimator): (&str, &str)) -> String {
    if sensing == "distributive" { estimator.to_owned() } else { format!("{sensing}, {estimator}") }
}

fn series(colour: usize, arm: (&str, &str), points: Vec<(f64, f64)>) -> Series {
    if arm.0 == "distributive" {
        Series::line(name(arm), colour, points)
    } else {
        Series::dashes(name(arm), colour, points)
    }
}
