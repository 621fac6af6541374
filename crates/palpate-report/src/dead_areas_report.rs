//! The report of dead areas: errors between sensors, by estimator and by how many sensors there are.

use maud::{Markup, html};

use super::numbers::{mm, number};
use super::page::{Figure, Figures, Page, Section, Table, numeric, short, text};
use super::{Axis, Chart, Mark, ReportError, ReportFile, Series, SeriesKind, Stroke, chart_to_svg};
use palpate_studies::dead_areas::{DeadAreaFindings, DeadAreaRow, DeadAreas};

/// Reports the dead areas: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn dead_areas_report(
    study: &DeadAreas,
    findings: &DeadAreaFindings,
) -> Result<Vec<ReportFile>, ReportError> {
    let report = DeadAreasReport { study, findings };
    let mut figures = vec![report.effective_figure(1)];
    let drawn = study.counts.iter().enumerate().map(|(i, count)| report.folded_figure(i + 2, *count));
    figures.extend(drawn);
    let figures = Figures(figures);
    let section = |id, heading, body| Section { id, heading, body };
    let folded: Vec<usize> = (0..study.counts.len()).map(|i| i + 2).collect();
    let page = Page {
        title: "Dead areas between sensors".to_owned(),
        opening: report.summary(),
        sections: vec![
            section(
                "counts",
                "How much is located, by the number of sensors",
                html! { (figures.show(1)) (report.effective_table(1)) },
            ),
            section(
                "between",
                "Errors between sensors",
                html! { @for i in &folded { (figures.show(*i)) } (report.folded_table(2)) },
            ),
            section("how", "How it was done", report.how()),
        ],
        footer: html! { p { "Made by palpate " (env!("CARGO_PKG_VERSION")) ", seed " (study.seed) "." } },
    };
    page.into_files(figures)
}

struct DeadAreasReport<'a> {
    study: &'a DeadAreas,
    findings: &'a DeadAreaFindings,
}

impl DeadAreasReport<'_> {
    /// Each sensing with each of its estimators, in order of appearance.
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

    fn summary(&self) -> Markup {
        let range = |arm: (&str, &str)| {
            let shares = self.study.counts.iter().filter_map(|count| self.row(arm, *count));
            let shares: Vec<f64> = shares.map(|row| row.effective_percent).collect();
            let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
            let most = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            format!("{}–{} %", number(least), number(most))
        };
        let counts: Vec<String> = self.study.counts.iter().map(usize::to_string).collect();
        html! {
            div.summary {
                p { "Effective length (errors within " (mm(self.study.tolerance_m)) " mm) over " (counts.join(", ")) " sensors:" }
                ul { @for arm in self.arms() { li { (name(arm)) ": " b { (range(arm)) } } } }
            }
        }
    }

    fn effective_figure(&self, number: usize) -> Figure {
        let line = |(i, arm): (usize, (&str, &'static str))| {
            let counts = self.study.counts.iter();
            let points =
                counts.filter_map(|count| Some((*count as f64, self.row(arm, *count)?.effective_percent)));
            series(i, arm, points.collect())
        };
        let counts: Vec<f64> = self.study.counts.iter().map(|count| *count as f64).collect();
        let chart = Chart {
            title: "Effective length by the number of sensors".to_owned(),
            x: Axis::log10("sensors").ticks_at(counts),
            y: Axis::linear("effective length, %").from_to(0.0, 100.0),
            series: self.arms().into_iter().enumerate().map(line).collect(),
            height_px: 560,
            ..Chart::default()
        };
        let caption = html! {
            "Share of the contacts, every 1/400 of the length, that are located within " (mm(self.study.tolerance_m))
            " mm. Solid: sensors under one surface; dashed: sensors of an array, each of which sees only what is near."
        };
        figure(number, &chart, caption)
    }

    fn folded_figure(&self, number: usize, count: usize) -> Figure {
        let line = |(i, arm): (usize, (&str, &'static str))| {
            let row = self.row(arm, count)?;
            let points = row.folded.folds.iter().map(|fold| (fold.pitches, fold.mean_error_m * 1e3));
            Some(series(i, arm, points.collect()))
        };
        let chart = Chart {
            title: format!("Errors between {count} sensors"),
            x: Axis::linear("distance from the nearest sensor, in pitches").from_to(0.0, 0.5),
            y: Axis::log10("mean error, mm"),
            series: self.arms().into_iter().enumerate().filter_map(line).collect(),
            marks: vec![Mark::HorizontalLine {
                y: self.study.tolerance_m * 1e3,
                label: format!("tolerance, {} mm", mm(self.study.tolerance_m)),
            }],
            height_px: 560,
            ..Chart::default()
        };
        let caption = html! {
            "Mean error from over a sensor (left) to half-way between two (right), folded over all gaps between " (count)
            " sensors. A dead area is a line that rises to the right."
        };
        figure(number, &chart, caption)
    }

    fn effective_table(&self, table: usize) -> Markup {
        let row = |arm: (&str, &'static str)| {
            let cell = |count: &usize| {
                text(number(self.row(arm, *count).map_or(f64::NAN, |row| row.effective_percent)))
            };
            std::iter::once(text(name(arm))).chain(self.study.counts.iter().map(cell)).collect()
        };
        let counts = self.study.counts.iter().map(|count| numeric(format!("{count} sensors")));
        Table {
            number: table,
            caption: html! { "Effective length in %. A dash: the estimator could not be fitted." },
            columns: std::iter::once(short("sensing, estimator")).chain(counts).collect(),
            rows: self.arms().into_iter().map(row).collect(),
        }
        .markup()
    }

    fn folded_table(&self, table: usize) -> Markup {
        let row = |row: &DeadAreaRow| {
            vec![
                text(name((&row.sensing, row.estimator))),
                text(row.sensors.to_string()),
                text(number(row.folded.at_sensors_m * 1e3)),
                text(number(row.folded.between_m * 1e3)),
                text(number(row.folded.between_m / row.folded.at_sensors_m)),
                text(number(row.folded.dead_percent)),
            ]
        };
        Table {
            number: table,
            caption: html! {
                "Mean errors within a tenth of a pitch from a sensor and from the middle of a gap, their ratio, and the share of the \
                 contacts between the outermost sensors that are off by more than the tolerance."
            },
            columns: vec![
                short("sensing, estimator"),
                numeric("sensors"),
                numeric("over sensors, mm"),
                numeric("between, mm"),
                numeric("ratio"),
                numeric("dead, %"),
            ],
            rows: self.findings.rows.iter().map(row).collect(),
        }
        .markup()
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
            @for (sensing, estimator, sensors, why) in &self.findings.left_out {
                p { (sensing) ", " (estimator) ", " (sensors) " sensors: left out, as " (why) "." }
            }
        }
    }
}

fn name((sensing, estimator): (&str, &str)) -> String {
    if sensing == "distributive" { estimator.to_owned() } else { format!("{sensing}, {estimator}") }
}

fn series(colour: usize, arm: (&str, &str), points: Vec<(f64, f64)>) -> Series {
    let stroke = if arm.0 == "distributive" { Stroke::Solid } else { Stroke::Dashed };
    Series { label: name(arm), colour, kind: SeriesKind::Line { points, stroke } }
}

fn figure(number: usize, chart: &Chart, caption: Markup) -> Figure {
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(chart), caption }
}
