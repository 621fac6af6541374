//! Tests of the drawing of a beam.

use super::{Drawing, parse_drawing};
use crate::beam_drawing::BeamDrawing;
use palpate_mechanics::surface::BeamSupportKind;

const BLUE: &str = "#0072b2";
const GREEN: &str = "#009e73";

const SPRING: BeamSupportKind =
    BeamSupportKind::Elastic { stiffness_n_per_m: 1e3, rotational_stiffness_nm_per_rad: None };

fn beam(sensors: usize, load_mm: f64, width_px: u32) -> BeamDrawing {
    let length_mm = 400.0;
    let wave = |x: f64| -3.47 * (std::f64::consts::PI * x / length_mm).sin();
    BeamDrawing {
        length_mm,
        supports: [0.0, length_mm].map(|at_mm| (at_mm, BeamSupportKind::Simple)).to_vec(),
        steps: Vec::new(),
        sensors_mm: (1..=sensors).map(|i| i as f64 * length_mm / (sensors + 1) as f64).collect(),
        load_mm,
        load_label: "3 N".into(),
        deflection_mm: (0..=200).map(|i| f64::from(i) * 2.0).map(|x| (x, wave(x))).collect(),
        width_px,
    }
}

fn parse_beam_drawing(drawing: &BeamDrawing) -> Drawing {
    parse_drawing(&drawing.svg())
}

fn cases() -> Vec<(String, BeamDrawing)> {
    let mut cases = Vec::new();
    for sensors in [0, 1, 2, 8, 13, 20] {
        for load_mm in [0.0, 1.0, 133.0, 200.0, 399.0, 400.0] {
            for width_px in [320, 480, 720] {
                let name = format!("{sensors} sensors, load at {load_mm} mm, {width_px} px");
                cases.push((name, beam(sensors, load_mm, width_px)));
            }
        }
    }
    let base = || beam(8, 390.0, 720);
    let scaled =
        |factor: f64| base().deflection_mm.into_iter().map(|(x, y)| (x, factor * y)).collect::<Vec<_>>();
    let special = [
        (
            "a cluster of sensors",
            BeamDrawing { sensors_mm: vec![100.0, 100.0, 101.0, 102.0, 399.0, 400.0, 0.0], ..base() },
        ),
        (
            "a long force label",
            BeamDrawing { load_label: "a force of 3 N & more, < 5 N, ".repeat(9), ..base() },
        ),
        ("no deflection", BeamDrawing { deflection_mm: vec![], ..base() }),
        ("zero deflection", BeamDrawing { deflection_mm: scaled(0.0), ..base() }),
        ("upward", BeamDrawing { deflection_mm: scaled(-1.0), ..base() }),
        ("metres", BeamDrawing { deflection_mm: scaled(1000.0), ..base() }),
        ("micrometres", BeamDrawing { deflection_mm: scaled(1e-4), ..base() }),
        (
            "every support, and steps",
            BeamDrawing {
                supports: vec![
                    (0.0, BeamSupportKind::Clamped),
                    (100.0, BeamSupportKind::Guided),
                    (200.0, SPRING),
                    (300.0, BeamSupportKind::Clamped),
                    (400.0, BeamSupportKind::Guided),
                ],
                steps: vec![(150.0, 2.0), (300.0, 0.1), (400.0, 1.0)],
                ..base()
            },
        ),
        (
            "deepest at the end",
            BeamDrawing { deflection_mm: vec![(0.0, 0.0), (200.0, -1.0), (400.0, -5.0)], ..base() },
        ),
    ];
    cases.extend(special.into_iter().map(|(name, drawing)| (name.to_owned(), drawing)));
    for length_mm in [0.004, 12_345.678] {
        let shape = vec![(0.0, 0.0), (length_mm / 2.0, -length_mm / 100.0), (length_mm, 0.0)];
        let drawing = BeamDrawing {
            length_mm,
            load_mm: 0.0,
            supports: vec![],
            sensors_mm: vec![length_mm],
            deflection_mm: shape,
            ..base()
        };
        cases.push((format!("{length_mm} mm long"), drawing));
    }
    cases
}

#[test]
fn texts_lie_inside_the_image_and_apart() {
    for (case, drawing) in cases() {
        let seen = parse_beam_drawing(&drawing);
        seen.assert_texts_inside(&case);
        seen.assert_texts_apart(&case);
    }
}

#[test]
fn lines_and_shapes_lie_inside_the_image() {
    for (case, drawing) in cases() {
        let seen = parse_beam_drawing(&drawing);
        for (paint, area) in &seen.shapes {
            assert!(super::inside(area, &seen.image), "{case}: {paint:?} at {area:?}");
        }
    }
}

#[test]
fn every_sensor_has_a_probe_and_its_number() {
    for (case, drawing) in cases() {
        let seen = parse_beam_drawing(&drawing);
        assert_eq!(seen.fills(GREEN).count(), drawing.sensors_mm.len(), "{case}");
        for number in 1..=drawing.sensors_mm.len() {
            assert!(seen.has_text(&number.to_string()), "{case}: no number {number}");
        }
    }
}

#[test]
fn length_force_and_deflection_are_stated() {
    let seen = parse_beam_drawing(&beam(8, 100.0, 720));
    for text in ["400 mm", "3 N", "3.47 mm"] {
        assert!(seen.has_text(text), "{text:?} is missing from {:?}", seen.texts);
    }
}

#[test]
fn the_deflection_is_drawn_as_many_times_larger_as_stated() {
    for factor in [1e-3, 0.1, 0.3, 1.0, 7.0, 100.0] {
        let mut drawing = beam(8, 100.0, 720);
        drawing.deflection_mm.iter_mut().for_each(|point| point.1 *= factor);
        let seen = parse_beam_drawing(&drawing);
        let shape =
            seen.strokes(BLUE).max_by(|a, b| a.width().total_cmp(&b.width())).expect("the deflected shape");
        let stroke = 2.5;
        let px_per_mm = (shape.width() - stroke) / drawing.length_mm;
        let drawn = (shape.height() - stroke) / (3.47 * factor * px_per_mm);
        let remark = seen
            .texts
            .iter()
            .find_map(|(text, _)| text.strip_prefix("deflection drawn "))
            .expect("the remark");
        let stated: f64 = remark.trim_end_matches(" ×").replace(',', "").parse().expect("a number");
        assert!((drawn / stated - 1.0).abs() < 0.03, "drawn {drawn}, stated {stated}");
        assert!(shape.height() > 30.0, "{} px cannot be seen", shape.height());
    }
}

#[test]
fn the_load_points_at_its_position() {
    for (load_mm, expected) in [(0.0, 40.0), (100.0, 200.0), (400.0, 680.0)] {
        let seen = parse_beam_drawing(&beam(8, load_mm, 720));
        let arrow = seen.strokes("#d55e00").next().expect("an arrow");
        assert!((arrow.left.midpoint(arrow.right) - expected).abs() < 0.2, "{arrow:?}");
    }
}

#[test]
fn rounding_errors_beyond_an_end_are_drawn_at_the_end() {
    let beyond = BeamDrawing { sensors_mm: vec![-1e-9, 400.0 + 1e-9], ..beam(0, 400.0 + 1e-9, 720) };
    let at_ends = BeamDrawing { sensors_mm: vec![0.0, 400.0], ..beam(0, 400.0, 720) };
    assert_eq!(beyond.svg(), at_ends.svg());
}
