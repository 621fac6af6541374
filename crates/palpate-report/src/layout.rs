//! Where everything of a chart goes, in pixels: settled before anything is drawn, so that it can be tested.
//!
//! From top to bottom: title, label of the vertical axis, names of vertical marks, plot, tick labels, label of
//! the horizontal axis, legend. Each has a strip of its own, so no text can lie over data.

use super::canvas::{Anchor, INK, Label, QUIET_INK};
use super::chart::{Chart, Mark};
use super::geometry::{Point, Rect};
use super::legend::{self, Legend};
use super::scale::{self, AxisScale};
use super::text;
use super::ticks::{self, Tick};

const MARGIN: f64 = 12.0;
const TITLE_SIZE: f64 = 15.0;
const TITLE_LINE: f64 = 22.0;
const AXIS_LABEL_SIZE: f64 = 12.5;
const AXIS_LABEL_LINE: f64 = 20.0;
const TICK_SIZE: f64 = 11.5;
const TICK_LINE: f64 = 24.0;
const MARK_SIZE: f64 = 11.5;
const MARK_LINE: f64 = 17.0;
/// From the header to the plot or the names of marks, and from the axis label to the legend.
const STRIP_GAP: f64 = 8.0;
/// Most rows of names above the plot.
const MARK_ROWS: usize = 3;
/// From the plot to the labels of the vertical axis.
const TICK_GAP: f64 = 8.0;
/// From the plot down to the middle of the labels of the horizontal axis.
const TICK_DROP: f64 = 16.0;
/// Share of the image's height that the legend leaves to the plot.
const LEAST_PLOT_SHARE: f64 = 0.25;
/// Least distances between neighbouring tick labels, and between their middles.
const LABEL_GAP: f64 = 14.0;
const LEAST_X_PITCH: f64 = 40.0;
const LEAST_Y_PITCH: f64 = 26.0;
/// Least room left of the plot: half of the widest label of a tick.
const LEAST_GUTTER: f64 = 44.0;
/// Half of the widest label of a tick, which may stand at the right end of the axis.
const OVERHANG: f64 = 36.0;

/// The places of all parts of one chart.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout<'a> {
    pub width_px: u32,
    pub height_px: u32,
    pub plot: Rect,
    pub x: AxisScale,
    pub y: AxisScale,
    pub x_ticks: Vec<Tick>,
    pub y_ticks: Vec<Tick>,
    /// Title, axis labels, tick labels and names of marks.
    pub labels: Vec<Label>,
    pub legend: Legend<'a>,
}

impl<'a> Layout<'a> {
    /// Settles every place.
    pub fn new(chart: &'a Chart) -> Self {
        let (width_px, height_px) = (chart.width_px.clamp(320, 4000), chart.height_px.clamp(280, 4000));
        let (width, height) = (f64::from(width_px), f64::from(height_px));
        let (x_values, y_values) = scale::values(chart);
        let (x, y) = (AxisScale::new(&chart.x, &x_values), AxisScale::new(&chart.y, &y_values));

        let (mut labels, header_bottom) = header(chart, width);
        let most_mark_rows = if vertical_names(chart).next().is_some() { MARK_ROWS } else { 0 };
        let footer = TICK_LINE + line_if(&chart.x.label, AXIS_LABEL_LINE) + STRIP_GAP + MARGIN;
        let free = height - header_bottom - most_mark_rows as f64 * MARK_LINE - footer;
        let least_plot = (LEAST_PLOT_SHARE * height).max(60.0);
        let legend_rows = ((free - least_plot) / legend::ROW_HEIGHT).floor().max(1.0) as usize;
        let legend = Legend::new(chart, width - 2.0 * MARGIN, legend_rows);

        let least_height = free - legend.height;
        let y_ticks = ticks::choose(&y, &chart.y.ticks, &|ticks| rows_fit(&y, ticks, least_height));
        let left = MARGIN + (widest(&y_ticks) + TICK_GAP).max(LEAST_GUTTER);
        let least_width = width - left - MARGIN - OVERHANG;
        let x_ticks = ticks::choose(&x, &chart.x.ticks, &|ticks| columns_fit(&x, ticks, least_width));
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
        let legend = legend.moved(legend_left, legend_top);
        Layout { width_px, height_px, plot, x, y, x_ticks, y_ticks, labels, legend }
    }

    /// Where a point of the data lies; `None` where an axis cannot show it.
    pub fn place(&self, x: f64, y: f64) -> Option<Point> {
        Some((self.across(self.x.share(x)?), self.up(self.y.share(y)?)))
    }

    /// As [`Layout::place`], but a y that is not positive lies on the low end of a logarithmic axis.
    pub fn place_edge(&self, x: f64, y: f64) -> Option<Point> {
        Some((self.across(self.x.share(x)?), self.up(self.y.share_or_low_end(y)?)))
    }

    /// From a share of the horizontal axis to pixels.
    pub fn across(&self, share: f64) -> f64 {
        self.plot.left + share * self.plot.width()
    }

    /// From a share of the vertical axis to pixels.
    pub fn up(&self, share: f64) -> f64 {
        self.plot.bottom - share * self.plot.height()
    }
}

fn line_if(text: &str, line: f64) -> f64 {
    if text.trim().is_empty() { 0.0 } else { line }
}

/// Title and label of the vertical axis, and where the room beneath them begins.
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

/// The label of the horizontal axis, under the middle of the plot as far as the image allows.
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

/// Middle (in data) and name of every vertical mark that has a name.
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

/// Names of the vertical marks between `left` and `right`, the lowest row first, and how many rows they take.
fn mark_labels(chart: &Chart, x: &AxisScale, (left, right): (f64, f64), top: f64) -> (usize, Vec<Label>) {
    let mut rows: Vec<Vec<(f64, f64)>> = Vec::new();
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
        let free = |row: &Vec<(f64, f64)>| row.iter().all(|&(start, end)| to <= start || end <= from);
        let row = rows.iter().position(free).unwrap_or(rows.len());
        if row == MARK_ROWS {
            continue;
        }
        if row == rows.len() {
            rows.push(Vec::new());
        }
        rows[row].push((from, to));
        placed.push((name, middle, row));
    }
    let at =
        |middle, row: usize| (middle, top + (rows.len() - row) as f64 * MARK_LINE - MARK_LINE / 2.0 - 2.0);
    let labels = placed.into_iter().map(|(text, middle, row)| Label {
        text,
        at: at(middle, row),
        anchor: Anchor::Middle,
        size: MARK_SIZE,
        colour: QUIET_INK,
    });
    (rows.len(), labels.collect())
}

fn tick_labels(
    plot: &Rect,
    (x, x_ticks): (&AxisScale, &[Tick]),
    (y, y_ticks): (&AxisScale, &[Tick]),
) -> Vec<Label> {
    let label = |tick: &Tick, at, anchor| Label {
        text: tick.label.clone(),
        at,
        anchor,
        size: TICK_SIZE,
        colour: QUIET_INK,
    };
    let columns = x_ticks.iter().map(|tick| {
        let at = (plot.left + x.tick_share(tick.value) * plot.width(), plot.bottom + TICK_DROP);
        label(tick, at, Anchor::Middle)
    });
    let rows = y_ticks.iter().map(|tick| {
        let at = (plot.left - TICK_GAP, plot.bottom - y.tick_share(tick.value) * plot.height());
        label(tick, at, Anchor::End)
    });
    columns.chain(rows).collect()
}

fn widest(ticks: &[Tick]) -> f64 {
    ticks.iter().map(|tick| text::width(&tick.label, TICK_SIZE)).fold(0.0, f64::max)
}

/// Whether labels above each other leave room between them on an axis of that height.
fn rows_fit(axis: &AxisScale, ticks: &[Tick], height: f64) -> bool {
    pairs(axis, ticks).all(|(pitch, _, _)| pitch * height >= LEAST_Y_PITCH)
}

/// Whether labels beside each other leave room between them on an axis of that width.
fn columns_fit(axis: &AxisScale, ticks: &[Tick], width: f64) -> bool {
    pairs(axis, ticks).all(|(pitch, before, after)| {
        let labels = text::width(&before.label, TICK_SIZE) / 2.0 + text::width(&after.label, TICK_SIZE) / 2.0;
        pitch * width >= (labels + LABEL_GAP).max(LEAST_X_PITCH)
    })
}

/// Neighbouring ticks and how far apart they are as a share of the axis.
fn pairs<'t>(axis: &AxisScale, ticks: &'t [Tick]) -> impl Iterator<Item = (f64, &'t Tick, &'t Tick)> {
    ticks.windows(2).map(|pair| {
        let pitch = axis.tick_share(pair[1].value) - axis.tick_share(pair[0].value);
        (pitch, &pair[0], &pair[1])
    })
}

/// How far the label of the last tick reaches beyond the axis.
fn overhang(axis: &AxisScale, ticks: &[Tick], width: f64) -> f64 {
    let reach = ticks.last().map_or(0.0, |tick| {
        let half = text::width(&tick.label, TICK_SIZE) / 2.0;
        half - (1.0 - axis.tick_share(tick.value)) * width
    });
    reach.clamp(4.0, OVERHANG)
}
