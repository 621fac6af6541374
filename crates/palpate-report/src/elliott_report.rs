//! The report of Elliott's chain: its error by the number of components, beside the influence locator and the limit.

use maud::{Markup, html};

use super::numbers::{mm, number, spread};
use super::page::{Figure, Figures, Page, Section, Table, numeric, short, text};
use super::{
    Axis, Chart, ErrorPoint, Marker, ReportError, ReportFile, Series, SeriesKind, Stroke, chart_to_svg,
};
use palpate_estimators::evaluation::Spread;
use palpate_studies::elliott::{Chain, ChainRow, Elliott, ElliottFindings, INNER};

/// Reports the study: `report.html`, one self-contained page, and its figures as SVG and PNG files.
///
/// # Errors
/// [`ReportError`] when a figure does not become a picture.
pub fn elliott_report(study: &Elliott, findings: &ElliottFindings) -> Result<Vec<ReportFile>, ReportError> {
    let report = ElliottReport { study, findings };
    let figures = Figures(vec![report.pressed_figure(1), report.moving_figure(2), report.variance_figure(3)]);
    let section = |id, heading, body| Section { id, heading, body };
    let page = Page {
        title: "Elliott’s chain: components of readings, and a network".to_owned(),
        opening: report.summary(),
        sections: vec![
            section("components", "Errors by the number of components", figures.show(1)),
            section("moving", "A load that moves", figures.show(2)),
            section("variance", "What the components carry", figures.show(3)),
            section("table", "All chains", report.table(1)),
            section("how", "How it was done", report.how()),
        ],
        footer: html! { p { "Made by palpate " (env!("CARGO_PKG_VERSION")) ", seed " (study.seed) "." } },
    };
    page.into_files(figures)
}

struct ElliottReport<'a> {
    study: &'a Elliott,
    findings: &'a ElliottFindings,
}

impl ElliottReport<'_> {
    fn row(&self, chain: Chain) -> Option<&ChainRow> {
        self.findings.rows.iter().find(|row| row.chain == chain)
    }

    /// The chains on components, with how many.
    fn by_components(&self) -> impl Iterator<Item = (f64, &ChainRow)> {
        self.findings.rows.iter().filter_map(|row| match row.chain {
            Chain::Components(count) => Some((count as f64, row)),
            _ => None,
        })
    }

    fn summary(&self) -> Markup {
        let best = self
            .by_components()
            .filter_map(|(count, row)| Some((count, row.error_m?.median)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let pressed = |chain| self.row(chain).and_then(|row| row.error_m);
        let moving = |chain| self.row(chain).map(|row| row.moving_error_m.median * 1e3);
        html! {
            div.summary { ul {
                @if let Some((count, error_m)) = best {
                    li { "The chain is best with " b { (count) " components" } ": mean error " b { (number(error_m * 1e3)) " mm" } "." }
                }
                @if let Some(error) = pressed(Chain::Readings) {
                    li { "The same network on all readings: " (number(error.median * 1e3)) " mm." }
                }
                @if let (Some(error), Some(limit_m)) = (pressed(Chain::Influence), self.row(Chain::Influence).and_then(|row| row.limit_m)) {
                    li {
                        "The influence locator on the same readings: " b { (number(error.median * 1e3)) " mm" } ", "
                        (number(error.median / limit_m)) " times the limit, " (number(limit_m * 1e3)) " mm."
                    }
                }
                @if let (Some(single), Some(filter), Some(smoother)) = (moving(Chain::Influence), moving(Chain::Filter), moving(Chain::Smoother)) {
                    li {
                        "Under a load that moves it is off by " (number(single)) " mm reading by reading, its filter by " (number(filter))
                        " mm and its smoother by " (number(smoother)) " mm."
                    }
                }
            } }
        }
    }

    fn pressed_figure(&self, number: usize) -> Figure {
        let mut series = vec![self.bars("network on components", 0, |row| row.error_m)];
        let limits = self.by_components().filter_map(|(count, row)| Some((count, row.limit_m? * 1e3)));
        let kind = SeriesKind::Line { points: limits.collect(), stroke: Stroke::Dashed };
        series.push(Series { label: "limit of these components".to_owned(), colour: 6, kind });
        series.extend(self.across(|row| row.error_m));
        let chart =
            Chart { title: "Error by the number of components".to_owned(), series, ..self.by_count() };
        let caption = html! {
            "Mean error of one press at each of some 400 places, within the inner " (INNER * 100.0) " % of the plate: medians over \
             the calibrations, bars from the 5th to the 95th percentile. The limit is the Cramér–Rao bound of what the components hold."
        };
        figure(number, &chart, caption)
    }

    fn moving_figure(&self, number: usize) -> Figure {
        let mut series = vec![self.bars("network on components", 0, |row| Some(row.moving_error_m))];
        series.extend(self.across(|row| Some(row.moving_error_m)));
        let chart = Chart { title: "Error under a load that moves".to_owned(), series, ..self.by_count() };
        let caption = html! { "Mean error of the readings of the moving load, one by one but for filter and smoother." };
        figure(number, &chart, caption)
    }

    fn variance_figure(&self, number: usize) -> Figure {
        let shares = self.findings.variance_percent.iter().enumerate();
        let points = shares.map(|(i, percent)| (i as f64 + 1.0, *percent)).collect();
        let kind = SeriesKind::Points { points, marker: Marker::Circle };
        let chart = Chart {
            title: "What each component carries".to_owned(),
            x: Axis::linear("component").from_to(0.0, self.findings.variance_percent.len() as f64 + 1.0),
            y: Axis::log10("share of the readings’ variance, %"),
            series: vec![Series { label: "component".to_owned(), colour: 0, kind }],
            ..Chart::default()
        };
        let caption = html! { "Of the first calibration. Where the shares level off, components are noise and nothing else." };
        figure(number, &chart, caption)
    }

    fn by_count(&self) -> Chart {
        let counts: Vec<f64> = self.by_components().map(|(count, _)| count).collect();
        Chart {
            x: Axis::log10("components").ticks_at(counts),
            y: Axis::log10("mean error, mm"),
            height_px: 520,
            ..Chart::default()
        }
    }

    fn bars(&self, label: &str, colour: usize, error: fn(&ChainRow) -> Option<Spread>) -> Series {
        let point = |(x, row): (f64, &ChainRow)| {
            let Spread { median, p05, p95 } = error(row)?;
            Some(ErrorPoint { x, y: median * 1e3, low: p05 * 1e3, high: p95 * 1e3 })
        };
        let points = self.by_components().filter_map(point).collect();
        let kind = SeriesKind::ErrorBars { points, marker: Marker::Circle };
        Series { label: label.to_owned(), colour, kind }
    }

    /// The chains that do not depend on a number of components: a line across each.
    fn across(&self, error: fn(&ChainRow) -> Option<Spread>) -> impl Iterator<Item = Series> {
        let chains = [
            (Chain::Readings, "network on all readings", 1),
            (Chain::Influence, "influence locator", 2),
            (Chain::Filter, "its filter", 3),
            (Chain::Smoother, "its smoother", 5),
        ];
        let counts: Vec<f64> = self.by_components().map(|(count, _)| count).collect();
        chains.into_iter().filter_map(move |(chain, name, colour)| {
            let median_mm = error(self.row(chain)?)?.median * 1e3;
            let points = counts.iter().map(|count| (*count, median_mm)).collect();
            let kind = SeriesKind::Line { points, stroke: Stroke::Solid };
            Some(Series { label: format!("{name}, {} mm", number(median_mm)), colour, kind })
        })
    }

    fn table(&self, table: usize) -> Markup {
        let row = |row: &ChainRow| {
            let mm = |error: Spread| spread(scaled(error), number);
            let over = row.error_m.zip(row.limit_m).map(|(error, limit_m)| error.median / limit_m);
            vec![
                text(chain_in_words(row.chain)),
                text(row.error_m.map_or_else(dash, mm)),
                text(row.limit_m.map_or_else(dash, |limit_m| number(limit_m * 1e3))),
                text(over.map_or_else(dash, number)),
                text(row.effective_percent.map_or_else(dash, |percent| spread(percent, number))),
                text(mm(row.moving_error_m)),
            ]
        };
        Table {
            number: table,
            caption: html! {
                "Mean errors within the inner plate and under the moving load, over " (self.study.calibrations) " calibrations: median and \
                 5th to 95th percentile. Limit: of what the chain sees, a reading at a time."
            },
            columns: vec![
                short("chain"),
                numeric("error, mm"),
                numeric("limit, mm"),
                numeric("ratio"),
                numeric("effective area, %"),
                numeric("moving, mm"),
            ],
            rows: self.findings.rows.iter().map(row).collect(),
        }
        .markup()
    }

    fn how(&self) -> Markup {
        html! {
            p {
                "After Elliott and others, who told the place of a load that moves over a plate from principal components of a grid \
                 of sensors by a back-propagation network. Here the readings of " (self.study.rig.bench.layout.len()) " sensors, less \
                 their mean and over their noise, are turned onto the eigenvectors of their covariance over the presses of a \
                 calibration (Karhunen–Loève), and the first components, each scaled to variance 1, are what a network with one hidden \
                 layer sees. Networks stop after " (super::numbers::whole(f64::from(self.study.presentations))) " presentations. The effective area \
                 counts errors within " (mm(self.study.tolerance_m)) " mm. The plate is in balance at every reading; sensing positions \
                 are those of the rig."
            }
        }
    }
}

/// A chain's name.
pub fn chain_in_words(chain: Chain) -> String {
    match chain {
        Chain::Components(count) => format!("network on {count} components"),
        Chain::Readings => "network on all readings".to_owned(),
        Chain::Influence => "influence locator".to_owned(),
        Chain::Filter => "influence locator, filter".to_owned(),
        Chain::Smoother => "influence locator, smoother".to_owned(),
    }
}

fn dash() -> String {
    super::numbers::NOTHING.to_owned()
}

fn scaled(error: Spread) -> Spread {
    Spread { median: error.median * 1e3, p05: error.p05 * 1e3, p95: error.p95 * 1e3 }
}

fn figure(number: usize, chart: &Chart, caption: Markup) -> Figure {
    Figure { number, alternative: chart.title.clone(), svg: chart_to_svg(chart), caption }
}
