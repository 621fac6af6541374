//! Tests of figures as PNG, and of text sizes in a font.

use super::charts::awkward;
use crate::drawing::svg::{Anchor, INK, Label, Svg};
use crate::drawing::text;
use crate::png::parse;
use crate::{PngError, ReportFile, chart_to_svg, svg_to_png, with_png_copies};
use resvg::usvg;

#[test]
fn every_chart_is_an_image_of_its_size() {
    for (case, chart) in awkward() {
        let png = svg_to_png(&chart_to_svg(&chart), 0.5).expect(case);
        let side = |at: usize| u32::from_be_bytes([png[at], png[at + 1], png[at + 2], png[at + 3]]);
        let expected = (chart.width_px.max(320) / 2, chart.height_px.max(280) / 2);
        assert_eq!((side(16), side(20)), expected, "{case}");
    }
}

#[test]
fn every_figure_is_followed_by_its_copy() {
    let file = |name: &str, text: String| ReportFile { name: name.to_owned(), bytes: text.into_bytes() };
    let svg = Svg::new(320, 240).finish();
    let files = vec![file("report.html", String::new()), file("figure-2.svg", svg)];
    let all = with_png_copies(files).unwrap();
    let names: Vec<&str> = all.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["report.html", "figure-2.svg", "figure-2.png"]);
    assert!(all[2].bytes.starts_with(b"\x89PNG"));
}

#[test]
fn estimated_widths_are_not_below_those_of_the_built_in_font() {
    let texts = [
        "load position, mm",
        "WWW MMM www mmm %%% @@",
        "illicit fjord (tr) [!]",
        "0123456789,.",
        "≤ ± × − µ ° é Ä ß",
    ];
    for content in
        texts.into_iter().chain(["normalized output, n = 30", "EFFECTIVE LENGTH, QUEUE", "a<b>c&d~#+="])
    {
        let label =
            Label { text: content.into(), at: (10.0, 50.0), anchor: Anchor::Start, size: 20.0, colour: INK };
        let mut svg = Svg::new(900, 100);
        svg.text(&label);
        let tree = parse(&svg.finish()).unwrap();
        let Some(usvg::Node::Text(drawn)) = tree.root().children().last() else { panic!("no text") };
        let (real, estimated) = (f64::from(drawn.abs_bounding_box().width()), text::width(content, 20.0));
        assert!(real <= estimated && estimated < 1.7 * real, "{content:?}: {real} against {estimated}");
    }
}

#[test]
fn the_built_in_font_has_the_signs_that_figures_use() {
    for sign in "…−×±≤≥µ°–ÄÖÜäöüßéσλ".chars() {
        let glyph = |text: String| {
            svg_to_png(&format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='40' height='40'><text x='5' y='30' font-size='24' \
             font-family='sans-serif'>{text}</text></svg>"
        ), 1.0).unwrap()
        };
        assert_ne!(glyph(sign.to_string()), glyph("\u{10ffff}".into()), "{sign} is missing");
        assert_ne!(glyph(sign.to_string()), glyph(" ".into()), "{sign} is blank");
    }
}

#[test]
fn invalid_svg_is_an_error() {
    assert!(matches!(svg_to_png("no drawing", 1.0), Err(PngError::Svg(_))));
    let svg = Svg::new(320, 240).finish();
    for scale in [0.0, -1.0, 0.001, 1e6, f32::NAN, f32::INFINITY] {
        assert!(matches!(svg_to_png(&svg, scale), Err(PngError::Size { .. })), "{scale}");
    }
    assert_eq!(parse(&svg).unwrap().size().width(), 320.0);
}
