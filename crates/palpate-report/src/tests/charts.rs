//! Tests of charts, also with extreme data.

use super::{Drawing, overlap, parse_drawing};
use crate::drawing::layout::Layout;
use crate::*;
use proptest::prelude::*;

const BLUE: &str = "#0072b2";
const LONG: &str = "an arm with a long name, such as normalized output, six training positions in the middle";

fn line(points: &[(f64, f64)]) -> SeriesKind {
    SeriesKind::Line { points: points.to_vec(), stroke: Stroke::Solid }
}

fn series(label: &str, colour: usize, kind: SeriesKind) -> Series {
    Series { label: label.into(), colour, kind }
}

fn one_line(points: &[(f64, f64)]) -> Chart {
    Chart {
        title: "Error".into(),
        x: Axis::linear("load position, mm"),
        y: Axis::linear("error, mm"),
        series: vec![series("median", 0, line(points))],
        ..Chart::default()
    }
}

fn log_line(points: &[(f64, f64)]) -> Chart {
    Chart { y: Axis::log10("error, mm"), ..one_line(points) }
}

fn everything(labels: [&str; 6]) -> Chart {
    let xs = [10.0, 20.0, 30.0];
    let band = xs.map(|x| BandPoint { x, low: 0.1 * x, high: x }).to_vec();
    let bars = xs.map(|x| ErrorPoint { x, y: 0.6 * x, low: 0.3 * x, high: 0.9 * x }).to_vec();
    let points = xs.map(|x| (x, 0.5 * x)).to_vec();
    let dashed = SeriesKind::Line { points: points.clone(), stroke: Stroke::Dashed };
    let kinds = [
        SeriesKind::Band { points: band },
        line(&points),
        dashed,
        SeriesKind::Points { points: points.clone(), marker: Marker::Cross },
        SeriesKind::Points { points, marker: Marker::Triangle },
        SeriesKind::ErrorBars { points: bars, marker: Marker::Square },
    ];
    Chart {
        title: labels[0].into(),
        x: Axis::linear(labels[1]),
        y: Axis::linear(labels[2]),
        series: labels
            .iter()
            .zip(kinds)
            .enumerate()
            .map(|(i, (label, kind))| series(label, i, kind))
            .collect(),
        marks: vec![
            Mark::Span { low: 12.0, high: 25.0, label: labels[3].into() },
            Mark::VerticalLine { x: 13.0, label: labels[4].into() },
            Mark::HorizontalLine { y: 7.0, label: labels[5].into() },
        ],
        ..Chart::default()
    }
}

pub(super) fn awkward() -> Vec<(&'static str, Chart)> {
    let tiny = |chart: Chart| Chart { width_px: 1, height_px: 1, ..chart };
    let wide = f64::MAX;
    vec![
        ("nothing at all", Chart::default()),
        (
            "nothing on logarithmic axes",
            Chart { x: Axis::log10("x"), y: Axis::log10("y"), ..Chart::default() },
        ),
        ("an empty series", one_line(&[])),
        ("a single point", one_line(&[(200.0, 3.0)])),
        ("a single zero", one_line(&[(0.0, 0.0)])),
        (
            "NaN and infinities",
            one_line(&[(1.0, 2.0), (2.0, f64::NAN), (f64::INFINITY, 3.0), (4.0, 5.0), (5.0, 1.0)]),
        ),
        ("nothing finite", one_line(&[(f64::NAN, 1.0), (1.0, f64::NEG_INFINITY)])),
        ("all y equal", one_line(&[(0.0, 5.0), (400.0, 5.0)])),
        ("a huge range", one_line(&[(-1e300, -1e300), (1e300, 1e300), (wide, wide)])),
        ("a tiny range", one_line(&[(0.0, 1e-310), (1e-310, 0.0)])),
        ("far from zero", one_line(&[(1e9, 1e12), (1e9 + 1.0, 1e12 + 3.0)])),
        ("logarithmic with zeros", log_line(&[(1.0, 0.0), (2.0, 10.0), (3.0, -5.0), (4.0, 1000.0)])),
        ("logarithmic over 600 decades", log_line(&[(1.0, 1e-300), (2.0, 1e300)])),
        ("logarithmic within a decade", log_line(&[(1.0, 3.1), (2.0, 4.2)])),
        (
            "a range that spans nothing",
            Chart { x: Axis::linear("x").from_to(3.0, 3.0), ..one_line(&[(1.0, 1.0)]) },
        ),
        (
            "a range without numbers",
            Chart { y: Axis::log10("y").from_to(0.0, f64::NAN), ..one_line(&[(1.0, 1.0)]) },
        ),
        (
            "crowded ticks",
            Chart {
                x: Axis::linear("x").ticks_at([1.0, 1.01, 1.02, 2.0, f64::NAN]),
                ..one_line(&[(1.0, 1.0), (9.0, 2.0)])
            },
        ),
        ("six long labels", everything([LONG; 6])),
        ("six long labels, tiny", tiny(everything([LONG; 6]))),
        (
            "markup in labels",
            everything(["a < b", "b > c & d", "\"quoted\" 'text'", "<svg>", "&amp;", "]]>"]),
        ),
        (
            "control characters in labels",
            everything(["a\u{0}b", "\u{1b}[0m", "line\nbreak", "\t", "\u{fffe}", ""]),
        ),
        (
            "wide characters",
            everything(["误差误差误差", "WWWWWWWWWWW", "mmmmmmmmmm", "ÄÖÜ", "µ ≤ 2 × 3 − 1 ± 4", "ßß"]),
        ),
        (
            "forty series",
            Chart {
                series: (0..40).map(|i| series(LONG, i, line(&[(0.0, 1.0)]))).collect(),
                ..Chart::default()
            },
        ),
    ]
}

fn seen_all() -> impl Iterator<Item = (&'static str, Drawing)> {
    awkward().into_iter().map(|(case, chart)| (case, parse_drawing(&chart_to_svg(&chart))))
}

#[test]
fn every_text_lies_inside_the_image() {
    seen_all().for_each(|(case, seen)| seen.assert_texts_inside(case));
}

#[test]
fn no_two_texts_overlap() {
    seen_all().for_each(|(case, seen)| seen.assert_texts_apart(case));
}

#[test]
fn every_line_and_shape_lies_inside_the_image() {
    for (case, seen) in seen_all() {
        for (paint, area) in &seen.shapes {
            assert!(super::inside(area, &seen.image), "{case}: {paint:?} at {area:?}");
        }
    }
}

#[test]
fn legend_and_texts_lie_outside_the_plot() {
    for (case, chart) in awkward() {
        let layout = Layout::new(&chart);
        let plot = layout.plot;
        assert!(plot.height() >= 60.0 && plot.width() >= 150.0, "{case}: no room for data in {plot:?}");
        for entry in &layout.legend.entries {
            assert!(!overlap(&entry.area, &plot), "{case}: legend {:?} over plot {plot:?}", entry.area);
        }
        for (text, area) in parse_drawing(&chart_to_svg(&chart)).texts {
            assert!(!overlap(&area, &plot), "{case}: {text:?} {area:?} over plot {plot:?}");
        }
    }
}

#[test]
fn legend_names_each_series_once_or_counts_the_missing() {
    for (case, chart) in awkward() {
        let layout = Layout::new(&chart);
        let named = chart.series.iter().filter(|series| !series.label.trim().is_empty()).count();
        let lines = chart
            .marks
            .iter()
            .filter(|mark| matches!(mark, Mark::HorizontalLine { label, .. } if !label.trim().is_empty()));
        let missing = named + lines.count() - layout.legend.entries.len();
        let remark = layout.legend.remainder.map(|label| label.text);
        assert_eq!(remark, (missing > 0).then(|| format!("and {missing} more")), "{case}");
    }
    let high = Chart { height_px: 480, ..everything([LONG; 6]) };
    assert_eq!(Layout::new(&high).legend.entries.len(), 7);
}

#[test]
fn labels_are_shown_letter_by_letter() {
    let seen = parse_drawing(&chart_to_svg(&everything([
        "a < b",
        "b > c & d",
        "\"q\" 'r'",
        "<svg>",
        "&amp;",
        "]]>",
    ])));
    for text in ["a < b", "b > c & d", "\"q\" 'r'", "<svg>", "&amp;", "]]>"] {
        assert!(seen.has_text(text), "{text:?} is missing from {:?}", seen.texts);
    }
}

#[test]
fn both_axes_of_every_chart_can_be_read() {
    for (case, chart) in awkward() {
        let layout = Layout::new(&chart);
        assert!(layout.x_ticks.len() >= 2, "{case}: {:?} along {:?}", layout.x_ticks, layout.x);
        assert!(layout.y_ticks.len() >= 2, "{case}: {:?} along {:?}", layout.y_ticks, layout.y);
    }
}

/// Strokes in the colour of the first series, without the legend.
fn pieces(chart: &Chart) -> usize {
    parse_drawing(&chart_to_svg(chart)).strokes(BLUE).count() - 1
}

#[test]
fn a_value_that_is_not_finite_breaks_the_line() {
    let whole = [(0.0, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 2.0), (4.0, 1.0)];
    assert_eq!(pieces(&one_line(&whole)), 1);
    for gap in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
        let mut broken = whole;
        broken[2].1 = gap;
        assert_eq!(pieces(&one_line(&broken)), 2, "{gap}");
    }
}

#[test]
fn a_logarithmic_axis_skips_values_that_are_not_positive() {
    let points = vec![(1.0, 10.0), (2.0, 0.0), (3.0, -1.0), (4.0, 100.0)];
    let chart = |y| Chart {
        y,
        series: vec![series("", 0, SeriesKind::Points { points: points.clone(), marker: Marker::Circle })],
        ..Chart::default()
    };
    let discs = |y| parse_drawing(&chart_to_svg(&chart(y))).fills(BLUE).count();
    assert_eq!((discs(Axis::linear("y")), discs(Axis::log10("y"))), (4, 2));
}

#[test]
fn a_bar_down_to_zero_reaches_the_end_of_a_logarithmic_axis() {
    let bar = ErrorPoint { x: 1.0, y: 10.0, low: 0.0, high: 20.0 };
    let chart = Chart {
        y: Axis::log10("y").from_to(1.0, 100.0),
        series: vec![series("", 0, SeriesKind::ErrorBars { points: vec![bar], marker: Marker::Cross })],
        ..Chart::default()
    };
    let bottom = Layout::new(&chart).plot.bottom;
    let lowest =
        parse_drawing(&chart_to_svg(&chart)).strokes(BLUE).map(|area| area.bottom).fold(0.0, f64::max);
    assert!((lowest - bottom).abs() < 1.5, "{lowest} against {bottom}");
}

#[test]
fn data_outside_a_fixed_range_are_cut_off_at_the_plot() {
    let far = [(-500.0, -900.0), (900.0, 1300.0)];
    let fixed = |chart: Chart| Chart {
        x: Axis::linear("x").from_to(0.0, 400.0),
        y: Axis::linear("y").from_to(0.0, 500.0),
        ..chart
    };
    let bands = far.map(|(x, y)| BandPoint { x, low: y - 100.0, high: y + 100.0 }).to_vec();
    for kind in [line(&far), SeriesKind::Band { points: bands }] {
        let chart = fixed(Chart { series: vec![series("", 0, kind)], ..Chart::default() });
        let plot = Layout::new(&chart).plot;
        let seen = parse_drawing(&chart_to_svg(&chart));
        let drawn: Vec<_> = seen.strokes(BLUE).chain(seen.fills(BLUE)).collect();
        assert_eq!(drawn.len(), 1);
        for area in drawn {
            assert!(area.left > plot.left - 2.0 && area.right < plot.right + 2.0, "{area:?} {plot:?}");
            assert!(area.top > plot.top - 2.0 && area.bottom < plot.bottom + 2.0, "{area:?} {plot:?}");
        }
    }
}

#[test]
fn data_lie_where_the_axes_say() {
    let chart = Chart {
        x: Axis::linear("x").from_to(0.0, 400.0),
        y: Axis::log10("y").from_to(1.0, 10_000.0),
        series: vec![series(
            "",
            0,
            SeriesKind::Points { points: vec![(100.0, 1000.0)], marker: Marker::Circle },
        )],
        ..Chart::default()
    };
    let plot = Layout::new(&chart).plot;
    let seen = parse_drawing(&chart_to_svg(&chart));
    let disc = seen.fills(BLUE).next().expect("a disc");
    let (x, y) = (disc.left.midpoint(disc.right), disc.top.midpoint(disc.bottom));
    assert!((x - (plot.left + 0.25 * plot.width())).abs() < 0.2, "{x}");
    assert!((y - (plot.bottom - 0.75 * plot.height())).abs() < 0.2, "{y}");
}

#[test]
fn the_same_chart_gives_the_same_text() {
    let chart = everything([LONG; 6]);
    assert_eq!(chart_to_svg(&chart), chart_to_svg(&chart));
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![-500.0..500.0, proptest::num::f64::ANY]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_data_can_be_drawn(
        points in proptest::collection::vec((any_number(), any_number()), 0..12),
        ends in (any_number(), any_number()),
        log in any::<bool>(),
        label in "\\PC{0,40}",
    ) {
        let axis = if log { Axis::log10("y") } else { Axis::linear("y") };
        let bars = points.iter().map(|&(x, y)| ErrorPoint { x, y, low: y - x, high: y * x }).collect();
        let band = points.iter().map(|&(x, y)| BandPoint { x, low: y - x, high: y * x }).collect();
        let chart = Chart {
            title: label.clone(),
            x: axis.clone().from_to(ends.0, ends.1),
            y: axis,
            series: vec![
                series(&label, 0, SeriesKind::Band { points: band }),
                series("line", 1, line(&points)),
                series("bars", 2, SeriesKind::ErrorBars { points: bars, marker: Marker::Circle }),
            ],
            marks: vec![Mark::VerticalLine { x: ends.0, label: label.clone() }],
            ..Chart::default()
        };
        let seen = parse_drawing(&chart_to_svg(&chart));
        seen.assert_texts_inside("any");
        seen.assert_texts_apart("any");
    }
}
