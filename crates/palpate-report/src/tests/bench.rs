//! Properties of the bench drawing.

use super::super::*;
use super::{Seen, see};

const BLUE: &str = "#0072b2";
const GREEN: &str = "#009e73";

/// A simply supported beam of 400 mm whose deflection is a half wave, deepest in the middle.
fn bench(sensors: usize, load_mm: f64, width_px: u32) -> BenchDrawing {
    let length_mm = 400.0;
    let wave = |x: f64| -3.47 * (std::f64::consts::PI * x / length_mm).sin();
    BenchDrawing {
        length_mm,
        supports: [0.0, length_mm]
            .map(|position_mm| BenchSupport { position_mm, kind: BenchSupportKind::Simple })
            .to_vec(),
        steps: Vec::new(),
        sensors_mm: (1..=sensors).map(|i| i as f64 * length_mm / (sensors + 1) as f64).collect(),
        load_mm,
        load_label: "3 N".into(),
        deflection_mm: (0..=200).map(|i| f64::from(i) * 2.0).map(|x| (x, wave(x))).collect(),
        width_px,
    }
}

fn seen(bench: &BenchDrawing) -> Seen {
    see(&bench_to_svg(bench).expect("a bench that can be drawn"))
}

fn cases() -> Vec<(String, BenchDrawing)> {
    let mut cases = Vec::new();
    for sensors in [0, 1, 2, 8, 13, 20] {
        for load_mm in [0.0, 1.0, 133.0, 200.0, 399.0, 400.0] {
            for width_px in [320, 480, 720] {
                let name = format!("{sensors} sensors, load at {load_mm} mm, {width_px} px");
                cases.push((name, bench(sensors, load_mm, width_px)));
            }
        }
    }
    let base = || bench(8, 390.0, 720);
    let scaled =
        |factor: f64| base().deflection_mm.into_iter().map(|(x, y)| (x, factor * y)).collect::<Vec<_>>();
    let special = [
        (
            "a cluster of sensors",
            BenchDrawing { sensors_mm: vec![100.0, 100.0, 101.0, 102.0, 399.0, 400.0, 0.0], ..base() },
        ),
        (
            "a long force label",
            BenchDrawing { load_label: "a force of 3 N & more, < 5 N, ".repeat(9), ..base() },
        ),
        ("no deflection", BenchDrawing { deflection_mm: vec![], ..base() }),
        ("zero deflection", BenchDrawing { deflection_mm: scaled(0.0), ..base() }),
        ("upward", BenchDrawing { deflection_mm: scaled(-1.0), ..base() }),
        (
            "a gap",
            BenchDrawing {
                deflection_mm: vec![(0.0, 0.0), (9.0, -1.0), (10.0, f64::NAN), (20.0, -2.0), (30.0, -1.0)],
                ..base()
            },
        ),
        ("metres", BenchDrawing { deflection_mm: scaled(1000.0), ..base() }),
        ("micrometres", BenchDrawing { deflection_mm: scaled(1e-4), ..base() }),
        (
            "every support, and steps",
            BenchDrawing {
                supports: [
                    (0.0, BenchSupportKind::Clamped),
                    (100.0, BenchSupportKind::Guided),
                    (200.0, BenchSupportKind::Elastic),
                    (300.0, BenchSupportKind::Clamped),
                    (400.0, BenchSupportKind::Guided),
                ]
                .map(|(position_mm, kind)| BenchSupport { position_mm, kind })
                .to_vec(),
                steps: [(150.0, 2.0), (300.0, 0.1), (400.0, 1.0)]
                    .map(|(to_mm, thickness_mm)| BenchStep { to_mm, thickness_mm })
                    .to_vec(),
                ..base()
            },
        ),
        (
            "deepest at the end",
            BenchDrawing { deflection_mm: vec![(0.0, 0.0), (200.0, -1.0), (400.0, -5.0)], ..base() },
        ),
    ];
    cases.extend(special.into_iter().map(|(name, bench)| (name.to_owned(), bench)));
    for length_mm in [0.004, 12_345.678] {
        let shape = vec![(0.0, 0.0), (length_mm / 2.0, -length_mm / 100.0), (length_mm, 0.0)];
        let bench = BenchDrawing {
            length_mm,
            load_mm: 0.0,
            supports: vec![],
            sensors_mm: vec![length_mm],
            deflection_mm: shape,
            ..base()
        };
        cases.push((format!("{length_mm} mm long"), bench));
    }
    cases
}

#[test]
fn texts_lie_inside_the_image_and_apart() {
    for (case, bench) in cases() {
        let seen = seen(&bench);
        seen.assert_texts_inside(&case);
        seen.assert_texts_apart(&case);
    }
}

#[test]
fn lines_and_shapes_lie_inside_the_image() {
    for (case, bench) in cases() {
        let seen = seen(&bench);
        for (paint, area) in &seen.shapes {
            assert!(super::inside(area, &seen.image), "{case}: {paint:?} at {area:?}");
        }
    }
}

#[test]
fn every_sensor_has_a_probe_and_its_number() {
    for (case, bench) in cases() {
        let seen = seen(&bench);
        assert_eq!(seen.fills(GREEN).count(), bench.sensors_mm.len(), "{case}");
        for number in 1..=bench.sensors_mm.len() {
            assert!(seen.has_text(&number.to_string()), "{case}: no number {number}");
        }
    }
}

#[test]
fn length_force_and_deflection_are_stated() {
    let seen = seen(&bench(8, 100.0, 720));
    for text in ["400 mm", "3 N", "3.47 mm"] {
        assert!(seen.has_text(text), "{text:?} is missing from {:?}", seen.texts);
    }
}

#[test]
fn the_deflection_is_drawn_as_many_times_larger_as_stated() {
    for factor in [1e-3, 0.1, 0.3, 1.0, 7.0, 100.0] {
        let mut bench = bench(8, 100.0, 720);
        bench.deflection_mm.iter_mut().for_each(|point| point.1 *= factor);
        let seen = seen(&bench);
        let shape =
            seen.strokes(BLUE).max_by(|a, b| a.width().total_cmp(&b.width())).expect("the deflected shape");
        let stroke = 2.5;
        let px_per_mm = (shape.width() - stroke) / bench.length_mm;
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
        let seen = seen(&bench(8, load_mm, 720));
        let arrow = seen.strokes("#d55e00").next().expect("an arrow");
        assert!((arrow.left.midpoint(arrow.right) - expected).abs() < 0.2, "{arrow:?}");
    }
}

#[test]
fn what_is_not_on_the_beam_is_an_error_with_its_value() {
    let error = |bench: BenchDrawing| bench_to_svg(&bench).expect_err("a bench that cannot be drawn");
    let off = |part, position_mm| BenchDrawingError::OffBeam { part, position_mm, length_mm: 400.0 };
    assert_eq!(error(bench(8, 401.0, 720)), off(BenchPart::Load, 401.0));
    assert_eq!(
        error(BenchDrawing { sensors_mm: vec![10.0, -1.0], ..bench(0, 1.0, 720) }),
        off(BenchPart::Sensor, -1.0)
    );
    let support = BenchSupport { position_mm: f64::INFINITY, kind: BenchSupportKind::Clamped };
    assert_eq!(
        error(BenchDrawing { supports: vec![support], ..bench(0, 1.0, 720) }),
        off(BenchPart::Support, f64::INFINITY)
    );
    for length_mm in [0.0, -4.0, f64::INFINITY] {
        assert_eq!(
            error(BenchDrawing { length_mm, ..bench(0, 0.0, 720) }),
            BenchDrawingError::Length { length_mm }
        );
    }
    assert!(matches!(
        error(BenchDrawing { length_mm: f64::NAN, ..bench(0, 0.0, 720) }),
        BenchDrawingError::Length { .. }
    ));
}
