//! Properties of the drawings, read back from the SVG by the same parser that makes the PNG.

mod bench;
mod charts;
mod dead_areas;
mod elliott;
mod pages;
mod parts;

use super::geometry::Rect;
use super::png;
use resvg::usvg;

/// A drawing read back.
struct Seen {
    image: Rect,
    /// Every text and the box of its font's line.
    texts: Vec<(String, Rect)>,
    /// The box of every line and shape, with its stroke.
    shapes: Vec<(Paint, Rect)>,
}

/// Colours of a line or shape as "#rrggbb".
#[derive(Debug, Clone, PartialEq)]
struct Paint {
    stroke: Option<String>,
    fill: Option<String>,
}

fn see(svg: &str) -> Seen {
    let tree = png::parse(svg).expect("well-formed SVG");
    let image =
        Rect { left: 0.0, top: 0.0, right: tree.size().width().into(), bottom: tree.size().height().into() };
    let mut seen = Seen { image, texts: Vec::new(), shapes: Vec::new() };
    walk(tree.root(), &mut seen);
    seen
}

fn walk(group: &usvg::Group, seen: &mut Seen) {
    for node in group.children() {
        match node {
            usvg::Node::Group(group) => walk(group, seen),
            usvg::Node::Path(path) => {
                let paint = Paint {
                    stroke: path.stroke().map(|stroke| hex(stroke.paint())),
                    fill: path.fill().map(|fill| hex(fill.paint())),
                };
                seen.shapes.push((paint, rect(path.abs_stroke_bounding_box())));
            }
            usvg::Node::Text(text) => {
                let characters =
                    text.chunks().iter().map(|chunk| chunk.text().trim()).collect::<Vec<_>>().join(" ");
                seen.texts.push((characters, rect(text.abs_bounding_box())));
            }
            usvg::Node::Image(_) => panic!("no drawing holds an image"),
        }
    }
}

fn hex(paint: &usvg::Paint) -> String {
    match paint {
        usvg::Paint::Color(colour) => format!("#{:02x}{:02x}{:02x}", colour.red, colour.green, colour.blue),
        _ => panic!("no drawing is painted with patterns"),
    }
}

fn rect(bounds: usvg::Rect) -> Rect {
    Rect {
        left: bounds.left().into(),
        top: bounds.top().into(),
        right: bounds.right().into(),
        bottom: bounds.bottom().into(),
    }
}

/// Whether two boxes share more than a tenth of a pixel in both directions.
fn overlap(a: &Rect, b: &Rect) -> bool {
    let across = a.right.min(b.right) - a.left.max(b.left);
    let down = a.bottom.min(b.bottom) - a.top.max(b.top);
    across > 0.1 && down > 0.1
}

fn inside(inner: &Rect, outer: &Rect) -> bool {
    outer.contains((inner.left, inner.top)) && outer.contains((inner.right, inner.bottom))
}

impl Seen {
    fn assert_texts_inside(&self, case: &str) {
        for (text, area) in &self.texts {
            assert!(inside(area, &self.image), "{case}: {text:?} at {area:?} leaves {:?}", self.image);
        }
    }

    fn assert_texts_apart(&self, case: &str) {
        for (index, (text, area)) in self.texts.iter().enumerate() {
            for (other, other_area) in &self.texts[..index] {
                assert!(
                    !overlap(area, other_area),
                    "{case}: {text:?} {area:?} lies on {other:?} {other_area:?}"
                );
            }
        }
    }

    fn has_text(&self, text: &str) -> bool {
        self.texts.iter().any(|(seen, _)| seen == text)
    }

    fn strokes(&self, colour: &str) -> impl Iterator<Item = &Rect> {
        self.shapes
            .iter()
            .filter(move |(paint, _)| paint.stroke.as_deref() == Some(colour))
            .map(|(_, area)| area)
    }

    fn fills(&self, colour: &str) -> impl Iterator<Item = &Rect> {
        self.shapes
            .iter()
            .filter(move |(paint, _)| paint.fill.as_deref() == Some(colour))
            .map(|(_, area)| area)
    }
}
