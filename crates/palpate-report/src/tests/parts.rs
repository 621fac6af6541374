//! Tests of the layout of a chart.

use crate::Axis;
use crate::drawing::axis::{AxisScale, Tick, choose_ticks, minor_ticks};
use crate::drawing::geometry::Rect;
use crate::drawing::{svg, text};
use proptest::prelude::*;

fn labels(ticks: &[Tick]) -> Vec<&str> {
    ticks.iter().map(|tick| tick.label.as_str()).collect()
}

fn up_to(most: usize) -> impl Fn(&[Tick]) -> bool {
    move |ticks| ticks.len() <= most.max(1)
}

fn tick_labels(axis: &Axis, most: usize) -> Vec<String> {
    let scale = AxisScale::new(axis, &[]);
    labels(&choose_ticks(&scale, axis.ticks.as_deref(), &up_to(most)))
        .into_iter()
        .map(str::to_owned)
        .collect()
}

#[test]
fn linear_ticks_are_round_numbers() {
    let of = |low, high, most| tick_labels(&Axis::linear("").from_to(low, high), most);
    assert_eq!(of(0.0, 400.0, 6), ["0", "100", "200", "300", "400"]);
    assert_eq!(of(1.0, 399.0, 8), ["50", "100", "150", "200", "250", "300", "350"]);
    assert_eq!(of(-0.2, 0.2, 6), ["−0.2", "−0.1", "0", "0.1", "0.2"]);
    assert_eq!(of(0.0, 40_000.0, 5), ["0", "10,000", "20,000", "30,000", "40,000"]);
    assert_eq!(of(0.0, 2e9, 5), ["0", "5e8", "1e9", "1.5e9", "2e9"]);
    assert_eq!(of(400.0, 0.0, 3), ["0", "200", "400"]);
}

#[test]
fn logarithmic_ticks_are_decades_or_fill_a_short_axis() {
    let of = |low, high, most| tick_labels(&Axis::log10("").from_to(low, high), most);
    assert_eq!(of(900.0, 400_000.0, 8), ["1,000", "10,000", "100,000"]);
    assert_eq!(of(0.01, 10.0, 8), ["0.01", "0.1", "1", "10"]);
    assert_eq!(of(4.0, 60.0, 8), ["5", "10", "20", "50"]);
    assert_eq!(of(3.0, 4.0, 3), ["3.0", "3.5", "4.0"]);
    assert_eq!(of(1e-12, 1e12, 5), ["1e−10", "0.00001", "1", "100,000", "1e10"]);
}

#[test]
fn ticks_stand_at_the_values_that_were_asked_for() {
    let axis = Axis::linear("").from_to(0.0, 35.0).ticks_at([30.0, 10.0, 20.0, 20.0, 90.0, f64::NAN]);
    assert_eq!(tick_labels(&axis, 9), ["10", "20", "30"]);
    assert_eq!(
        tick_labels(&Axis::linear("").from_to(0.0, 1.0).ticks_at([0.125, 1.0 / 3.0]), 9),
        ["0.125", "0.333333"]
    );
}

#[test]
fn only_successive_decades_have_minor_lines() {
    let minor = |low, high, most| {
        let scale = AxisScale::new(&Axis::log10("").from_to(low, high), &[]);
        minor_ticks(&scale, &choose_ticks(&scale, None, &up_to(most)))
    };
    assert_eq!(minor(1.0, 1000.0, 8).len(), 24);
    assert_eq!(minor(1.0, 100.0, 8).len(), 0);
    assert_eq!(minor(1e-12, 1e12, 5).len(), 0);
}

#[test]
fn automatic_range_holds_the_data_and_is_not_padded_across_zero() {
    let ends = |values: &[f64]| {
        let scale = AxisScale::new(&Axis::linear(""), values);
        (scale.low, scale.high)
    };
    assert_eq!(ends(&[0.0, 100.0]), (0.0, 105.0));
    assert_eq!(ends(&[-100.0, 0.0]), (-105.0, 0.0));
    assert_eq!(ends(&[5.0, 5.0]), (4.5, 5.5));
    assert_eq!(ends(&[f64::NAN]), (0.0, 1.0));
}

proptest! {
    #[test]
    fn automatic_range_shows_every_value(a in -1e9..1e9_f64, b in -1e9..1e9_f64, log in any::<bool>()) {
        let axis = if log { Axis::log10("") } else { Axis::linear("") };
        let values = if log { [a.abs() + 1e-6, b.abs() + 1e-6] } else { [a, b] };
        let scale = AxisScale::new(&axis, &values);
        for value in values {
            prop_assert!((0.0..=1.0).contains(&scale.share(value).unwrap()), "{value} on {scale:?}");
        }
    }

    #[test]
    fn a_clipped_line_stays_inside_and_on_the_line(ends in proptest::array::uniform4(-50.0..50.0_f64)) {
        let rect = Rect { left: -10.0, right: 20.0, top: -5.0, bottom: 15.0 };
        let (start, end) = ((ends[0], ends[1]), (ends[2], ends[3]));
        let slack = Rect { left: -10.001, right: 20.001, top: -5.001, bottom: 15.001 };
        let pieces = rect.clip_line(&[start, end]);
        for &(x, y) in pieces.iter().flatten() {
            prop_assert!(slack.contains((x, y)));
            let aside = (end.0 - start.0) * (y - start.1) - (end.1 - start.1) * (x - start.0);
            prop_assert!(aside.abs() < 1e-6);
        }
        let middles = (0..=100).map(|i| f64::from(i) / 100.0).map(|t| {
            (start.0 + t * (end.0 - start.0), start.1 + t * (end.1 - start.1))
        });
        prop_assert_eq!(pieces.is_empty() && middles.into_iter().any(|point| rect.contains(point)), false);
    }
}

#[test]
fn a_line_that_leaves_and_returns_is_two_pieces() {
    let rect = Rect { left: 0.0, right: 10.0, top: 0.0, bottom: 10.0 };
    let pieces = rect.clip_line(&[(1.0, 5.0), (5.0, 5.0), (5.0, 20.0), (7.0, 20.0), (7.0, 5.0)]);
    assert_eq!(pieces, [vec![(1.0, 5.0), (5.0, 5.0), (5.0, 10.0)], vec![(7.0, 10.0), (7.0, 5.0)]]);
}

#[test]
fn a_clipped_polygon_keeps_the_common_area() {
    let rect = Rect { left: 0.0, right: 10.0, top: 0.0, bottom: 10.0 };
    let area = |points: &[(f64, f64)]| {
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>().abs() / 2.0
    };
    let half_over = [(5.0, 2.0), (15.0, 2.0), (15.0, 4.0), (5.0, 4.0)];
    assert_eq!(area(&rect.clip_polygon(&half_over)), 10.0);
    let around = [(-5.0, -5.0), (15.0, -5.0), (15.0, 15.0), (-5.0, 15.0)];
    assert_eq!(area(&rect.clip_polygon(&around)), 100.0);
    assert_eq!(rect.clip_polygon(&[(20.0, 1.0), (30.0, 1.0), (25.0, 5.0)]), []);
}

#[test]
fn a_fitted_text_is_no_wider_than_its_room() {
    let long = "effective length, % of the length of the beam";
    assert_eq!(text::fit(long, 12.0, 1000.0), long);
    for room in [20.0, 50.0, 120.0] {
        let fitted = text::fit(long, 12.0, room);
        assert!(text::width(&fitted, 12.0) <= room && fitted.ends_with('…'), "{fitted:?}");
    }
    let lines = text::wrap(long, 12.0, 120.0, 2);
    assert_eq!(lines.len(), 2);
    assert!(lines.iter().all(|line| text::width(line, 12.0) <= 120.0), "{lines:?}");
    assert!(lines[1].ends_with('…'));
    assert_eq!(text::wrap(long, 12.0, 1000.0, 2), [long]);
    assert!(text::wrap("  ", 12.0, 100.0, 2).is_empty());
}

#[test]
fn colours_of_the_palette_differ_and_start_over() {
    for index in 0..7 {
        assert!((0..index).all(|other| svg::palette(other) != svg::palette(index)));
        assert_eq!(svg::palette(index), svg::palette(index + 7));
    }
}
