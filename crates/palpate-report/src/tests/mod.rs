//! Tests of the drawings, parsed as XML.

mod beams;
mod charts;
mod dead_areas;
mod elliott;
mod maps;
mod pages;
mod parts;
#[cfg(feature = "png")]
mod pictures;

use crate::drawing::geometry::Rect;
use crate::drawing::text;

struct Drawing {
    image: Rect,
    /// Texts and the estimated boxes of their lines.
    texts: Vec<(String, Rect)>,
    /// Strokes and boxes of lines and shapes.
    shapes: Vec<(Paint, Rect)>,
}

/// Colours as "#rrggbb".
#[derive(Debug, Clone, PartialEq)]
struct Paint {
    stroke: Option<String>,
    fill: Option<String>,
}

fn parse_drawing(svg: &str) -> Drawing {
    let document = roxmltree::Document::parse(svg).expect("well-formed SVG");
    let root = document.root_element();
    let image = Rect { left: 0.0, top: 0.0, right: number(root, "width"), bottom: number(root, "height") };
    let mut seen = Drawing { image, texts: Vec::new(), shapes: Vec::new() };
    for element in root.children().filter(roxmltree::Node::is_element) {
        if element.tag_name().name() == "text" {
            seen.texts.push((element.text().unwrap_or_default().trim().to_owned(), text_box(element)));
        } else {
            let paint = |name| element.attribute(name).filter(|paint| *paint != "none").map(str::to_owned);
            seen.shapes.push((Paint { stroke: paint("stroke"), fill: paint("fill") }, shape_box(element)));
        }
    }
    seen
}

fn number(element: roxmltree::Node, name: &str) -> f64 {
    let text = element.attribute(name).unwrap_or_else(|| panic!("{element:?} has no {name}"));
    text.parse().unwrap_or_else(|_| panic!("{name} of {element:?} is not a number"))
}

fn text_box(element: roxmltree::Node) -> Rect {
    let [x, y, size] = ["x", "y", "font-size"].map(|name| number(element, name));
    let width = text::width(element.text().unwrap_or_default().trim(), size);
    let left = match element.attribute("text-anchor") {
        Some("start") => x,
        Some("middle") => x - 0.5 * width,
        Some("end") => x - width,
        other => panic!("a text is anchored at its {other:?}"),
    };
    // Ascent and descent of Noto Sans, above and below the baseline.
    Rect { left, right: left + width, top: y - 1.07 * size, bottom: y + 0.29 * size }
}

fn shape_box(element: roxmltree::Node) -> Rect {
    let of = |name| number(element, name);
    match element.tag_name().name() {
        "rect" => {
            Rect { left: of("x"), top: of("y"), right: of("x") + of("width"), bottom: of("y") + of("height") }
        }
        "circle" => bounding_box(&[(of("cx"), of("cy"))], of("r")),
        "polygon" => bounding_box(&points(element), 0.0),
        "polyline" => bounding_box(&points(element), 0.5 * of("stroke-width")),
        other => panic!("no drawing holds a {other}"),
    }
}

fn points(element: roxmltree::Node) -> Vec<(f64, f64)> {
    let point = |point: &str| {
        let (x, y) = point.split_once(',').expect("two coordinates");
        (x.parse().expect("a number"), y.parse().expect("a number"))
    };
    element.attribute("points").expect("points").split(' ').map(point).collect()
}

fn bounding_box(points: &[(f64, f64)], margin: f64) -> Rect {
    let least = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).fold(f64::INFINITY, f64::min) - margin;
    let most = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).fold(f64::NEG_INFINITY, f64::max) + margin;
    Rect { left: least(|at| at.0), right: most(|at| at.0), top: least(|at| at.1), bottom: most(|at| at.1) }
}

fn overlap(a: &Rect, b: &Rect) -> bool {
    let across = a.right.min(b.right) - a.left.max(b.left);
    let down = a.bottom.min(b.bottom) - a.top.max(b.top);
    across > 0.1 && down > 0.1
}

fn inside(inner: &Rect, outer: &Rect) -> bool {
    outer.contains((inner.left, inner.top)) && outer.contains((inner.right, inner.bottom))
}

impl Drawing {
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
