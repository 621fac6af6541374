//! Lines, shapes and texts in pixels; the one place that knows `plotters`.
//!
//! Its SVG backend rounds every coordinate and stroke width to whole units and leaves line joins sharp, so it is
//! given a canvas [`FINE`] times finer than the pixels, inside an outer `svg` element that scales it back.

use super::geometry::{Point, Rect};
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::element::{Circle, DashedPathElement, PathElement, Polygon, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, RGBAColor, RGBColor, ShapeStyle, TextStyle};

/// Steps of the backend's coordinates in one pixel.
const FINE: f64 = 10.0;
/// The backend writes a font size divided by this number.
const BACKEND_FONT_FACTOR: f64 = 1.24;
/// From the middle of the capitals down to where the backend centres a text, in units of the font size.
const CAPITALS_DROP: f64 = 0.11;

pub(crate) const INK: RGBColor = RGBColor(34, 34, 34);
pub(crate) const QUIET_INK: RGBColor = RGBColor(90, 90, 90);
pub(crate) const REFERENCE: RGBColor = RGBColor(110, 110, 110);
pub(crate) const GRID: RGBColor = RGBColor(228, 228, 228);
pub(crate) const MINOR_GRID: RGBColor = RGBColor(243, 243, 243);
pub(crate) const WHITE: RGBColor = RGBColor(255, 255, 255);

/// Okabe and Ito's colours, less the yellow that is lost on white.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];

/// The colour with that index; the palette starts over at its end.
pub(crate) fn palette(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// Which part of a text stands at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A text and where it goes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Label {
    pub text: String,
    /// Horizontally where `anchor` says, vertically the middle of the capitals.
    pub at: Point,
    pub anchor: Anchor,
    /// Font size in pixels.
    pub size: f64,
    pub colour: RGBColor,
}

/// A canvas of some pixels; drawing beyond its edge is cut off.
pub(crate) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// The SVG text of what `paint` draws on a white canvas.
pub(crate) fn svg(width_px: u32, height_px: u32, paint: impl FnOnce(&Canvas<'_>)) -> String {
    let fine = |pixels: u32| pixels * FINE as u32;
    let mut drawing = String::new();
    {
        let area =
            SVGBackend::with_string(&mut drawing, (fine(width_px), fine(height_px))).into_drawing_area();
        let canvas = Canvas { area };
        canvas.written(canvas.area.fill(&WHITE));
        paint(&canvas);
        canvas.written(canvas.area.present());
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px}\" height=\"{height_px}\" \
         viewBox=\"0 0 {} {}\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n{drawing}</svg>\n",
        fine(width_px),
        fine(height_px)
    )
}

impl Canvas<'_> {
    /// A line through the points; nothing for fewer than two.
    pub fn line(&self, points: &[Point], width: f64, colour: RGBColor) {
        if points.len() > 1 {
            self.written(self.area.draw(&PathElement::new(fine_points(points), stroke(width, colour))));
        }
    }

    /// A broken line through the points.
    pub fn dashed_line(&self, points: &[Point], width: f64, colour: RGBColor) {
        let (dash, gap) = (6.0 * FINE, 5.0 * FINE);
        self.written(self.area.draw(&DashedPathElement::new(
            fine_points(points),
            dash as i32,
            gap as i32,
            stroke(width, colour),
        )));
    }

    /// A filled polygon; nothing for fewer than three corners.
    pub fn polygon(&self, points: &[Point], colour: RGBAColor) {
        if points.len() > 2 {
            self.written(self.area.draw(&Polygon::new(fine_points(points), colour.filled())));
        }
    }

    /// A filled rectangle.
    pub fn rectangle(&self, rect: Rect, colour: RGBAColor) {
        let corners = [fine_point((rect.left, rect.top)), fine_point((rect.right, rect.bottom))];
        self.written(self.area.draw(&Rectangle::new(corners, colour.filled())));
    }

    /// A filled disc.
    pub fn disc(&self, centre: Point, radius: f64, colour: RGBColor) {
        self.written(self.area.draw(&Circle::new(
            fine_point(centre),
            (radius * FINE).round() as i32,
            colour.filled(),
        )));
    }

    /// A text; characters that XML cannot hold become spaces.
    pub fn text(&self, label: &Label) {
        let text: String = label.text.chars().map(|c| if is_xml(c) { c } else { ' ' }).collect();
        let horizontal = match label.anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let style = TextStyle::from(("sans-serif", label.size * FINE * BACKEND_FONT_FACTOR))
            .color(&label.colour)
            .pos(Pos::new(horizontal, VPos::Center));
        let at = (label.at.0, label.at.1 + CAPITALS_DROP * label.size);
        self.written(self.area.draw(&Text::new(text, fine_point(at), style)));
    }

    /// The backend only appends to a `String`, so an error is one of this module.
    fn written<E: std::error::Error + Send + Sync>(&self, result: Result<(), DrawingAreaErrorKind<E>>) {
        result.expect("writing SVG into a String cannot fail");
    }
}

fn stroke(width: f64, colour: RGBColor) -> ShapeStyle {
    colour.stroke_width((width * FINE).round() as u32)
}

fn fine_point((x, y): Point) -> (i32, i32) {
    ((x * FINE).round() as i32, (y * FINE).round() as i32)
}

fn fine_points(points: &[Point]) -> Vec<(i32, i32)> {
    points.iter().copied().map(fine_point).collect()
}

fn is_xml(character: char) -> bool {
    !character.is_control() && !matches!(character, '\u{fffe}' | '\u{ffff}')
}
