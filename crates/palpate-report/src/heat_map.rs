//! A quantity over a plane as colours: one map, or several of the same plane and scale beside each other.

use plotters::style::Color;

use super::canvas::{self, Anchor, Canvas, GRID, INK, Label, QUIET_INK, WHITE};
use super::chart::{Axis, Ticks};
use super::colour_map::colour_of;
use super::extremes::Extremes;
use super::geometry::{Point, Rect};
use super::scale::AxisScale;
use super::text;
use super::ticks::{self, Tick};

const MARGIN: f64 = 12.0;
const TITLE_SIZE: f64 = 15.0;
const TITLE_LINE: f64 = 26.0;
const NAME_SIZE: f64 = 12.5;
const NAME_LINE: f64 = 22.0;
const TICK_SIZE: f64 = 11.5;
/// Room left of a map for the labels of its ticks, and beneath it.
const GUTTER: f64 = 40.0;
const FOOT: f64 = 26.0;
/// From one map to the next.
const GAP: f64 = 18.0;
const BAR_WIDTH: f64 = 16.0;
/// Room for the labels of the colour bar.
const BAR_LABELS: f64 = 54.0;
/// Least distances between the labels of neighbouring ticks.
const LABEL_GAP: f64 = 12.0;
const LEAST_PITCH: f64 = 26.0;
/// Most height of one map.
const MOST_HEIGHT: f64 = 420.0;
/// Cells overlap by this much, or a line of background would show between them.
const OVERLAP: f64 = 0.5;

/// A quantity over a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Heading, in one line.
    pub title: String,
    /// Length of the plane along x, in millimetres.
    pub length_mm: f64,
    /// Its width along y, in millimetres.
    pub width_mm: f64,
    /// Equal cells along x.
    pub columns: usize,
    /// Equal cells along y.
    pub rows: usize,
    /// The maps.
    pub panels: Vec<HeatPanel>,
    /// Where the sensors are, in millimetres.
    pub sensors_mm: Vec<(f64, f64)>,
    /// What the colours mean, with its unit: "limit, mm".
    pub label: String,
    /// Larger values have the colour of this one.
    pub most: f64,
    /// Width of the image in pixels at scale 1; drawn within 320 to 4,000. The height follows from the plane.
    pub width_px: u32,
}

/// One map.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatPanel {
    /// Its name; empty for none.
    pub name: String,
    /// A value a cell, row by row from the lower left; one that is not finite leaves its cell grey.
    pub values: Vec<f64>,
}

/// Draws the maps as one self-contained SVG document: x to the right, y upward, a millimetre as long both ways, with one
/// colour bar for all. The scale is logarithmic where the largest value is ten times the smallest, and all are positive.
pub fn heat_map_to_svg(map: &HeatMap) -> String {
    let width_px = map.width_px.clamp(320, 4000);
    let layout = Layout::new(map, f64::from(width_px));
    canvas::svg(width_px, layout.height.ceil() as u32, |canvas| {
        canvas.text(&layout.title(map));
        for (panel, plot) in map.panels.iter().zip(&layout.plots) {
            draw_cells(canvas, map, panel, *plot, &layout.colours);
            draw_sensors(canvas, map, *plot);
            layout.labels_of(panel, *plot).iter().for_each(|label| canvas.text(label));
        }
        layout.draw_bar(canvas, map);
    })
}

/// Where everything goes.
struct Layout {
    height: f64,
    plots: Vec<Rect>,
    bar: Rect,
    colours: AxisScale,
    x: (AxisScale, Vec<Tick>),
    y: (AxisScale, Vec<Tick>),
}

impl Layout {
    fn new(map: &HeatMap, width: f64) -> Self {
        let count = map.panels.len().max(1);
        let columns = match count {
            1..=3 => count,
            4 => 2,
            _ => 3,
        };
        let room = width - 2.0 * MARGIN - BAR_LABELS - BAR_WIDTH - GAP;
        let each = room / columns as f64 - GUTTER - GAP;
        let aspect = map.width_mm / map.length_mm;
        let map_width = each.min(MOST_HEIGHT / aspect).max(20.0);
        let map_height = map_width * aspect;
        let top = MARGIN + TITLE_LINE;
        let row_height = NAME_LINE + map_height + FOOT;
        let plot = |i: usize| {
            let (column, row) = ((i % columns) as f64, (i / columns) as f64);
            let left = MARGIN + GUTTER + column * (map_width + GUTTER + GAP);
            let top = top + row * row_height + NAME_LINE;
            Rect { left, top, right: left + map_width, bottom: top + map_height }
        };
        let plots: Vec<Rect> = (0..count).map(plot).collect();
        let right = plots.iter().map(|plot| plot.right).fold(0.0, f64::max);
        let first = plots[0];
        let bar_height = map_height.max(120.0);
        let bar = Rect {
            left: right + GAP,
            right: right + GAP + BAR_WIDTH,
            top: first.top,
            bottom: first.top + bar_height,
        };
        let rows = count.div_ceil(columns) as f64;
        let height = (top + rows * row_height).max(bar.bottom + FOOT) + NAME_LINE + MARGIN;
        let axis = |size_mm: f64| AxisScale::new(&Axis::linear("").from_to(0.0, size_mm), &[]);
        let (x, y) = (axis(map.length_mm), axis(map.width_mm));
        let x_ticks = ticks::choose(&x, &Ticks::Automatic, &|ticks| fit_beside(&x, ticks, map_width));
        let y_ticks = ticks::choose(&y, &Ticks::Automatic, &|ticks| fit_above(&y, ticks, map_height));
        Self { height, plots, bar, colours: colours(map), x: (x, x_ticks), y: (y, y_ticks) }
    }

    fn title(&self, map: &HeatMap) -> Label {
        let at = (MARGIN, MARGIN + 0.5 * TITLE_LINE);
        let room = self.bar.right + BAR_LABELS - MARGIN;
        let text = text::fit(&map.title, TITLE_SIZE, room);
        Label { text, at, anchor: Anchor::Start, size: TITLE_SIZE, colour: INK }
    }

    /// Name and ticks of one map.
    fn labels_of(&self, panel: &HeatPanel, plot: Rect) -> Vec<Label> {
        let label = |text: &str, at: Point, anchor| Label {
            text: text.to_owned(),
            at,
            anchor,
            size: TICK_SIZE,
            colour: QUIET_INK,
        };
        let (x, x_ticks) = &self.x;
        let (y, y_ticks) = &self.y;
        let along = x_ticks.iter().map(|tick| {
            let across = plot.left + x.tick_share(tick.value) * plot.width();
            label(&tick.label, (across, plot.bottom + 13.0), Anchor::Middle)
        });
        let up = y_ticks.iter().map(|tick| {
            let height = plot.bottom - y.tick_share(tick.value) * plot.height();
            label(&tick.label, (plot.left - 7.0, height), Anchor::End)
        });
        let mut labels: Vec<Label> = along.chain(up).collect();
        let name = text::fit(&panel.name, NAME_SIZE, plot.width() + GUTTER);
        labels.push(Label {
            size: NAME_SIZE,
            colour: INK,
            ..label(&name, (plot.left, plot.top - 11.0), Anchor::Start)
        });
        // The lowest map of a column names the axis beneath it.
        if !self.plots.iter().any(|other| other.left == plot.left && other.top > plot.top) {
            let at = (plot.left.midpoint(plot.right), plot.bottom + FOOT + 0.5 * NAME_LINE - 4.0);
            labels.push(label("x, mm", at, Anchor::Middle));
        }
        labels.push(label("y, mm", (plot.left - 7.0, plot.top - 11.0), Anchor::End));
        labels
    }

    fn draw_bar(&self, canvas: &Canvas<'_>, map: &HeatMap) {
        const STEPS: usize = 120;
        let Rect { left, right, top, bottom } = self.bar;
        let step = (bottom - top) / STEPS as f64;
        for i in 0..STEPS {
            let colour = colour_of((i as f64 + 0.5) / STEPS as f64);
            let low = bottom - i as f64 * step;
            let area = Rect { left, right, top: (low - step - OVERLAP).max(top), bottom: low };
            canvas.rectangle(area, colour.to_rgba());
        }
        let fits = |ticks: &[Tick]| fit_above(&self.colours, ticks, bottom - top);
        for tick in ticks::choose(&self.colours, &Ticks::Automatic, &fits) {
            let y = bottom - self.colours.tick_share(tick.value) * (bottom - top);
            canvas.line(&[(right, y), (right + 4.0, y)], 1.0, QUIET_INK);
            let at = (right + 8.0, y);
            canvas.text(&Label {
                text: tick.label,
                at,
                anchor: Anchor::Start,
                size: TICK_SIZE,
                colour: QUIET_INK,
            });
        }
        let at = (left, top - 11.0);
        let text = text::fit(&map.label, NAME_SIZE, BAR_LABELS + BAR_WIDTH + MARGIN);
        canvas.text(&Label { text, at, anchor: Anchor::Start, size: NAME_SIZE, colour: INK });
    }
}

/// The scale of the colours.
fn colours(map: &HeatMap) -> AxisScale {
    let all = map.panels.iter().flat_map(|panel| panel.values.iter().copied());
    let finite = all.filter(|value| value.is_finite());
    let extremes = Extremes::of(finite.map(|value| value.min(map.most)));
    let Extremes { least, greatest } = extremes;
    let (axis, from) =
        if extremes.are_far_apart() { (Axis::log10(""), least) } else { (Axis::linear(""), least.min(0.0)) };
    AxisScale::new(&axis.from_to(from, greatest), &[least, greatest])
}

fn draw_cells(canvas: &Canvas<'_>, map: &HeatMap, panel: &HeatPanel, plot: Rect, colours: &AxisScale) {
    canvas.rectangle(plot, GRID.to_rgba());
    let (width, height) = (plot.width() / map.columns as f64, plot.height() / map.rows as f64);
    for (i, value) in panel.values.iter().enumerate() {
        let Some(share) = Some(*value).filter(|value| value.is_finite()) else { continue };
        let Some(share) = colours.share_or_low_end(share.min(map.most)) else { continue };
        let (column, row) = ((i % map.columns) as f64, (i / map.columns) as f64);
        let (left, bottom) = (plot.left + column * width, plot.bottom - row * height);
        let area = Rect {
            left,
            right: (left + width + OVERLAP).min(plot.right),
            top: (bottom - height - OVERLAP).max(plot.top),
            bottom,
        };
        canvas.rectangle(area, colour_of(share).to_rgba());
    }
}

/// White rings with a dark middle, which are seen on any colour.
fn draw_sensors(canvas: &Canvas<'_>, map: &HeatMap, plot: Rect) {
    let small = plot.width() < 200.0;
    let (rim, middle) = if small { (3.2, 1.9) } else { (4.8, 3.0) };
    for &(x_mm, y_mm) in &map.sensors_mm {
        let at = (
            plot.left + x_mm / map.length_mm * plot.width(),
            plot.bottom - y_mm / map.width_mm * plot.height(),
        );
        canvas.disc(at, rim, WHITE);
        canvas.disc(at, middle, INK);
    }
}

/// Whether labels beside each other leave room between them.
fn fit_beside(axis: &AxisScale, ticks: &[Tick], width: f64) -> bool {
    ticks.windows(2).all(|pair| {
        let labels: f64 = pair.iter().map(|tick| 0.5 * text::width(&tick.label, TICK_SIZE)).sum();
        (axis.tick_share(pair[1].value) - axis.tick_share(pair[0].value)) * width >= labels + LABEL_GAP
    })
}

/// Whether labels above each other do.
fn fit_above(axis: &AxisScale, ticks: &[Tick], height: f64) -> bool {
    ticks
        .windows(2)
        .all(|pair| (axis.tick_share(pair[1].value) - axis.tick_share(pair[0].value)) * height >= LEAST_PITCH)
}
