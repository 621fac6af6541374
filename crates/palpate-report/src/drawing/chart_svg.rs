use super::axis::minor_ticks;
use super::chart::{BandPoint, Chart, ErrorPoint, Mark, Marker, Series, SeriesKind, Stroke};
use super::geometry::{Point, Rect};
use super::layout::{Layout, LegendItem};
use super::svg::{BLACK, Colour, GRID, MINOR_GRID, QUIET_INK, REFERENCE, Svg, WHITE, palette};

const LINE_WIDTH: f64 = 1.8;
const REFERENCE_WIDTH: f64 = 1.2;
const ERROR_BAR_WIDTH: f64 = 1.5;
const CAP_HALF_WIDTH: f64 = 4.0;
const MARKER_RADIUS: f64 = 4.2;
/// Separates a marker from the shapes under it.
const MARKER_RIM: f64 = 1.2;
const CROSS_WIDTH: f64 = 2.0;
const BAND_OPACITY: f64 = 0.2;
const SPAN_OPACITY: f64 = 0.05;

/// Draws a self-contained SVG document of `width_px` × `height_px`.
///
/// A legend without room for all names ends with the number of missing ones.
pub fn chart_to_svg(chart: &Chart) -> String {
    let layout = Layout::new(chart);
    let mut painter = Painter { svg: Svg::new(layout.width_px, layout.height_px), layout: &layout };
    painter.spans(&chart.marks);
    painter.grid();
    chart.series.iter().for_each(|series| painter.band(series));
    painter.reference_lines(&chart.marks);
    painter.base_line();
    chart.series.iter().for_each(|series| painter.line(series));
    chart.series.iter().for_each(|series| painter.markers(series));
    painter.legend();
    layout.labels.iter().for_each(|label| painter.svg.text(label));
    painter.svg.finish()
}

struct Painter<'a> {
    svg: Svg,
    layout: &'a Layout<'a>,
}

impl Painter<'_> {
    fn spans(&mut self, marks: &[Mark]) {
        let plot = self.layout.plot;
        for mark in marks {
            let Mark::Span { low, high, .. } = mark else { continue };
            let (Some(start), Some(end)) =
                (self.layout.x.share(low.min(*high)), self.layout.x.share(low.max(*high)))
            else {
                continue;
            };
            let (left, right) = (self.layout.x_px(start.max(0.0)), self.layout.x_px(end.min(1.0)));
            if left < right {
                self.svg.rectangle(Rect { left, right, ..plot }, BLACK.with_opacity(SPAN_OPACITY));
            }
        }
    }

    fn grid(&mut self) {
        let Layout { x, y, x_ticks, y_ticks, plot, .. } = self.layout;
        let column = |value| {
            let across = self.layout.x_px(x.tick_share(value));
            [(across, plot.top), (across, plot.bottom)]
        };
        let row = |value| {
            let up = self.layout.y_px(y.tick_share(value));
            [(plot.left, up), (plot.right, up)]
        };
        let minor_columns = minor_ticks(x, x_ticks).into_iter().map(column);
        let minor_rows = minor_ticks(y, y_ticks).into_iter().map(row);
        let columns = x_ticks.iter().map(|tick| column(tick.value));
        let rows = y_ticks.iter().map(|tick| row(tick.value));
        minor_columns.chain(minor_rows).for_each(|line| self.svg.line(&line, 1.0, MINOR_GRID));
        columns.chain(rows).for_each(|line| self.svg.line(&line, 1.0, GRID));
    }

    fn base_line(&mut self) {
        let plot = self.layout.plot;
        self.svg.line(&[(plot.left, plot.bottom), (plot.right, plot.bottom)], 1.0, QUIET_INK);
    }

    fn reference_lines(&mut self, marks: &[Mark]) {
        let plot = self.layout.plot;
        for mark in marks {
            let ends = match *mark {
                Mark::VerticalLine { x, .. } => self
                    .layout
                    .x
                    .share(x)
                    .map(|share| self.layout.x_px(share))
                    .map(|x| [(x, plot.top), (x, plot.bottom)]),
                Mark::HorizontalLine { y, .. } => self
                    .layout
                    .y
                    .share(y)
                    .map(|share| self.layout.y_px(share))
                    .map(|y| [(plot.left, y), (plot.right, y)]),
                Mark::Span { .. } => None,
            };
            for piece in ends.into_iter().flat_map(|ends| plot.clip_line(&ends)) {
                self.svg.dashed_line(&piece, REFERENCE_WIDTH, REFERENCE);
            }
        }
    }

    fn band(&mut self, series: &Series) {
        let SeriesKind::Band { points } = &series.kind else { return };
        let place = |point: &BandPoint| {
            Some((self.layout.place_edge(point.x, point.low)?, self.layout.place_edge(point.x, point.high)?))
        };
        for run in runs(points.iter().map(place)) {
            let low = run.iter().map(|(low, _)| *low);
            let high = run.iter().rev().map(|(_, high)| *high);
            let outline: Vec<Point> = low.chain(high).collect();
            let colour = palette(series.colour).with_opacity(BAND_OPACITY);
            self.svg.polygon(&self.layout.plot.clip_polygon(&outline), colour);
        }
    }

    fn line(&mut self, series: &Series) {
        let SeriesKind::Line { points, stroke } = &series.kind else { return };
        let colour = palette(series.colour);
        for run in runs(points.iter().map(|&(x, y)| self.layout.place(x, y))) {
            if let [lone] = run[..]
                && self.layout.plot.contains(lone)
            {
                self.svg.disc(lone, LINE_WIDTH, colour);
            }
            for piece in self.layout.plot.clip_line(&run) {
                self.stroke(&piece, *stroke, colour);
            }
        }
    }

    fn stroke(&mut self, points: &[Point], stroke: Stroke, colour: Colour) {
        match stroke {
            Stroke::Solid => self.svg.line(points, LINE_WIDTH, colour),
            Stroke::Dashed => self.svg.dashed_line(points, LINE_WIDTH, colour),
        }
    }

    fn markers(&mut self, series: &Series) {
        let layout = self.layout;
        let colour = palette(series.colour);
        match &series.kind {
            SeriesKind::Points { points, marker } => {
                for at in points.iter().filter_map(|&(x, y)| layout.place_inside(x, y)) {
                    draw_rim(&mut self.svg, at, *marker);
                    draw_marker(&mut self.svg, at, *marker, colour);
                }
            }
            SeriesKind::ErrorBars { points, marker } => {
                points.iter().for_each(|point| self.error_bar(point, *marker, colour));
            }
            SeriesKind::Line { .. } | SeriesKind::Band { .. } => {}
        }
    }

    fn error_bar(&mut self, point: &ErrorPoint, marker: Marker, colour: Colour) {
        let plot = self.layout.plot;
        let at = self.layout.place_inside(point.x, point.y);
        if let Some(at) = at {
            draw_rim(&mut self.svg, at, marker);
        }
        let ends = [self.layout.place_edge(point.x, point.low), self.layout.place_edge(point.x, point.high)];
        if let [Some(low), Some(high)] = ends {
            for piece in plot.clip_line(&[low, high]) {
                self.svg.line(&piece, ERROR_BAR_WIDTH, colour);
            }
            for (x, y) in [low, high].into_iter().filter(|&end| plot.contains(end)) {
                self.svg.line(&[(x - CAP_HALF_WIDTH, y), (x + CAP_HALF_WIDTH, y)], ERROR_BAR_WIDTH, colour);
            }
        }
        if let Some(at) = at {
            draw_marker(&mut self.svg, at, marker, colour);
        }
    }

    fn legend(&mut self) {
        for entry in &self.layout.legend.entries {
            let Rect { left, right, top, bottom } = entry.swatch;
            let middle = top.midpoint(bottom);
            match entry.named {
                LegendItem::Series(series) => self.swatch(series, entry.swatch),
                LegendItem::Reference => {
                    self.svg.dashed_line(&[(left, middle), (right, middle)], REFERENCE_WIDTH, REFERENCE);
                }
            }
            self.svg.text(&entry.label);
        }
        if let Some(remainder) = &self.layout.legend.remainder {
            self.svg.text(remainder);
        }
    }

    fn swatch(&mut self, series: &Series, area: Rect) {
        let colour = palette(series.colour);
        let Rect { left, right, top, bottom } = area;
        let middle = (left.midpoint(right), top.midpoint(bottom));
        match &series.kind {
            SeriesKind::Line { stroke, .. } => {
                self.stroke(&[(left, middle.1), (right, middle.1)], *stroke, colour);
            }
            SeriesKind::Band { .. } => self.svg.rectangle(area, colour.with_opacity(BAND_OPACITY)),
            SeriesKind::Points { marker, .. } => draw_marker(&mut self.svg, middle, *marker, colour),
            SeriesKind::ErrorBars { marker, .. } => {
                self.svg.line(&[(middle.0, top - 2.0), (middle.0, bottom + 2.0)], ERROR_BAR_WIDTH, colour);
                draw_marker(&mut self.svg, middle, *marker, colour);
            }
        }
    }
}

/// Splits items at gaps.
fn runs<T>(items: impl Iterator<Item = Option<T>>) -> Vec<Vec<T>> {
    let mut runs = vec![Vec::new()];
    for item in items {
        match (item, runs.last_mut()) {
            (Some(item), Some(run)) => run.push(item),
            _ => runs.push(Vec::new()),
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

fn draw_rim(svg: &mut Svg, at: Point, marker: Marker) {
    draw_shape(svg, at, marker, MARKER_RADIUS + MARKER_RIM, CROSS_WIDTH + MARKER_RIM, WHITE);
}

fn draw_marker(svg: &mut Svg, at: Point, marker: Marker, colour: Colour) {
    draw_shape(svg, at, marker, MARKER_RADIUS, CROSS_WIDTH, colour);
}

fn draw_shape(svg: &mut Svg, at: Point, marker: Marker, radius: f64, cross_width: f64, colour: Colour) {
    match marker {
        Marker::Circle => svg.disc(at, radius, colour),
        Marker::Square => svg.rectangle(square(at, 0.9 * radius), colour),
        Marker::Triangle => svg.polygon(&triangle(at, 1.35 * radius), colour),
        Marker::Cross => {
            svg.line(&[(at.0 - radius, at.1 - radius), (at.0 + radius, at.1 + radius)], cross_width, colour);
            svg.line(&[(at.0 - radius, at.1 + radius), (at.0 + radius, at.1 - radius)], cross_width, colour);
        }
    }
}

fn square((x, y): Point, half: f64) -> Rect {
    Rect { left: x - half, right: x + half, top: y - half, bottom: y + half }
}

/// Apex up, with corners at `radius` from the centre.
fn triangle((x, y): Point, radius: f64) -> [Point; 3] {
    let half_side = radius * 0.75_f64.sqrt();
    [(x, y - radius), (x + half_side, y + radius / 2.0), (x - half_side, y + radius / 2.0)]
}
