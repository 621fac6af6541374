//! Layout of a chart, in pixels.
//!
//! Texts, plot and legend have strips of their own, so no text lies over data.

use super::axis::{
    AxisScale, LABEL_GAP, TICK_GAP, TICK_SIZE, Tick, choose_ticks, columns_fit, rows_fit, tick_labels,
};
use super::chart::{Chart, Mark, Series, SeriesKind};
use super::geometry::{Point, Rect};
use super::svg::{Anchor, INK, Label, QUIET_INK};
use super::text;

const MARGIN: f64 = 12.0;
const TITLE_SIZE: f64 = 15.0;
const TITLE_LINE: f64 = 22.0;
const AXIS_LABEL_SIZE: f64 = 12.5;
const AXIS_LABEL_LINE: f64 = 20.0;
const TICK_LINE: f64 = 24.0;
const MARK_SIZE: f64 = 11.5;
const MARK_LINE: f64 = 17.0;
const STRIP_GAP: f64 = 8.0;
const MARK_ROWS: usize = 3;
const LEAST_PLOT_SHARE: f64 = 0.25;
/// Half of the widest tick label.
const LEAST_GUTTER: f64 = 44.0;
/// Half of the widest tick label.
const OVERHANG: f64 = 36.0;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout<'a> {
    pub width_px: u32,
    pub height_px: u32,
    pub plot: Rect,
    pub x: AxisScale,
    pub y: AxisScale,
    pub x_ticks: Vec<Tick>,
    pub y_ticks: Vec<Tick>,
    pub labels: Vec<Label>,
    pub legend: Legend<'a>,
}

impl<'a> Layout<'a> {
    pub fn new(chart: &'a Chart) -> Self {
        let (width_px, height_px) = (chart.width_px.clamp(320, 4000), chart.height_px.clamp(280, 4000));
        let (width, height) = (f64::from(width_px), f64::from(height_px));
        let (x_values, y_values) = values(chart);
        let (x, y) = (AxisScale::new(&chart.x, &x_values), AxisScale::new(&chart.y, &y_values));

        let (mut labels, header_bottom) = header(chart, width);
        let most_mark_rows = if vertical_names(chart).next().is_some() { MARK_ROWS } else { 0 };
        let footer = TICK_LINE + line_if(&chart.x.label, AXIS_LABEL_LINE) + STRIP_GAP + MARGIN;
        let free = height - header_bottom - most_mark_rows as f64 * MARK_LINE - footer;
        let least_plot = (LEAST_PLOT_SHARE * height).max(60.0);
        let legend_rows = ((free - least_plot) / ROW_HEIGHT).floor().max(1.0) as usize;
        let legend = Legend::new(chart, width - 2.0 * MARGIN, legend_rows);

        let least_height = free - legend.height;
        let y_ticks = choose_ticks(&y, chart.y.ticks.as_deref(), &|ticks| rows_fit(&y, ticks, least_height));
        let left = MARGIN + (widest(&y_ticks) + TICK_GAP).max(LEAST_GUTTER);
        let least_width = width - left - MARGIN - OVERHANG;
        let x_ticks =
            choose_ticks(&x, chart.x.ticks.as_deref(), &|ticks| columns_fit(&x, ticks, least_width));
        let right = width - MARGIN - overhang(&x, &x_ticks, least_width);

        let (mark_rows, mark_labels) = mark_labels(chart, &x, (left, right), header_bottom);
        let plot = Rect {
            left,
            right,
            top: header_bottom + mark_rows as f64 * MARK_LINE,
            bottom: height - footer - legend.height,
        };
        labels.extend(mark_labels);
        labels.extend(tick_labels(&plot, (&x, &x_ticks), (&y, &y_ticks)));
        labels.extend(x_axis_label(chart, &plot, width));
        let legend_left = left.min(width - MARGIN - legend.width).max(MARGIN);
        let legend_top = height - MARGIN - legend.height;
        let legend = legend.translate(legend_left, legend_top);
        Layout { width_px, height_px, plot, x, y, x_ticks, y_ticks, labels, legend }
    }

    /// Maps data to pixels; `None` for an undrawable point.
    pub fn place(&self, x: f64, y: f64) -> Option<Point> {
        Some((self.x_px(self.x.share(x)?), self.y_px(self.y.share(y)?)))
    }

    /// Maps data to pixels; `None` outside the plot.
    pub fn place_inside(&self, x: f64, y: f64) -> Option<Point> {
        self.place(x, y).filter(|&at| self.plot.contains(at))
    }

    /// [`Self::place`], but a non-positive y lies on the low end of a logarithmic axis.
    pub fn place_edge(&self, x: f64, y: f64) -> Option<Point> {
        Some((self.x_px(self.x.share(x)?), self.y_px(self.y.share_or_low_end(y)?)))
    }

    pub fn x_px(&self, share: f64) -> f64 {
        self.plot.left + share * self.plot.width()
    }

    pub fn y_px(&self, share: f64) -> f64 {
        self.plot.bottom - share * self.plot.height()
    }
}

fn line_if(text: &str, line: f64) -> f64 {
    if text.trim().is_empty() { 0.0 } else { line }
}

/// Also returns the top of the room beneath the header.
fn header(chart: &Chart, width: f64) -> (Vec<Label>, f64) {
    let room = width - 2.0 * MARGIN;
    let at_left = |text: String, top: f64, line: f64, size: f64, colour| Label {
        text,
        at: (MARGIN, top + line / 2.0),
        anchor: Anchor::Start,
        size,
        colour,
    };
    let (mut labels, mut top) = (Vec::new(), MARGIN);
    for line in text::wrap(&chart.title, TITLE_SIZE, room, 2) {
        labels.push(at_left(line, top, TITLE_LINE, TITLE_SIZE, INK));
        top += TITLE_LINE;
    }
    for line in text::wrap(&chart.y.label, AXIS_LABEL_SIZE, room, 1) {
        labels.push(at_left(line, top, AXIS_LABEL_LINE, AXIS_LABEL_SIZE, QUIET_INK));
        top += AXIS_LABEL_LINE;
    }
    (labels, top + STRIP_GAP)
}

fn x_axis_label(chart: &Chart, plot: &Rect, width: f64) -> Option<Label> {
    let text = text::wrap(&chart.x.label, AXIS_LABEL_SIZE, width - 2.0 * MARGIN, 1).pop()?;
    let half = text::width(&text, AXIS_LABEL_SIZE) / 2.0;
    let middle = (plot.left.midpoint(plot.right)).min(width - MARGIN - half).max(MARGIN + half);
    Some(Label {
        text,
        at: (middle, plot.bottom + TICK_LINE + AXIS_LABEL_LINE / 2.0),
        anchor: Anchor::Middle,
        size: AXIS_LABEL_SIZE,
        colour: QUIET_INK,
    })
}

fn vertical_names(chart: &Chart) -> impl Iterator<Item = ((f64, f64), &str)> {
    chart
        .marks
        .iter()
        .filter_map(|mark| match mark {
            Mark::VerticalLine { x, label } => Some(((*x, *x), label.as_str())),
            Mark::Span { low, high, label } => Some(((*low, *high), label.as_str())),
            Mark::HorizontalLine { .. } => None,
        })
        .filter(|(_, label)| !label.trim().is_empty())
}

/// Lowest row first; also returns the number of rows.
fn mark_labels(chart: &Chart, x: &AxisScale, (left, right): (f64, f64), top: f64) -> (usize, Vec<Label>) {
    let mut rows = text::Rows::default();
    let mut placed = Vec::new();
    for ((low, high), name) in vertical_names(chart) {
        let (Some(start), Some(end)) = (x.share(low.min(high)), x.share(low.max(high))) else { continue };
        if end < 0.0 || start > 1.0 {
            continue;
        }
        let name = text::fit(name, MARK_SIZE, right - left);
        let half = text::width(&name, MARK_SIZE) / 2.0;
        let share = (start.max(0.0) + end.min(1.0)) / 2.0;
        let middle = (left + share * (right - left)).min(right - half).max(left + half);
        let (from, to) = (middle - half - LABEL_GAP / 2.0, middle + half + LABEL_GAP / 2.0);
        if rows.first_free(from, to) < MARK_ROWS {
            placed.push((name, middle, rows.place(from, to)));
        }
    }
    let at =
        |middle, row: usize| (middle, top + (rows.count() - row) as f64 * MARK_LINE - MARK_LINE / 2.0 - 2.0);
    let labels = placed.into_iter().map(|(text, middle, row)| Label {
        text,
        at: at(middle, row),
        anchor: Anchor::Middle,
        size: MARK_SIZE,
        colour: QUIET_INK,
    });
    (rows.count(), labels.collect())
}

fn widest(ticks: &[Tick]) -> f64 {
    ticks.iter().map(|tick| text::width(&tick.label, TICK_SIZE)).fold(0.0, f64::max)
}

fn overhang(axis: &AxisScale, ticks: &[Tick], width: f64) -> f64 {
    let reach = ticks.last().map_or(0.0, |tick| {
        let half = text::width(&tick.label, TICK_SIZE) / 2.0;
        half - (1.0 - axis.tick_share(tick.value)) * width
    });
    reach.clamp(4.0, OVERHANG)
}

fn values(chart: &Chart) -> (Vec<f64>, Vec<f64>) {
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for series in &chart.series {
        match &series.kind {
            SeriesKind::Line { points, .. } | SeriesKind::Points { points, .. } => {
                for &(x, y) in points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
                    xs.push(x);
                    ys.push(y);
                }
            }
            SeriesKind::Band { points } => {
                xs.extend(points.iter().map(|point| point.x));
                ys.extend(points.iter().flat_map(|point| [point.low, point.high]));
            }
            SeriesKind::ErrorBars { points, .. } => {
                xs.extend(points.iter().map(|point| point.x));
                ys.extend(points.iter().flat_map(|point| [point.low, point.y, point.high]));
            }
        }
    }
    for mark in &chart.marks {
        match mark {
            Mark::VerticalLine { x, .. } => xs.push(*x),
            Mark::HorizontalLine { y, .. } => ys.push(*y),
            Mark::Span { low, high, .. } => xs.extend([*low, *high]),
        }
    }
    (xs, ys)
}

const ROW_HEIGHT: f64 = 20.0;
const NAME_SIZE: f64 = 12.0;
const SWATCH_WIDTH: f64 = 24.0;
const INDENT: f64 = 31.0;
const GAP: f64 = 18.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LegendItem<'a> {
    Series(&'a Series),
    Reference,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry<'a> {
    pub named: LegendItem<'a>,
    /// Box of the sample.
    pub swatch: Rect,
    pub label: Label,
    pub area: Rect,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Legend<'a> {
    pub entries: Vec<Entry<'a>>,
    /// Remark with the number of names without room.
    pub remainder: Option<Label>,
    pub width: f64,
    pub height: f64,
}

impl<'a> Legend<'a> {
    pub fn new(chart: &'a Chart, width: f64, most_rows: usize) -> Self {
        let names: Vec<(LegendItem<'_>, String)> =
            names(chart).map(|(named, name)| (named, text::fit(name, NAME_SIZE, width - INDENT))).collect();
        let mut kept = names.len();
        let mut places = arrange(&names, kept, width);
        while kept > 0 && places.last().is_some_and(|place| place.row >= most_rows) {
            kept -= 1;
            places = arrange(&names, kept, width);
        }
        if places.last().is_some_and(|place| place.row >= most_rows) {
            places.clear();
        }
        let entries =
            names.iter().zip(&places).take(kept).map(|((named, name), place)| entry(*named, name, place));
        Legend {
            entries: entries.collect(),
            remainder: places
                .get(kept)
                .map(|place| label(remainder(names.len() - kept), place.left, place.row)),
            width: places.iter().map(|place| place.left + place.width).fold(0.0, f64::max),
            height: places.last().map_or(0.0, |place| (place.row + 1) as f64 * ROW_HEIGHT),
        }
    }

    pub fn translate(mut self, left: f64, top: f64) -> Self {
        for entry in &mut self.entries {
            entry.swatch = entry.swatch.translate(left, top);
            entry.area = entry.area.translate(left, top);
        }
        for label in self.entries.iter_mut().map(|entry| &mut entry.label).chain(&mut self.remainder) {
            label.at = (label.at.0 + left, label.at.1 + top);
        }
        self
    }
}

struct Place {
    left: f64,
    row: usize,
    width: f64,
}

fn arrange(names: &[(LegendItem<'_>, String)], kept: usize, width: f64) -> Vec<Place> {
    let mut widths: Vec<f64> =
        names[..kept].iter().map(|(_, name)| INDENT + text::width(name, NAME_SIZE)).collect();
    if kept < names.len() {
        widths.push(text::width(&remainder(names.len() - kept), NAME_SIZE));
    }
    let (mut left, mut row) = (0.0, 0);
    let mut places = Vec::new();
    for entry_width in widths {
        if left > 0.0 && left + entry_width > width {
            (left, row) = (0.0, row + 1);
        }
        places.push(Place { left, row, width: entry_width });
        left += entry_width + GAP;
    }
    places
}

fn names(chart: &Chart) -> impl Iterator<Item = (LegendItem<'_>, &str)> {
    let series = chart.series.iter().map(|series| (LegendItem::Series(series), series.label.as_str()));
    let references = chart.marks.iter().filter_map(|mark| match mark {
        Mark::HorizontalLine { label, .. } => Some((LegendItem::Reference, label.as_str())),
        Mark::VerticalLine { .. } | Mark::Span { .. } => None,
    });
    series.chain(references).filter(|(_, name)| !name.trim().is_empty())
}

fn remainder(count: usize) -> String {
    format!("and {count} more")
}

fn label(text: String, left: f64, row: usize) -> Label {
    let middle = (row as f64 + 0.5) * ROW_HEIGHT;
    Label { text, at: (left, middle), anchor: Anchor::Start, size: NAME_SIZE, colour: INK }
}

fn entry<'a>(named: LegendItem<'a>, name: &str, place: &Place) -> Entry<'a> {
    let top = place.row as f64 * ROW_HEIGHT;
    let left = place.left;
    Entry {
        named,
        swatch: Rect { left, top: top + 4.0, right: left + SWATCH_WIDTH, bottom: top + ROW_HEIGHT - 4.0 },
        label: label(name.to_owned(), left + INDENT, place.row),
        area: Rect { left, top, right: left + place.width, bottom: top + ROW_HEIGHT },
    }
}
