//! Invalid plates and sensors.

use super::*;

fn sound() -> PlateSpec {
    steel(0.3, 0.2, Edges::all(Edge::Simple), 48)
}

fn on_points(points: &[(f64, f64)]) -> PlateSpec {
    let supports = points.iter().map(|(x_m, y_m)| simple_at(*x_m, *y_m)).collect();
    PlateSpec { supports, edges: Edges::all(Edge::Free), ..sound() }
}

#[test]
fn uncomputable_plate_is_refused_with_value_and_bound() {
    let one_edge = Edges { bottom: Edge::Simple, ..Edges::all(Edge::Free) };
    let refused = [
        PlateSpec { thickness_m: 0.0, ..sound() },
        PlateSpec { length_m: f64::INFINITY, ..sound() },
        PlateSpec { width_m: -0.2, ..sound() },
        PlateSpec { youngs_modulus_pa: f64::NAN, ..sound() },
        PlateSpec { thickness_m: 1e-200, ..sound() },
        PlateSpec { poissons_ratio: -1.0, ..sound() },
        PlateSpec { poissons_ratio: 0.51, ..sound() },
        PlateSpec { poissons_ratio: f64::NAN, ..sound() },
        PlateSpec { elements: 3, ..sound() },
        PlateSpec { elements: usize::MAX, ..sound() },
        PlateSpec { elements: 2000, ..sound() },
        on_points(&[]),
        on_points(&[(0.1, 0.15)]),
        on_points(&[(0.1, 0.15), (0.2, 0.05)]),
        on_points(&[(0.1, 0.05), (0.2, 0.1), (0.3, 0.15)]),
        PlateSpec { edges: one_edge, ..sound() },
        on_points(&[(0.1, 0.05), (0.31, 0.1), (0.3, 0.15)]),
        on_points(&[(0.1, 0.05), (0.2, 0.1), (0.1, 0.05)]),
        on_points(&[(0.1, 0.05), (0.2, 0.1), (0.104, 0.05)]),
        PlateSpec { edges: one_edge, ..on_points(&[(0.1, 0.05), (0.2, 0.0)]) },
        PlateSpec { supports: vec![elastic_at(0.1, 0.1, 0.0)], ..sound() },
        PlateSpec { supports: vec![elastic_at(0.1, 0.1, f64::NAN)], ..sound() },
        PlateSpec { supports: vec![simple_at(f64::NAN, 0.1)], ..sound() },
    ];
    let messages = refused.map(|spec| Plate::new(spec).unwrap_err().to_string());
    insta::assert_snapshot!(messages.join("\n"));
    assert!(Plate::new(sound()).is_ok());
    assert!(Plate::new(PlateSpec { edges: one_edge, ..on_points(&[(0.1, 0.05)]) }).is_ok());
}

#[test]
fn insensitive_sensor_is_refused() {
    let edges = Edges { left: Edge::Simple, right: Edge::Free, bottom: Edge::Clamped, top: Edge::Simple };
    let spec =
        PlateSpec { edges, supports: vec![simple_at(0.2, 0.1), elastic_at(0.25, 0.1, 1e3)], ..sound() };
    let plate = Plate::new(spec).unwrap();
    let places = [
        ("left", at(0.0, 0.1)),
        ("right", at(0.3, 0.1)),
        ("bottom", at(0.1, 0.0)),
        ("top", at(0.1, 0.2)),
        ("right-hand end of the bottom", at(0.3, 0.0)),
        ("middle", at(0.15, 0.1)),
        ("simple support", at(0.2, 0.1)),
        ("elastic support", at(0.25, 0.1)),
    ];
    let mut table = String::new();
    for kind in [SensorKind::Deflection, SensorKind::Slope, SensorKind::Strain, SensorKind::Reaction] {
        for (name, place) in places {
            let answer =
                plate.insensitive_sensor(kind, place).map_or("reads".to_owned(), |why| why.to_string());
            table += &format!("{kind}, {name}: {answer}\n");
            // A refused sensor reads 0, and an accepted one does not.
            let largest = [at(0.11, 0.07), at(0.22, 0.13), at(0.28, 0.18)]
                .map(|contact| plate.influence(kind, place, contact).abs())
                .into_iter()
                .fold(0.0, f64::max);
            let natural = kind == SensorKind::Strain && name == "left";
            let share = largest / plate.full_scale(kind);
            assert!(
                kind == SensorKind::Reaction || natural || (answer == "reads") == (share > 1e-9),
                "{kind}, {name}: {share:e}"
            );
        }
    }
    insta::assert_snapshot!(table);
}
