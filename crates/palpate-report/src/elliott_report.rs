use maud::{Markup, html};

use super::numbers::{NOTHING, mm, number, quantile_range, whole};
use super::page::{Figure, Page, ReportFile, Section, Table};
use super::{Axis, Chart, ErrorPoint, Marker, Series};
use palpate_estimators::evaluation::Quantiles;
use palpate_studies::elliott::{Chain, ChainRow, Elliott, ElliottResults, INNER};

/// `report.html` and SVG figures.
pub fn elliott_report(study: &Elliott, findings: &ElliottResults) -> Vec<ReportFile> {
    let report = ElliottReport { study, findings };
    let sections = vec![
        Section::new("components", "Errors by the number of components").figure(report.pressed_figure()),
        Section::new("moving", "A load that moves").figure(report.moving_figure()),
        Section::new("variance", "What the components carry").figure(report.variance_figure()),
        Section::new("table", "All chains").table(report.table()),
        Section::new("how", "How it was done").text(report.how()),
    ];
    Page::new("Elliott’s chain: components of readings, and a network", report.summary(), sections)
        .with_source(html! { ", seed " (study.seed) })
        .files()
}

struct ElliottReport<'a> {
    study: &'a Elliott,
    findings: &'a ElliottResults,
}

impl ElliottReport<'_> {
    fn row(&self, chain: Chain) -> Option<&ChainRow> {
        self.findings.rows.iter().find(|row| row.chain == chain)
    }

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
            @if let Some((count, error_m)) = best {
                li { "The chain is best with " b { (count) " components" } ": mean error " b { (number(error_m * 1e3)) " mm" } "." }
            }
            @if let Some(error) = pressed(Chain::Readings) {
                li { "This network on all readings: " (number(error.median * 1e3)) " mm." }
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
        }
    }

    fn pressed_figure(&self) -> Figure {
        let limits = self.by_components().filter_map(|(count, row)| Some((count, row.limit_m? * 1e3)));
        let mut series = vec![
            self.bars("network on components", 0, |row| row.error_m),
            Series::dashes("limit of these components", 6, limits.collect()),
        ];
        series.extend(self.across(|row| row.error_m));
        let caption = html! {
            "Mean error of one press at each of some 400 places, within the inner " (INNER * 100.0) " % of the plate: medians over \
             the calibrations, bars from the 5th to the 95th percentile. The limit is the Cramér–Rao bound of the components."
        };
        Figure::chart(&self.by_count("Error by the number of components", series), caption)
    }

    fn moving_figure(&self) -> Figure {
        let mut series = vec![self.bars("network on components", 0, |row| Some(row.moving_error_m))];
        series.extend(self.across(|row| Some(row.moving_error_m)));
        let caption = html! { "Mean error of the readings of the moving load, one by one but for filter and smoother." };
        Figure::chart(&self.by_count("Error under a load that moves", series), caption)
    }

    fn variance_figure(&self) -> Figure {
        let shares = self.findings.variance_percent.iter().enumerate();
        let points: Vec<(f64, f64)> = shares.map(|(i, percent)| (i as f64 + 1.0, *percent)).collect();
        let x = Axis::linear("component").from_to(0.0, points.len() as f64 + 1.0);
        let y = Axis::log10("share of the readings’ variance, %");
        let series = vec![Series::markers("component", 0, points, Marker::Circle)];
        let caption =
            html! { "Of the first calibration. Where the shares level off, components are only noise." };
        Figure::chart(&Chart::new("What each component carries", x, y, series), caption)
    }

    fn by_count(&self, title: &str, series: Vec<Series>) -> Chart {
        let counts: Vec<f64> = self.by_components().map(|(count, _)| count).collect();
        let x = Axis::log10("components").ticks_at(counts);
        Chart::new(title, x, Axis::log10("mean error, mm"), series).with_height(520)
    }

    fn bars(&self, label: &str, colour: usize, error: fn(&ChainRow) -> Option<Quantiles>) -> Series {
        let point = |(x, row): (f64, &ChainRow)| {
            let Quantiles { median, p05, p95 } = error(row)?.scaled(1e3);
            Some(ErrorPoint { x, y: median, low: p05, high: p95 })
        };
        let points = self.by_components().filter_map(point).collect();
        Series::error_bars(label, colour, points, Marker::Circle)
    }

    /// Chains independent of the number of components.
    fn across(&self, error: fn(&ChainRow) -> Option<Quantiles>) -> impl Iterator<Item = Series> {
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
            Some(Series::line(format!("{name}, {} mm", number(median_mm)), colour, points))
        })
    }

    fn table(&self) -> Table {
        let caption = html! {
            "Mean errors within the inner plate and under the moving load, over " (self.study.calibrations) " calibrations: median and \
             5th to 95th percentile. Limit: of the inputs of the chain, for one reading."
        };
        let shown = |figure: Option<Quantiles>| {
            figure.map_or_else(|| NOTHING.to_owned(), |figure| quantile_range(figure, number))
        };
        Table::from_rows(&self.findings.rows)
            .short("chain", |row| row.chain.to_string())
            .numeric("error, mm", |row| shown(row.error_m.map(|error| error.scaled(1e3))))
            .mm("limit, mm", |row| row.limit_m)
            .number("ratio", |row| {
                row.error_m.zip(row.limit_m).map(|(error, limit_m)| error.median / limit_m)
            })
            .numeric("effective area, %", |row| shown(row.effective_percent))
            .numeric("moving, mm", |row| shown(Some(row.moving_error_m.scaled(1e3))))
            .caption(caption)
    }

    fn how(&self) -> Markup {
        html! {
            p {
                "After Elliott and others, who located a load that moves over a plate from principal components of a grid of \
                 sensors by a back-propagation network. Here the readings of "
                (self.study.rig.setup.layout().len()) " sensors, less \
                 their mean and over their noise, are turned onto the eigenvectors of their covariance over the presses of a \
                 calibration (Karhunen–Loève), and the first components, each scaled to variance 1, are what a network with one hidden \
                 layer sees. Networks stop after " (whole(f64::from(self.study.presentations))) " presentations. The effective area \
                 counts errors within " (mm(self.study.tolerance_m)) " mm. The plate is in balance at every reading; sensing positions \
                 are those of the rig."
            }
        }
    }
}
