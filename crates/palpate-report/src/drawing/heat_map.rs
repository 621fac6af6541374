use super::axis::{Axis, AxisScale, TICK_SIZE, Tick, choose_ticks, columns_fit, rows_fit, tick_labels};
use super::chart::Extremes;
use super::geometry::{Point, Rect};
use super::svg::{Anchor, Colour, GRID, INK, Label, QUIET_INK, Svg, WHITE};
use super::text;
use palpate_estimators::estimator::Cells;

const MARGIN: f64 = 12.0;
const TITLE_SIZE: f64 = 15.0;
const TITLE_LINE: f64 = 26.0;
const NAME_SIZE: f64 = 12.5;
const NAME_LINE: f64 = 28.0;
const NAME_RISE: f64 = 17.0;
const GUTTER: f64 = 40.0;
const FOOT: f64 = 26.0;
const GAP: f64 = 18.0;
const BAR_WIDTH: f64 = 16.0;
const BAR_LABELS: f64 = 54.0;
const LEAST_WIDTH: f64 = 120.0;
const MOST_HEIGHT: f64 = 420.0;
/// Hides the background between neighbouring cells.
const OVERLAP: f64 = 0.5;

/// Quantity over a plane.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Heading of at most two lines.
    pub title: String,
    /// Cells of the plane.
    pub cells: Cells,
    /// Maps.
    pub panels: Vec<HeatPanel>,
    /// Positions of dots, such as sensors.
    pub dots_mm: Vec<(f64, f64)>,
    /// Quantity of the colours with its unit: "limit, mm".
    pub label: String,
    /// Upper end of the scale; larger values have its colour.
    pub most: f64,
    /// Width in pixels, clamped to 320–4,000; the plane gives the height.
    pub width_px: u32,
}

/// One map.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatPanel {
    /// Name; may be empty.
    pub name: String,
    /// Value of each cell; grey if not finite.
    pub values: Vec<f64>,
}

impl HeatPanel {
    /// Map; the name may be empty.
    pub fn new(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), values }
    }
}

/// Draws the maps as a self-contained SVG document with one colour bar: x to the right, y upward,
/// equal scales. The colours are logarithmic if all values are positive and the largest is ten
/// times the smallest.
///
/// ```
/// use palpate_estimators::load_profile::Cells;
/// use palpate_mechanics::surface::Extent;
/// use palpate_report::{HeatMap, HeatPanel, heat_map_to_svg};
///
/// let cells = Cells { extent: Extent::plane(0.3, 0.2)?, columns: 3, rows: 2 };
/// let values = (0..6).map(f64::from).collect();
/// let svg = heat_map_to_svg(&HeatMap {
///     title: "Errors over a plate".to_owned(),
///     cells,
///     panels: vec![HeatPanel::new("influence", values)],
///     dots_mm: vec![(75.0, 100.0), (225.0, 100.0)],
///     label: "error, mm".to_owned(),
///     most: f64::INFINITY,
///     width_px: 640,
/// });
/// assert!(svg.contains("Errors over a plate"));
/// # Ok::<(), palpate_numerics::OutOfRange>(())
/// ```
pub fn heat_map_to_svg(map: &HeatMap) -> String {
    let width_px = map.width_px.clamp(320, 4000);
    let layout = Layout::new(map, f64::from(width_px));
    let mut svg = Svg::new(width_px, layout.height.ceil() as u32);
    layout.title.iter().for_each(|line| svg.text(line));
    for (panel, plot) in map.panels.iter().zip(&layout.plots) {
        draw_cells(&mut svg, map, panel, *plot, &layout.colours);
        draw_dots(&mut svg, map, *plot);
        layout.labels_of(panel, *plot).iter().for_each(|label| svg.text(label));
    }
    layout.draw_bar(&mut svg, map);
    svg.finish()
}

fn sides_mm(map: &HeatMap) -> [f64; 2] {
    let extent = map.cells.extent;
    [extent.length_m() * 1e3, extent.width_m().unwrap_or(extent.length_m()) * 1e3]
}

fn title_labels(title: &str, width: f64) -> Vec<Label> {
    const MOST_LINES: usize = 2;
    let lines = text::wrap(title, TITLE_SIZE, width - 2.0 * MARGIN, MOST_LINES).into_iter().enumerate();
    let label = |(i, text): (usize, String)| {
        let at = (MARGIN, MARGIN + (i as f64 + 0.5) * TITLE_LINE);
        Label { text, at, anchor: Anchor::Start, size: TITLE_SIZE, colour: INK }
    };
    lines.map(label).collect()
}

struct Layout {
    width: f64,
    height: f64,
    title: Vec<Label>,
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
        let columns = columns.min((room / (LEAST_WIDTH + GUTTER + GAP)) as usize).max(1);
        let each = room / columns as f64 - GUTTER - GAP;
        let [length_mm, width_mm] = sides_mm(map);
        let aspect = width_mm / length_mm;
        let map_width = each.min(MOST_HEIGHT / aspect).max(20.0);
        let map_height = map_width * aspect;
        let title = title_labels(&map.title, width);
        let top = MARGIN + title.len().max(1) as f64 * TITLE_LINE;
        let row_height = NAME_LINE + map_height + FOOT;
        let plot = |i: usize| {
            let (column, row) = ((i % columns) as f64, (i / columns) as f64);
            let left = MARGIN + GUTTER + column * (map_width + GUTTER + GAP);
            let top = top + row * row_height + NAME_LINE;
            Rect { left, top, right: left + map_width, bottom: top + map_height }
        };
        let plots: Vec<Rect> = (0..count).map(plot).collect();
        let left = plots.iter().map(|plot| plot.right).fold(0.0, f64::max) + GAP;
        let top_of_bar = plots[0].top;
        let bottom = top_of_bar + map_height.max(120.0);
        let bar = Rect { left, right: left + BAR_WIDTH, top: top_of_bar, bottom };
        let rows = count.div_ceil(columns) as f64;
        let height = (top + rows * row_height).max(bar.bottom + FOOT) + NAME_LINE + MARGIN;
        let axis = |size_mm: f64| AxisScale::new(&Axis::linear("").from_to(0.0, size_mm), &[]);
        let (x, y) = (axis(length_mm), axis(width_mm));
        let x_ticks = choose_ticks(&x, None, &|ticks| columns_fit(&x, ticks, map_width));
        let y_ticks = choose_ticks(&y, None, &|ticks| rows_fit(&y, ticks, map_height));
        let (x, y) = ((x, x_ticks), (y, y_ticks));
        Self { width, height, title, plots, bar, colours: colours(map), x, y }
    }

    fn name_room(&self, plot: Rect) -> f64 {
        let is_last_of_row = !self.plots.iter().any(|other| other.top == plot.top && other.left > plot.left);
        // The next map's axis name or the colour bar is to the right of the name.
        let is_beneath_bar = plot.top > self.bar.bottom;
        if is_last_of_row && is_beneath_bar {
            self.width - MARGIN - plot.left
        } else {
            plot.width() + 0.5 * GAP
        }
    }

    fn labels_of(&self, panel: &HeatPanel, plot: Rect) -> Vec<Label> {
        let label = |text: &str, at: Point, anchor| Label {
            text: text.to_owned(),
            at,
            anchor,
            size: TICK_SIZE,
            colour: QUIET_INK,
        };
        let mut labels = tick_labels(&plot, (&self.x.0, &self.x.1), (&self.y.0, &self.y.1));
        let name = text::fit(&panel.name, NAME_SIZE, self.name_room(plot));
        let above = plot.top - NAME_RISE;
        labels.push(Label {
            size: NAME_SIZE,
            colour: INK,
            ..label(&name, (plot.left, above), Anchor::Start)
        });
        // The axis is named beneath the lowest map of a column.
        if !self.plots.iter().any(|other| other.left == plot.left && other.top > plot.top) {
            let at = (plot.left.midpoint(plot.right), plot.bottom + FOOT + 0.5 * NAME_LINE - 1.0);
            labels.push(label("x, mm", at, Anchor::Middle));
        }
        labels.push(label("y, mm", (plot.left - 7.0, above), Anchor::End));
        labels
    }

    fn draw_bar(&self, svg: &mut Svg, map: &HeatMap) {
        const STEPS: usize = 120;
        let Rect { left, right, top, bottom } = self.bar;
        let step = (bottom - top) / STEPS as f64;
        for i in 0..STEPS {
            let low = bottom - i as f64 * step;
            let area = Rect { left, right, top: (low - step - OVERLAP).max(top), bottom: low };
            svg.rectangle(area, colour_of((i as f64 + 0.5) / STEPS as f64));
        }
        let fits = |ticks: &[Tick]| rows_fit(&self.colours, ticks, bottom - top);
        for Tick { value, label } in choose_ticks(&self.colours, None, &fits) {
            let y = bottom - self.colours.tick_share(value) * (bottom - top);
            svg.line(&[(right, y), (right + 4.0, y)], 1.0, QUIET_INK);
            let at = (right + 8.0, y);
            svg.text(&Label { text: label, at, anchor: Anchor::Start, size: TICK_SIZE, colour: QUIET_INK });
        }
        let at = (left, top - NAME_RISE);
        let text = text::fit(&map.label, NAME_SIZE, BAR_LABELS + BAR_WIDTH + MARGIN);
        svg.text(&Label { text, at, anchor: Anchor::Start, size: NAME_SIZE, colour: INK });
    }
}

fn colours(map: &HeatMap) -> AxisScale {
    let all = map.panels.iter().flat_map(|panel| panel.values.iter().copied());
    let finite = all.filter(|value| value.is_finite());
    let extremes = Extremes::from_values(finite.map(|value| value.min(map.most)));
    let Extremes { least, greatest } = extremes;
    let from = if extremes.are_far_apart() { least } else { least.min(0.0) };
    AxisScale::new(&extremes.axis("").from_to(from, greatest), &[least, greatest])
}

fn draw_cells(svg: &mut Svg, map: &HeatMap, panel: &HeatPanel, plot: Rect, colours: &AxisScale) {
    svg.rectangle(plot, GRID);
    let (width, height) = (plot.width() / map.cells.columns as f64, plot.height() / map.cells.rows as f64);
    for (i, value) in panel.values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
        let Some(share) = colours.share_or_low_end(value.min(map.most)) else { continue };
        let (column, row) = ((i % map.cells.columns) as f64, (i / map.cells.columns) as f64);
        let (left, bottom) = (plot.left + column * width, plot.bottom - row * height);
        let right = (left + width + OVERLAP).min(plot.right);
        let top = (bottom - height - OVERLAP).max(plot.top);
        svg.rectangle(Rect { left, right, top, bottom }, colour_of(share));
    }
}

fn draw_dots(svg: &mut Svg, map: &HeatMap, plot: Rect) {
    let (rim, middle) = if plot.width() < 200.0 { (3.2, 1.9) } else { (4.8, 3.0) };
    let [length_mm, width_mm] = sides_mm(map);
    for &(x_mm, y_mm) in &map.dots_mm {
        let at = (plot.left + x_mm / length_mm * plot.width(), plot.bottom - y_mm / width_mm * plot.height());
        svg.disc(at, rim, WHITE);
        svg.disc(at, middle, INK);
    }
}

/// Viridis at ten even steps (van der Walt and Smith, 2015; public domain). Lightness rises with
/// the value, also in grey print.
const VIRIDIS: [Colour; 10] = [
    Colour::opaque(68, 1, 84),
    Colour::opaque(72, 40, 120),
    Colour::opaque(62, 74, 137),
    Colour::opaque(49, 104, 142),
    Colour::opaque(38, 130, 142),
    Colour::opaque(31, 158, 137),
    Colour::opaque(53, 183, 121),
    Colour::opaque(109, 205, 89),
    Colour::opaque(180, 222, 44),
    Colour::opaque(253, 231, 37),
];

fn colour_of(share: f64) -> Colour {
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (place as usize).min(VIRIDIS.len() - 2);
    let part = place - below as f64;
    let (low, high) = (VIRIDIS[below].rgb, VIRIDIS[below + 1].rgb);
    let mix = |i: usize| (f64::from(low[i]) * (1.0 - part) + f64::from(high[i]) * part).round() as u8;
    Colour::opaque(mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_grow_lighter_and_hold_at_the_ends() {
        let light = |share: f64| {
            let [r, g, b] = colour_of(share).rgb.map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let steps: Vec<f64> = (0..=50).map(|i| light(f64::from(i) / 50.0)).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!((colour_of(-3.0), colour_of(9.0)), (VIRIDIS[0], VIRIDIS[9]));
    }
}
